"""The energy book: every joule is somewhere, or something took it."""

import numpy as np
import pytest
import scenes
from test_box_belts import PITCH, THICKNESS, add_belt

from beltsim import energy, engine, inp, trajectory
from beltsim.checkpoint import put_back, take
from beltsim.engine import begin_stage, state_of
from beltsim.progress import sentence
from beltsim.run import prepare, run
from beltsim.scene import build
from beltsim.stepsize import TimeStepError
from beltsim.verify.strips import Strip, add_strip, case_deck

G = 9.81
HELD = 1e12  # Pa, never reached: all belts here share the compiled steps of those that break


def start(deck):
    """The state of a deck at its start, with a book."""
    inp.check_case(deck)
    state = state_of(build(deck))
    state.account = energy.account_of(state.scene)
    begin_stage(state, prepare(state, state.scene.steps[0], 0.0, lambda _: None, True))
    return state


def book(deck, duration):
    """All terms of the book after a duration [s]."""
    state = start(deck)
    scenes.advance(state, round(duration / state.stage.time_step))
    return energy.balance(state)


def residuals(make, duration, steps):
    """Residuals [J] of a scene made for each time step [s]."""
    return [book(make(step), duration)["energy_residual"] for step in steps]


def orders(values):
    """Orders of convergence between neighbours of a list made with steps halved each time."""
    return np.log2(np.abs(np.array(values[:-1]) / np.array(values[1:])))


# --- belts -----------------------------------------------------------------------------------------------------------


def whirled(step, *, damping=0.0, drag=0.0, force=False):
    """A strip that falls and swings about its end, which is carried along."""
    deck = case_deck(time_step=step, gravity=(0.0, 0.0, -G))
    x = np.linspace(0.0, 1.0, 11)
    add_strip(
        deck, Strip(bonds=10, damping=damping, tensile_strength=HELD), np.stack([x, 0 * x, 0 * x], axis=1)
    )
    deck.add("MOTION", particles="1", type="VELOCITY", rows={"vector": [(0.3, 0.0, 0.5)]})
    if drag:
        deck.add("DAMPING", mass_proportional=drag, rows={"velocity": [(0.2, 0.0, 0.0)]})
    if force:
        rows = {"id": [11], "force": [(3.0, 1.0, 2.0)], "torque": [(0.01, 0.02, 0.0)]}
        deck.add("FORCE", rows=rows)
    return deck


@pytest.mark.parametrize(
    "terms",
    [{}, {"damping": 0.5}, {"drag": 5.0}, {"damping": 0.1, "drag": 5.0, "force": True}],
    ids=["undamped", "bonds damped", "damped against a wind", "all of it, and a load"],
)
def test_the_balance_of_a_belt_closes_with_order_2_in_the_step(terms):
    found = residuals(lambda step: whirled(step, **terms), 0.1, (1e-4, 5e-5, 2.5e-5))
    np.testing.assert_allclose(orders(found), 2.0, atol=0.2)
    last = book(whirled(2.5e-5, **terms), 0.1)
    assert abs(found[-1]) < 1e-5 * max(abs(value) for value in last.values())


def released(step):
    """A strip stretched by 1 % along its axis and let go: a linear vibration."""
    deck = case_deck(time_step=step)
    x = np.linspace(0.0, 1.01, 11)
    add_strip(deck, Strip(bonds=10, tensile_strength=HELD), np.stack([x, 0 * x, 0 * x], axis=1))
    return deck


def test_a_linear_vibration_in_large_steps_closes_to_rounding():
    """Velocity Verlet conserves the energy less what it holds back, exactly: 1 % of it here, seen nowhere else."""
    terms = book(released(1e-4), 0.05)
    assert terms["energy_kinetic"] > 0.1
    assert abs(terms["energy_integration"]) > 1e-3 * terms["energy_kinetic"]
    assert abs(terms["energy_residual"]) < 1e-10 * terms["energy_kinetic"]


def test_a_change_of_the_step_is_no_work():
    """Of a vibration that goes on in steps of another length."""
    deck = released(1e-4)
    deck.blocks("STEP")[0].parameters |= {"NAME": "long", "DURATION": 0.02}
    deck.add("STEP", name="short", duration=0.02, time_step=5e-5)
    state = start(deck)
    scenes.advance(state, 200)
    begin_stage(state, prepare(state, state.scene.steps[1], state.time, lambda _: None, True))
    scenes.advance(state, 100)
    terms = energy.balance(state)
    assert terms["work_drives"] == 0.0
    assert abs(terms["energy_residual"]) < 1e-10 * terms["energy_kinetic"]


def test_the_residual_of_an_undamped_strip_stays_bounded():
    deck = case_deck(time_step=1e-4)
    x = np.linspace(0.0, 1.0, 11)
    bent = np.stack([x, 0 * x, 0.01 * x**2], axis=1)
    add_strip(deck, Strip(bonds=10, tensile_strength=HELD), bent)
    state = start(deck)
    residual = scenes.advance(state, 20_000, every=500, probe=lambda s: energy.balance(s)["energy_residual"])
    whole = sum(state.account.start.values())
    # Verlet's energy swings by about (w dt)^2 / 8 of the fastest mode's and does not drift.
    assert np.abs(residual).max() < 0.05 * whole
    assert abs(residual[20:].mean() - residual[:20].mean()) < 1e-3 * whole


def test_the_book_goes_on_after_a_checkpoint_as_if_never_interrupted():
    whole, again = (start(whirled(1e-4, damping=0.3, drag=1.0)) for _ in range(2))
    scenes.advance(whole, 200)
    kept = take(whole)
    scenes.advance(whole, 200)
    put_back(kept, again)
    scenes.advance(again, 200)
    assert energy.balance(again) == energy.balance(whole)


def test_a_damped_pair_loses_what_it_had():
    deck = case_deck(time_step=4e-6)  # (w dt)^2 / 4 = 7e-5 of the energy swings with the force
    strip = Strip(bonds=1, length=0.1, damping=0.2, tensile_strength=HELD)
    add_strip(deck, strip, [(0.0, 0.0, 0.0), (0.102, 0.0, 0.0)])
    terms = book(deck, 0.05)
    at_first = 0.5 * strip.axial / 0.1 * 0.002**2
    assert terms["loss_bond_damping"] == pytest.approx(at_first, rel=1e-4)
    assert terms["energy_bonds"] + terms["energy_kinetic"] < 1e-6 * at_first


def test_a_belt_that_snaps_loses_the_energy_of_the_bond():
    deck = case_deck(time_step=1e-5)
    strip = Strip(bonds=10, tensile_strength=2e6)
    x = np.linspace(0.0, 1.0, 11)
    add_strip(deck, strip, np.stack([x, 0 * x, 0 * x], axis=1))
    deck.add("MOTION", particles="1", type="VELOCITY", rows={"vector": [(0.0, 0.0, 0.0)]})
    deck.add("MOTION", particles="11", type="VELOCITY", rows={"vector": [(3.0, 0.0, 0.0)]})
    state = start(deck)
    seen = scenes.advance(state, 3000, every=10, probe=lambda s: np.array(list(energy.balance(s).values())))
    terms = dict(zip(energy.balance(state), seen.T))
    assert np.count_nonzero(state.scene.bonds.intact == 0) >= 1
    # A bond holds at its strength s^2 / 2E A l; it breaks at most one step's stretch later.
    held = (2e6) ** 2 / (2 * strip.young) * strip.area * strip.pitch
    broken = np.count_nonzero(state.scene.bonds.intact == 0)
    assert terms["loss_breakage"][-1] == pytest.approx(broken * held, rel=0.02)
    largest = max(np.abs(values).max() for values in terms.values())
    assert np.abs(terms["energy_residual"]).max() < 1e-3 * largest


# --- spheres, planes and rollers ------------------------------------------------------------------------------------

RADIUS = 0.01
MASS = scenes.SOFT["density"] * 4 / 3 * np.pi * RADIUS**3


def thrown(step, *, velocity=(0.3, 0.0, -1.0), **contact):
    """A sphere thrown at a plane."""
    deck = scenes.case(time_step=step, gravity=(0.0, 0.0, -G), **contact)
    scenes.add_spheres(deck, [(0.0, 0.0, 0.02)], radius=RADIUS, velocity=velocity)
    scenes.add_plane(deck)
    return deck


def resting(step, *, velocity, plane_velocity=None, **contact):
    """A sphere that lies on a plane as deep as it sinks in by its weight, and slides."""
    deck = scenes.case(time_step=step, gravity=(0.0, 0.0, -G), **contact)
    modulus = scenes.SOFT["youngs_modulus"] / (2 * (1 - scenes.SOFT["poisson_ratio"] ** 2))
    overlap = (3 * MASS * G / (4 * modulus * RADIUS**0.5)) ** (2 / 3)
    scenes.add_spheres(deck, [(0.0, 0.0, RADIUS - overlap)], radius=RADIUS, velocity=velocity)
    scenes.add_plane(deck)
    if plane_velocity is not None:
        deck.add("MOTION", part="floor", type="SURFACE VELOCITY", rows={"vector": [plane_velocity]})
    return deck


def test_a_bounce_costs_the_share_that_the_restitution_says():
    terms = book(thrown(5e-6, velocity=(0.0, 0.0, -1.0), restitution=0.6), 0.03)
    # It falls 1 cm, less the depth at which it begins to touch.
    impact = 0.5 * MASS * (1.0 + 2 * G * 0.01)
    # Gravity acts during the contact of 3 ms too, with 3 % of the mean force.
    assert terms["loss_contact_damping"] == pytest.approx((1 - 0.6**2) * impact, rel=0.01)
    assert abs(terms["energy_residual"]) < 1e-5 * impact


def test_the_balance_of_an_oblique_bounce_closes_with_order_2_in_the_step():
    found = residuals(lambda step: thrown(step, restitution=0.6, friction=0.3), 0.03, (2e-5, 1e-5, 5e-6))
    np.testing.assert_allclose(orders(found), 2.0, atol=0.2)


LOSSES = [f"loss_{name}" for name in energy.LOSSES]


def spinning_pair(step, **contact):
    """Two spheres that meet off their centres, one of them spinning."""
    deck = scenes.case(time_step=step, **contact)
    places = [(0.0, 0.0, 0.0), (1.6 * RADIUS + 1.3e-5, 1.2 * RADIUS, 0.0)]
    spins = [(0.0, 0.0, 0.0), (10.0, 20.0, 5.0)]
    scenes.add_spheres(deck, places, radius=RADIUS, velocity=[(0.5, 0.0, 0.0), (-0.5, 0.0, 0.0)], spin=spins)
    return deck


@pytest.mark.parametrize("contact", [{}, {"friction": 0.5}, {"friction": 0.5, "rolling": 0.2}])
def test_no_loss_is_ever_given_back(contact):
    """A damper beyond the bound of friction must not wind its spring up the other way: it would make energy."""
    state = start(spinning_pair(1e-5, restitution=0.3, **contact))
    first = energy.energies(state)["kinetic"]
    seen = scenes.advance(
        state, 800, every=5, probe=lambda s: np.array([energy.balance(s)[name] for name in LOSSES])
    )
    # The velocities of a half step where one turns back: a third order share of each row.
    assert np.diff(seen, axis=0).min() > -1e-6 * first
    assert seen[-1].min() > -1e-9 * first
    assert seen[-1][LOSSES.index("loss_contact_damping")] > 0.3 * first


@pytest.mark.parametrize("friction", [0.0, 0.5, 5.0])
def test_the_balance_of_a_turning_pair_closes_with_order_2_in_the_step(friction):
    """Damped, and with friction that slides or sticks: the old force acted across the old normal."""
    found = residuals(
        lambda step: spinning_pair(step, restitution=0.3, friction=friction), 0.008, (2e-5, 1e-5, 5e-6)
    )
    np.testing.assert_allclose(orders(found), 2.0, atol=0.3)


def test_the_friction_spring_of_a_turning_pair_makes_no_energy():
    found = book(spinning_pair(1e-5, friction=5.0), 0.008)
    first = energy.energies(start(spinning_pair(1e-5)))["kinetic"]
    # (w dt)^2 of an impact of 3 ms is 1e-4, and its force is nearly the same on both ways; with the slip across the
    # normal of the step's end this was 1.2e-4.
    assert abs(found["energy_residual"]) < 2e-6 * first


def test_a_sphere_slides_until_it_rolls_and_friction_takes_two_sevenths():
    terms = book(resting(1e-5, velocity=(0.5, 0.0, 0.0), friction=0.3, restitution=0.5), 0.1)
    at_first = 0.5 * MASS * 0.5**2
    # The rolling sphere keeps 5/7 of its energy; its spring swings on by a little.
    assert terms["energy_kinetic"] + terms["energy_rotational"] == pytest.approx(5 / 7 * at_first, rel=1e-3)
    lost = terms["loss_friction"] + terms["loss_contact_damping"] + terms["loss_spring_change"]
    assert lost == pytest.approx(2 / 7 * at_first, rel=2e-3)
    assert terms["loss_friction"] > 0.98 * lost
    assert abs(terms["energy_residual"]) < 1e-4 * at_first


def test_friction_of_a_held_sphere_on_a_moving_plane_is_force_times_path():
    deck = scenes.case(time_step=1e-5, friction=0.3, restitution=0.5)
    scenes.add_spheres(deck, [(0.0, 0.0, RADIUS - 1e-4)], radius=RADIUS, fixed="YES")
    scenes.add_plane(deck)
    deck.add("MOTION", part="floor", type="SURFACE VELOCITY", rows={"vector": [(2.0, 0.0, 0.0)]})
    state = start(deck)
    scenes.advance(state, 1000)
    before = energy.balance(state)
    pull = abs(float(state.scene.machinery.parts.force[0, 0]))
    scenes.advance(state, 1000)
    after = energy.balance(state)
    assert after["loss_friction"] - before["loss_friction"] == pytest.approx(pull * 2.0 * 0.01, rel=1e-9)
    assert after["work_drives"] - before["work_drives"] == pytest.approx(pull * 2.0 * 0.01, rel=1e-9)


def test_rolling_resistance_stops_a_sphere_and_takes_its_energy():
    deck = resting(1e-5, velocity=(0.2, 0.0, 0.0), friction=0.5, rolling=0.1, restitution=0.5)
    terms = book(deck, 0.3)
    at_first = 0.5 * MASS * 0.2**2
    assert terms["energy_kinetic"] + terms["energy_rotational"] < 0.02 * at_first
    assert terms["loss_rolling"] > 0.5 * at_first
    assert abs(terms["energy_residual"]) < 1e-3 * at_first


def test_the_damper_takes_the_energy_of_a_rocking_sphere():
    """Below the bound of rolling all that it had goes to the rolling spring and its damper."""
    spin = 0.02  # rad/s; turns by 1e-3 of what the bound needs
    deck = resting(1e-5, velocity=(spin * RADIUS, 0.0, 0.0), friction=0.8, restitution=0.5, rolling=0.2)
    slots = np.zeros(1, int)
    state = start(deck)
    state.scene.population.particles.angular_momentum[1, slots] = 0.4 * MASS * RADIUS**2 * spin
    state.scene.population.particles.angular_velocity[1, slots] = spin
    first = 0.7 * MASS * (spin * RADIUS) ** 2
    scenes.advance(state, 20_000)
    terms = energy.balance(state)
    left = terms["energy_kinetic"] + terms["energy_rotational"] + terms["energy_contact_rolling"]
    assert left < 1e-3 * first
    assert terms["loss_rolling"] + terms["loss_contact_damping"] == pytest.approx(first, rel=0.01)
    assert terms["loss_rolling"] > 0.9 * first


def seam(step, place):
    """A sphere that falls on light boxes of a belt whose rim is held."""
    deck = scenes.case(time_step=step, friction=0.5, restitution=0.3, rolling=0.1, gravity=(0, 0, -G))
    grid = add_belt(deck, 6, 6, young=5e6, damping=0.05)
    rim = sorted({*grid[0], *grid[-1], *grid[:, 0], *grid[:, -1]})
    vector = {"vector": [(0.0, 0.0, 0.0)]}
    deck.add("MOTION", particles=", ".join(map(str, rim)), type="VELOCITY", rows=vector)
    centre = (PITCH * place[0], PITCH * place[1], 0.5 * THICKNESS + 2 * RADIUS + 1e-4)
    scenes.add_spheres(deck, [centre], radius=2 * RADIUS, velocity=(0.3, 0.1, -1.5))
    return deck


@pytest.mark.parametrize("place", [(2.5, 2.5), (2.5, 2.2), (2.45, 2.41)])
def test_boxes_that_share_a_sphere_make_no_energy(place):
    """Boxes that took turns in carrying it made some per cent of what the impact brought."""
    state = start(seam(1e-5, place))
    first = energy.energies(state)["kinetic"]
    residual = scenes.advance(state, 8000, every=100, probe=lambda s: energy.balance(s)["energy_residual"])
    assert np.abs(residual).max() < 1e-3 * first


def test_a_driven_roller_with_bearing_friction():
    deck = scenes.case(time_step=1e-4)
    scenes.add_cylinder(deck, diameter=0.1, length=0.2)
    scenes.add_spheres(deck, [(0.0, 0.0, 1.0)], radius=RADIUS)
    deck.add("MOTION", part="roller", type="TORQUE", torque=0.3, inertia=0.02, friction_torque=0.1)
    terms = book(deck, 0.5)
    rate = 0.2 / 0.02 * 0.5
    angle = 0.5 * rate * 0.5
    # Constant torques are exact: rounding alone remains.
    assert terms["energy_parts"] == pytest.approx(0.5 * 0.02 * rate**2, rel=1e-12)
    assert terms["work_drives"] == pytest.approx(0.3 * angle, rel=1e-11)
    assert terms["loss_bearings"] == pytest.approx(0.1 * angle, rel=1e-9)
    assert abs(terms["energy_residual"]) < 1e-9 * terms["work_drives"]


def on_a_roller(step, motion):
    """A sphere held beside an idle roller that another turning thing drives by friction."""
    deck = scenes.case(time_step=step, friction=0.4, restitution=0.4)
    scenes.add_cylinder(deck, diameter=0.1, length=0.2)
    scenes.add_spheres(deck, [(0.0, 0.0, 0.05 + RADIUS - 2e-4)], radius=RADIUS, name="wheel")
    deck.add("MOTION", particle_type="wheel", type="VELOCITY", rows={"vector": [(0, 0, 0, 0, 40.0, 0)]})
    deck.add("MOTION", part="roller", **motion)
    return deck


def test_a_roller_driven_by_friction_takes_what_the_driver_gives_less_the_losses():
    terms = book(on_a_roller(1e-5, {"type": "FREE ROTATION", "inertia": 1e-4, "friction_torque": 1e-3}), 0.2)
    assert terms["energy_parts"] == pytest.approx(0.5 * 1e-4 * 8.0**2, rel=0.05)  # 40 rad/s by 1 cm to 5 cm
    assert terms["loss_friction"] > 0.0
    assert terms["loss_bearings"] > 0.0
    assert abs(terms["energy_residual"]) < 1e-3 * terms["work_drives"]


def test_a_take_up_stores_its_energy_in_motion_and_suspension():
    deck = scenes.case(time_step=1e-4)
    scenes.add_cylinder(deck, diameter=0.1, length=0.2)
    scenes.add_spheres(deck, [(0.0, 0.0, 1.0)], radius=RADIUS)
    deck.add(
        "MOTION",
        part="roller",
        type="TENSION",
        force=10.0,
        mass=2.0,
        damping=3.0,
        rows={"vector": [(1, 0, 0)]},
    )
    found = book(deck, 0.5)
    speed = 10.0 / 3.0 * (1 - np.exp(-3.0 / 2.0 * 0.5))
    # The trapezoidal rule of the damper is off by (c dt / m)^2 / 12 of the decay: 2e-9
    assert found["energy_parts"] == pytest.approx(0.5 * 2.0 * speed**2, rel=1e-8)
    assert abs(found["energy_residual"]) < 1e-8 * found["work_drives"]


# --- runs -----------------------------------------------------------------------------------------------------------


def fed(tmp_path, **output):
    """A feed that falls on a plane with a moving surface, which carries it out of the domain."""
    deck = scenes.case(
        time_step=1e-5, gravity=(0, 0, -G), duration=0.5, friction=0.5, restitution=0.4, rolling=0.05
    )
    deck.add("PARTICLE TYPE", name="grain", shape="SPHERE", radius=RADIUS, material="stuff")
    rows = {"box": [(-0.03, -0.03, 0.04, 0.03, 0.03, 0.1)], "velocity": [(0.0, 0.0, -0.5)]}
    deck.add("SOURCE", name="feed", particle_type="grain", mass_rate=0.5, rows=rows)
    scenes.add_plane(deck)
    deck.add("MOTION", part="floor", type="SURFACE VELOCITY", rows={"vector": [(1.0, 0.0, 0.0)]})
    deck.add("DOMAIN", rows={"box": [(-0.1, -0.1, -0.1, 0.1, 0.1, 0.2)]})
    deck.add("OUTPUT", interval=0.05, **output)
    inp.check_case(deck)
    said = []
    run(deck, build(deck), str(tmp_path / "out.h5"), report=said.append)
    with trajectory.read(tmp_path / "out.h5") as found:
        return said, [frame.observables for frame in found]


@pytest.mark.parametrize("sorted_at", [engine.ENOUGH_TO_SORT, 1])
def test_the_balance_of_bulk_that_comes_and_goes_closes(tmp_path, monkeypatch, sorted_at):
    """Also where spheres are sorted by place as new ones come."""
    monkeypatch.setattr(engine, "ENOUGH_TO_SORT", sorted_at)
    said, frames = fed(tmp_path, fields=("VELOCITY", "ENERGY"))
    last = frames[-1]
    assert last["removed_mass"] > 0.0
    assert last["work_brought"] > 0.0
    assert last["work_taken"] > 0.0
    for terms in frames[1:]:
        largest = max(abs(terms[name]) for name, _, _ in energy.OBSERVABLES)
        assert abs(terms["energy_residual"]) < 1e-3 * largest
    assert said[-1].energy_drift < 1e-3
    assert f"energy drift {said[-1].energy_drift:.1g}" in sentence(said[-1])


def test_the_terms_of_every_frame_add_up_to_the_residual(tmp_path):
    _, frames = fed(tmp_path, fields=("ENERGY",))

    def total(terms, prefix, names):
        return sum(terms[f"{prefix}_{name}"] for name in names)

    stored = [total(terms, "energy", energy.ENERGIES) for terms in frames]
    for terms, now in zip(frames, stored):
        work = terms["work_drives"] + terms["work_forces"] + terms["work_brought"] - terms["work_taken"]
        rest = now - stored[0] + total(terms, "loss", energy.LOSSES) - work
        assert rest == pytest.approx(terms["energy_residual"], abs=1e-12)


def test_the_reference_integrator_keeps_no_book(tmp_path):
    deck = whirled(1e-4)
    deck.blocks("STEP")[0].parameters["INTEGRATOR"] = "PEFRL"
    deck.add("OUTPUT", interval=0.05, fields=("ENERGY",))
    with pytest.raises(TimeStepError, match="the energy book"):
        run(deck, build(deck), str(tmp_path / "out.h5"))


def test_without_a_book_nothing_of_it_is_recorded(tmp_path):
    said, frames = fed(tmp_path)
    assert not any(name.startswith(("loss_", "work_", "energy_")) for name in frames[-1])
    assert "energy drift" not in sentence(said[-1])
