"""Records -> solids: which faces a lump has, which edges bound them, where its body puts it.

Pointers are resolved by the type of the record they point at, and from the bottom up (face -> shell -> lump ->
body, loop -> face, coedge -> loop and edge). That needs no table of layouts per save version and follows no chain
that could be broken or endless.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

from .sat import SatError, SatText
from .surfaces import BadGeometry, Vector, curve_of, numbers_of, surface_of
from .transforms import IDENTITY, Transform, transform_of

MAX_PROBLEMS = 20


class Edge(NamedTuple):
    """One edge: its record, ends, curve (None at the tip of a cone) and whether it runs along the curve."""

    record: int
    start: Vector
    end: Vector
    is_ring: bool
    curve: object | None
    is_forward: bool


class Face(NamedTuple):
    """One face: its record, surface, whether it looks against the surface's normal, and edges with their sense."""

    record: int
    surface: object
    is_reversed: bool
    edges: list[tuple[Edge, bool]]


@dataclass
class Solid:
    """One lump: faces still as records, so that a plate with a thousand holes costs nothing until asked."""

    lump: int
    body: int
    transform: int | None
    faces: list[int] = field(default_factory=list)


@dataclass
class Model:
    """All solids of a text, and what is needed to read their faces."""

    sat: SatText
    solids: list[Solid]
    wires: int
    loose_faces: int
    _surface_of_face: dict[int, int]
    _loops: dict[int, list[int]]
    _coedges: dict[int, list[tuple[int, str]]]
    _cache: dict[int, object] = field(default_factory=dict)

    def surface(self, face: int):
        """The surface of a face; faces may share it."""
        return self._cached(self._surface_of_face[face], surface_of)

    def face(self, record: int) -> Face:
        """A face with its surface and edges; raises `SatError` where they are damaged."""
        edges = [
            (self.edge(edge), sense in ("forward", "0"))
            for loop in self._loops.get(record, ())
            for edge, sense in self._coedges.get(loop, ())
        ]
        return Face(record, self.surface(record), self.is_reversed(record), edges)

    def is_reversed(self, face: int) -> bool:
        """Whether a face looks against the normal of its surface."""
        return self._is_reversed(face)

    def _is_reversed(self, record: int) -> bool:
        """The sense of a face or edge: its word, before version 2.2 a digit behind the last pointer."""
        words = self.sat.words(record)
        for word in words:
            if word in ("forward", "reversed"):
                return word == "reversed"
        last = max((i for i, word in enumerate(words) if word[0] == "$"), default=0)
        sense = words[last + 1] if last + 1 < len(words) else "nothing"
        if sense not in ("0", "1"):
            found = f"found the sense {sense!r} in a {words[0]}, expected forward or reversed"
            raise SatError(self.sat.problem(record, found))
        return sense == "1"

    def is_sheet(self, face: int) -> bool:
        """Whether both sides of a face are outside: a sheet without thickness."""
        return "double" in self.sat.words(face)

    def edge(self, record: int) -> Edge:
        """One edge with its end points and curve."""
        found = self._cache.get(-record - 1)
        if found is None:
            found = self._cache[-record - 1] = self._edge(record)
        return found

    def _edge(self, record: int) -> Edge:
        sat = self.sat
        targets = sat.pointers(record)
        vertices = [n for n in targets if n >= 0 and sat.bases[n] == "vertex"]
        if len(vertices) != 2:
            raise SatError(sat.problem(record, f"found an edge with {len(vertices)} vertices, expected two"))
        ends = [self._point(n) for n in vertices]
        curves = [n for n in targets if n >= 0 and sat.bases[n] == "curve"]
        curve = self._cached(curves[-1], curve_of) if curves else None
        return Edge(record, *ends, vertices[0] == vertices[1], curve, not self._is_reversed(record))

    def _point(self, vertex: int) -> Vector:
        sat = self.sat
        point = [n for n in sat.pointers(vertex) if n >= 0 and sat.bases[n] == "point"]
        if not point:
            raise SatError(sat.problem(vertex, "found a vertex without a point"))
        return self._cached(point[-1], _point_of)

    def _cached(self, record: int, build):
        found = self._cache.get(record)
        if found is None:
            try:
                found = self._cache[record] = build(self.sat.kinds[record], self.sat.words(record))
            except BadGeometry as error:
                raise SatError(self.sat.problem(record, str(error))) from None
        return found

    def forget(self) -> None:
        """Drop the geometry read so far: solids share none, and large assemblies would fill the memory."""
        self._cache.clear()

    def transform(self, solid: Solid) -> Transform:
        """Where the body of a solid stands; raises `SatError` for shear and damage."""
        if solid.transform is None:
            return IDENTITY
        try:
            return transform_of(self.sat.words(solid.transform))
        except BadGeometry as error:
            raise SatError(self.sat.problem(solid.transform, str(error))) from None

    def name(self, solid: Solid) -> str:
        """The name that the CAD system gave to the lump or its body, or nothing."""
        return _name(self.sat, solid.lump) or _name(self.sat, solid.body)


def _point_of(_kind: str, words) -> Vector:
    values = numbers_of(words)
    if len(values) < 3:
        raise BadGeometry(f"found {len(values)} numbers in a point, expected 3")
    return tuple(values[-3:])


def _name(sat: SatText, owner: int) -> str:
    waiting, seen = sat.pointers(owner)[:1], set()
    while waiting:
        record = waiting.pop()
        if record < 0 or record in seen or sat.bases[record] != "attrib":
            continue
        seen.add(record)
        strings = sat.strings(record)
        for key, value in pairwise(strings):
            if "name" in key.lower() and value.strip():
                return value.strip()
        waiting += sat.pointers(record)
    return ""


def read_model(sat: SatText) -> Model:
    """The solids of a SAT text, in the order of their lumps.

    Raises `SatError` with every broken link (up to 20).
    """
    links = _Links(sat)
    lump_body = links.up("lump", "body")
    shell_lump = links.up("shell", "lump", optional=True)
    subshell_shell = links.up("subshell", "shell", optional=True)
    face_shell = links.up("face", "shell", instead=subshell_shell, optional=True)
    surface_of_face = links.up("face", "surface")
    loop_face = links.up("loop", "face")
    coedge_loop = links.up("coedge", "loop", instead=dict.fromkeys(links.all("wire"), -1))
    coedge_edge = links.up("coedge", "edge")
    transforms = links.up("body", "transform", optional=True)
    senses = {coedge: links.sense(coedge) for coedge, loop in coedge_loop.items() if loop >= 0}
    links.check()

    solids = {lump: Solid(lump, body, transforms.get(body)) for lump, body in lump_body.items()}
    loose = 0
    for face in links.all("face"):
        lump = shell_lump.get(face_shell.get(face))
        if lump is None:
            loose += 1
        else:
            solids[lump].faces.append(face)
    loops, coedges = defaultdict(list), defaultdict(list)
    for loop, face in loop_face.items():
        loops[face].append(loop)
    for coedge, loop in coedge_loop.items():
        if loop >= 0:
            coedges[loop].append((coedge_edge[coedge], senses[coedge]))
    wires = len({lump for lump in solids if not solids[lump].faces})
    found = [solid for solid in solids.values() if solid.faces]
    return Model(sat, found, wires, loose, surface_of_face, dict(loops), dict(coedges))


class _Links:
    """Pointers of all records by type, and the problems found on the way."""

    def __init__(self, sat: SatText):
        self.sat = sat
        self.problems: list[str] = []
        self.by_base = defaultdict(list)
        for record, base in enumerate(sat.bases):
            self.by_base[base].append(record)

    def all(self, base: str) -> list[int]:
        return self.by_base.get(base, [])

    def up(
        self, base: str, above: str, *, instead: dict | None = None, optional: bool = False
    ) -> dict[int, int]:
        """For every record of type `base` the record of type `above` it points at, or `instead` of another target."""
        bases, pointers, found = self.sat.bases, self.sat.pointers, {}
        for record in self.all(base):
            targets = pointers(record)
            if -2 in targets:
                self.problems.append((record, f"found a pointer of a {base} to a record that does not exist"))
            target = next((n for n in targets if n >= 0 and bases[n] == above), None)
            if target is None and instead:
                target = next((instead[n] for n in targets if n in instead), None)
            if target is not None:
                found[record] = target
            elif not optional:
                self.problems.append((record, f"found a {base} that points at no {above}"))
        return found

    def sense(self, coedge: int) -> str:
        """The sense of a coedge: the field between its pointers to the edge and to the loop."""
        words = self.sat.words(coedge)
        for before, word, after in zip(words, words[1:], words[2:]):
            if word in ("forward", "reversed", "0", "1") and before[0] == after[0] == "$":
                return word
        self.problems.append((coedge, "found a coedge without a sense, expected forward or reversed"))
        return ""

    def check(self):
        if self.problems:
            unique = sorted(set(self.problems))
            lines = [self.sat.problem(*problem) for problem in unique[:MAX_PROBLEMS]]
            if len(unique) > MAX_PROBLEMS:
                lines.append(f"{self.sat.name}: and {len(unique) - MAX_PROBLEMS} problems more")
            raise SatError("\n".join(lines))
