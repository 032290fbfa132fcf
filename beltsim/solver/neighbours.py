"""Lists of near pairs: contacts without history, history carried from one list to the next, who sums which pair.

A list holds all pairs whose surfaces are closer than the skin; it serves until some particle has moved half the skin.
Lists are sorted by their first index, so that every order of summation is fixed.
"""

from __future__ import annotations

import numpy as np

from beltsim.solver.jit import inner, kernel, maker
from beltsim.solver.ledger import carry_book
from beltsim.solver.state import Array, Contacts, Loads
from beltsim.solver.stretches import place_of


@kernel
def carry_history(new, old, new_key, old_key, row_origin, key_origin, half):
    """Copy the history of pairs that stand in both lists.

    Parameters
    ----------
    new, old : Contacts
    new_key, old_key : the arrays that tell the pairs of a row apart (`second`, or `first` for part lists)
    row_origin, key_origin : index in the old list of each row and key of the new one, -1 for none
    half : each pair stands in the row of its lower particle; particles that were sorted anew may have changed their
        roles, and what acts on the first acts with the opposite sign on the second
    """
    after = (
        0  # the place after the last one found: where the next one stands if both lists are in the same order
    )
    for row in range(new.start.size - 1):
        for k in range(new.start[row], new.start[row + 1]):
            old_row, wanted, sign = row_origin[row], key_origin[new_key[k]], 1.0
            if half and wanted < old_row:
                old_row, wanted, sign = wanted, old_row, -1.0
            if old_row < 0 or old_row >= old.start.size - 1 or wanted < 0:
                continue
            before, begin, end = after, old.start[old_row], old.start[old_row + 1]
            if before < begin or before >= end or old_key[before] != wanted:
                before = place_of(old_key, wanted, begin, end)
            if before >= 0:
                after = before + 1
                if old.stiffness[before] > 0.0:
                    copy_history(new, old, k, before, sign)


@inner
def copy_history(new, old, k, before, sign):
    """Copy the history of the old pair `before` to the new pair k, with a sign."""
    new.stiffness[k] = old.stiffness[before]
    for axis in range(3):
        new.spring[axis, k] = sign * old.spring[axis, before]
    carry_rolling(new.rolling, old.rolling, k, before, sign)
    carry_book(new.book, old.book, k, before, sign)


@inner
def carry_rolling(new, old, k, before, sign):
    """Copy a rolling moment, where there are any."""
    if new is not None:
        for axis in range(3):
            new[axis, k] = sign * old[axis, before]


@kernel
def link_neighbours(start, second, bonded_start, bonded, beside):
    """For each pair (sphere, box), the pairs of the same sphere with the box's first four bonded neighbours."""
    for row in range(start.size - 1):
        begin, end = start[row], start[row + 1]
        for k in range(begin, end):
            found = 0
            for n in range(bonded_start[second[k]], bonded_start[second[k] + 1]):
                other = place_of(second, bonded[n], begin, end)
                if other >= 0 and found < 4:
                    beside[found, k] = other
                    found += 1


def empty_contacts(start: Array, first: Array, second: Array, *, rolls=True, summed=True) -> Contacts:
    """Contacts without history for the pairs given.

    `rolls`: with rolling moments; `summed`: with loads, overlaps and links between the pairs of a particle.
    """
    pairs = first.size
    return Contacts(
        start=start,
        first=first,
        second=second,
        spring=np.zeros((3, pairs)),
        stiffness=np.zeros(pairs),
        rolling=np.zeros((3, pairs)) if rolls else None,
        loads=np.zeros((9, pairs)) if summed else None,
        overlap=np.full(pairs, -1.0) if summed else None,
        beside=np.full((4, pairs), -1, np.int32) if summed else None,
        carriers=np.zeros(pairs, np.uint32) if summed else None,
    )


def owners_of(start: Array) -> Array:
    """Row (pairs,) int32 that each pair of a list stands in, from the rows' start (rows + 1,)."""
    return np.repeat(np.arange(start.size - 1, dtype=np.int32), np.diff(start))


@maker
def sort_loads(particles, first):
    """Which pairs load each particle (`state.Loads`)."""
    start = np.zeros(particles + 1, np.int64)
    for k in range(first.size):
        start[first[k] + 1] += 1
    for i in range(particles):
        start[i + 1] += start[i]
    entry = np.empty(start[particles], np.int64)
    free = start[:-1].copy()
    for k in range(first.size):
        entry[free[first[k]]] = k
        free[first[k]] += 1
    return Loads(start, entry)
