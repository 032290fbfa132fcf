"""Rollers in the assembly, in metres: from turned bodies to identical geometries, classes, order and names."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, replace
from math import sqrt

from .drums import Span, Turned
from .surfaces import Vector, along
from .transforms import Transform

# A fillet counts if the written length is that of the drum within this [m].
FITS = 1e-5
# Positions and sizes are rounded to this many digits of a metre: a picometre, far below any CAD tolerance.
DIGITS = 12


@dataclass(frozen=True)
class Roller:
    """One smooth cylinder.

    origin, axis : a point of the axis [m] and its unit direction; `face`, `drum` and `overall` [m] lie along it
    diameter, bore, fillet [m] : of the widest cylinder, of a through hole, of the edge (radius); 0 = none
    length, centre, edge_radius [m] : of the cylinder that is written
    geometry, identical : number of its geometry (from 0), and how many rollers share it
    kind, rule : PULLEY or IDLER, and the rule that decided
    speed : angular velocity about `axis` [rad/s], None if nothing drives it; `station` where the belt touches it
    """

    origin: Vector
    axis: Vector
    diameter: float
    face: Span
    drum: Span
    overall: Span
    bore: float = 0.0
    fillet: float = 0.0
    cad_name: str = ""
    line: int = 0
    notes: tuple[str, ...] = ()
    length: float = 0.0
    centre: Vector = (0.0, 0.0, 0.0)
    edge_radius: float = 0.0
    geometry: int = 0
    identical: int = 1
    kind: str = "IDLER"
    rule: str = ""
    name: str = ""
    speed: float | None = None
    station: float | None = None


def place(turned: Turned, transform: Transform, unit_mm: float, *, cad_name="", line=0) -> Roller:
    """A turned body, put where its transform says, in metres."""
    factor = abs(transform.scale) * unit_mm / 1000
    origin = tuple(v * unit_mm / 1000 for v in transform.point(turned.line.origin))
    turn = -1 if transform.scale < 0 else 1
    axis = transform.direction(tuple(turn * v for v in turned.line.axis))
    spans = [
        Span(span.low * factor, span.high * factor) for span in (turned.face, turned.drum, turned.overall)
    ]
    largest = max(range(3), key=lambda i: (round(abs(axis[i]), 9), -i))
    if axis[largest] < 0:
        axis, spans = tuple(-v for v in axis), [Span(-span.high, -span.low) for span in spans]
    radii = [2 * turned.radius * factor, 2 * turned.bore * factor, turned.fillet * factor]
    diameter, bore, fillet = map(_tidy, radii)
    notes = tuple(note.in_mm(1000 * factor) for note in turned.notes)
    return Roller(origin, axis, diameter, *spans, bore, fillet, cad_name, line, notes)


def _tidy(value: float) -> float:
    return round(value, DIGITS) + 0.0


def sized(rollers: list[Roller], *, length: str = "drum", edge_radius: float | None = None) -> list[Roller]:
    """Rollers with the `length` that is written ("drum", "face" or "overall") and its middle.

    `edge_radius` [m] is given, or that of fillets which round both ends of that length off. It never exceeds
    half the diameter or half the length.
    """
    found = []
    for roller in rollers:
        span = getattr(roller, length)
        fits = abs(span.length - roller.drum.length) < FITS
        edge = edge_radius if edge_radius is not None else (roller.fillet if fits else 0.0)
        edge = min(edge, roller.diameter / 2, span.length / 2)
        middle = along(roller.origin, (span.low + span.high) / 2, roller.axis)
        centre = tuple(map(_tidy, middle))
        found.append(replace(roller, length=_tidy(span.length), centre=centre, edge_radius=_tidy(edge)))
    return found


def identified(rollers: list[Roller], tolerance: float | None = None) -> list[Roller]:
    """Rollers with the number of their geometry and the count of identical ones; all of a kind get one size.

    Sizes are the same if they differ by less than `tolerance` [m] (default 0.01 mm, or 1e-5 of the size), so that
    108.0049 and 108.0051 never fall apart as they do when each is rounded. Place and direction play no part.
    """
    fields = ("diameter", "length", "bore", "edge_radius")
    columns = [_clusters([getattr(roller, field) for roller in rollers], tolerance) for field in fields]
    columns.append(_clusters([roller.overall.length for roller in rollers], tolerance))
    keys = list(zip(*columns))
    numbers = {key: i for i, key in enumerate(dict.fromkeys(keys))}
    counts = Counter(keys)
    first = {}
    found = []
    for roller, key in zip(rollers, keys):
        model = first.setdefault(key, roller)
        sizes = {field: getattr(model, field) for field in fields}
        found.append(replace(roller, geometry=numbers[key], identical=counts[key], **sizes))
    return found


def _clusters(values: list[float], tolerance: float | None) -> list[int]:
    """Cluster number of each value: in order of size, one beyond the tolerance of the first begins a new cluster."""
    order = sorted(range(len(values)), key=lambda i: values[i])
    numbers, first = [0] * len(values), values[order[0]] if order else 0.0
    current = 0
    for i in order:
        if values[i] - first > (max(1e-5, 1e-5 * abs(first)) if tolerance is None else tolerance):
            first, current = values[i], current + 1
        numbers[i] = current
    return numbers


def classified(
    rollers: list[Roller], *, diameter_limit: float | None = None, quantity_limit: int | None = None
) -> list[Roller]:
    """Rollers with their class: PULLEY at or above the diameter [m] or at or below the count, else IDLER."""
    return [replace(roller, **_class(roller, diameter_limit, quantity_limit)) for roller in rollers]


def _class(roller: Roller, diameter_limit, quantity_limit) -> dict:
    # A diameter of just the limit must not fall below it by a rounding error of the file.
    if diameter_limit is not None and roller.diameter >= diameter_limit * (1 - 1e-9):
        return {"kind": "PULLEY", "rule": f"diameter at or above {diameter_limit:g} m"}
    if quantity_limit is not None and roller.identical <= quantity_limit:
        return {"kind": "PULLEY", "rule": f"not more than {quantity_limit} of its kind"}
    below = [] if diameter_limit is None else [f"diameter below {diameter_limit:g} m"]
    more = [] if quantity_limit is None else [f"more than {quantity_limit} of its kind"]
    return {"kind": "IDLER", "rule": " and ".join(below + more) or "no limit was given"}


def ordered(rollers: list[Roller], sort: str = "auto") -> list[Roller]:
    """Rollers along the conveyor: along the belt if one touches them, else along an axis, else as in the file.

    "auto" takes the belt, and without one the longest side of the box around all centres.
    """
    if sort == "file" or not rollers:
        return rollers
    extents = [max(r.centre[i] for r in rollers) - min(r.centre[i] for r in rollers) for i in range(3)]
    axes = sorted(range(3), key=lambda i: (-round(extents[i], 6), i))
    if sort in ("x", "y", "z"):
        axes.sort(key=lambda i: i != "xyz".index(sort))

    def key(roller: Roller):
        station = roller.station if sort == "auto" else None
        place = tuple(round(roller.centre[i], 6) for i in axes)
        return (station is None, 0.0 if station is None else round(station, 6), place)

    return sorted(rollers, key=key)


def named(rollers: list[Roller], *, by: str = "class", prefix: str = "") -> list[Roller]:
    """Rollers with unique names, numbered in their order.

    `by`: "class" (pulley_001), "geometry" (idler_d133x380_001) or "cad" (the CAD system's name, if it has one).
    """
    stems = [_stem(roller, by) for roller in rollers]
    repeated = Counter(stems)
    used, seen, found = set(), Counter(), []
    for roller, stem in zip(rollers, stems):
        numbered = by != "cad" or not _clean(roller.cad_name) or repeated[stem] > 1
        name = prefix + stem
        while numbered or name in used:
            seen[stem] += 1
            name, numbered = f"{prefix}{stem}_{seen[stem]:03d}", f"{prefix}{stem}_{seen[stem]:03d}" in used
        used.add(name)
        found.append(replace(roller, name=name))
    return found


def _stem(roller: Roller, by: str) -> str:
    if by == "cad" and _clean(roller.cad_name):
        return _clean(roller.cad_name)
    if by == "geometry":
        return geometry_name(roller)
    return roller.kind.lower()


def geometry_name(roller: Roller) -> str:
    """Class and size of a roller, as idler_d133x380 (mm)."""
    return f"{roller.kind.lower()}_d{1000 * roller.diameter:.6g}x{1000 * roller.length:.6g}"


def _clean(name: str) -> str:
    """A CAD name as one word without signs that mean something in an INP text."""
    printable = "".join(sign if sign.isprintable() else " " for sign in name)
    return re.sub(r"""[\s,"'=*?]+""", "_", printable).strip("_")


def quaternion_of(axis: Vector) -> tuple[float, float, float, float]:
    """The shortest rotation (qw, qx, qy, qz) that turns local z to `axis`."""
    if axis[2] < -1 + 1e-12:
        return (0.0, 1.0, 0.0, 0.0)
    w, x, y = 1 + axis[2], -axis[1], axis[0]
    length = sqrt(w * w + x * x + y * y)
    return (w / length, x / length + 0.0, y / length + 0.0, 0.0)
