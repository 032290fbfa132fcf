"""A run that cannot go on stops, and says which particle or bond, when and why."""

import numpy as np
import pytest
from scenes import add_spheres, case

from beltsim import inp
from beltsim.console import ExitCode
from beltsim.engine import BlowUp, advance_by, begin_stage, state_of
from beltsim.run import prepare
from beltsim.scene import build

UPRIGHT = [1.0, 0.0, 0.0, 0.0]


def started(deck: inp.Deck):
    """State at the beginning of the deck's step."""
    scene = build(inp.read_text(inp.dumps(deck)))
    state = state_of(scene)
    begin_stage(state, prepare(state, scene.steps[0], 0.0, lambda _: None, True))
    return state


def pair(**bond) -> inp.Deck:
    """Two bonded spheres, the second fixed."""
    deck = case(time_step=1e-5)
    first = add_spheres(deck, [[0.0, 0.0, 0.0]], radius=0.01, name="free", spin=[[0.0, 400.0, 0.0]])
    second = add_spheres(deck, [[0.03, 0.0, 0.0]], radius=0.01, name="held", fixed="YES")
    deck.add("BOND TYPE", name="t", radius=0.002, youngs_modulus=1e6, poisson_ratio=0.3, **bond)
    rows = {
        "particles": [[first[0], second[0]]],
        "position_1": [[0.0, 0.0, 0.0]],
        "orientation_1": [UPRIGHT],
        "position_2": [[0.03, 0.0, 0.0]],
        "orientation_2": [UPRIGHT],
    }
    deck.add("BOND", type="t", rows=rows)
    return deck


def test_a_bond_that_is_wound_up_stops_the_run():
    """400 rad/s turn the free sphere by 180 degrees in 8 ms, whatever the soft bond does."""
    state = started(pair())
    with pytest.raises(BlowUp, match=r"bond of particles 1 and 2 is turned by 17[78]\.\d degrees") as stop:
        advance_by(state, 2000)
    assert stop.value.exit_code == ExitCode.BLOW_UP
    assert 0.005 < state.time < 0.012


def test_a_broken_bond_may_turn_as_it_likes():
    state = started(pair(tensile_strength=1e3))
    advance_by(state, 2000)
    assert not state.scene.bonds.intact[0]


def test_a_particle_that_moves_too_far_in_a_step_is_named():
    deck = case(time_step=1e-3)
    add_spheres(deck, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], radius=0.01, velocity=[[0, 0, 0], [0, 1e4, 0]])
    with pytest.raises(BlowUp, match=r"particle 2 \(ball\) at .* moves 10 m per step"):
        started(deck)


def test_a_position_that_is_no_number_is_found_at_once():
    deck = case(time_step=1e-4)
    add_spheres(deck, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], radius=0.01)
    state = started(deck)
    state.scene.population.particles.velocity[0, 1] = np.nan
    with pytest.raises(BlowUp, match="particle 2"):
        advance_by(state, 1)


def test_a_held_sphere_in_a_plane_without_a_contact_property_is_left_alone():
    """Held things never touch, so the pair needs no property; the law of the pair is all zeros, and so is its force."""
    deck = inp.Deck()
    deck.add("FORMAT", name="BELTSIM", version=1)
    for name in "ab":
        deck.add("MATERIAL", name=name, density=1000.0, youngs_modulus=1e6, poisson_ratio=0.3)
    add_spheres(deck, [[0.0, 0.0, 0.005]], radius=0.01, material="a", fixed="YES")
    rows = {"position": [[0.0, 0.0, 0.0]], "orientation": [UPRIGHT]}
    deck.add("PART", name="floor", shape="PLANE", material="b", rows=rows)
    deck.add("STEP", duration=1.0, time_step=1e-4)
    state = started(deck)
    advance_by(state, 3)
    particles = state.scene.population.particles
    assert np.array_equal(particles.position[:, 0], [0.0, 0.0, 0.005])
    assert np.all(particles.force == 0.0)
