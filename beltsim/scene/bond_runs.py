"""The order of bonds in the solver: runs of slots between consecutive particles, cut into pieces.

In a grid all bonds along the belt are one run and all bonds across it another, with a gap of one slot at the end of
each row. Pieces stand in the order of the particles that they load, chunk by chunk: see `solver.bonds`.
"""

from __future__ import annotations

import numpy as np

from beltsim.solver.bond_tiles import TILE
from beltsim.solver.chunks import CHUNK
from beltsim.solver.state import Runs

SHORTEST_RUN = 8  # bonds: one vector of doubles; shorter runs cost more in calls than gathering does
LONGEST_GAP = (
    16  # slots: at 5 ns each, what a piece costs by its call and its bonds beyond the last whole vector
)


def in_runs(first: np.ndarray, second: np.ndarray, kind: np.ndarray) -> tuple[np.ndarray, Runs]:
    """Order of the bonds (m,), and the pieces of the runs that they form in it.

    Bonds in runs shorter than `SHORTEST_RUN` are scattered: those of a kind stand together at the end of their chunk.
    """
    run = runs_of(first, second, kind)
    scattered = np.bincount(run)[run] < SHORTEST_RUN
    low, high = np.minimum(first, second), np.maximum(first, second)
    chunk = low // CHUNK
    # Bonds that load more than their own chunk and the next one stand after all chunks.
    chunks = int(chunk.max()) + 1
    chunk = np.where(high // CHUNK > chunk + 1, chunks, chunk)
    tile = np.where(scattered, np.iinfo(np.int64).max, low // TILE)
    run = np.where(scattered, kind, run)
    order = np.lexsort((first, run, tile, chunk))

    def change(values):
        return np.diff(values[order]) != 0

    group = np.concatenate([[0], np.cumsum(change(chunk) | change(tile) | change(run))])
    place = np.arange(order.size) - np.searchsorted(group, group)
    full = np.where(scattered[order], place // TILE, 0)
    start = np.flatnonzero(np.concatenate([[True], (np.diff(group) != 0) | (np.diff(full) != 0)]))
    piece = np.repeat(np.arange(start.size), np.diff(np.append(start, order.size)))
    # The slot of a bond in its piece: a scattered one takes the next, one of a run stands where its particle does.
    slot = np.where(scattered, 0, first)[order]
    slot = np.where(scattered[order], np.arange(order.size) - start[piece], slot - slot[start][piece])
    count = slot[np.append(start[1:], order.size) - 1] + 1
    base = np.cumsum(count) - count
    bond = np.full(count.sum(), -1, np.int32)
    bond[base[piece] + slot] = np.arange(order.size)
    alone = scattered[order][start]
    return order, Runs(
        first=np.where(alone, -1, first[order][start]).astype(np.int64),
        second=np.where(alone, -1, second[order][start]).astype(np.int64),
        base=base.astype(np.int64),
        count=count.astype(np.int64),
        kind=kind[order][start].astype(np.int32),
        bond=bond,
        chunk=np.searchsorted(chunk[order][start], np.arange(chunks + 1)).astype(np.int64),
    )


def runs_of(first: np.ndarray, second: np.ndarray, kind: np.ndarray) -> np.ndarray:
    """Number (m,) of each bond's run: bonds of one kind between particles equally far apart, in the order of the first.

    A run goes over gaps of up to `LONGEST_GAP` slots that are no longer than the stretch of bonds before them.
    """
    order = np.lexsort((first, second - first, kind))
    gap = np.diff(first[order]) - 1
    apart = (np.diff(kind[order]) != 0) | (np.diff((second - first)[order]) != 0)
    ends = np.flatnonzero(apart | (gap != 0))
    stretch = np.diff(ends, prepend=-1)
    bridged = ~apart[ends] & (gap[ends] >= 0) & (gap[ends] <= np.minimum(stretch, LONGEST_GAP))
    run = np.zeros(order.size, np.int64)
    run[ends[~bridged] + 1] = 1
    number = np.empty(order.size, np.int64)
    number[order] = np.cumsum(run)
    return number
