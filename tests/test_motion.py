"""How particles and parts move: free flight and rotation, drives, supports, loads and damping."""

import numpy as np
import pytest
import scenes
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

MOMENTS = np.array([1.0, 1.9, 2.7])  # of a plate-like body
SPIN = np.array([0.4, 1.0, 0.3])


def test_free_fall_follows_the_parabola_to_rounding():
    deck = scenes.case(time_step=1e-5, gravity=(0.3, -0.2, -9.81))
    scenes.add_spheres(deck, [(1.0, 2.0, 3.0)], radius=0.01, velocity=(0.5, 4.0, 1.0))
    scenes.add_boxes(
        deck,
        [(5.0, 2.0, 3.0)],
        size=(0.03, 0.03, 0.01),
        edge_radius=0.004,
        velocity=(0.5, 4.0, 1.0),
        group="alone",
    )
    state = scenes.start(deck)
    scenes.advance(state, 20_000)
    t = 0.2
    fall = np.array([0.5, 4.0, 1.0]) * t + 0.5 * np.array([0.3, -0.2, -9.81]) * t**2
    p = scenes.particles(state)
    for n, start in ((0, (5.0, 2.0, 3.0)), (1, (1.0, 2.0, 3.0))):
        # Verlet is exact for a constant force: rounding of 2e4 additions to lengths of 5 m remains.
        assert p.position[:, n] == pytest.approx(np.array(start) + fall, abs=2e4 * 1e-15)
        assert p.velocity[:, n] == pytest.approx([0.5 + 0.3 * t, 4.0 - 0.2 * t, 1.0 - 9.81 * t], abs=1e-11)


def test_without_gravity_nothing_moves_by_a_bit():
    deck = scenes.case(time_step=1e-5)
    scenes.add_spheres(deck, [(0.1, 0.2, 0.3)], radius=0.01)
    state = scenes.start(deck)
    scenes.advance(state, 1000)
    assert scenes.particles(state).position[:, 0].tolist() == [0.1, 0.2, 0.3]


def test_a_sphere_turns_at_its_constant_rate():
    spin = np.array([3.0, -40.0, 25.0])
    deck = scenes.case(time_step=1e-4)
    scenes.add_spheres(deck, [(0.0, 0.0, 0.0)], radius=0.01, spin=spin)
    state = scenes.start(deck)
    scenes.advance(state, 10_000)
    turned = Rotation.from_quat(scenes.particles(state).orientation[:, 0], scalar_first=True)
    # the rational angle of a step of p rad is p^3 / 12 short: 47 rad in steps of 4.7 mrad
    assert (turned * Rotation.from_rotvec(spin).inv()).magnitude() < 47.3 * 0.00473**2 / 12 * 1.01
    assert scenes.particles(state).angular_velocity[:, 0] == pytest.approx(spin, rel=1e-13)


def spinning_plate(time_step, *, orientation=scenes.UPRIGHT):
    deck = scenes.case(time_step=time_step, duration=100.0)
    deck.add(
        "PARTICLE TYPE",
        name="plate",
        shape="ROUNDED BOX",
        size_x=3.0,
        size_y=2.0,
        size_z=1.0,
        edge_radius=0.1,
        contact_group="alone",
        mass=1.0,
        inertia_x=MOMENTS[0],
        inertia_y=MOMENTS[1],
        inertia_z=MOMENTS[2],
        material="stuff",
    )
    deck.add("CONTACT GROUP", name="alone")
    frame = Rotation.from_quat(orientation, scalar_first=True)
    scenes.add_particles(deck, "plate", [(0.0, 0.0, 0.0)], orientation=orientation, spin=[frame.apply(SPIN)])
    return scenes.start(deck)


def euler_solution(duration):
    """Orientation of the free plate from Euler's equations, by an adaptive method of high order."""

    def slope(_, y):
        w, q = y[:3], y[3:]
        turning = np.array([0.0, *w])
        product = [
            q[0] * turning[0] - q[1:] @ turning[1:],
            *(q[0] * turning[1:] + turning[0] * q[1:] + np.cross(q[1:], turning[1:])),
        ]
        return np.concatenate([-np.cross(w, MOMENTS * w) / MOMENTS, 0.5 * np.array(product)])

    start = np.concatenate([SPIN, scenes.UPRIGHT])
    found = solve_ivp(slope, (0.0, duration), start, method="DOP853", rtol=1e-12, atol=1e-13)
    return Rotation.from_quat(found.y[3:, -1], scalar_first=True)


def test_a_free_body_turns_as_euler_says_with_an_error_of_second_order():
    exact = euler_solution(50.0)
    errors = []
    for steps in (1000, 2000, 4000, 8000):
        state = spinning_plate(50.0 / steps)
        scenes.advance(state, steps)
        turned = Rotation.from_quat(scenes.particles(state).orientation[:, 0], scalar_first=True)
        errors.append((turned * exact.inv()).magnitude())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(2.0, abs=0.1)
    # Not worse than the splitting by exact angles (Miller et al. 2002), 1.87e-4 for this body, spin and step
    assert errors[-1] < 1.87e-4


def test_a_free_body_keeps_its_momentum_its_energy_and_its_unit_quaternion():
    orientation = tuple(Rotation.from_rotvec([0.3, -0.5, 0.8]).as_quat(scalar_first=True))
    state = spinning_plate(0.05, orientation=orientation)
    momentum = scenes.momenta(state)[1]
    energy = scenes.kinetic_energy(state)
    seen = scenes.advance(
        state,
        100_000,
        every=1000,
        probe=lambda s: (
            scenes.kinetic_energy(s) / energy - 1.0,
            np.linalg.norm(scenes.particles(s).orientation[:, 0]) - 1.0,
        ),
    )
    # (h omega)^2 = 2.5e-3 bounds the ripple of a second-order scheme; no trend on top of it
    assert np.abs(seen[:, 0]).max() < 2.5e-3
    assert abs(seen[50:, 0].mean() - seen[:50, 0].mean()) < 2.5e-4
    assert np.abs(seen[:, 1]).max() < 1e-12
    assert scenes.momenta(state)[1] == pytest.approx(momentum, abs=1e-12)


def test_a_symmetric_top_precesses_about_its_momentum():
    deck = scenes.case(time_step=1e-3, duration=100.0)
    scenes.add_boxes(
        deck,
        [(0, 0, 0)],
        size=(0.2, 0.2, 0.05),
        edge_radius=0.01,
        spin=(0.6, 0.0, 2.0),
        name="top",
        group="alone",
    )
    state = scenes.start(deck)
    p = scenes.particles(state)
    across, along = p.inertia[1, 0], p.inertia[2, 0]
    momentum = np.array([across * 0.6, 0.0, along * 2.0])
    rate = np.linalg.norm(momentum) / across
    scenes.advance(state, 2000)
    axis = Rotation.from_quat(p.orientation[:, 0], scalar_first=True).apply([0.0, 0.0, 1.0])
    wanted = Rotation.from_rotvec(2.0 * rate * momentum / np.linalg.norm(momentum)).apply([0.0, 0.0, 1.0])
    assert axis == pytest.approx(wanted, abs=1e-5)  # (h omega)^2 of 4 rad/s over 8 rad


def test_damping_pulls_all_particles_towards_the_reference_velocity():
    deck = scenes.case(time_step=1e-4)
    scenes.add_spheres(deck, [(0, 0, 0)], radius=0.01, velocity=(3.0, 0.0, 1.0))
    deck.add("DAMPING", mass_proportional=2.0, rows={"velocity": [(1.0, 0.0, 0.0)]})
    state = scenes.start(deck)
    scenes.advance(state, 5000)
    left = np.exp(-2.0 * 0.5)
    # lagged velocity: first order, c dt = 2e-4
    assert scenes.particles(state).velocity[:, 0] == pytest.approx([1 + 2 * left, 0, left], rel=4e-4)


def test_loads_on_particles_follow_their_amplitude_and_add_up():
    deck = scenes.case(time_step=1e-3)
    scenes.add_spheres(deck, [(0, 0, 0), (1, 0, 0)], radius=0.05)
    deck.add("AMPLITUDE", name="ramp", rows={"time": [0.1, 0.3], "factor": [0.0, 1.0]})
    zero = (0.0, 0.0, 0.0)
    deck.add(
        "FORCE", amplitude="ramp", rows={"id": [2, 2], "force": [(2, 0, 0), (1, 0, 0)], "torque": [zero] * 2}
    )
    deck.add("FORCE", rows={"id": [2], "force": [zero], "torque": [(0, 0, 0.004)]})
    state = scenes.start(deck)
    scenes.advance(state, 500)
    p = scenes.particles(state)
    # impulse of the ramp: 3 N x (0.2 s / 2 + 0.2 s)
    assert p.velocity[0, 1] * p.mass[1] == pytest.approx(3.0 * 0.3, rel=1e-12)
    assert p.angular_velocity[2, 1] * p.inertia[2, 1] == pytest.approx(0.004 * 0.5, rel=1e-12)
    assert not p.velocity[:, 0].any()


def roller(time_step=1e-3, **case):
    deck = scenes.case(time_step=time_step, **case)
    scenes.add_cylinder(deck, diameter=0.2, length=0.5)
    return deck


def turned_about_y(state):
    """Angle of the first part from its start, about world y."""
    start = Rotation.from_quat(scenes.ALONG_Y, scalar_first=True)
    now = Rotation.from_quat(state.scene.machinery.parts.orientation[:, 0], scalar_first=True)
    return (now * start.inv()).as_rotvec()[1]


def test_a_prescribed_rotation_follows_its_amplitude():
    deck = roller()
    deck.add("AMPLITUDE", name="ramp", rows={"time": [0.1, 0.3, 0.4], "factor": [0.0, 1.0, 0.5]})
    deck.add("MOTION", part="roller", type="ROTATION", angular_velocity=5.0, amplitude="ramp")
    state = scenes.start(deck)
    scenes.advance(state, 600)
    # 5 rad/s x (0.2/2 + 0.1 x 0.75 + 0.2 x 0.5); the middle of the step is exact for a linear rate
    assert turned_about_y(state) == pytest.approx(5.0 * 0.275, rel=1e-12)
    assert state.scene.machinery.parts.angular_velocity[:, 0] == pytest.approx([0.0, 2.5, 0.0], abs=1e-12)


def test_a_drive_torque_speeds_a_roller_up_against_its_bearing():
    deck = roller()
    deck.add("MOTION", part="roller", type="TORQUE", torque=3.0, inertia=0.5, friction_torque=1.0)
    state = scenes.start(deck)
    scenes.advance(state, 500)
    assert state.scene.machinery.parts.angular_velocity[1, 0] == pytest.approx((3.0 - 1.0) / 0.5 * 0.5)
    # A constant acceleration is exact: rounding alone remains.
    assert turned_about_y(state) == pytest.approx(0.5 * 4.0 * 0.5**2, rel=1e-12)


def test_bearing_friction_holds_a_roller_against_a_smaller_torque_and_stops_it_without_turning_back():
    deck = roller()
    deck.add("AMPLITUDE", name="pulse", rows={"time": [0.1, 0.1001], "factor": [1.0, 0.1]})
    deck.add(
        "MOTION",
        part="roller",
        type="TORQUE",
        torque=5.0,
        inertia=0.5,
        friction_torque=1.0,
        amplitude="pulse",
    )
    state = scenes.start(deck)
    rates = scenes.advance(state, 1000, probe=lambda s: s.scene.machinery.parts.angular_velocity[1, 0])
    assert rates[90] > 0.7
    assert (rates >= 0.0).all()
    # 0.8 rad/s, and half a step's kick by the torque that falls within a step, lost at 1 rad/s2
    assert not rates[905:].any()


def test_a_take_up_pulley_accelerates_under_its_force():
    deck = roller(time_step=1e-4)
    deck.add(
        "MOTION", part="roller", type="TENSION", force=40.0, mass=20.0, rows={"vector": [(-3.0, 0.0, 4.0)]}
    )
    state = scenes.start(deck)
    scenes.advance(state, 5000)
    parts = state.scene.machinery.parts
    way = 0.5 * 2.0 * 0.5**2
    assert parts.velocity[:, 0] == pytest.approx([-0.6, 0.0, 0.8], abs=1e-12)
    assert parts.position[:, 0] == pytest.approx([-0.6 * way, 0.0, 0.8 * way], rel=1e-11)


def swung_frame(steps, *, damping=0.0):
    """Place and speed of a frame of 2 kg on 800 N/m, 0.2 s after it is let go at 0.5 m/s."""
    deck = roller(time_step=0.2 / steps, duration=0.2)
    deck.blocks("STEP")[0].parameters["NAME"] = "carry"
    deck.add("STEP", name="swing", duration=0.2, time_step=0.2 / steps)
    along_z = {"vector": [(0.0, 0.0, 0.5)]}
    deck.add("MOTION", part="roller", type="VELOCITY", step="carry", rows=along_z)
    deck.add(
        "MOTION",
        part="roller",
        type="SUSPENSION",
        stiffness=800.0,
        mass=2.0,
        damping=damping,
        step="swing",
        rows=along_z,
    )
    state = scenes.start(deck)
    scenes.advance(state, steps)
    scenes.next_step(state, 1)
    scenes.advance(state, steps)
    parts = state.scene.machinery.parts
    return np.array([parts.position[2, 0] - 0.1, parts.velocity[2, 0]])


@pytest.mark.parametrize("damping", [0.0, 24.0, 4000.0], ids=["undamped", "damped", "creeping"])
def test_a_sprung_frame_swings_as_its_closed_form_with_an_error_of_second_order(damping):
    decay, frequency = damping / 4.0, np.sqrt(complex(400.0 - (damping / 4.0) ** 2))
    exact = 0.5 * np.exp(-decay * 0.2) * np.sin(frequency * 0.2) / frequency
    speed = 0.5 * np.exp(-decay * 0.2) * np.cos(frequency * 0.2) - decay * exact
    errors = [
        np.abs(swung_frame(steps, damping=damping) - [exact.real, speed.real]) for steps in (200, 400, 800)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(2.0, abs=0.1)


def test_a_velocity_follows_its_amplitude():
    deck = scenes.case(time_step=1e-3)
    deck.add("AMPLITUDE", name="ramp", rows={"time": [0.1, 0.3], "factor": [0.0, 2.0]})
    scenes.add_cylinder(deck, diameter=0.1, length=0.5)
    scenes.add_spheres(deck, [(0.0, 0.0, 5.0)], radius=0.01, name="clamp")
    vector = (0.3, 0.0, -0.4, 0.0, 5.0, 0.0)
    for what in ({"part": "roller"}, {"particle_type": "clamp"}):
        deck.add("MOTION", **what, type="VELOCITY", amplitude="ramp", rows={"vector": [vector]})
    state = scenes.start(deck)
    p, parts = scenes.particles(state), state.scene.machinery.parts
    assert not parts.velocity.any()
    assert not p.velocity.any()
    scenes.advance(state, 200)
    assert p.velocity[:, 0] == pytest.approx([0.3, 0.0, -0.4], abs=1e-13)
    assert parts.velocity[:, 0] == pytest.approx([0.3, 0.0, -0.4], abs=1e-13)
    assert parts.angular_velocity[:, 0] == pytest.approx([0.0, 5.0, 0.0], abs=1e-12)
    scenes.advance(state, 300)
    # the integral of the ramp: 0.2 s x 2 / 2 + 0.2 s x 2; the middle of the step is exact for a linear rate
    way = 0.6 * np.array([0.3, 0.0, -0.4])
    assert parts.position[:, 0] == pytest.approx(way, abs=1e-13)
    assert p.position[:, 0] == pytest.approx([*way[:2], way[2] + 5.0], abs=1e-13)
    assert turned_about_y(state) == pytest.approx(3.0, rel=1e-12)
    turned = Rotation.from_quat(p.orientation[:, 0], scalar_first=True).as_rotvec()
    assert turned == pytest.approx([0.0, 3.0, 0.0], abs=1e-12)


def test_a_sphere_on_a_belt_that_speeds_up_rolls_at_two_sevenths_of_its_acceleration():
    deck = scenes.case(time_step=2e-5, gravity=(0.0, 0.0, -9.81), friction=0.8, restitution=0.5)
    radius = 0.01
    modulus = scenes.SOFT["youngs_modulus"] / (2 * (1 - scenes.SOFT["poisson_ratio"] ** 2))
    weight = scenes.SOFT["density"] * 4 / 3 * np.pi * radius**3 * 9.81
    overlap = (3 * weight / (4 * modulus * radius**0.5)) ** (2 / 3)
    scenes.add_spheres(deck, [(0.0, 0.0, radius - overlap)], radius=radius)
    scenes.add_plane(deck)
    deck.add("AMPLITUDE", name="ramp", rows={"time": [0.0, 1.0], "factor": [0.0, 1.0]})
    rows = {"vector": [(3.0, 0.0, 0.0)]}
    deck.add("MOTION", part="floor", type="SURFACE VELOCITY", amplitude="ramp", rows=rows)
    state = scenes.start(deck)
    scenes.advance(state, 10_000)
    # The friction spring of 60 N/m stretches by 1e-5 m first: (0.2 s x 3 m/s2) 2/7 but for its swing of 1e-3
    assert scenes.particles(state).velocity[0, 0] == pytest.approx(2 / 7 * 3.0 * 0.2, rel=5e-3)
    assert state.scene.machinery.parts.velocity[0, 0] == pytest.approx(0.6, rel=1e-12)
    assert not state.scene.machinery.parts.position[:, 0].any()


def test_a_sprung_frame_swings_at_its_frequency_and_comes_back():
    deck = roller(time_step=1e-4, duration=10.0)
    scenes.add_spheres(deck, [(0.0, 0.0, 0.1 + 0.0199)], radius=0.02, velocity=(0.0, 0.0, -0.5))
    deck.add(
        "MOTION",
        part="roller",
        type="SUSPENSION",
        stiffness=800.0,
        mass=2.0,
        rows={"vector": [(0.0, 0.0, 1.0)]},
    )
    state = scenes.start(deck)
    scenes.advance(state, 500)
    seen = scenes.advance(state, 20_000, probe=lambda s: s.scene.machinery.parts.position[2, 0])
    crossings = np.flatnonzero((seen[:-1] < 0.0) & (seen[1:] >= 0.0))
    assert len(crossings) > 4
    period = np.diff(crossings).mean() * 1e-4
    assert period == pytest.approx(2 * np.pi * np.sqrt(2.0 / 800.0), rel=1e-3)
    assert np.ptp(seen[:3200]) == pytest.approx(np.ptp(seen[-3200:]), rel=1e-3)


def test_a_sprung_frame_sinks_under_a_weight_by_its_stiffness():
    deck = roller(time_step=2e-5, gravity=(0.0, 0.0, -9.81), duration=10.0, restitution=0.2)
    scenes.add_spheres(deck, [(0.0, 0.0, 0.12)], radius=0.02)
    deck.add(
        "MOTION",
        part="roller",
        type="SUSPENSION",
        stiffness=800.0,
        mass=0.2,
        damping=25.0,
        rows={"vector": [(0.0, 0.0, 1.0)]},
    )
    state = scenes.start(deck)
    scenes.advance(state, 50_000)
    weight = scenes.particles(state).mass[0] * 9.81
    assert state.scene.machinery.parts.position[2, 0] == pytest.approx(-weight / 800.0, rel=1e-6)
    assert state.scene.machinery.parts.force[2, 0] == pytest.approx(-weight, rel=1e-6)


def test_parts_and_particles_with_a_velocity_keep_it_whatever_they_push():
    deck = scenes.case(time_step=1e-5, friction=0.3)
    scenes.add_cylinder(deck, diameter=0.02, length=0.1, point=(-0.05, 0.0, 0.0))
    deck.add("MOTION", part="roller", type="VELOCITY", rows={"vector": [(1.0, 0.0, 0.0, 0.0, 0.0, 0.0)]})
    scenes.add_spheres(deck, [(0.0, 0.0, 0.0)], radius=0.01)
    scenes.add_spheres(deck, [(0.03, 0.0, 0.2)], radius=0.01, name="clamp")
    deck.add(
        "MOTION", particle_type="clamp", type="VELOCITY", rows={"vector": [(0.0, 0.0, -2.0, 1.0, 0.0, 0.0)]}
    )
    state = scenes.start(deck)
    scenes.advance(state, 20_000)
    p, parts = scenes.particles(state), state.scene.machinery.parts
    ball, clamp = scenes.slot(state, 1), scenes.slot(state, 2)
    assert parts.position[:, 0] == pytest.approx([0.15, 0.0, 0.0], abs=1e-12)
    assert p.velocity[:, clamp].tolist() == [0.0, 0.0, -2.0]
    assert p.angular_velocity[:, clamp].tolist() == [1.0, 0.0, 0.0]
    assert p.position[:, clamp] == pytest.approx([0.03, 0.0, -0.2], abs=1e-10)
    assert p.velocity[0, ball] > 1.0


def test_a_swinging_arm_finds_what_lies_in_its_way():
    """A long cylinder turned about its middle, across its axis: its end is far faster than its centre."""
    deck = scenes.case(time_step=1e-5)
    scenes.add_cylinder(deck, diameter=0.02, length=1.0, orientation=scenes.ALONG_X)
    deck.add("MOTION", part="roller", type="VELOCITY", rows={"vector": [(0.0, 0.0, 0.0, 0.0, 0.0, 4.0)]})
    scenes.add_spheres(deck, [(0.45, 0.05, 0.0)], radius=0.01)
    state = scenes.start(deck)
    scenes.advance(state, 8000)
    # e = 1 on a far heavier arm: twice the arm's speed at that radius
    assert np.linalg.norm(scenes.particles(state).velocity[:, 0]) == pytest.approx(2 * 4.0 * 0.45, rel=0.02)


def test_a_motion_of_one_step_ends_with_it():
    deck = scenes.case(time_step=1e-3, duration=0.1)
    deck.blocks("STEP")[0].parameters["NAME"] = "one"
    deck.add("STEP", name="two", duration=0.1, time_step=1e-3)
    for n, name in enumerate(("turning", "stopped", "moving")):
        scenes.add_cylinder(deck, name=name, diameter=0.1, length=0.1, point=(n, 0.0, 0.0))
    deck.add("MOTION", part="turning", type="ROTATION", angular_velocity=5.0, step="one")
    deck.add("MOTION", part="stopped", type="ROTATION", angular_velocity=5.0, step="one")
    deck.add("MOTION", part="stopped", type="ROTATION", angular_velocity=0.0, step="two")
    deck.add("MOTION", part="moving", type="VELOCITY", step="one", rows={"vector": [(1.0, 0.0, 0.0)]})
    state = scenes.start(deck)
    scenes.advance(state, 100)
    parts = state.scene.machinery.parts
    assert parts.position[0, 2] == pytest.approx(2.1)
    scenes.next_step(state, 1)
    scenes.advance(state, 100)
    assert not parts.angular_velocity.any()
    assert not parts.velocity.any()
    assert parts.position[0, 2] == pytest.approx(2.1)


def test_a_fixed_particle_stays_where_it_is():
    deck = scenes.case(time_step=1e-4, gravity=(0.0, 0.0, -9.81))
    moving = {"velocity": (1.0, 0.0, 0.0), "spin": (0.0, 0.0, 5.0)}  # which a fixed particle does not follow
    scenes.add_spheres(deck, [(0.0, 0.0, 0.0)], radius=0.01, fixed="YES", **moving)
    scenes.add_spheres(deck, [(0.0, 0.0, 0.0199)], radius=0.01, name="falling")
    state = scenes.start(deck)
    scenes.advance(state, 1000)
    held = scenes.slot(state, 1)
    assert not scenes.particles(state).position[:, held].any()
    assert not scenes.particles(state).velocity[:, held].any()
    assert scenes.particles(state).orientation[:, held].tolist() == [1.0, 0.0, 0.0, 0.0]


def test_free_rollers_turn_on_through_the_next_step():
    deck = scenes.case(time_step=1e-3, duration=0.1)
    deck.blocks("STEP")[0].parameters["NAME"] = "one"
    deck.add("STEP", name="two", duration=0.1, time_step=1e-3)
    scenes.add_cylinder(deck, diameter=0.1, length=0.1)
    deck.add("MOTION", part="roller", type="TORQUE", torque=1.0, inertia=0.1, step="one")
    deck.add("MOTION", part="roller", type="FREE ROTATION", inertia=0.1, step="two")
    state = scenes.start(deck)
    scenes.advance(state, 100)
    scenes.next_step(state, 1)
    scenes.advance(state, 100)
    assert state.scene.machinery.parts.angular_velocity[1, 0] == pytest.approx(1.0)
