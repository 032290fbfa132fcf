"""Particles that come, go and change places: arrays are made anew, exactly as long as the particles there are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from beltsim.scene import Scene
from beltsim.scene.bodies import make_particles
from beltsim.solver.state import Particles, Shapes


@dataclass
class Arrivals:
    """New spheres, a row each."""

    id: np.ndarray  # (k,) int64
    species: np.ndarray  # (k,) int32
    position: np.ndarray  # (k, 3) m
    velocity: np.ndarray  # (k, 3) m/s


def insert(scene: Scene, new: Arrivals) -> np.ndarray:
    """Add spheres to a scene; returns the old slot of every particle, -1 for the new ones."""
    population, shapes, bodies = scene.population, scene.shapes, scene.population.bodies
    count, k = population.count, new.id.size
    chosen = [bodies[s] for s in new.species]
    mass = np.array([body.mass for body in chosen])
    inertia = np.array([body.inertia for body in chosen])
    fresh = make_particles(new.position, np.tile([1.0, 0.0, 0.0, 0.0], (k, 1)), mass, inertia)
    fresh.velocity[:] = new.velocity.T
    fresh.force[:] = scene.gravity[:, None] * mass
    radius = np.array([body.edge_radius for body in chosen])
    population.particles = Particles(
        *(np.concatenate(pair, axis=-1) for pair in zip(population.particles, fresh))
    )
    scene.shapes = Shapes(
        core=np.concatenate([shapes.core, np.zeros((3, k))], axis=1),
        radius=np.concatenate([shapes.radius, radius]),
        bounding=np.concatenate([shapes.bounding, radius]),
        material=np.concatenate(
            [shapes.material, np.array([scene.materials.row[body.material] for body in chosen], np.int32)]
        ),
        group=np.concatenate(
            [shapes.group, np.array([scene.groups.of(body.group) for body in chosen], np.int32)]
        ),
        may_touch=shapes.may_touch,
    )
    population.id = np.concatenate([population.id, new.id])
    population.species = np.concatenate([population.species, new.species]).astype(np.int32)
    population.half_extent = np.concatenate([population.half_extent, np.repeat(radius[:, None], 3, axis=1)])
    population.edge_radius = np.concatenate([population.edge_radius, radius])
    return np.concatenate([np.arange(count, dtype=np.int64), np.full(k, -1, np.int64)])


def remove(scene: Scene, leaves: np.ndarray) -> np.ndarray:
    """Take away the particles marked in `leaves` (n,) bool; returns the old slot of every one that stays."""
    stay = np.flatnonzero(~leaves)
    take(scene, stay)
    return stay.astype(np.int64)


def sort_free(scene: Scene, cell: float) -> np.ndarray:
    """Bring the free spheres into the order of cells with the edge `cell` [m]; returns the old slot of every particle.

    Neighbours in space are then neighbours in memory.
    """
    population = scene.population
    place = population.particles.position[:, population.permanent :]
    # Slices across the longest side, so that neighbours in the next slice are as near as can be.
    sides = np.argsort(-np.ptp(place, axis=1), kind="stable")
    column = np.floor(place[sides] / cell).astype(np.int64)
    order = population.permanent + np.lexsort(column[::-1])
    origin = np.concatenate([np.arange(population.permanent), order])
    take(scene, origin)
    return origin


def take(scene: Scene, slots: np.ndarray) -> None:
    """Keep the particles of some slots, in the order given."""
    population, shapes = scene.population, scene.shapes
    population.particles = Particles(*(np.take(array, slots, axis=-1) for array in population.particles))
    scene.shapes = Shapes(
        np.take(shapes.core, slots, axis=1),
        shapes.radius[slots],
        shapes.bounding[slots],
        shapes.material[slots],
        shapes.group[slots],
        shapes.may_touch,
    )
    population.id, population.species = population.id[slots], population.species[slots]
    population.half_extent = population.half_extent[slots]
    population.edge_radius = population.edge_radius[slots]


def outside(scene: Scene) -> np.ndarray:
    """Which free spheres (n,) bool have left the domain. Belts and fixed particles stay for the whole run."""
    population = scene.population
    low, high = scene.domain[:3, None], scene.domain[3:, None]
    position = population.particles.position
    leaves = ~np.all((position >= low) & (position <= high), axis=0)
    leaves[: population.permanent] = False
    return leaves
