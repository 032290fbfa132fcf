"""A belt's grid and data sheet to the blocks of a Deck."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from beltsim.console import UsageProblem
from beltsim.inp import Deck

from .cells import Cells, inertia
from .flat import Flat
from .frames import angular_velocities, before_and_after
from .piece import Grid
from .properties import Direction, Sheet, longitudinal, mass_per_area, transverse


class Belt(NamedTuple):
    """One belt, SI.

    axes : (R, C, 3, 3) body to world; orientation : (R, C, 4); zone : (R, C) index into `sheets`, 0 is the belt's
    own sheet; names of the zones in `zone_names` (the first is empty).
    """

    grid: Grid
    axes: np.ndarray
    orientation: np.ndarray
    flat: Flat
    cells: Cells
    zone: np.ndarray
    sheets: list[Sheet]
    zone_names: list[str]


@dataclass(frozen=True)
class Making:
    """How particles are shaped, named and set going.

    elongation : meshed over stress-free length along and across; edge_radius, overlap and sphere_radius in m, None
    for their defaults; touching_columns : columns at each edge that may touch those of the other edge; speed m/s.
    """

    shape: str = "box"
    edge_radius: float | None = None
    overlap: float | None = None
    sphere_radius: float | None = None
    elongation: tuple[float, float] = (1.0, 1.0)
    fibres: str = "none"
    fibre_name: str = "fibre"
    bond_name: str = ""
    name: str = "belt"
    prefix: str = ""
    touching_columns: int = 0
    speed: float | None = None
    material: str = "rubber"
    first_id: int = 1


def ids_of(belt: Belt, making: Making) -> np.ndarray:
    """Particle ids (R, C), counted across the belt first."""
    rows, columns = belt.zone.shape
    return making.first_id + np.arange(rows * columns).reshape(rows, columns)


def add_belt(deck: Deck, belt: Belt, making: Making) -> None:
    """Append contact groups, particle types, particles, velocities, bond types, rules and bonds of one belt."""
    ids = ids_of(belt, making)
    _add_groups(deck, making)
    _add_particles(deck, belt, making, ids)
    _add_sizes(deck, belt, making, ids)
    if making.speed is not None:
        velocity = making.speed * belt.axes[..., 0]
        spin = angular_velocities(belt.grid, belt.axes, making.speed)
        rows = {
            "id": ids.ravel(),
            "velocity": velocity.reshape(-1, 3),
            "angular_velocity": spin.reshape(-1, 3),
        }
        deck.add(
            "INITIAL VELOCITY",
            rows={name: values + 0.0 if name != "id" else values for name, values in rows.items()},
        )
    along = _add_bonds(
        deck, belt, making, "longitudinal", belt.cells.longitudinal, *_longitudinal_rows(belt, ids)
    )
    across = _add_bonds(deck, belt, making, "transverse", belt.cells.transverse, *_transverse_rows(belt, ids))
    _add_rules(deck, making, along, across)


def _group(making: Making, side: str = "") -> str:
    return f"{making.prefix}{making.name}{side and '_' + side}"


def _add_groups(deck: Deck, making: Making) -> None:
    for side in ("", "left", "right") if making.touching_columns else ("",):
        deck.add("CONTACT GROUP", name=_group(making, side), belt=_group(making))
    if making.touching_columns:
        deck.add(
            "CONTACT GROUP PAIR",
            group_a=_group(making, "left"),
            group_b=_group(making, "right"),
            contact=True,
        )


def _sides(columns: int, touching: int) -> list[str]:
    """Contact group of each column: the positive local y is on the left."""
    if 2 * touching > columns:
        raise UsageProblem(f"--touching-edges {touching}: the belt has {columns} columns only")
    return ["right" if j < touching else "left" if j >= columns - touching else "" for j in range(columns)]


def _fibre_names(columns: int, making: Making) -> list[str]:
    if making.fibres == "none":
        return [making.name] * columns
    digits = max(3, len(str(columns)))
    numbers = [1 + j % 2 if making.fibres == "alternating" else 1 + j for j in range(columns)]
    digits = 1 if making.fibres == "alternating" else digits
    return [f"{making.fibre_name}_{number:0{digits}d}" for number in numbers]


def _add_particles(deck: Deck, belt: Belt, making: Making, ids: np.ndarray) -> None:
    columns = belt.zone.shape[1]
    sides = _sides(columns, making.touching_columns)
    fibres = _fibre_names(columns, making)
    kinds: dict[tuple[str, str, int], list[int]] = {}
    for j in range(columns):
        for zone in np.unique(belt.zone[:, j]).tolist():
            kinds.setdefault((fibres[j], sides[j], zone), []).append(j)
    for (fibre, side, zone), at in kinds.items():
        parts = [fibre, side, belt.zone_names[zone]]
        name = making.prefix + "_".join(part for part in parts if part)
        deck.add(
            "PARTICLE TYPE",
            name=name,
            **_type_parameters(belt, making, zone),
            contact_group=_group(making, side),
        )
        chosen = np.zeros(belt.zone.shape, bool)
        chosen[:, at] = belt.zone[:, at] == zone
        rows = {
            "id": ids[chosen],
            "position": belt.grid.points[chosen],
            "orientation": belt.orientation[chosen],
        }
        deck.add("PARTICLE", type=name, rows=rows)


def _type_parameters(belt: Belt, making: Making, zone: int) -> dict:
    sheet = belt.sheets[zone]
    along, across = (np.array(side) for side in belt.cells.nominal)
    mass = mass_per_area(sheet) * along * across
    ix, iy, iz = inertia(mass, along, across, np.array(sheet.thickness)).tolist()
    body = {
        "mass": float(mass),
        "inertia_x": ix,
        "inertia_y": iy,
        "inertia_z": iz,
        "material": making.material,
    }
    x, y, z = outer_size(along, across, sheet, making).tolist()
    if making.shape == "sphere":
        return {"shape": "SPHERE", "radius": x / 2, **body}
    return {
        "shape": "ROUNDED BOX",
        "size_x": x,
        "size_y": y,
        "size_z": z,
        "edge_radius": edge_radius(sheet, making),
        **body,
    }


def edge_radius(sheet: Sheet, making: Making) -> float:
    """Radius of the boxes' edges, m: 0.4 of the thickness unless stated."""
    return 0.4 * sheet.thickness if making.edge_radius is None else making.edge_radius


def outer_size(along: np.ndarray, across: np.ndarray, sheet: Sheet, making: Making) -> np.ndarray:
    """Outer sizes (..., 3), m, of particles in their cells: as meshed, longer by the overlap, so that flats meet."""
    sides = np.stack([along * making.elongation[0], across * making.elongation[1]], axis=-1)
    if making.shape == "sphere":
        overlap = making.overlap or 0.0
        sphere = (
            np.full(sides.shape[:-1], 2 * (making.sphere_radius or 0.0))
            if making.sphere_radius
            else sides.max(axis=-1) + overlap
        )
        return np.repeat(sphere[..., None], 3, axis=-1)
    overlap = 2 * edge_radius(sheet, making) if making.overlap is None else making.overlap
    return np.concatenate([sides + overlap, np.full((*sides.shape[:-1], 1), sheet.thickness)], axis=-1)


def masses(belt: Belt) -> np.ndarray:
    """Mass (R, C) of each particle, kg."""
    per_area = np.array([mass_per_area(sheet) for sheet in belt.sheets])[belt.zone]
    return per_area * belt.cells.along * belt.cells.across


def _add_sizes(deck: Deck, belt: Belt, making: Making, ids: np.ndarray) -> None:
    """Rows for the cells that differ from their type's: all of a graded belt, the half cells of an even one."""
    cells = belt.cells
    nominal = cells.nominal
    differs = ~(
        np.isclose(cells.along, nominal[0], rtol=1e-9) & np.isclose(cells.across, nominal[1], rtol=1e-9)
    )
    if not differs.any():
        return
    mass = masses(belt)
    size, moments = np.empty((*mass.shape, 3)), np.empty((*mass.shape, 3))
    for zone, sheet in enumerate(belt.sheets):
        at = belt.zone == zone
        size[at] = outer_size(cells.along[at], cells.across[at], sheet, making)
        moments[at] = inertia(mass[at], cells.along[at], cells.across[at], np.full(at.sum(), sheet.thickness))
    rows = {"id": ids[differs], "size": size[differs], "mass": mass[differs], "inertia": moments[differs]}
    deck.add("PARTICLE SIZE", rows=rows)


def _longitudinal_rows(belt: Belt, ids: np.ndarray) -> tuple:
    """Particle pairs, stress-free vector (S, C, 3) and orientation of the second particle, and the zones."""
    lengths = belt.flat.lengths
    used = len(lengths)
    _, after = before_and_after(ids, belt.grid.kind)
    _, zone_after = before_and_after(belt.zone, belt.grid.kind)
    pairs = np.stack([ids, after], axis=-1)[:used]
    vector = np.stack([lengths, np.zeros_like(lengths), np.zeros_like(lengths)], axis=-1)
    turned = np.zeros((*lengths.shape, 4))
    turned[..., 0] = 1.0
    if belt.grid.kind == "moebius":
        turned[-1] = (
            0.0,
            1.0,
            0.0,
            0.0,
        )  # across the seam the neighbour lies upside down, without any stress
    return pairs, vector, turned, _bond_zone(belt.zone[:used], zone_after[:used])


def _transverse_rows(belt: Belt, ids: np.ndarray) -> tuple:
    widths = belt.flat.widths
    pairs = np.stack([ids[:, :-1], ids[:, 1:]], axis=-1)
    vector = np.stack([belt.flat.shifts, widths, np.zeros_like(widths)], axis=-1)
    same = np.zeros((*widths.shape, 4))
    same[..., 0] = 1.0
    return pairs, vector, same, _bond_zone(belt.zone[:, :-1], belt.zone[:, 1:])


def _bond_zone(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """A bond belongs to a zone if both its particles do, else to the belt."""
    return np.where(one == other, one, 0)


def _add_bonds(deck, belt, making, direction, widths, pairs, vector, turned, zone) -> list[str]:
    """One bond type and one block for each zone and section width; returns the types' names."""
    names = []
    for at, index, name in _kinds_of_bonds(belt, making, direction, widths, zone):
        names.append(name)
        sheet = belt.sheets[index]
        of = longitudinal if direction == "longitudinal" else transverse
        width = float(widths[at][0])
        deck.add("BOND TYPE", name=name, **_bond_parameters(of(sheet), sheet, width))
        rows = {
            "particles": pairs[at],
            "position_1": np.zeros((len(pairs[at]), 3)),
            "orientation_1": np.tile([1.0, 0.0, 0.0, 0.0], (len(pairs[at]), 1)),
            "position_2": vector[at],
            "orientation_2": turned[at],
        }
        deck.add("BOND", type=name, rows=rows)
    return names


def _kinds_of_bonds(belt, making, direction, widths, zone) -> Iterator[tuple[np.ndarray, int, str]]:
    """Mask of the bonds, zone and name of each kind; of a zone's widths the commonest has the plain name."""
    steps = np.round(widths / widths.max() * 1e10)  # sums of equal numbers differ in their last bits only
    for index in np.unique(zone).tolist():
        stem = f"{making.prefix}{making.bond_name}{direction}" + (
            f"_{belt.zone_names[index]}" if index else ""
        )
        found, counts = np.unique(steps[zone == index], return_counts=True)
        for number, k in enumerate(np.argsort(-counts, kind="stable").tolist()):
            yield (
                (zone == index) & (steps == found[k]),
                index,
                stem if number == 0 else f"{stem}_w{number + 1}",
            )


def _bond_parameters(direction: Direction, sheet: Sheet, width: float) -> dict:
    section = {"section_width": width, "section_thickness": sheet.thickness}
    if sheet.bond_radius is not None:
        section = {"radius": sheet.bond_radius}
    return {
        **section,
        "youngs_modulus": direction.youngs_modulus,
        "poisson_ratio": sheet.poisson_ratio,
        "reduction_factor": direction.reduction_factor,
        "in_plane_reduction_factor": sheet.in_plane_reduction_factor,
        "damping_factor": sheet.damping_factor,
        "torsion": "GRID",
        "tensile_strength": direction.tensile_strength,
        "shear_strength": sheet.shear_strength,
    }


def _add_rules(deck: Deck, making: Making, along: list[str], across: list[str]) -> None:
    """Bond types by fibre names, where names alone tell them; else each bond keeps that of its block."""
    if making.fibres == "none" or len(along) > 1 or len(across) > 1:
        return
    pattern = f"{making.prefix}{making.fibre_name}_*"
    deck.add("BOND RULE", particle_type_a=pattern, particle_type_b="SAME", bond_type=along[0])
    deck.add("BOND RULE", particle_type_a=pattern, particle_type_b="OTHER", bond_type=across[0])
