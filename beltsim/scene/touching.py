"""Which things may touch, and with what law: materials, contact properties and contact groups as tables."""

from __future__ import annotations

import numpy as np

from beltsim import inp
from beltsim.inp import Deck
from beltsim.scene.bodies import BOX, CYLINDER, SPHERE, Body, Population
from beltsim.solver.contact import damping_of_restitution
from beltsim.solver.state import Laws, LinearLaws, Shapes

NO_GROUP = 0


class Materials:
    """Rows of the contact laws by material name."""

    def __init__(self, deck: Deck):
        self.blocks = list(inp.by_name(deck, "MATERIAL").values())
        self.row = {block["NAME"]: row for row, block in enumerate(self.blocks)}
        self.laws = laws_of(deck, self.blocks)


def laws_of(deck: Deck, materials: list) -> Laws | LinearLaws:
    """Laws of all pairs of materials; pairs without a contact property never touch and stay zero."""
    linear = any(block["TYPE"] == "LINEAR" for block in deck.blocks("CONTACT MODEL"))
    kind, springs = (LinearLaws, linear_springs) if linear else (Laws, hertz_springs)
    n = max(1, len(materials))
    laws = kind(*(np.zeros((n, n)) for _ in kind._fields))
    for a, first in enumerate(materials):
        for b, second in enumerate(materials):
            found = inp.contact_property(deck, first["NAME"], second["NAME"])
            if found is None:
                continue
            laws[0][a, b], laws[1][a, b] = springs(found, first, second)
            laws.damping[a, b] = damping_of_restitution(found["RESTITUTION"])
            laws.friction[a, b] = found["FRICTION"]
            laws.rolling_friction[a, b] = found["ROLLING FRICTION"]
            laws.rolling_damping[a, b] = found["ROLLING DAMPING"]
    return laws


def hertz_springs(found, first, second) -> tuple[float, float]:  # noqa: ARG001 - one signature for all laws
    """E* and G* [Pa]: 1/E* = (1 - n1^2)/E1 + (1 - n2^2)/E2, 1/G* = (2 - n1)/G1 + (2 - n2)/G2 (Hertz; Mindlin 1949)."""
    return (
        1.0 / (compliance(first) + compliance(second)),
        1.0 / (shear_compliance(first) + shear_compliance(second)),
    )


def linear_springs(found, first, second) -> tuple[float, float]:  # noqa: ARG001
    """Normal and tangential stiffness [N/m] of a contact property."""
    return found["NORMAL STIFFNESS"], found["TANGENTIAL STIFFNESS"]


def compliance(material) -> float:
    """(1 - n^2) / E of a material [1/Pa]."""
    return (1.0 - material["POISSON RATIO"] ** 2) / material["YOUNGS MODULUS"]


def shear_compliance(material) -> float:
    """(2 - n) / G of a material [1/Pa]."""
    nu = material["POISSON RATIO"]
    return (2.0 - nu) * 2.0 * (1.0 + nu) / material["YOUNGS MODULUS"]


class Groups:
    """Rows of `may_touch` by group name; row 0 is for things without a group, which touch everything."""

    def __init__(self, deck: Deck):
        rule = inp.contact_groups(deck)
        names = [None, *inp.by_name(deck, "CONTACT GROUP")]
        self.row = {name: row for row, name in enumerate(names) if name is not None}
        self.may_touch = np.array([[rule.touch(a, b) for b in names] for a in names], bool)

    def of(self, name: str | None) -> int:
        """Row of a group name, or of none."""
        return NO_GROUP if name is None else self.row[name]


def shapes_of(population: Population, materials: Materials, groups: Groups) -> Shapes:
    """What all particles look like to contacts. Cylinder particles touch as parts: nothing here touches them."""
    body_rows = population.bodies
    sphere = np.array([body.shape == SPHERE for body in body_rows], bool)[population.species]
    edge = population.edge_radius
    core = np.where(sphere[:, None], 0.0, population.half_extent - edge[:, None])
    material = np.array([materials.row[body.material] for body in body_rows], np.int32)
    group = np.array([groups.of(body.group) for body in body_rows], np.int32)
    return Shapes(
        core=np.ascontiguousarray(core.T),
        radius=edge.copy(),
        bounding=np.linalg.norm(core, axis=1) + edge,
        material=material[population.species],
        group=group[population.species],
        may_touch=groups.may_touch,
    )


def touching_boxes(population: Population, groups: Groups) -> list[tuple[Body, Body]]:
    """Pairs of particle types of rounded boxes that contact groups let touch each other."""
    counts = np.bincount(population.species, minlength=len(population.bodies))
    boxes = [n for n, body in enumerate(population.bodies) if body.shape == BOX and counts[n]]
    rows = [groups.of(body.group) for body in population.bodies]
    return [
        (population.bodies[a], population.bodies[b])
        for n, a in enumerate(boxes)
        for b in boxes[n:]
        if groups.may_touch[rows[a], rows[b]] and (a != b or counts[a] > 1)
    ]


def of_shape(population: Population, shape: str) -> np.ndarray:
    """Slots of particles of a shape, (n,) int32 ascending."""
    wanted = np.array([body.shape == shape for body in population.bodies], bool)
    return (
        np.flatnonzero(wanted[population.species]).astype(np.int32) if wanted.size else np.zeros(0, np.int32)
    )


__all__ = ["BOX", "CYLINDER", "SPHERE", "Groups", "Materials", "of_shape", "shapes_of", "touching_boxes"]
