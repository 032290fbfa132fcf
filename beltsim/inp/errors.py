"""What is wrong with a text: collected while reading, raised all at once."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
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


@dataclass
class Gaps:
    """What could not be read, so that nothing is called missing or contradicting because of it.

    content : keywords of which some block had a problem;  names : those of which some name or row is unknown
    """

    content: set[str] = field(default_factory=set)
    names: set[str] = field(default_factory=set)

    def add(self, *keywords: str) -> None:
        """Nothing is known for sure about these keywords."""
        self.content.update(keywords)
        self.names.update(keywords)


class Mismatch(ValueError):
    """One thing found where another was expected; the place is added by who knows it."""

    def __init__(self, found: str, expected: str):
        super().__init__(f"found {found}, expected {expected}")
        self.found = found
        self.expected = expected


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

    def add_mismatch(self, where: Where, error: Mismatch) -> None:
        """Note a mismatch at its place."""
        self.add(where, error.found, error.expected)

    def add_rows(self, block, rows, found: Callable[[int], str], expected: str) -> None:
        """Note a problem in each of the `rows` (indices) of a block; `found(i)` says what row i holds."""
        self.add_some(rows, block.row_where, found, expected)

    def add_some(self, rows, where: Callable, found: Callable[[int], str], expected: str) -> None:
        """Note a problem in each of the `rows`, where `where(i)` says; many of one kind are counted only."""
        for i in rows[:MOST_PER_BLOCK]:
            self.add(where(int(i)), found(int(i)), expected)
        if len(rows) > MOST_PER_BLOCK:
            more = len(rows) - MOST_PER_BLOCK
            self.add(
                where(int(rows[MOST_PER_BLOCK])),
                f"{more} more rows like the {MOST_PER_BLOCK} above",
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


def nearest_name(word: str, known: Iterable[str]) -> str | None:
    """The known word nearest to `word`, None if none is near."""
    folded = {name.upper(): name for name in known}
    close = difflib.get_close_matches(word.upper(), folded, n=1, cutoff=0.6)
    return folded[close[0]] if close else None


def nearest(word: str, known: Iterable[str]) -> str:
    """The phrase "; did you mean X?" with the known word nearest to `word`, empty if none is near."""
    close = nearest_name(word, known)
    return f"; did you mean {close}?" if close else ""


def listed(names: Iterable[str], last: str = "or") -> str:
    """Words as an English list: "A, B or C"."""
    names = list(names)
    return "".join(names) if len(names) < 2 else f"{', '.join(names[:-1])} {last} {names[-1]}"
