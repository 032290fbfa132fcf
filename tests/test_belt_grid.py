"""Rows and columns come back from triangles exactly, whatever the diagonals, the order and the winding."""

import belts
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beltconverter.recover import Wishes, recover
from beltconverter.refusals import NotABelt
from beltconverter.stl import read_stl

# Nine digits of coordinates up to 4 m leave 4 nm; nodes are tens of millimetres apart.
ROUNDING = 1e-8
DEGREE = np.pi / 180

MADE = {
    "flat": belts.flat(12, 5),
    "flat, two columns": belts.flat(9, 2),
    "single cell": belts.flat(2, 2),
    "square": belts.flat(6, 6),
    "skew 40, 1:1": belts.flat(14, 6, skew=40 * DEGREE),
    "skew 40, 10:1": belts.flat(14, 6, pitch=0.5, skew=40 * DEGREE),
    "skew 40, 1:10": belts.flat(14, 6, width=0.5, skew=40 * DEGREE),
    "two pulleys": belts.racetrack(60, 8),
    "three rows round": belts.racetrack(3, 4),
    "troughed": belts.racetrack(80, 9, trough=35 * DEGREE),
    "pipe": belts.racetrack(90, 12, pipe=1.9 * np.pi),
    "turnover": belts.racetrack(90, 7, turnover=True),
    "endless, skew 40": belts.racetrack(60, 8, skew=40 * DEGREE),
    "endless, chevron 40": belts.racetrack(60, 9, skew=40 * DEGREE, chevron=True),
    "wider than long": belts.racetrack(12, 30, straight=0.1, radius=0.1, width=2.0),
    "graded 10:1": belts.strip(np.cumsum(np.geomspace(0.01, 0.1, 60)), 6, straight=2.0),
    "moebius": belts.moebius(40, 5),
    "moebius, two columns": belts.moebius(16, 2),
}


def recovered(data: bytes, wishes=None):
    warnings = []
    return recover(read_stl(data), wishes or Wishes(), warnings), warnings


@pytest.mark.parametrize("diagonals", ["uniform", "other", "alternating", "random"])
@pytest.mark.parametrize("name", MADE)
def test_every_class_of_belt_comes_back_from_its_file(name, diagonals):
    made = MADE[name]
    corners = belts.corners_of(made, belts.facets_of(made, diagonals))
    (grid,), warnings = recovered(belts.ascii_stl(corners))
    assert belts.is_same_grid(grid.points, grid.kind, made, ROUNDING)
    assert warnings == []


@pytest.mark.parametrize("name", MADE)
def test_shuffled_facets_with_mixed_winding_give_the_same_grid(name):
    made = MADE[name]
    rng = np.random.default_rng(3)
    diagonals = (
        "random" if len(made.points) > 3 else "alternating"
    )  # three random ones may happen to run alike
    corners = belts.corners_of(made, belts.spoiled(belts.facets_of(made, diagonals, rng), rng))
    (grid,), warnings = recovered(belts.ascii_stl(corners))
    assert belts.is_same_grid(grid.points, grid.kind, made, ROUNDING)
    assert warnings == []


def test_binary_and_ascii_files_hold_the_same_belt():
    made = MADE["troughed"]
    (grid,), _ = recovered(belts.binary_stl(belts.corners_of(made)))
    assert belts.is_same_grid(
        grid.points, grid.kind, made, 4 * 2.0**-24
    )  # single precision of numbers below 4


@st.composite
def made_belts(draw):
    rows, columns = draw(st.integers(2, 12)), draw(st.integers(2, 7))
    skew = draw(st.floats(-40, 40)) * DEGREE
    kind = draw(st.sampled_from(["open", "endless", "moebius"]))
    if kind == "open":
        return belts.flat(rows, columns, draw(st.floats(0.02, 0.2)), draw(st.floats(0.02, 0.2)), skew)
    if kind == "moebius":
        return belts.moebius(rows + 3, columns)
    shape = draw(st.sampled_from([{}, {"trough": 0.6}, {"pipe": 5.5}, {"turnover": True}]))
    return belts.racetrack(rows + 3, columns, skew=skew, chevron=draw(st.booleans()), **shape)


@settings(deadline=None, max_examples=150)
@given(
    made=made_belts(),
    diagonals=st.sampled_from(["uniform", "other", "alternating", "random"]),
    shuffled=st.booleans(),
    digits=st.integers(5, 17),
    seed=st.integers(0, 2**32 - 1),
)
def test_a_recovered_grid_is_the_made_one_or_the_refusal_has_a_name(made, diagonals, shuffled, digits, seed):
    rng = np.random.default_rng(seed)
    facets = belts.spoiled(belts.facets_of(made, diagonals, rng), rng, shuffled=shuffled)
    try:
        (grid,), warnings = recovered(belts.ascii_stl(belts.corners_of(made, facets), digits))
    except NotABelt as refusal:
        pytest.fail(f"a whole belt was refused: {refusal}")
    if any("squarer cells" in warning for warning in warnings):
        return  # topology allows two grids and the file does not tell which: said, and settled by an option
    assert belts.is_same_grid(grid.points, grid.kind, made, 4 * 10.0 ** (1 - digits))
