"""A belt's bonds, bond types and bond rules as blocks of a Deck."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from beltsim.inp import Deck

from .belt import Belt, Making, ids_of
from .frames import before_and_after
from .properties import Direction, Sheet, longitudinal, transverse

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
UPSIDE_DOWN = (0.0, 1.0, 0.0, 0.0)  # half a turn about local x


class Bonds(NamedTuple):
    """Bonds of one direction, flattened.

    particles : (B, 2) ids; vector : (B, 3) stress-free place of the second in the frame of the first, m;
    orientation : (B, 4) of the second there; zone : (B,); width : (B,) of the section, m.
    """

    particles: np.ndarray
    vector: np.ndarray
    orientation: np.ndarray
    zone: np.ndarray
    width: np.ndarray


def add_bonds(deck: Deck, belt: Belt, making: Making) -> None:
    """Append bond types with their bonds, and rules where the names of fibres tell the types."""
    ids = ids_of(belt, making)
    along = _add_direction(deck, belt, making, "longitudinal", _longitudinal(belt, ids))
    across = _add_direction(deck, belt, making, "transverse", _transverse(belt, ids))
    if making.fibres != "none" and len(along) == len(across) == 1:
        pattern = f"{making.prefix}{making.fibre_name}_*"
        deck.add("BOND RULE", particle_type_a=pattern, particle_type_b="SAME", bond_type=along[0])
        deck.add("BOND RULE", particle_type_a=pattern, particle_type_b="OTHER", bond_type=across[0])


def _longitudinal(belt: Belt, ids: np.ndarray) -> Bonds:
    lengths = belt.flat.lengths
    used = slice(len(lengths))
    after, zone_after = (before_and_after(values, belt.grid.kind)[1] for values in (ids, belt.zone))
    orientation = np.tile(UPRIGHT, (*lengths.shape, 1))
    if belt.grid.kind == "moebius":
        orientation[-1] = UPSIDE_DOWN  # so the neighbours across the seam lie, without any stress
    vector = np.stack([lengths, 0 * lengths, 0 * lengths], axis=-1)
    pairs = np.stack([ids, after], axis=-1)[used]
    return _flattened(pairs, vector, orientation, belt.zone[used], zone_after[used], belt.cells.longitudinal)


def _transverse(belt: Belt, ids: np.ndarray) -> Bonds:
    shifts, widths = belt.flat.shifts, belt.flat.widths
    pairs = np.stack([ids[:, :-1], ids[:, 1:]], axis=-1)
    vector = np.stack([shifts, widths, 0 * widths], axis=-1)
    orientation = np.tile(UPRIGHT, (*widths.shape, 1))
    return _flattened(pairs, vector, orientation, belt.zone[:, :-1], belt.zone[:, 1:], belt.cells.transverse)


def _flattened(pairs, vector, orientation, zone, zone_after, width) -> Bonds:
    """A bond belongs to a zone if both its particles do, else to the belt."""
    zone = np.where(zone == zone_after, zone, 0)
    rows = pairs.reshape(-1, 2), vector.reshape(-1, 3), orientation.reshape(-1, 4)
    return Bonds(*rows, zone.ravel(), width.ravel())


def _add_direction(deck: Deck, belt: Belt, making: Making, direction: str, bonds: Bonds) -> list[str]:
    """One bond type and one block for each zone and section width; returns the types' names."""
    names = []
    stem = f"{making.prefix}{making.bond_name}{direction}"
    of = longitudinal if direction == "longitudinal" else transverse
    for zone, number, chosen in _kinds(bonds):
        sheet = belt.sheets[zone]
        parts = [stem, belt.zone_names[zone], f"w{number}" if number > 1 else ""]
        names.append("_".join(part for part in parts if part))
        width = float(bonds.width[chosen[0]])
        deck.add("BOND TYPE", name=names[-1], **_type_parameters(of(sheet), sheet, width))
        rows = {
            "particles": bonds.particles[chosen],
            "position_1": np.zeros((len(chosen), 3)),
            "orientation_1": np.tile(UPRIGHT, (len(chosen), 1)),
            "position_2": bonds.vector[chosen],
            "orientation_2": bonds.orientation[chosen],
        }
        deck.add("BOND", type=names[-1], rows=rows)
    return names


def _kinds(bonds: Bonds) -> Iterator[tuple[int, int, np.ndarray]]:
    """Zone, number and bonds (indices) of each zone and section width; number 1 is the zone's commonest width."""
    steps = np.round(
        bonds.width / bonds.width.max() * 1e10
    )  # sums of equal numbers differ in their last bits only
    for zone in np.unique(bonds.zone).tolist():
        inside = np.flatnonzero(bonds.zone == zone)
        _, kind, counts = np.unique(steps[inside], return_inverse=True, return_counts=True)
        groups = np.split(np.argsort(kind, kind="stable"), np.cumsum(counts)[:-1])
        for number, k in enumerate(np.argsort(-counts, kind="stable").tolist(), start=1):
            yield zone, number, inside[groups[k]]


def _type_parameters(direction: Direction, sheet: Sheet, width: float) -> dict:
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
