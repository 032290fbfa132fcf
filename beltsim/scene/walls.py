"""Triangle meshes as the solver's arrays: who neighbours whom, which edges can poke into a box, a tree to search."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from beltsim.solver.state import Walls, WallTree
from beltsim.solver.wall_contacts import SMOOTH
from beltsim.solver.wall_pairs import LEAF

FLAT = 0.02
"""Edges folded by less [rad] are seams of one plane: no box feels them. Single-precision files fold planes by 1e-4."""


@dataclass
class Mesh:
    """One mesh part in its own frame."""

    part: int
    vertices: np.ndarray  # (v, 3) m
    triangles: np.ndarray  # (t, 3), near ones near one another


def in_search_order(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The triangles sorted so that each leaf of the tree, and each of its branches, is a compact patch."""
    from scipy.spatial import cKDTree

    return triangles[cKDTree(vertices[triangles].mean(axis=1), leafsize=LEAF).indices]


def walls_of(meshes: list[Mesh], spacing: float) -> tuple[Walls, WallTree]:
    """All meshes in one; points of folds and rims stand at most `spacing` [m] apart, none if that is 0."""
    vertices, triangles, shift = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], 0
    for mesh in meshes:
        vertices.append(mesh.vertices)
        triangles.append(mesh.triangles + shift)
        shift += len(mesh.vertices)
    vertex, triangle = np.concatenate(vertices), np.concatenate(triangles)
    part = np.repeat([mesh.part for mesh in meshes], [len(mesh.triangles) for mesh in meshes])
    edges = Edges(vertex, triangle)
    beside_start, beside = neighbours(vertex, triangle, edges)
    point_start, point = edges.points(spacing)
    walls = Walls(
        vertex=np.ascontiguousarray(vertex.T),
        triangle=np.ascontiguousarray(triangle.T.astype(np.int32)),
        part=part.astype(np.int32),
        beside_start=beside_start,
        beside=beside,
        alike=alike(normals(vertex, triangle), beside_start, beside),
        point_start=point_start,
        point=np.ascontiguousarray(point.T),
        point_part=np.repeat(part, np.diff(point_start)).astype(np.int32),
        ball=balls(vertex, triangle),
    )
    return walls, tree_of(meshes)


def normals(vertex: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    """Unit normals (t, 3)."""
    a, b, c = np.moveaxis(vertex[triangle], 1, 0)
    n = np.cross(b - a, c - a)
    return n / np.linalg.norm(n, axis=1, keepdims=True)


def balls(vertex: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    """Centres and radii (4, t) of balls around the triangles, wider by what rounding may take."""
    corners = vertex[triangle]
    centre = corners.mean(axis=1)
    radius = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    return np.vstack([centre.T, radius + 1e-9 * (radius + np.abs(centre).max(axis=1, initial=0.0))])


def alike(normal: np.ndarray, start: np.ndarray, beside: np.ndarray) -> np.ndarray:
    """Whether each neighbour lies within `SMOOTH` of the plane of its triangle, whichever way both are wound."""
    own = np.repeat(normal, np.diff(start), axis=0)
    return np.abs(np.sum(own * normal[beside], axis=1)) > np.cos(SMOOTH)


def neighbours(vertex: np.ndarray, triangle: np.ndarray, edges: Edges) -> tuple[np.ndarray, np.ndarray]:
    """Triangles that share a point with each triangle, ascending: rows and members. T-joints share points too."""
    from scipy.sparse import csr_array

    owner, joint = edges.joints()
    rows = np.concatenate([np.repeat(np.arange(len(triangle)), 3), owner])
    columns = np.concatenate([triangle.ravel(), joint])
    touch = csr_array((np.ones(rows.size, np.int32), (rows, columns)), (len(triangle), max(1, len(vertex))))
    shared = (touch @ touch.T).tocsr()
    shared.setdiag(0)
    shared.eliminate_zeros()
    shared.sort_indices()
    return shared.indptr.astype(np.int64), shared.indices.astype(np.int32)


class Edges:
    """The edges of all triangles, each once."""

    def __init__(self, vertex: np.ndarray, triangle: np.ndarray):
        self.vertex, self.triangle = vertex, triangle
        sides = np.sort(triangle[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        self.ends, self.side_edge, self.count = np.unique(
            sides, axis=0, return_inverse=True, return_counts=True
        )
        self.side_edge = self.side_edge.ravel()
        self.owner = np.zeros(len(self.ends), np.int64)
        self.owner[self.side_edge[::-1]] = np.repeat(np.arange(len(triangle)), 3)[::-1]

    def joints(self) -> tuple[np.ndarray, np.ndarray]:
        """T-joints: triangles, and the rim vertices that lie within an edge of theirs."""
        from scipy.spatial import cKDTree

        rims = np.flatnonzero(self.count == 1)
        if not rims.size:
            return np.zeros(0, np.int64), np.zeros(0, np.int64)
        loose = np.unique(self.ends[rims])
        a, b = self.vertex[self.ends[rims]].transpose(1, 0, 2)
        length = np.linalg.norm(b - a, axis=1)
        tolerance = 1e-6 * float(np.linalg.norm(np.ptp(self.vertex, axis=0)))
        near = cKDTree(self.vertex[loose]).query_ball_point(0.5 * (a + b), 0.5 * length + tolerance)
        rim = np.repeat(np.arange(rims.size), [len(found) for found in near])
        joint = loose[np.concatenate([np.asarray(found, np.int64) for found in near])]
        along = (b - a)[rim] / length[rim, None]
        out = self.vertex[joint] - a[rim]
        off = np.linalg.norm(out - np.sum(out * along, axis=1)[:, None] * along, axis=1)
        ends = self.ends[rims][rim]
        keep = (off <= tolerance) & (joint != ends[:, 0]) & (joint != ends[:, 1])
        return self.owner[rims][rim[keep]], joint[keep]

    def sharp(self) -> np.ndarray:
        """Whether each edge is a rim, or a fold of more than `FLAT`; winding does not matter."""
        others = self.triangle[:, [2, 0, 1]].ravel()
        order = np.argsort(self.side_edge, kind="stable")
        start = np.concatenate([[0], np.cumsum(self.count)[:-1]]) if self.count.size else np.zeros(0, int)
        pairs = np.flatnonzero(self.count == 2)
        a, b = self.vertex[self.ends[pairs]].transpose(1, 0, 2)
        along = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)

        def wing(n):
            out = self.vertex[others[order[start[pairs] + n]]] - a
            out -= np.sum(out * along, axis=1)[:, None] * along
            return out / np.linalg.norm(out, axis=1, keepdims=True)

        found = np.ones(len(self.ends), bool)
        found[pairs] = np.linalg.norm(wing(0) + wing(1), axis=1) > FLAT
        return found

    def points(self, spacing: float) -> tuple[np.ndarray, np.ndarray]:
        """Points along all sharp edges, ends included, with the triangle that owns each: rows (t + 1,) and points."""
        if spacing <= 0.0 or not len(self.ends):
            return np.zeros(len(self.triangle) + 1, np.int64), np.zeros((0, 3))
        edges = np.flatnonzero(self.sharp())
        a, b = self.vertex[self.ends[edges]].transpose(1, 0, 2)
        pieces = np.ceil(np.linalg.norm(b - a, axis=1) / spacing).astype(np.int64)
        edge = np.repeat(np.arange(edges.size), pieces - 1)
        step = 1 + np.arange(edge.size) - np.repeat(np.cumsum(pieces - 1) - (pieces - 1), pieces - 1)
        inside = a[edge] + (step / pieces[edge])[:, None] * (b - a)[edge]
        tips, first = np.unique(self.ends[edges].ravel(), return_index=True)
        points = np.concatenate([inside, self.vertex[tips]])
        owner = np.concatenate([self.owner[edges][edge], np.repeat(self.owner[edges], 2)[first]])
        start = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=len(self.triangle)))])
        return start.astype(np.int64), points[np.argsort(owner, kind="stable")]


def tree_of(meshes: list[Mesh]) -> WallTree:
    """A tree for each mesh: leaves of `LEAF` triangles in their order, each branch the box of its two halves."""
    lows, highs, base, leaves, first, nodes = [], [], [], [], [], 0
    for mesh in meshes:
        low, high = tree_boxes(mesh)
        base.append(nodes)
        leaves.append(len(low) // 2)
        first.append(sum(len(other.triangles) for other in meshes[: len(first)]))
        nodes += len(low)
        lows.append(low)
        highs.append(high)
    empty = [np.zeros((0, 3))]
    return WallTree(
        low=np.ascontiguousarray(np.concatenate(empty + lows).T),
        high=np.ascontiguousarray(np.concatenate(empty + highs).T),
        base=np.array(base, np.int64),
        leaves=np.array(leaves, np.int64),
        first=np.array(first, np.int64),
        count=np.array([len(mesh.triangles) for mesh in meshes], np.int64),
        part=np.array([mesh.part for mesh in meshes], np.int32),
    )


def tree_boxes(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corners (2 n, 3) of the nodes of a tree with n leaves; row 0 is no node."""
    corners = mesh.vertices[mesh.triangles]
    starts = np.arange(0, len(corners), LEAF)
    count = 1 << max(0, int(np.ceil(np.log2(len(starts)))))
    low, high = np.full((2 * count, 3), np.inf), np.full((2 * count, 3), -np.inf)
    low[count : count + len(starts)] = np.minimum.reduceat(corners.min(axis=1), starts)
    high[count : count + len(starts)] = np.maximum.reduceat(corners.max(axis=1), starts)
    while count > 1:
        half = count // 2
        low[half:count] = np.minimum(low[count : 2 * count : 2], low[count + 1 : 2 * count : 2])
        high[half:count] = np.maximum(high[count : 2 * count : 2], high[count + 1 : 2 * count : 2])
        count = half
    return low, high
