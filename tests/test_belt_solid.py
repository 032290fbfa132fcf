"""The mid-surface of a solid endless belt: evenly divided, in the middle, half a cell inside the edges."""

import belts
import numpy as np
import pytest
from scipy.spatial import cKDTree

from beltconverter.convert import Settings, convert
from beltconverter.mesh import welded
from beltconverter.refusals import NotABelt
from beltconverter.solid import mid_surfaces, solids_of

CELL = 0.06
SHAPES = {
    "two pulleys": {},
    "troughed": {"trough": 0.6},
    "pipe": {"pipe": 1.9 * np.pi},
    "turnover": {"turnover": True},
}
PLAIN = {"radius": 0.4, "straight": 4.0, "width": 0.8}


def solid_mesh(made, thickness):
    corners = belts.solid_of(made, thickness)
    rng = np.random.default_rng(1)
    return welded(corners[rng.permutation(len(corners))].reshape(-1, 3))


def mid_surface(made, thickness=0.012, half_edges=False):
    solids = solids_of(solid_mesh(made, thickness), [])
    (grid,) = mid_surfaces(solids, CELL, half_edges=half_edges)
    return grid, solids[0]


@pytest.mark.parametrize("name", SHAPES)
def test_the_grid_lies_in_the_middle_of_the_solid_with_cells_of_the_wanted_size(name):
    rows = 300
    made = belts.racetrack(rows, 21, **PLAIN, **SHAPES[name])
    grid, solid = mid_surface(made)
    length = 2 * PLAIN["straight"] + 2 * np.pi * PLAIN["radius"]
    assert grid.points.shape[:2] == (round(length / CELL), round(PLAIN["width"] / CELL))
    # CAD facets are chords: nodes lie up to s^2/8R inside the true surface; the width of the section is kept.
    chord = (length / rows) ** 2 / (8 * PLAIN["radius"])
    fine = belts.racetrack(2000, 161, **PLAIN, **SHAPES[name]).points
    spacing = np.hypot(length / 2000, PLAIN["width"] / 160) / 2 * 1.1
    gap = cKDTree(fine.reshape(-1, 3)).query(grid.points.reshape(-1, 3))[0]
    assert gap.max() < spacing + 2 * chord
    across = np.linalg.norm(np.diff(grid.points, axis=1), axis=2)
    assert across.mean() == pytest.approx(PLAIN["width"] / round(PLAIN["width"] / CELL), rel=0.01)
    assert solid.thickness == pytest.approx(0.012, rel=0.01)


def test_outer_nodes_lie_half_a_cell_inside_the_edge_or_on_it():
    made = belts.racetrack(200, 11, **PLAIN)
    inside, on_edge = mid_surface(made)[0].points, mid_surface(made, half_edges=True)[0].points
    cell = PLAIN["width"] / 13
    assert np.abs(inside[..., 1]).max() == pytest.approx(PLAIN["width"] / 2 - cell / 2, rel=1e-9)
    assert np.abs(on_edge[..., 1]).max() == pytest.approx(PLAIN["width"] / 2, rel=1e-9)
    assert on_edge.shape[1] == inside.shape[1] + 1


def test_a_solid_becomes_a_belt_of_its_own_thickness():
    data = belts.binary_stl(1000 * belts.solid_of(belts.racetrack(120, 9, **PLAIN), 0.015))
    conversion = convert(data, "solid.stl", Settings(cell=0.08))
    (kind,) = conversion.deck.blocks("PARTICLE TYPE")
    assert kind["SIZE Z"] == pytest.approx(0.015, rel=0.01)
    assert conversion.reports[0]["kind"] == "endless"
    assert conversion.reports[0]["width"] == pytest.approx(PLAIN["width"], rel=1e-6)
    assert "took mm" in conversion.warnings[0]


@pytest.mark.parametrize("facets", [6, 8])
def test_rounded_edges_are_told_with_a_warning(facets):
    made = belts.racetrack(200, 11, **PLAIN)
    warnings = []
    (solid,) = solids_of(welded(belts.solid_of(made, 0.012, rounding=facets).reshape(-1, 3)), warnings)
    (grid,) = mid_surfaces([solid], CELL, half_edges=True)
    # The sides reach into the rounding by less than its radius of 6 mm.
    assert np.ptp(grid.points[..., 1]) == pytest.approx(PLAIN["width"] + 0.006, abs=0.006)
    assert "rounded" in warnings[0]


def test_two_solids_become_two_belts():
    one = belts.solid_of(belts.racetrack(120, 9, **PLAIN), 0.01)
    two = belts.solid_of(belts.racetrack(80, 7, radius=0.3, straight=2.0, width=0.6), 0.01) + np.array(
        [0, 0, 2.0]
    )
    solids = solids_of(welded(np.concatenate([one, two]).reshape(-1, 3)), [])
    assert len(mid_surfaces(solids, CELL, half_edges=False)) == 2


def refused(corners):
    with pytest.raises(NotABelt) as caught:
        solids_of(welded(np.asarray(corners).reshape(-1, 3)), [])
    return str(caught.value)


def test_solids_that_are_no_endless_belts_are_refused_by_name():
    import trimesh

    assert "open length" in refused(trimesh.creation.box((2.0, 0.5, 0.01)).triangles)
    assert "no two sides of like size" in refused(trimesh.creation.icosphere().triangles)
    assert "not closed" in refused(belts.corners_of(belts.racetrack(60, 5)))
