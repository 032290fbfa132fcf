"""A triangulated surface as plain arrays, and the exact weld that makes one from loose corners."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Mesh(NamedTuple):
    """Nodes and facets of a surface.

    points : (V, 3) float64, in the file's own unit until it is scaled.
    facets : (F, 3) int64, node indices.
    order : (F,) int64, the facet's place in the file: two facets of one quad usually stand together.
    """

    points: np.ndarray
    facets: np.ndarray
    order: np.ndarray


def welded(corners: np.ndarray, index: np.ndarray | None = None) -> Mesh:
    """Mesh of facets given by corner points (N, 3), three rows a facet or through `index` (3 F,).

    Only bit-equal points become one node (-0.0 counts as 0.0). A mesher writes one node always with the same
    digits, so this is enough for a whole mesh and never joins the two edges of a pipe belt that touch.
    """
    points, node = merge_equal(corners)
    facets = (node if index is None else node[index]).reshape(-1, 3)
    return Mesh(points, facets, np.arange(len(facets)))


def merge_equal(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distinct rows of `points` (N, 3) in order of first appearance, and the new index of every old row."""
    points = np.asarray(points, dtype=np.float64) + 0.0
    order, is_new = _grouped(points)
    first = order[is_new]
    by_appearance = np.argsort(first)
    rank = np.empty_like(by_appearance)
    rank[by_appearance] = np.arange(len(first))
    index = np.empty(len(points), dtype=np.int64)
    index[order] = rank[np.cumsum(is_new) - 1]
    return points[first[by_appearance]], index


def _grouped(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Order (N,) in which equal rows stand together, lowest index first, and where a new row begins (N,)."""
    keys = _hashes(points)
    order = np.argsort(keys, kind="stable")
    is_new, new_key = _changes(points[order]), _changes(keys[order][:, None])
    if np.any(is_new != new_key):  # two different points share a hash: sort by the coordinates themselves
        order = np.lexsort(points.T)
        is_new = _changes(points[order])
    return order, is_new


def _changes(rows: np.ndarray) -> np.ndarray:
    return np.concatenate([np.ones(min(len(rows), 1), bool), np.any(rows[1:] != rows[:-1], axis=1)])


def _hashes(points: np.ndarray) -> np.ndarray:
    """splitmix64 over the bits of the three coordinates.

    One 64-bit key sorts several times faster than three doubles; weaker mixes collided at a million points.
    """
    bits = np.ascontiguousarray(points).view(np.uint64).reshape(-1, 3)
    key = np.zeros(len(bits), dtype=np.uint64)
    for axis in range(3):
        key = key + bits[:, axis] + np.uint64(0x9E3779B97F4A7C15)
        key = (key ^ (key >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        key = (key ^ (key >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        key = key ^ (key >> np.uint64(31))
    return key
