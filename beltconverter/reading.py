"""Which way round a belt with uniform diagonals is read, where topology allows two grids."""

from __future__ import annotations

import numpy as np

from .grid import REMESH, Strips
from .mesh import Mesh
from .refusals import NotABelt
from .topology import Edges

MOST = 0.95  # share of facet pairs in the file that must agree before file order decides


def rows_endless(mesh: Mesh, edges: Edges, strips: Strips, cells: str, warnings: list[str]) -> np.ndarray:
    """Which crossing edges (K,) are transverse in an endless belt.

    A class of crossing edges can hold the diagonals only if each of its edges parts a facet based on the lower
    column from one based on the upper. One irregular diagonal in a strip settles it. Where all diagonals of a
    strip run alike both classes qualify: then `cells` decides: "auto" asks the order of facets in the file and,
    if that says nothing, takes the squarer cells with a warning; "square" and "skew" take those cells.
    """
    count = strips.column.max()
    is_between = strips.column[strips.opposite[:, 0]] != strips.column[strips.opposite[:, 1]]
    valid = _sums(strips, ~is_between, count) == 0
    if not valid.any(axis=1).all():
        strip = np.argmin(valid.any(axis=1))
        place = mesh.points[strips.ends[strips.strip == strip][0, 0]]
        raise NotABelt("unstructured", f"no rows across strip {strip + 1}", REMESH, place)
    diagonal = np.argmax(valid, axis=1)
    ambiguous = valid.all(axis=1)
    if ambiguous.any():
        diagonal[ambiguous] = _decided(mesh, edges, strips, cells, warnings)[ambiguous]
    return strips.colour != diagonal[strips.strip]


def _sums(strips: Strips, weights: np.ndarray, count: int) -> np.ndarray:
    """Sum (strips, 2) of a weight (K,) over the edges of each colour in each strip."""
    keys = 2 * strips.strip + strips.colour
    return np.bincount(keys, weights=weights.astype(np.float64), minlength=2 * count).reshape(-1, 2)


def _decided(mesh: Mesh, edges: Edges, strips: Strips, cells: str, warnings: list[str]) -> np.ndarray:
    """Colour (strips,) of the diagonals by file order or by shape."""
    count = strips.column.max()
    size = np.bincount(strips.strip, minlength=count)[:, None] / 2
    squarer = np.argmin(_sums(strips, _cosines(mesh, strips), count) / size, axis=1)
    if cells != "auto":
        return squarer if cells == "square" else 1 - squarer
    share = _sums(strips, _paired_in_file(mesh, edges, strips), count) / size
    settled = share.max(axis=1) > MOST
    if not settled.all():
        warnings.append(
            "all diagonals run alike and the file's facet order does not pair them: took the squarer cells; "
            "--cells skew takes the other reading"
        )
    return np.where(settled, np.argmax(share, axis=1), squarer)


def _paired_in_file(mesh: Mesh, edges: Edges, strips: Strips) -> np.ndarray:
    """Crossing edges (K,) shared by two facets that stand at 2k and 2k + 1 in the file."""
    first, second = mesh.order[edges.facets[strips.edges]].T
    return first // 2 == second // 2


def _cosines(mesh: Mesh, strips: Strips) -> np.ndarray:
    """Mean |cos| (K,) of the two angles opposite each crossing edge: zero if it is a square cell's diagonal."""
    low, high = (mesh.points[strips.ends[:, k]] for k in range(2))
    total = np.zeros(len(low))
    for side in range(2):
        apex = mesh.points[strips.opposite[:, side]]
        a, b = low - apex, high - apex
        size = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
        total += np.abs(np.sum(a * b, axis=1)) / np.where(size > 0, size, 1.0)
    return total / 2
