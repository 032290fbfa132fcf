"""A mesh file's surface to the proven grids of its belts: exact nodes first, tolerance only where that fails."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .mesh import Mesh
from .piece import Grid, solve
from .refusals import NotABelt
from .topology import cleaned, edges_of, facets_at, pieces, without_slivers
from .weld import welds


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
        grids = _with_notes(mesh, wishes, [], warnings)
    except NotABelt as refusal:
        grids = _without_slivers(mesh, wishes, warnings) or _welded(mesh, wishes, warnings)
        if not grids:
            raise refusal from None
    else:
        grids = _joined(mesh, grids, wishes, warnings)
    return [_asserted(_closed(grid, wishes, warnings), wishes) for grid in grids]


def _grids(mesh: Mesh, wishes: Wishes, notes: list[str]) -> list[Grid]:
    """Proven grids of a mesh as it is; what is to be said of them goes to `notes`."""
    parts = pieces(mesh, edges_of(mesh))
    _refuse_common_nodes(mesh, [part for part, _ in parts])
    return [solve(part, part_edges, wishes.cells, notes) for part, part_edges in parts]


def _with_notes(mesh: Mesh, wishes: Wishes, notes: list[str], warnings: list[str]) -> list[Grid]:
    """The same; its notes become warnings only if all pieces are proven."""
    grids = _grids(mesh, wishes, notes)
    warnings.extend(notes)
    return grids


def _refuse_common_nodes(mesh: Mesh, parts: list[Mesh]) -> None:
    """Two patches that share nodes but no edge are one belt whose lines of nodes do not match."""
    if sum(len(part.points) for part in parts) < np.count_nonzero(facets_at(mesh)) + 2:
        return
    points, uses = np.unique(np.concatenate([part.points for part in parts]), axis=0, return_counts=True)
    found = f"{np.count_nonzero(uses > 1)} nodes in which patches meet without a common edge"
    remedy = "give neighbouring patches the same nodes, or export each belt to its own file"
    raise NotABelt("crack", found, remedy, points[np.argmax(uses > 1)])


def _without_slivers(mesh: Mesh, wishes: Wishes, warnings: list[str]) -> list[Grid] | None:
    """Grids after leaving out facets without area, if there are any and that helps."""
    notes: list[str] = []
    plain = without_slivers(mesh, notes)
    try:
        return _with_notes(plain, wishes, notes, warnings) if notes else None
    except NotABelt:
        return None


def _welded(mesh: Mesh, wishes: Wishes, warnings: list[str]) -> list[Grid] | None:
    """Grids at the smallest weld that proves the fewest pieces; of equally few, a clear one is preferred."""
    best: tuple = (math.inf, False)
    grids, notes = None, []
    for weld in welds(mesh, wishes.weld, 0.25):
        found: list[str] = []
        try:
            trial = _grids(weld.mesh, wishes, found)
        except NotABelt:
            continue
        if (len(trial), not weld.is_clear) < best:
            best = (len(trial), not weld.is_clear)
            grids, notes = trial, [*found, weld.note]
        if best == (1, False):
            break
    warnings.extend(notes)
    return grids


def _joined(mesh: Mesh, grids: list[Grid], wishes: Wishes, warnings: list[str]) -> list[Grid]:
    """Several proven belts, or one whose patches differ in the last digits of their common border.

    Belts side by side keep their distance: unless a weld is asked for, only 1 % of a cell is taken for rounding,
    and a wider one that would do is mentioned.
    """
    notes: list[str] = []
    for weld in welds(mesh, wishes.weld, 0.25) if len(grids) > 1 else ():
        found: list[str] = []
        try:
            trial = _grids(weld.mesh, wishes, found)
        except NotABelt:
            continue
        if len(trial) >= len(grids):
            continue
        if wishes.weld is None and weld.share > 0.01:
            wide = f"--weld {weld.tolerance:.2g} (in the unit of the mesh)"
            notes.append(
                f"{len(grids)} belts; if they are patches of fewer, {wide} would join them to {len(trial)}"
            )
            break
        grids, notes = trial, [*found, f"patches joined: {weld.note}"]
    warnings.extend(notes)
    return grids


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
