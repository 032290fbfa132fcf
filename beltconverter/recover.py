"""A mesh file's surface to the proven grids of its belts: exact nodes first, tolerance only where that fails."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .mesh import Mesh, merge_equal
from .piece import Grid, solve
from .refusals import NotABelt
from .topology import cleaned, edges_of, facets_at, pieces, without_slivers
from .weld import Weld, merged_nodes, welds


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
        found = Found(mesh, *_grids(mesh, wishes))
    except NotABelt as refusal:
        found = _without_slivers(mesh, wishes) or _welded(mesh, wishes)
        if not found:
            raise refusal from None
    else:
        found = _joined(found, wishes)
    found = _closed(found, wishes)
    warnings.extend(found.notes)
    return [_asserted(grid, wishes) for grid in found.grids]


class Found(NamedTuple):
    """A mesh as it was repaired, its proven grids, and what is to be said of them."""

    mesh: Mesh
    grids: list[Grid]
    notes: list[str]


def _grids(mesh: Mesh, wishes: Wishes) -> tuple[list[Grid], list[str]]:
    """Proven grids of a mesh as it is, and notes."""
    notes: list[str] = []
    parts = pieces(mesh, edges_of(mesh))
    _refuse_common_nodes(mesh, [part for part, _ in parts])
    return [solve(part, part_edges, wishes.cells, notes) for part, part_edges in parts], notes


def _refuse_common_nodes(mesh: Mesh, parts: list[Mesh]) -> None:
    """Two patches that share nodes but no edge are one belt whose lines of nodes do not match."""
    if sum(len(part.points) for part in parts) < np.count_nonzero(facets_at(mesh)) + 2:
        return
    points, uses = np.unique(np.concatenate([part.points for part in parts]), axis=0, return_counts=True)
    found = f"{np.count_nonzero(uses > 1)} nodes in which patches meet without a common edge"
    remedy = "give neighbouring patches the same nodes, or export each belt to its own file"
    raise NotABelt("crack", found, remedy, points[np.argmax(uses > 1)])


def _without_slivers(mesh: Mesh, wishes: Wishes) -> Found | None:
    """Grids after leaving out facets without area, if there are any and that helps."""
    left_out: list[str] = []
    plain = without_slivers(mesh, left_out)
    try:
        grids, notes = _grids(plain, wishes) if left_out else ([], [])
    except NotABelt:
        return None
    return Found(plain, grids, [*left_out, *notes]) if grids else None


def _trials(mesh: Mesh, wishes: Wishes) -> Iterator[tuple[Weld, Found]]:
    """The welds that prove all pieces, ever coarser."""
    for weld in welds(mesh, wishes.weld, 0.25):
        try:
            grids, notes = _grids(weld.mesh, wishes)
        except NotABelt:
            continue
        yield weld, Found(weld.mesh, grids, notes)


def _welded(mesh: Mesh, wishes: Wishes) -> Found | None:
    """Grids at the smallest weld that proves the fewest pieces.

    Of equally few, those without ends that lie upon each other are preferred (a ring of which one crack is left has
    such ends, wherever the crack runs), then clear welds.
    """
    best, best_rank = None, (math.inf, False, False)
    for weld, found in _trials(mesh, wishes):
        has_seam = any(_seam(grid, wishes) is not None for grid in found.grids)
        rank = (len(found.grids), has_seam, not weld.is_clear)
        if rank < best_rank:
            best, best_rank = found._replace(notes=[*found.notes, weld.note]), rank
        if rank == (1, False, False):
            break
    return best


def _joined(found: Found, wishes: Wishes) -> Found:
    """Several proven belts, or one whose patches differ in the last digits of their common border.

    Belts side by side keep their distance: unless a weld is asked for, only 1 % of a cell is taken for rounding,
    and a wider one that would do is mentioned.
    """
    best = found
    for weld, trial in _trials(found.mesh, wishes) if len(found.grids) > 1 else ():
        if len(trial.grids) >= len(best.grids):
            continue
        if wishes.weld is None and weld.share > 0.01:
            wide = (
                f"--weld {weld.tolerance:.2g} (in the unit of the mesh) would join them to {len(trial.grids)}"
            )
            best.notes.append(f"{len(best.grids)} belts; if they are patches of fewer, {wide}")
            break
        best = trial._replace(notes=[*trial.notes, f"patches joined: {weld.note}"])
    return best


def _closed(found: Found, wishes: Wishes) -> Found:
    """Open grids whose two ends lie upon each other made rings: their seams are welded and all is proven again."""
    seams = [seam for grid in found.grids if (seam := _seam(grid, wishes)) is not None]
    if not seams:
        return found
    last, first = (np.concatenate(side) for side in zip(*seams))
    gap = np.linalg.norm(last - first, axis=1).max()
    count = len(found.mesh.points)
    _, index = merge_equal(np.concatenate([found.mesh.points, last, first]))
    a, b = index[count:].reshape(2, -1)
    try:
        merged = merged_nodes(found.mesh, a, b)
        grids, notes = _grids(merged, wishes)
    except NotABelt:
        return found._replace(
            notes=[*found.notes, "ends of the belt lie upon each other and could not be joined"]
        )
    said = f"the seam of the belt was closed: its ends are {gap:.3g} apart (file units)"
    return Found(merged, grids, [*found.notes, *(note for note in notes if note not in found.notes), said])


def _seam(grid: Grid, wishes: Wishes) -> tuple[np.ndarray, np.ndarray] | None:
    """Nodes (C, 3) of the last row and those of the first on which they lie, if they do.

    Only the ends of the longer direction are looked at: the long edges of a pipe belt may touch and must not be
    joined. A stated `endless` admits the other direction too, a stated `open` none.
    """
    if grid.kind != "open" or wishes.kind == "open" or wishes.weld == 0:
        return None
    points = grid.points if extent(grid.points, 0) >= extent(grid.points, 1) else grid.points.swapaxes(0, 1)
    for candidate in (points, points.swapaxes(0, 1)) if wishes.kind == "endless" else (points,):
        for last in (candidate[-1], candidate[-1, ::-1]):
            apart = np.linalg.norm(last - candidate[0], axis=1).max()
            if len(candidate) > 3 and apart <= 0.25 * _median_edge(candidate):
                return last, candidate[0]
    return None


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
