"""Rollers -> Deck: parts, or particles that are held in place, with their material and what was converted."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from beltsim import inp

from .rollers import Roller, geometry_name, quaternion_of

COLOURS = {"PULLEY": "#cc3333", "IDLER": "#3366cc"}
# Hues that stay apart for colour-blind eyes (Okabe and Ito), one a geometry.
PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#f0e442", "#666666")


@dataclass(frozen=True)
class Material:
    """Name, density [kg/m3], Young's modulus [Pa] and Poisson's ratio of the rollers."""

    name: str = "steel"
    density: float = 7850.0
    youngs_modulus: float = 2.1e11
    poisson_ratio: float = 0.3


def deck_of(
    rollers: list[Roller],
    *,
    output: str = "parts",
    material: Material = Material(),
    colour_by: str = "class",
    colours: dict[str, str] = COLOURS,
    prefix: str = "",
    first_id: int = 1,
    ramp: float = 0.0,
    settings: list[str] = (),
    result: list[str] = (),
) -> inp.Deck:
    """The deck of named rollers.

    output : "parts", "particles", or "auto": pulleys as parts, idlers as particles
    colour_by : "class", "geometry" or "none"
    ramp : time [s] in which driven rollers reach their speed, 0 = from the start
    settings, result : lines of the two *INFO blocks
    """
    deck = inp.Deck()
    deck.add("FORMAT", name="BELTSIM", version=1)
    deck.add("INFO", title="CONVERSION SETTINGS", rows={"text": list(settings)})
    deck.add("INFO", title="RESULT", rows={"text": [*result, *geometry_lines(rollers)]})
    deck.add(
        "MATERIAL",
        name=material.name,
        density=material.density,
        youngs_modulus=material.youngs_modulus,
        poisson_ratio=material.poisson_ratio,
    )
    amplitude = f"{prefix}ramp" if ramp and any(roller.speed is not None for roller in rollers) else None
    if amplitude:
        deck.add("AMPLITUDE", name=amplitude, rows={"time": [0.0, ramp], "factor": [0.0, 1.0]})
    looks = {"material": material.name, "colour_by": colour_by, "colours": colours, "amplitude": amplitude}
    parts = [roller for roller in rollers if is_part(roller, output)]
    _add_parts(deck, parts, **looks)
    _add_particles(deck, [r for r in rollers if not is_part(r, output)], prefix, first_id, **looks)
    return deck


def is_part(roller: Roller, output: str) -> bool:
    """Whether a roller is written as a part."""
    return output == "parts" or (output == "auto" and roller.kind == "PULLEY")


def geometry_lines(rollers: list[Roller]) -> list[str]:
    """One line for each geometry: class, sizes, count and the rule that made the class."""
    first = {roller.geometry: roller for roller in reversed(rollers)}
    counts = Counter(roller.geometry for roller in rollers)
    return [
        f"geometry {i} = {roller.kind}, diameter {roller.diameter:.6g} m, length {roller.length:.6g} m, "
        f"{counts[number]} identical ({roller.rule})"
        for i, (number, roller) in enumerate(sorted(first.items()), 1)
    ]


def _sizes(roller: Roller, colour_by: str, colours: dict[str, str], material: str) -> dict:
    colour = colours[roller.kind] if colour_by == "class" else PALETTE[roller.geometry % len(PALETTE)]
    return {
        "shape": "CYLINDER",
        "diameter": roller.diameter,
        "length": roller.length,
        "edge_radius": roller.edge_radius,
        "class": roller.kind,
        "color": None if colour_by == "none" else colour,
        "material": material,
    }


def _add_parts(deck, rollers, *, material, colour_by, colours, amplitude):
    for roller in rollers:
        row = {"position": [roller.centre], "orientation": [quaternion_of(roller.axis)]}
        deck.add("PART", name=roller.name, rows=row, **_sizes(roller, colour_by, colours, material))
    for roller in rollers:
        if roller.speed is not None:
            deck.add(
                "MOTION",
                part=roller.name,
                type="ROTATION",
                angular_velocity=roller.speed,
                amplitude=amplitude,
            )


def _add_particles(deck, rollers, prefix, first_id, *, material, colour_by, colours, amplitude):
    """One type for each geometry and spin, since a motion drives a type; ids in the order of the rollers."""
    types: dict[tuple, list[tuple[int, Roller]]] = {}
    for number, roller in enumerate(rollers, first_id):
        types.setdefault((roller.kind, roller.geometry, roller.speed), []).append((number, roller))
    names = _type_names([members[0][1] for members in types.values()], prefix)
    for name, members in zip(names, types.values()):
        sizes = _sizes(members[0][1], colour_by, colours, material)
        deck.add("PARTICLE TYPE", name=name, fixed="POSITION", **sizes)
    for name, members in zip(names, types.values()):
        rows = {
            "id": [number for number, _ in members],
            "position": [roller.centre for _, roller in members],
            "orientation": [quaternion_of(roller.axis) for _, roller in members],
        }
        deck.add("PARTICLE", type=name, rows=rows)
    for name, members in zip(names, types.values()):
        speed = members[0][1].speed
        if speed is not None:
            motion = {"type": "ROTATION", "angular_velocity": speed, "amplitude": amplitude}
            deck.add("MOTION", particle_type=name, **motion)


def _type_names(rollers: list[Roller], prefix: str) -> list[str]:
    stems = [prefix + geometry_name(roller) for roller in rollers]
    repeated, seen, names = Counter(stems), Counter(), []
    for stem in stems:
        seen[stem] += 1
        names.append(f"{stem}_{seen[stem]}" if repeated[stem] > 1 else stem)
    return names
