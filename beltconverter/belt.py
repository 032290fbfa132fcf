"""A belt as it is converted: its grid, its stress-free state, its properties and how its particles are made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .cells import Cells
from .flat import Flat
from .piece import Grid
from .properties import Sheet, mass_per_area


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


def masses(belt: Belt) -> np.ndarray:
    """Mass (R, C) of each particle, kg."""
    per_area = np.array([mass_per_area(sheet) for sheet in belt.sheets])[belt.zone]
    return per_area * belt.cells.along * belt.cells.across
