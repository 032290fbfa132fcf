"""The mid-surface of a solid endless belt, as a structured grid.

The facets fall into faces at edges sharper than 45 degrees; the two largest faces are the carrying and the running
side, each a ring. Planes across the belt cut both; each cut is divided evenly by arc length, and the mean of the two
sides is a node. The far end of a cut is found by walking along it: the nearest point of the other belt edge may lie
on another strand (in a turnover that went wrong at a quarter of the stations).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .mesh import Mesh
from .piece import Grid
from .refusals import NotABelt
from .section import Face, Missed, along_closed, clustered, cut, divided
from .topology import Edges, border_loops, cleaned, components, edges_of, pieces

SHARP = (45.0, 30.0, 20.0, 12.0)  # degrees
HALF = np.array([0.5])
ALIKE = 0.6  # smaller over larger area of the two sides of a belt
MOST_OF_IT = 0.5  # share of the surface that both sides make up at least


class Solid(NamedTuple):
    """The two sides of a solid belt and its mean thickness (file units)."""

    one: Face
    other: Face
    thickness: float


def solids_of(mesh: Mesh, warnings: list[str]) -> list[Solid]:
    """The belts of a file of solids; `NotABelt` names a body that is none."""
    mesh = cleaned(mesh, warnings)
    return [_solid(part, edges, warnings) for part, edges in pieces(mesh, edges_of(mesh))]


def _solid(mesh: Mesh, edges: Edges, warnings: list[str]) -> Solid:
    if len(edges.border):
        remedy = "export a closed solid, or leave out --cell for a mid-surface"
        place = mesh.points[edges.nodes[edges.border[0], 0]]
        raise NotABelt("open surface", "the surface is not closed", remedy, place)
    a, b, c = (mesh.points[mesh.facets[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    sides = _sides(mesh, edges, areas, warnings)
    one, other = (_ring(Mesh(mesh.points, mesh.facets[side], mesh.order[side])) for side in sides)
    other = _matched(other, one)
    volume = abs(np.sum(a * np.cross(b, c)) / 6) if _is_wound(mesh, edges) else math.nan
    thickness = volume / (areas[sides[0] | sides[1]].sum() / 2)
    return Solid(one, other, thickness if math.isfinite(thickness) else _gap(one, other))


def _sides(mesh: Mesh, edges: Edges, areas: np.ndarray, warnings: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Facets (masks) of the two largest faces, if they are alike and enclose most of the solid.

    Edges sharper than 45 degrees part faces. Where belt edges are rounded that leaves one face only: then blunter
    edges are tried, down to 12 degrees; facets round a pulley meet at a few degrees.
    """
    bends = _bends(mesh, edges)
    for sharp in SHARP:
        is_smooth = bends < math.radians(sharp)
        faces = components(len(areas), *edges.facets[is_smooth].T)
        size = np.bincount(faces, weights=areas)
        large = np.argsort(-size, kind="stable")[:2]
        alike = len(large) == 2 and size[large[1]] >= ALIKE * size[large[0]]
        if alike and size[large].sum() > MOST_OF_IT * areas.sum():
            if sharp < SHARP[0]:
                warnings.append(
                    f"no edges sharper than {sharp:g} degrees part the belt's sides: is it rounded there?"
                )
            return faces == large[0], faces == large[1]
    found = "it has no two sides of like size that edges part"
    remedy = "remove fillets, cleats and profiles from the solid, or mesh the mid-surface"
    raise NotABelt("solid", found, remedy, mesh.points.mean(axis=0))


def _bends(mesh: Mesh, edges: Edges) -> np.ndarray:
    """Angle (E,) between the two facets of each edge, rad, 0 if they are level, whatever their winding."""
    ends = edges.nodes
    edge = mesh.points[ends[:, 1]] - mesh.points[ends[:, 0]]
    edge /= np.linalg.norm(edge, axis=1, keepdims=True)
    inward = []
    for facet in edges.facets.T:
        apex = mesh.points[mesh.facets[facet].sum(axis=1) - ends.sum(axis=1)] - mesh.points[ends[:, 0]]
        across = apex - np.sum(apex * edge, axis=1, keepdims=True) * edge
        inward.append(across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300))
    return np.arccos(np.clip(-np.sum(inward[0] * inward[1], axis=1), -1.0, 1.0))


def _is_wound(mesh: Mesh, edges: Edges) -> bool:
    """Whether all facets are wound alike, so that the divergence theorem gives the volume."""
    direction = np.sign(np.roll(mesh.facets, -1, axis=1) - mesh.facets).ravel()
    return not np.bincount(edges.of_facet.ravel(), weights=direction).any()


def _gap(one: Face, other: Face) -> float:
    from scipy.spatial import cKDTree

    return float(np.median(cKDTree(other.points).query(one.points)[0]))


def _ring(side: Mesh) -> Face:
    """One side of an endless belt: a face with two closed borders."""
    ((part, edges),) = pieces(side, edges_of(side))
    loops = border_loops(edges)
    if len(loops) != 2:
        what = "ends (an open length)" if len(loops) == 1 else f"{len(loops)} borders"
        remedy = "--cell takes whole endless belts: close the belt in CAD, or mesh the mid-surface"
        raise NotABelt("solid", f"a side of the belt has {what}", remedy, part.points.mean(axis=0))
    border = np.full(len(edges.nodes), -1)
    border[edges.border] = np.isin(edges.nodes[edges.border, 0], loops[1])
    rims = [part.points[loop] for loop in loops]
    corners = part.points[part.facets]
    area = np.linalg.norm(np.cross(*np.diff(corners, axis=1).swapaxes(0, 1)), axis=1).sum() / 2
    clusters = clustered(corners, 2 * area / _girth(rims[0]))  # twice the width: a slanted cut is longer
    return Face(part.points, part.facets, edges.of_facet, edges.facets, border, rims, clusters)


def _matched(face: Face, guide: Face) -> Face:
    """The face with its borders in the order of those that lie opposite on `guide`."""
    from scipy.spatial import cKDTree

    tree = cKDTree(guide.loops[0])
    one, other = (tree.query(loop)[0].mean() for loop in face.loops)
    if one <= other:
        return face
    return face._replace(border=np.where(face.border < 0, -1, 1 - face.border), loops=face.loops[::-1])


def mid_surfaces(solids: list[Solid], cell: float, *, half_edges: bool) -> list[Grid]:
    """Grids of the mid-surfaces, cells of about `cell` (file units), whole numbers of them along and across.

    The outer nodes lie half a cell inside the belt's edge, or on it with `half_edges`.
    """
    return [_mid_surface(solid, cell, half_edges) for solid in solids]


def _mid_surface(solid: Solid, cell: float, half_edges: bool) -> Grid:
    centre = _centre_line(solid, cell)
    rows = max(round(_girth(centre) / cell), 3)
    stations, directions = along_closed(centre, rows)
    chains = [_cut(solid.one, *station) for station in zip(stations, directions)]
    width = float(np.mean([np.linalg.norm(np.diff(chain, axis=0), axis=1).sum() for chain in chains]))
    columns = max(round(width / cell) + half_edges, 2)
    shares = np.linspace(0, 1, columns) if half_edges else (np.arange(columns) + 0.5) / columns
    points = np.empty((rows, columns, 3))
    for i, chain in enumerate(chains):
        back = _cut(solid.other, stations[i], directions[i])
        points[i] = (divided(chain, shares) + divided(back, shares)) / 2
    _refuse_folds(points, directions, cell)
    return Grid(points, "endless")


def _centre_line(solid: Solid, cell: float) -> np.ndarray:
    """Middles (n, 3) of cuts across both sides, about one a cell.

    Where the belt twists, its edges run aslant of its centre line, one to each side: the first cuts stand square to
    the mean direction of both edges. The middles of such cuts stray by some millimetres in a turnover, so the cuts
    are made again, square to the line that they give over half a width to each side.
    """
    from scipy.spatial import cKDTree

    first, second = solid.one.loops
    starts, ways = along_closed(first, max(round(_girth(first) / cell), 3))
    opposite, opposite_ways = along_closed(second, 4 * len(starts))
    nearest = cKDTree(opposite)
    middles, widths = [], []
    for start, way in zip(starts, ways):
        chain = _cut(solid.one, start, way)
        other = opposite_ways[nearest.query(chain[-1])[1]]
        mean = way + np.sign(other @ way) * other
        middles.append(_middle(solid, divided(chain, HALF)[0], mean / np.linalg.norm(mean)))
        widths.append(np.linalg.norm(np.diff(chain, axis=0), axis=1).sum())
    reach = min(max(round(np.median(widths) / 2 / cell), 1), len(starts) // 8 + 1)
    stations = along_closed(np.array(middles), len(starts), reach)
    return np.array([_middle(solid, *station) for station in zip(*stations)])


def _middle(solid: Solid, point: np.ndarray, direction: np.ndarray) -> np.ndarray:
    sides = [divided(_cut(side, point, direction), HALF)[0] for side in (solid.one, solid.other)]
    return (sides[0] + sides[1]) / 2


def _cut(face: Face, point: np.ndarray, direction: np.ndarray) -> np.ndarray:
    try:
        return cut(face, point, direction)
    except Missed as missed:
        raise NotABelt("solid", str(missed), "mesh the mid-surface of this belt", point) from None


def _girth(loop: np.ndarray) -> float:
    return float(np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1).sum())


def _refuse_folds(points: np.ndarray, directions: np.ndarray, cell: float) -> None:
    """Every node is ahead of the one before it and within two cells of it."""
    ahead = np.roll(points, -1, axis=0) - points
    forward = np.einsum("ijk,ik->ij", ahead, directions)
    bad = (forward <= 0) | (np.linalg.norm(ahead, axis=2) > 2.5 * cell)
    if bad.any():
        i, j = np.argwhere(bad)[0]
        remedy = "take smaller --cell, or mesh the mid-surface"
        raise NotABelt("solid", "the cuts across the belt cross each other", remedy, points[i, j])
