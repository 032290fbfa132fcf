"""A belt turns its rollers: sense and speed from its side and course, in any place and direction."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from beltsim import inp
from partconverter import rollers as roll
from partconverter.belts import BeltError, belt_of, joined
from partconverter.driving import driven
from partconverter.drums import Span
from partconverter.rollers import Roller

RADIUS, DISTANCE, HALF, PITCH, COLUMNS = 0.2, 2.0, 0.005, 0.025, 8
SPEED = 2.5


def loop_deck(turn: Rotation = None, shift=(0.0, 0.0, 0.0)) -> inp.Deck:
    """An endless belt round a tail pulley at the origin and a head pulley at x = 2 m, carrying strand to +x."""
    turn = turn or Rotation.identity()
    middle = RADIUS + HALF
    length = 2 * DISTANCE + 2 * pi * middle
    rows = round(length / PITCH)
    station = np.arange(rows) * length / rows
    point, angle = np.array([_on_loop(s, middle) for s in station], dtype=object).T
    across = (np.arange(COLUMNS) - (COLUMNS - 1) / 2) * PITCH
    position = np.array([p + np.array([0, y, 0]) for p in point for y in across], float)
    # Angle about y that turns the upper strand's frame to the local one.
    frames = Rotation.from_rotvec(np.outer(np.repeat(angle.astype(float), COLUMNS), [0, 1, 0]))
    ids = np.arange(rows * COLUMNS).reshape(rows, COLUMNS) + 1
    along = np.stack([ids, np.roll(ids, -1, axis=0)], axis=-1).reshape(-1, 2)
    beside = np.stack([ids[:, 1:], ids[:, :-1]], axis=-1).reshape(-1, 2)
    deck = inp.Deck()
    deck.add("FORMAT", name="BELTSIM", version=1)
    deck.add("MATERIAL", name="rubber", density=1200, youngs_modulus=5e6, poisson_ratio=0.45)
    sizes = {"size_x": 0.033, "size_y": 0.033, "size_z": 2 * HALF, "edge_radius": 0.004}
    deck.add("PARTICLE TYPE", name="belt", shape="ROUNDED BOX", material="rubber", **sizes)
    place = {
        "position": turn.apply(position) + shift,
        "orientation": (turn * frames).as_quat(scalar_first=True),
    }
    deck.add("PARTICLE", type="belt", rows={"id": ids.ravel(), **place})
    deck.add("BOND TYPE", name="bond", radius=0.005, youngs_modulus=1e8, poisson_ratio=0.3)
    for pairs, way in ((along, (PITCH, 0, 0)), (beside, (0, -PITCH, 0))):
        one, zero = np.tile([1.0, 0, 0, 0], (len(pairs), 1)), np.zeros((len(pairs), 3))
        states = {"position_1": zero, "orientation_1": one, "position_2": zero + way, "orientation_2": one}
        deck.add("BOND", type="bond", rows={"particles": pairs, **states})
    return deck


def _on_loop(s: float, radius: float):
    """Place on the loop's middle line and angle about y of its frame."""
    half_turn = pi * radius
    if s < DISTANCE:
        return np.array([s, 0, radius]), 0.0
    if s < DISTANCE + half_turn:
        a = (s - DISTANCE) / radius
        return np.array([DISTANCE + radius * np.sin(a), 0, radius * np.cos(a)]), a
    if s < 2 * DISTANCE + half_turn:
        return np.array([2 * DISTANCE + half_turn - s, 0, -radius]), pi
    a = (s - 2 * DISTANCE - half_turn) / radius
    return np.array([-radius * np.sin(a), 0, -radius * np.cos(a)]), pi + a


def cylinder(x, z, radius, axis=(0.0, 1.0, 0.0), name="") -> Roller:
    half = Span(-0.15, 0.15)
    return roll.sized([Roller((x, 0.0, z), axis, 2 * radius, half, half, half, name=name)])[0]


TOP = RADIUS + 2 * HALF  # outer side of the upper strand
CASES = {
    # name: (roller, angular velocity about +y for a belt of 1 m/s)
    "head pulley": (cylinder(DISTANCE, 0, RADIUS), 1 / (RADIUS + HALF)),
    "tail pulley": (cylinder(0, 0, RADIUS), 1 / (RADIUS + HALF)),
    "carrying idler": (cylinder(1.0, RADIUS - 0.05, 0.05), 1 / 0.05),
    "roller on top": (cylinder(1.2, TOP + 0.04, 0.04), -1 / 0.04),
    "return idler": (cylinder(0.7, -TOP - 0.05, 0.05), -1 / 0.05),
    "snub inside the return strand": (cylinder(1.3, -RADIUS + 0.03, 0.03), 1 / 0.03),
}
# Speeds are written with five digits.
FIVE_DIGITS = 1e-4


@pytest.fixture(scope="module")
def belt():
    return belt_of(loop_deck(), "belt.inp", SPEED)


@pytest.mark.parametrize("name", CASES)
def test_sense_and_speed_follow_from_side_and_course(belt, name):
    one, expected = CASES[name]
    (found,), warnings = driven([one], belt)
    assert found.speed == pytest.approx(SPEED * expected, rel=FIVE_DIGITS)
    assert not warnings


@pytest.mark.parametrize("name", CASES)
def test_an_axis_the_other_way_and_a_belt_backwards_turn_the_sign(belt, name):
    one, expected = CASES[name]
    flipped = replace(one, axis=(0.0, -1.0, 0.0))
    assert driven([flipped], belt)[0][0].speed == pytest.approx(-SPEED * expected, rel=FIVE_DIGITS)
    assert driven([one], belt_of(loop_deck(), "b", -SPEED))[0][0].speed == pytest.approx(
        -SPEED * expected, rel=FIVE_DIGITS
    )


def test_the_surface_moves_with_the_belt_where_they_touch(belt):
    one, _ = CASES["return idler"]
    (found,), _ = driven([one], belt)
    arm = np.array([0, 0, 0.05])
    assert np.cross(np.multiply(found.axis, found.speed), arm) == pytest.approx(
        [-SPEED, 0, 0], abs=1e-4 * SPEED
    )


def test_turning_and_moving_everything_changes_nothing(belt):
    turn, shift = Rotation.from_rotvec([0.4, -0.7, 1.1]), np.array([10.0, -20.0, 5.0])
    moved = belt_of(loop_deck(turn, shift), "belt.inp", SPEED)
    for one, expected in CASES.values():
        axis = turn.apply(one.axis)
        there = replace(one, centre=tuple(turn.apply(one.centre) + shift), axis=tuple(axis))
        assert driven([there], moved)[0][0].speed == pytest.approx(SPEED * expected, rel=FIVE_DIGITS)


def test_cylinders_that_no_belt_touches_are_named_with_their_gap(belt):
    low = replace(CASES["carrying idler"][0], name="low", centre=(1.0, 0.0, RADIUS - 0.05 - 0.008))
    far = replace(low, name="far", centre=(1.0, 0.0, 5.0))
    beside = replace(low, name="beside", centre=(1.0, 1.0, RADIUS - 0.05))
    found, (warning,) = driven([low, far, beside], belt)
    assert [one.speed for one in found] == [None, None, None]
    assert "no belt touches 3" in warning
    assert "low (8 mm apart)" in warning
    assert "far (out of reach)" in warning
    assert driven([low], belt, touch_gap=0.009)[0][0].speed == pytest.approx(50, rel=FIVE_DIGITS)


def test_cylinders_that_cut_into_the_belt_are_named_with_their_depth(belt):
    high = replace(CASES["carrying idler"][0], name="high", centre=(1.0, 0.0, RADIUS - 0.05 + 0.003))
    (found,), (warning,) = driven([high], belt)
    assert "cut into the belt: high (3 mm)" in warning
    assert found.speed == pytest.approx(50, rel=FIVE_DIGITS)


def test_a_disc_between_two_columns_is_driven_too(belt):
    disc = replace(CASES["carrying idler"][0], length=0.004)
    assert driven([disc], belt)[0][0].speed == pytest.approx(50, rel=FIVE_DIGITS)


def test_a_roller_along_the_belt_is_not_driven_by_it(belt):
    along = replace(CASES["carrying idler"][0], axis=(1.0, 0.0, 0.0))
    assert driven([along], belt)[0][0].speed is None


def test_rollers_are_ordered_along_the_belt(belt):
    found, _ = driven([one for one, _ in CASES.values()], belt)
    stations = dict(zip(CASES, (one.station for one in found)))
    order = sorted((name for name in CASES if name != "tail pulley"), key=lambda name: stations[name])
    assert order == [
        "carrying idler",
        "roller on top",
        "head pulley",
        "snub inside the return strand",
        "return idler",
    ]
    # The belt begins on the tail pulley's tangent point, so that contact runs over the seam.
    assert stations["tail pulley"] < PITCH
    assert stations["carrying idler"] == pytest.approx(1.0, abs=PITCH)
    # Arc to the head pulley's far point; chords of the rows' centres are shorter by less than 1e-3.
    assert stations["head pulley"] == pytest.approx(DISTANCE + pi * (RADIUS + HALF) / 2, abs=PITCH)


def test_two_belts_drive_what_they_touch_each_at_its_speed():
    far = loop_deck(shift=(0.0, 10.0, 0.0))
    both = joined([belt_of(loop_deck(), "a", SPEED), belt_of(far, "b", 2 * SPEED)])
    one, expected = CASES["carrying idler"]
    other = replace(one, centre=(1.0, 10.0, RADIUS - 0.05))
    found, warnings = driven([one, other], both)
    assert [r.speed for r in found] == pytest.approx(
        [SPEED * expected, 2 * SPEED * expected], rel=FIVE_DIGITS
    )
    assert found[1].station > found[0].station
    assert not warnings


def test_a_belt_that_moves_in_its_file_needs_no_speed():
    deck = loop_deck()
    with pytest.raises(BeltError, match="no \\*INITIAL VELOCITY of the belt"):
        belt_of(deck, "belt.inp")
    block = deck.blocks("PARTICLE")[0]
    along = Rotation.from_quat(block.rows["orientation"], scalar_first=True).apply([1, 0, 0])
    moving = {"id": block.rows["id"], "velocity": 3 * along, "angular_velocity": 0 * along}
    deck.add("INITIAL VELOCITY", rows=moving)
    one, expected = CASES["carrying idler"]
    assert driven([one], belt_of(deck, "belt.inp"))[0][0].speed == pytest.approx(
        3 * expected, rel=FIVE_DIGITS
    )


def test_a_deck_without_a_belt_is_refused():
    deck = inp.Deck()
    deck.add("FORMAT", name="BELTSIM", version=1)
    with pytest.raises(BeltError, match=r"parts\.inp: found no bonded particles"):
        belt_of(deck, "parts.inp")
