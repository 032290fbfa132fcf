"""INP text to Deck: includes, keyword lines and rows, checked against the keyword table; all problems at once."""

from __future__ import annotations

from pathlib import Path

from beltsim.console import read_input

from .case import case_problems
from .deck import Block, Deck
from .definitions import drop_repeated
from .errors import Gaps, Mismatch, Problems, Where, listed, nearest, nearest_name
from .keywords import KEYWORDS
from .lexer import RawBlock, clean, raw_blocks, unquoted
from .row_reader import read_rows
from .rules import block_problems, deck_problems
from .schema import Keyword
from .values import parse

STDIN = "<stdin>"


def read(path: str | Path) -> Deck:
    """The deck of a file, "-" for stdin; InpErrors with every problem of the text.

    Holds what any INP file must obey; what only a whole case must (references, steps) is `read_case`'s.
    """
    return _read(*_source(path), case=False)


def read_text(data: bytes | str, name: str = "text", folder: Path = Path()) -> Deck:
    """The deck of a text; `name` stands in messages, included files are looked up in `folder`."""
    return _read(data.encode() if isinstance(data, str) else data, name, Path(folder), case=False)


def read_case(path: str | Path) -> Deck:
    """The deck of a file that is to be run, "-" for stdin; the problems of `read` and `check_case` together."""
    return _read(*_source(path), case=True)


def check_case(deck: Deck) -> None:
    """InpErrors with everything that keeps a deck from being run: references, steps, contact properties."""
    problems, gaps = Problems(), Gaps()
    for block in deck.blocks():
        block_problems(block, problems)
    deck = drop_repeated(deck, problems, gaps)
    deck_problems(deck, problems, gaps)
    case_problems(deck, problems, gaps, Where("deck", 1))
    problems.raise_if_any()


def _source(path: str | Path) -> tuple[bytes, str, Path]:
    if str(path) == "-":
        return read_input("-"), STDIN, Path()
    return read_input(str(path)), str(path), Path(path).parent


def _read(data: bytes, name: str, folder: Path, *, case: bool) -> Deck:
    reading = _Reading()
    reading.text(data, name, folder, [str((folder / Path(name).name).resolve())])
    deck = drop_repeated(Deck(reading.blocks), reading.problems, reading.gaps)
    deck_problems(deck, reading.problems, reading.gaps)
    if case:
        case_problems(deck, reading.problems, reading.gaps, Where(name, 1))
    reading.problems.raise_if_any()
    return deck


class _Reading:
    """What has been read so far."""

    def __init__(self):
        self.blocks: list[Block] = []
        self.problems = Problems()
        self.gaps = Gaps()

    def text(self, data: bytes, file: str, folder: Path, opened: list[str]) -> None:
        """Read one text; `opened` are the files that are being read, this one last."""
        before = len(self.problems)
        data = clean(data, file, self.problems)
        if len(self.problems) > before:
            self.gaps.add(*KEYWORDS)
        for raw in raw_blocks(data, file, self.problems):
            self._block(raw, data, folder, opened)

    def _block(self, raw: RawBlock, data: bytes, folder: Path, opened: list[str]) -> None:
        name = " ".join(raw.fields[0][0][1:].upper().split())
        keyword = KEYWORDS.get(name)
        if keyword is None:
            self.problems.add(
                raw.where, f"the keyword *{name}", f"a keyword of the format{nearest(name, KEYWORDS)}"
            )
            self.gaps.add(nearest_name(name, KEYWORDS) or name)
            return
        before = len(self.problems)
        values = self._parameters(keyword, raw)
        rows, lines = read_rows(keyword, raw, data, self.problems)
        if keyword.name == "INCLUDE":
            self._include(values.get("INPUT"), raw.where, folder, opened)
            return
        block = Block(keyword.name, values, rows, raw.where, folder, lines)
        self.blocks.append(block)
        self._check(block, sound=len(self.problems) == before)

    def _check(self, block: Block, *, sound: bool) -> None:
        before = len(self.problems)
        if sound:
            block_problems(block, self.problems)
        if not sound or len(self.problems) > before:
            self.gaps.content.add(block.keyword)
        if not sound and "NAME" not in block:
            self.gaps.names.add(block.keyword)

    def _parameters(self, keyword: Keyword, raw: RawBlock) -> dict:
        values: dict = {}
        seen: set[str] = set()
        for text, line in raw.fields[1:]:
            try:
                name, value = _parameter(keyword, text)
                if name in seen:
                    raise Mismatch(f"{name} again", "each parameter once")
                seen.add(name)
                values[name] = _value(keyword, name, value)
            except Mismatch as error:
                after_comma = (
                    "; the line before ends in a comma" if line > raw.where.line and "=" not in text else ""
                )
                self.problems.add(Where(raw.where.file, line), error.found, error.expected + after_comma)
        for parameter in keyword.parameters:
            if parameter.required and parameter.name not in seen:
                self.problems.add(raw.where, f"*{keyword.name} without {parameter.name}", parameter.doc)
        return values

    def _include(self, name: str | None, where: Where, folder: Path, opened: list[str]) -> None:
        if name is None:
            self.gaps.add(*KEYWORDS)
            return
        path = folder / name
        target = str(path.resolve())
        if target in opened:
            chain = " -> ".join(Path(file).name for file in [*opened[opened.index(target) :], target])
            self.problems.add(where, f"the cycle {chain}", "included files that do not include one another")
            return
        try:
            data = path.read_bytes()
        except OSError as error:
            self.problems.add(where, f"INPUT={name} ({error.strerror})", "a file that can be read")
            self.gaps.add(*KEYWORDS)
            return
        self.text(data, str(path), path.parent, [*opened, target])


def _parameter(keyword: Keyword, text: str) -> tuple[str, str]:
    """Canonical name and value text of a field `NAME=VALUE`."""
    name, equals, value = text.partition("=")
    name = " ".join(name.upper().split())
    if not equals:
        raise Mismatch(repr(text) if text else "an empty field", "PARAMETER=VALUE")
    known = [parameter.name for parameter in keyword.parameters]
    if name not in known:
        expected = listed(known) + nearest(name, known) if known else "none"
        raise Mismatch(f"the parameter {name} in *{keyword.name}", expected)
    return name, value.strip()


def _value(keyword: Keyword, name: str, text: str):
    try:
        return parse(keyword.parameter(name), unquoted(text))
    except Mismatch as error:
        raise Mismatch(f"{name}={error.found}", error.expected) from None
