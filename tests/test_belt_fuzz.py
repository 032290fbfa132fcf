"""Whatever is done to a mesh: what comes out is a grid of its own facets, or a refusal with a name."""

import belts
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from test_belt_grid import made_belts

from beltconverter.recover import Wishes, recover
from beltconverter.refusals import NotABelt
from beltconverter.stl import read_stl

KEY = 9  # digits of the coordinates by which nodes are told apart; the files have as many


def keys(points):
    """Points as text: equal where the file's digits are."""
    return np.array(
        [" ".join(f"{x + 0.0:.{KEY}g}" for x in point) for point in points.reshape(-1, 3).tolist()]
    )


def cells_of(grid):
    """Sets of the four corner keys of each cell."""
    name = keys(grid.points).reshape(grid.points.shape[:2])
    after = {"open": name[:0], "endless": name[:1], "moebius": name[:1, ::-1]}[grid.kind]
    name = np.concatenate([name, after])
    return [
        frozenset(cell)
        for cell in np.stack([name[:-1, :-1], name[1:, :-1], name[1:, 1:], name[:-1, 1:]], -1).reshape(-1, 4)
    ]


def is_made_of(grids, corners):
    """Each cell of the grids is filled by two facets of the file, and none is left over.

    Facets without area may be left out, with a warning, or belong to a cell of which three nodes lie in line.
    """
    sides = corners - np.roll(corners, 1, axis=1)
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    has_area = area > 1e-7 * np.sum(sides**2, axis=2).max(axis=1)
    return any(are_all_in_cells(grids, chosen) for chosen in (corners, corners[has_area]))


def are_all_in_cells(grids, corners):
    """Slow and obvious, by sets."""
    facets = {frozenset(facet) for facet in keys(corners).reshape(-1, 3).tolist()}
    facets = {facet for facet in facets if len(facet) == 3}
    for cell in [cell for grid in grids for cell in cells_of(grid)]:
        inside = [facet for facet in facets if facet <= cell]
        if len(cell) != 4 or len(inside) != 2 or inside[0] | inside[1] != cell:
            return False
        facets -= set(inside)
    return not facets


def damaged(facets, count, how, rng):
    """Facets of a mesh of which some were deleted, doubled, given another node, or to which loose ones were added."""
    facets = facets.copy()
    chosen = rng.choice(len(facets), min(3, len(facets) - 1), replace=False)
    if how == "deleted":
        return np.delete(facets, chosen, axis=0)
    if how == "doubled":
        return np.concatenate([facets, facets[chosen][:, ::-1]])
    if how == "another node":
        facets[chosen[0], rng.integers(3)] = rng.integers(count)
    if how == "added":
        return np.concatenate([facets, rng.integers(0, count, (1, 3))])
    if how == "two nodes in one":
        facets[facets == rng.integers(count)] = rng.integers(count)
    return facets


def grids_or_none(mesh, wishes):
    """Grids and warnings, or None for a refusal that has a name and a remedy."""
    warnings = []
    try:
        return recover(mesh, wishes, warnings), warnings
    except NotABelt as refusal:
        if not (refusal.cause and refusal.remedy):
            raise AssertionError("a refusal without a name") from refusal
        return None, warnings


EXACT = Wishes(weld=0.0)


@settings(deadline=None, max_examples=200)
@given(
    made=made_belts(),
    how=st.sampled_from(["deleted", "doubled", "another node", "added", "two nodes in one"]),
    seed=st.integers(0, 2**32 - 1),
)
def test_a_damaged_mesh_gives_a_grid_of_its_facets_or_a_refusal(made, how, seed):
    rng = np.random.default_rng(seed)
    points = made.points.reshape(-1, 3)
    facets = damaged(belts.facets_of(made, "random", rng), len(points), how, rng)
    corners = points[belts.spoiled(facets, rng)]
    grids, _ = grids_or_none(read_stl(belts.ascii_stl(corners, digits=KEY)), EXACT)
    assert grids is None or is_made_of(grids, corners)


@settings(deadline=None, max_examples=100)
@given(made=made_belts(), digits=st.integers(2, 4), seed=st.integers(0, 2**32 - 1))
def test_coarse_rounding_gives_a_grid_of_the_rounded_facets_or_a_refusal(made, digits, seed):
    rng = np.random.default_rng(seed)
    facets = belts.spoiled(belts.facets_of(made, "random", rng), rng)
    mesh = read_stl(belts.ascii_stl(belts.corners_of(made, facets), digits))
    grids, _ = grids_or_none(mesh, EXACT)
    assert grids is None or is_made_of(grids, mesh.points[mesh.facets])


@settings(deadline=None, max_examples=100)
@given(made=made_belts(), jitter=st.floats(1e-9, 1e-4), seed=st.integers(0, 2**32 - 1))
def test_every_corner_off_by_itself_gives_the_belt_or_a_refusal(made, jitter, seed):
    rng = np.random.default_rng(seed)
    corners = belts.corners_of(made, belts.facets_of(made, "random", rng))
    corners = corners + rng.uniform(-jitter, jitter, corners.shape)
    grids, warnings = grids_or_none(read_stl(belts.binary_stl(corners)), Wishes())
    if grids is None or any("squarer" in warning for warning in warnings):
        return
    (grid,) = grids
    assert belts.is_same_grid(grid.points, grid.kind, made, 3 * jitter + 4 * 2.0**-24)
