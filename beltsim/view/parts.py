"""Machine parts of a deck or a frame as solids: cylinders, meshes from files, and planes cut to what they carry."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .colours import from_hex
from .errors import ViewProblem
from .particles import class_colour
from .scenery import Cylinders, Mesh, Scenery, bounds, rotation_matrices

FLOOR = (0.80, 0.81, 0.83)


def part_colour(colour: str | None, kind: str | None) -> np.ndarray:
    """The colour (3,) of a part: its own, else that of its class."""
    return from_hex(colour) if colour else np.array(class_colour(kind or ""))


def cylinders(rows: list[tuple]) -> Cylinders:
    """Cylinders from rows of position, orientation, diameter, length and colour."""
    position, orientation, diameter, length, colour = (np.array(column, float) for column in zip(*rows))
    return Cylinders(position, orientation, diameter, length, colour)


def mesh_file(path: Path, scale: float, position, orientation, colour) -> Mesh:
    """The triangles of an STL, OBJ or PLY file, scaled to m, turned and moved."""
    mesh = _loaded(path)
    return placed_mesh(mesh.vertices * scale, mesh.faces, position, orientation, colour)


def placed_mesh(vertices: np.ndarray, faces: np.ndarray, position, orientation, colour) -> Mesh:
    """Triangles of a part's frame, turned and moved to where the part is."""
    turn = rotation_matrices(np.reshape(orientation, (1, 4)))[0]
    return Mesh(vertices @ turn.T + position, faces, colour)


def _loaded(path: Path):
    import trimesh

    try:
        mesh = trimesh.load_mesh(path)
    except FileNotFoundError:
        raise
    except Exception as error:  # each of trimesh's readers raises its own kinds
        raise ViewProblem(f"{path}: found {error}, expected an STL, OBJ or PLY file") from None
    if not len(mesh.faces):
        raise ViewProblem(f"{path}: found no triangle, expected an STL, OBJ or PLY file")
    return mesh


def plane(position, orientation, box: np.ndarray) -> Mesh:
    """The piece of an infinite plane below and above a box (2, 3), a tenth wider."""
    turn = rotation_matrices(np.reshape(orientation, (1, 4)))[0]
    corners = np.array(np.meshgrid(*box.T)).reshape(3, 8).T
    local = (corners - position) @ turn
    (x0, y0), (x1, y1) = local.min(axis=0)[:2], local.max(axis=0)[:2]
    a, b = 0.05 * (x1 - x0), 0.05 * (y1 - y0)
    flat = [[x0 - a, y0 - b, 0], [x1 + a, y0 - b, 0], [x1 + a, y1 + b, 0], [x0 - a, y1 + b, 0]]
    return Mesh(np.array(flat) @ turn.T + position, [[0, 1, 2], [0, 2, 3]], FLOOR)


def add_rolls_and_planes(scenery: Scenery, rolls: list[tuple], planes: list[tuple]) -> None:
    """Add cylinders (rows of `cylinders`), then planes (position, orientation) as wide as all the rest."""
    if rolls:
        scenery.items.append(cylinders(rolls))
    if scenery.visible():
        box = bounds(scenery)
        scenery.items += [plane(position, orientation, box) for position, orientation in planes]
