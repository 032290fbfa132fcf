"""Bonds: the geometry of their stress-free states, bonds given twice, and the rules that give them their type."""

from __future__ import annotations

import numpy as np

from .deck import Block, Deck
from .errors import Problems
from .lookup import AllRows, Particles, is_pattern, matches

# Below this share of a unit vector the normal direction of a section counts as undefined and local y takes over.
_LEAST_NORMAL = 0.1


def bond_row_problems(block: Block, problems: Problems) -> None:
    """Note bonds of a particle with itself, of length zero, or without section axes."""
    ids = block.rows["particles"]
    itself = ids[:, 0] == ids[:, 1]
    problems.add_rows(
        block, np.flatnonzero(itself), lambda i: f"a bond of {ids[i, 0]} with itself", "two particles"
    )
    first, second = block.rows["position_1"], block.rows["position_2"]
    length = np.linalg.norm(second - first, axis=1)
    rounding = 4 * np.finfo(float).eps * np.maximum(np.abs(first), np.abs(second)).max(axis=1, initial=0.0)
    zero = length <= rounding
    problems.add_rows(
        block,
        np.flatnonzero(zero & ~itself),
        lambda i: f"a bond of length {length[i]:.3g} between {ids[i, 0]} and {ids[i, 1]}",
        "stress-free positions that differ",
    )
    axis = (second - first) / np.where(zero, 1.0, length)[:, None]
    problems.add_rows(
        block,
        np.flatnonzero(~zero & ~itself & ~_has_section_axes(block, axis)),
        lambda i: f"a bond of {ids[i, 0]} and {ids[i, 1]} whose local z and y both lie along it or cancel",
        "orientations that tell the normal of the section",
    )


def _has_section_axes(block: Block, axis: np.ndarray) -> np.ndarray:
    """Whether e3 can be made: from the mean local z, else the mean local y, else local z of particle 1.

    The last is for the seam of a Moebius belt, where both means cancel: its neighbours lie upside down.
    """
    quaternions = block.rows["orientation_1"], block.rows["orientation_2"]
    normal = _share_across(sum(map(_local_z, quaternions)) / 2, axis)
    fine = normal >= _LEAST_NORMAL
    if not fine.all():
        fine |= _share_across(sum(map(_local_y, quaternions)) / 2, axis) > 1e-6
        fine |= _share_across(_local_z(quaternions[0]), axis) >= _LEAST_NORMAL
    return fine


def _share_across(vectors: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Length of what is left of each vector when it is made normal to the axis."""
    along = np.einsum("ij,ij->i", vectors, axis)
    return np.linalg.norm(vectors - along[:, None] * axis, axis=1)


def _local_z(quaternions: np.ndarray) -> np.ndarray:
    w, x, y, z = quaternions.T
    return np.column_stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])


def _local_y(quaternions: np.ndarray) -> np.ndarray:
    w, x, y, z = quaternions.T
    return np.column_stack([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)])


def repeated_bonds(deck: Deck, problems: Problems) -> None:
    """Note every bond of two particles that have one already, in either order."""
    rows = AllRows(deck, "BOND")
    pairs = np.sort(rows.column("particles"), axis=1)
    if len(pairs) < 2:
        return
    order = np.lexsort(pairs.T[::-1])
    again = np.flatnonzero((np.diff(pairs[order], axis=0) == 0).all(axis=1)) + 1

    def found(i: int) -> str:
        first = int(np.flatnonzero((pairs == pairs[i]).all(axis=1))[0])
        return f"a second bond of {pairs[i, 0]} and {pairs[i, 1]}, first at {rows.where(first)}"

    problems.add_some(order[again], rows.where, found, "one bond for each pair of particles")


# --- types by rule -----------------------------------------------------------------------------------------------


def bond_type_of(deck: Deck, type_a: str, type_b: str, written_type: str) -> str:
    """Name of the bond type of bonds between two particle types: that of the best *BOND RULE, else the written one.

    The rule with more exact names wins; *BOND RULE counts as exact with SAME if its first name is, and OTHER is
    no exact name. Of equal ones the first is taken; that they agree is `check_case`'s.
    """
    best = best_rules(deck.blocks("BOND RULE"), type_a, type_b)
    return best[0]["BOND TYPE"] if best else written_type


def best_rules(rules: list[Block], type_a: str, type_b: str) -> list[Block]:
    """The matching rules of highest rank; more than one with differing bond types is an error of the deck."""
    ranked = [(_rank(rule), rule) for rule in rules if _rule_matches(rule, type_a, type_b)]
    highest = max((rank for rank, _ in ranked), default=0)
    return [rule for rank, rule in ranked if rank == highest]


def _rule_matches(rule: Block, type_a: str, type_b: str) -> bool:
    first, second = rule["PARTICLE TYPE A"], rule["PARTICLE TYPE B"]
    if second == "SAME":
        return type_a == type_b and matches(type_a, first)
    if second == "OTHER":
        return type_a != type_b and (matches(type_a, first) or matches(type_b, first))
    return (matches(type_a, first) and matches(type_b, second)) or (
        matches(type_b, first) and matches(type_a, second)
    )


def _rank(rule: Block) -> int:
    first = not is_pattern(rule["PARTICLE TYPE A"])
    second = rule["PARTICLE TYPE B"]
    return 2 * first if second == "SAME" else first + (second != "OTHER" and not is_pattern(second))


def bond_rule_problems(deck: Deck, particles: Particles, problems: Problems) -> None:
    """Note rules of equal rank that give bonds between the same two particle types differing bond types."""
    rules = deck.blocks("BOND RULE")
    if not rules:
        return
    for a, b in bonded_type_pairs(deck, particles):
        best = best_rules(rules, particles.names[a], particles.names[b])
        differing = [rule for rule in best if rule["BOND TYPE"] != best[0]["BOND TYPE"]]
        for rule in differing:
            found = (
                f"a rule for {particles.names[a]} and {particles.names[b]} that differs from {best[0].where}"
            )
            problems.add(rule.where, found, "rules of equal rank to agree, or one with more exact names")


def bonded_type_pairs(deck: Deck, particles: Particles) -> list[tuple[int, int]]:
    """Pairs of indices into `particles.names`, low first, of which at least one bond exists."""
    index = particles.index(AllRows(deck, "BOND").column("particles"))
    index = index[(index >= 0).all(axis=1)]
    pairs = np.sort(particles.types[index], axis=1) if len(index) else np.empty((0, 2), np.int64)
    return [(int(a), int(b)) for a, b in np.unique(pairs, axis=0)]
