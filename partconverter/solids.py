"""One solid -> a turned body (drum, journals, bore), or the reason why it is none.

A solid revolves when all its faces do, round one axis: that single test throws out boxes, plates with holes, half
cylinders and crossing cylinders. Where some faces do not (keyways, drilled holes), the widest full cylinder counts
if nothing stands out beyond it; such a body carries a note.
"""

from __future__ import annotations

from collections import Counter
from math import cos, pi, sin
from typing import NamedTuple

from .profiles import SHARE, Band, Line, angle_of, band_of, is_round, line_through, revolves, sides_told
from .surfaces import Circle, Cone, Ellipse, Freeform, Sphere, Torus, along, cross, less, norm, off_surface
from .topology import Edge, Face, Model, Solid

# A vertex may lie this share of the radius off its surface (translated models: 0.01 mm); more is damage.
OFF_SURFACE = 5e-4
# Chamfers, fillets and crowns belong to the drum; a cone or fillet that takes more of the radius is an end cap.
END_DROP = 0.25
# A keyway leaves more than this share of the circumference; a D-shaped or half cylinder less.
LEAST_COVER = 0.8
# Axes tried on one solid, those of the largest cylinders first: the widest part of a roller is among them.
MOST_AXES = 8


class LeftOut(NamedTuple):
    """A solid that is no roller: why in one of `REASONS`, and what was found."""

    reason: str
    detail: str = ""


REASONS = {
    "no cylinder": "without an outer cylinder (boxes, beams, plates with holes)",
    "not a body of revolution": "with an outer cylinder, but not turned round its axis (brackets, crossing cylinders)",
    "part of a cylinder": "with half or other part cylinders only",
    "conical": "of conical shape without a straight part (--cones writes it)",
    "freeform": "with NURBS faces that hide the shape (export analytic surfaces)",
    "sheet": "without thickness (sheets)",
    "open": "with faces that are not sewn together",
    "damaged": "whose faces, edges and vertices do not fit together",
}


class Span(NamedTuple):
    """A stretch of the axis."""

    low: float
    high: float

    @property
    def length(self) -> float:
        """Its length."""
        return self.high - self.low


class Turned(NamedTuple):
    """A turned body in body coordinates: radius of its widest part and stretches along `line`.

    `face` is the straight part, `drum` adds fillets, chamfers and crowns, `overall` the journals. `bore` and
    `fillet` are radii, 0 if there is none. `notes` say what a person should know.
    """

    line: Line
    radius: float
    face: Span
    drum: Span
    overall: Span
    bore: float
    fillet: float
    conical: bool
    notes: list[str]


class Section(NamedTuple):
    """All outer cylinder faces of one radius: their stretches along the axis, and the faces."""

    radius: float
    spans: list[Span]
    bands: list[Band]

    @property
    def length(self) -> float:
        """Length of cylinder, without the gaps."""
        return sum(span.length for span in self.spans)


def recognise(model: Model, solid: Solid, *, section: str = "largest") -> Turned | LeftOut:
    """The turned body of a solid, or why it is none.

    `section` picks the drum among several outer cylinders: the "largest" diameter, or the "longest".
    Raises `topology.SatError` for damaged records.
    """
    surfaces = {face: model.surface(face) for face in solid.faces}
    if all(model.is_sheet(face) for face in solid.faces):
        return LeftOut("sheet")
    lines = _outer_lines(model, surfaces)
    if not lines:
        return _without_cylinder(model, solid, surfaces)
    faces = [model.face(face) for face in solid.faces]
    broken = _broken(faces, lines[0])
    if broken:
        return broken
    for line in lines:
        if all(revolves(surface, line) for surface in surfaces.values()):
            return _turned(line, [band_of(face, line) for face in faces], section)
    reasons = [_dominant(faces, line, section) for line in lines]
    found = next((reason for reason in reasons if isinstance(reason, Turned)), None)
    if found:
        return found
    freeform = sum(isinstance(surface, Freeform) for surface in surfaces.values())
    if freeform:
        return LeftOut("freeform", f"{freeform} of {len(faces)} faces")
    return reasons[0]


def _outer_lines(model: Model, surfaces: dict) -> list[Line]:
    """Axes of outer cylinders and cones (else of tori), that of the largest radius first."""
    outer = []
    for face, surface in surfaces.items():
        if isinstance(surface, Cone) and surface.circular and surface.outward != model.is_reversed(face):
            outer.append((surface.radius, surface.centre, surface.axis))
    if not outer:
        tori = [s for s in surfaces.values() if isinstance(s, Torus)]
        outer = [(s.major + abs(s.minor), s.centre, s.axis) for s in tori]
    lines: list[Line] = []
    for radius, centre, axis in sorted(set(outer), reverse=True):
        if len(lines) < MOST_AXES and not any(
            line.is_parallel(axis) and line.holds(centre) for line in lines
        ):
            lines.append(line_through(centre, axis, radius))
    return lines


def _without_cylinder(model: Model, solid: Solid, surfaces) -> LeftOut:
    freeform = [face for face, surface in surfaces.items() if isinstance(surface, Freeform)]
    inner = [s for s in surfaces.values() if isinstance(s, Cone) and s.circular]
    if inner:
        line = line_through(inner[0].centre, inner[0].axis, inner[0].radius)
        if all(revolves(surface, line) for surface in surfaces.values()):
            return LeftOut("damaged", "its faces are turned inside out")
    if not freeform:
        return LeftOut("no cylinder")
    detail = f"{len(freeform)} of {len(solid.faces)} faces"
    for face in freeform:
        radii = [edge.curve.radius for edge, _ in model.face(face).edges if isinstance(edge.curve, Circle)]
        if len(radii) > 1 and max(radii) - min(radii) < SHARE * radii[0]:
            return LeftOut("freeform", f"{detail}, it looks like a cylinder of diameter {2 * radii[0]:.6g}")
    return LeftOut("freeform", detail)


def _broken(faces: list[Face], line: Line) -> LeftOut | None:
    """What does not fit together: open shells, vertices off their surfaces or circles."""
    tolerance = OFF_SURFACE / SHARE * line.tolerance
    uses, ways = Counter(), Counter()
    for face in faces:
        if not face.edges and not isinstance(face.surface, Torus | Sphere):
            return LeftOut("damaged", "a face has no edges")
        for edge, forward in face.edges:
            uses[edge.record] += edge.curve is not None
            ways[edge.record] += (1 if forward else -1) * (edge.curve is not None)
            for point in (edge.start, edge.end):
                off = max(off_surface(face.surface, point), _off_curve(edge, point))
                if off > tolerance:
                    return LeftOut("damaged", f"a vertex lies {off:.3g} off its face or edge")
    unsewn = sum(count == 1 for count in uses.values())
    if unsewn:
        return LeftOut("open", f"{unsewn} edges bound one face only")
    return LeftOut("damaged", "two faces run along an edge the same way") if any(ways.values()) else None


def _crooked(bands: list[Band], line: Line) -> LeftOut | None:
    """Bands that cannot be: cylinders of no length, normals that contradict the loops."""
    if any(band.is_cylinder and band.high - band.low < line.tiny for band in bands):
        return LeftOut("damaged", "a cylinder has no length")
    if len(sides_told(bands, line)) > 1:
        return LeftOut("damaged", "its faces disagree on the side of the material")
    return None


def _off_curve(edge: Edge, point) -> float:
    return (
        abs(norm(less(point, edge.curve.centre)) - edge.curve.radius)
        if isinstance(edge.curve, Circle)
        else 0.0
    )


def _turned(line: Line, bands: list[Band], section: str) -> Turned | LeftOut:
    """The drum of a solid whose faces all revolve round `line`."""
    broken = _crooked(bands, line)
    if broken:
        return broken
    overall = Span(min(band.low for band in bands), max(band.high for band in bands))
    widest = max((band for band in bands if band.side > 0), key=lambda band: band.widest, default=None)
    if widest is None:
        return LeftOut("damaged", "no face has its material within")
    sections = _sections(bands, line)
    if not sections or (section == "largest" and widest.widest > sections[0].radius + line.tolerance):
        return _conical(line, bands, widest, overall)
    notes: list[str] = []
    chosen = _choose(sections, section, notes)
    return _drum(line, bands, chosen, overall, notes)


def _sections(bands: list[Band], line: Line) -> list[Section]:
    """Outer cylinders by radius, largest first; touching stretches are one."""
    sections: list[Section] = []
    outer = sorted(
        (b for b in bands if b.is_cylinder and b.side > 0), key=lambda b: (-b.face.surface.radius, b.low)
    )
    for band in outer:
        radius = band.face.surface.radius
        if not sections or sections[-1].radius - radius > line.tolerance:
            sections.append(Section(radius, [], []))
        sections[-1].bands.append(band)
    for found in sections:
        for band in sorted(found.bands, key=lambda b: b.low):
            if found.spans and band.low <= found.spans[-1].high + line.tolerance:
                last = found.spans.pop()
                found.spans.append(Span(last.low, max(last.high, band.high)))
            else:
                found.spans.append(Span(band.low, band.high))
    return sections


def _choose(sections: list[Section], section: str, notes: list[str]) -> Section:
    longest = max(sections, key=lambda s: s.length)
    chosen = longest if section == "longest" else sections[0]
    if chosen is not longest and chosen.length < longest.length / 2:
        notes.append(
            f"the largest cylinder (diameter {2 * chosen.radius:.6g}, {chosen.length:.6g} long) is shorter than that "
            f"of diameter {2 * longest.radius:.6g} ({longest.length:.6g} long): --section longest takes the other"
        )
    if len(chosen.spans) > 1:
        whole = chosen.spans[-1].high - chosen.spans[0].low
        share = round(100 * chosen.length / whole)
        notes.append(
            f"{len(chosen.spans)} cylinders of the same diameter in a row, taken as one ({share} % of it)"
        )
    return chosen


def _drum(line, bands, chosen: Section, overall: Span, notes) -> Turned:
    face = Span(chosen.spans[0].low, chosen.spans[-1].high)
    low, low_fillet, low_radius = _grow(bands, line, face.low, chosen.radius, -1, END_DROP * chosen.radius)
    high, high_fillet, high_radius = _grow(bands, line, face.high, chosen.radius, 1, END_DROP * chosen.radius)
    crown = chosen.radius - min(low_radius, high_radius)
    if crown > line.tolerance:
        notes.append(f"crowned: diameter {2 * (chosen.radius - crown):.6g} at its ends")
    fillet = min(low_fillet, high_fillet)
    return Turned(
        line, chosen.radius, face, Span(low, high), overall, _bore(bands, line, overall), fillet, False, notes
    )


def _grow(bands, line, end, radius, way, most_drop) -> tuple[float, float, float]:
    """Follow fillets, chamfers and crowns that touch the end of a drum.

    Returns the new end, the radius of the last fillet and the radius where the last flat cone (crown) ends.
    """
    start, fillet, crown, left = radius, 0.0, radius, list(bands)
    while True:
        step = next((b for b in left if b.side > 0 and _leads_on(b, line, end, radius, way)), None)
        if step is None:
            return end, fillet, crown
        left.remove(step)
        far_z, far_r = max(step.rings, key=lambda ring: way * ring[0])
        if start - far_r > most_drop:
            return end, fillet, crown
        is_fillet = isinstance(step.face.surface, Torus) and abs(step.face.surface.minor) < start / 2
        fillet = abs(step.face.surface.minor) if is_fillet else 0.0
        if not is_fillet and abs(radius - far_r) < 0.2 * abs(far_z - end):
            crown = far_r
        end, radius = far_z, far_r


def _leads_on(band: Band, line: Line, end, radius, way) -> bool:
    """Whether a band touches the ring (end, radius) and goes on from there."""
    touches = any(abs(z - end) < line.tolerance and abs(r - radius) < line.tolerance for z, r in band.rings)
    return touches and max(way * z for z, _ in band.rings) > way * end + line.tiny


def _bore(bands, line, overall: Span) -> float:
    """Least radius of the holes that lead from end to end, 0 if they do not."""
    holes = sorted((b for b in bands if b.side < 0 and isinstance(b.face.surface, Cone)), key=lambda b: b.low)
    reached = overall.low
    for hole in holes:
        if hole.low > reached + line.tolerance:
            return 0.0
        reached = max(reached, hole.high)
    through = holes and reached >= overall.high - line.tolerance
    return min(r for hole in holes for _, r in hole.rings) if through else 0.0


def _conical(line, bands, widest: Band, overall: Span) -> Turned:
    """A body whose widest part is no cylinder: its whole outer run of cones counts."""
    low, high = widest.low, widest.high
    if widest.rings:
        first, last = (max(widest.rings, key=lambda ring, way=way: way * ring[0]) for way in (-1, 1))
        low = min(low, _grow(bands, line, *first, -1, float("inf"))[0])
        high = max(high, _grow(bands, line, *last, 1, float("inf"))[0])
    drum = Span(low, high)
    notes = ["conical or barrel-shaped: no straight part, its largest diameter is taken"]
    return Turned(line, widest.widest, drum, drum, overall, _bore(bands, line, overall), 0.0, True, notes)


def _dominant(faces: list[Face], line: Line, section: str) -> Turned | LeftOut:
    """The widest full cylinder of a solid that does not wholly revolve, if nothing stands out beyond it."""
    bands = [band_of(face, line) for face in faces if revolves(face.surface, line)]
    sections = _sections(bands, line)
    if not sections:
        return LeftOut("no cylinder", "cones or tori only")
    widest = sections[0]
    points = [line.zr(point) for face in faces for edge, _ in face.edges for point in _points(edge)]
    out = max(r for _, r in points) - widest.radius
    if out > line.tolerance:
        return LeftOut("not a body of revolution", f"something stands {out:.6g} out of its cylinder")
    cover = min(_cover(widest, line, end) for end in (widest.spans[0].low, widest.spans[-1].high))
    if cover < LEAST_COVER:
        return LeftOut("part of a cylinder", f"{round(100 * cover)} % of the circumference")
    broken = _crooked(bands, line)
    if broken:
        return broken
    others = len(faces) - len(bands)
    whole = "" if cover > 1 - 1e-6 else f", {100 * cover:.3g} % of the circumference is left"
    notes = [f"{others} of {len(faces)} faces do not revolve (keyway, drilled holes){whole}"]
    overall = Span(min(z for z, _ in points), max(z for z, _ in points))
    return _drum(line, bands, _choose(sections, section, notes), overall, notes)


def _cover(section: Section, line: Line, end: float) -> float:
    """Share of the full circle that closes a section at one end."""
    edges = {
        edge.record: edge for band in section.bands for edge, _ in band.face.edges if is_round(edge, line)
    }
    at_end = [edge for edge in edges.values() if abs(line.zr(edge.start)[0] - end) < line.tolerance]
    return min(1.0, sum(angle_of(edge) for edge in at_end) / (2 * pi))


def _points(edge: Edge) -> list:
    """Points that show how far an edge reaches: its ends, and for circles some between."""
    if not isinstance(edge.curve, Circle | Ellipse):
        return [edge.start, edge.end]
    start = less(edge.start, edge.curve.centre)
    if isinstance(edge.curve, Ellipse):
        major = edge.curve.major
        minor = tuple(edge.curve.ratio * v for v in cross(edge.curve.axis, major))
        angle = 2 * pi
    else:
        axis = edge.curve.axis if edge.is_forward else tuple(-v for v in edge.curve.axis)
        major, minor = start, cross(axis, start)
        angle = angle_of(edge)
    steps = 16
    turns = [k * angle / steps for k in range(steps + 1)]
    return [along(along(edge.curve.centre, cos(turn), major), sin(turn), minor) for turn in turns]
