"""Cuts of planes through one side of a solid belt, followed from one belt edge to the other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Clusters(NamedTuple):
    """Facets in bunches of neighbours: facets (n, k), centres (n, 3) and radii (n,) of spheres round each bunch.

    reach : no cut is longer than this, so bunches farther from a point of the cut do not count.
    """

    facets: np.ndarray
    centres: np.ndarray
    radii: np.ndarray
    reach: float

    def near(self, point: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """Facets (m,) of the bunches that the plane meets within reach of `point`."""
        away = self.centres - point
        met = np.abs(away @ direction) <= self.radii
        met &= np.sum(away * away, axis=1) <= (self.radii + self.reach) ** 2
        return self.facets[met].ravel()


def clustered(corners: np.ndarray, reach: float, size: int = 128) -> Clusters:
    """Bunches of facets given by their corner points (F, 3, 3), in the order of a tree of their centres."""
    from scipy.spatial import cKDTree

    order = cKDTree(corners.mean(axis=1)).indices
    facets = np.resize(order, (-(-len(order) // size), size))
    bunched = corners[facets].reshape(len(facets), -1, 3)
    centres = (bunched.min(axis=1) + bunched.max(axis=1)) / 2
    radii = np.linalg.norm(bunched - centres[:, None], axis=2).max(axis=1)
    return Clusters(facets, centres, radii, reach)


class Face(NamedTuple):
    """One side of a belt, a ring of facets.

    points : (V, 3); facets : (F, 3) nodes; facet_edges : (F, 3) edge from corner k to k + 1; edge_facets : (E, 2),
    -1 beyond a border; border : (E,) which of the two borders an edge is on, -1 inside; loops : the borders as
    points; clusters : the facets in bunches, to find those that a plane may cut.
    """

    points: np.ndarray
    facets: np.ndarray
    facet_edges: np.ndarray
    edge_facets: np.ndarray
    border: np.ndarray
    loops: list[np.ndarray]
    clusters: Clusters


class Missed(Exception):
    """A plane found no cut from one belt edge to the other."""


def along_closed(loop: np.ndarray, count: int, reach: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """`count` evenly spaced points (n, 3) of a closed polyline and its directions (n, 3) there.

    Directions are chords over `reach` spacings to each side, so that facet corners do not tilt the cuts.
    """
    closed = np.concatenate([loop, loop[:1]])
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    places = np.arange(count) / count * way[-1]
    points = np.stack([np.interp(places, way, closed[:, k]) for k in range(3)], axis=1)
    directions = np.roll(points, -reach, axis=0) - np.roll(points, reach, axis=0)
    return points, directions / np.linalg.norm(directions, axis=1, keepdims=True)


def divided(chain: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Points (n, 3) at shares (n,) of a polyline's length."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(chain, axis=0), axis=1))])
    return np.stack([np.interp(shares * way[-1], way, chain[:, k]) for k in range(3)], axis=1)


def cut(face: Face, point: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Polyline (n, 3) in which the plane through `point` cuts the face, from its first border to its second.

    Of several cuts (the plane meets other strands too) the one nearest to `point`.
    """
    near = face.clusters.near(point, direction)
    height = face.points @ direction - point @ direction
    above = (height >= 0)[face.facets[near]]
    is_cut = above.any(axis=1) & ~above.all(axis=1)
    chains = _chains(face, near[is_cut], above[is_cut], height) if is_cut.any() else []
    if not chains:
        raise Missed("a plane across the belt finds no cut from edge to edge")
    return min(chains, key=lambda chain: _distance(chain, point))


def _chains(face: Face, facets: np.ndarray, above: np.ndarray, height: np.ndarray) -> list[np.ndarray]:
    """Cuts from the first border to the second as polylines; each cut facet has exactly two cut edges."""
    crossed = face.facet_edges[facets][above != np.roll(above, -1, axis=1)].reshape(-1, 2)
    edges_of = dict(zip(facets.tolist(), crossed.tolist()))
    walks = [_walk(face, edges_of, start) for start in crossed[face.border[crossed] == 0].tolist()]
    through = [np.array(walk) for walk in walks if face.border[walk[-1]] == 1]
    return [_points_on(face, walk, height) for walk in through]


def _walk(face: Face, edges_of: dict[int, list[int]], edge: int) -> list[int]:
    """Cut edges from a border edge on, to the next border edge or to where the facets at hand end."""
    walk, facet = [edge], int(face.edge_facets[edge, 0])
    while facet in edges_of:
        one, other = edges_of[facet]
        edge = other if one == edge else one
        walk.append(edge)
        first, second = face.edge_facets[edge].tolist()
        facet = second if first == facet else first
    return walk


def _points_on(face: Face, edges: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Where the plane meets the edges."""
    facet = face.edge_facets[edges, 0]
    side = np.argmax(face.facet_edges[facet] == edges[:, None], axis=1)
    start, end = face.facets[facet, side], face.facets[facet, (side + 1) % 3]
    share = height[start] / (height[start] - height[end])
    return face.points[start] + share[:, None] * (face.points[end] - face.points[start])


def _distance(chain: np.ndarray, point: np.ndarray) -> float:
    """Least squared distance of a point to a polyline."""
    start, step = chain[:-1], np.diff(chain, axis=0)
    length = np.maximum(np.sum(step * step, axis=1), 1e-300)
    share = np.clip(np.sum((point - start) * step, axis=1) / length, 0.0, 1.0)
    return float(np.min(np.sum((start + share[:, None] * step - point) ** 2, axis=1)))
