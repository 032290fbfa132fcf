"""STL bytes, ASCII or binary, to a mesh; everything that is not a whole STL file is refused by name."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator
from itertools import chain, count

import numpy as np

from .mesh import Mesh, welded
from .refusals import SHOWN, UnreadableMesh, UnreadableMeshes

# The grammar of one facet. `[^\r\n]*` takes the rest of a line, so that the numbers are parsed once a node.
FACET = re.compile(
    rb"facet\s+normal[^\r\n]*\s+outer\s+loop\s+vertex\s+([^\r\n]*)\s+vertex\s+([^\r\n]*)\s+vertex\s+([^\r\n]*)"
    rb"\s+endloop\s+endfacet"
)
BEGINNING = re.compile(rb"(?<!end)facet")
STRANGERS = (
    (b"version https://git-lfs", "a Git LFS pointer instead of the file itself"),
    (b"../.git/annex", "a git-annex pointer instead of the file itself"),
    (b"/annex/objects", "a git-annex pointer instead of the file itself"),
    (b"<", "an HTML or XML page"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"PK\x03\x04", "a zip archive"),
    (b"\xff\xfe", "UTF-16 text"),
    (b"\xfe\xff", "UTF-16 text"),
)


def read_stl(data: bytes, name: str = "mesh") -> Mesh:
    """Mesh of an STL file's bytes; `UnreadableMesh` names the line or the count that is wrong."""
    if not data.strip():
        raise UnreadableMesh(name, "an empty file", "an STL file")
    if _is_binary(data):
        return _read_binary(data, name)
    start = data.removeprefix(b"\xef\xbb\xbf").lstrip()[:4096]
    for mark, what in STRANGERS:
        if start.startswith(mark):
            raise UnreadableMesh(name, what, "an STL file")
    if b"\0" in start:
        raise _wrong_count(data, name)
    if start[:5].lower() != b"solid":
        line = start.splitlines()[0][:40].decode("utf-8", "replace")
        raise UnreadableMesh(name, f"'{line}'", "an STL file (ASCII begins with 'solid')", line=1)
    return _read_ascii(data, name)


def _is_binary(data: bytes) -> bool:
    """Only the length tells: headers of binary files often begin with "solid" too."""
    return len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little")


def _wrong_count(data: bytes, name: str) -> UnreadableMesh:
    if len(data) < 84:
        return UnreadableMesh(name, f"{len(data)} bytes", "at least the 84 bytes of a binary STL header")
    facets = int.from_bytes(data[80:84], "little")
    return UnreadableMesh(
        name,
        f"{len(data)} bytes with a count of {facets} facets (truncated, or a wrong count)",
        f"{84 + 50 * facets} bytes for a binary STL file of that count",
    )


def _read_binary(data: bytes, name: str) -> Mesh:
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    corners = np.frombuffer(data, record, offset=84)["corners"].reshape(-1, 3).astype(np.float64)
    if not len(corners):
        raise UnreadableMesh(name, "no facets", "the facets of a belt")
    bad = np.unique(np.flatnonzero(~np.isfinite(corners).all(axis=1)) // 3) + 1
    if len(bad):
        raise UnreadableMeshes(
            [UnreadableMesh(name, f"NaN or infinity in facet {facet}", "finite coordinates") for facet in bad]
        )
    return welded(corners)


def _read_ascii(data: bytes, name: str) -> Mesh:
    text = data if b"facet normal" in data else data.lower()  # the keywords are written in either case
    nodes = defaultdict(count().__next__)  # text of a vertex -> its number, in order of first appearance
    index, problems = [np.zeros(0, np.int64)], []
    for begin, end in _solids(text, name, problems):
        blocks = [_corner_numbers(text, *block, nodes) for block in _blocks(text, begin, end)]
        if text.count(b"facet", begin, end) != 2 * sum(map(len, blocks)) // 3:
            problems += _broken_facets(text, begin, end, name)
        index.extend(blocks)
    coordinates = _coordinates(list(nodes), text, name, problems)
    if problems:
        raise UnreadableMeshes(problems)
    index = np.concatenate(index)
    if not len(index):
        raise UnreadableMesh(name, "no facets", "the facets of a belt")
    return welded(coordinates, index)


def _solids(text: bytes, name: str, problems: list[UnreadableMesh]) -> Iterator[tuple[int, int]]:
    """Begin and end of what stands between `solid` and `endsolid` lines; their names may hold anything."""
    at = text.find(b"solid")
    while at >= 0:
        begin = _line_end(text, at)
        end = text.find(b"endsolid", begin)
        if end < 0:
            line = text.count(b"\n") + 1
            problems.append(
                UnreadableMesh(name, "the end of the file (truncated)", "a line 'endsolid'", line)
            )
            end = max(begin, text.rfind(b"endfacet") + len(b"endfacet"))  # what is whole is read
        yield begin, end
        after = _line_end(text, end)
        at = text.find(b"solid", after)
        stray = text.find(b"facet", after, at if at >= 0 else len(text))
        if stray >= 0:
            line = text.count(b"\n", 0, stray) + 1
            problems.append(
                UnreadableMesh(
                    name, "a facet after 'endsolid'", "facets between 'solid' and 'endsolid'", line
                )
            )


def _line_end(text: bytes, at: int) -> int:
    ends = [end for end in (text.find(b"\n", at), text.find(b"\r", at, at + 1000)) if end >= 0]
    return min(ends, default=len(text))


def _blocks(text: bytes, at: int, stop: int, size: int = 1 << 24) -> Iterator[tuple[int, int]]:
    """Spans of about 16 MB that end with a facet: the words of a million facets at once would take a gigabyte."""
    while at < stop:
        end = stop if at + size >= stop else text.rfind(b"endfacet", at, at + size) + len(b"endfacet")
        end = end if end > at else stop
        yield at, end
        at = end


def _corner_numbers(text: bytes, begin: int, end: int, nodes: dict[bytes, int]) -> np.ndarray:
    corners = chain.from_iterable(FACET.findall(text, begin, end))
    return np.fromiter(map(nodes.__getitem__, corners), dtype=np.int64)


def _broken_facets(text: bytes, at: int, end: int, name: str) -> list[UnreadableMesh]:
    """The lines of all that stands between two facets and is no facet."""
    expected = "'facet normal', 'outer loop', three 'vertex x y z', 'endloop' and 'endfacet', in this order"
    gaps = []
    for match in FACET.finditer(text, at, end):
        gaps.append((at, match.start()))
        at = match.end()
    problems = []
    for begin, stop in [*gaps, (at, end)]:
        # A stretch with no beginning of a facet holds the rest of one, which is told as it stands.
        places = [match.start() for match in BEGINNING.finditer(text, begin, stop)]
        if not places and b"facet" in text[begin:stop]:
            places = [text.find(b"facet", begin, stop)]
        for place in places:
            found = text[place : place + 60].splitlines()[0].decode("utf-8", "replace")
            line = text.count(b"\n", 0, place) + 1
            problems.append(UnreadableMesh(name, f"a broken facet that begins '{found}'", expected, line))
    return problems


def _coordinates(vertices: list[bytes], text: bytes, name: str, problems: list[UnreadableMesh]) -> np.ndarray:
    """Coordinates (v, 3) of vertices from their texts; what no number can be goes to the problems."""
    fields = b" ".join(vertices).split()
    try:
        numbers = np.array(list(map(float, fields)))
    except ValueError:
        numbers = np.zeros(0)
    if len(numbers) != 3 * len(vertices) or not np.isfinite(numbers).all():
        problems += _bad_vertices(vertices, text, name)
        return np.zeros((0, 3))
    return numbers.reshape(-1, 3)


def _bad_vertices(vertices: list[bytes], text: bytes, name: str) -> list[UnreadableMesh]:
    """One problem for each vertex text that is not three numbers, where it stands first."""
    complaints = [(vertex, found) for vertex in vertices if (found := _complaint(vertex))]
    expected = "three finite numbers with decimal points"
    problems = []
    for n, (vertex, found) in enumerate(complaints):
        # Lines are counted for those only that are shown.
        line = len(text)
        if n < SHOWN:
            place = re.search(rb"vertex\s+" + re.escape(vertex), text).start()
            line = text.count(b"\n", 0, place) + 1
        shown = vertex.decode("utf-8", "replace")
        problems.append(UnreadableMesh(name, f"'vertex {shown}' ({found})", expected, line))
    return problems


def _complaint(vertex: bytes) -> str:
    if b"," in vertex:
        return "decimal comma"
    fields = vertex.split()
    try:
        values = [float(field) for field in fields]
    except ValueError:
        return "not three numbers"
    if len(fields) != 3:
        return f"{len(fields)} numbers"
    for field, value in zip(fields, values):
        if value != value:
            return "NaN"
        if value in (float("inf"), float("-inf")):
            return "infinity" if b"inf" in field.lower() else "overflow: beyond 1.8e308"
    return ""
