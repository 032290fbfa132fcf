"""Files with cracks, patches and belts that touch: repaired where it is safe, never welded where it is not."""

import belts
import numpy as np
import pytest
from test_belt_grid import DEGREE, ROUNDING, recovered

from beltconverter.recover import Wishes, recover
from beltconverter.refusals import NotABelt
from beltconverter.stl import read_stl


def in_right_half(corners):
    return corners[..., 0].mean(axis=1) > 0.75


def test_a_crack_between_two_patches_is_closed():
    made = belts.racetrack(80, 9, trough=35 * DEGREE)
    corners = belts.corners_of(made)
    corners[in_right_half(corners)] += 3e-6
    (grid,), warnings = recovered(belts.ascii_stl(corners))
    assert belts.is_same_grid(grid.points, grid.kind, made, 4e-6)
    assert any("welded" in warning for warning in warnings)


def test_two_open_patches_become_one_belt():
    made = belts.flat(30, 5)
    corners = belts.corners_of(made)
    corners[in_right_half(corners)] += 1e-7
    (grid,), warnings = recovered(belts.ascii_stl(corners, digits=12))
    assert belts.is_same_grid(grid.points, grid.kind, made, 2e-7)
    assert any("patches joined" in warning for warning in warnings)


def test_a_ring_of_four_patches_becomes_one_belt():
    made = belts.racetrack(80, 6)
    corners = belts.corners_of(made)
    patch = np.digitize(corners[..., 0].mean(axis=1), [0.3, 0.8, 1.3])
    corners += 2e-7 * patch[:, None, None]
    (grid,), warnings = recovered(belts.ascii_stl(corners, digits=12))
    assert belts.is_same_grid(grid.points, grid.kind, made, 2e-6)
    assert any("welded" in warning for warning in warnings)


def test_patches_with_a_wide_gap_stay_apart_with_a_warning_and_are_joined_on_request():
    made = belts.flat(30, 5)
    corners = belts.corners_of(made)
    corners[in_right_half(corners)] += 3e-3
    grids, warnings = recovered(belts.ascii_stl(corners))
    assert len(grids) == 2
    assert any("patches of fewer, --weld" in warning for warning in warnings)
    (grid,), _ = recovered(belts.ascii_stl(corners), Wishes(weld=6e-3))
    assert belts.is_same_grid(grid.points, grid.kind, made, 4e-3)


def test_every_corner_rounded_on_its_own_still_gives_the_belt():
    made = belts.racetrack(60, 7)
    corners = belts.corners_of(made)
    corners += np.random.default_rng(1).uniform(-1e-6, 1e-6, corners.shape)
    (grid,), _ = recovered(belts.ascii_stl(corners, digits=12))
    assert belts.is_same_grid(grid.points, grid.kind, made, 2e-6)


def test_the_seam_of_an_endless_belt_is_closed():
    made = belts.racetrack(80, 9)
    seam = belts.Made(np.concatenate([made.points, made.points[:1] + 1e-4]), "open")
    (grid,), warnings = recovered(belts.ascii_stl(belts.corners_of(seam)))
    assert belts.is_same_grid(grid.points, grid.kind, made, 2e-4)
    assert any("seam" in warning for warning in warnings)


def test_the_seam_stays_open_if_an_open_belt_is_stated():
    made = belts.racetrack(80, 9)
    seam = belts.Made(np.concatenate([made.points, made.points[:1] + 1e-4]), "open")
    (grid,), _ = recovered(belts.ascii_stl(belts.corners_of(seam)), Wishes(kind="open"))
    assert belts.is_same_grid(grid.points, grid.kind, seam, ROUNDING)


def pipe(gap):
    """Straight pipe of open length whose long edges lie `gap` apart."""
    radius, angle = 0.1, np.linspace(0, 1, 13) * (2 * np.pi - gap / 0.1)
    x = np.arange(40) * 0.05
    points = np.stack(
        np.broadcast_arrays(x[:, None], radius * np.cos(angle), radius * np.sin(angle)), axis=-1
    )
    return belts.Made(points, "open")


@pytest.mark.parametrize("gap", [1e-3, 1e-5, 1e-7])
def test_long_edges_of_a_pipe_that_nearly_touch_are_not_welded(gap):
    made = pipe(gap)
    (grid,), warnings = recovered(belts.ascii_stl(belts.corners_of(made), digits=12))
    assert belts.is_same_grid(grid.points, grid.kind, made, 1e-11)
    assert warnings == []


def test_overlapping_edges_of_an_endless_pipe_are_not_welded():
    made = belts.racetrack(120, 16, pipe=2.1 * np.pi)
    (grid,), warnings = recovered(belts.ascii_stl(belts.corners_of(made)))
    assert belts.is_same_grid(grid.points, grid.kind, made, ROUNDING)
    assert warnings == []


def test_edges_of_an_endless_pipe_that_touch_within_a_cracked_mesh_are_not_welded():
    made = belts.racetrack(120, 16, pipe=2 * np.pi - 0.02)
    corners = belts.corners_of(made)
    corners[in_right_half(corners)] += 1e-6
    (grid,), _ = recovered(belts.ascii_stl(corners))
    assert belts.is_same_grid(grid.points, grid.kind, made, 2e-6)


def test_belts_that_touch_in_single_nodes_are_parted_there():
    made = belts.racetrack(60, 7)
    points = made.points.copy()
    points[10, 0] = points[10, 6] = points[10, [0, 6]].mean(axis=0)  # both edges reach the same point once
    touching = belts.Made(points, "endless")
    (grid,), warnings = recovered(belts.ascii_stl(belts.corners_of(touching)))
    assert belts.is_same_grid(grid.points, grid.kind, touching, ROUNDING)
    assert warnings == []


def test_a_sandwich_of_two_belts_gives_two_belts_in_file_order():
    lower, upper = belts.racetrack(60, 7), belts.racetrack(40, 5)
    upper = belts.Made(upper.points + np.array([0.1, 0.0, 0.812]), "endless")
    data = belts.ascii_stl(np.concatenate([belts.corners_of(lower), belts.corners_of(upper)]))
    grids, warnings = recovered(data)
    assert [grid.points.shape for grid in grids] == [(60, 7, 3), (40, 5, 3)]
    assert all(belts.is_same_grid(g.points, g.kind, m, ROUNDING) for g, m in zip(grids, (lower, upper)))
    assert warnings == []


def test_two_belts_in_two_solids_of_one_file_are_found():
    one, two = belts.flat(10, 4), belts.flat(8, 3)
    two = belts.Made(two.points + np.array([0, 0, 0.3]), "open")
    data = belts.ascii_stl(belts.corners_of(one)) + belts.ascii_stl(
        belts.corners_of(two), name="vertex facet 2"
    )
    grids, _ = recovered(data)
    assert [grid.points.shape for grid in grids] == [(10, 4, 3), (8, 3, 3)]


def test_duplicate_and_degenerate_facets_are_left_out_and_counted():
    made = belts.racetrack(60, 7)
    facets = belts.facets_of(made)
    extra = [facets[:3, ::-1], facets[5:7], facets[:4, [0, 0, 1]]]
    (grid,), warnings = recovered(belts.ascii_stl(belts.corners_of(made, np.concatenate([facets, *extra]))))
    assert belts.is_same_grid(grid.points, grid.kind, made, ROUNDING)
    assert warnings == ["4 degenerate facets left out", "5 duplicate facets left out"]


def test_a_facet_without_area_along_the_edge_is_left_out():
    made = belts.flat(10, 4)
    facets = np.concatenate([belts.facets_of(made), [[0, 4, 8]]])  # three nodes in line on the long edge
    (grid,), warnings = recovered(belts.ascii_stl(belts.corners_of(made, facets)))
    assert belts.is_same_grid(grid.points, grid.kind, made, ROUNDING)
    assert warnings == ["1 degenerate facet without area left out"]


def uniform_skew(shuffled):
    """Endless belt, cells 50 x 50 mm, rows at 40 degrees, all short diagonals: two grids fit its triangles."""
    rows = 60
    made = belts.racetrack(rows, 8, straight=(rows * 0.05 - 0.8 * np.pi) / 2, width=0.35, skew=40 * DEGREE)
    facets = belts.facets_of(made, "other")
    rng = np.random.default_rng(2)
    return made, belts.ascii_stl(belts.corners_of(made, belts.spoiled(facets, rng) if shuffled else facets))


def test_file_order_settles_a_belt_that_topology_leaves_open():
    made, data = uniform_skew(shuffled=False)
    (grid,), warnings = recovered(data)
    assert belts.is_same_grid(grid.points, grid.kind, made, ROUNDING)
    assert warnings == []


def test_shuffled_it_is_read_with_the_squarer_cells_and_a_warning_and_otherwise_by_option():
    made, data = uniform_skew(shuffled=True)
    (square,), warnings = recovered(data)
    (skew,), quiet = recovered(data, Wishes(cells="skew"))
    assert not belts.is_same_grid(square.points, square.kind, made, ROUNDING)
    assert any("--cells skew" in warning for warning in warnings)
    assert belts.is_same_grid(skew.points, skew.kind, made, ROUNDING)
    assert quiet == []


def test_weld_zero_takes_exact_nodes_only():
    corners = belts.corners_of(belts.racetrack(40, 5))
    corners[in_right_half(corners)] += 1e-6
    with pytest.raises(NotABelt):
        recover(read_stl(belts.ascii_stl(corners)), Wishes(weld=0.0), [])


def test_a_pipe_whose_long_edges_share_nodes_is_refused_if_an_open_belt_is_stated():
    made = pipe(0.0)
    corners = belts.corners_of(belts.Made(np.round(made.points, 6), "open"))
    with pytest.raises(NotABelt, match="--open was stated"):
        recover(read_stl(belts.ascii_stl(corners)), Wishes(kind="open"), [])
