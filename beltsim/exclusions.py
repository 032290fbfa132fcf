"""Pairs of particles that must not touch: those of one belt that overlap by design, and broken ones until they part.

The cells of a belt overlap, so that a bond that breaks leaves two of them deep inside each other: were they to touch at
once, they would fly apart. They stay excluded until they have been apart once. Boxes of a belt reach farther than to
those that they are bonded to: those with at most three bonds from one to the other do not touch either. In a grid,
cells farther apart than that have no overlap unless the pitch is below 1.4 edge radii.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from beltsim.solver.box_contacts import pairs_overlap
from beltsim.solver.state import Bonds, Particles, Shapes


class Excluded(NamedTuple):
    """Pairs that do not touch though contact groups let them; rows (2, p) are slots, the lower first, in order."""

    linked: np.ndarray  # (2, p) int32, by intact bonds
    waiting: np.ndarray  # (2, q) int32, linked once, and not apart since
    intact: int  # bonds that were intact then
    start: (
        np.ndarray
    )  # (m,) int64: particle i must not touch member[start[i]:start[i + 1]]; none has a higher number
    member: np.ndarray  # (2 (p + q),) int32, ascending for each particle


def excluded_at_start(boxes: np.ndarray, bonds: Bonds | None, shapes: Shapes) -> Excluded:
    """Exclusions of a scene before its first step; `boxes` = slots of rounded boxes if any of them may touch."""
    none = np.zeros((2, 0), np.int32)
    if bonds is None:
        return indexed(none, none, 0)
    return indexed(linked_pairs(boxes, bonds, shapes), none, int(np.count_nonzero(bonds.intact)))


def renewed(
    excluded: Excluded, boxes: np.ndarray, bonds: Bonds | None, particles: Particles, shapes: Shapes
) -> Excluded:
    """Exclusions at the present positions: newly unlinked pairs wait, those that are apart wait no longer."""
    linked, waiting = excluded.linked, excluded.waiting
    intact = 0 if bonds is None else int(np.count_nonzero(bonds.intact))
    if intact == excluded.intact and not waiting.size:
        return excluded
    if intact != excluded.intact:
        linked = linked_pairs(boxes, bonds, shapes)
        before = np.concatenate([excluded.linked, waiting], axis=1)
        waiting = before[:, ~np.isin(keys_of(before), keys_of(linked))]
    if waiting.size:
        waiting = waiting[:, pairs_overlap(particles, shapes, *np.ascontiguousarray(waiting))]
    return indexed(linked, waiting, intact)


def keys_of(pairs: np.ndarray) -> np.ndarray:
    """One number (p,) int64 for each pair."""
    return (pairs[0].astype(np.int64) << 32) | pairs[1]


def linked_pairs(boxes: np.ndarray, bonds: Bonds, shapes: Shapes) -> np.ndarray:
    """Pairs (2, p) with an intact bond, and of boxes with up to three from one to the other, that groups let touch."""
    from scipy.sparse import coo_array

    whole = bonds.intact != 0
    first, second = bonds.first[whole], bonds.second[whole]
    size = int(max(first.max(initial=0), second.max(initial=0))) + 1
    ends = np.concatenate([first, second]), np.concatenate([second, first])
    one = coo_array((np.ones(2 * first.size, bool), ends), shape=(size, size)).tocsr()
    kept = (first != second) & touchable(shapes, first, second)
    keys = [keys_of(np.sort(np.stack([first, second])[:, kept], axis=0))]
    if boxes.size:
        two = one @ one
        i, j = (two + two @ one).nonzero()
        kept = (i < j) & np.isin(i, boxes) & np.isin(j, boxes)
        i, j = i[kept], j[kept]
        keys.append(keys_of(np.stack([i, j])[:, touchable(shapes, i, j)]))
    keys = np.unique(np.concatenate(keys))
    return np.stack([keys >> 32, keys & 0xFFFFFFFF]).astype(np.int32)


def touchable(shapes: Shapes, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Whether contact groups let the particles i and j touch."""
    return shapes.may_touch[shapes.group[i], shapes.group[j]]


def indexed(linked: np.ndarray, waiting: np.ndarray, intact: int) -> Excluded:
    """Exclusions with the list of each particle."""
    pairs = np.concatenate([linked, waiting], axis=1)
    ends, others = np.concatenate([pairs[0], pairs[1]]), np.concatenate([pairs[1], pairs[0]])
    start = np.zeros(int(ends.max(initial=-1)) + 2, np.int64)
    np.cumsum(np.bincount(ends, minlength=start.size - 1), out=start[1:])
    return Excluded(linked, waiting, intact, start, others[np.lexsort((others, ends))].astype(np.int32))


def by_particle(excluded: Excluded, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Who must not touch each of `count` particles: start (count + 1,) and members."""
    start = excluded.start
    return np.concatenate([start, np.full(count + 1 - start.size, start[-1])]), excluded.member
