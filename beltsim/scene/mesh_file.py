"""Triangles of a *PART, SHAPE=MESH: its file read, welded and checked."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from beltsim.inp import Block
from beltsim.inp.units import UNITS

HEADER, FACET = 84, 50  # bytes of a binary STL file
WHOLE = "a whole file: this one is cut off"
WELD = 1e-6
"""Vertices closer than this share of the mesh's diagonal are one: single precision keeps 1e-7."""


class MeshProblem(Exception):
    """What was found in a mesh file and what was expected."""

    def __init__(self, found: str, expected: str):
        super().__init__(found)
        self.found, self.expected = found, expected


def read_mesh(block: Block) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v, 3) [m] and triangles (t, 3) of a mesh part, in the axes of its file.

    Raises
    ------
    MeshProblem
        If the file is no triangle mesh that can carry: empty, not finite, or with triangles that have no area.
    """
    vertices, triangles = load(block)
    if not len(triangles):
        raise MeshProblem("no triangle", "a triangle mesh")
    if not np.isfinite(vertices).all():
        raise MeshProblem("a vertex that is NaN or infinite", "finite coordinates")
    scale = float(UNITS["length"][(block.get("UNIT") or "m").lower()])
    vertices, triangles, tolerance = weld(vertices * scale, triangles)
    flat = np.flatnonzero(heights(vertices, triangles) <= tolerance)
    if flat.size:
        raise MeshProblem(
            f"{flat.size} triangles without area (the first is number {flat[0] + 1})",
            "triangles with an area: remove or merge those",
        )
    return vertices, triangles


def load(block: Block) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles as they stand in the file."""
    import trimesh

    path = Path(block.path())
    announced = 0
    try:
        if path.suffix.lower() == ".stl":
            refuse_cut_stl(path.read_bytes())
        elif path.suffix.lower() == ".ply":
            announced = announced_faces(path.read_bytes())
        mesh = trimesh.load_mesh(path, process=False)
        vertices, triangles = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    except MeshProblem:
        raise
    except Exception as error:  # each of trimesh's readers raises its own kinds
        raise MeshProblem(f"no mesh ({error})", "an STL, OBJ or PLY file") from None
    if len(triangles) < announced:
        raise MeshProblem(f"{len(triangles)} of the {announced} faces of its header", WHOLE)
    return vertices, triangles.reshape(-1, 3)


def refuse_cut_stl(data: bytes) -> None:
    """Raise `MeshProblem` for an STL file that ends too early: trimesh would find fewer triangles or none."""
    count = int.from_bytes(data[HEADER - 4 : HEADER], "little")
    if len(data) < HEADER or len(data) == HEADER + FACET * count:
        return
    if data.lstrip()[:5].lower() == b"solid" and b"facet" in data:
        if b"endsolid" not in data[-1000:].lower():
            raise MeshProblem("no endsolid at its end", WHOLE)
    elif len(data) < HEADER + FACET * count:
        found = f"{(len(data) - HEADER) // FACET} of the {count} triangles of its header"
        raise MeshProblem(found, WHOLE)


def announced_faces(data: bytes) -> int:
    """Number of faces that the header of a PLY file announces; 0 if it does not say."""
    match = re.search(rb"^element\s+face\s+(\d+)", data[:10_000], re.MULTILINE)
    return int(match[1]) if match else 0


def weld(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """The mesh with near vertices made one, and the tolerance [m]; STL files repeat every vertex."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    exact, place = np.unique(vertices, axis=0, return_inverse=True)
    tolerance = WELD * float(np.linalg.norm(np.ptp(exact, axis=0)))
    pairs = cKDTree(exact).query_pairs(tolerance, output_type="ndarray")
    near = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(exact),) * 2)
    count, group = connected_components(near, directed=False)
    first = np.full(count, len(exact), np.int64)
    np.minimum.at(first, group, np.arange(len(exact)))
    return exact[first], group[place.ravel()][triangles], tolerance


def heights(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Least height (t,) [m] of each triangle: twice its area over its longest side."""
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    twice = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    longest = np.max([np.linalg.norm(side, axis=1) for side in (b - a, c - b, a - c)], axis=0)
    return np.divide(twice, longest, out=np.zeros_like(twice), where=longest > 0.0)
