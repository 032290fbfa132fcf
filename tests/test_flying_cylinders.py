"""Cylinder particles that fly: on planes, rollers, belts, and against spheres and one another."""

import numpy as np
import pytest
import scenes
from scipy.spatial.transform import Rotation

from beltsim.engine import renew_lists
from beltsim.scene import build
from beltsim.scene.unbuilt import SceneError

G = 9.81
RADIUS, LENGTH = 0.05, 0.3
MODULUS = scenes.SOFT["youngs_modulus"] / (2 * (1 - scenes.SOFT["poisson_ratio"] ** 2))  # of two alike
MASS = scenes.SOFT["density"] * np.pi * RADIUS**2 * LENGTH


def add_rods(deck, places, *, edge=0.0, name="rod", fixed="NO", group=None, **state):
    """Cylinders of a new type, along y unless told."""
    deck.add(
        "PARTICLE TYPE",
        name=name,
        shape="CYLINDER",
        diameter=2 * RADIUS,
        length=LENGTH,
        edge_radius=edge,
        material="stuff",
        fixed=fixed,
        contact_group=group,
    )
    return scenes.add_particles(deck, name, places, **{"orientation": scenes.ALONG_Y} | state)


def on_floor(places, *, time_step=5e-5, gravity=(0.0, 0.0, -G), friction=0.5, restitution=0.3, **given):
    """Rods over a floor."""
    deck = scenes.case(time_step=time_step, gravity=gravity, friction=friction, restitution=restitution)
    add_rods(deck, places, **given)
    scenes.add_plane(deck)
    return deck


def axis_of(state, slot=0):
    """Axis of a rod in the world."""
    return Rotation.from_quat(scenes.particles(state).orientation[:, slot], scalar_first=True).apply(
        [0, 0, 1]
    )


@pytest.mark.parametrize(
    ("orientation", "height", "stiffness"),
    [
        (scenes.ALONG_Y, RADIUS, np.pi / 4 * MODULUS * LENGTH),  # a line along its whole length
        (scenes.UPRIGHT, LENGTH / 2, 2 * MODULUS * RADIUS),  # a flat round punch
    ],
    ids=["lying", "standing"],
)
def test_a_cylinder_rests_on_a_plane_as_deep_as_its_stiffness_says(orientation, height, stiffness):
    state = scenes.start(on_floor([(0.0, 0.0, height + 1e-4)], orientation=orientation))
    scenes.advance(state, 20_000)
    p = scenes.particles(state)
    sink = MASS * G / stiffness
    # The line of the rim helps the end by pi sink / 16 R, 4e-4.
    assert height - p.position[2, 0] == pytest.approx(sink, rel=1.1 * np.pi * sink / (16 * RADIUS))
    assert state.scene.machinery.parts.force[2, 1] + state.scene.machinery.parts.force[2, 0] == pytest.approx(
        -MASS * G, rel=1e-6
    )
    assert (
        np.abs(axis_of(state) - Rotation.from_quat(orientation, scalar_first=True).apply([0, 0, 1])).max()
        < 1e-9
    )
    assert np.abs(p.velocity).max() < 1e-8


def test_a_cylinder_rolls_down_a_slope_at_two_thirds_of_its_pull():
    slope = np.radians(10.0)
    sink = MASS * G * np.cos(slope) / (np.pi / 4 * MODULUS * LENGTH)
    down = (G * np.sin(slope), 0.0, -G * np.cos(slope))
    state = scenes.start(on_floor([(0.0, 0.0, RADIUS - sink)], gravity=down))
    scenes.advance(state, 8_000)
    p = scenes.particles(state)
    # The friction spring, 0.8 of the normal stiffness, swings the speed by g sin(slope) / omega, 2e-3 of it here.
    assert p.velocity[0, 0] == pytest.approx(2 / 3 * G * np.sin(slope) * 0.4, rel=3e-3)
    assert p.angular_velocity[1, 0] * RADIUS == pytest.approx(p.velocity[0, 0], rel=5e-3)
    assert abs(p.position[1, 0]) < 1e-9
    assert np.abs(axis_of(state) - [0, 1, 0]).max() < 1e-9


def rolling_rod(rolling, *, slope=0.0, speed=0.0):
    """A rod that lies on a floor as deep as its weight presses it, under a gravity that is tilted."""
    angle = np.radians(slope)
    sink = MASS * G * np.cos(angle) / (np.pi / 4 * MODULUS * LENGTH)
    down = (G * np.sin(angle), 0.0, -G * np.cos(angle))
    deck = scenes.case(time_step=5e-5, gravity=down, friction=0.8, restitution=0.3, rolling=rolling)
    add_rods(deck, [(0.0, 0.0, RADIUS - sink)], velocity=(speed, 0.0, 0.0), spin=(0.0, speed / RADIUS, 0.0))
    scenes.add_plane(deck)
    return deck


def test_rolling_resistance_slows_a_rolling_cylinder():
    state = scenes.start(rolling_rod(0.05, speed=1.0))
    p = scenes.particles(state)
    scenes.advance(state, 4000)
    first = p.velocity[0, 0]
    scenes.advance(state, 4000)
    # The moment r_r R N against m R^2 + I = 3/2 m R^2; the friction spring swings by some 1e-3 of the speed lost.
    assert (p.velocity[0, 0] - first) / 0.2 == pytest.approx(-2.0 / 3.0 * 0.05 * G, rel=5e-3)
    assert np.abs(p.velocity[1, 0]) < 1e-9


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_rolling_resistance_holds_a_cylinder_on_a_slope_below_its_limit(share):
    slope = 3.0
    limit = np.tan(np.radians(slope))
    state = scenes.start(rolling_rod(share * limit, slope=slope))
    p = scenes.particles(state)
    scenes.advance(state, 20_000)
    first = p.velocity[0, 0]
    places = scenes.advance(state, 10_000, every=10, probe=lambda s: scenes.particles(s).position[0, 0])
    if share > 1.0:
        # It started 10 % below the limit at once, so it slid a little before; now it rocks, by less than 1e-4 R.
        assert np.ptp(places) < 1e-4 * RADIUS
    else:
        pull = 2.0 / 3.0 * (1.0 - share) * G * np.sin(np.radians(slope))
        assert (p.velocity[0, 0] - first) / 0.5 == pytest.approx(pull, rel=5e-3)


def test_a_cylinder_rolling_to_rest_accounts_for_its_energy():
    from test_energy import book

    terms = book(rolling_rod(0.1, speed=0.3), 1.0)
    first = 0.75 * MASS * 0.3**2
    assert terms["energy_kinetic"] + terms["energy_rotational"] < 1e-3 * first
    assert terms["loss_rolling"] > 0.95 * first
    assert abs(terms["energy_residual"]) < 1e-3 * first


def test_a_cylinder_lies_in_the_cradle_of_two_rollers():
    """Each roller carries m g / (2 cos a), from its own centre to that of the cylinder."""
    deck = scenes.case(time_step=5e-5, gravity=(0.0, 0.0, -G), friction=0.0, restitution=0.1)
    for n, x in enumerate((-0.06, 0.06)):
        scenes.add_cylinder(deck, name=f"roller_{n}", diameter=0.1, length=0.5, point=(x, 0.0, 0.0))
    add_rods(deck, [(0.0, 0.0, 0.08)])
    state = scenes.start(deck)
    scenes.advance(state, 20_000)
    parts, p = state.scene.machinery.parts, scenes.particles(state)
    for n, x in enumerate((-0.06, 0.06)):
        out = np.array([x, 0.0, 0.0]) - p.position[:, 0]
        out /= np.linalg.norm(out)
        assert parts.force[:, n] == pytest.approx(MASS * G / (2 * -out[2]) * out, rel=1e-5, abs=1e-5)
    assert np.abs(axis_of(state) - [0, 1, 0]).max() < 1e-9


@pytest.mark.parametrize("tilt", [0.3, 1.0, 1.4])
def test_a_tossed_cylinder_comes_to_lie_and_never_gains_energy(tilt):
    """The lowest point of its rim stays above the depth that its energy can press it to."""
    orientation = tuple(Rotation.from_euler("xy", [tilt, 0.4]).as_quat(scalar_first=True))
    deck = on_floor([(0.0, 0.0, 0.25)], orientation=orientation, spin=[(1.0, 2.0, 3.0)], restitution=0.4)
    state = scenes.start(deck)

    def look(state):
        p = scenes.particles(state)
        axis = axis_of(state)
        lowest = p.position[2, 0] - LENGTH / 2 * abs(axis[2]) - RADIUS * np.hypot(axis[0], axis[1])
        return scenes.kinetic_energy(state) + MASS * G * p.position[2, 0], lowest, axis[2]

    seen = scenes.advance(state, 60_000, every=20, probe=look)
    whole = seen[:, 0]
    stiffness = MODULUS * RADIUS  # of half a rim, less than any that touches
    assert seen[:, 1].min() > -np.sqrt(2 * whole[0] / (0.25 * stiffness))
    # Energy kept in the contact comes back; beyond the highest so far it would be made.
    assert whole.max() < whole[0] * (1 + 1e-3)
    assert abs(seen[-1, 2]) < 1e-3
    assert seen[-1, 0] < whole[0] - 0.3


def test_the_energy_book_of_a_falling_cylinder_closes():
    from test_energy import book

    orientation = tuple(Rotation.from_euler("xy", [1.2, 0.4]).as_quat(scalar_first=True))
    deck = on_floor([(0.0, 0.0, 0.15)], orientation=orientation, time_step=1e-5, restitution=0.5)
    terms = book(deck, 0.3)
    # The stiffness of the end depends on its angle, which no spring of its own stores: some 1e-3 of the bounce.
    assert abs(terms["energy_residual"]) < 5e-3 * MASS * G * 0.1
    assert terms["loss_contact_damping"] > 0.1 * MASS * G * 0.1


def test_a_sphere_gives_its_momentum_to_a_cylinder_that_it_hits_in_the_middle():
    deck = scenes.case(time_step=1e-5)
    add_rods(deck, [(0.0, 0.0, 0.0)])
    scenes.add_spheres(deck, [(0.0, 0.0, 0.0702)], radius=0.02, velocity=(0.0, 0.0, -1.0))
    state = scenes.start(deck)
    scenes.advance(state, 4000)
    p = scenes.particles(state)
    rod, ball = scenes.slot(state, 1), scenes.slot(state, 2)
    m = p.mass[ball]
    assert p.velocity[2, rod] == pytest.approx(-2 * m / (m + MASS), rel=1e-3)
    assert p.velocity[2, ball] == pytest.approx(-(m - MASS) / (m + MASS), rel=1e-3)


@pytest.mark.parametrize("damped", [False, True])
@pytest.mark.parametrize(
    "orientation",
    [scenes.ALONG_Y, scenes.ALONG_X, tuple(Rotation.from_euler("x", 1.0).as_quat(scalar_first=True))],
    ids=["parallel", "crossed", "rim first"],
)
def test_two_cylinders_that_collide_keep_their_momenta(orientation, damped):
    deck = scenes.case(time_step=1e-5, friction=0.3 * damped, restitution=0.5 if damped else 1.0)
    add_rods(deck, [(0.0, 0.0, 0.0)], name="first")
    add_rods(
        deck,
        [(0.01, 0.02, 0.2)],
        name="second",
        orientation=orientation,
        velocity=[(0.0, 0.0, -1.0)],
        spin=[(0.0, 0.0, 2.0)],
    )
    state = scenes.start(deck)
    before, whole = scenes.momenta(state), scenes.kinetic_energy(state)
    scenes.advance(state, 20_000)
    after = scenes.momenta(state)
    assert scenes.particles(state).velocity[2, 0] < -0.1
    assert after[0] == pytest.approx(before[0], abs=1e-12 * MASS * 20_000)
    assert after[1] == pytest.approx(before[1], abs=1e-12 * MASS * 20_000)
    if damped:
        assert scenes.kinetic_energy(state) < 0.98 * whole
    else:
        # Simpson's rule over a changing line and the end's weight are no exact potential.
        assert scenes.kinetic_energy(state) == pytest.approx(whole, rel=0.01)


def test_a_turned_and_shifted_scene_does_as_the_first_one():
    frame, shift = Rotation.from_rotvec([0.5, -0.8, 0.3]), np.array([0.4, 0.1, -0.2])
    ends = []
    for turn, move in ((Rotation.identity(), np.zeros(3)), (frame, shift)):
        deck = scenes.case(
            time_step=5e-5, gravity=tuple(turn.apply([0.0, 0.0, -G])), friction=0.4, restitution=0.4
        )
        start = turn * Rotation.from_euler("xy", [0.9, 0.2])
        place = turn.apply([0.02, 0.0, 0.3]) + move
        add_rods(deck, [place], orientation=tuple(start.as_quat(scalar_first=True)))
        floor = tuple(turn.as_quat(scalar_first=True))
        scenes.add_plane(deck, point=tuple(move), orientation=floor)
        along = turn * Rotation.from_quat(scenes.ALONG_Y, scalar_first=True)
        middle = tuple(turn.apply([0.1, 0.0, 0.05]) + move)
        given = {"diameter": 0.1, "length": 0.4, "point": middle}
        scenes.add_cylinder(deck, orientation=tuple(along.as_quat(scalar_first=True)), **given)
        state = scenes.start(deck)
        scenes.advance(state, 6000)
        ends.append(turn.inv().apply(scenes.particles(state).position[:, 0] - move))
    assert np.abs(ends[0] - ends[1]).max() < 1e-6


def test_history_outlives_new_lists():
    """A cylinder across a slope of 20 degrees that friction holds, with lists made anew all the time."""
    slope, ends = np.radians(20.0), []
    along = tuple(Rotation.from_euler("y", np.pi / 2).as_quat(scalar_first=True))
    for renew in (False, True):
        down = (G * np.sin(slope), 0.0, -G * np.cos(slope))
        state = scenes.start(on_floor([(0.0, 0.0, RADIUS)], orientation=along, gravity=down))
        for _ in range(40):
            scenes.advance(state, 50)
            if renew:
                renew_lists(state)
        ends.append(scenes.particles(state).position.copy())
    assert np.array_equal(*ends)
    assert abs(ends[0][0, 0]) < 1e-3


def test_cylinders_on_a_belt_of_boxes_are_carried_by_it():
    deck = scenes.case(time_step=1e-5, gravity=(0.0, 0.0, -G), friction=0.5, restitution=0.2)
    scenes.add_grid(deck, 6, 20, fixed="YES")
    add_rods(deck, [(0.05, 0.19, 0.005 + RADIUS)])
    state = scenes.start(deck)
    scenes.advance(state, 40_000)
    p, rod = scenes.particles(state), scenes.slot(state, 121)
    assert p.position[2, rod] == pytest.approx(0.005 + RADIUS, abs=3e-4)
    assert np.abs(p.velocity[:, rod]).max() < 1e-2


def test_the_automatic_time_step_bounds_the_contacts_of_cylinders():
    deck = on_floor([(0.0, 0.0, RADIUS), (0.0, 0.0, 0.17)], time_step="AUTO")
    state = scenes.start(deck, allow_unstable=False)
    stiff = np.pi / 4 * MODULUS * LENGTH
    assert state.stage.time_step < 0.8 * 2 / np.sqrt(stiff / MASS)
    scenes.advance(state, int(0.5 / state.stage.time_step))
    assert scenes.particles(state).position[2].max() < 0.16
    assert scenes.particles(state).position[2].min() > 0.04


def test_what_is_not_built_of_flying_cylinders_is_refused_by_name(tmp_path):
    deck = scenes.case(time_step=1e-5)
    add_rods(deck, [(0.0, 0.0, 1.0)])
    corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0)]
    scenes.add_mesh(deck, tmp_path / "plate.stl", corners, [(0, 1, 2)], name="plate")
    with pytest.raises(SceneError, match="rod, a CYLINDER with FIXED=NO, that may touch the mesh plate"):
        build(deck)
    for block in deck.blocks("PARTICLE TYPE") + deck.blocks("PART"):
        block.parameters["CONTACT GROUP"] = "apart"
    deck.add("CONTACT GROUP", name="apart")
    assert build(deck).machinery.rods.particle.tolist() == [0]
