"""Stretches of arrays: sorted with their partners, searched, counted and given room."""

import numpy as np
import pytest

from beltsim.solver.jit import kernel, maker
from beltsim.solver.stretches import first_from, place_of, sort_stretch, starts_of, with_room


@kernel
def sorted_stretch(value, partner, begin, end):
    sort_stretch(value, partner, begin, end)


@maker
def grown(values, wanted):
    return with_room(values, wanted)


@pytest.mark.parametrize("length", [0, 1, 2, 9, 10, 500])
def test_a_stretch_is_sorted_with_its_partners_and_nothing_beside_it_moves(length, rng):
    value, partner = rng.integers(50, size=length + 20).astype(float), np.arange(length + 20)
    before = value.copy()
    sorted_stretch(value, partner, 7, 7 + length)
    assert np.array_equal(value[7 : 7 + length], np.sort(before[7 : 7 + length]))
    assert np.array_equal(before[partner], value)
    beside = np.r_[0:7, 7 + length : length + 20]
    assert np.array_equal(partner[beside], beside)
    assert np.array_equal(np.sort(partner), np.arange(length + 20))


def test_places_in_a_stretch_are_those_of_a_plain_search(rng):
    values = np.sort(rng.integers(0, 40, 30))
    values[:5], values[25:] = 99, -99  # what lies outside does not count
    inside = values[5:25]
    for wanted in range(-1, 42):
        assert first_from(values, 5, 25, wanted) == 5 + np.searchsorted(inside, wanted)
        place = place_of(values, wanted, 5, 25)
        assert (place == -1) == (wanted not in inside)
        assert place == -1 or (5 <= place < 25 and values[place] == wanted)
    assert place_of(values, 99, 5, 5) == -1


def test_rows_begin_where_the_counts_of_the_rows_before_end(rng):
    row = rng.integers(8, size=40)
    assert np.array_equal(starts_of(row, 9), np.concatenate([[0], np.cumsum(np.bincount(row, minlength=9))]))


def test_room_is_made_only_where_it_lacks_and_keeps_the_values():
    values = np.arange(4, dtype=np.int32)
    assert grown(values, 4).size == 4
    larger = grown(values, 5)
    assert larger.size >= 5
    assert larger.dtype == np.int32
    assert np.array_equal(larger[:4], values)


@pytest.fixture
def rng():
    return np.random.default_rng(5)
