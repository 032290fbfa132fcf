"""Rounded boxes on planes and meshes: the law of the corners, rest, sliding, rebound, energy, rims under a face."""

import numpy as np
import pytest
from scenes import (
    SOFT,
    UPRIGHT,
    add_boxes,
    add_mesh,
    add_plane,
    advance,
    case,
    kinetic_energy,
    particles,
    start,
    tilted,
)
from scipy.spatial.transform import Rotation

SIZE, EDGE, DENSITY = (0.06, 0.04, 0.02), 0.004, 1200.0
CORE = np.array(SIZE) - 2.0 * EDGE
MODULUS = 5.0e6 / (1.0 - 0.3**2) / 2.0  # E* of SOFT on SOFT
PUNCH = 2.0 / np.sqrt(np.pi) * MODULUS * np.sqrt(CORE[0] * CORE[1])  # N/m, flat
HERTZ = 4.0 / 3.0 * MODULUS * np.sqrt(EDGE)  # of one corner
FLAT = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [(0, 1, 2), (0, 2, 3)]


def flat_force(depth):
    """Documented force of a box that lies flat."""
    return PUNCH * depth + 4.0 * HERTZ * depth**1.5


def rest_depth(weight):
    """Depth at which the flat box carries a weight, by bisection."""
    low, high = 0.0, 0.01
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if flat_force(middle) < weight else (low, middle)
    return low


def box_over(floor, height, tmp_path, *, orientation=UPRIGHT, slope=0.0, **given):
    """One box, its centre `height` above the floor at the origin, on a plane or a mesh that falls by `slope`."""
    state = {name: given.pop(name) for name in ("velocity", "spin") if name in given}
    deck = case(**{"time_step": 2e-5, **given})
    up = Rotation.from_quat(tilted(slope), scalar_first=True)
    turn = up * Rotation.from_quat(orientation, scalar_first=True)
    add_boxes(
        deck,
        [up.apply((0.0, 0.0, height))],
        size=SIZE,
        edge_radius=EDGE,
        orientation=turn.as_quat(scalar_first=True),
        **state,
    )
    if floor == "plane":
        add_plane(deck, orientation=tilted(slope))
    else:
        add_mesh(
            deck,
            tmp_path / "floor.stl",
            *FLAT,
            name="floor",
            point=(0.0, 0.0, 0.0),
            orientation=tilted(slope),
        )
    return start(deck)


def loads(state):
    """Force and torque on the box, gravity not counted."""
    p = particles(state)
    return p.force[:, 0] - p.mass[0] * state.scene.gravity, p.torque[:, 0].copy()


@pytest.mark.parametrize("floor", ["plane", "mesh"])
@pytest.mark.parametrize("depth", [1e-6, 1e-4, 2e-3])
def test_a_flat_box_has_the_documented_force(floor, depth, tmp_path):
    force, torque = loads(box_over(floor, 0.01 - depth, tmp_path))
    # A mesh is a file in single precision: 1e-8 of its size, and the box's own arithmetic.
    assert force == pytest.approx((0.0, 0.0, flat_force(depth)), rel=1e-6, abs=1e-9)
    assert torque == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


@pytest.mark.parametrize("floor", ["plane", "mesh"])
def test_the_force_is_the_slope_of_an_energy_of_the_corners_at_any_tilt(floor, tmp_path, rng):
    """F = -dU/dz and torque = -dU/dangle, U the sum of the documented energies of the eight corners."""

    def energy(height, turn):
        corners = turn.apply(np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, 8).T * CORE)
        d = np.maximum(0.0, EDGE - (height + corners[:, 2]))
        return float(np.sum(0.4 * HERTZ * d**2.5 + 0.125 * PUNCH * d**2))

    for _ in range(12):
        turn = Rotation.from_rotvec(rng.uniform(-1, 1, 3))
        corners = turn.apply(np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, 8).T * CORE)
        height = EDGE - corners[:, 2].min() - 1e-3 * rng.uniform(0.1, 2.0)
        force, torque = loads(box_over(floor, height, tmp_path, orientation=turn.as_quat(scalar_first=True)))
        h = 1e-8
        slope = (energy(height + h, turn) - energy(height - h, turn)) / (2 * h)
        assert force == pytest.approx((0.0, 0.0, -slope), rel=1e-6, abs=1e-6)
        for axis in np.eye(3):
            h = 1e-6
            ahead, back = (Rotation.from_rotvec(s * h * axis) * turn for s in (1, -1))
            moment = -(energy(height, ahead) - energy(height, back)) / (2 * h)
            assert torque @ axis == pytest.approx(moment, rel=1e-5, abs=1e-6 * abs(slope) * SIZE[0])


def test_the_force_has_no_jump_under_tilt(tmp_path):
    """From flat over an edge: the load at a fixed height of the lowest corner changes gradually, flat included."""
    angles = np.linspace(-0.02, 0.02, 81)
    heights = CORE[2] / 2 * np.cos(angles) + CORE[0] / 2 * np.sin(np.abs(angles)) + EDGE - 1e-4
    seen = []
    for angle, height in zip(angles, heights):
        force, _ = loads(box_over("plane", height, tmp_path, orientation=tilted(angle)))
        seen.append(force[2])
    steps = np.abs(np.diff(seen)) / max(seen)
    # 0.5 mrad lifts the far corners by 26 um of their 100 um: a quarter of their half, and a little for Hertz.
    assert steps.max() < 0.2
    assert seen == pytest.approx(seen[::-1], rel=1e-9)
    fine = [
        loads(box_over("plane", 0.01 - 1e-4, tmp_path, orientation=tilted(angle)))[0][2]
        for angle in (-1e-9, 0.0, 1e-9)
    ]
    assert fine == pytest.approx([fine[1]] * 3, rel=1e-6)


@pytest.mark.parametrize("floor", ["plane", "mesh"])
def test_a_flat_box_rests_where_its_weight_is_carried(floor, tmp_path):
    weight = box_weight()
    state = box_over(
        floor, 0.01 - 0.5 * rest_depth(weight), tmp_path, gravity=(0, 0, -9.81), friction=0.5, restitution=0.2
    )
    advance(state, 10000)
    p = particles(state)
    assert p.position[2, 0] == pytest.approx(0.01 - rest_depth(weight), abs=1e-9)
    before = p.position[:, 0].copy()
    advance(state, 10000)
    # Creep: less than a millionth of its size, in 0.2 s.
    assert np.abs(particles(state).position[:, 0] - before).max() < 1e-6 * SIZE[2]
    assert kinetic_energy(state) < 1e-12 * weight * SIZE[2]


def box_weight():
    """Weight of the box [N]."""
    deck = case(time_step=1e-5)
    add_boxes(deck, [(0, 0, 1)], size=SIZE, edge_radius=EDGE)
    return float(particles(start(deck)).mass[0]) * 9.81


@pytest.mark.parametrize("floor", ["plane", "mesh"])
def test_a_block_on_an_incline_sticks_below_its_friction_and_slides_above(floor, tmp_path):
    """0.98 of the limit: creep below a millionth of its size; beyond: a = g (sin - mu cos), without turning over."""
    slope = np.radians(25.0)
    sink = rest_depth(box_weight() * np.cos(slope))
    along = np.array([np.cos(slope), 0.0, -np.sin(slope)])

    def slide(friction, steps):
        state = box_over(
            floor,
            0.01 - sink,
            tmp_path,
            slope=slope,
            gravity=(0, 0, -9.81),
            friction=friction,
            restitution=0.2,
        )
        advance(state, 10000)
        first = particles(state).position[:, 0].copy(), particles(state).velocity[:, 0].copy()
        advance(state, steps)
        return (particles(state).position[:, 0] - first[0]) @ along, (
            particles(state).velocity[:, 0] - first[1]
        ) @ along

    creep, _ = slide(np.tan(slope) / 0.98, 10000)
    assert abs(creep) < 1e-6 * SIZE[0]
    for friction in (np.tan(slope) / 1.02, 0.2):
        _, gained = slide(friction, 10000)
        expected = 9.81 * (np.sin(slope) - friction * np.cos(slope)) * 0.2
        assert gained == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("floor", ["plane", "mesh"])
def test_a_sliding_block_stops_after_its_braking_distance(floor, tmp_path):
    """v^2 / (2 mu g), and a block spun about the vertical comes to rest too."""
    weight = box_weight()
    state = box_over(
        floor,
        0.01 - rest_depth(weight),
        tmp_path,
        gravity=(0, 0, -9.81),
        friction=0.4,
        restitution=0.2,
        velocity=(0.6, 0.0, 0.0),
    )
    advance(state, 20000)
    assert particles(state).position[0, 0] == pytest.approx(0.36 / (2 * 0.4 * 9.81), rel=2e-3)
    state = box_over(
        floor,
        0.01 - rest_depth(weight),
        tmp_path,
        gravity=(0, 0, -9.81),
        friction=0.4,
        restitution=0.2,
        spin=(0.0, 0.0, 10.0),
    )
    advance(state, 10000)
    assert np.linalg.norm(particles(state).angular_velocity[:, 0]) < 1e-3


@pytest.mark.parametrize("restitution", [0.3, 0.8])
@pytest.mark.parametrize("floor", ["plane", "mesh"])
def test_a_box_that_falls_flat_rebounds_as_given(floor, restitution, tmp_path):
    """Most of the stiffness is the linear punch, whose damping is exact; the corners' Hertz share is a few per cent."""
    state = box_over(
        floor, 0.0101, tmp_path, restitution=restitution, velocity=(0.0, 0.0, -0.3), time_step=1e-5
    )
    advance(state, 3000)
    assert particles(state).velocity[2, 0] == pytest.approx(0.3 * restitution, rel=0.02)
    assert particles(state).angular_velocity[:, 0] == pytest.approx((0, 0, 0), abs=1e-6)


@pytest.mark.parametrize("floor", ["plane", "mesh"])
def test_a_tumbling_box_keeps_its_energy(floor, tmp_path):
    """Elastic and frictionless: a box that hits with corners, edges and faces gains and loses nothing."""
    turn = Rotation.from_rotvec((0.7, -0.4, 0.2)).as_quat(scalar_first=True)
    errors = []
    for time_step in (2e-5, 1e-5):
        state = box_over(
            floor,
            0.045,
            tmp_path,
            orientation=turn,
            gravity=(0, 0, -9.81),
            time_step=time_step,
            spin=(3.0, 2.0, 1.0),
        )
        begin = energy_under_gravity(state)
        free = advance(
            state, round(1.0 / time_step), every=25, probe=lambda s: [energy_under_gravity(s), loads(s)[0][2]]
        )
        assert np.count_nonzero(free[:, 1] > 0.0) > 20
        in_flight = free[free[:, 1] == 0.0, 0]
        errors.append(np.abs(in_flight - begin).max() / begin)
        assert particles(state).position[2, 0] > 0.005
    # Verlet: second order in the step, but for the kinks where corners begin to touch.
    assert errors[0] < 1e-3
    assert errors[1] < 0.5 * errors[0]


def energy_under_gravity(state):
    """Kinetic energy and height of the box [J]."""
    p = particles(state)
    return kinetic_energy(state) + float(p.mass[0]) * 9.81 * float(p.position[2, 0])


def test_a_turned_scene_moves_likewise(tmp_path):
    """Plane, box and gravity turned together: the same motion, turned."""
    ends = []
    for turn in (Rotation.identity(), Rotation.from_rotvec((0.4, 1.1, -0.8))):
        deck = case(
            time_step=2e-5, gravity=tuple(turn.apply((1.0, 0.5, -9.0))), friction=0.3, restitution=0.5
        )
        start_turn = turn * Rotation.from_rotvec((0.3, 0.2, 0.1))
        add_boxes(
            deck,
            [turn.apply((0.0, 0.0, 0.03))],
            size=SIZE,
            edge_radius=EDGE,
            orientation=start_turn.as_quat(scalar_first=True),
        )
        add_plane(deck, orientation=turn.as_quat(scalar_first=True))
        state = start(deck)
        advance(state, 5000)
        p = particles(state)
        ends.append(turn.inv().apply([p.position[:, 0], p.velocity[:, 0], p.angular_velocity[:, 0]]))
    assert ends[0] == pytest.approx(ends[1], abs=1e-8)


def test_a_held_box_may_lie_in_a_floor_with_which_it_has_no_contact_property():
    """Nothing pushes it, nothing is NaN: held particles and parts need no property."""
    deck = case(time_step=2e-5, gravity=(0, 0, -9.81), materials={"stuff": SOFT, "stone": SOFT})
    (block,) = deck.blocks("CONTACT PROPERTY")
    block.parameters["MATERIAL A"] = block.parameters["MATERIAL B"] = "stuff"
    add_boxes(deck, [(0.0, 0.0, 0.005)], size=SIZE, edge_radius=EDGE, fixed="YES")
    add_plane(deck, material="stone")
    state = start(deck)
    advance(state, 10)
    assert loads(state)[0] == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    assert particles(state).position[:, 0] == pytest.approx((0.0, 0.0, 0.005), abs=0.0)


def rail(width):
    """A strip of two triangles along y, `width` wide."""
    return [(-width, -1, 0), (width, -1, 0), (width, 1, 0), (-width, 1, 0)], [(0, 1, 2), (0, 2, 3)]


@pytest.mark.parametrize("width", [0.012, 0.003])
def test_a_box_rests_on_a_rail_narrower_than_itself(width, tmp_path):
    """No corner lies over the rail: its rims carry the box."""
    deck = case(time_step=2e-5, gravity=(0, 0, -9.81), friction=0.5, restitution=0.2)
    add_boxes(deck, [(0.0, 0.0, 0.0099)], size=SIZE, edge_radius=EDGE)
    add_mesh(deck, tmp_path / "rail.stl", *rail(width), name="rail")
    state = start(deck)
    advance(state, 25000)
    p, part = particles(state), state.scene.machinery.parts
    assert 0.0098 < p.position[2, 0] < 0.01
    assert np.linalg.norm(p.velocity[:, 0]) < 1e-6
    assert part.force[2, 0] == pytest.approx(-box_weight(), rel=1e-4)
    assert p.orientation[:, 0] == pytest.approx(UPRIGHT, abs=1e-4)


def test_a_box_whose_centre_is_beyond_the_lip_tips_over_it(tmp_path):
    """On a plate that ends at x = 0: with the centre 2 mm inside it stays, 2 mm outside it goes over the lip."""
    ends = []
    for x in (-0.002, 0.002):
        deck = case(time_step=2e-5, gravity=(0, 0, -9.81), friction=0.5, restitution=0.2)
        add_boxes(deck, [(x, 0.0, 0.0099)], size=SIZE, edge_radius=EDGE)
        plate = [(-1, -1, 0), (0, -1, 0), (0, 1, 0), (-1, 1, 0)], [(0, 1, 2), (0, 2, 3)]
        add_mesh(deck, tmp_path / "plate.stl", *plate, name="plate")
        state = start(deck)
        advance(state, 15000)
        ends.append(particles(state).position[2, 0])
    assert ends[0] == pytest.approx(0.0099, abs=2e-4)
    assert ends[1] < 0.0


@pytest.fixture
def rng():
    return np.random.default_rng(5)
