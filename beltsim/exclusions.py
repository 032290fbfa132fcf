"""Pairs of boxes that must not touch: those of one belt that overlap by design, and broken ones until they part.

The cells of a belt overlap, so that a bond that breaks leaves two boxes deep inside each other: were they to touch at
once, they would fly apart. They stay excluded until they have been apart once. The same holds for cells that meet at a
corner without a bond of their own: boxes that at most three bonds lead from one to the other do not touch either. In a
grid, cells farther apart than that have no overlap unless the pitch is below 1.4 edge radii.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from beltsim.solver.box_contacts import boxes_overlap
from beltsim.solver.state import Bonds, Particles, Shapes


class Excluded(NamedTuple):
    """Pairs of boxes that do not touch; rows (2, p) are slots, the lower first, in ascending order."""

    linked: np.ndarray  # (2, p) int32, by up to three intact bonds
    waiting: np.ndarray  # (2, q) int32, linked once, and not apart since
    intact: int  # bonds that were intact then


def excluded_at_start(boxes: np.ndarray, bonds: Bonds | None) -> Excluded:
    """Exclusions among the slots `boxes` of a scene before its first step."""
    none = np.zeros((2, 0), np.int32)
    if bonds is None:
        return Excluded(none, none, 0)
    return Excluded(linked_pairs(boxes, bonds), none, int(np.count_nonzero(bonds.intact)))


def renewed(
    excluded: Excluded, boxes: np.ndarray, bonds: Bonds | None, particles: Particles, shapes: Shapes
) -> Excluded:
    """Exclusions at the present positions: newly unlinked pairs wait, those that are apart wait no longer."""
    linked, waiting = excluded.linked, excluded.waiting
    intact = 0 if bonds is None else int(np.count_nonzero(bonds.intact))
    if intact != excluded.intact:
        linked = linked_pairs(boxes, bonds)
        before = np.concatenate([excluded.linked, waiting], axis=1)
        waiting = before[:, ~np.isin(keys_of(before), keys_of(linked))]
    if waiting.shape[1]:
        waiting = waiting[:, boxes_overlap(particles, shapes, *np.ascontiguousarray(waiting))]
    return Excluded(linked, waiting, intact)


def keys_of(pairs: np.ndarray) -> np.ndarray:
    """One number (p,) int64 for each pair."""
    return (pairs[0].astype(np.int64) << 32) | pairs[1]


def linked_pairs(boxes: np.ndarray, bonds: Bonds) -> np.ndarray:
    """Pairs (2, p) of the slots `boxes` with at most three intact bonds from one to the other."""
    from scipy.sparse import coo_array

    whole = bonds.intact != 0
    first, second = bonds.first[whole], bonds.second[whole]
    size = int(max(boxes.max(initial=0), first.max(initial=0), second.max(initial=0))) + 1
    ones = np.ones(2 * first.size, bool)
    ends = np.concatenate([first, second]), np.concatenate([second, first])
    one = coo_array((ones, ends), shape=(size, size)).tocsr()
    two = one @ one
    i, j = (one + two + two @ one).nonzero()
    chosen = (i < j) & np.isin(i, boxes) & np.isin(j, boxes)
    pairs = np.stack([i[chosen], j[chosen]]).astype(np.int32)
    return pairs[:, np.argsort(keys_of(pairs))]


def by_particle(excluded: Excluded, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Who must not touch each of `count` particles: start (count + 1,) int64 and members int32."""
    pairs = np.concatenate([excluded.linked, excluded.waiting], axis=1)
    ends, others = np.concatenate([pairs[0], pairs[1]]), np.concatenate([pairs[1], pairs[0]])
    start = np.zeros(count + 1, np.int64)
    np.cumsum(np.bincount(ends, minlength=count), out=start[1:])
    return start, others[np.lexsort((others, ends))].astype(np.int32)
