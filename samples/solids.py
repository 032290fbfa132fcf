"""Solids as CAD systems hold them (complete B-reps): cylinders, tubes, rollers, any half profile, boxes.

A `Solid` is plain data: vertices, edges between them and faces with loops of (edge, forward), each face to the
left of its loops seen from outside. `Body` gives solids a common transform and name. Lengths are in drawing units.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import atan2, cos, hypot, pi, sin, sqrt
from typing import NamedTuple

Vector = tuple[float, float, float]


class Surface(NamedTuple):
    """One surface record: its kind (plane, cone, torus, sphere, ...) and the values behind its head."""

    kind: str
    values: tuple[float, ...]


class Curve(NamedTuple):
    """One curve record: straight (point, direction) or ellipse (centre, normal, major, ratio)."""

    kind: str
    values: tuple[float, ...]


class Edge(NamedTuple):
    """From vertex `start` to vertex `end`; equal ones make a closed ring."""

    start: int
    end: int
    curve: Curve | None
    low: float
    high: float


class Face(NamedTuple):
    """A surface, whether the face looks against its normal, and loops of (edge, forward)."""

    surface: Surface
    is_reversed: bool
    loops: list[list[tuple[int, bool]]]


@dataclass
class Solid:
    """One lump: a list of shells, each a list of faces; further shells are voids."""

    vertices: list[Vector] = field(default_factory=list)
    edges: list[Edge] = field(default_factory=list)
    shells: list[list[Face]] = field(default_factory=list)
    sides: str = "single"

    def vertex(self, point: Vector) -> int:
        """Add a vertex and return its number."""
        self.vertices.append(point)
        return len(self.vertices) - 1

    def edge(self, *fields) -> int:
        """Add an edge and return its number."""
        self.edges.append(Edge(*fields))
        return len(self.edges) - 1


@dataclass
class Body:
    """Solids with one transform: `matrix` (rows, acts on row vectors), `scale`, then `shift`."""

    solids: list[Solid]
    name: str = ""
    matrix: tuple[Vector, Vector, Vector] | None = None
    shift: Vector = (0.0, 0.0, 0.0)
    scale: float = 1.0
    shear: bool = False


def add(*vectors) -> Vector:
    """Sum of vectors."""
    return tuple(map(sum, zip(*vectors)))


def times(factor: float, vector) -> Vector:
    """`factor` times `vector`."""
    return tuple(factor * v for v in vector)


def cross(a, b) -> Vector:
    """Cross product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(vector) -> Vector:
    """`vector` at length 1."""
    return times(1 / sqrt(sum(v * v for v in vector)), vector)


def frame_of(axis) -> tuple[Vector, Vector, Vector]:
    """Right-handed unit vectors (e1, e2, axis)."""
    axis = unit(axis)
    least = min(range(3), key=lambda i: abs(axis[i]))
    e1 = unit(cross(axis, tuple(float(i == least) for i in range(3))))
    return e1, cross(axis, e1), axis


def cylinder(diameter, length, centre=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0), *, bore=0.0, **options) -> Solid:
    """A cylinder, or a tube if `bore` is given, with its middle at `centre`."""
    r, h, b = diameter / 2, length / 2, bore / 2
    profile = [(b, -h), (r, -h), (r, h), (b, h)]
    return revolve(profile, centre, axis, **options)


def roller(
    diameter, length, shaft, overall, centre=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0), **options
) -> Solid:
    """A drum with two journals of diameter `shaft`; `overall` is the length from end to end."""
    r, s, h, e = diameter / 2, shaft / 2, length / 2, overall / 2
    profile = [(0, -e), (s, -e), (s, -h), (r, -h), (r, h), (s, h), (s, e), (0, e)]
    return revolve(profile, centre, axis, **options)


def revolve(profile, centre=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0), *, pieces=1, seam=False, hole="reversed"):
    """The solid of revolution of a half profile of (r, z) points.

    The profile runs counter-clockwise in the (r, z) plane (material on its left) and is closed by itself,
    unless its first and last point lie on the axis. A point (r, z, (rc, zc)) starts an arc about (rc, zc),
    convex if it is half a circle.
    Every curved face is cut into `pieces` sectors, or once if `seam`; `hole` says how inner faces are spelt:
    "reversed" faces or negative "cosine".
    """
    solid = Solid()
    points = [(float(p[0]), float(p[1])) for p in profile]
    arcs = [p[2] if len(p) > 2 else None for p in profile]
    place = _Place(centre, frame_of(axis))
    rings = [_ring(solid, place, point, pieces) for point in points]
    closed = points[0][0] > 0 or points[-1][0] > 0
    steps = range(len(points) if closed else len(points) - 1)
    shell = []
    for i in steps:
        j = (i + 1) % len(points)
        surface, is_reversed = _revolved(place, points[i], points[j], arcs[i], hole)
        cut = surface.kind != "plane" and (seam or pieces > 1)
        seams = _seams(solid, place, (points[i], points[j], arcs[i]), rings[i], rings[j]) if cut else []
        shell += [Face(surface, is_reversed, loops) for loops in _loops(rings[i], rings[j], seams)]
    solid.shells.append(shell)
    return solid


class _Place(NamedTuple):
    centre: Vector
    frame: tuple[Vector, Vector, Vector]

    def at(self, r, z, angle=0.0) -> Vector:
        e1, e2, axis = self.frame
        return add(self.centre, times(r * cos(angle), e1), times(r * sin(angle), e2), times(z, axis))


class _Ring(NamedTuple):
    """The vertices and arcs that one profile point sweeps; no arcs on the axis."""

    vertices: list[int]
    arcs: list[int]


def _ring(solid, place, point, pieces) -> _Ring:
    r, z = point
    if r == 0:
        return _Ring([solid.vertex(place.at(0, z))] * pieces, [])
    curve = Curve("ellipse", (*place.at(0, z), *place.frame[2], *times(r, place.frame[0]), 1))
    vertices = [solid.vertex(place.at(r, z, 2 * pi * k / pieces)) for k in range(pieces)]
    angles = [2 * pi * k / pieces for k in range(pieces + 1)]
    arcs = [
        solid.edge(vertices[k], vertices[(k + 1) % pieces], curve, angles[k], angles[k + 1])
        for k in range(pieces)
    ]
    return _Ring(vertices, arcs)


def _revolved(place, start, end, arc, hole) -> tuple[Surface, bool]:
    """The surface that one profile segment sweeps, and whether its normal points into the material."""
    (r0, z0), (r1, z1) = start, end
    e1, _, axis = place.frame
    if arc is not None:
        outward = (z1 - z0, r0 - r1)
        convex = outward[0] * (r0 + r1 - 2 * arc[0]) + outward[1] * (z0 + z1 - 2 * arc[1]) >= 0
        minor = hypot(r0 - arc[0], z0 - arc[1])
        if arc[0] == 0:
            return Surface("sphere", (*place.at(0, arc[1]), minor, *e1, *axis)), not convex
        return Surface("torus", (*place.at(0, arc[1]), *axis, arc[0], minor, *e1)), not convex
    if z0 == z1:
        return Surface("plane", (*place.at(0, z0), *times(1 if r1 < r0 else -1, axis), *e1)), False
    length = hypot(r1 - r0, z1 - z0)
    cosine = abs(z1 - z0) / length
    sine = (r1 - r0) / (z1 - z0) * cosine
    r, z = (r0, z0) if r0 > 0 else (r1, z1)
    inner = z1 < z0
    if inner and hole == "cosine":
        sine, cosine, inner = -sine, -cosine, False
    return Surface("cone", (*place.at(0, z), *axis, *times(r, e1), 1, sine + 0.0, cosine, r)), inner


def _seams(solid, place, segment, ring, next_ring) -> list[int]:
    """One edge along the profile segment at every cut."""
    (r0, z0), (r1, z1), arc = segment
    count = len(ring.vertices)
    seams = []
    for k in range(count):
        angle = 2 * pi * k / count
        start, end = place.at(r0, z0, angle), place.at(r1, z1, angle)
        if arc is None:
            way = add(end, times(-1, start))
            curve, low, high = Curve("straight", (*start, *unit(way))), 0.0, sqrt(sum(v * v for v in way))
        else:
            centre = place.at(arc[0], arc[1], angle)
            outwards = add(place.at(1, 0, angle), times(-1, place.at(0, 0)))
            turn = (r0 - arc[0]) * (z1 - arc[1]) - (z0 - arc[1]) * (r1 - arc[0])
            normal = times(1 if turn >= 0 else -1, cross(outwards, place.frame[2]))
            curve = Curve("ellipse", (*centre, *normal, *add(start, times(-1, centre)), 1))
            dot = (r0 - arc[0]) * (r1 - arc[0]) + (z0 - arc[1]) * (z1 - arc[1])
            low, high = 0.0, atan2(abs(turn), dot)
        seams.append(solid.edge(ring.vertices[k], next_ring.vertices[k], curve, low, high))
    return seams


def _loops(ring, next_ring, seams):
    """Loops of each face between two rings: the face lies left of every loop, seen from outside."""
    if not seams:
        rounds = [[(arc, True) for arc in ring.arcs], [(arc, False) for arc in reversed(next_ring.arcs)]]
        yield [loop for loop in rounds if loop]
        return
    count = len(seams)
    for k in range(count):
        loop = [(ring.arcs[k], True)] if ring.arcs else []
        loop.append((seams[(k + 1) % count], True))
        loop += [(next_ring.arcs[k], False)] if next_ring.arcs else []
        loop.append((seams[k], False))
        yield [loop]


def box(size, centre=(0.0, 0.0, 0.0)) -> Solid:
    """A box of outer `size` (x, y, z) with its middle at `centre`."""
    solid = Solid()
    corner = {}
    for i in range(8):
        signs = ((i & 1) * 2 - 1, (i >> 1 & 1) * 2 - 1, (i >> 2 & 1) * 2 - 1)
        corner[signs] = solid.vertex(add(centre, tuple(s * e / 2 for s, e in zip(signs, size))))
    edges = {}

    def use(start, end):
        if (end, start) in edges:
            return edges[end, start], False
        way = add(solid.vertices[end], times(-1, solid.vertices[start]))
        line = Curve("straight", (*solid.vertices[start], *unit(way)))
        edges[start, end] = solid.edge(start, end, line, 0.0, sqrt(sum(v * v for v in way)))
        return edges[start, end], True

    shell = []
    for axis in range(3):
        for side in (-1, 1):
            u, v = ((axis + 1) % 3, (axis + 2) % 3) if side > 0 else ((axis + 2) % 3, (axis + 1) % 3)
            ring = []
            for su, sv in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                signs = [0, 0, 0]
                signs[axis], signs[u], signs[v] = side, su, sv
                ring.append(corner[tuple(signs)])
            normal = tuple(float(side if i == axis else 0) for i in range(3))
            across = tuple(float(i == u) for i in range(3))
            loop = [use(ring[k], ring[(k + 1) % 4]) for k in range(4)]
            shell.append(Face(Surface("plane", (*solid.vertices[ring[0]], *normal, *across)), False, [loop]))
    solid.shells.append(shell)
    return solid
