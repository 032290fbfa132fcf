"""SAT text -> header and records: any save version, any line breaks, counted strings, history left out.

A record is `[-n] type field ... #`. Fields that hold a string are counted (`@7 unknown`, before version 7.0
`7 unknown`), so a `#` inside one ends nothing. Nothing here knows what a record means.
"""

from __future__ import annotations

import re
from array import array
from bisect import bisect_right
from dataclasses import dataclass, field
from functools import cached_property

from .formats import foreign_format
from .header import Header, SatError, read_header, readable


@dataclass
class SatText:
    """The records of one text: type, last component of the type and place of each, pointers by record number."""

    name: str
    text: str
    header: Header
    kinds: list[str] = field(default_factory=list)
    bases: list[str] = field(default_factory=list)
    starts: array = field(default_factory=lambda: array("q"))
    ends: array = field(default_factory=lambda: array("q"))
    numbers: dict[int, int] | None = None
    has_history: bool = False
    warnings: list[str] = field(default_factory=list)

    def line(self, record: int) -> int:
        """Line on which a record begins, from 1."""
        return bisect_right(self._breaks, self.starts[record]) + 1

    @cached_property
    def _breaks(self) -> list[int]:
        return [match.start() for match in re.finditer("\n", self.text)]

    def words(self, record: int) -> list[str]:
        """The fields of a record, split at white space (strings fall apart)."""
        return self.text[self.starts[record] : self.ends[record]].split()

    def pointers(self, record: int) -> list[int]:
        """Records that a record points at, in its order; -1 for null, -2 for one that does not exist.

        In a text with a history section, which is not read, a pointer into it counts as null.
        """
        found = _POINTER.findall(self.text, self.starts[record], self.ends[record])
        missing = -1 if self.has_history else -2
        if self.numbers is not None:
            return [self.numbers.get(int(word), -1 if word == "-1" else missing) for word in found]
        count = len(self.kinds)
        return [n if -1 <= n < count else missing for n in map(int, found)]

    def strings(self, record: int) -> list[str]:
        """The counted strings of a record, as text."""
        text, at, last = self.text, self.starts[record], self.ends[record]
        pattern = _COUNTED if self.header.version >= 700 else _BARE_COUNTED
        found = []
        while match := pattern.search(text, at, last):
            end = _string_end(text, match.end(), int(match[1]))
            string = readable(text[match.end() : end])
            # Before 7.0 any number may look like a count: a string is followed by a blank and is no number.
            if pattern is _BARE_COUNTED and (not text[end : end + 1].isspace() or _PLAIN.fullmatch(string)):
                at = match.end()
                continue
            found.append(string)
            at = end
        return found

    def problem(self, record: int, text: str) -> str:
        """`file:line: text` about a record."""
        return f"{self.name}:{self.line(record)}: {text}"


_POINTER = re.compile(r"\$(-?\d+)(?=\s)")
_COUNTED = re.compile(r"@(\d+) ")
_BARE_COUNTED = re.compile(r"(?<=\s)(\d{1,6}) ")
_PLAIN = re.compile(r"[-+.\deE\s]*")
_TYPE = re.compile(r"\s*(?:-(\d+)\s+)?([A-Za-z_][\w.]*(?:-[\w.]+)*)(?=\s|$)")
# Before 7.0 a `#` may stand in an uncounted-looking string: the one that ends a record is followed by
# the end of the line or by what looks like the next record.
_OLD_END = re.compile(r"(?<=\s)#(?=[ \t]*(?:\r?\n|$)|\s+(?:-\d+\s+)?[A-Za-z_][\w-]*\s+\$)")


def read(data: bytes, name: str = "<text>") -> SatText:
    """Header and records of a SAT text.

    Raises `SatError` for other formats, damaged records and texts that break off before their end mark.
    """
    text = _decoded(data, name)
    header, start = read_header(text, name)
    sat = SatText(name, text, header)
    end = _split(sat, start)
    _check_end(sat, end)
    return sat


def _decoded(data: bytes, name: str) -> str:
    if not data.strip():
        raise SatError(f"{name}:1: the file is empty, expected SAT text")
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        data = data.decode("utf-16", errors="replace").encode()
    data = data.removeprefix(b"\xef\xbb\xbf")
    foreign = foreign_format(data)
    if foreign:
        raise SatError(
            f"{name}:1: this is {foreign}, expected ACIS SAT text: export the assembly as SAT (text)"
        )
    # One character a byte: strings are counted in bytes, whatever their encoding.
    return data.decode("latin-1")


def _split(sat: SatText, start: int) -> int:
    """Find every record; returns where the first End-of or Begin-of mark stands, or the end of the text."""
    text, kinds, starts, ends = sat.text, sat.kinds, sat.starts, sat.ends
    find_end = _end_of_record if sat.header.version >= 700 else _end_of_old_record
    numbers, numbered, interned = {}, True, {}
    while match := _TYPE.match(text, start):
        kind = match[2]
        if kind.startswith(("End-of-", "Begin-of-")):
            start = match.start(2)
            sat.has_history = kind.startswith("Begin-of-")
            break
        end = find_end(text, match.end())
        if end < 0:
            line = text.count("\n", 0, match.start(2)) + 1
            raise SatError(
                f"{sat.name}:{line}: the {kind} record has no end (#): the file is cut off or damaged"
            )
        number = match[1]
        if number is None:
            numbered = False
        else:
            numbers[int(number)] = len(kinds)
        kinds.append(interned.setdefault(kind, kind))
        starts.append(match.start(2))
        ends.append(end)
        start = end + 1
    bases = {kind: kind.rsplit("-", 1)[-1] for kind in interned}
    sat.bases = [bases[kind] for kind in kinds]
    if numbers and numbered:
        if len(numbers) < len(kinds):
            raise SatError(
                f"{sat.name}: {len(kinds) - len(numbers)} records repeat the number of another one"
            )
        sat.numbers = None if all(key == place for key, place in numbers.items()) else numbers
    elif numbers:
        raise SatError(
            f"{sat.name}: only {len(numbers)} of {len(kinds)} records carry their number (-n type)"
        )
    return start


def _end_of_record(text: str, start: int) -> int:
    """Place of the `#` that ends a record, past those in counted strings; -1 if there is none."""
    end = text.find("#", start)
    at = text.find("@", start, end)
    while 0 <= at < end:
        match = _COUNTED.match(text, at)
        past = _string_end(text, match.end(), int(match[1])) if match else at + 1
        if past > end:
            end = text.find("#", past)
        at = text.find("@", past, end)
    return end


def _string_end(text: str, start: int, count: int) -> int:
    """Where a counted string ends: after so many bytes, or characters if a blank follows only then."""
    end = start + count
    if text[end : end + 1].isspace() or count > 10_000:
        return end
    try:
        characters = text[start : start + 4 * count].encode("latin-1").decode(errors="ignore")[:count]
        in_characters = start + len(characters.encode())
    except UnicodeEncodeError:
        return end
    return in_characters if text[in_characters : in_characters + 1].isspace() else end


def _end_of_old_record(text: str, start: int) -> int:
    match = _OLD_END.search(text, start)
    return match.start() if match else -1


def _check_end(sat: SatText, end: int) -> None:
    """The text must go on to its end mark, or hold exactly the announced number of records."""
    rest = sat.text[end : end + 80].strip()
    line = sat.text.count("\n", 0, end) + 1
    mark = re.search(r"End-of-A(?:CIS|SM)-data", sat.text[end:])
    announced = sat.header.records
    if mark and rest.startswith(("End-of-", "Begin-of-")):
        if sat.text[end + mark.end() :].strip(" \t\r\n\x1a\x00"):
            sat.warnings.append(f"{sat.name}: what stands behind the end mark {mark[0]} was not read")
    elif rest:
        raise SatError(
            f"{sat.name}:{line}: found {rest.splitlines()[0][:40]!r}, expected a record or an end mark"
        )
    elif not announced or announced != len(sat.kinds):
        told = f"{announced} announced" if announced else "End-of-ACIS-data expected"
        raise SatError(f"{sat.name}:{line}: the text breaks off after {len(sat.kinds)} records ({told})")
    if mark and announced and announced != len(sat.kinds) and not rest.startswith("Begin-of-"):
        sat.warnings.append(
            f"{sat.name}:1: the header announces {announced} records, the text has {len(sat.kinds)}"
        )
