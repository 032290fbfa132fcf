"""What a triangle mesh is made of: edges, connected pieces, borders, and the class of surface they make."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .mesh import Mesh
from .refusals import NotABelt

NEXT = (1, 2, 0)
MOST_PIECES = 1000


class Edges(NamedTuple):
    """Edge table of a mesh.

    nodes : (E, 2) lower and higher node of each edge.
    of_facet : (F, 3) edge from corner k to corner k + 1.
    facets : (E, 2) the one or two facets of each edge; -1 where there is no second.
    """

    nodes: np.ndarray
    of_facet: np.ndarray
    facets: np.ndarray

    @property
    def border(self) -> np.ndarray:
        """Indices of the edges with one facet."""
        return np.flatnonzero(self.facets[:, 1] < 0)

    @property
    def inner(self) -> np.ndarray:
        """Indices of the edges with two facets."""
        return np.flatnonzero(self.facets[:, 1] >= 0)


def cleaned(mesh: Mesh, warnings: list[str]) -> Mesh:
    """The mesh without facets that have a node twice and without repeated facets, in any winding."""
    corners = np.sort(mesh.facets, axis=1)
    whole = (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2])
    _warn(warnings, np.count_nonzero(~whole), "degenerate facet")
    mesh, corners = _kept(mesh, whole), corners[whole]
    by_corners = np.lexsort((corners[:, 2], corners[:, 1], corners[:, 0]))
    is_repeated = np.zeros(len(corners), bool)
    is_repeated[by_corners[1:]] = np.all(corners[by_corners[1:]] == corners[by_corners[:-1]], axis=1)
    _warn(warnings, np.count_nonzero(is_repeated), "duplicate facet")
    if not len(corners):
        remedy = "export the mesh with more digits"
        raise NotABelt("degenerate", "no facet has three different nodes", remedy, mesh.points[0])
    return _kept(mesh, ~is_repeated)


def without_slivers(mesh: Mesh, warnings: list[str]) -> Mesh:
    """The mesh without facets of no area, although their three nodes differ."""
    a, b, c = (mesh.points[mesh.facets[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    longest = np.max([np.sum((p - q) ** 2, axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    has_area = area > 1e-7 * longest  # seven digits, as ASCII files commonly have, leave noise of this size
    _warn(warnings, np.count_nonzero(~has_area), "degenerate facet", "without area")
    return _kept(mesh, has_area)


def _kept(mesh: Mesh, keep: np.ndarray) -> Mesh:
    return mesh if keep.all() else Mesh(mesh.points, mesh.facets[keep], mesh.order[keep])


def _warn(warnings: list[str], number: int, what: str, how: str = "") -> None:
    if number:
        warnings.append(f"{number} {what}{'s' if number > 1 else ''} {how + ' ' if how else ''}left out")


def edges_of(mesh: Mesh) -> Edges:
    """Edge table; an edge with three or more facets is refused with its place."""
    facets = mesh.facets
    starts, ends = facets.ravel(), facets[:, NEXT].ravel()
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    keys = low * len(mesh.points) + high
    order = np.argsort(keys, kind="stable")
    is_new = np.concatenate([[True], keys[order][1:] != keys[order][:-1]])
    first = np.flatnonzero(is_new)
    uses = np.diff(np.append(first, len(order)))
    nodes = np.stack([low, high], axis=1)[order[first]]
    if uses.max() > 2:
        _refuse_fin(mesh, nodes[uses > 2], uses.max())
    of_facet = np.empty(len(order), np.int64)
    of_facet[order] = np.cumsum(is_new) - 1
    second = np.where(uses == 2, order[np.minimum(first + 1, len(order) - 1)] // 3, -1)
    return Edges(nodes, of_facet.reshape(-1, 3), np.stack([order[first] // 3, second], axis=1))


def _refuse_fin(mesh: Mesh, nodes: np.ndarray, most: int) -> None:
    raise NotABelt(
        "fin",
        f"{len(nodes)} edge{'s' if len(nodes) > 1 else ''} with more than two facets (up to {most})",
        "a mid-surface has at most two facets at an edge: remove ribs, cleats and doubled surfaces",
        mesh.points[nodes[0]].mean(axis=0),
    )


def pieces(mesh: Mesh, edges: Edges) -> list[tuple[Mesh, Edges]]:
    """The connected pieces (over edges with two facets), in file order, each with its own node numbers."""
    label = components(len(mesh.facets), *edges.facets[edges.inner].T)
    number = int(label.max()) + 1
    if number > MOST_PIECES:
        found = f"{number} loose pieces: neighbouring facets have no common nodes"
        raise NotABelt("loose", found, "export the mesh with more digits, or weld its nodes", mesh.points[0])
    if number == 1 and facets_at(mesh).min() > 0:
        return [(mesh, edges)]
    result = []
    for piece in np.split(np.argsort(label, kind="stable"), np.cumsum(np.bincount(label))[:-1]):
        nodes, facets = np.unique(mesh.facets[piece], return_inverse=True)
        part = Mesh(mesh.points[nodes], facets.reshape(-1, 3), mesh.order[piece])
        result.append((part, edges_of(part)))
    return sorted(result, key=lambda item: item[0].order.min())


def components(number: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Label (number,) of the connected component of each of `number` things linked in pairs a, b."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links = coo_array((np.ones(len(a), np.int8), (a, b)), shape=(number, number))
    return connected_components(links, directed=False)[1]


def split_fans(mesh: Mesh, edges: Edges) -> Mesh:
    """The mesh with one node for each fan of facets: surfaces that touch in a node only are parted there."""
    starts = mesh.facets.ravel()
    half = np.argsort(edges.of_facet.ravel(), kind="stable")
    uses = np.bincount(edges.of_facet.ravel(), minlength=len(edges.nodes))
    first = (np.cumsum(uses) - uses)[uses == 2]
    one, two = half[first], half[first + 1]
    follower = np.arange(len(starts)).reshape(-1, 3)[:, NEXT].ravel()
    same_way = starts[one] == starts[two]
    links_a = np.concatenate([one, follower[one]])
    links_b = np.concatenate([np.where(same_way, two, follower[two]), np.where(same_way, follower[two], two)])
    fan = components(len(starts), links_a, links_b)
    corner_of_fan = np.zeros(fan.max() + 1, np.int64)
    corner_of_fan[fan] = starts
    return Mesh(mesh.points[corner_of_fan], fan.reshape(-1, 3).astype(np.int64), mesh.order)


def is_pinched(edges: Edges) -> bool:
    """Whether some node has more than two border edges."""
    nodes = edges.nodes[edges.border]
    return len(nodes) > 0 and np.bincount(nodes.ravel()).max() > 2


def border_loops(edges: Edges) -> list[np.ndarray]:
    """Closed borders as sequences of nodes, longest first; each node has exactly two border edges."""
    nodes = edges.nodes[edges.border]
    neighbours: dict[int, list[int]] = {}
    for a, b in nodes.tolist():
        neighbours.setdefault(a, []).append(b)
        neighbours.setdefault(b, []).append(a)
    loops = []
    while neighbours:
        loop, node = [], next(iter(neighbours))
        while node in neighbours:
            loop.append(node)
            one, other = neighbours.pop(node)
            node = one if one in neighbours else other
        loops.append(np.array(loop))
    return sorted(loops, key=lambda loop: (-len(loop), loop.min()))


def facets_at(mesh: Mesh) -> np.ndarray:
    """Number of facets (V,) at each node."""
    return np.bincount(mesh.facets.ravel(), minlength=len(mesh.points))


def angle_sums(mesh: Mesh) -> np.ndarray:
    """Sum (V,) of the facets' angles at each node, rad."""
    sums = np.zeros(len(mesh.points))
    corners = mesh.points[mesh.facets]
    for k in range(3):
        a, b = corners[:, NEXT[k]] - corners[:, k], corners[:, NEXT[NEXT[k]]] - corners[:, k]
        angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1))
        sums += np.bincount(mesh.facets[:, k], weights=angle, minlength=len(sums))
    return sums


def double_cover(mesh: Mesh, edges: Edges) -> tuple[Mesh, np.ndarray]:
    """The two-sided cover of a one-sided surface and, for each of its nodes, the node it covers.

    Facet f appears as f (wound as in the file) and F + f (wound the other way); across an edge the sheet is kept
    if the windings agree and changed if not, so the cover has two sides. Of a Moebius belt it is an endless belt.
    """
    count = len(mesh.facets)
    flipped = mesh.facets[:, ::-1]
    both = np.concatenate([mesh.facets, flipped])
    a, b = edges.facets[edges.inner].T
    direction = np.sign(mesh.facets[:, NEXT] - mesh.facets)
    agree = np.zeros(len(edges.nodes), np.int64)
    np.add.at(agree, edges.of_facet.ravel(), direction.ravel())
    changed = agree[edges.inner] != 0  # both facets run along the edge the same way: their windings disagree
    pairs_a = np.concatenate([a, a + count])
    pairs_b = np.concatenate([np.where(changed, b + count, b), np.where(changed, b, b + count)])
    nodes = edges.nodes[np.tile(edges.inner, 2)]
    corner = np.arange(6 * count).reshape(-1, 3)
    links = []
    for column in range(2):
        node = nodes[:, column, None]
        links.append((corner[pairs_a][both[pairs_a] == node], corner[pairs_b][both[pairs_b] == node]))
    label = components(6 * count, *(np.concatenate(side) for side in zip(*links)))
    covered = np.zeros(label.max() + 1, np.int64)
    covered[label] = both.ravel()
    cover = Mesh(mesh.points[covered], label.reshape(-1, 3).astype(np.int64), np.tile(mesh.order, 2))
    return cover, covered
