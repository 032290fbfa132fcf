"""Which materials can touch, and the contact property of two materials.

Particles touch particles and parts; parts, and particles held by FIXED, never touch one another. Contact groups
decide as the format says; bonded pairs never touch while no bond can break.
"""

from __future__ import annotations

from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np

from .deck import Block, Deck
from .errors import Problems
from .lookup import AllRows, Particles, by_name


def contact_property(deck: Deck, material_a: str, material_b: str) -> Block | None:
    """The *CONTACT PROPERTY of two materials, None if there is none: the exact pair, else one `*`, else two."""
    best = best_properties(deck.blocks("CONTACT PROPERTY"), material_a, material_b)
    return best[0] if best else None


def best_properties(properties: list[Block], material_a: str, material_b: str) -> list[Block]:
    """The matching properties with the fewest `*`."""
    ranked = []
    for block in properties:
        given = (block["MATERIAL A"], block["MATERIAL B"])
        for pair in (given, given[::-1]):
            if pair[0] in ("*", material_a) and pair[1] in ("*", material_b):
                ranked.append((given.count("*"), block))
                break
    fewest = min((stars for stars, _ in ranked), default=0)
    return [block for stars, block in ranked if stars == fewest]


class ContactGroups(NamedTuple):
    """What the deck says of contact groups: `pairs` {two names: whether they touch}, `belts` {name: belt}."""

    pairs: dict[frozenset[str], bool]
    belts: dict[str, str | None]

    def touch(self, group_a: str | None, group_b: str | None) -> bool:
        """Whether particles or parts of two groups touch; None = without a group."""
        if group_a is None or group_b is None:
            return True
        said = self.pairs.get(frozenset((group_a, group_b)))
        if said is not None:
            return said
        belt_a, belt_b = self.belts.get(group_a), self.belts.get(group_b)
        return group_a != group_b and (belt_a is None or belt_a != belt_b)


def contact_groups(deck: Deck) -> ContactGroups:
    """The contact groups of a deck, ready for the question which of them touch."""
    return ContactGroups(
        {
            frozenset((pair["GROUP A"], pair["GROUP B"])): pair["CONTACT"]
            for pair in deck.blocks("CONTACT GROUP PAIR")
        },
        {name: group.get("BELT") for name, group in by_name(deck, "CONTACT GROUP").items()},
    )


class _Kind(NamedTuple):
    """Bodies that count as one for the question what can touch."""

    material: str
    group: str | None
    held: bool
    is_part: bool


def contact_problems(deck: Deck, particles: Particles, problems: Problems) -> None:
    """Note pairs of materials that can touch and have no contact property, or two that contradict."""
    properties = deck.blocks("CONTACT PROPERTY")
    materials = by_name(deck, "MATERIAL")
    for (a, b), (first, second) in _touching_materials(deck, particles).items():
        best = best_properties(properties, a, b)
        where = max((materials[name].where for name in (a, b) if name in materials), default=first.where)
        if not best:
            found = (
                f"no *CONTACT PROPERTY for {a} and {b}, which can touch: {_title(first)} and {_title(second)}"
            )
            problems.add(where, found, f"*CONTACT PROPERTY, MATERIAL A={a}, MATERIAL B={b}")
        elif len(best) > 1:
            found = f"two properties of equal rank for {a} and {b}, the other at {best[0].where}"
            problems.add(best[1].where, found, "one, or one that names both materials")


def _title(block: Block) -> str:
    return f"*{block.keyword}, NAME={block.get('NAME')}"


def _touching_materials(deck: Deck, particles: Particles) -> dict[tuple[str, str], tuple[Block, Block]]:
    """Pairs of materials that can touch, with an example of two blocks that do."""
    members, counts, kind_of_type = _kinds(deck, particles)
    kinds, groups = list(members), contact_groups(deck)
    bonded = _bonded_pairs(deck, particles, kind_of_type, len(kinds))
    found: dict[tuple[str, str], tuple[Block, Block]] = {}
    for i, j in combinations_with_replacement(range(len(kinds)), 2):
        a, b = kinds[i], kinds[j]
        pairs = counts[i] * (counts[i] - 1) / 2 if i == j else counts[i] * counts[j]
        if (a.held and b.held) or pairs <= bonded[i, j] or not groups.touch(a.group, b.group):
            continue
        if a.material <= b.material:
            found.setdefault((a.material, b.material), (members[a], members[b]))
        else:
            found.setdefault((b.material, a.material), (members[b], members[a]))
    return found


def _kinds(deck: Deck, particles: Particles) -> tuple[dict[_Kind, Block], list[float], np.ndarray]:
    """The kinds with one block each, how many bodies each has, and the kind of each particle type (-1: unused)."""
    types = by_name(deck, "PARTICLE TYPE")
    fed = _fed_types(deck)
    number = np.bincount(particles.types, minlength=len(particles.names))
    members: dict[_Kind, Block] = {}
    counts: dict[_Kind, float] = {}
    of_type = np.full(len(particles.names), -1)
    for i, name in enumerate(particles.names):
        block = types.get(name)
        if block is None or "MATERIAL" not in block or not (number[i] or name in fed):
            continue
        kind = _Kind(block["MATERIAL"], block.get("CONTACT GROUP"), block["FIXED"] != "NO", False)
        members.setdefault(kind, block)
        counts[kind] = counts.get(kind, 0) + (np.inf if name in fed else int(number[i]))
        of_type[i] = list(members).index(kind)
    for block in deck.blocks("PART"):
        if "MATERIAL" in block:
            kind = _Kind(block["MATERIAL"], block.get("CONTACT GROUP"), True, True)
            members.setdefault(kind, block)
            counts[kind] = counts.get(kind, 0) + 1
    return members, [counts[kind] for kind in members], of_type


def _fed_types(deck: Deck) -> set[str]:
    """Particle types that a source or a fill adds."""
    fed = {block.get("PARTICLE TYPE") for keyword in ("SOURCE", "FILL") for block in deck.blocks(keyword)}
    return fed | {name for block in deck.blocks("SOURCE") for name, _ in block.rows["fractions"]}


def _bonded_pairs(deck: Deck, particles: Particles, kind_of_type: np.ndarray, n_kinds: int) -> np.ndarray:
    """Number of pairs of each two kinds that unbreakable bonds keep from touching, (kinds, kinds)."""
    bonded = np.zeros((n_kinds, n_kinds))
    strengths = ("TENSILE STRENGTH", "SHEAR STRENGTH")
    if any(name in block for block in deck.blocks("BOND TYPE") for name in strengths):
        return bonded
    index = particles.index(AllRows(deck, "BOND").column("particles"))
    index = index[(index >= 0).all(axis=1)]
    if len(index):
        kinds = np.sort(kind_of_type[particles.types[index]], axis=1)
        kinds = kinds[kinds[:, 0] >= 0]
        np.add.at(bonded, (kinds[:, 0], kinds[:, 1]), 1)
    return bonded
