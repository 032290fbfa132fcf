"""A spatial hash of points: linear in their number, whatever the extent of the scene.

Cells are hashed into a power of two of buckets instead of laid out densely, so one particle a million kilometres away
costs nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from beltsim.solver.jit import inner, kernel

Array = np.ndarray


class HashGrid(NamedTuple):
    """Points sorted by bucket."""

    cell: float  # edge of a cell, m
    mask: int  # buckets - 1
    start: Array  # (buckets + 1,) int64
    member: Array  # (points,) int32, the particles in bucket order
    corner: Array  # (points, 3) int64 cell of each member


@inner
def cell_of(value, cell):
    """Cell coordinate; clipped so that any finite position fits an integer."""
    return np.int64(math.floor(max(-1e15, min(1e15, value / cell))))


@inner
def bucket_of(ix, iy, iz, mask):
    """Bucket of a cell (Teschner et al. 2003)."""
    return ((ix * 73856093) ^ (iy * 19349663) ^ (iz * 83492791)) & mask


@kernel
def hash_points(position, chosen, cell):
    """HashGrid of the particles `chosen` (int32), at `position` (3, n), with cells of edge `cell` [m]."""
    buckets = 16
    while buckets < 2 * chosen.size:
        buckets *= 2
    mask = buckets - 1
    corners = np.empty((chosen.size, 3), np.int64)
    start = np.zeros(buckets + 1, np.int64)
    for n in range(chosen.size):
        for axis in range(3):
            corners[n, axis] = cell_of(position[axis, chosen[n]], cell)
        start[bucket_of(corners[n, 0], corners[n, 1], corners[n, 2], mask) + 1] += 1
    for bucket in range(buckets):
        start[bucket + 1] += start[bucket]
    member = np.empty(chosen.size, np.int32)
    corner = np.empty((chosen.size, 3), np.int64)
    free = start[:-1].copy()
    for n in range(chosen.size):
        bucket = bucket_of(corners[n, 0], corners[n, 1], corners[n, 2], mask)
        place = free[bucket]
        free[bucket] = place + 1
        member[place] = chosen[n]
        corner[place] = corners[n]
    return HashGrid(cell, mask, start, member, corner)


@inner
def members_of(grid, ix, iy, iz):
    """First and past-last place of the bucket that holds cell (ix, iy, iz); check `is_in` for each."""
    bucket = bucket_of(ix, iy, iz, grid.mask)
    return grid.start[bucket], grid.start[bucket + 1]


@inner
def is_in(grid, place, ix, iy, iz):
    """Whether the member at `place` lies in this cell and not in another one of the same bucket."""
    return grid.corner[place, 0] == ix and grid.corner[place, 1] == iy and grid.corner[place, 2] == iz
