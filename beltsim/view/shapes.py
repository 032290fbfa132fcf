"""Solids as triangles that face outward: bevelled boxes, prisms and the hulls in which spheres are looked for."""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np

from .scenery import Boxes, Cylinders, Mesh, Spheres, rotation_matrices

PRISM_SIDES = 64  # a roller of 200 pixels radius is drawn at most 0.24 pixel too small


def hull_faces(points: np.ndarray) -> np.ndarray:
    """Faces (m, 3) of the convex hull of points around the origin, wound so that their normals point outward."""
    from scipy.spatial import ConvexHull

    faces = ConvexHull(points).simplices.astype(np.int64)
    a, b, c = np.moveaxis(points[faces], 1, 0)
    inward = np.einsum("ni,ni->n", np.cross(b - a, c - a), a + b + c) < 0
    faces[inward] = faces[inward][:, ::-1]
    return faces


@cache
def bevelled_cube() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A box with bevelled edges: its 24 corners as signs of the half size, as signs of the edge radius, 44 faces.

    Each corner lies on one of the six faces: full half size along that axis, an edge radius less along the others.
    """
    corners = [(signs, axis) for signs in product((-1.0, 1.0), repeat=3) for axis in range(3)]
    half = np.array([signs for signs, _ in corners])
    edge = -half * [[k != axis for k in range(3)] for _, axis in corners]
    return half, edge, hull_faces(half + 0.2 * edge)


@cache
def unit_prism() -> tuple[np.ndarray, np.ndarray]:
    """A prism inscribed in the cylinder of radius 1 and half length 1 about z: vertices and outward faces."""
    angle = np.arange(PRISM_SIDES) * 2 * np.pi / PRISM_SIDES
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.ones(PRISM_SIDES)])
    points = np.concatenate([ring, ring * [1, 1, -1]])
    return points, hull_faces(points)


@cache
def unit_ball(subdivisions: int) -> tuple[np.ndarray, np.ndarray]:
    """A subdivided icosahedron inscribed in the unit sphere: vertices and outward faces."""
    from trimesh.creation import icosphere

    ball = icosphere(subdivisions=subdivisions)
    return np.asarray(ball.vertices), np.asarray(ball.faces)


@cache
def ball_hull() -> tuple[np.ndarray, np.ndarray, float]:
    """An 80-sided hull around the unit sphere: vertices, outward faces, and how far it reaches (1.07)."""
    points, faces = unit_ball(1)
    a, b, c = np.moveaxis(points[faces], 1, 0)
    normal = np.cross(b - a, c - a)
    inner = (np.einsum("ni,ni->n", normal, a) / np.linalg.norm(normal, axis=1)).min()
    return points / inner, faces, 1 / inner


def box_corners(boxes: Boxes) -> tuple[np.ndarray, np.ndarray]:
    """World positions (n, 24, 3) of the corners of bevelled boxes, and the faces (44, 3) they all share."""
    half, edge, faces = bevelled_cube()
    local = half * boxes.size[:, None] / 2 + edge * boxes.edge_radius[:, None, None]
    return placed(local, boxes.orientation, boxes.position), faces


def prism_corners(cylinders: Cylinders) -> tuple[np.ndarray, np.ndarray]:
    """World positions (n, 128, 3) of the corners of prisms inscribed in cylinders, and their faces (252, 3)."""
    points, faces = unit_prism()
    half = np.column_stack([cylinders.diameter, cylinders.diameter, cylinders.length]) / 2
    return placed(points * half[:, None], cylinders.orientation, cylinders.position), faces


def placed(local: np.ndarray, orientation: np.ndarray, position: np.ndarray) -> np.ndarray:
    """World positions (n, m, 3) of local points (n, m, 3) of n solids."""
    return np.einsum("nij,nmj->nmi", rotation_matrices(orientation), local) + position[:, None]


def triangles(item: Boxes | Spheres | Cylinders | Mesh) -> tuple[np.ndarray, int]:
    """Triangles (m, 3, 3) of an item, solid after solid, and how many each solid has.

    Spheres get a hull that holds them: whoever casts rays finds the sphere itself inside.
    """
    if isinstance(item, Mesh):
        return item.vertices[item.faces], 1
    if isinstance(item, Spheres):
        points, faces, _ = ball_hull()
        corners = points * item.radius[:, None, None] + item.position[:, None]
    else:
        corners, faces = (box_corners if isinstance(item, Boxes) else prism_corners)(item)
    return corners[:, faces].reshape(-1, 3, 3), len(faces)
