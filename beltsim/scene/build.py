"""A deck as a scene: plain data, built once before the first step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from beltsim.inp import Block, Deck
from beltsim.scene.bodies import BOX, SPHERE, Population, populate
from beltsim.scene.bonding import Bonding, bonds_of
from beltsim.scene.guiding import slots_of_motion
from beltsim.scene.machinery import Machinery, amplitudes_of, machinery_of
from beltsim.scene.touching import Groups, Materials, shapes_of, touching_boxes
from beltsim.scene.unbuilt import (
    refuse_flying_cylinders,
    refuse_sharp_boxes,
    refuse_sharp_boxes_on_meshes,
    refuse_turning,
    refuse_unbuilt,
)
from beltsim.solver.motion import Amplitudes
from beltsim.solver.state import BondKinds, Bonds, BondStrength, Laws, Runs, Shapes


@dataclass
class Scene:
    """Everything that a run starts from. `population` and `shapes` change as bulk comes and goes."""

    deck: Deck
    population: Population
    shapes: Shapes
    laws: Laws
    groups: Groups
    materials: Materials
    bonding: Bonding | None
    machinery: Machinery
    amplitudes: Amplitudes
    tables: dict[str, int]
    gravity: np.ndarray  # (3,) m/s2
    domain: np.ndarray | None  # (6,) m
    sources: list[Block]
    steps: list[Block]

    @property
    def bonds(self) -> Bonds | None:
        """Bonds in the solver's order."""
        return self.bonding.bonds if self.bonding else None

    @property
    def runs(self) -> Runs | None:
        """Runs of the bonds."""
        return self.bonding.runs if self.bonding else None

    @property
    def kinds(self) -> BondKinds | None:
        """What bonds share."""
        return self.bonding.kinds if self.bonding else None

    @property
    def strength(self) -> BondStrength | None:
        """Strengths, None if no bond can break."""
        return self.bonding.strength if self.bonding else None

    @property
    def has_spheres(self) -> bool:
        """Whether there are or will be spheres."""
        return bool(self.sources) or self.has_shape(SPHERE)

    @property
    def has_boxes(self) -> bool:
        """Whether there are rounded boxes."""
        return self.has_shape(BOX)

    @property
    def boxes_may_touch(self) -> bool:
        """Whether contact groups let any two rounded boxes touch each other."""
        return bool(touching_boxes(self.population, self.groups))

    def has_shape(self, shape: str) -> bool:
        """Whether particles of this shape are there now."""
        bodies, species = self.population.bodies, self.population.species
        return any(body.shape == shape and np.any(species == n) for n, body in enumerate(bodies))


def build(deck: Deck) -> Scene:
    """Scene of a deck that `inp.read_case` has accepted.

    Raises
    ------
    SceneError
        With every block or parameter that this version does not run, as `file:line: found, expected`.
    """
    refuse_unbuilt(deck)
    materials, groups = Materials(deck), Groups(deck)
    population = populate(deck)
    shapes = shapes_of(population, materials, groups)
    refuse_sharp_boxes(touching_boxes(population, groups))
    meshes = [block for block in deck.blocks("PART") if block["SHAPE"] == "MESH"]
    refuse_sharp_boxes_on_meshes(population, groups, meshes)
    refuse_flying_cylinders(deck, population, groups, meshes)
    refuse_turning(deck, population, slots_of_motion)
    machinery = machinery_of(deck, population, materials, groups)
    bonding = bonds_of(deck, population)
    amplitudes, tables = amplitudes_of(deck)
    gravity = [block.rows["acceleration"][0] for block in deck.blocks("GRAVITY")]
    domain = [block.rows["box"][0] for block in deck.blocks("DOMAIN")]
    return Scene(
        deck=deck,
        population=population,
        shapes=shapes,
        laws=materials.laws,
        groups=groups,
        materials=materials,
        bonding=bonding,
        machinery=machinery,
        amplitudes=amplitudes,
        tables=tables,
        gravity=np.array(gravity[-1] if gravity else (0.0, 0.0, 0.0), dtype=np.float64),
        domain=None if not domain else np.asarray(domain[-1], dtype=np.float64),
        sources=deck.blocks("SOURCE"),
        steps=deck.blocks("STEP"),
    )
