"""How the rows of a list of pairs are shared out in chunks, and which pairs cross from one chunk to another.

A chunk owns a stretch of the particles that stay for the whole run, as a belt, and a stretch of the free ones, the bulk
that lies there: cut by slots alone, half of the pairs of a loaded belt crossed.
"""

from __future__ import annotations

import math

import numpy as np

from beltsim.solver.jit import maker
from beltsim.solver.state import Array, Crossings

REACHES = 16
"""How long a stretch is, in mean distances of partners: some 6 % of the pairs cross. Stretches of 2048 particles let
41 % cross in a box of 80,000, whose loads took 3 times as long to add up."""

LEAST = 512
"""Particles of a chunk at least: below, handing it out costs more than it brings."""


PIECE = 4096
"""Pairs of a piece at most: some thousand particles, whose state fits into the second-level cache."""


def crossings_of(start: Array, second: Array, permanent: int) -> Crossings:
    """Crossings of the list whose rows are start (n + 1,) and whose second particles are second (p,).

    The first `permanent` particles stay for the whole run, the others are free and sorted by place.
    """
    bounds = bounds_of(start, second, permanent)
    crossing = count_crossing(start, second, bounds)
    place = np.concatenate([[0], np.cumsum(crossing)])
    piece, owner, pair = pieces_of(start[bounds])
    return Crossings(
        start=bounds,
        piece=piece,
        owner=owner,
        pair=pair,
        stop=np.array([second[low:high].max() + 1 for low, high in pair.T], np.int64),
        place=place,
        count=np.zeros_like(crossing),
        loads=np.zeros((place[-1], 6)),
        loaded=np.zeros(place[-1], np.int32),
    )


def pieces_of(pairs: Array) -> tuple[Array, Array, Array]:
    """`Crossings.piece`, `owner` and `pair` of chunks whose pairs of each kind end at pairs (2, c + 1)."""
    # Of both kinds of a chunk, then of the next chunk.
    first, last = pairs[:, :-1].T.ravel(), pairs[:, 1:].T.ravel()
    count = -(-(last - first) // PIECE)
    whose = np.repeat(np.arange(count.size), count)
    begin = first[whose] + PIECE * (np.arange(whose.size) - (np.cumsum(count) - count)[whose])
    piece = np.concatenate([[0], np.cumsum(count)[1::2]])
    return piece, whose // 2, np.stack([begin, np.minimum(begin + PIECE, last[whose])])


def bounds_of(start: Array, second: Array, permanent: int) -> Array:
    """Ends (2, chunks + 1) of the stretches of permanent and of free particles that the chunks own.

    The kind with more pairs of its own is cut into stretches of about the same work, the other one where its partners
    are.
    """
    count = start.size - 1
    pairs, reach, rows, partners = survey(start, second, permanent)
    if count > permanent and pairs[1] >= pairs[0]:
        free = even_ends(start, permanent, count, reach[1])
        return np.stack([following_ends(0, permanent, rows, partners, free), free])
    kept = even_ends(start, 0, permanent, reach[0])
    order = np.argsort(partners, kind="stable")
    return np.stack([kept, following_ends(permanent, count, partners[order], rows[order], kept)])


@maker
def survey(start, second, permanent):
    """What a list looks like.

    Returns
    -------
    pairs (2,), reach (2,) : of two permanent and of two free particles how many pairs there are, and how many slots
        they are apart in the mean
    rows, partners : the permanent and the free particles of the other pairs
    """
    pairs, reach, mixed = np.zeros(2, np.int64), np.zeros(2), 0
    rows, partners = np.empty(start[permanent], np.int64), np.empty(start[permanent], np.int64)
    for i in range(start.size - 1):
        kind = 0 if i < permanent else 1
        for k in range(start[i], start[i + 1]):
            j = second[k]
            if i < permanent <= j:
                rows[mixed], partners[mixed] = i, j
                mixed += 1
            else:
                pairs[kind] += 1
                reach[kind] += j - i
    return pairs, reach / np.maximum(pairs, 1), rows[:mixed].copy(), partners[:mixed].copy()


def even_ends(start: Array, low: int, high: int, reach: float) -> Array:
    """Ends (chunks + 1,) of stretches of the particles low to high with about the same work.

    `reach` = mean distance of partners. The number of stretches is even, so that two threads get the same.
    """
    size = max(LEAST, REACHES * reach)
    chunks = 1 if high - low < size else 2 * math.ceil((high - low) / (2.0 * size))
    work = start[low : high + 1] + np.arange(high - low + 1)
    inner = np.searchsorted(work, work[0] + (work[-1] - work[0]) * np.arange(1, chunks) / chunks)
    return np.concatenate([[low], low + inner, [high]])


def following_ends(low: int, high: int, slots: Array, partners: Array, ends: Array) -> Array:
    """Ends (chunks + 1,) of stretches of the particles low to high, so that few pairs cross.

    `slots` (p,), ascending, are those of them with partners of the other kind, whose stretches end at `ends`.
    """
    chunks = ends.size - 1
    if slots.size == 0:
        return np.linspace(low, high, chunks + 1).astype(np.int64)
    earlier = np.cumsum(np.bincount(np.searchsorted(ends, partners, "right") - 1, minlength=chunks))
    inner = slots[np.minimum(earlier[:-1], slots.size - 1)]
    return np.concatenate([[low], inner, [high]])


@maker
def count_crossing(start, second, bounds):
    """How many pairs of each chunk have a second particle of another one."""
    owner, crossing = np.empty(start.size - 1, np.int32), np.zeros(bounds.shape[1] - 1, np.int64)
    for kind in range(2):
        for chunk in range(bounds.shape[1] - 1):
            for i in range(bounds[kind, chunk], bounds[kind, chunk + 1]):
                owner[i] = chunk
    for i in range(start.size - 1):
        for k in range(start[i], start[i + 1]):
            crossing[owner[i]] += owner[second[k]] != owner[i]
    return crossing
