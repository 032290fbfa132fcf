"""Which particles are near one another.

The largest ones, within a factor of two, are searched for among all, in columns as wide as they need, then the rest
likewise: a boulder in sand does not make every grain look at every other one. Where all are alike, as in most scenes,
that is a single sweep.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import pairwise

import numpy as np

from beltsim.solver.columns import ROW, column_of, columns_of
from beltsim.solver.jit import inner, kernel, maker
from beltsim.solver.state import Array, Shapes
from beltsim.solver.stretches import sort_stretch, starts_of
from beltsim.solver.together import together

AROUND = (0, 1, ROW - 1, ROW, ROW + 1, -1, 1 - ROW, -ROW, -ROW - 1)
"""Keys of a column and of its neighbours, less its own; by the first five any two neighbours meet once."""


ENOUGH_TO_SHARE = 3000
"""Particles from which a second thread pays: below, waking it costs what it saves, 0.1 ms."""


def particle_pairs(
    position: Array,
    shapes: Shapes,
    owners: Array,
    members: Array | None,
    skin: float,
    apart: tuple[Array, Array],
    team: int | None = None,
) -> tuple[Array, Array]:
    """Pairs of `owners` with `members` whose bounding spheres are closer than the skin; row i: particle i.

    Parameters
    ----------
    owners : (n,) int32 particles
    members : likewise, others than the owners; None: the owners, each pair once, at the lower particle
    apart : start (particles + 1,) and member: whom each particle must not touch (`beltsim.exclusions`)
    team : threads, None for one; the pairs are the same

    Returns
    -------
    start : (particles + 1,) int64
    second : (pairs,) int32, ascending within a row
    """
    position, bounding, half = flattened(position), shapes.bounding, members is None
    choosy = apart[1].size > 0 or not shapes.may_touch.all()
    found = [np.empty((2, 0), np.int32)]
    for some, others, cell in by_size(owners, members, bounding, skin):
        own = columns_of(position, bounding, some, cell)
        other = own if others is None else columns_of(position, bounding, others, cell)
        rules = (others is None, skin, choosy, shapes, *apart)
        ends = even_stretches(own.start, 1 if team is None or some.size < ENOUGH_TO_SHARE else team)
        found += together(team, [partial(swept, own, other, *stretch, *rules) for stretch in pairwise(ends)])
    pairs = np.concatenate(found, axis=1)
    return rows_of(pairs, pairs.shape[1], position.shape[1], half)


def even_stretches(start: Array, count: int) -> list[int]:
    """Ends (count + 1,) of stretches of the columns that start at start (columns + 1,), with about as many members."""
    return np.searchsorted(start, np.linspace(0, start[-1], count + 1)).tolist()


def swept(own, other, begin: int, end: int, *rules) -> Array:
    """Near pairs (2, p) of the columns `begin` to `end` of `own` with those of `other`; `rules` as in `sweep`."""
    pairs, total = np.empty((2, 16 + 6 * int(own.start[end] - own.start[begin])), np.int32), 0
    while begin < end:
        begin, total = sweep(own, other, begin, end, *rules, pairs, total)
        if begin < end:
            pairs = doubled(pairs, total)
    return pairs[:, :total]


def flattened(position: Array) -> Array:
    """Positions with the shortest side of the scene last: columns then follow the order in which spheres are sorted."""
    sides = np.argsort(-np.ptp(position, axis=1), kind="stable") if position.size else [0, 1, 2]
    return position[sides]


def by_size(
    owners: Array, members: Array | None, bounding: Array, skin: float
) -> Iterator[tuple[Array, Array | None, float]]:
    """Whom to look for among whom, None: among themselves; and the width of the columns that this needs [m]."""
    among = owners if members is None else members
    while owners.size and among.size:
        widest = bounding[owners].max(), bounding[among].max()
        cell = float(sum(widest) + skin)
        large, small = parted(owners, bounding, 0.5 * max(widest))
        if members is None:
            yield large, None, cell
            yield small, large, cell
            owners = among = small
        else:
            large_among, small_among = parted(among, bounding, 0.5 * max(widest))
            yield large, among, cell
            yield small, large_among, cell
            owners, among = small, small_among


def parted(chosen: Array, bounding: Array, limit: float) -> tuple[Array, Array]:
    """Those of some particles whose bounding radius is at least a limit, and the others."""
    large = bounding[chosen] >= limit
    return (chosen, chosen[:0]) if large.all() else (chosen[large], chosen[~large])


def doubled(pairs: Array, total: int) -> Array:
    """Room (2, 2 n) for twice as many pairs, with those there are."""
    larger = np.empty((2, 2 * pairs.shape[1]), pairs.dtype)
    larger[:, :total] = pairs[:, :total]
    return larger


@kernel
def sweep(own, other, begin, end, alike, skin, choosy, shapes, apart_start, apart, pairs, total):
    """Add the near pairs of the columns `begin` to `end` of `own` with those of `other`, themselves if `alike`.

    Returns the first column that did not fit, and the number of pairs.
    """
    around = AROUND
    first, second = pairs[0], pairs[1]
    for c in range(begin, end):
        before = total
        for n in range(5 if alike else 9):
            d = column_of(other, own.key[c] + around[n])
            if d >= 0:
                total = join(own, c, other, d, alike and n == 0, skin, first, second, total)
                if total < 0:
                    return c, before
        if choosy:
            total = keep_touching(shapes, apart_start, apart, first, second, before, total)
    return end, total


@inner
def join(own, c, other, d, same, skin, first, second, total):
    """Add the near pairs of two columns, each once if they are the `same`; their number, -1 if they may not fit.

    A pair is written and counted only if it is near: no branch to be guessed wrong in the innermost loop.
    """
    x, y, z, radius, member = other.x, other.y, other.z, other.radius, other.member
    low, end = other.start[d], other.start[d + 1]
    wide = other.widest + skin
    for p in range(own.start[c], own.start[c + 1]):
        i, px, py, pz, reach = own.member[p], own.x[p], own.y[p], own.z[p], own.radius[p] + skin
        lowest, highest = pz - (own.widest + wide), pz + (own.radius[p] + wide)
        while low < end and z[low] < lowest:
            low += 1
        if total + (end - low) > first.size:
            return -1
        q = p + 1 if same else low
        while q < end and z[q] <= highest:
            dx, dy, dz, apart = x[q] - px, y[q] - py, z[q] - pz, radius[q] + reach
            first[total], second[total] = i, member[q]
            total += np.int64(dx * dx + dy * dy + dz * dz < apart * apart)
            q += 1
    return total


@inner
def keep_touching(shapes, apart_start, apart, first, second, begin, total):
    """Keep only those of the pairs from `begin` on that may touch; their new number."""
    kept = begin
    for k in range(begin, total):
        i, j = first[k], second[k]
        if shapes.may_touch[shapes.group[i], shapes.group[j]] and not is_among(apart_start, apart, i, j):
            first[kept], second[kept] = i, j
            kept += 1
    return kept


@inner
def is_among(start, member, i, j):
    """Whether j stands in row i."""
    found = False
    for n in range(start[i], start[i + 1]):
        found = found or member[n] == j
    return found


@maker
def rows_of(pairs, total, count, half):
    """Start (count + 1,) and second (total,) of pairs in any order; if `half` the lower particle owns a pair."""
    first, second = pairs[0, :total], pairs[1, :total]
    if half:
        for k in range(total):
            if first[k] > second[k]:
                first[k], second[k] = second[k], first[k]
    start = starts_of(first, count)
    free = start[:-1].copy()
    row = np.empty(total, np.int32)
    for k in range(total):
        row[free[first[k]]] = second[k]
        free[first[k]] += 1
    for i in range(count):
        sort_stretch(row, row, start[i], start[i + 1])
    return start, row
