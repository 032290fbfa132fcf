"""Orders of convergence of both integrators on smooth, undamped scenes."""

import numpy as np
import pytest
from scenes import SOFT

from beltsim import inp
from beltsim.engine import advance_by, begin_stage, state_of
from beltsim.run import prepare
from beltsim.scene import build
from beltsim.stepsize import TimeStepError

PITCH, NODES, DURATION = 0.05, 6, 0.02  # m, -, s
UPRIGHT = [1.0, 0.0, 0.0, 0.0]


def strip(integrator: str, time_step: float, **bond) -> inp.Deck:
    """A free strip that is bent, twisted and stretched by its initial velocities."""
    deck = inp.Deck()
    deck.add("FORMAT", name="BELTSIM", version=1)
    deck.add("MATERIAL", name="stuff", **SOFT)
    deck.add("CONTACT PROPERTY", material_a="*", material_b="*", friction=0.0, restitution=1.0)
    deck.add("CONTACT GROUP", name="belt", belt="belt")
    size = {f"size_{axis}": length for axis, length in zip("xyz", (0.058, 0.058, 0.01))}
    deck.add("PARTICLE TYPE", name="b", shape="ROUNDED BOX", edge_radius=0.004, material="stuff",
             contact_group="belt", **size)  # fmt: skip
    ids = np.arange(1, NODES + 1)
    place = np.c_[PITCH * np.arange(NODES), np.zeros(NODES), np.zeros(NODES)]
    deck.add("PARTICLE", type="b", rows={"id": ids, "position": place, "orientation": [UPRIGHT] * NODES})
    shape = np.sin(np.linspace(0.0, 3.0, NODES))[:, None]
    velocity, spin = shape * [0.3, 0.5, 1.0], shape[::-1] * [20.0, 30.0, 10.0]
    deck.add("INITIAL VELOCITY", rows={"id": ids, "velocity": velocity, "angular_velocity": spin})
    deck.add("BOND TYPE", name="t", section_width=0.05, section_thickness=0.01, youngs_modulus=1e6,
             poisson_ratio=0.3, **bond)  # fmt: skip
    n = NODES - 1
    deck.add("BOND", type="t", rows={
        "particles": np.c_[ids[:-1], ids[1:]],
        "position_1": np.zeros((n, 3)), "orientation_1": [UPRIGHT] * n,
        "position_2": [[PITCH, 0.0, 0.0]] * n, "orientation_2": [UPRIGHT] * n,
    })  # fmt: skip
    deck.add("STEP", duration=DURATION, time_step=time_step, integrator=integrator)
    return inp.read_text(inp.dumps(deck))


def started(deck: inp.Deck):
    """State at the beginning of the deck's step."""
    scene = build(deck)
    state = state_of(scene)
    begin_stage(state, prepare(state, scene.steps[0], 0.0, lambda _: None, False))
    return state


def end(integrator: str, steps: int) -> np.ndarray:
    """Positions and orientations after `DURATION` in so many steps."""
    state = started(strip(integrator, DURATION / steps))
    advance_by(state, steps)
    particles = state.scene.population.particles
    return np.concatenate([particles.position.ravel(), particles.orientation.ravel()])


@pytest.mark.parametrize(("integrator", "order", "slack"), [("VERLET", 2.0, 0.1), ("PEFRL", 4.0, 0.25)])
def test_order_of_convergence(integrator, order, slack):
    """The error falls by 2^order when the step is halved; the reference is PEFRL at an eighth of the finest step."""
    truth = end("PEFRL", 6400)
    errors = [np.max(np.abs(end(integrator, steps) - truth)) for steps in (400, 800)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=slack)


def test_pefrl_conserves_momentum():
    state = started(strip("PEFRL", DURATION / 400))
    particles = state.scene.population.particles
    before = (particles.velocity @ particles.mass).copy()
    advance_by(state, 400)
    after = particles.velocity @ particles.mass
    assert np.allclose(after, before, rtol=0.0, atol=1e-13 * np.abs(before).max() * 400)


def test_pefrl_is_refused_where_forces_depend_on_velocity():
    with pytest.raises(TimeStepError, match="DAMPING FACTOR"):
        started(strip("PEFRL", DURATION / 400, damping_factor=0.1))
