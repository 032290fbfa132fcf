"""The list of cylinders that fly near parts: two pairs for each, one for either half, and how their history is kept."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from beltsim.solver.neighbours import carry_history, empty_contacts, owners_of
from beltsim.solver.part_pairs import part_pairs
from beltsim.solver.rods import Rods
from beltsim.solver.state import Contacts, Particles, Parts, Shapes


class ListedRods(NamedTuple):
    """Halves of cylinders that fly near parts; rows of the contacts are parts, `beside[0]` says which half."""

    contacts: Contacts
    rods: Rods


def list_rods(
    particles: Particles, shapes: Shapes, parts: Parts, part_group: np.ndarray, rods: Rods, skin: float
) -> ListedRods:
    """Pairs at the present positions; two cylinders that fly are a pair once, of the earlier with the later's part."""
    start, first = part_pairs(particles.position, shapes, rods.particle, parts, part_group, skin, True)
    second = owners_of(start)
    flying = np.full(parts.radius.size, np.iinfo(np.int32).max, np.int32)
    flying[rods.part] = rods.particle
    kept = first < flying[second]
    first, second = np.repeat(first[kept], 2), np.repeat(second[kept], 2)
    start = np.searchsorted(second, np.arange(start.size)).astype(np.int64)
    contacts = empty_contacts(start, first, second)
    contacts.beside[0] = np.arange(first.size) % 2
    return ListedRods(contacts, rods)


def carry_rods(new: ListedRods, old: ListedRods, origin: np.ndarray, parts: int) -> None:
    """Copy contact history from the old list; `origin` is the old slot of each particle, -1 for new ones."""
    halves = np.where(origin[:, None] < 0, -1, 2 * origin[:, None] + np.arange(2)).ravel()
    keys = [2 * one.contacts.first.astype(np.int64) + one.contacts.beside[0] for one in (new, old)]
    carry_history(new.contacts, old.contacts, *keys, np.arange(parts, dtype=np.int64), halves, False)
