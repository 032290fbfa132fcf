"""Welds of border nodes within a tolerance, for meshes whose exact nodes give no belt.

Only nodes on a border are candidates, so that layers that touch inside are never joined.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .mesh import Mesh
from .refusals import NotABelt
from .topology import cleaned, components, edges_of

STEP = 2.5


class Weld(NamedTuple):
    """A mesh with border nodes up to `tolerance` apart in one.

    share : the tolerance over the median edge; is_clear : no further pair lies within four times the tolerance, so
    it does not cut through the scatter of one cause, as a weld does that closes one half of a crack.
    """

    tolerance: float
    share: float
    is_clear: bool
    mesh: Mesh

    @property
    def note(self) -> str:
        """What a person is told of it."""
        return f"border nodes up to {self.tolerance:.3g} apart (file units) were welded"


def welds(mesh: Mesh, most: float | None, share: float) -> Iterator[Weld]:
    """Ever coarser welds, from 1e-8 of the extent to `most`, or to `share` of the median edge.

    Only levels at which another pair of nodes comes into reach are tried, so belts that keep clear cost nothing.
    """
    try:
        a, b, apart, edge = _pairs(mesh, most, share)
    except NotABelt:  # a mesh with fins has no border to speak of
        return
    limit = share * edge if most is None else most
    tolerance, reached = 1e-8 * np.ptp(mesh.points, axis=0).max(), 0
    while reached < len(apart):
        level = min(tolerance, limit)
        near = apart <= level
        if np.count_nonzero(near) > reached:
            reached = np.count_nonzero(near)
            is_clear = not np.any(~near & (apart <= 4 * level))
            yield Weld(level, level / edge, is_clear, merged_nodes(mesh, a[near], b[near]))
        tolerance *= STEP


def _pairs(mesh: Mesh, most: float | None, share: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Pairs of border nodes a, b within the limit, their distances, and the median edge."""
    from scipy.spatial import cKDTree

    edges = edges_of(mesh)
    length = np.linalg.norm(np.diff(mesh.points[edges.nodes], axis=1)[:, 0], axis=1)
    edge = float(np.median(length))
    limit = share * edge if most is None else most
    nodes = np.unique(edges.nodes[edges.border])
    if not len(nodes):
        return nodes, nodes, np.empty(0), edge
    a, b = nodes[cKDTree(mesh.points[nodes]).query_pairs(limit, output_type="ndarray")].T
    apart = np.linalg.norm(mesh.points[a] - mesh.points[b], axis=1)
    inside = apart <= limit  # the tree rounds its own way
    return a[inside], b[inside], apart[inside], edge


def merged_nodes(mesh: Mesh, a: np.ndarray, b: np.ndarray) -> Mesh:
    """The mesh with one node, the first, for each cluster of linked ones, and without the facets that vanish."""
    label = components(len(mesh.points), a, b)
    _, first = np.unique(label, return_index=True)
    return cleaned(Mesh(mesh.points[first], label[mesh.facets].astype(np.int64), mesh.order), [])
