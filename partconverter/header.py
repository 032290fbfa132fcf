"""The head of a SAT text: save version, product and unit, and where the records begin."""

from __future__ import annotations

import re
from dataclasses import dataclass

from beltsim.console import CommandError


class SatError(CommandError):
    """Every problem found in a SAT text, one `file:line: found, expected` per line (exit code 3)."""


@dataclass(frozen=True)
class Header:
    """Save version (100 x major + 10 x minor), number of records (0: not told), product and millimetres per unit.

    `unit_mm` is None where the text does not say (before version 2.0, or -1).
    """

    version: int
    records: int
    product: str = ""
    unit_mm: float | None = None


_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_FIRST_LINE = re.compile(r"\s*(\d+)[ \t]+(\d+)[ \t]+(\d+)[ \t]+(\d+)[ \t]*\r?\n")
_SCALE_LINE = re.compile(rf"\s*({_NUMBER})[ \t]+({_NUMBER})[ \t]+({_NUMBER})[ \t]*\r?\n")
_HEADER_STRING = re.compile(r"\s*@?(\d+)(?: |(?=\s))")
_KEY_LINE = re.compile(r"\s*[TF][ \t]+@(\d+) ")


def readable(text: str) -> str:
    """A string of the text, which holds one character a byte, as its author wrote it."""
    try:
        return text.encode("latin-1").decode()
    except UnicodeDecodeError:
        return text


def read_header(text: str, name: str) -> tuple[Header, int]:
    """The header, and where the records begin."""
    first = _FIRST_LINE.match(text)
    if not first:
        line = text.lstrip().splitlines()[0][:40] if text.strip() else ""
        raise SatError(
            f"{name}:1: found {line!r}, expected the four numbers of a SAT header (version, records, entities, flags)"
        )
    version, records = int(first[1]), int(first[2])
    if version < 200:
        # Texts saved before 2.0 have one header line: no product, no units.
        return Header(version, records), first.end()
    product, scale = _product_and_scale(text, first.end(), name)
    unit_mm = float(scale[1])
    start = scale.end()
    key = _KEY_LINE.match(text, start)
    if key:
        # From version 26.0 on a line `T @52 KEY` without a `#` stands before the first record.
        start = key.end() + int(key[1])
    return Header(version, records, product, unit_mm if unit_mm > 0 else None), start


def _product_and_scale(text: str, start: int, name: str):
    """The product line as text, and the match of the line `mm_per_unit resabs resnor` behind it."""
    strings, at = [], start
    while len(strings) < 3 and (match := _HEADER_STRING.match(text, at)):
        # Some systems wrap the line between a count and its text; the break is not counted.
        at = match.end()
        while text[at : at + 1] in ("\r", "\n") and int(match[1]) > 0:
            at += 1
        strings.append(text[at : at + int(match[1])])
        at += int(match[1])
    scale = _SCALE_LINE.match(text, at) if len(strings) == 3 else None
    if scale:
        return ", ".join(map(readable, strings[:2])), scale
    # Counts in home-made files can be wrong: the first line that is exactly three numbers is the one.
    at = start
    for line in text[start : start + 4000].splitlines(keepends=True)[:8]:
        scale = _SCALE_LINE.fullmatch(line)
        if scale:
            return readable(text[start:at].strip()), _SCALE_LINE.match(text, at)
        at += len(line)
    raise SatError(
        f"{name}:3: found no line of three numbers (millimetres per unit and two tolerances) in the header"
    )
