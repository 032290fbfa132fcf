"""Spheres and boxes that rest, roll and slide: on planes, on a belt of boxes, on cylinders."""

import itertools

import numpy as np
import pytest
import scenes

from beltsim.engine import renew_lists
from beltsim.solver.belt_surface import SHARPNESS

G = 9.81
DOWN = (0.0, 0.0, -G)
RADIUS = 0.05
MASS = 1200.0 * 4.0 / 3.0 * np.pi * RADIUS**3
MODULUS = 5.0e6 / (1.0 - 0.3**2)  # of scenes.SOFT against something rigid
RIGID = {"density": 1000.0, "youngs_modulus": 1e25, "poisson_ratio": 0.3}
MATERIALS = {"stuff": scenes.SOFT, "rigid": RIGID}


def static_overlap(weight, radius=RADIUS, modulus=MODULUS):
    """Hertz overlap of a sphere that carries a weight on a plane."""
    return (3.0 * weight / (4.0 * modulus * np.sqrt(radius))) ** (2.0 / 3.0)


def lying_sphere(*, angle=0.0, velocity=None, rolling=0.0, friction=0.3, surface=None, time_step=5e-5):
    """A sphere at its static overlap on a rigid plane, seen in the axes of the plane that falls towards +x."""
    gravity = (G * np.sin(angle), 0.0, -G * np.cos(angle))
    deck = scenes.case(
        time_step=time_step,
        gravity=gravity,
        materials=MATERIALS,
        friction=friction,
        restitution=0.5,
        rolling=rolling,
        duration=10.0,
    )
    height = RADIUS - static_overlap(MASS * G * np.cos(angle))
    scenes.add_spheres(deck, [(0.0, 0.0, height)], radius=RADIUS, velocity=velocity)
    scenes.add_plane(deck, material="rigid")
    if surface is not None:
        deck.add("MOTION", part="floor", type="SURFACE VELOCITY", rows={"vector": [surface]})
    return scenes.start(deck)


def ball(state):
    """Position, velocity and angular velocity of the first free sphere."""
    p, n = scenes.particles(state), scenes.slot(state, 1)
    return p.position[:, n].copy(), p.velocity[:, n].copy(), p.angular_velocity[:, n].copy()


def test_a_thrown_sphere_slides_and_then_rolls_at_five_sevenths_of_its_speed():
    state = lying_sphere(velocity=(1.0, 0.0, 0.0))
    until = 2.0 / (7.0 * 0.3 * G)
    scenes.advance(state, round(until / 5e-5))
    place, velocity, _ = ball(state)
    assert place[0] == pytest.approx(12.0 / (49.0 * 0.3 * G), rel=2e-3)
    assert velocity[0] == pytest.approx(5.0 / 7.0, rel=2e-3)
    scenes.advance(state, 4000)
    _, velocity, spin = ball(state)
    assert velocity[0] == pytest.approx(5.0 / 7.0, rel=1e-3)
    assert spin[1] * RADIUS == pytest.approx(5.0 / 7.0, rel=1e-3)
    # rolling without resistance goes on
    scenes.advance(state, 10_000)
    assert ball(state)[1][0] == pytest.approx(velocity[0], rel=1e-6)


def test_a_sphere_laid_on_a_running_belt_reaches_two_sevenths_of_its_speed():
    state = lying_sphere(surface=(1.4, -0.7, 0.0))
    scenes.advance(state, 8000)
    _, velocity, spin = ball(state)
    assert velocity[:2] == pytest.approx([0.4, -0.2], rel=1e-3)
    # surface speed less its own: it turns against the belt
    assert np.cross(spin, (0.0, 0.0, -RADIUS))[:2] == pytest.approx([1.0, -0.5], rel=1e-3)


@pytest.mark.parametrize("share", [0.5, 0.98, 1.02, 3.0])
def test_a_sphere_on_an_incline_rolls_or_slips_as_its_friction_allows(share):
    angle = np.radians(30.0)
    friction = share * 2.0 / 7.0 * np.tan(angle)
    state = lying_sphere(angle=angle, friction=friction)
    scenes.advance(state, 4000)
    _, first, spin_first = ball(state)
    scenes.advance(state, 8000)
    _, second, spin_second = ball(state)
    if share > 1.0:
        acceleration = 5.0 / 7.0 * G * np.sin(angle)
        turning = acceleration / RADIUS
    else:
        acceleration = G * (np.sin(angle) - friction * np.cos(angle))
        turning = 2.5 * friction * G * np.cos(angle) / RADIUS
    assert (second - first)[0] / 0.4 == pytest.approx(acceleration, rel=1e-3)
    assert (spin_second - spin_first)[1] / 0.4 == pytest.approx(turning, rel=2e-3)


def test_rolling_resistance_slows_a_rolling_sphere():
    state = lying_sphere(velocity=(1.0, 0.0, 0.0), rolling=0.05)
    scenes.advance(state, 4000)
    _, first, _ = ball(state)
    scenes.advance(state, 4000)
    # torque r_r R N against (m R^2 + I) = 7/5 m R^2
    assert (ball(state)[1] - first)[0] / 0.2 == pytest.approx(-5.0 / 7.0 * 0.05 * G, rel=5e-3)


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_rolling_resistance_holds_a_sphere_on_an_incline_below_its_limit(share):
    angle = np.radians(5.0)
    resistance = share * np.tan(angle)
    state = lying_sphere(angle=angle, friction=0.8, rolling=resistance)
    scenes.advance(state, 20_000)
    first = ball(state)
    places = scenes.advance(state, 20_000, every=10, probe=lambda s: ball(s)[0][0])
    second = ball(state)
    if share > 1.0:
        # The rocking, some 6 rad/s at 0.3 of critical, falls by exp(-3.6) between the halves.
        assert np.ptp(places[1000:]) < 0.05 * np.ptp(places[:1000])
        assert np.ptp(places[1000:]) < 1e-3 * RADIUS
    else:
        acceleration = 5.0 / 7.0 * G * (np.sin(angle) - resistance * np.cos(angle))
        assert second[1][0] - first[1][0] == pytest.approx(acceleration, rel=5e-3)


@pytest.mark.parametrize("linear", [False, True])
def test_a_sphere_rocks_on_its_rolling_spring_and_damper(linear):
    """Two degrees of freedom, rolling and slipping on the tangential spring: the slow pair of eigenvalues."""
    resistance, damping, step = 0.1, 0.1, 5e-5
    weight, springs = MASS * G, {"normal_stiffness": 1e4, "tangential_stiffness": 8e3}
    deck = scenes.case(
        time_step=step,
        gravity=DOWN,
        materials=MATERIALS,
        friction=0.8,
        rolling=resistance,
        rolling_damping=damping,
        duration=10.0,
        **(springs if linear else {}),
    )
    if linear:
        deck.add("CONTACT MODEL", type="LINEAR")
        k_n, k_t = springs.values()
        overlap = weight / k_n
    else:
        overlap = static_overlap(weight)
        k_n = 2.0 * MODULUS * np.sqrt(RADIUS * overlap)
        k_t = 2.0 * (1.0 - 0.3) / (2.0 - 0.3) * k_n
    spin = 1e-4
    scenes.add_spheres(
        deck,
        [(0.0, 0.0, RADIUS - overlap)],
        radius=RADIUS,
        velocity=(spin * RADIUS, 0.0, 0.0),
        spin=(0.0, spin, 0.0),
    )
    scenes.add_plane(deck, material="rigid")
    inertia = 0.4 * MASS * RADIUS**2
    k_r = 2.25 * k_n * (resistance * RADIUS) ** 2
    c_r = 2.0 * damping * np.sqrt(1.4 * MASS * RADIUS**2 * k_r)
    motion = [
        [0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
        [-k_t / MASS, k_t * RADIUS / MASS, 0.0, 0.0],
        [k_t * RADIUS / inertia, -(k_t * RADIUS**2 + k_r) / inertia, 0.0, -c_r / inertia],
    ]
    values = np.linalg.eigvals(motion)
    slow = values[np.argmin(np.abs(values))]
    assert abs(slow.real / abs(slow)) == pytest.approx(damping, rel=0.1)  # what the keyword says

    state = scenes.start(deck)
    half = np.pi / abs(slow.imag)
    spins = scenes.advance(state, round(8 * half / step), every=1, probe=lambda s: ball(s)[2][1])
    falls = np.flatnonzero(np.diff(np.sign(spins)))
    share = spins[falls] / (spins[falls] - spins[falls + 1])
    crossings = (falls + share) * step
    # First order in the step with damping: relative dt |w| = 3e-3 at most.
    assert np.diff(crossings)[1:].mean() == pytest.approx(half, rel=3e-3)
    peaks = [np.abs(spins[a:b]).max() for a, b in itertools.pairwise(falls[1:])]
    decrement = np.log(peaks[0] / peaks[-1]) / (len(peaks) - 1)
    assert decrement == pytest.approx(-slow.real * half, rel=1e-2)


def test_a_heap_comes_to_rest():
    """Rocking dies out; what may stay is the spin of single spheres about the plane's normal, which nothing resists."""
    deck = scenes.case(
        time_step=5e-5,
        gravity=DOWN,
        materials=MATERIALS,
        friction=0.5,
        restitution=0.3,
        rolling=0.1,
        duration=100.0,
    )
    rng = np.random.default_rng(5)
    places = np.indices((3, 3, 6)).reshape(3, -1).T * 2.1 * RADIUS
    places[:, :2] += rng.uniform(-0.04, 0.04, (len(places), 2)) * RADIUS
    scenes.add_spheres(deck, places + np.array([0.0, 0.0, RADIUS]), radius=RADIUS)
    scenes.add_plane(deck, material="rigid")
    state = scenes.start(deck)
    scenes.advance(state, 140_000)
    p = scenes.particles(state)
    assert p.position[2].max() > 1.5 * RADIUS  # still a heap
    rolling = np.sum(p.angular_momentum[:2] * p.angular_velocity[:2], axis=0)
    energy = 0.5 * np.sum(p.mass * np.sum(p.velocity**2, axis=0) + rolling)
    assert energy < 1e-12 * MASS * G * RADIUS


def test_a_column_of_spheres_carries_its_weight():
    count = 5
    deck = scenes.case(
        time_step=5e-5, gravity=DOWN, materials=MATERIALS, friction=0.3, restitution=0.3, duration=10.0
    )
    heights = RADIUS * (1 + 2 * np.arange(count))
    scenes.add_spheres(deck, [(0.0, 0.0, z) for z in heights], radius=RADIUS)
    scenes.add_plane(deck, material="rigid")
    deck.add("DAMPING", mass_proportional=30.0)
    state = scenes.start(deck)
    scenes.advance(state, 60_000)
    carried = MASS * G * np.arange(count, 0, -1)
    overlaps = np.append(
        static_overlap(carried[:1]), static_overlap(carried[1:], radius=RADIUS / 2, modulus=MODULUS / 2)
    )
    found = heights - scenes.particles(state).position[2]
    assert np.diff(found, prepend=0.0) == pytest.approx(overlaps, rel=1e-8)
    assert scenes.kinetic_energy(state) < 1e-12 * MASS * G * RADIUS
    assert state.scene.machinery.parts.force[2, 0] == pytest.approx(-count * MASS * G, rel=1e-8)


def test_a_bouncing_sphere_loses_height_by_the_square_of_its_restitution():
    deck = scenes.case(
        time_step=1e-6,
        gravity=DOWN,
        materials={"stuff": {**scenes.SOFT, "youngs_modulus": 1e11}, "rigid": RIGID},
        restitution=0.7,
        duration=10.0,
    )
    scenes.add_spheres(deck, [(0.0, 0.0, 0.1 + RADIUS)], radius=RADIUS)
    scenes.add_plane(deck, material="rigid")
    state = scenes.start(deck)
    height = scenes.advance(state, 640_000, every=200, probe=lambda s: ball(s)[0][2] - RADIUS)
    inside = np.flatnonzero((height[1:-1] > height[:-2]) & (height[1:-1] >= height[2:])) + 1
    peaks = height[inside][:3]
    # Gravity works along the overlap too: 0.06 mm, 0.5 % of the third height.
    assert peaks == pytest.approx(0.1 * 0.7 ** (2.0 * np.arange(1, 4)), rel=0.01)


def lying_block(share):
    """A block on a rigid plane at 20 degrees, its friction a share of what holds it; seen in the plane's axes."""
    angle = np.radians(20.0)
    friction = share * np.tan(angle)
    deck = scenes.case(
        time_step=5e-5,
        gravity=(G * np.sin(angle), 0.0, -G * np.cos(angle)),
        materials=MATERIALS,
        friction=friction,
        restitution=0.3,
        duration=10.0,
    )
    scenes.add_boxes(deck, [(0.0, 0.0, 0.01)], size=(0.06, 0.06, 0.02), edge_radius=0.004, group="alone")
    scenes.add_plane(deck, material="rigid")
    return scenes.start(deck), G * (np.sin(angle) - friction * np.cos(angle))


def test_a_block_on_an_incline_sticks_just_above_its_friction_angle_and_creeps_by_nothing():
    state, _ = lying_block(1.02)
    scenes.advance(state, 40_000)
    first = ball(state)[0]
    scenes.advance(state, 20_000)
    assert np.linalg.norm(ball(state)[0] - first) < 1e-6 * 0.06


def test_a_block_on_an_incline_slides_just_below_its_friction_angle():
    state, acceleration = lying_block(0.98)
    scenes.advance(state, 10_000)
    first = ball(state)[1]
    scenes.advance(state, 10_000)
    assert (ball(state)[1] - first)[0] / 0.5 == pytest.approx(acceleration, rel=0.01)


# A belt of boxes under a sphere


PITCH = 0.02
TOP = 0.005


def sphere_on_belt(velocity, *, start=(0.05, 0.03), force=None, friction=0.6, belt=None, rolling=0.0):
    """A sphere at its static overlap on a flat belt of held boxes; rolls at `velocity` if that is not zero."""
    radius = 0.015
    mass = 1200.0 * 4.0 / 3.0 * np.pi * radius**3
    deck = scenes.case(
        time_step=2e-5,
        gravity=DOWN,
        materials=MATERIALS,
        friction=friction,
        restitution=0.5,
        rolling=rolling,
        duration=10.0,
    )
    height = TOP + radius - static_overlap(mass * G, radius)
    spin = np.cross((0.0, 0.0, 1.0), velocity) / radius
    ids = scenes.add_spheres(deck, [(*start, height)], radius=radius, velocity=velocity, spin=spin)
    scenes.add_grid(deck, 12, 6, pitch=PITCH, material="rigid")
    if force is not None:
        deck.add("FORCE", rows={"id": ids, "force": [force], "torque": [(0.0, 0.0, 0.0)]})
    if belt is not None:
        deck.add("MOTION", particle_type="box", type="VELOCITY", rows={"vector": [belt]})
    return scenes.start(deck), mass


def contact_load(state, mass, given=(0.0, 0.0, 0.0)):
    """Force of the belt on the sphere."""
    n = scenes.slot(state, 1)
    return scenes.particles(state).force[:, n] - mass * np.array(DOWN) - np.array(given)


@pytest.mark.parametrize(
    "velocity",
    [(0.5, 0.0, 0.0), (0.0, 0.15, 0.0), (0.4, 0.13, 0.0), (0.02, 0.003, 0.0)],
    ids=["along", "across", "oblique", "slow"],
)
@pytest.mark.parametrize("start", [(0.05, 0.03), (0.0507, 0.0222)], ids=["on seams", "anywhere"])
def test_a_sphere_that_rolls_over_a_flat_belt_feels_no_seam(velocity, start):
    state, mass = sphere_on_belt(velocity, start=start)
    loads = scenes.advance(state, 12_000, every=5, probe=lambda s: contact_load(s, mass))
    assert np.abs(loads[:, 2] / (mass * G) - 1.0).max() < 0.02
    # free rolling needs no friction, at the seams neither
    assert np.abs(loads[:, :2]).max() < 0.02 * mass * G
    # Where two or four boxes carry, the surface is higher by ln(4) / 256 of the overlap at most.
    climb = 10.0 / 7.0 * G * np.log(4.0) / SHARPNESS * static_overlap(mass * G, 0.015)
    change = ball(state)[1][:2] ** 2 - np.square(velocity[:2])
    assert np.abs(change).max() < 4e-3 * np.dot(velocity, velocity) + climb


def test_friction_is_handed_on_at_the_seams():
    """A rolling sphere that is pulled: its friction, 2/7 of the pull, is a spring that must survive each seam."""
    pull = 0.05
    state, mass = sphere_on_belt((0.3, 0.0, 0.0), force=(pull, 0.0, 0.0))
    scenes.advance(state, 1000)
    loads = scenes.advance(state, 12_000, every=5, probe=lambda s: contact_load(s, mass, (pull, 0.0, 0.0)))
    assert ball(state)[0][0] > 0.05 + 4 * PITCH
    assert loads[:, 0] == pytest.approx(-2.0 / 7.0 * pull, rel=0.02)


def test_a_sphere_laid_on_a_running_belt_of_boxes_reaches_two_sevenths_of_its_speed():
    state, _ = sphere_on_belt((0.0, 0.0, 0.0), start=(0.18, 0.03), belt=(0.35, 0.0, 0.0), friction=0.3)
    scenes.advance(state, 15_000)
    assert ball(state)[1][0] == pytest.approx(0.1, rel=2e-3)


def test_a_sphere_at_rest_on_a_corner_of_four_boxes_stays():
    state, mass = sphere_on_belt((0.0, 0.0, 0.0), start=(2.5 * PITCH, 1.5 * PITCH), rolling=0.01)
    first = ball(state)[0]
    scenes.advance(state, 20_000)
    start = ball(state)[0]
    assert np.linalg.norm((start - first)[:2]) < 1e-6 * 0.015
    # Four boxes that share press harder than one: it rises by ln(4) / 256 of its overlap, and by 2/3 of that again.
    lift = 5.0 / 3.0 * np.log(4.0) / SHARPNESS * static_overlap(mass * G, 0.015)
    assert (start - first)[2] == pytest.approx(lift, rel=0.02)
    scenes.advance(state, 20_000)
    assert np.linalg.norm(ball(state)[0] - start) < 1e-6 * 0.015
    assert contact_load(state, mass)[2] == pytest.approx(mass * G, rel=1e-6)


@pytest.mark.parametrize("torn", [False, True])
def test_a_sphere_in_a_gap_lies_on_both_sides_once_their_bonds_are_broken(torn):
    """Two rows of a belt drawn 4 mm apart: one surface while they are bonded, two boxes that share the load if not."""
    gap, overlap, radius = 0.004, 1e-4, 0.015
    deck = scenes.case(time_step=1e-6, materials=MATERIALS, friction=0.0)
    scenes.add_spheres(deck, [(0.01, 0.0, 0.1)], radius=radius, fixed="YES")
    scenes.add_grid(deck, 2, 1, pitch=0.02, material="rigid")
    state = scenes.start(deck)
    p = scenes.particles(state)
    sphere, left, right = (scenes.slot(state, number) for number in (1, 2, 3))
    p.position[0, left] -= 0.5 * gap
    p.position[0, right] += 0.5 * gap
    # The flats end at the gap, 1 mm above and below the middle; the edges' radius is 4 mm.
    reach = radius + 0.004 - overlap
    height = np.sqrt(reach**2 - (0.5 * gap) ** 2)
    p.position[:, sphere] = (0.01, 0.0, 0.001 + height)
    if torn:
        state.scene.bonds.intact[:] = 0
    renew_lists(state)
    scenes.advance(state, 1)
    force = p.force[:, sphere]
    single = 4.0 / 3.0 * MODULUS * np.sqrt(radius) * overlap**1.5
    if torn:
        # 1e-9: rounding of an overlap of 1e-4 m between places of 0.02 m
        assert force == pytest.approx((0.0, 0.0, 2.0 * single * height / reach), abs=1e-9 * single)
    else:
        # Both share one force along their own normals; the surface is 2^(1/p) deeper, and the shares sum up to as much.
        shared = single * 2.0 ** (2.5 / SHARPNESS)
        assert force == pytest.approx((0.0, 0.0, shared * height / reach), abs=1e-9 * single)


# Boxes on cylinders


def held_box_on_roller(
    *, friction=0.35, restitution=0.5, overlap=1e-5, velocity=None, length=1.0, tilt=scenes.UPRIGHT, **motion
):
    """A long flat box held on top of a roller at an overlap."""
    deck = scenes.case(
        time_step=1e-4, materials=MATERIALS, friction=friction, restitution=restitution, duration=10.0
    )
    scenes.add_boxes(
        deck,
        [(0.0, 0.0, 0.1 + 0.005 - overlap)],
        size=(length, 0.028, 0.01),
        edge_radius=0.004,
        group="belt",
        fixed="YES",
        orientation=tilt,
    )
    scenes.add_cylinder(deck, diameter=0.2, length=0.3, material="rigid")
    if motion:
        deck.add("MOTION", part="roller", **motion)
    if velocity is not None:
        deck.add("MOTION", particle_type="box", type="VELOCITY", rows={"vector": [velocity]})
    return scenes.start(deck)


LINE = np.pi / 4.0 * MODULUS * 0.02 * 1e-5  # pi/4 E* l d


def test_a_flat_box_presses_a_roller_with_a_force_in_proportion_to_overlap_and_length():
    force = held_box_on_roller().scene.machinery.parts.force[:, 0]
    assert force == pytest.approx([0.0, 0.0, -LINE], abs=1e-9 * LINE)


def test_a_slipping_roller_feels_friction_times_the_normal_force_times_its_radius():
    # Undamped: the place of the line is known to 1e-11 m only, a difference of radii over the overlap, and a roller
    # that turns there approaches so fast that damping adds 2e-9 of the force.
    state = held_box_on_roller(type="ROTATION", angular_velocity=4.0, restitution=1.0)
    scenes.advance(state, 2000)
    parts = state.scene.machinery.parts
    assert parts.torque[:, 0] == pytest.approx([0.0, -0.35 * LINE * 0.1, 0.0], rel=1e-9, abs=1e-12)
    assert parts.force[0, 0] == pytest.approx(-0.35 * LINE, rel=1e-9)


def test_a_belt_spins_a_free_roller_up_to_its_speed():
    inertia, speed = 2e-3, 0.3
    state = held_box_on_roller(velocity=(speed, 0.0, 0.0), type="FREE ROTATION", inertia=inertia)
    rates = scenes.advance(state, 12_000, probe=lambda s: s.scene.machinery.parts.angular_velocity[1, 0])
    slipping = 0.35 * LINE * 0.1 / inertia
    until = speed / 0.1 / slipping
    early = round(0.5 * until / 1e-4)
    assert rates[early - 1] == pytest.approx(slipping * early * 1e-4, rel=2e-3)
    assert rates[-1] == pytest.approx(speed / 0.1, rel=1e-3)


def test_bearing_friction_below_the_grip_does_not_keep_a_roller_from_turning_with_the_belt():
    state = held_box_on_roller(
        velocity=(0.3, 0.0, 0.0), type="FREE ROTATION", inertia=2e-4, friction_torque=0.5 * 0.35 * LINE * 0.1
    )
    scenes.advance(state, 10_000)
    assert state.scene.machinery.parts.angular_velocity[1, 0] == pytest.approx(3.0, rel=1e-3)
    assert state.scene.machinery.parts.torque[1, 0] == pytest.approx(0.5 * 0.35 * LINE * 0.1, rel=1e-2)


def test_a_free_box_rests_on_two_rollers():
    deck = scenes.case(
        time_step=2e-5, gravity=DOWN, materials=MATERIALS, friction=0.4, restitution=0.3, duration=10.0
    )
    scenes.add_boxes(deck, [(0.0, 0.0, 0.105)], size=(0.4, 0.108, 0.01), edge_radius=0.004, group="belt")
    for name, x in (("left", -0.15), ("right", 0.1)):
        scenes.add_cylinder(deck, name=name, diameter=0.2, length=0.3, point=(x, 0.0, 0.0), material="rigid")
    deck.add("DAMPING", mass_proportional=30.0)
    state = scenes.start(deck)
    scenes.advance(state, 50_000)
    p, parts = scenes.particles(state), state.scene.machinery.parts
    weight = p.mass[0] * G
    # levers of 0.15 and 0.1 m
    assert parts.force[2] == pytest.approx([-0.4 * weight, -0.6 * weight], rel=1e-4)
    assert scenes.kinetic_energy(state) < 1e-12 * weight * 0.1


def test_a_box_comes_to_rest_on_the_flat_end_of_a_cylinder():
    deck = scenes.case(
        time_step=2e-5, gravity=DOWN, materials=MATERIALS, friction=0.4, restitution=0.3, duration=10.0
    )
    scenes.add_boxes(deck, [(0.02, 0.01, 0.106)], size=(0.05, 0.05, 0.01), edge_radius=0.004, group="belt")
    scenes.add_cylinder(deck, diameter=0.3, length=0.2, orientation=scenes.UPRIGHT, material="rigid")
    state = scenes.start(deck)
    scenes.advance(state, 25_000)
    p = scenes.particles(state)
    assert state.scene.machinery.parts.force[2, 0] == pytest.approx(-p.mass[0] * G, rel=1e-3)
    # on its core: 1 mm thick about its middle
    assert p.position[:, 0] == pytest.approx([0.02, 0.01, 0.101], abs=2e-5)
    assert np.linalg.norm(p.velocity) < 1e-3


def test_momentum_goes_from_an_oblique_sphere_into_a_free_box_and_none_is_lost():
    deck = scenes.case(time_step=1e-5, friction=0.4, restitution=0.6)
    scenes.add_boxes(deck, [(0.0, 0.0, 0.0)], size=(0.1, 0.06, 0.02), edge_radius=0.004, group="belt")
    scenes.add_spheres(
        deck, [(0.03, 0.02, 0.0301)], radius=0.02, velocity=(0.5, 0.2, -1.0), spin=(5.0, 30.0, -10.0)
    )
    state = scenes.start(deck)
    before, turning = scenes.momenta(state)
    scenes.advance(state, 4000)
    after, turned = scenes.momenta(state)
    assert scenes.particles(state).angular_velocity[1, 0] > 1.0
    assert after == pytest.approx(before, abs=1e-13)
    assert turned == pytest.approx(turning, abs=1e-14)


@pytest.mark.parametrize("size", [(0.05, 0.008, 0.008), (0.008, 0.05, 0.02)])
def test_a_box_that_is_all_rounding_bounces_off_a_roller(size):
    deck = scenes.case(time_step=1e-5)
    top = 0.1 + 0.5 * size[2] + 1e-3
    scenes.add_boxes(
        deck, [(0.0, 0.0, top)], size=size, edge_radius=0.004, group="belt", velocity=(0.0, 0.0, -1.0)
    )
    scenes.add_cylinder(deck, diameter=0.2, length=0.3)
    state = scenes.start(deck)
    scenes.advance(state, 2000)
    p = scenes.particles(state)
    assert p.velocity[2, 0] == pytest.approx(1.0, rel=1e-3)
    assert p.position[2, 0] > top


def test_groups_decide_what_touches():
    deck = scenes.case(time_step=1e-5)
    for name in ("one", "other"):
        deck.add("CONTACT GROUP", name=name)
    deck.add("CONTACT GROUP PAIR", group_a="one", group_b="other", contact=False)
    pairs = [("one", "one"), ("one", "other"), ("one", None), (None, None)]
    for n, groups in enumerate(pairs):
        for side, group in zip((-1.0, 1.0), groups):
            scenes.add_spheres(
                deck,
                [(0.011 * side, 0.1 * n, 0.0)],
                radius=0.01,
                name=f"s{n}{side}",
                group=group,
                velocity=(-1.0 * side, 0.0, 0.0),
            )
    state = scenes.start(deck)
    scenes.advance(state, 2000)
    p = scenes.particles(state)
    left = [p.velocity[0, scenes.slot(state, 1 + 2 * n)] for n in range(len(pairs))]
    assert left == pytest.approx([1.0, 1.0, -1.0, -1.0], rel=1e-2)
