"""A SAT text -> all rollers in it, what was left out and why, and what a person should be warned of."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from . import sat
from .drums import LeftOut, Turned
from .rollers import Roller, place
from .solids import REASONS, recognise
from .topology import Model, Solid, read_model

# Millimetres per unit of what CAD systems write.
UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "ft": 304.8, "yd": 914.4, "um": 0.001, "km": 1e6}
# Rollers of conveyors have diameters between these [m]; others point to a wrong unit.
USUAL_DIAMETERS = (0.005, 5.0)
# Reasons for leaving a solid out that a person should look at; beams and plates are only counted.
TOLD = ("conical", "freeform", "open", "damaged", "part of a cylinder")
MOST_TOLD = 5


@dataclass
class Found:
    """What a SAT text holds.

    rollers : every turned body, in file order
    left_out : (file line, CAD name, reason, detail) of the solids that are none
    unit_mm : millimetres per drawing unit that were used
    """

    header: sat.Header
    rollers: list[Roller]
    left_out: list[tuple[int, str, str, str]]
    solids: int
    unit_mm: float
    warnings: list[str] = field(default_factory=list)


def find_rollers(
    data: bytes, name: str, *, unit_mm: float | None = None, section: str = "largest", cones: bool = False
) -> Found:
    """All rollers of a SAT text, in metres.

    `unit_mm` overrides the header's millimetres per unit; `section` and `cones` as in `solids.recognise` and the
    command. Raises `sat.SatError` for text that is no SAT or damaged.
    """
    text = sat.read(data, name)
    model = read_model(text)
    warnings = list(text.warnings)
    unit = _unit(text, unit_mm, warnings)
    found = Found(text.header, [], [], len(model.solids), unit, warnings)
    for solid in model.solids:
        _sort_in(found, model, solid, recognise(model, solid, section=section), cones)
        model.forget()
    _warn(found, model)
    return found


def _unit(text: sat.SatText, given: float | None, warnings: list[str]) -> float:
    told = text.header.unit_mm
    if given is not None:
        return given
    if told is None:
        warnings.append(f"{text.name}: the file does not say its unit; taken as mm (--unit changes it)")
        return 1.0
    if not any(abs(told / known - 1) < 1e-6 for known in UNITS.values()):
        warnings.append(f"{text.name}:3: one unit of the file has {told:g} mm, which is no usual unit")
    return told


def _sort_in(found: Found, model: Model, solid: Solid, what: Turned | LeftOut, cones: bool) -> None:
    line, cad_name = model.sat.line(solid.lump), model.name(solid)
    if isinstance(what, LeftOut):
        scale = abs(model.transform(solid).scale) if what.detail.lengths else 1.0
        found.left_out.append((line, cad_name, what.reason, what.detail.in_mm(scale * found.unit_mm)))
        return
    roller = place(what, model.transform(solid), found.unit_mm, cad_name=cad_name, line=line)
    if what.conical and not cones:
        detail = f"largest diameter {1000 * roller.diameter:.6g} mm, {1000 * roller.drum.length:.6g} mm long"
        found.left_out.append((line, cad_name, "conical", detail))
    else:
        found.rollers.append(roller)


def _warn(found: Found, model: Model) -> None:
    name, warnings = model.sat.name, found.warnings
    if found.rollers:
        largest = max(roller.diameter for roller in found.rollers)
        if not USUAL_DIAMETERS[0] <= largest <= USUAL_DIAMETERS[1]:
            warnings.append(
                f"{name}: the largest diameter is {1000 * largest:.6g} mm at {found.unit_mm:g} mm per unit; "
                "is the unit wrong? (--unit changes it)"
            )
    if model.wires:
        bodies = "1 body" if model.wires == 1 else f"{model.wires} bodies"
        warnings.append(f"{name}: {bodies} of wires without faces left out")
    if model.loose_faces:
        warnings.append(f"{name}: {model.loose_faces} faces that belong to no solid left out")
    for reason in TOLD:
        left = [entry for entry in found.left_out if entry[2] == reason]
        for line, cad_name, _, detail in left[:MOST_TOLD]:
            who = f" ({cad_name})" if cad_name else ""
            more = f": {detail}" if detail else ""
            warnings.append(f"{name}:{line}: left out a solid{who} {REASONS[reason]}{more}")
        if len(left) > MOST_TOLD:
            warnings.append(f"{name}: and {len(left) - MOST_TOLD} more solids {REASONS[reason]}")
    notes = Counter(note for roller in found.rollers for note in roller.notes)
    for note, count in notes.items():
        first = next(roller for roller in found.rollers if note in roller.notes)
        others = f" and {count - 1} more" if count > 1 else ""
        warnings.append(f"{name}:{first.line}: {first.cad_name or 'cylinder'}{others}: {note}")
