"""How far points are from the surfaces of what is in a scene: room for bulk that comes or lies there from the start."""

from __future__ import annotations

import numpy as np

from beltsim.scene import Scene
from beltsim.scene.machinery import MESH, Machinery


def distance_to_particles(places: np.ndarray, slots: np.ndarray, scene: Scene) -> np.ndarray:
    """Distance (n,) [m] of each point from the surface of one sphere or rounded box."""
    from scipy.spatial.transform import Rotation

    particles, shapes = scene.population.particles, scene.shapes
    if not slots.size:
        return np.zeros(0)
    frame = Rotation.from_quat(particles.orientation[:, slots].T, scalar_first=True)
    local = np.abs(frame.inv().apply(places - particles.position[:, slots].T))
    outside = np.maximum(local - shapes.core[:, slots].T, 0.0)
    return np.linalg.norm(outside, axis=1) - shapes.radius[slots]


def distance_to_part(places: np.ndarray, machinery: Machinery, p: int) -> np.ndarray:
    """Distance (n,) [m] of points from a cylinder or a plane, negative inside; inf from a mesh."""
    from scipy.spatial.transform import Rotation

    parts = machinery.parts
    frame = Rotation.from_quat(parts.orientation[:, p], scalar_first=True)
    local = frame.inv().apply(places - parts.position[:, p])
    if np.isinf(parts.radius[p]):
        return local[:, 2]
    if machinery.info[p].shape == MESH:
        return np.full(len(places), np.inf)
    beyond = np.abs(local[:, 2]) - parts.half_length[p]
    aside = np.hypot(local[:, 0], local[:, 1]) - parts.radius[p]
    return np.where((beyond > 0) & (aside > 0), np.hypot(beyond, aside), np.maximum(beyond, aside))


def triangles_of(machinery: Machinery) -> np.ndarray:
    """Corners (t, 3, 3) [m] of all triangles of all meshes, where they are now."""
    from scipy.spatial.transform import Rotation

    walls, parts = machinery.walls, machinery.parts
    if walls is None or not walls.triangle.shape[1]:
        return np.zeros((0, 3, 3))
    frame = Rotation.from_quat(parts.orientation[:, walls.part].T, scalar_first=True)
    corners = [
        frame.apply(walls.vertex[:, walls.triangle[c]].T) + parts.position[:, walls.part].T for c in range(3)
    ]
    return np.stack(corners, axis=1)


def near_triangles(places: np.ndarray, triangles: np.ndarray, reach: float) -> np.ndarray:
    """Which points (n,) bool are nearer than `reach` [m] to one of some triangles (t, 3, 3)."""
    from scipy.spatial import cKDTree
    from trimesh.triangles import closest_point

    touched = np.zeros(len(places), bool)
    if not len(triangles):
        return touched
    middle = triangles.mean(axis=1)
    widest = np.linalg.norm(triangles - middle[:, None], axis=2).max()
    near = cKDTree(middle).query_ball_point(places, widest + reach)
    which, rows = listed(near)
    if which.size:
        closest = closest_point(triangles[rows], places[which])
        touched[which[np.linalg.norm(closest - places[which], axis=1) < reach]] = True
    return touched


def listed(near: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lists of neighbours, one for each point, as pairs: points (m,) and neighbours (m,)."""
    which = np.repeat(np.arange(len(near)), [len(one) for one in near])
    return which, np.fromiter((member for one in near for member in one), np.int64, which.size)
