"""One connected piece of mesh to one proven grid: open, endless or Moebius, or the reason why not."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .grid import REMESH, chain, columns_from, prove, rows_open, strips_of
from .mesh import Mesh
from .reading import rows_endless
from .refusals import NotABelt
from .topology import (
    Edges,
    angle_sums,
    border_loops,
    double_cover,
    edges_of,
    facets_at,
    is_pinched,
    split_fans,
)

MOST_CORNER_SETS = 64


class Grid(NamedTuple):
    """A proven belt grid.

    points : (R, C, 3), i along the belt and j across it.
    kind : "open"; "endless" (row R is row 0); "moebius" (row R is row 0 with the columns reversed).
    """

    points: np.ndarray
    kind: str

    @property
    def is_ring(self) -> bool:
        """Whether the last row is followed by the first."""
        return self.kind != "open"


def solve(mesh: Mesh, edges: Edges, cells: str, warnings: list[str]) -> Grid:
    """Proven grid of one piece; `NotABelt` names what stands against it."""
    try:
        return _solve_parted(mesh, edges, cells, warnings)
    except NotABelt as refusal:
        if refusal.cause != "solid" and _is_nearly_closed(mesh, edges):
            raise _solid(mesh, "a border as small as a few missing facets") from None
        raise


def _solve_parted(mesh: Mesh, edges: Edges, cells: str, warnings: list[str]) -> Grid:
    """Grid of the piece as it is, else with a node of its own for each fan of facets."""
    parted = None
    if not is_pinched(edges):
        try:
            return _solve(mesh, edges, cells, warnings)
        except NotABelt:
            parted = split_fans(mesh, edges)
            if len(parted.points) == len(mesh.points):
                raise
    parted = parted or split_fans(mesh, edges)
    return _solve(parted, edges_of(parted), cells, warnings)


def _is_nearly_closed(mesh: Mesh, edges: Edges) -> bool:
    """Whether the border is short: below a fifth of the root of the area.

    Twice the root is the least of an open belt; of an endless belt a fifth is that of one a hundred times as wide
    as long.
    """
    corners = mesh.points[mesh.facets]
    area = np.linalg.norm(np.cross(*np.diff(corners, axis=1).swapaxes(0, 1)), axis=1).sum() / 2
    border = np.linalg.norm(np.diff(mesh.points[edges.nodes[edges.border]], axis=1), axis=2).sum()
    return bool(border < 0.2 * math.sqrt(area))


def _solid(mesh: Mesh, what: str) -> NotABelt:
    return NotABelt(
        "solid",
        f"the surface has {what}: it is a solid, or a belt whose edges are welded together",
        "export the mid-surface, or let --cell 50mm make it from the solid",
        mesh.points.mean(axis=0),
    )


def _solve(mesh: Mesh, edges: Edges, cells: str, warnings: list[str]) -> Grid:
    loops = border_loops(edges)
    kind = _kind(mesh, edges, loops)
    if kind == "open":
        return Grid(mesh.points[_open_grid(mesh, edges, loops[0])], kind)
    if kind == "endless":
        grid = _endless_grid(mesh, edges, loops, cells, warnings)
        return Grid(mesh.points[_from_first_node(grid, grid)], kind)
    return Grid(mesh.points[_moebius_grid(mesh, edges, cells, warnings)], kind)


def _kind(mesh: Mesh, edges: Edges, loops: list[np.ndarray]) -> str:
    """Class of the surface by its Euler number and border loops, which tell all three kinds apart.

    An open belt with a hole has the Euler number and the loop count of an endless belt: only the unequal lengths
    of its loops give it away.
    """
    euler = len(mesh.points) - len(edges.nodes) + len(mesh.facets)
    sizes = [len(loop) for loop in loops]
    handles = (2 - len(loops) - euler) // 2
    if not loops or handles:
        raise _solid(mesh, f"{handles} handle{'s' if handles > 1 else ''}" if loops else "no border")
    if len(loops) == 1 and euler == 1:
        return "open"
    if len(loops) == 2 and euler == 0 and sizes[0] == sizes[1]:
        return "endless"
    if len(loops) == 1 and euler == 0:
        return "moebius"
    if len(loops) == 2 and euler == 0 and sizes[1] > sizes[0] // 2:
        raise _uneven_edges(mesh, sizes)
    if len(loops) > 1:
        raise _hole(mesh, loops)
    raise NotABelt("unstructured", f"a surface with Euler number {euler}", REMESH, mesh.points[loops[0][0]])


def _uneven_edges(mesh: Mesh, sizes: list[int]) -> NotABelt:
    found = f"the two edges of the belt have {sizes[0]} and {sizes[1]} nodes"
    if notch := _notch(mesh):
        return notch
    return NotABelt("transition", found + " (triangular transition or cut-out)", REMESH)


def _notch(mesh: Mesh) -> NotABelt | None:
    """A re-entrant corner: a border node with more than 225 degrees of surface around it."""
    edges = edges_of(mesh)
    border = np.unique(edges.nodes[edges.border])
    angle = angle_sums(mesh)[border]
    if angle.max() < 1.25 * math.pi:
        return None
    place = mesh.points[border[np.argmax(angle)]]
    return NotABelt(
        "notch", "the border has a re-entrant corner", "close the cut-out in the mid-surface", place
    )


def _hole(mesh: Mesh, loops: list[np.ndarray]) -> NotABelt:
    rim = mesh.points[loops[-1]]
    centred = rim - rim.mean(axis=0)
    area = np.linalg.norm(np.cross(centred, np.roll(centred, -1, axis=0)).sum(axis=0)) / 2
    longest = np.max(np.sum((rim - np.roll(rim, -1, axis=0)) ** 2, axis=1))
    if area < 1e-6 * longest:
        found = "edges that do not meet node to node (T-junction or crack)"
        return NotABelt("crack", found, "give neighbouring patches the same nodes", rim.mean(axis=0))
    found = f"{len(loops)} closed borders; the smallest has {len(rim)} nodes"
    return NotABelt(
        "hole", found, "close holes in the mid-surface: a belt has one or two borders", rim.mean(axis=0)
    )


def _endless_grid(
    mesh: Mesh, edges: Edges, loops: list[np.ndarray], cells: str, warnings: list[str]
) -> np.ndarray:
    line = loops[0]
    columns, rest = divmod(len(mesh.points), len(line))
    if rest or columns < 2:
        found = f"{len(mesh.points)} nodes do not make whole rows behind an edge of {len(line)}"
        raise _notch(mesh) or NotABelt("unstructured", found, REMESH)
    strips = strips_of(mesh, edges, columns_from(line, mesh, edges, columns))
    grid = chain(line, strips, rows_endless(mesh, edges, strips, cells, warnings), columns)
    prove(grid, mesh, endless=True)
    return grid


def _from_first_node(grid: np.ndarray, names: np.ndarray) -> np.ndarray:
    """The ring turned so that the node that the file names first is in row 0."""
    return np.roll(grid, -(np.argmin(names) // grid.shape[1]), axis=0)


def _moebius_grid(mesh: Mesh, edges: Edges, cells: str, warnings: list[str]) -> np.ndarray:
    """Grid of a one-sided belt: half of that of its two-sided cover, which is an endless belt."""
    cover, covered = double_cover(mesh, edges)
    cover_edges = edges_of(cover)
    grid = _endless_grid(cover, cover_edges, border_loops(cover_edges), cells, warnings)
    grid = covered[_from_first_node(grid, covered[grid])]
    rows = len(grid) // 2
    if len(grid) != 2 * rows or not np.array_equal(grid[rows:], grid[:rows, ::-1]):
        raise NotABelt("unstructured", "a one-sided surface without rows and columns", REMESH)
    return grid[:rows]


def _open_grid(mesh: Mesh, edges: Edges, loop: np.ndarray) -> np.ndarray:
    """Grid (R, C), R >= C, of a piece with one border: tries corner sets, likeliest first, until one is proven."""
    rows, columns = _sides(mesh, len(loop))
    first = None
    for start in _corner_starts(mesh, loop, rows, columns)[:MOST_CORNER_SETS]:
        line = np.roll(loop, -start)[:rows]
        try:
            strips = strips_of(mesh, edges, columns_from(line, mesh, edges, columns))
            grid = chain(line, strips, rows_open(strips), columns)
            prove(grid, mesh, endless=False)
            return grid
        except NotABelt as refusal:
            first = first or refusal
    raise _notch(mesh) or first or NotABelt("unstructured", "a border without four corners", REMESH)


def _sides(mesh: Mesh, border: int) -> tuple[int, int]:
    """Nodes along and across, R >= C: R C = nodes and 2 (R + C) - 4 = nodes on the border."""
    nodes, half = len(mesh.points), border // 2 + 2
    square = half * half - 4 * nodes
    root = math.isqrt(square) if square >= 0 else -1
    if border % 2 or root * root != square or (half - root) // 2 < 2 or (half - root) % 2:
        found = f"{nodes} nodes with {border} on the border are no rows and columns"
        odd = len(mesh.facets) % 2 or border % 2
        raise _notch(mesh) or NotABelt("transition" if odd else "unstructured", found, REMESH)
    return (half + root) // 2, (half - root) // 2


def _corner_starts(mesh: Mesh, loop: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """Places on the border where four corners in the right spacing may begin, sharpest corners first."""
    start = np.arange(len(loop) // 2)
    steps = np.array([0, rows - 1, rows + columns - 2, 2 * rows + columns - 3])
    corners = (start[:, None] + steps) % len(loop)
    around = facets_at(mesh)[loop]
    lone = np.count_nonzero(around == 1)
    fits = np.all(around[corners] <= 2, axis=1) & (np.count_nonzero(around[corners] == 1, axis=1) == lone)
    sharpness = -angle_sums(mesh)[loop][corners].sum(axis=1)
    order = np.argsort(-sharpness, kind="stable")
    return order[fits[order]]
