"""Near particles against all pairs: sizes of 1:100, huge coordinates, coincident points, nobody at all."""

import numpy as np
import pytest

from beltsim.solver.particle_pairs import ENOUGH_TO_SHARE, particle_pairs
from beltsim.solver.state import Shapes

SKIN = 0.002


def shapes_of(bounding, group=None, may_touch=((True,),)):
    n = bounding.size
    group = np.zeros(n, np.int32) if group is None else group.astype(np.int32)
    return Shapes(np.zeros((3, n)), bounding, bounding, np.zeros(n, np.int32), group, np.array(may_touch))


def nobody_apart(count):
    return np.zeros(count + 1, np.int64), np.zeros(0, np.int32)


def slots(chosen):
    return np.asarray(chosen, np.int32)


def near(position, bounding):
    """Whether each two particles (n, n) are closer than the skin, by trying all."""
    d = position[:, :, None] - position[:, None, :]
    return np.sum(d * d, axis=0) < (bounding[:, None] + bounding[None] + SKIN) ** 2


def wanted_among(position, bounding, owners):
    chosen = np.zeros(bounding.size, bool)
    chosen[owners] = True
    return np.argwhere(np.triu(near(position, bounding) & chosen & chosen[:, None], 1))


def wanted_with(position, bounding, owners, members):
    chosen = np.zeros((2, bounding.size), bool)
    chosen[0, owners], chosen[1, members] = True, True
    return np.argwhere(near(position, bounding) & chosen[0][:, None] & chosen[1])


def listed(position, shapes, owners, members=None, apart=None, team=None):
    """Pairs (p, 2) of the list, in its order."""
    apart = nobody_apart(shapes.bounding.size) if apart is None else apart
    start, second = particle_pairs(position, shapes, owners, members, SKIN, apart, team)
    assert start.size == shapes.bounding.size + 1
    return np.column_stack([np.repeat(np.arange(start.size - 1), np.diff(start)), second])


def sand_and_boulders(rng, count=1500):
    """Radii between 1 and 100 mm, mostly small, at random in a box that they fill densely."""
    bounding = 0.001 * (1.0 - rng.uniform(size=count) * (1.0 - 100.0**-1.5)) ** (-1.0 / 1.5)
    bounding[0], bounding[-1] = 0.1, 0.001
    side = (np.sum(4.0 * bounding**3)) ** (1.0 / 3.0)
    return rng.uniform(0.0, side, (3, count)), bounding


@pytest.mark.parametrize("offset", [0.0, -0.37, 1e6, -3e9])
def test_sizes_of_one_to_a_hundred_are_all_found_once_and_in_order(offset, rng):
    position, bounding = sand_and_boulders(rng)
    position += offset
    owners = slots(np.arange(bounding.size))
    found = listed(position, shapes_of(bounding), owners)
    assert np.array_equal(found, wanted_among(position, bounding, owners))
    assert len(found) > 500


def test_pairs_of_two_sets_of_one_to_a_hundred_are_all_found_once_and_in_order(rng):
    position, bounding = sand_and_boulders(rng)
    parted = rng.uniform(size=bounding.size) < 0.7
    for chosen in (parted, ~parted, bounding > 0.01, bounding < 0.01):
        owners, members = slots(np.flatnonzero(chosen)), slots(np.flatnonzero(~chosen))
        found = listed(position, shapes_of(bounding), owners, members)
        assert np.array_equal(found, wanted_with(position, bounding, owners, members))
        assert len(found) > 100


@pytest.mark.parametrize("team", [2, 3])
def test_threads_find_the_pairs_that_one_finds(team, rng):
    """Of so many that they share them out, sizes of 1:100 in several searches, and more than there is room for."""
    position, bounding = sand_and_boulders(rng, 2 * ENOUGH_TO_SHARE)
    everybody = slots(np.arange(bounding.size))
    crowded = np.full((3, ENOUGH_TO_SHARE), 0.25) + rng.uniform(0.0, 0.05, (3, ENOUGH_TO_SHARE))
    for place, radius in ((position, bounding), (crowded, np.full(ENOUGH_TO_SHARE, 0.005))):
        owners = everybody[: radius.size]
        alone = listed(place, shapes_of(radius), owners)
        assert len(alone) > radius.size
        assert np.array_equal(listed(place, shapes_of(radius), owners, team=team), alone)


def test_only_chosen_particles_are_listed(rng):
    position, bounding = sand_and_boulders(rng, 600)
    owners = slots(np.arange(0, 600, 3))
    found = listed(position, shapes_of(bounding), owners)
    assert np.array_equal(found, wanted_among(position, bounding, owners))
    assert len(found) > 50


def test_order_and_place_of_the_particles_do_not_change_who_is_near(rng):
    position, bounding = sand_and_boulders(rng)
    owners, shuffled = slots(np.arange(bounding.size)), rng.permutation(bounding.size)
    straight = listed(position, shapes_of(bounding), owners)
    turned = listed(np.ascontiguousarray(position[[2, 0, 1]]), shapes_of(bounding), owners)
    assert np.array_equal(straight, turned)
    mixed = listed(np.ascontiguousarray(position[:, shuffled]), shapes_of(bounding[shuffled]), owners)
    back = np.sort(shuffled[mixed], axis=1)
    assert np.array_equal(straight, back[np.lexsort(back.T[::-1])])


def test_points_that_coincide_are_near_each_other_and_more_than_there_is_room_for():
    count = 60
    owners = slots(np.arange(count))
    found = listed(np.full((3, count), 0.25), shapes_of(np.full(count, 0.01)), owners)
    assert np.array_equal(found, np.argwhere(np.triu(np.ones((count, count), bool), 1)))


def test_columns_far_apart_that_share_a_key_are_not_near():
    cell = 2.0 * 0.01 + SKIN
    far = cell * 2.0**32
    position = np.array([[0.5 * cell, 0.0, 0.0], [0.5 * cell + far, 0.0, 0.0], [0.5 * cell, far, 0.0]]).T
    position = np.ascontiguousarray(np.hstack([position, position + np.array([[0.0], [0.0], [0.015]])]))
    owners, bounding = slots(np.arange(6)), np.full(6, 0.01)
    found = listed(position, shapes_of(bounding), owners)
    assert np.array_equal(found, [[0, 3], [1, 4], [2, 5]])


@pytest.mark.parametrize("count", [0, 1, 5])
def test_nobody_is_near_nobody(count):
    position, shapes = np.zeros((3, count)), shapes_of(np.full(count, 0.01))
    none, everybody = slots([]), slots(np.arange(count))
    assert len(listed(position, shapes, none)) == 0
    assert len(listed(position, shapes, none, everybody)) == 0
    assert len(listed(position, shapes, everybody, none)) == 0
    assert len(listed(position, shapes, everybody)) == count * (count - 1) // 2


def test_pairs_kept_apart_and_groups_that_may_not_touch_are_left_out(rng):
    position, bounding = sand_and_boulders(rng)
    count = bounding.size
    group, may_touch = rng.integers(2, size=count), np.array([[True, False], [False, True]])
    apart = np.triu(rng.uniform(size=(count, count)) < 0.3, 1)
    apart |= apart.T
    rows = np.concatenate([[0], np.cumsum(apart.sum(axis=1))]), slots(np.nonzero(apart)[1])
    owners = slots(np.arange(count))
    found = listed(position, shapes_of(bounding, group, may_touch), owners, apart=rows)
    pairs = wanted_among(position, bounding, owners)
    allowed = may_touch[group[pairs[:, 0]], group[pairs[:, 1]]] & ~apart[pairs[:, 0], pairs[:, 1]]
    assert np.array_equal(found, pairs[allowed])
    assert 100 < len(found) < 0.6 * len(pairs)


@pytest.fixture
def rng():
    return np.random.default_rng(11)
