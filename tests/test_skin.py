"""The skin of the near lists tunes itself: towards the least cost of a step, and without changing what is computed."""

import math
from typing import NamedTuple

import numpy as np
import scenes

from beltsim.lists import Lists
from beltsim.skin import BUILD, FIRST, NARROWEST, PACE, TEST, WIDEST, first_skin, tuned

RADIUS, COUNT = 0.01, 1000


class Listed(NamedTuple):
    """A list by its number of pairs."""

    first: np.ndarray


def lists_of(pairs: float) -> Lists:
    return Lists((Listed(np.zeros(round(pairs))),), None, None, None, None, None, None)


def cost(skin: float, crowding: float, drift: float) -> float:
    """Cost [ns] of a step: pairs within reach, and lists anew whenever something has drifted by half the skin."""
    pairs = crowding * (2.0 * RADIUS + skin) ** 3
    return TEST["spheres"] * pairs + BUILD * COUNT * drift / (0.5 * skin)


def settled(crowding: float, drift: float) -> float:
    """The skin that a long run ends with."""
    first = skin = first_skin(np.full(COUNT, RADIUS))
    for _ in range(100):
        pairs = crowding * (2.0 * RADIUS + skin) ** 3
        skin = tuned(skin, first, lists_of(pairs), COUNT, math.ceil(0.5 * skin / drift))
    return skin


def test_the_skin_goes_to_the_least_cost_of_a_step():
    """For slow and fast, thin and dense scenes: within a few per cent of the best skin that is allowed."""
    first = FIRST * RADIUS
    allowed = np.linspace(NARROWEST * first, WIDEST * first, 400)
    for crowding in (2.0e8, 1.0e9):
        for drift in (2.0e-6, 2.0e-5):
            least = min(cost(skin, crowding, drift) for skin in allowed)
            # Flat around the least: the skin goes in steps that count whole time steps.
            assert cost(settled(crowding, drift), crowding, drift) < 1.05 * least


def test_the_skin_changes_slowly_and_stays_near_the_first():
    first = first_skin(np.full(COUNT, RADIUS))
    assert tuned(first, first, lists_of(10), COUNT, 1) == first * PACE
    assert tuned(first, first, lists_of(10**6), COUNT, 10**6) == first / PACE
    assert settled(1.0e3, 1.0e-5) == WIDEST * first
    assert settled(1.0e10, 1.0e-9) == NARROWEST * first


def test_a_tuned_skin_does_not_change_the_motion():
    """A box of bouncing spheres with the skin tuned and held: the same but for the rounding of sums."""

    def places(hold: bool) -> np.ndarray:
        rng = np.random.default_rng(5)
        deck = scenes.case(time_step=2e-5, gravity=(0.0, 0.0, -9.81), restitution=0.6, friction=0.3)
        at = np.mgrid[0:4, 0:4, 0:4].reshape(3, -1).T * 0.022 + (0.0, 0.0, 0.012)
        scenes.add_spheres(deck, at, radius=RADIUS, velocity=rng.uniform(-1.0, 1.0, at.shape))
        scenes.add_plane(deck)
        state = scenes.start(deck)
        skins = set()
        for _ in range(10):
            scenes.advance(state, 50)
            skins.add(state.skin)
            if hold:
                state.skin = state.first_skin
        assert hold or len(skins) > 3
        return scenes.particles(state).position.copy()

    # 500 steps through some three impacts each, which multiply rounding by less than a thousand.
    np.testing.assert_allclose(places(hold=False), places(hold=True), atol=1e-12)
