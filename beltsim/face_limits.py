"""What contacts between the faces of rounded boxes ask of the time step."""

from __future__ import annotations

import math

import numpy as np

from beltsim.scene import Scene
from beltsim.scene.bodies import BOX
from beltsim.scene.touching import touching_boxes
from beltsim.solver.state import Laws
from beltsim.solver.timestep import IMPACT_STEPS


def face_stiffness(scene: Scene) -> np.ndarray:
    """Stiffness (n,) [N/m] of each box's widest face on the thinnest and hardest box that it may touch; 0 for none."""
    population, laws = scene.population, scene.laws
    area = face_areas(population.half_extent - population.edge_radius[:, None], population.edge_radius)
    thickness = population.half_extent.min(axis=1, initial=math.inf)
    stiffness = np.zeros(population.count)
    rows = {body.name: n for n, body in enumerate(population.bodies)}
    for pair in touching_boxes(population, scene.groups):
        for own, other in (pair, pair[::-1]):
            mine, theirs = (population.species == rows[body.name] for body in (own, other))
            hardness = laws[0][scene.materials.row[own.material], scene.materials.row[other.material]]
            if isinstance(laws, Laws):
                depth = 0.5 * (thickness[mine] + thickness[theirs].min())
            else:
                depth = np.minimum(area[mine], area[theirs].min())
            stiffness[mine] = np.maximum(stiffness[mine], hardness * area[mine] / depth)
    return stiffness


def face_areas(core: np.ndarray, edge_radius: np.ndarray) -> np.ndarray:
    """Areas (n,) [m2] of the widest faces of cores (n, 3): `box_box.face_area` for arrays."""
    widths = np.maximum(2.0 * core, edge_radius[:, None])
    thinnest = 2 - np.argmin(core[:, ::-1], axis=1)
    return np.prod(np.where(np.arange(3) == thinnest[:, None], 1.0, widths), axis=1)


def face_contact_rows(scene: Scene, ratio: float) -> np.ndarray:
    """Share (n,) [1/s2] of a whole face contact in the bound of each box that can move.

    Normal and tangential springs (`ratio` of both) spread over the face, so that they act at its mean square radius; as
    much again for the coupling with what they touch.
    """
    population = scene.population
    particles, stiffness = population.particles, face_stiffness(scene)
    reach = np.sum(population.half_extent**2, axis=1) / 3.0
    lever = particles.mass * reach / particles.inertia.min(axis=0)
    moves = particles.mobility.max(axis=0)
    return moves * 2.0 * stiffness * (1.0 + ratio) * (1.0 + lever) / particles.mass


def face_impacts(scene: Scene) -> list[tuple[float, str]]:
    """A twentieth of the impact [s] of each kind of loose box that falls flat on another, with its name."""
    population, stiffness = scene.population, face_stiffness(scene)
    mass = population.particles.mass
    loose = population.particles.mobility[0] > 0.0
    if scene.bonds is not None:
        loose[scene.bonds.first] = loose[scene.bonds.second] = False
    found = []
    for n, body in enumerate(population.bodies):
        chosen = loose & (population.species == n) & (stiffness > 0.0)
        if body.shape == BOX and np.any(chosen):
            # The least reduced mass: that of two alike.
            duration = math.pi * math.sqrt(0.5 * float(np.min(mass[chosen] / stiffness[chosen])))
            found.append((duration / IMPACT_STEPS, f"impact of faces of {body.name}"))
    return found
