"""Strips in motion and at rest: statics, frequencies, large rotation, breakage, energy and momenta."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from beltsim.engine import advance_by
from beltsim.verify.loops import add_pulley, pulley_case
from beltsim.verify.stepping import (
    axial_forces,
    energy_of,
    frequency_of,
    growth,
    momenta_of,
    position_of,
    projection,
    put_load,
    ramp,
    run_for,
    sampled,
    settle,
    start,
)
from beltsim.verify.strips import (
    Strip,
    add_belt_types,
    add_strip,
    case_deck,
    checked,
    line,
    straight,
    strip_deck,
)

STRIP = Strip(bonds=10)
FIRST_BENDING = 0.329742  # Hz, of the cantilever


def particles_of(state):
    return state.scene.population.particles


def test_the_strips_of_this_file_are_cases_that_the_format_accepts():
    assert checked(strip_deck(STRIP)).blocks("BOND")


# --- statics ---------------------------------------------------------------------------------------------------


def test_axial_extension_is_f_l_over_e_a():
    state = start(strip_deck(STRIP), clamped=[0])
    put_load(state, 10, force=(500.0, 0.0, 0.0))
    settle(state, 51.0, 5)  # critical damping: the rest falls by 535 a period
    assert position_of(state)[10, 0] - 1.0 == pytest.approx(0.01, rel=1e-9)
    np.testing.assert_allclose(axial_forces(state), 500.0, rtol=1e-9)


@pytest.mark.parametrize("bonds", [5, 20])
def test_tip_deflection_of_a_cantilever_is_exact_for_any_number_of_bonds(bonds):
    state = start(strip_deck(Strip(bonds=bonds, damping=0.3)), clamped=[0])
    load = 1e-4  # N: the square of the slope, 1.4e-8, is the error of the linear formula
    put_load(state, bonds, force=(0.0, 0.0, load))
    settle(state, FIRST_BENDING, 6)
    exact = load * (1.0 / (3.0 * STRIP.bending) + 1.0 / (5.0 / 6.0 * STRIP.shear_modulus * STRIP.area))
    assert position_of(state)[bonds, 2] == pytest.approx(exact, rel=1e-7)


def test_the_reduction_factor_makes_a_beam_of_f_ei_and_leaves_the_extension():
    state = start(strip_deck(Strip(bonds=10, reduction=0.1)), clamped=[0])
    put_load(state, 10, force=(0.0, 0.0, 1e-5))
    settle(state, FIRST_BENDING * math.sqrt(0.1), 4)
    exact = 1e-5 * (10.0 / (3.0 * STRIP.bending) + 1.0 / (5.0 / 6.0 * STRIP.shear_modulus * STRIP.area))
    assert position_of(state)[10, 2] == pytest.approx(exact, rel=1e-7)
    put_load(state, 10, force=(500.0, 0.0, 0.0))
    settle(state, 51.0, 5)
    assert position_of(state)[10, 0] - 1.0 == pytest.approx(0.01, rel=1e-6)  # bending has hardly gone back


def test_torsion_turns_the_tip_by_t_l_over_g_j():
    # Global damping slows no rotation: the bonds' is set near critical for the first mode (ratio 0.11 of the pair's).
    state = start(strip_deck(Strip(bonds=10, damping=8.0)), clamped=[0])
    put_load(state, 10, torque=(0.05, 0.0, 0.0))
    run_for(state, 1.0)
    q = particles_of(state).orientation[:, 10]
    saint_venant = 0.1 * 0.01**3 / 3.0 * (1.0 - 0.063 + 0.052e-5)
    assert 2.0 * math.atan2(q[1], q[0]) == pytest.approx(
        0.05 / (STRIP.shear_modulus * saint_venant), rel=1e-9
    )


def test_hanging_under_its_own_weight():
    state = start(strip_deck(STRIP, gravity=(9.81, 0.0, 0.0)), clamped=[0])
    settle(state, 51.0, 5)
    assert position_of(state)[10, 0] - 1.0 == pytest.approx(1200.0 * 9.81 / (2.0 * 50e6), rel=1e-9)


# --- large rotation --------------------------------------------------------------------------------------------


def test_an_end_moment_of_2_pi_ei_over_l_rolls_the_strip_into_a_circle():
    state = start(strip_deck(Strip(bonds=10, damping=0.3)), clamped=[0])
    state.stage.drag = 4.0 * math.pi * FIRST_BENDING
    ramp(state, 10, (0, 0, 0), (0.0, -2.0 * math.pi * STRIP.bending, 0.0), duration=4.0)
    settle(state, FIRST_BENDING, 4)
    assert np.linalg.norm(position_of(state)[10]) < 1e-6
    turn = Rotation.from_quat(particles_of(state).orientation.T, scalar_first=True)
    steps = np.linalg.norm((turn[:-1].inv() * turn[1:]).as_rotvec(), axis=1)
    np.testing.assert_allclose(steps, 2.0 * math.pi / 10.0, rtol=1e-6)


def test_tip_of_the_elastica_at_unit_load():
    strip = Strip(bonds=20)
    state = start(strip_deck(strip), clamped=[0])
    put_load(state, 20, force=(0.0, 0.0, -strip.bending))
    settle(state, FIRST_BENDING, 3)
    tip = position_of(state)[20]
    # Elliptic integrals (Bisshopp and Drucker 1945); at 20 bonds 0.2 % of the length.
    assert -tip[2] == pytest.approx(0.301721, abs=2e-3)
    assert tip[0] == pytest.approx(0.943567, abs=2e-3)


def test_a_string_hangs_in_a_catenary():
    # Without bending stiffness; the closed form for an inextensible chain: H = 14.9072 N at a sag of 0.1 m.
    arc = 1.026187
    strip = Strip(bonds=40, length=arc, reduction=0.0, young=1e9)
    x = np.linspace(0.0, 1.0, 41)
    deck = case_deck(gravity=(0.0, 0.0, -9.81))
    add_strip(deck, strip, np.stack([x, 0 * x, -0.4 * x * (1.0 - x)], axis=1))
    state = start(deck, pinned=[0, 40])
    settle(state, 1.7, 6)
    horizontal, sag = 14.9072, 0.1
    assert -position_of(state)[20, 2] == pytest.approx(sag, rel=5e-3)
    middle = axial_forces(state)[19:21].mean()
    assert middle == pytest.approx(horizontal, rel=1e-2)  # twice the error of the sag


@pytest.mark.parametrize("axis", np.eye(3), ids=["twist", "bending", "in plane"])
def test_a_swing_from_170_degrees_conserves_energy(axis):
    coarse, fine = swing(axis, 0.1), swing(axis, 0.05)
    assert coarse < 0.01  # (omega dt)^2 / 4 at a tenth of the limit
    assert coarse > 3.0 * fine  # of second order: 4, at nearly the same looks


def swing(axis, safety):
    # About a section axis: towards a softer one the same energy would reach beyond 180 degrees.
    strip = Strip(bonds=1, length=0.05, radius=0.01)
    deck = case_deck(safety=safety)
    turn = Rotation.from_rotvec(np.radians(170.0) * axis).as_quat(scalar_first=True)
    add_strip(deck, strip, line(2, 0.05), orientation=[[1.0, 0, 0, 0], turn])
    state = start(deck)
    before, momentum = energy_of(state), momenta_of(state)
    energies = []
    for _ in range(40):
        run_for(state, 2.5e-4)
        energies.append(energy_of(state))
    after = momenta_of(state)
    np.testing.assert_allclose(after[0], momentum[0], atol=1e-12)
    np.testing.assert_allclose(after[1], momentum[1], atol=1e-12)
    return np.max(np.abs(np.array(energies) / before - 1.0))


# --- frequencies -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("bonds", "exact"), [(10, 50.9786), (20, 51.0179)])
def test_first_axial_frequency_is_that_of_the_chain(bonds, exact):
    strip = Strip(bonds=bonds)
    shape = np.sin(0.5 * np.pi * np.arange(bonds + 1) / bonds)
    state = start(strip_deck(strip), clamped=[0], velocity=np.outer(shape, [1e-3, 0.0, 0.0]))
    rest = position_of(state)[:, 0].copy()
    interval, values = sampled(state, 0.04, 200, lambda s: projection(s, shape, 0, rest))
    # Verlet raises a frequency by (omega dt)^2 / 24: 4e-4 at 10 bonds, 1e-4 at 20; targets have six digits.
    omega, dt = 2.0 * math.pi * exact, state.stage.time_step
    assert frequency_of(interval, values) == pytest.approx(exact * (1.0 + (omega * dt) ** 2 / 24.0), rel=1e-5)


def cantilever_mode(strip):
    x = np.arange(strip.bonds + 1) / strip.bonds
    beta = 1.875104
    ratio = (math.cosh(beta) + math.cos(beta)) / (math.sinh(beta) + math.sin(beta))
    return np.cosh(beta * x) - np.cos(beta * x) - ratio * (np.sinh(beta * x) - np.sin(beta * x))


def cantilever_frequency(strip):
    shape = cantilever_mode(strip)
    state = start(strip_deck(strip), clamped=[0], velocity=np.outer(shape, [0.0, 0.0, 1e-4]))
    interval, values = sampled(state, 3.0, 100, lambda s: projection(s, shape, 2, 0.0 * shape))
    return frequency_of(interval, values)


def test_first_bending_frequency_of_a_cantilever():
    assert cantilever_frequency(Strip(bonds=20)) == pytest.approx(0.329716, rel=5e-3)  # Timoshenko beam


def test_the_reduction_factor_lowers_the_frequency_by_its_root():
    ratio = cantilever_frequency(Strip(bonds=10, reduction=0.25)) / cantilever_frequency(STRIP)
    assert ratio == pytest.approx(0.5, rel=1e-3)  # shear flexibility and rotary inertia do not scale along


def test_first_torsional_frequency():
    strip = Strip(bonds=20)
    shape = np.sin(0.5 * np.pi * np.arange(21) / 20)
    state = start(strip_deck(strip), clamped=[0], spin=np.outer(shape, [0.1, 0.0, 0.0]))

    def twist(s):
        q = particles_of(s).orientation
        return float(shape @ (2.0 * np.arctan2(q[1], q[0])))

    interval, values = sampled(state, 0.3, 150, twist)
    assert frequency_of(interval, values) == pytest.approx(
        6.09651, rel=1e-3
    )  # chain: (pi / 80)^2 / 24 too low


def test_a_tensioned_string_sounds_at_its_pitch():
    strip = Strip(bonds=40, length=1.0 / 1.004, reduction=0.0, density=1200.0 * 1.004)
    shape = np.sin(np.pi * np.arange(41) / 40)
    state = start(
        strip_deck(strip, stretch=1.004), pinned=[0, 40], velocity=np.outer(shape, [0.0, 0.0, 1e-3])
    )
    interval, values = sampled(state, 0.3, 150, lambda s: projection(s, shape, 2, 0.0 * shape))
    assert frequency_of(interval, values) == pytest.approx(6.45497, rel=2e-3)  # T = 200 N


@pytest.mark.parametrize("reduction", [0.0, 0.01, 1.0])
def test_a_strip_stretched_by_15_percent_is_stable_with_any_bending_stiffness(reduction):
    # Its tension exceeds the shear stiffness times the pitch: particles must not turn away from the chord.
    strip = Strip(bonds=40, length=1.0 / 1.15, reduction=reduction, density=1200.0 * 1.15)
    shape = np.sin(np.pi * np.arange(41) / 40)
    state = start(strip_deck(strip, stretch=1.15), pinned=[0, 40], velocity=np.outer(shape, [0.0, 0.0, 1e-3]))
    np.testing.assert_allclose(axial_forces(state), 7500.0, rtol=1e-12)
    interval, values = sampled(state, 0.1, 150, lambda s: projection(s, shape, 2, 0.0 * shape))
    assert frequency_of(interval, values) == pytest.approx(0.5 * math.sqrt(7500.0 / 1.2), rel=2e-3)


def test_compression_beyond_eulers_load_buckles_and_below_it_does_not():
    critical = math.pi**2 * STRIP.bending / 4.0
    shape = 1.0 - np.cos(0.5 * np.pi * np.arange(11) / 10)
    rates = []
    for share in (0.95, 1.05):
        state = start(strip_deck(STRIP), clamped=[0], velocity=np.outer(shape, [0.0, 0.0, 1e-6]))
        put_load(state, 10, force=(-share * critical, 0.0, 0.0))
        interval, values = sampled(state, 6.0, 60, lambda s: projection(s, shape, 2, 0.0 * shape))
        rates.append(growth(interval, values))
    assert rates[0] < 0.0 < rates[1]
    # The rate is linear in the load and zero at the critical one; the chain's is 0.4 % above (10 bonds).
    assert 0.95 - rates[0] * 0.1 / (rates[1] - rates[0]) == pytest.approx(1.0, abs=0.01)


# --- invariants ------------------------------------------------------------------------------------------------


def crooked_velocity(count, size, seed=4):
    return size * np.random.default_rng(seed).normal(size=(count, 3))


def test_momentum_and_angular_momentum_stay_to_rounding():
    strip = Strip(bonds=10, damping=0.05)
    state = start(strip_deck(strip), velocity=crooked_velocity(11, 0.5), spin=crooked_velocity(11, 5.0, 5))
    linear, angular = momenta_of(state)
    advance_by(state, 10000)
    after = momenta_of(state)
    scale = 1.2 * 0.5  # kg m/s
    np.testing.assert_allclose(after[0], linear, atol=1e-12 * scale)
    np.testing.assert_allclose(after[1], angular, atol=1e-12 * scale)


def test_quaternions_stay_unit():
    state = start(strip_deck(STRIP), velocity=crooked_velocity(11, 0.5), spin=crooked_velocity(11, 50.0))
    advance_by(state, 20000)
    norms = np.linalg.norm(particles_of(state).orientation, axis=0)
    np.testing.assert_allclose(norms, 1.0, atol=1e-14)


def energy_swing(safety):
    state = start(strip_deck(STRIP, safety=safety), velocity=crooked_velocity(11, 0.1) * [1.0, 0.0, 1.0])
    before = energy_of(state)
    energies = []
    for _ in range(100):
        run_for(state, 2e-4)
        energies.append(energy_of(state))
    return float(np.max(np.abs(np.array(energies) / before - 1.0)))


def test_the_energy_error_is_of_second_order_in_the_step():
    coarse, fine = energy_swing(0.2), energy_swing(0.1)
    assert coarse < 0.02
    # Sampled at the same times, up to a step.
    assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.15)


def test_energy_without_damping_has_no_trend():
    state = start(strip_deck(STRIP, safety=0.5), velocity=crooked_velocity(11, 0.1))
    energies = []
    for _ in range(200):
        advance_by(state, 500)
        energies.append(energy_of(state))
    energies = np.array(energies) / energies[0] - 1.0
    first, second = energies[:100].mean(), energies[100:].mean()
    # The swing is bounded by (omega dt)^2 / 8 of the fastest modes; the two halves differ by the error of their means.
    assert np.max(np.abs(energies)) < 0.1
    assert abs(first - second) < 4.0 * energies.std() / math.sqrt(50.0)


def test_damping_takes_energy_at_every_look():
    strip = Strip(bonds=10, damping=0.1)
    state = start(strip_deck(strip, safety=0.2), velocity=crooked_velocity(11, 0.1))
    energies = [energy_of(state)]
    for _ in range(50):
        advance_by(state, 20)
        energies.append(energy_of(state))
    assert np.all(np.diff(energies) < 0.0)


def test_a_strip_in_rigid_rotation_stays_rigid_and_undamped():
    # Spun about its middle, stretched to balance the centrifugal force: chain of half end masses, w^2 small.
    strip, rate = Strip(bonds=10, damping=0.5), 2.0
    arms = line(11, 0.1) - [0.5, 0.0, 0.0]
    velocity = np.cross([0.0, 0.0, rate], arms)
    state = start(strip_deck(strip), velocity=velocity, spin=np.tile([0.0, 0.0, rate], (11, 1)))
    settle_time = 2.0  # s, 60 periods of the axial motion that the sudden spin starts: damped away
    run_for(state, settle_time)
    before = energy_of(state)
    shape = np.linalg.norm(np.diff(position_of(state), axis=0), axis=1)
    run_for(state, 1.0)
    np.testing.assert_allclose(np.linalg.norm(np.diff(position_of(state), axis=0), axis=1), shape, rtol=1e-10)
    assert energy_of(state) == pytest.approx(before, rel=1e-9)


def test_a_turned_scene_gives_turned_results():
    turn = Rotation.from_rotvec([0.3, -1.2, 0.8])
    velocity = crooked_velocity(11, 0.3)
    plain = start(strip_deck(STRIP), velocity=velocity)
    deck = case_deck()
    quaternions = np.tile(turn.as_quat(scalar_first=True), (11, 1))
    add_strip(deck, STRIP, turn.apply(line(11, STRIP.pitch)), orientation=quaternions)
    turned = start(deck, velocity=turn.apply(velocity))
    for state in (plain, turned):
        advance_by(state, 500)
    np.testing.assert_allclose(position_of(turned), turn.apply(position_of(plain)), atol=1e-10)


def test_a_strip_that_flies_at_20_metres_a_second_bends_like_one_at_rest():
    velocity = crooked_velocity(11, 0.3)
    states = []
    for boost in ([0.0, 0.0, 0.0], [20.0, 0.0, 0.0]):
        states.append(start(strip_deck(STRIP, time_step=2e-5), velocity=np.add(velocity, boost)))
        advance_by(states[-1], 5000)
    places = [position_of(state) - position_of(state).mean(axis=0) for state in states]
    np.testing.assert_allclose(places[1], places[0], atol=1e-10)  # 2 m from the origin: 4e-16 m a step


def scaled_run(length=1.0, young=1.0, time_step=1e-4):
    """Places after 500 steps of a strip with its lengths, stiffness and step scaled, in units of the length."""
    strip = Strip(
        bonds=8,
        length=length,
        width=0.125 * length,
        thickness=length / 64,
        young=young * 2.0**26,
        poisson=0.25,
    )
    # Speeds scale with the root of the stiffness, and spins with speed over length.
    speed = math.sqrt(young)
    velocity, spin = speed * crooked_velocity(9, 0.5), speed / length * crooked_velocity(9, 5.0, 5)
    state = start(strip_deck(strip, time_step=time_step), velocity=velocity, spin=spin)
    advance_by(state, 500)
    return position_of(state) / length


@pytest.mark.parametrize("power", [-20, 10])
def test_a_strip_of_another_size_gives_the_same_bits(power):
    # Mass grows with the cube of the size and the step with the size: no length is written into the code.
    size = 2.0**power
    np.testing.assert_array_equal(scaled_run(length=size, time_step=1e-4 * size), scaled_run())


@pytest.mark.parametrize("power", [-3, 6])
def test_a_stiffer_strip_in_shorter_steps_gives_the_same_bits(power):
    np.testing.assert_array_equal(scaled_run(young=4.0**power, time_step=1e-4 / 2.0**power), scaled_run())


def test_the_same_run_gives_the_same_bits():
    states = [start(strip_deck(STRIP), velocity=crooked_velocity(11, 0.3)) for _ in range(2)]
    advance_by(states[0], 1000)
    for _ in range(10):
        advance_by(states[1], 100)
    np.testing.assert_array_equal(position_of(states[0]), position_of(states[1]))


def test_end_particles_of_half_mass_make_the_strip_weigh_its_length():
    state = start(strip_deck(STRIP))
    assert particles_of(state).mass.sum() == pytest.approx(1.2, rel=1e-14)


# --- breakage --------------------------------------------------------------------------------------------------


def pulled_pair(stress, *, shear=False, strength=1e6):
    """A held pair under a given tensile (or shear) stress in its bond, after one step."""
    kind = {"shear_strength": strength} if shear else {"tensile_strength": strength}
    strip = Strip(bonds=1, length=0.05, **kind)
    deck = case_deck()
    stretch = stress * strip.area / (strip.axial / 0.05)
    add_strip(deck, strip, [[0.0, 0, 0], [0.05 + (0 if shear else stretch), 0, 0]])
    state = start(deck, clamped=[0, 1])
    if shear:
        particles_of(state).position[2, 1] = stress * strip.area / state.scene.kinds.stiffness[2, 0]
    advance_by(state, 3)
    return state


@pytest.mark.parametrize("shear", [False, True])
def test_a_bond_breaks_at_its_strength_and_not_below(shear):
    # The stress is exact to rounding: 1e-6 either side decides.
    below, above = (pulled_pair(1e6 * (1.0 + sign * 1e-6), shear=shear) for sign in (-1, 1))
    assert below.scene.bonds.intact[0] == 1
    assert below.scene.strength.mode[0] == 0
    assert above.scene.bonds.intact[0] == 0
    assert above.scene.strength.mode[0] == (2 if shear else 1)
    assert not particles_of(above).force.any()


def test_bending_breaks_the_outer_fibre():
    strip = Strip(bonds=1, length=0.05, tensile_strength=1e6)
    moment = 1e6 * 0.1 * 0.01**2 / 6.0
    angle = moment / (strip.bending / 0.05)
    for share, intact in ((1.0 - 1e-6, 1), (1.0 + 1e-6, 0)):
        turn = Rotation.from_rotvec([0.0, share * angle, 0.0]).as_quat(scalar_first=True)
        half = 0.5 * share * angle
        deck = case_deck()
        # Both centres on the chord at half the turn: pure bending, no shear and no stretch in the mid frame.
        place = [0.05 * math.cos(half), 0.0, -0.05 * math.sin(half)]
        add_strip(deck, strip, [[0.0, 0, 0], place], orientation=[[1.0, 0, 0, 0], turn])
        state = start(deck, clamped=[0, 1])
        assert state.scene.bonds.intact[0] == intact


def test_a_strip_pulled_apart_breaks_once_records_it_and_conserves():
    strip = Strip(bonds=6, length=0.3, tensile_strength=2e6)
    deck = strip_deck(strip, safety=0.2)
    velocity = np.zeros((7, 3))
    velocity[:, 0] = np.linspace(-10.0, 10.0, 7)
    state = start(deck, velocity=velocity)
    (linear, angular), before = momenta_of(state), energy_of(state)
    energies, records = [before], []
    for _ in range(400):
        advance_by(state, 1)
        energies.append(energy_of(state))
        records.append(state.scene.strength.broken_step.copy())
    bonds, strength = state.scene.bonds, state.scene.strength
    assert np.any(bonds.intact == 0)
    np.testing.assert_array_equal(strength.broken_step >= 0, bonds.intact == 0)
    np.testing.assert_array_equal(strength.mode > 0, bonds.intact == 0)
    # Recorded once, in the step in which it broke.
    for b in np.flatnonzero(bonds.intact == 0):
        seen = [record[b] for record in records if record[b] >= 0]
        assert set(seen) == {strength.broken_step[b]}
        assert records[seen[0] - 1][b] == seen[0]
    after = momenta_of(state)
    np.testing.assert_allclose(after[0], linear, atol=1e-12)
    np.testing.assert_allclose(after[1], angular, atol=1e-12)
    # Breaking only takes energy; Verlet's own swing at a fifth of the limit is below (omega dt)^2 / 8 = 2 %.
    assert max(energies) < before * 1.02
    assert energies[-1] < before


# --- loose boxes -----------------------------------------------------------------------------------------------


def test_a_box_without_bonds_gets_its_step_from_its_contact_with_a_roller():
    deck = pulley_case(0.0)
    add_belt_types(deck, STRIP)
    deck.add(
        "PARTICLE", type="belt", rows={"id": [1], "position": [[0, 0, 0.105]], "orientation": straight(1)}
    )
    add_pulley(deck, "roller", 0.0, 0.1)
    state = start(deck)
    stiffness = (
        0.25 * math.pi * STRIP.young / 0.91 * STRIP.width
    )  # of the line contact with steel, a little less
    assert state.stage.time_step < 2.0 / math.sqrt(0.99 * stiffness / 0.12)
