"""How the rows of a list of pairs are shared out in chunks, and which pairs cross from one chunk to another."""

from __future__ import annotations

import numpy as np

from beltsim.solver.jit import maker
from beltsim.solver.state import Array, Crossings

CHUNK = 2048
"""Particles of a chunk, on average: the fewer, the more pairs cross; four threads still share 20,000 particles."""


def bounds_of(start: Array) -> Array:
    """First particle (chunks + 1,) of each chunk, so that all have about the same work.

    `start` (n + 1,) are the pairs of each row. The number of chunks is even, so that two threads get the same.
    """
    particles = start.size - 1
    chunks = 1 if particles < CHUNK else 2 * -(-particles // (2 * CHUNK))
    work = start + np.arange(particles + 1)
    inner = np.searchsorted(work, work[-1] * np.arange(1, chunks) / chunks)
    return np.concatenate([[0], inner, [particles]]).astype(np.int64)


def crossings_of(start: Array, second: Array) -> Crossings:
    """Crossings of the list whose rows are start (n + 1,) and whose second particles are second (p,)."""
    bounds = bounds_of(start)
    column, incoming_start, incoming, loaded = share_out(start, second, bounds)
    return Crossings(bounds, column, np.zeros((6, incoming.size)), incoming_start, incoming, loaded)


@maker
def share_out(start, second, bounds):
    """Columns of the crossing pairs, and the same columns sorted by the particle that they load."""
    column = np.full(second.size, -1, np.int32)
    count = np.zeros(start.size, np.int64)
    crossing = 0
    for chunk in range(bounds.size - 1):
        for k in range(start[bounds[chunk]], start[bounds[chunk + 1]]):
            if second[k] >= bounds[chunk + 1]:
                column[k] = crossing
                crossing += 1
                count[second[k] + 1] += 1
    for i in range(start.size - 1):
        count[i + 1] += count[i]
    incoming, loaded = np.empty(crossing, np.int32), np.empty(crossing, np.int32)
    incoming_start = count[bounds]
    for k in range(second.size):
        if column[k] >= 0:
            place = count[second[k]]
            incoming[place], loaded[place] = column[k], second[k]
            count[second[k]] += 1
    return column, incoming_start, incoming, loaded
