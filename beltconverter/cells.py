"""Each particle's cell of the belt: its sides, mass and inertia, and the section widths of its bonds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .flat import Flat, tributary
from .frames import before_and_after
from .piece import Grid

EVEN = 0.01  # cells that differ by less are written as one size


class Cells(NamedTuple):
    """Stress-free cells of a belt.

    along, across : (R, C) sides of each particle's cell, m; longitudinal : (S, C) and transverse : (R, C - 1)
    section widths of the bonds, m; nominal : sides of the type's cell (a, b); is_even : whether one size fits all
    (but for the half cells of `--edge half`).
    """

    along: np.ndarray
    across: np.ndarray
    longitudinal: np.ndarray
    transverse: np.ndarray
    nominal: tuple[float, float]
    is_even: bool


def cells_of(grid: Grid, flat: Flat, *, half_edges: bool) -> Cells:
    """Cells whose areas add up to the belt's stress-free area, and whose widths to its width and length.

    With `half_edges` the outer nodes lie on the belt's edge: half a cell, else a whole one.
    """
    rows = len(grid.points)
    lengths = np.broadcast_to(flat.lengths.mean(axis=1, keepdims=True), flat.lengths.shape)
    widths = np.broadcast_to(flat.widths.mean(axis=0), flat.widths.shape)
    is_even = all(np.ptp(values) < EVEN * values.mean() for values in (lengths, widths))
    if is_even:
        lengths, widths = (np.full(values.shape, values.mean()) for values in (lengths, widths))
    along = tributary(lengths, ring=grid.is_ring, half_ends=half_edges)
    across = tributary(widths.T, ring=False, half_ends=half_edges).T
    _, across_next = before_and_after(across, grid.kind)
    longitudinal = ((across + across_next) / 2)[: rows if grid.is_ring else rows - 1]
    transverse = (along[:, 1:] + along[:, :-1]) / 2
    return Cells(
        along, across, longitudinal, transverse, (float(lengths.mean()), float(widths.mean())), is_even
    )


def inertia(mass: np.ndarray, along: np.ndarray, across: np.ndarray, thickness: np.ndarray) -> np.ndarray:
    """Principal moments (..., 3), kg m2, of cuboid cells."""
    a, b, c = along**2, across**2, thickness**2
    return np.stack([mass * (b + c), mass * (a + c), mass * (a + b)], axis=-1) / 12
