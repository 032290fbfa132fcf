"""Rows and columns of a belt from the topology of its triangles, with proof.

A quad mesh whose cells were cut along any diagonals is read back without looking at shapes: the hop distance from
one belt edge is the column, because every edge, diagonals included, changes the column by at most one; between
two columns the crossing edges are transverse and diagonal in turn. The result is checked cell by cell before it
is believed, so that a wrong guess anywhere ends in a refusal, never in a wrong belt.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .mesh import Mesh
from .refusals import NotABelt
from .topology import Edges, components

REMESH = "mesh the mid-surface with a structured (mapped) rectangular grid"


class Strips(NamedTuple):
    """Edges that run from one column to the next, and how they alternate.

    column : (V,) column of each node.
    edges : (K,) the crossing edges; ends : (K, 2) their nodes, lower column first; strip : (K,) lower column.
    colour : (K,) the two classes, one of which holds the diagonals.
    opposite : (K, 2) node opposite the edge in each of its facets, -1 without a facet.
    """

    column: np.ndarray
    edges: np.ndarray
    ends: np.ndarray
    strip: np.ndarray
    colour: np.ndarray
    opposite: np.ndarray


def columns_from(side: np.ndarray, mesh: Mesh, edges: Edges, count: int) -> np.ndarray:
    """Column (V,) of every node: hops from the belt edge `side`, with `len(side)` nodes in each of `count`."""
    column = _hops(side, len(mesh.points), edges.nodes)
    if column.min() < 0:
        # So it is with the two-sided cover of a piece that only looks like a Moebius belt: it touches itself in a node.
        raise NotABelt("unstructured", "nodes that no edge joins to the belt's edge", REMESH)
    sizes = np.bincount(column)
    wrong = np.flatnonzero(sizes != len(side))
    if len(sizes) != count or len(wrong):
        layer = wrong[0] if len(wrong) else len(sizes) - 1
        steady = layer > 1 and layer + 2 < len(sizes) and sizes[layer] == sizes[layer + 1]
        raise NotABelt(
            "transition" if steady else "unstructured",
            f"line {layer + 1} from the belt edge has {sizes[layer]} nodes, the edge has {len(side)}",
            REMESH,
            mesh.points[column == layer].mean(axis=0),
        )
    return column


def _hops(sources: np.ndarray, count: int, edges: np.ndarray) -> np.ndarray:
    """Hops (count,) over edges (E, 2) from the nearest source; -1 where no way leads."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order

    root = np.full(len(sources), count)
    a = np.concatenate([edges[:, 0], edges[:, 1], root])
    b = np.concatenate([edges[:, 1], edges[:, 0], sources])
    graph = csr_array((np.ones(len(a), np.int8), (a, b)), shape=(count + 1, count + 1))
    order, before = breadth_first_order(graph, count, return_predecessors=True)
    place = np.empty(count + 1, np.int64)
    place[order] = np.arange(len(order))
    parents = place[
        before[order[1:]]
    ]  # never decreasing: a layer ends where the parents leave the layer before
    hops = np.zeros(count + 1, np.int64)
    begin, end, layer = 0, 1, 0
    while begin < end:
        hops[order[begin:end]] = layer
        begin, end, layer = end, 1 + np.searchsorted(parents, end, side="left"), layer + 1
    return hops[:count] - 1


def strips_of(mesh: Mesh, edges: Edges, column: np.ndarray) -> Strips:
    """Crossing edges, two-coloured so that neighbours round a strip differ."""
    ends = edges.nodes
    step = column[ends[:, 1]] - column[ends[:, 0]]
    crossing = np.flatnonzero(step)
    number = np.full(len(ends), -1)
    number[crossing] = np.arange(len(crossing))
    of_facet = number[edges.of_facet]
    crossed = of_facet >= 0
    _refuse_flat_facets(mesh, crossed)
    pairs = of_facet[crossed].reshape(-1, 2)
    label = components(2 * len(crossing), *_opposites(pairs, len(crossing))).reshape(2, -1)
    ends = np.where((step[crossing] < 0)[:, None], ends[crossing][:, ::-1], ends[crossing])
    if np.any(label[0] == label[1]):
        odd = ends[np.argmax(label[0] == label[1]), 0]
        raise NotABelt("unstructured", "cells that are no quads", REMESH, mesh.points[odd])
    colour = (label[0] < label[1]).astype(np.int64)
    return Strips(column, crossing, ends, column[ends[:, 0]], colour, _opposite_nodes(mesh, edges, crossing))


def _refuse_flat_facets(mesh: Mesh, crossed: np.ndarray) -> None:
    flat = np.flatnonzero(np.count_nonzero(crossed, axis=1) != 2)
    if len(flat):
        place = mesh.points[mesh.facets[flat[0]]].mean(axis=0)
        raise NotABelt("unstructured", "a facet inside one line of nodes", REMESH, place)


def _opposites(pairs: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    a, b = pairs.T
    return np.concatenate([a, a + count]), np.concatenate([b + count, b])


def _opposite_nodes(mesh: Mesh, edges: Edges, chosen: np.ndarray) -> np.ndarray:
    facets = edges.facets[chosen]
    others = mesh.facets[facets].sum(axis=2) - edges.nodes[chosen].sum(axis=1)[:, None]
    return np.where(facets >= 0, others, -1)


def rows_open(strips: Strips) -> np.ndarray:
    """Which crossing edges (K,) are transverse in an open belt: the colour of those on the belt's ends."""
    on_end = strips.opposite[:, 1] < 0
    count = strips.column.max()
    ones = np.bincount(strips.strip[on_end], weights=strips.colour[on_end], minlength=count)
    if np.any(np.bincount(strips.strip[on_end], minlength=count) != 2) or np.any(ones % 2):
        raise NotABelt("unstructured", "the ends of the mesh are not aligned", REMESH)
    return strips.colour == (ones > 0)[strips.strip]


def chain(line: np.ndarray, strips: Strips, is_transverse: np.ndarray, count: int) -> np.ndarray:
    """Node grid (R, C): the line of nodes on the first belt edge, followed through the transverse edges."""
    nodes = len(strips.column)
    lower, upper = strips.ends[is_transverse].T
    if np.any(np.bincount(lower, minlength=nodes)[strips.column < count - 1] != 1):
        raise NotABelt("unstructured", "rows that fork or end", REMESH)
    after = np.full(nodes, -1)
    after[lower] = upper
    grid = np.empty((len(line), count), np.int64)
    grid[:, 0] = line
    for j in range(1, count):
        grid[:, j] = after[grid[:, j - 1]]
    return grid


def prove(grid: np.ndarray, mesh: Mesh, *, endless: bool) -> None:
    """Raise unless `grid` (R, C) holds every node once and each of its cells exactly its two facets.

    A facet of a cell lacks one of the four corners; two facets fill the cell without overlap if and only if the
    corners they lack are opposite.
    """
    rows, columns = grid.shape
    place = np.full(len(mesh.points), -1)
    place[grid.ravel()] = np.arange(grid.size)
    if grid.size != len(mesh.points) or place.min() < 0:
        raise NotABelt("unstructured", "nodes outside the grid", REMESH)
    i, j = np.divmod(place[mesh.facets], columns)
    across = j.max(axis=1) - j.min(axis=1)
    if endless:
        wraps = (i.max(axis=1) == rows - 1) & (i.min(axis=1) == 0)
        i = np.where(wraps[:, None] & (i == 0), rows, i)
    along = i.max(axis=1) - i.min(axis=1)
    low_i, low_j = i.min(axis=1), j.min(axis=1)
    corner = 2 * (i - low_i[:, None]) + (j - low_j[:, None])
    lacking = 6 - corner.sum(axis=1)
    cell = low_i * (columns - 1) + low_j
    cells = (rows if endless else rows - 1) * (columns - 1)
    bad = np.flatnonzero((along != 1) | (across != 1))
    if not len(bad):
        # Opposite corners are 0 and 3 or 1 and 2: only they add up to 3.
        total = np.bincount(cell, minlength=cells)
        lacked = np.bincount(cell, weights=lacking, minlength=cells)
        wrong = (total != 2) | (lacked != 3)
        if len(total) == cells and not wrong.any():
            return
        bad = np.flatnonzero(np.isin(cell, np.flatnonzero(wrong)))
    place = mesh.points[mesh.facets[bad[0]]].mean(axis=0) if len(bad) else None
    raise NotABelt("unstructured", "a cell that is not exactly two facets", REMESH, place)
