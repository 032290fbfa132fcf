"""Surface and curve records -> plain geometry: planes, cones (cylinders among them), tori, spheres, circles, lines.

All numbers are in drawing units and body coordinates, as the record has them.
"""

from __future__ import annotations

import re
from math import hypot, sqrt
from typing import NamedTuple

Vector = tuple[float, float, float]

# Records spell unit vectors to about 16 digits, the worst real ones to 7.
UNIT_TOLERANCE = 1e-4
# No length of a drawing reaches this, in any unit.
LARGEST = 1e12
# A cone whose half angle is below this is a cylinder; systems write 0, 6e-17 or 1e-12.
CYLINDER_SINE = 1e-6


class BadGeometry(ValueError):
    """A surface or curve record whose numbers cannot be right."""


class Plane(NamedTuple):
    """Plane through `point`."""

    point: Vector
    axis: Vector


class Cone(NamedTuple):
    """Cone with `radius` at `centre`; a cylinder if `slope` (growth of the radius along the axis) is 0.

    `outward`: the record's normal points away from the axis. `circular`: the section is a circle.
    """

    centre: Vector
    axis: Vector
    radius: float
    slope: float
    outward: bool
    circular: bool


class Torus(NamedTuple):
    """Circle of radius |minor| swept about the axis at radius `major` (negative: a lemon)."""

    centre: Vector
    axis: Vector
    major: float
    minor: float


class Sphere(NamedTuple):
    """Sphere; a negative radius turns its normal inwards."""

    centre: Vector
    radius: float


class Freeform(NamedTuple):
    """Any other surface, such as NURBS (`spline`)."""

    kind: str


class Circle(NamedTuple):
    """Circle, counter-clockwise about its axis."""

    centre: Vector
    axis: Vector
    radius: float


class Ellipse(NamedTuple):
    """Ellipse with half axes `major` and `ratio` times that."""

    centre: Vector
    axis: Vector
    major: Vector
    ratio: float


class OtherCurve(NamedTuple):
    """A straight line or a free curve."""

    kind: str


def dot(a, b) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def less(a, b) -> Vector:
    """`a` - `b`."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def along(start, step, direction) -> Vector:
    """`start` + `step` x `direction`."""
    return (
        start[0] + step * direction[0],
        start[1] + step * direction[1],
        start[2] + step * direction[2],
    )


def cross(a, b) -> Vector:
    """Vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(a) -> float:
    """Length of a vector."""
    return sqrt(dot(a, a))


_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def numbers_of(words: list[str]) -> list[float]:
    """The numbers that follow the head of a record, without the ranges `I` and `F value`.

    The head ends with the last pointer; the numbers end with the first other word.
    """
    first = max((i for i, word in enumerate(words) if word[0] == "$"), default=-1) + 1
    found, skip = [], False
    for word in words[first:]:
        if skip:
            skip = False
        elif word == "F":
            skip = True
        elif word != "I":
            if not _NUMBER.fullmatch(word):
                break
            found.append(float(word))
    if not all(abs(value) < LARGEST for value in found):
        raise BadGeometry(f"found a number beyond {LARGEST:g}, expected lengths of a machine")
    return found


def unit_vector(vector, what: str) -> Vector:
    """`vector` at length 1 exactly; `BadGeometry` if it is far from that."""
    length = norm(vector)
    if abs(length - 1) > UNIT_TOLERANCE:
        raise BadGeometry(f"found a {what} of length {length:.6g}, expected a unit vector")
    return (vector[0] / length, vector[1] / length, vector[2] / length)


def surface_of(kind: str, words: list[str]):
    """The surface of a `*-surface` record; raises `BadGeometry`."""
    make = _SURFACES.get(kind)
    if make is None:
        return Freeform(kind.rsplit("-", 1)[0])
    count, build = make
    values = numbers_of(words)
    if len(values) < count:
        raise BadGeometry(f"found {len(values)} numbers in a {kind}, expected {count}")
    return build(values)


def _plane(v) -> Plane:
    return Plane(tuple(v[:3]), unit_vector(v[3:6], "normal"))


def _cone(v) -> Cone:
    axis, major, ratio, sine, cosine = unit_vector(v[3:6], "cone axis"), v[6:9], *v[9:12]
    radius = norm(major)
    if radius <= 0 or abs(dot(axis, major)) > 10 * UNIT_TOLERANCE * radius:
        raise BadGeometry("found a cone whose major axis is not at right angles to its axis")
    if abs(hypot(sine, cosine) - 1) > UNIT_TOLERANCE or cosine == 0:
        raise BadGeometry(
            f"found a half angle of sine {sine:g} and cosine {cosine:g}, expected squares that add to 1"
        )
    slope = 0.0 if abs(sine) < CYLINDER_SINE else sine / cosine
    return Cone(tuple(v[:3]), axis, radius, slope, cosine > 0, abs(ratio - 1) < 1e-6)


def _torus(v) -> Torus:
    if v[7] == 0:
        raise BadGeometry("found a torus of radius 0")
    return Torus(tuple(v[:3]), unit_vector(v[3:6], "torus axis"), v[6], v[7])


def _sphere(v) -> Sphere:
    if v[3] == 0:
        raise BadGeometry("found a sphere of radius 0")
    return Sphere(tuple(v[:3]), v[3])


_SURFACES = {
    "plane-surface": (6, _plane),
    "cone-surface": (12, _cone),
    "torus-surface": (8, _torus),
    "sphere-surface": (4, _sphere),
}


def curve_of(kind: str, words: list[str]):
    """The curve of a `*-curve` record; raises `BadGeometry`."""
    if kind != "ellipse-curve":
        return OtherCurve(kind.rsplit("-", 1)[0])
    values = numbers_of(words)
    if len(values) < 10:
        raise BadGeometry(f"found {len(values)} numbers in an ellipse-curve, expected 10")
    centre, axis, major = tuple(values[:3]), unit_vector(values[3:6], "ellipse normal"), tuple(values[6:9])
    if norm(major) <= 0:
        raise BadGeometry("found an ellipse of radius 0")
    if abs(values[9] - 1) < 1e-6:
        return Circle(centre, axis, norm(major))
    return Ellipse(centre, axis, major, values[9])


def off_surface(surface, point) -> float:
    """Distance of a point from a surface; 0 where it is not known (free form, elliptic)."""
    if isinstance(surface, Plane):
        return abs(dot(less(point, surface.point), surface.axis))
    if isinstance(surface, Sphere):
        return abs(norm(less(point, surface.centre)) - abs(surface.radius))
    if isinstance(surface, Freeform) or (isinstance(surface, Cone) and not surface.circular):
        return 0.0
    z = dot(less(point, surface.centre), surface.axis)
    r = norm(less(point, along(surface.centre, z, surface.axis)))
    if isinstance(surface, Torus):
        # A lemon torus lies on the other side of its axis.
        return min(abs(hypot(side * r - surface.major, z) - abs(surface.minor)) for side in (1, -1))
    return abs(r - abs(surface.radius + z * surface.slope)) / hypot(1, surface.slope)
