"""One solid -> a turned body (drum, journals, bore), or the reason why it is none.

A solid revolves when all its faces do, round one axis: that single test throws out boxes, plates with holes, half
cylinders and crossing cylinders. Where some faces do not (keyways, drilled holes), the widest full cylinder counts
if nothing stands out beyond it; such a body carries a note.
"""

from __future__ import annotations

from collections import Counter
from math import cos, pi, sin

from .drums import LeftOut, Note, Section, Span, Turned, choose, crooked, drum_of, sections_of, turned
from .profiles import SHARE, Line, angle_of, band_of, is_round, line_through, revolves
from .surfaces import Circle, Cone, Ellipse, Freeform, Sphere, Torus, along, cross, less, norm, off_surface
from .topology import Edge, Face, Model, Solid

# A vertex may lie this share of the radius off its surface (translated models: 0.01 mm); more is damage.
OFF_SURFACE = 5e-4
# A keyway leaves more than this share of the circumference; a D-shaped or half cylinder less.
LEAST_COVER = 0.8
# Axes tried on one solid, those of the largest cylinders first: the widest part of a roller is among them.
MOST_AXES = 8


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
    unknown = {s.kind for s in surfaces.values() if isinstance(s, Freeform)} - {"spline", "meshsurf"}
    if unknown:
        return LeftOut("damaged", Note(f"a surface of the unknown kind {min(unknown)}"))
    faces = [model.face(face) for face in solid.faces]
    broken = _broken(faces, lines[0])
    if broken:
        return broken
    for line in lines:
        if all(revolves(surface, line) for surface in surfaces.values()):
            return turned(line, [band_of(face, line) for face in faces], section)
    reasons = [_dominant(faces, line, section) for line in lines]
    found = next((reason for reason in reasons if isinstance(reason, Turned)), None)
    if found:
        return found
    freeform = sum(isinstance(surface, Freeform) for surface in surfaces.values())
    if freeform:
        return LeftOut("freeform", Note(f"{freeform} of {len(faces)} faces"))
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
            return LeftOut("damaged", Note("its faces are turned inside out"))
    if not freeform:
        return LeftOut("no cylinder")
    detail = f"{len(freeform)} of {len(solid.faces)} faces"
    for face in freeform:
        radii = [edge.curve.radius for edge, _ in model.face(face).edges if isinstance(edge.curve, Circle)]
        if len(radii) > 1 and max(radii) - min(radii) < SHARE * radii[0]:
            text = f"{detail}, it looks like a cylinder of diameter {{}}"
            return LeftOut("freeform", Note(text, (2 * radii[0],)))
    return LeftOut("freeform", Note(detail))


def _broken(faces: list[Face], line: Line) -> LeftOut | None:
    """What does not fit together: open shells, vertices off their surfaces or circles."""
    tolerance = OFF_SURFACE / SHARE * line.tolerance
    uses, ways = Counter(), Counter()
    for face in faces:
        if not face.edges and not isinstance(face.surface, Torus | Sphere):
            return LeftOut("damaged", Note("a face has no edges"))
        for edge, forward in face.edges:
            uses[edge.record] += edge.curve is not None
            ways[edge.record] += (1 if forward else -1) * (edge.curve is not None)
            for point in (edge.start, edge.end):
                off = max(off_surface(face.surface, point), _off_curve(edge, point))
                if off > tolerance:
                    return LeftOut("damaged", Note("a vertex lies {} off its face or edge", (off,)))
    unsewn = sum(count == 1 for count in uses.values())
    if unsewn:
        return LeftOut("open", Note(f"{unsewn} edges bound one face only"))
    if any(way and uses[edge] == 2 for edge, way in ways.items()):
        return LeftOut("damaged", Note("two faces run along an edge the same way"))
    return None


def _off_curve(edge: Edge, point) -> float:
    if not isinstance(edge.curve, Circle):
        return 0.0
    return abs(norm(less(point, edge.curve.centre)) - edge.curve.radius)


def _dominant(faces: list[Face], line: Line, section: str) -> Turned | LeftOut:
    """The widest full cylinder of a solid that does not wholly revolve, if nothing stands out beyond it."""
    bands = [band_of(face, line) for face in faces if revolves(face.surface, line)]
    sections = sections_of(bands, line)
    if not sections:
        return LeftOut("no cylinder", Note("cones or tori only"))
    widest = sections[0]
    points = [line.zr(point) for face in faces for edge, _ in face.edges for point in _points(edge)]
    out = max(*(r for _, r in points), *(band.widest for band in bands)) - widest.radius
    if out > line.tolerance:
        return LeftOut("not a body of revolution", Note("something stands {} out of its cylinder", (out,)))
    cover = min(_cover(widest, line, end) for end in (widest.spans[0].low, widest.spans[-1].high))
    if cover < LEAST_COVER:
        return LeftOut("part of a cylinder", Note(f"{round(100 * cover)} % of the circumference"))
    broken = crooked(bands, line)
    if broken:
        return broken
    others = len(faces) - len(bands)
    whole = "" if cover > 1 - 1e-6 else f", {100 * cover:.3g} % of the circumference is left"
    notes = [Note(f"{others} of {len(faces)} faces do not revolve (keyway, drilled holes){whole}")]
    reached = [z for z, _ in points] + [z for band in bands for z in (band.low, band.high)]
    overall = Span(min(reached), max(reached))
    return drum_of(line, bands, choose(sections, section, notes), overall, notes)


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
