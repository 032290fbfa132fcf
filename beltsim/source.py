"""Bulk inlets: spheres placed in a box at a mass rate, without overlap with particles and parts.

Two random streams come from the seed: one draws the particle types, one the places. So the sequence of types, and with
it the largest number of particles, is known before the run, whatever space there is in the box.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from beltsim.clearance import distance_to_part, near_triangles, triangles_of
from beltsim.inp import Block
from beltsim.scene import Scene
from beltsim.scene.bodies import CYLINDER, Body, Population
from beltsim.scene.machinery import MESH, Machinery
from beltsim.scene.touching import of_shape
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
    solids = solids_near(source, scene)
    found, species = [], []
    while source.inserted + bodies[source.next_type()].mass <= source.due(time):
        radius = bodies[source.waiting].edge_radius
        place = free_place(source, radius, centres, reach, solids)
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
    """Centres (m, 3) and bounding radii (m,) of the particles in or beside the box; cylinders are among the parts."""
    position, bounding = scene.population.particles.position.T, scene.shapes.bounding
    widest = max(scene.population.bodies[s].edge_radius for s in source.species)
    margin = (bounding + widest)[:, None]
    near = np.all((position > source.low - margin) & (position < source.high + margin), axis=1)
    near[of_shape(scene.population, CYLINDER)] = False
    return position[near], bounding[near]


@dataclass
class Solids:
    """Parts in or beside the box of a source."""

    machinery: Machinery
    parts: list[int]  # cylinders and planes
    triangles: np.ndarray  # (t, 3, 3) m

    def touch(self, place: np.ndarray, radius: float) -> bool:
        """Whether a sphere of a radius at a place would touch one of them."""
        point = place[None]
        if any(distance_to_part(point, self.machinery, p)[0] < radius for p in self.parts):
            return True
        return bool(near_triangles(point, self.triangles, radius)[0])


def solids_near(source: Source, scene: Scene) -> Solids:
    """What of the parts may be in the way of the spheres of a source, as contact groups have it."""
    bodies, machinery = scene.population.bodies, scene.machinery
    groups = [scene.groups.of(bodies[s].group) for s in source.species]
    touches = scene.groups.may_touch[groups][:, machinery.group].any(axis=0)
    middle, half = 0.5 * (source.low + source.high), 0.5 * (source.high - source.low)
    reach = float(np.linalg.norm(half)) + max(bodies[s].edge_radius for s in source.species)
    parts = [
        int(p)
        for p in np.flatnonzero(touches)
        if machinery.info[p].shape != MESH and distance_to_part(middle[None], machinery, p)[0] < reach
    ]
    triangles = triangles_of(machinery)[touches[machinery.walls.part]]
    beyond = (triangles.min(axis=1) > middle + reach) | (triangles.max(axis=1) < middle - reach)
    return Solids(machinery, parts, triangles[~beyond.any(axis=1)])


def free_place(
    source: Source, radius: float, centres: np.ndarray, reach: np.ndarray, solids: Solids
) -> np.ndarray | None:
    """A random place in the box that overlaps nothing, or None after `TRIES` tries."""
    low, high = source.low + radius, source.high - radius
    middle = 0.5 * (source.low + source.high)
    low, high = np.minimum(low, middle), np.maximum(high, middle)
    for place in source.places.uniform(low, high, (TRIES, 3)):
        free = not np.any(np.sum((centres - place) ** 2, axis=1) < (reach + radius) ** 2)
        if free and not solids.touch(place, radius):
            return place
    return None
