"""Bulk inlets: spheres placed without overlap in a box, at a mass rate.

Two random streams come from the seed: one draws the particle types, one the places. So the sequence of types, and with
it the largest number of particles, is known before the run, whatever space there is in the box.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from beltsim.inp import Block
from beltsim.scene import Scene
from beltsim.scene.bodies import Body, Population
from beltsim.turnover import Arrivals

TRIES = 40  # places tried for one particle before it waits for the next visit
LONGEST_PAUSE = 0.02  # s between two visits of a source


@dataclass
class Source:
    """A *SOURCE at work."""

    name: str
    low: np.ndarray  # (3,) m, corner of the box
    high: np.ndarray  # (3,) m
    velocity: np.ndarray  # (3,) m/s
    species: np.ndarray  # (k,) types that may come
    share: np.ndarray  # (k,) by number, sums to 1
    rate: float  # kg/s
    start: float  # s
    end: float  # s
    step_name: str | None
    types: np.random.Generator
    places: np.random.Generator
    inserted: float = 0.0  # kg
    waiting: int = -1  # type that is due next, -1: not drawn yet

    def due(self, time: float) -> float:
        """Mass [kg] that should have come by a time."""
        return self.rate * max(0.0, min(time, self.end) - self.start)

    def next_type(self) -> int:
        """Type of the next particle."""
        if self.waiting < 0:
            self.waiting = int(self.types.choice(self.species, p=self.share))
        return self.waiting


def source_of(block: Block, population: Population) -> Source:
    """A *SOURCE ready to begin."""
    rows = {body.name: n for n, body in enumerate(population.bodies)}
    fractions = block.rows["fractions"] or [(block["PARTICLE TYPE"], 1.0)]
    species = np.array([rows[name] for name, _ in fractions])
    mass = np.array([population.bodies[s].mass for s in species])
    number = np.array([share for _, share in fractions]) / mass
    box = np.ravel(block.rows["box"])
    types, places = np.random.SeedSequence(block["SEED"]).spawn(2)
    end = block.get("END")
    return Source(
        block["NAME"],
        np.minimum(box[:3], box[3:]),
        np.maximum(box[:3], box[3:]),
        np.ravel(block.rows["velocity"]).astype(np.float64),
        species,
        number / number.sum(),
        block["MASS RATE"],
        block["START"],
        math.inf if end is None else end,
        block.get("STEP"),
        np.random.default_rng(types),
        np.random.default_rng(places),
    )


def planned_count(block: Block, population: Population, end: float) -> int:
    """Most particles that a source can bring until a time: the sequence of its types, drawn in advance."""
    source, count = source_of(block, population), 0
    total = source.due(end)
    while source.inserted < total:
        source.inserted += population.bodies[source.next_type()].mass
        source.waiting = -1
        count += 1
    return count


def pause_of(source: Source, bodies: list[Body]) -> float:
    """Time [s] between two visits: half a diameter of travel, so that the box fills layer by layer."""
    smallest = min(bodies[s].edge_radius for s in source.species)
    speed = float(np.linalg.norm(source.velocity))
    return LONGEST_PAUSE if speed == 0.0 else min(LONGEST_PAUSE, smallest / speed)


def arrivals(source: Source, scene: Scene, time: float, next_id: int) -> Arrivals | None:
    """Spheres that are due at a time and find room in the box; None if there are none."""
    bodies = scene.population.bodies
    centres, reach = occupied(source, scene)
    found, species = [], []
    while source.inserted + bodies[source.next_type()].mass <= source.due(time):
        radius = bodies[source.waiting].edge_radius
        place = free_place(source, radius, centres, reach)
        if place is None:
            break
        centres, reach = np.vstack([centres, place]), np.append(reach, radius)
        found.append(place)
        species.append(source.waiting)
        source.inserted += bodies[source.waiting].mass
        source.waiting = -1
    if not found:
        return None
    count = len(found)
    ids = np.arange(next_id, next_id + count, dtype=np.int64)
    return Arrivals(ids, np.array(species, np.int32), np.array(found), np.tile(source.velocity, (count, 1)))


def occupied(source: Source, scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Centres (m, 3) and bounding radii (m,) of the particles in or beside the box."""
    position, bounding = scene.population.particles.position.T, scene.shapes.bounding
    widest = max(scene.population.bodies[s].edge_radius for s in source.species)
    margin = (bounding + widest)[:, None]
    near = np.all((position > source.low - margin) & (position < source.high + margin), axis=1)
    return position[near], bounding[near]


def free_place(source: Source, radius: float, centres: np.ndarray, reach: np.ndarray) -> np.ndarray | None:
    """A random place in the box that overlaps nothing, or None after `TRIES` tries."""
    low, high = source.low + radius, source.high - radius
    middle = 0.5 * (source.low + source.high)
    low, high = np.minimum(low, middle), np.maximum(high, middle)
    for place in source.places.uniform(low, high, (TRIES, 3)):
        if not np.any(np.sum((centres - place) ** 2, axis=1) < (reach + radius) ** 2):
            return place
    return None
