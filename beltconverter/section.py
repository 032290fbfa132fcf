"""Cuts of planes through one side of a solid belt, followed from one belt edge to the other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Face(NamedTuple):
    """One side of a belt, a ring of facets.

    points : (V, 3); facets : (F, 3) nodes; facet_edges : (F, 3) edge from corner k to k + 1; edge_facets : (E, 2),
    -1 beyond a border; border : (E,) which of the two borders an edge is on, -1 inside; loops : the borders as
    points.
    """

    points: np.ndarray
    facets: np.ndarray
    facet_edges: np.ndarray
    edge_facets: np.ndarray
    border: np.ndarray
    loops: list[np.ndarray]


class Missed(Exception):
    """A plane found no cut from one belt edge to the other."""


def along_closed(loop: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """`count` evenly spaced points (n, 3) of a closed polyline and its directions (n, 3) there.

    Directions are chords over one spacing to each side, so that facet corners do not tilt the cuts.
    """
    closed = np.concatenate([loop, loop[:1]])
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    places = np.arange(count) / count * way[-1]
    points = np.stack([np.interp(places, way, closed[:, k]) for k in range(3)], axis=1)
    directions = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    return points, directions / np.linalg.norm(directions, axis=1, keepdims=True)


def divided(chain: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Points (n, 3) at shares (n,) of a polyline's length."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(chain, axis=0), axis=1))])
    return np.stack([np.interp(shares * way[-1], way, chain[:, k]) for k in range(3)], axis=1)


def cut(face: Face, point: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Polyline (n, 3) in which the plane through `point` cuts the face, from its first border to its second.

    Of several cuts (the plane meets other strands too) the one nearest to `point`.
    """
    height = (face.points - point) @ direction
    above = (height >= 0)[face.facets]
    cut_facets = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
    chains = _chains(face, cut_facets, above[cut_facets], height)
    if not chains:
        raise Missed("a plane across the belt finds no cut from edge to edge")
    return min(chains, key=lambda chain: _distance(chain, point))


def _chains(face: Face, facets: np.ndarray, above: np.ndarray, height: np.ndarray) -> list[np.ndarray]:
    """Cuts from the first border to the second as polylines; each cut facet has exactly two cut edges."""
    crossed = face.facet_edges[facets][above != np.roll(above, -1, axis=1)].reshape(-1, 2)
    edges_of = dict(zip(facets.tolist(), crossed.tolist()))
    ends = crossed[face.border[crossed] == 0].tolist()
    walks = [_walk(face, edges_of, start) for start in ends]
    return [_points_on(face, np.array(walk), height) for walk in walks if face.border[walk[-1]] == 1]


def _walk(face: Face, edges_of: dict[int, list[int]], edge: int) -> list[int]:
    """Cut edges from a border edge to the next border edge."""
    walk, facet = [edge], int(face.edge_facets[edge, 0])
    while facet >= 0:
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
    start = face.facets[facet, side]
    end = face.facets[facet, (side + 1) % 3]
    share = height[start] / (height[start] - height[end])
    return face.points[start] + share[:, None] * (face.points[end] - face.points[start])


def _distance(chain: np.ndarray, point: np.ndarray) -> float:
    """Least squared distance of a point to a polyline."""
    start, step = chain[:-1], np.diff(chain, axis=0)
    length = np.maximum(np.sum(step * step, axis=1), 1e-300)
    share = np.clip(np.sum((point - start) * step, axis=1) / length, 0.0, 1.0)
    return float(np.min(np.sum((start + share[:, None] * step - point) ** 2, axis=1)))
