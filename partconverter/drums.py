"""Bands round one axis -> the turned body: drum with its fillets, chamfers and crowns, journals and bore."""

from __future__ import annotations

from typing import NamedTuple

from .profiles import Band, Line, sides_told
from .surfaces import Cone, Torus

# Chamfers, fillets and crowns belong to the drum; a cone or fillet that takes more of the radius is an end cap.
END_DROP = 0.25


class Note(NamedTuple):
    """What a person should know: a text with a place for each of some lengths in drawing units."""

    text: str
    lengths: tuple[float, ...] = ()

    def in_mm(self, unit_mm: float) -> str:
        """The text with its lengths in mm."""
        return self.text.format(*(f"{length * unit_mm:.6g} mm" for length in self.lengths))


class LeftOut(NamedTuple):
    """A solid that is no roller: why in one of `solids.REASONS`, and what was found."""

    reason: str
    detail: Note = Note("")


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
    notes: list[Note]


class Section(NamedTuple):
    """All outer cylinder faces of one radius: their stretches along the axis, and the faces."""

    radius: float
    spans: list[Span]
    bands: list[Band]

    @property
    def length(self) -> float:
        """Length of cylinder, without the gaps."""
        return sum(span.length for span in self.spans)


def turned(line: Line, bands: list[Band], section: str) -> Turned | LeftOut:
    """The drum of a solid whose faces all revolve round `line`."""
    broken = crooked(bands, line)
    if broken:
        return broken
    overall = Span(min(band.low for band in bands), max(band.high for band in bands))
    widest = max((band for band in bands if band.side > 0), key=lambda band: band.widest, default=None)
    if widest is None:
        return LeftOut("damaged", Note("no face has its material within"))
    sections = sections_of(bands, line)
    if not sections or (section == "largest" and widest.widest > sections[0].radius + line.tolerance):
        return _conical(line, bands, widest, overall)
    notes: list[Note] = []
    chosen = choose(sections, section, notes)
    return drum_of(line, bands, chosen, overall, notes)


def sections_of(bands: list[Band], line: Line) -> list[Section]:
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


def choose(sections: list[Section], section: str, notes: list[Note]) -> Section:
    """The "largest" or the "longest" of the sections; what a person should know of the choice goes to `notes`."""
    longest = max(sections, key=lambda s: s.length)
    chosen = longest if section == "longest" else sections[0]
    if chosen is not longest and chosen.length < longest.length / 2:
        text = (
            "the largest cylinder (diameter {}, {} long) is shorter than that of diameter {} ({} long): "
            "--section longest takes the other"
        )
        notes.append(Note(text, (2 * chosen.radius, chosen.length, 2 * longest.radius, longest.length)))
    if len(chosen.spans) > 1:
        share = round(100 * chosen.length / (chosen.spans[-1].high - chosen.spans[0].low))
        text = f"{len(chosen.spans)} cylinders of the same diameter in a row, taken as one ({share} % of it)"
        notes.append(Note(text))
    return chosen


def drum_of(line, bands, chosen: Section, overall: Span, notes) -> Turned:
    """The body whose straight part is `chosen`, grown over the fillets, chamfers and crowns that touch it."""
    face = Span(chosen.spans[0].low, chosen.spans[-1].high)
    low, low_fillet, low_radius = _grow(bands, line, face.low, chosen.radius, -1, END_DROP * chosen.radius)
    high, high_fillet, high_radius = _grow(bands, line, face.high, chosen.radius, 1, END_DROP * chosen.radius)
    crown = chosen.radius - min(low_radius, high_radius)
    if crown > line.tolerance:
        notes.append(Note("crowned: diameter {} at its ends", (2 * (chosen.radius - crown),)))
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
    notes = [Note("conical or barrel-shaped: no straight part, its largest diameter is taken")]
    return Turned(line, widest.widest, drum, drum, overall, _bore(bands, line, overall), 0.0, True, notes)


def crooked(bands: list[Band], line: Line) -> LeftOut | None:
    """Bands that cannot be: cylinders of no length, normals that contradict the loops."""
    if any(band.is_cylinder and band.high - band.low < line.tiny for band in bands):
        return LeftOut("damaged", Note("a cylinder has no length"))
    if len(sides_told(bands, line)) > 1:
        return LeftOut("damaged", Note("its faces disagree on the side of the material"))
    return None
