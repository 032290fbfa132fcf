"""Points in columns along z: what every search for near pairs walks through.

Columns are hashed, so one particle a million kilometres away costs nothing, and the members of each are sorted by z:
two neighbouring columns are swept side by side, and one look-up serves all members of a column.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from beltsim.solver.jit import inner, inner_maker, maker
from beltsim.solver.stretches import sort_stretch, starts_of

Array = np.ndarray

ROW = 1 << 32  # keys of two columns side by side along x differ by this, along y by 1


class Columns(NamedTuple):
    """Particles by column and, within it, by z; row c of `key` and `start` is column c."""

    cell: float  # edge of a column, m
    widest: float  # largest bounding radius, m
    bucket: Array  # (buckets,) int32 hash table: 1 + number of the column, 0 where empty
    key: Array  # (columns,) int64
    start: Array  # (columns + 1,) int64
    member: Array  # (n,) int32 particles
    x: Array  # (n,) m, of each member
    y: Array  # (n,) m
    z: Array  # (n,) m
    radius: Array  # (n,) m, bounding


@inner
def cell_of(value, cell):
    """Cell coordinate; clipped so that any finite position fits an integer."""
    return np.int64(math.floor(max(-1e15, min(1e15, value / cell))))


@inner
def key_of(x, y, cell):
    """Key of the column at x and y. Columns billions of cells apart may share one: their members are just not near."""
    return cell_of(x, cell) * ROW + cell_of(y, cell)


@inner
def first_bucket(key, buckets):
    """Bucket in which to begin looking for a key; eight columns along y stand together in a cache line."""
    block = np.uint64(key >> 3)
    block = (block ^ (block >> np.uint64(29))) * np.uint64(0x9E3779B97F4A7C15)
    return np.int64(((block >> np.uint64(32)) << np.uint64(3)) + np.uint64(key & 7)) & (buckets - 1)


@inner
def find_bucket(bucket, keys, key):
    """The bucket that holds a key, or the empty one where it belongs."""
    place = first_bucket(key, bucket.size)
    while bucket[place] != 0 and keys[bucket[place] - 1] != key:
        place = (place + 1) & (bucket.size - 1)
    return place


@inner
def column_of(columns, key):
    """Number of the column with this key, -1 if it has no members."""
    return columns.bucket[find_bucket(columns.bucket, columns.key, key)] - 1


@inner_maker
def number_columns(position, chosen, cell, bucket):
    """Column of each chosen particle (n,), and the key of each column, in order of appearance."""
    keys = np.empty(chosen.size, np.int64)
    column = np.empty(chosen.size, np.int32)
    found, last = 0, -1
    for n in range(chosen.size):
        key = key_of(position[0, chosen[n]], position[1, chosen[n]], cell)
        if last < 0 or keys[last] != key:
            place = find_bucket(bucket, keys, key)
            if bucket[place] == 0:
                keys[found] = key
                found += 1
                bucket[place] = found
            last = bucket[place] - 1
        column[n] = last
    return column, keys[:found].copy()


@maker
def columns_of(position, bounding, chosen, cell):
    """Columns of edge `cell` [m], in order of appearance, of the particles `chosen` (int32) at `position` (3, n)."""
    buckets = 16
    while buckets < 2 * chosen.size:
        buckets *= 2
    bucket = np.zeros(buckets, np.int32)
    column, key = number_columns(position, chosen, cell, bucket)
    start = starts_of(column, key.size)
    member, z = np.empty(chosen.size, np.int32), np.empty(chosen.size)
    free = start[:-1].copy()
    for n in range(chosen.size):
        place = free[column[n]]
        free[column[n]] = place + 1
        member[place], z[place] = chosen[n], position[2, chosen[n]]
    x, y, radius = np.empty(chosen.size), np.empty(chosen.size), np.empty(chosen.size)
    widest = 0.0
    for c in range(key.size):
        sort_stretch(z, member, start[c], start[c + 1])
        for place in range(start[c], start[c + 1]):
            i = member[place]
            x[place], y[place], radius[place] = position[0, i], position[1, i], bounding[i]
            widest = max(widest, radius[place])
    return Columns(cell, widest, bucket, key, start, member, x, y, z, radius)
