"""What is wrong with a text: collected while reading, raised all at once."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import NamedTuple

from beltsim.console import CommandError

# A file with a wrong unit may have a million bad rows; the first ones of a block say it all.
MOST_PER_BLOCK = 50


class Where(NamedTuple):
    """A line of a text: file name as a person would type it, line number from 1."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


class Mismatch(ValueError):
    """One thing found where another was expected; the place is added by who knows it."""

    def __init__(self, found: str, expected: str):
        super().__init__(f"found {found}, expected {expected}")


class InpErrors(CommandError):
    """Every problem of a deck, one line each: `file:line: found, expected`."""

    def __init__(self, problems: Iterable[str]):
        self.problems = list(problems)
        super().__init__("\n".join(self.problems))


class Problems:
    """The problems found so far."""

    def __init__(self):
        self._found: list[tuple[Where, str]] = []

    def add(self, where: Where, found: str, expected: str) -> None:
        """Note one problem."""
        self._found.append((where, f"found {found}, expected {expected}"))

    def add_rows(self, block, rows, found, expected: str) -> None:
        """Note a problem in each of the `rows` (indices) of a block; `found(i)` says what row i holds."""
        for i in rows[:MOST_PER_BLOCK]:
            self.add(block.row_where(int(i)), found(int(i)), expected)
        if len(rows) > MOST_PER_BLOCK:
            self.add(
                block.row_where(int(rows[MOST_PER_BLOCK])),
                f"{len(rows) - MOST_PER_BLOCK} more such rows",
                expected,
            )

    def __len__(self) -> int:
        return len(self._found)

    def lines(self) -> list[str]:
        """The messages, by file (in the order they were first named) and line, each once."""
        order = {file: i for i, file in enumerate(dict.fromkeys(where.file for where, _ in self._found))}
        found = sorted(self._found, key=lambda problem: (order[problem[0].file], problem[0].line))
        return list(dict.fromkeys(f"{where}: {text}" for where, text in found))

    def raise_if_any(self) -> None:
        """Raise `InpErrors` with all problems, if there are any."""
        if self._found:
            raise InpErrors(self.lines())


def nearest(word: str, known: Iterable[str]) -> str:
    """The phrase "; did you mean X?" with the known word nearest to `word`, empty if none is near."""
    folded = {name.upper(): name for name in known}
    close = difflib.get_close_matches(word.upper(), folded, n=1, cutoff=0.6)
    return f"; did you mean {folded[close[0]]}?" if close else ""


def listed(names: Iterable[str], last: str = "or") -> str:
    """Words as an English list: "A, B or C"."""
    names = list(names)
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} {last} {names[-1]}"
