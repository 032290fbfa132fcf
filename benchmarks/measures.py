"""What two programs must agree on: kinetic energy, sag, mean overlap, and where the particles are."""

from __future__ import annotations

import numpy as np
from scenes import BELT_DENSITY, GRAINS, GRAVITY, HELD, TIME_STEP, Scene


def masses(scene: Scene) -> np.ndarray:
    """Masses (n,) [kg]."""
    density = np.where(scene.kind == GRAINS, scene.grain_density, BELT_DENSITY)
    return 4.0 / 3.0 * np.pi * scene.radius**3 * density


def measures(scene: Scene, result: dict) -> dict[str, float]:
    """Kinetic energy [J], sag of the belt [m] and mean overlap of grains with what they touch [m]."""
    mass, free = masses(scene), scene.kind != HELD
    turning = 0.4 * mass * scene.radius**2
    energy = 0.5 * mass @ np.sum(result["velocity"] ** 2, axis=1)
    energy += 0.5 * turning[free] @ np.sum(result["spin"][free] ** 2, axis=1)
    found = {"kinetic energy": float(energy)}
    if len(scene.rest):
        found["sag"] = -float(result["position"][: len(scene.rest), 2].min())
    if np.any(scene.kind == GRAINS):
        overlaps = grain_overlaps(scene, result["position"])
        found["mean overlap"] = float(overlaps.mean()) if overlaps.size else 0.0
        found["contacts"] = float(overlaps.size)
    return found


def grain_overlaps(scene: Scene, position: np.ndarray) -> np.ndarray:
    """Overlaps [m] of all touching pairs of spheres with a grain in them."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(position).query_pairs(2.0 * scene.radius.max(), output_type="ndarray")
    pairs = pairs[(scene.kind[pairs] == GRAINS).any(axis=1)]
    distance = np.linalg.norm(position[pairs[:, 0]] - position[pairs[:, 1]], axis=1)
    overlap = scene.radius[pairs].sum(axis=1) - distance
    return overlap[overlap > 0.0]


def apart(scene: Scene, ours: dict, theirs: dict, steps: int) -> float:
    """How far apart both results are: rms distance over the rms of what forces other than gravity moved."""
    time = steps * TIME_STEP
    unmoved = scene.position + time * scene.velocity
    unmoved[scene.kind != HELD, 2] -= 0.5 * GRAVITY * time**2
    moved = np.sqrt(np.mean((ours["position"] - unmoved) ** 2))
    return float(np.sqrt(np.mean((ours["position"] - theirs["position"]) ** 2)) / moved)
