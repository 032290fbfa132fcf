"""*FILL: a layer of bulk that lies on a belt from the start and moves with it.

The places are those of a close packing, shaken by a random part of a radius, as dense (0.64) as bulk that was poured
and shaken; what overlaps anything, sticks out above the height or lies beside the belt is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from beltsim.clearance import distance_to_part, distance_to_particles, listed, near_triangles, triangles_of
from beltsim.inp import Block
from beltsim.measures import belt_slots
from beltsim.scene import Scene
from beltsim.scene.bodies import BOX, SPHERE
from beltsim.scene.touching import of_shape
from beltsim.scene.unbuilt import SceneError, problem
from beltsim.turnover import Arrivals, insert

SHAKE = 0.05  # of a radius: how far a sphere is moved from its place, at most
GAP = 1e-3  # of a radius: the least distance from anything
STEEPEST = 0.5  # cosine of the angle with the vertical beyond which a belt carries nothing


@dataclass
class Surface:
    """The carrying side of a belt."""

    slots: np.ndarray  # (k,) of the belt particles that look up
    position: np.ndarray  # (k, 3) m
    normal: np.ndarray  # (k, 3) unit
    axes: np.ndarray  # (3, 3) rows: running direction, across, mean normal
    top: np.ndarray  # (k,) m, height of the upper face along the mean normal


@dataclass(frozen=True)
class Filled:
    """What a *FILL brought."""

    particle_type: str
    belt: str
    count: int
    mass: float  # kg


def fill_belts(scene: Scene) -> list[Filled]:
    """Lay the bulk of all *FILL blocks on its belts, one after the other; adds it to the scene.

    Raises
    ------
    SceneError
        For a type that is no free sphere, a belt without a carrying side, and a layer that takes no sphere.
    """
    filled = []
    for block in scene.deck.blocks("FILL"):
        names = [body.name for body in scene.population.bodies]
        species = names.index(block["PARTICLE TYPE"])
        body = scene.population.bodies[species]
        if body.shape != SPHERE or body.fixed != "NO":
            raise SceneError(problem(block, f"*FILL with {body.name}, SHAPE={body.shape}", "a free SPHERE"))
        surface = carrying_side(block, scene)
        places = packing(surface, scene, body.edge_radius, block["HEIGHT"], block["SEED"])
        places, nearest = on_the_belt(places, surface, scene, body.edge_radius, block["HEIGHT"])
        free = ~touching(places, body.edge_radius, scene)
        places, nearest = places[free], nearest[free]
        if not len(places):
            found = f"HEIGHT={block['HEIGHT']:g} m, which takes no sphere of {2 * body.edge_radius:g} m"
            raise SceneError(problem(block, found, "a higher layer, or room on the belt"))
        velocity = scene.population.particles.velocity[:, surface.slots[nearest]].T
        ids = scene.population.id.max() + 1 + np.arange(len(places))
        insert(scene, Arrivals(ids, np.full(len(places), species, np.int32), places, velocity))
        filled.append(Filled(body.name, block["BELT"], len(places), len(places) * body.mass))
    return filled


def carrying_side(block: Block, scene: Scene) -> Surface:
    """The part of a belt whose normals look up, against gravity (without gravity: along z)."""
    from scipy.spatial.transform import Rotation

    particles, g = scene.population.particles, scene.gravity
    up = -g / np.linalg.norm(g) if np.any(g) else np.array([0.0, 0.0, 1.0])
    slots = np.flatnonzero(belt_slots(scene, block["BELT"]))
    frames = Rotation.from_quat(particles.orientation[:, slots].T, scalar_first=True).as_matrix()
    carries = frames[:, :, 2] @ up > STEEPEST
    if not np.any(carries):
        raise SceneError(
            problem(block, f"no particle of {block['BELT']} whose normal looks up", "a carrying side")
        )
    slots, frames = slots[carries], frames[carries]
    mean = frames[:, :, 2].mean(axis=0)
    mean /= np.linalg.norm(mean)
    along = frames[:, :, 0].mean(axis=0)
    along -= (along @ mean) * mean
    along /= np.linalg.norm(along)
    position, normal = particles.position[:, slots].T, frames[:, :, 2]
    face = position + scene.population.half_extent[slots, 2:] * normal
    return Surface(slots, position, normal, np.stack([along, np.cross(mean, along), mean]), face @ mean)


def packing(surface: Surface, scene: Scene, radius: float, height: float, seed: int) -> np.ndarray:
    """Places (n, 3) of a hexagonal close packing over the whole belt, layers parallel to its mean plane, shaken."""
    pitch = 2.0 * radius * (1.0 + GAP + SHAKE)
    local = surface.position @ surface.axes.T
    margin = scene.population.half_extent[surface.slots].max()
    low, high = local.min(axis=0) - margin, local.max(axis=0) + margin
    low[2], high[2] = surface.top.min() + radius * (1.0 + GAP + SHAKE), surface.top.max() + height
    steps = pitch * np.array([1.0, np.sqrt(0.75), np.sqrt(2.0 / 3.0)])
    i, j, k = (
        n.ravel()
        for n in np.meshgrid(
            *(np.arange(max(1, int((b - a) / step) + 1)) for a, b, step in zip(low, high, steps)),
            indexing="ij",
        )
    )
    odd = k % 2
    places = np.stack([i + 0.5 * ((j + odd) % 2), j + odd / 3.0, k + 0.0], axis=1) * steps
    generator = np.random.default_rng(seed)
    shake = generator.normal(size=places.shape)
    shake *= (SHAKE * radius * generator.random(len(places)) / np.linalg.norm(shake, axis=1))[:, None]
    return (low + places + shake) @ surface.axes


def on_the_belt(places, surface: Surface, scene: Scene, radius: float, height: float) -> tuple:
    """Those places that lie over the belt and below the height, and the nearest belt particle (row) of each.

    The height counts from the lowest point of the belt's cross-section there, so a trough is filled to a level top.
    """
    from scipy.spatial import cKDTree

    _, nearest = cKDTree(surface.position).query(places)
    half = scene.population.half_extent[surface.slots]
    level = lowest_across(surface, 2.0 * half[:, 0].max())[nearest] + height
    fits = places @ surface.axes[2] + radius <= level * (1.0 + 1e-12)
    fits &= within_faces(places, surface, scene, nearest, half)
    return places[fits], nearest[fits]


def within_faces(places, surface: Surface, scene: Scene, nearest, half) -> np.ndarray:
    """Which places (n,) bool lie above the face of their nearest belt particle, not beside it or below."""
    from scipy.spatial.transform import Rotation

    orientation = scene.population.particles.orientation[:, surface.slots[nearest]].T
    frame = Rotation.from_quat(orientation, scalar_first=True)
    local = frame.inv().apply(places - surface.position[nearest])
    beside = np.abs(local[:, :2]) > half[nearest, :2]
    return ~np.any(beside, axis=1) & (local[:, 2] > 0.0)


def lowest_across(surface: Surface, width: float) -> np.ndarray:
    """Height (k,) [m] of the lowest face in the cross-section of each belt particle, a stripe of a width [m]."""
    along = surface.position @ surface.axes[0]
    stripe = ((along - along.min()) / width).astype(int)
    lowest = np.full(stripe.max() + 1, np.inf)
    np.minimum.at(lowest, stripe, surface.top)
    return lowest[stripe]


def touching(places: np.ndarray, radius: float, scene: Scene) -> np.ndarray:
    """Which spheres (n,) bool of a radius would be nearer than the gap to a particle or a part."""
    from scipy.spatial import cKDTree

    population, reach = scene.population, radius * (1.0 + GAP)
    solid = np.concatenate([of_shape(population, SPHERE), of_shape(population, BOX)])
    tree = cKDTree(population.particles.position[:, solid].T)
    near = tree.query_ball_point(places, reach + float(scene.shapes.bounding[solid].max()))
    which, rows = listed(near)
    hit = distance_to_particles(places[which], solid[rows], scene) < reach
    touched = np.zeros(len(places), bool)
    touched[which[hit]] = True
    for p in range(len(scene.machinery.info)):
        touched |= distance_to_part(places, scene.machinery, p) < reach
    return touched | near_triangles(places, triangles_of(scene.machinery), reach)
