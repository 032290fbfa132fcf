"""The linear spring-dashpot model against its closed form."""

import math

import numpy as np
import pytest
from scenes import SOFT, add_spheres

from beltsim import inp
from beltsim.engine import advance_by, begin_stage, state_of
from beltsim.lists import overlaps_of
from beltsim.run import prepare
from beltsim.scene import build

STIFFNESS = 1e5  # N/m
RADIUS = 0.01  # m
SPEED = 1.0  # m/s, of each


def collided(restitution: float, share: int):
    """Two equal spheres that have met head on, with `share` steps in the undamped contact; state and step."""
    deck = inp.Deck()
    deck.add("FORMAT", name="BELTSIM", version=1)
    deck.add("MATERIAL", name="stuff", **SOFT)
    deck.add("CONTACT MODEL", type="LINEAR")
    deck.add(
        "CONTACT PROPERTY",
        material_a="*",
        material_b="*",
        friction=0.0,
        restitution=restitution,
        normal_stiffness=STIFFNESS,
        tangential_stiffness=0.5 * STIFFNESS,
    )
    mass = SOFT["density"] * 4.0 / 3.0 * math.pi * RADIUS**3
    step = math.pi * math.sqrt(0.5 * mass / STIFFNESS) / share
    deck.add("STEP", duration=1.0, time_step=step)
    places = [[0, 0, 0], [2 * RADIUS, 0, 0]]
    add_spheres(deck, places, radius=RADIUS, velocity=[[SPEED, 0, 0], [-SPEED, 0, 0]])
    scene = build(inp.read_text(inp.dumps(deck)))
    state = state_of(scene)
    begin_stage(state, prepare(state, scene.steps[0], 0.0, lambda _: None, False))
    return state, step, mass


@pytest.mark.parametrize("restitution", [0.1, 0.5, 0.9])
def test_restitution_comes_out_as_given(restitution):
    """First order in the step, since the damping sees velocities of the half step: error below 2 / share."""
    for share in (200, 800):
        state, _, _ = collided(restitution, share)
        advance_by(state, 3 * share)
        speed = -state.scene.population.particles.velocity[0, 0]
        assert abs(speed / SPEED - restitution) < 2.0 / share


def test_largest_overlap_is_speed_over_frequency():
    share = 400
    state, _, mass = collided(1.0, share)
    advance_by(state, share // 2)
    overlap = overlaps_of(state.lists.spheres, state.scene.population.particles, state.scene.shapes)[0]
    # Second order in the step: (pi / share)^2 / 24 relative.
    assert overlap == pytest.approx(2 * SPEED * math.sqrt(0.5 * mass / STIFFNESS), rel=(np.pi / share) ** 2)
