"""Bodies on one axis: shafts in tubes, tubes in tubes, which are one roller to a belt."""

from __future__ import annotations

from dataclasses import replace

from .drums import Span
from .profiles import ANGLE
from .rollers import Roller
from .surfaces import along, cross, dot, less, norm

# Bodies whose axes lie closer than this [m] are coaxial.
COAXIAL = 1e-4


def merge_coaxial(rollers: list[Roller]) -> list[Roller]:
    """Bodies on one axis line that overlap become one roller: the widest, which lists the rest.

    A tube on its shaft, or inner and outer tube, are several bodies of one idler.
    """
    partners: dict[int, set[int]] = {}
    for i, j in coaxial_pairs(rollers):
        partners.setdefault(i, set()).add(j)
        partners.setdefault(j, set()).add(i)
    merged: dict[int, Roller] = {}
    for i in sorted(range(len(rollers)), key=lambda i: (-rollers[i].diameter, i)):
        wider = min(partners.get(i, set()) & merged.keys(), default=None)
        if wider is None:
            merged[i] = rollers[i]
        else:
            merged[wider] = _joined(merged[wider], rollers[i])
    return [merged[i] for i in sorted(merged)]


def coaxial_pairs(rollers: list[Roller]) -> list[tuple[int, int]]:
    """Pairs (i, j) of rollers on one axis line that overlap along it.

    A sweep along the longest side of the assembly: overlapping bodies lie at most one length apart.
    """
    if len(rollers) < 2:
        return []
    centres = [along(r.origin, (r.overall.low + r.overall.high) / 2, r.axis) for r in rollers]
    side = max(range(3), key=lambda k: max(c[k] for c in centres) - min(c[k] for c in centres))
    order = sorted(range(len(rollers)), key=lambda i: centres[i][side])
    reach = max(r.overall.length for r in rollers)
    found = []
    for place, i in enumerate(order):
        for j in order[place + 1 :]:
            if centres[j][side] - centres[i][side] > reach:
                break
            if are_coaxial(rollers[i], rollers[j]):
                found.append((i, j))
    return found


def are_coaxial(a: Roller, b: Roller) -> bool:
    """Whether two bodies lie on one axis line and overlap along it."""
    if norm(cross(a.axis, b.axis)) > ANGLE:
        return False
    to = less(b.origin, a.origin)
    along_axis = dot(to, a.axis)
    if norm(less(to, along((0.0, 0.0, 0.0), along_axis, a.axis))) > COAXIAL:
        return False
    span = _seen_from(a, b)
    return min(a.overall.high, span.high) - max(a.overall.low, span.low) > COAXIAL


def _seen_from(a: Roller, b: Roller) -> Span:
    """The whole length of `b` along the axis of `a`."""
    shift, way = dot(less(b.origin, a.origin), a.axis), dot(b.axis, a.axis)
    ends = sorted(shift + way * end for end in b.overall)
    return Span(*ends)


def _joined(wider: Roller, inner: Roller) -> Roller:
    span = _seen_from(wider, inner)
    overall = Span(min(wider.overall.low, span.low), max(wider.overall.high, span.high))
    size = f"{1000 * inner.diameter:.6g} x {1000 * inner.overall.length:.6g} mm"
    note = f"merged with a coaxial body {size}"
    bore = 0.0 if inner.bore == 0 else min(wider.bore, inner.bore)
    return replace(wider, overall=overall, bore=bore, notes=(*wider.notes, note))
