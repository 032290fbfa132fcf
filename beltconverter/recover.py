"""A mesh file's surface to the proven grids of its belts: exact nodes first, tolerance only where that fails."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .mesh import Mesh
from .piece import Grid, solve
from .refusals import NotABelt
from .topology import Edges, cleaned, components, edges_of, facets_at, pieces, without_slivers


class Wishes(NamedTuple):
    """What the user states about the mesh.

    kind : "open", "endless" or None; cells : "auto", "square" or "skew"; weld : largest distance (file units) at
    which border nodes may become one, None for automatic.
    """

    kind: str | None = None
    cells: str = "auto"
    weld: float | None = None


def recover(mesh: Mesh, wishes: Wishes, warnings: list[str]) -> list[Grid]:
    """Proven grids in file order; `NotABelt` if any piece of the mesh is none."""
    mesh = cleaned(mesh, warnings)
    try:
        grids = _grids(mesh, edges_of(mesh), wishes, warnings)
    except NotABelt as refusal:
        grids = _mended(mesh, wishes, warnings)
        if not grids:
            raise refusal from None
    else:
        if len(grids) > 1:
            grids = _joined(mesh, grids, wishes, warnings)
    return [_asserted(_closed(grid, wishes, warnings), wishes) for grid in grids]


def _grids(mesh: Mesh, edges: Edges, wishes: Wishes, warnings: list[str]) -> list[Grid]:
    parts = pieces(mesh, edges)
    _refuse_common_nodes(mesh, [part for part, _ in parts])
    return [solve(part, part_edges, wishes.cells, warnings) for part, part_edges in parts]


def _refuse_common_nodes(mesh: Mesh, parts: list[Mesh]) -> None:
    """Two patches that share nodes but no edge are one belt whose lines of nodes do not match."""
    if sum(len(part.points) for part in parts) < np.count_nonzero(facets_at(mesh)) + 2:
        return
    points, uses = np.unique(np.concatenate([part.points for part in parts]), axis=0, return_counts=True)
    found = f"{np.count_nonzero(uses > 1)} nodes in which patches meet without a common edge"
    remedy = "give neighbouring patches the same nodes, or export each belt to its own file"
    raise NotABelt("crack", found, remedy, points[np.argmax(uses > 1)])


def _mended(mesh: Mesh, wishes: Wishes, warnings: list[str]) -> list[Grid] | None:
    """Grids after leaving out facets without area, else at the smallest weld that proves the fewest pieces.

    Of equally few pieces a clear weld is preferred: see `_welds`.
    """
    notes: list[str] = []
    plain = without_slivers(mesh, notes)
    if notes:
        try:
            grids = _grids(plain, edges_of(plain), wishes, notes)
        except NotABelt:
            pass
        else:
            warnings.extend(notes)
            return grids
    best, best_rank = None, None
    for tolerance, is_clear, merged in _welds(mesh, wishes.weld, 0.25):
        notes = []
        try:
            merged = cleaned(merged, [])
            grids = _grids(merged, edges_of(merged), wishes, notes)
        except NotABelt:
            continue
        rank = (len(grids), not is_clear)
        if best is None or rank < best_rank:
            best_rank = rank
            best = grids, [*notes, f"border nodes up to {tolerance:.3g} apart (file units) were welded"]
        if best_rank == (1, False):
            break
    if best:
        warnings.extend(best[1])
        return best[0]
    return None


def _joined(mesh: Mesh, grids: list[Grid], wishes: Wishes, warnings: list[str]) -> list[Grid]:
    """Several proven belts, or one whose patches differ in the last digits of their common border.

    Belts side by side keep their distance: only 1 % of a cell is taken for rounding here.
    """
    best, best_notes = grids, []
    for tolerance, _, merged in _welds(mesh, wishes.weld, 0.01):
        notes: list[str] = []
        try:
            trial = _grids(merged, edges_of(merged), wishes, notes)
        except NotABelt:
            continue
        if len(trial) < len(best):
            found = f"patches joined: border nodes up to {tolerance:.3g} apart (file units) were welded"
            best, best_notes = trial, [*notes, found]
    warnings.extend(best_notes)
    return best


def _welds(mesh: Mesh, most: float | None, share: float):
    """Ever coarser welds (tolerance, is clear, mesh) of border nodes, from 1e-8 of the extent to `share` of an edge.

    Only levels at which another pair of nodes comes into reach are tried, so belts that keep clear cost nothing.
    A level is clear if no further pair lies within four times its tolerance: it does not cut through the scatter
    of one cause, as a level does that closes one half of a crack.
    """
    from scipy.spatial import cKDTree

    edges = edges_of_lenient(mesh)
    if edges is None:
        return
    length = np.linalg.norm(np.diff(mesh.points[edges.nodes], axis=1)[:, 0], axis=1)
    limit = share * np.median(length) if most is None else most
    nodes = np.unique(edges.nodes[edges.border])
    pairs = cKDTree(mesh.points[nodes]).query_pairs(limit, output_type="ndarray") if len(nodes) else ()
    if not len(pairs):
        return
    a, b = nodes[pairs].T
    apart = np.linalg.norm(mesh.points[a] - mesh.points[b], axis=1)
    tolerance = 1e-8 * np.ptp(mesh.points, axis=0).max()
    reached = 0
    while tolerance < 2.5 * limit:
        near = apart <= min(tolerance, limit)
        if np.count_nonzero(near) > reached:
            reached = np.count_nonzero(near)
            is_clear = not np.any((apart > min(tolerance, limit)) & (apart <= 4 * tolerance))
            yield min(tolerance, limit), is_clear, _merged(mesh, a[near], b[near])
        tolerance *= 2.5


def edges_of_lenient(mesh: Mesh) -> Edges | None:
    """Edge table, or None for a mesh that has none."""
    try:
        return edges_of(mesh)
    except NotABelt:
        return None


def _merged(mesh: Mesh, a: np.ndarray, b: np.ndarray) -> Mesh:
    label = components(len(mesh.points), a, b)
    used, first = np.unique(label, return_index=True)
    assert len(used) == label.max() + 1
    return Mesh(mesh.points[first], label[mesh.facets].astype(np.int64), mesh.order)


def _closed(grid: Grid, wishes: Wishes, warnings: list[str]) -> Grid:
    """An open grid whose two ends lie upon each other is an endless belt with an unwelded seam.

    Only the ends of the longer direction are looked at: the long edges of a pipe belt may touch and must not be
    joined. A stated `endless` admits the other direction too, a stated `open` none.
    """
    if grid.kind != "open" or wishes.kind == "open" or wishes.weld == 0:
        return grid
    points = grid.points if extent(grid.points, 0) >= extent(grid.points, 1) else grid.points.swapaxes(0, 1)
    for candidate in (points, points.swapaxes(0, 1)) if wishes.kind == "endless" else (points,):
        for kind, last in (("endless", candidate[-1]), ("moebius", candidate[-1, ::-1])):
            apart = np.linalg.norm(last - candidate[0], axis=1).max()
            if len(candidate) > 3 and apart <= 0.25 * _median_edge(candidate):
                warnings.append(
                    f"the seam of the belt was closed: its ends are {apart:.3g} apart (file units)"
                )
                return Grid(candidate[:-1], kind)
    return grid


def extent(points: np.ndarray, axis: int) -> float:
    """Mean length of the grid's lines along one of its two axes."""
    steps = np.linalg.norm(np.diff(points, axis=axis), axis=2)
    return float(steps.sum(axis=axis).mean())


def _median_edge(points: np.ndarray) -> float:
    return float(
        np.median(np.concatenate([np.linalg.norm(np.diff(points, axis=k), axis=2).ravel() for k in (0, 1)]))
    )


def _asserted(grid: Grid, wishes: Wishes) -> Grid:
    if wishes.kind is None or grid.is_ring == (wishes.kind == "endless"):
        return grid
    found = f"the mesh is an {'endless' if grid.is_ring else 'open'} belt, --{wishes.kind} was stated"
    remedy = "a pipe belt whose two long edges share nodes reads as a ring across: part the edges in the mesh"
    if not grid.is_ring:
        remedy = "join the two ends of the mesh, or leave out --endless"
    raise NotABelt(grid.kind, found, remedy, grid.points[0, 0])
