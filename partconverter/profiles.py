"""Faces round one axis -> bands: where each lies along the axis, at which radius, and on which side the material is.

Everything happens in the half plane (z along the axis, r from it), so a split, quartered or seamed face gives the
same band as a whole one.
"""

from __future__ import annotations

from math import acos, atan2, cos, hypot, pi, sin
from typing import NamedTuple

from .surfaces import Circle, Cone, Plane, Sphere, Torus, Vector, along, cross, dot, less, norm
from .topology import Edge, Face

# Two directions are parallel below this angle [rad]; faces touch within this share of the radius.
ANGLE = 1e-4
SHARE = 1e-3


class Line(NamedTuple):
    """An axis: `origin` is its foot from (0, 0, 0), the largest component of `axis` is positive.

    Within `tolerance` faces touch and axes are one; below `tiny` there is no extent at all.
    """

    origin: Vector
    axis: Vector
    tolerance: float

    @property
    def tiny(self) -> float:
        """A millionth of the radius."""
        return self.tolerance * 1e-6 / SHARE

    def zr(self, point) -> tuple[float, float]:
        """Place of a point along the axis and its distance from it."""
        to = less(point, self.origin)
        z = dot(to, self.axis)
        return z, norm(less(to, along((0.0, 0.0, 0.0), z, self.axis)))

    def is_parallel(self, direction) -> bool:
        """Whether a unit vector has the direction of the axis, either way."""
        return norm(cross(direction, self.axis)) < ANGLE

    def holds(self, point) -> bool:
        """Whether a point lies on the axis."""
        return self.zr(point)[1] < self.tolerance


def line_through(centre, axis, radius) -> Line:
    """The axis line of a surface of that radius."""
    largest = max(range(3), key=lambda i: (round(abs(axis[i]), 9), -i))
    if axis[largest] < 0:
        axis = (-axis[0], -axis[1], -axis[2])
    return Line(along(centre, -dot(centre, axis), axis), axis, SHARE * radius)


class Band(NamedTuple):
    """One face round the axis: its rings [(z, r)], extent, and side +1 (material within), -1 (hole) or 0 (plane)."""

    face: Face
    rings: list[tuple[float, float]]
    low: float
    high: float
    widest: float
    side: int

    @property
    def is_cylinder(self) -> bool:
        """Whether the face is part of a cylinder."""
        return isinstance(self.face.surface, Cone) and self.face.surface.slope == 0


def revolves(surface, line: Line) -> bool:
    """Whether a surface is one of revolution round `line`."""
    if isinstance(surface, Plane):
        return line.is_parallel(surface.axis)
    if isinstance(surface, Sphere):
        return line.holds(surface.centre)
    if isinstance(surface, Cone):
        return surface.circular and line.is_parallel(surface.axis) and line.holds(surface.centre)
    return isinstance(surface, Torus) and line.is_parallel(surface.axis) and line.holds(surface.centre)


def is_round(edge: Edge, line: Line) -> bool:
    """Whether an edge is (part of) a circle round `line`."""
    curve = edge.curve
    return isinstance(curve, Circle) and line.is_parallel(curve.axis) and line.holds(curve.centre)


def angle_of(edge: Edge) -> float:
    """Angle that a circular edge covers round its centre [rad]."""
    if edge.is_ring:
        return 2 * pi
    axis = edge.curve.axis if edge.is_forward else tuple(-v for v in edge.curve.axis)
    start, end = less(edge.start, edge.curve.centre), less(edge.end, edge.curve.centre)
    return atan2(dot(cross(start, end), axis), dot(start, end)) % (2 * pi)


def band_of(face: Face, line: Line) -> Band:
    """The band of a face that revolves round `line`."""
    surface = face.surface
    rings = sorted({line.zr(point) for edge, _ in face.edges for point in (edge.start, edge.end)})
    if isinstance(surface, Cone) and surface.slope and rings and rings[-1][0] - rings[0][0] < line.tiny:
        tip = along(surface.centre, -surface.radius / surface.slope, surface.axis)
        rings = sorted([*rings, line.zr(tip)])
    extent = list(rings)
    if isinstance(surface, Torus | Sphere):
        extent += _arc_extent(face, line)
    low, high = min((z for z, _ in extent), default=0.0), max((z for z, _ in extent), default=0.0)
    return Band(face, rings, low, high, max((r for _, r in extent), default=0.0), _side(face, line, rings))


def _side(face: Face, line: Line, rings) -> int:
    """Side of the material, where the normal leans most from the axis."""
    leanings = [_normal(face, line, ring)[1] for ring in rings] or [_normal(face, line, _seed(face, line))[1]]
    most = max(leanings, key=abs)
    return 0 if abs(most) < ANGLE else (1 if most > 0 else -1)


def _seed(face: Face, line: Line) -> tuple[float, float]:
    """The outermost point of a torus or sphere without edges."""
    z = line.zr(face.surface.centre)[0]
    centre_r, radius = _arc(face.surface)
    return z, centre_r + radius


def _normal(face: Face, line: Line, ring) -> tuple[float, float]:
    """Normal (z, r) out of the material at a ring."""
    surface, (z, r) = face.surface, ring
    turn = -1 if face.is_reversed else 1
    if isinstance(surface, Plane):
        return turn * dot(surface.axis, line.axis), 0.0
    if isinstance(surface, Cone):
        slope = surface.slope * (1 if dot(surface.axis, line.axis) > 0 else -1)
        turn *= (1 if surface.outward else -1) / hypot(1, slope)
        return -slope * turn, turn
    centre_z = line.zr(surface.centre)[0]
    centre_r, radius = _arc(surface)
    inwards = surface.radius < 0 if isinstance(surface, Sphere) else surface.minor < 0
    turn *= (-1 if inwards else 1) / radius
    return (z - centre_z) * turn, (r - centre_r) * turn


def _arc(surface) -> tuple[float, float]:
    """Radius of the centre and radius of the arc that sweeps a torus or sphere."""
    if isinstance(surface, Sphere):
        return 0.0, abs(surface.radius)
    return surface.major, abs(surface.minor)


def ring_ways(face: Face, line: Line):
    """For every round edge of a face its ring (z, r) and the way (z, r) on which the face goes on from there.

    A face lies to the left of its loops, seen from outside.
    """
    for edge, forward in face.edges:
        if is_round(edge, line):
            ring = line.zr(edge.start)
            turn = 1 if (dot(edge.curve.axis, line.axis) > 0) == (edge.is_forward == forward) else -1
            normal_z, normal_r = _normal(face, line, ring)
            yield ring, (turn * normal_r, -turn * normal_z)


def sides_told(bands: list[Band], line: Line) -> set[bool]:
    """Whether edges and normals agree on where the faces lie: {True} in sound solids.

    {False} is a system that runs loops the other way, both together are damage.
    """
    told = set()
    for band in bands:
        axis = 1 if isinstance(band.face.surface, Plane) else 0
        if not band.rings or isinstance(band.face.surface, Torus | Sphere):
            continue
        ends = [ring[axis] for ring in band.rings]
        # A disc without inner ring goes on to the axis.
        disc = axis == 1 and max(ends) - min(ends) < line.tiny
        middle = (max(ends) + (0.0 if disc else min(ends))) / 2
        told |= {way[axis] * (middle - ring[axis]) > 0 for ring, way in ring_ways(band.face, line)}
    return told


def _arc_extent(face: Face, line: Line) -> list[tuple[float, float]]:
    """Points of a torus or sphere that lie farthest along the axis and from it, between its rings or the axis."""
    centre_z = line.zr(face.surface.centre)[0]
    centre_r, radius = _arc(face.surface)
    starts = []
    for (z, r), (way_z, way_r) in ring_ways(face, line):
        angle = atan2(z - centre_z, r - centre_r)
        starts.append((angle, 1 if way_z * cos(angle) - way_r * sin(angle) > 0 else -1))
    stops = [angle for angle, _ in starts]
    if radius >= abs(centre_r):
        on_axis = acos(max(-1.0, min(1.0, -centre_r / radius)))
        stops += [on_axis, -on_axis]
    arcs = [_until(angle, way, stops) for angle, way in starts] or [(-pi, pi)]
    corners = [k * pi / 2 for k in range(-8, 9)]
    reached = [angle for low, high in arcs for angle in [low, high, *(c for c in corners if low < c < high)]]
    points = [(centre_z + radius * sin(angle), centre_r + radius * cos(angle)) for angle in reached]
    return [(z, r) for z, r in points if r > -line.tolerance]


def _until(angle: float, way: int, stops) -> tuple[float, float]:
    """The stretch from `angle` in direction `way` to the next of `stops`, or all round."""
    gaps = [way * (stop - angle) % (2 * pi) for stop in stops]
    step = min((gap for gap in gaps if 1e-6 < gap < 2 * pi - 1e-6), default=2 * pi)
    return (angle, angle + step) if way > 0 else (angle - step, angle)
