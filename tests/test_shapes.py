"""Where shapes touch, against signed distances in closed form, sampling, and the cases where directions degenerate."""

import itertools

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.spatial.transform import Rotation

from beltsim.solver import shapes
from beltsim.solver.box_cylinder import box_cylinder

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
HALF = np.array([0.0165, 0.0165, 0.005])  # of a belt particle, outer
EDGE = 0.004
CORE = tuple(HALF - EDGE)
RADIUS, HALF_LENGTH = 0.0665, 0.19  # of an idler
AXIS = (0.0, 1.0, 0.0)


def quaternion(rotation):
    return tuple(rotation.as_quat(scalar_first=True))


def box_distance(points, half, edge):
    """Signed distance of points (n, 3) from a rounded box at the origin."""
    q = np.abs(points) - (half - edge)
    return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0) - edge


def cylinder_distance(points, radius, half_length, edge):
    """Signed distance of points (n, 3) from a rounded cylinder at the origin, its axis along z."""
    q = np.stack([np.hypot(points[:, 0], points[:, 1]), np.abs(points[:, 2])], axis=1)
    q -= np.array([radius, half_length]) - edge
    return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0) - edge


def gradient(distance, point, step=1e-7):
    """Direction in which a distance grows fastest at a point, by central differences."""
    offsets = step * np.vstack([np.eye(3), -np.eye(3)])
    values = distance(point + offsets)
    return (values[:3] - values[3:]) / (2 * step)


def test_spheres_overlap_by_their_radii_less_their_distance():
    overlap, normal = shapes.sphere_sphere((1.0, 2.0, 3.0), 0.5, (1.0, 2.6, 3.8), 0.6)
    assert overlap == pytest.approx(0.1, abs=1e-15)
    assert normal == pytest.approx((0.0, -0.6, -0.8), abs=1e-15)


def test_coincident_spheres_get_a_fixed_unit_normal():
    overlap, normal = shapes.sphere_sphere((1.0, 2.0, 3.0), 0.5, (1.0, 2.0, 3.0), 0.25)
    assert (overlap, normal) == (0.75, (0.0, 0.0, 1.0))


def test_a_sphere_and_a_plane_overlap_by_the_depth_below_the_surface():
    overlap, normal = shapes.sphere_plane((5.0, 1.0, 0.2), 0.3, (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    assert overlap == pytest.approx(0.1, abs=1e-15)
    assert normal == (0.0, 0.0, 1.0)


def test_a_sphere_meets_a_turned_rounded_box_at_its_signed_distance(rng):
    place = np.array([0.3, -0.2, 0.7])
    for rotation in Rotation.random(200, random_state=rng):
        local = rng.uniform(-2.0, 2.0, 3) * HALF
        overlap, normal = shapes.sphere_box(
            tuple(place + rotation.apply(local)), 0.01, tuple(place), quaternion(rotation), CORE, EDGE
        )
        wanted = gradient(lambda x: box_distance(x, HALF, EDGE), local)
        assert overlap == pytest.approx(0.01 - box_distance(local[None], HALF, EDGE)[0], abs=1e-15)
        # 1e-6: rounding of the central difference, unless the nearest face changes within its step
        assert np.linalg.norm(rotation.inv().apply(normal) - wanted) < 1e-6


@pytest.mark.parametrize("place", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (1, 1, 1), (0, 0, 1)])
def test_a_sphere_centre_in_or_on_a_box_core_gets_a_unit_normal_out_of_the_box(place):
    centre = tuple(np.array(place) * CORE)
    overlap, normal = shapes.sphere_box(centre, 0.01, (0.0, 0.0, 0.0), UPRIGHT, CORE, EDGE)
    assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-15)
    assert overlap == pytest.approx(0.01 - box_distance(np.array([centre]), HALF, EDGE)[0], abs=1e-15)


def test_a_sphere_meets_a_finite_cylinder_at_its_signed_distance(rng):
    middle = np.array([0.1, 0.2, -0.3])
    for rotation in Rotation.random(200, random_state=rng):
        local = rng.uniform(-1.5, 1.5, 3) * np.array([RADIUS, RADIUS, HALF_LENGTH])
        for edge in (0.0, 0.01):
            overlap, normal = shapes.sphere_cylinder(
                tuple(middle + rotation.apply(local)),
                0.02,
                tuple(middle),
                tuple(rotation.apply([0.0, 0.0, 1.0])),
                RADIUS,
                HALF_LENGTH,
                edge,
            )
            distance = cylinder_distance(local[None], RADIUS, HALF_LENGTH, edge)[0]
            wanted = gradient(lambda x, e=edge: cylinder_distance(x, RADIUS, HALF_LENGTH, e), local)
            assert overlap == pytest.approx(0.02 - distance, abs=1e-14)
            assert np.linalg.norm(rotation.inv().apply(normal) - wanted) < 1e-6


@pytest.mark.parametrize("edge", [0.0, 0.01])
@pytest.mark.parametrize(
    "place",
    [
        pytest.param((0.0, 0.0, 0.0), id="centre in the middle"),
        pytest.param((0.0, 0.0, HALF_LENGTH + 0.01), id="on the axis beyond the cap"),
        pytest.param((0.0, 0.0, HALF_LENGTH), id="on the axis in the cap"),
        pytest.param((RADIUS, 0.0, HALF_LENGTH), id="on the rim circle"),
        pytest.param((RADIUS - 0.01, 0.0, HALF_LENGTH - 0.01), id="on the core's rim circle"),
        pytest.param((RADIUS, 0.0, 0.0), id="on the mantle"),
        pytest.param((0.3 * RADIUS, 0.0, 0.0), id="inside"),
    ],
)
def test_a_cylinder_pushes_from_every_special_place_with_a_unit_normal_and_the_true_overlap(place, edge):
    for axis, centre in [((0.0, 0.0, 1.0), place), ((1.0, 0.0, 0.0), (place[2], place[1], place[0]))]:
        overlap, normal = shapes.sphere_cylinder(
            centre, 0.02, (0.0, 0.0, 0.0), axis, RADIUS, HALF_LENGTH, edge
        )
        distance = cylinder_distance(np.array([place]), RADIUS, HALF_LENGTH, edge)[0]
        assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-15)
        assert overlap == pytest.approx(0.02 - distance, abs=1e-15)


def test_the_overlap_with_a_cylinder_never_changes_faster_than_the_centre_moves(rng):
    def overlap_at(x):
        return shapes.sphere_cylinder(
            tuple(x), 0.02, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), RADIUS, HALF_LENGTH, 0.005
        )[0]

    for _ in range(300):
        x = rng.uniform(-1.3, 1.3, 3) * np.array([RADIUS, RADIUS, HALF_LENGTH])
        step = 1e-9 * rng.standard_normal(3)
        # 1e-15: rounding of lengths below 1 m
        assert abs(overlap_at(x + step) - overlap_at(x)) <= np.linalg.norm(step) + 1e-15


def flat_box(overlap, rotation=None, along=0.0, core=CORE):
    """Arguments of `box_cylinder` for a box that lies on top of a cylinder along y, and is then turned."""
    centre = (0.0, along, RADIUS + HALF[2] - overlap)
    orientation = quaternion(rotation) if rotation is not None else UPRIGHT
    return centre, orientation, core, EDGE, (0.0, 0.0, 0.0), AXIS, RADIUS, HALF_LENGTH


def sampled_line(arguments, samples=2001):
    """Heights along the cylinder's axis and the overlap there: all edges of the core are cut, and joined in pairs."""
    centre, orientation, core, edge, middle, axis, radius, half_length = arguments
    frame = Rotation.from_quat(orientation, scalar_first=True).as_matrix() * np.array(core)
    corners = np.array(list(itertools.product((-1, 1), repeat=3)))
    edges = [(i, j) for i, j in itertools.combinations(range(8), 2) if (corners[i] != corners[j]).sum() == 1]
    places = np.array(centre) - np.array(middle) + corners @ frame.T
    reach = np.clip(places @ np.array(axis), -half_length, half_length)
    height = np.linspace(reach.min(), reach.max(), samples)
    cuts = []
    for i, j in edges:
        begin, step = places[i], places[j] - places[i]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = (height - begin @ np.array(axis)) / (step @ np.array(axis))
        share[~((share >= 0.0) & (share <= 1.0))] = np.nan
        cuts.append(flattened(begin + share[:, None] * step, axis))
    distance = np.full(samples, np.inf)
    for begin, end in itertools.combinations(cuts, 2):
        side = end - begin
        share = np.clip(-(begin * side).sum(1) / np.maximum((side * side).sum(1), 1e-300), 0.0, 1.0)
        distance = np.fmin(distance, np.linalg.norm(begin + share[:, None] * side, axis=1))
    return height, np.maximum(radius + edge - distance, 0.0)


def flattened(v, axis):
    v = np.asarray(v)
    return v - np.multiply.outer(v @ np.array(axis), np.array(axis))


def test_a_flat_box_on_a_cylinder_touches_along_its_whole_core_length():
    area, length, normal, point, *_ = box_cylinder(*flat_box(2e-5))
    assert length == pytest.approx(2 * CORE[1], rel=1e-12)
    assert area == pytest.approx(2 * CORE[1] * 2e-5, rel=1e-9)
    assert normal == pytest.approx((0.0, 0.0, 1.0), abs=1e-12)
    assert point == pytest.approx((0.0, 0.0, RADIUS), abs=1e-12)


def test_a_box_rolled_about_a_parallel_axis_overlaps_by_its_section_s_distance(rng):
    for angle in rng.uniform(-np.pi, np.pi, 100):
        place = rng.uniform(-1.5, 1.5) * HALF[0]
        rotation = Rotation.from_euler("y", angle)
        support = np.abs(rotation.as_matrix()[2, [0, 2]]) @ np.array(CORE)[[0, 2]] + EDGE
        arguments = list(flat_box(0.0, rotation))
        arguments[0] = (place, 0.0, RADIUS + support - 5e-4)
        # The axis of the cylinder in the frame of the box: its distance from the section is a signed distance.
        local = rotation.inv().apply(-np.array(arguments[0]))
        local[1] = 0.0
        overlap = RADIUS - box_distance(local[None], HALF, EDGE)[0]
        area, length, *_ = box_cylinder(*arguments)
        if overlap <= 0.0:
            assert area == 0.0
        else:
            # 1e-8 m: the regularisation moves the nearest point by 1e-5 of half a side
            assert area / (2 * CORE[1]) == pytest.approx(overlap, abs=1e-8)
            assert length == pytest.approx(2 * CORE[1], rel=1e-9)


def test_any_common_rotation_of_box_and_cylinder_gives_the_same_contact(rng):
    plain = flat_box(3e-5, Rotation.from_rotvec([2e-3, -0.3, 0.05]))
    area, length, normal, point, *_ = box_cylinder(*plain)
    for turn in Rotation.random(50, random_state=rng):
        turned = box_cylinder(
            tuple(turn.apply(plain[0])),
            quaternion(turn * Rotation.from_quat(plain[1], scalar_first=True)),
            CORE,
            EDGE,
            plain[4],
            tuple(turn.apply(AXIS)),
            RADIUS,
            HALF_LENGTH,
        )
        # Overlap is a difference of lengths of 0.07 m, so 1e-16 of those is 1e-12 of an overlap of 3e-5 m.
        assert turned[0] == pytest.approx(area, rel=1e-10)
        assert turned[1] == pytest.approx(length, rel=1e-10)
        assert turned[2] == pytest.approx(turn.apply(normal), abs=1e-10)
        assert turned[3] == pytest.approx(turn.apply(point), abs=1e-10)


@pytest.mark.parametrize("overlap", [1e-5, 1e-4])
def test_a_tilt_below_a_milliradian_changes_the_force_by_less_than_two_per_cent(overlap, rng):
    flat = box_cylinder(*flat_box(overlap))[0]
    for direction in rng.standard_normal((200, 3)):
        tilt = Rotation.from_rotvec(1e-3 * direction / np.linalg.norm(direction))
        area = box_cylinder(*flat_box(overlap, tilt))[0]
        assert abs(area / flat - 1.0) < 0.02


def test_the_line_integral_of_a_tilted_and_skewed_box_equals_the_sampled_one(rng):
    for _ in range(100):
        rotation = Rotation.from_rotvec(rng.uniform(-1.0, 1.0, 3) * np.array([3e-3, 1.0, 0.05]))
        arguments = list(flat_box(0.0, rotation, along=rng.uniform(-1.1, 1.1) * HALF_LENGTH))
        support = np.abs(rotation.as_matrix()[2]) @ np.array(CORE) + EDGE
        x = rng.uniform(-0.3, 0.3) * HALF[0]
        arguments[0] = (x, arguments[0][1], np.sqrt((RADIUS + support) ** 2 - x * x) - 2e-4)
        s, overlap = sampled_line(arguments)
        wanted = trapezoid(overlap, s)
        area = box_cylinder(*arguments)[0]
        # The line is straight, the true distance to the axis along a skew one is not: 0.05 rad of skew bend it by
        # (0.05 x 12.5 mm)^2 / 2 R = 3e-6 m, over 25 mm; the cut at the end comes on top, by one sample.
        assert area == pytest.approx(wanted, abs=3e-6 * 0.025 + 1e-3 * wanted)


def test_the_force_is_the_slope_of_the_energy_of_the_sampled_overlap(rng):
    for _ in range(8):
        rotation = Rotation.from_rotvec(rng.uniform(-1.0, 1.0, 3) * np.array([1e-2, 0.05, 1.6]))
        arguments = list(flat_box(0.0, rotation))
        support = np.abs(rotation.as_matrix()[2]) @ np.array(CORE) + EDGE
        arguments[0] = (0.0, 0.01, RADIUS + support - rng.uniform(2e-4, 1e-3))

        def energy(shift, turn, arguments=arguments, rotation=rotation):
            moved = list(arguments)
            moved[0] = tuple(np.array(arguments[0]) + shift)
            moved[1] = quaternion(Rotation.from_rotvec(turn) * rotation)
            s, overlap = sampled_line(moved, 4001)
            return 0.5 * trapezoid(overlap**2, s)

        force, torque, twice = line_wrench(arguments)
        zero = np.zeros(3)
        slope = [(energy(-h, zero) - energy(h, zero)) / 2e-7 for h in 1e-7 * np.eye(3)]
        turning = [(energy(zero, -h) - energy(zero, h)) / 2e-5 for h in 1e-5 * np.eye(3)]
        scale = np.linalg.norm(force)
        # 4e-3: the samples, whose ends jump by 7e-6 m of the line as it turns.
        assert 0.5 * twice == pytest.approx(energy(zero, zero), rel=1e-3)
        assert force == pytest.approx(slope, abs=4e-3 * scale)
        assert torque == pytest.approx(turning, abs=4e-3 * scale * CORE[1])


def line_wrench(arguments):
    """Force and torque on the box and twice the energy of a line contact, all over the stiffness per length."""
    area, _, normal, point, _, lever, squares = box_cylinder(*arguments)
    force = area * np.array(normal)
    return force, np.cross(np.array(point) - arguments[0], force) + lever * force, squares


PLACES = {
    "on the mantle": lambda rng: rng.uniform(-1.0, 1.0) * (HALF_LENGTH - 2 * CORE[1]),
    "over the end": lambda rng: HALF_LENGTH + rng.uniform(-1.0, 1.0) * CORE[1],
    "just over the end": lambda rng: HALF_LENGTH + CORE[1] - 10.0 ** rng.uniform(-6.0, -3.0),
}


@pytest.mark.parametrize("tilt", [1e-3, 0.05, 0.5])
@pytest.mark.parametrize("place", PLACES)
def test_a_line_contact_makes_no_energy_on_any_way(place, tilt, rng):
    """Force and torque are the slopes of the energy the contact holds: on the mantle, over the end, against it."""
    for _ in range(40):
        # Skewed by more than 1e-5: below, the couple changes its sign gradually.
        rotation = Rotation.from_rotvec(rng.uniform(0.1, 1.0, 3) * tilt * rng.choice((-1.0, 1.0), 3))
        overlap, x = rng.uniform(1e-5, 1e-3), rng.uniform(-0.5, 0.5) * HALF[0]
        support = np.abs(rotation.as_matrix()[2]) @ np.array(CORE) + EDGE
        arguments = list(flat_box(0.0, rotation, PLACES[place](rng)))
        arguments[0] = np.array((x, arguments[0][1], np.sqrt((RADIUS + support) ** 2 - x * x) - overlap))

        def energy(shift, turn, arguments=arguments, rotation=rotation):
            moved = [arguments[0] + shift, quaternion(Rotation.from_rotvec(turn) * rotation), *arguments[2:]]
            return 0.5 * line_wrench(moved)[2]

        force, torque, _ = line_wrench(arguments)
        zero, step, turn = np.zeros(3), 1e-5 * overlap, 1e-7
        slope = [(energy(-h, zero) - energy(h, zero)) / (2 * step) for h in step * np.eye(3)]
        turning = [(energy(zero, -h) - energy(zero, h)) / (2 * turn) for h in turn * np.eye(3)]
        # Three points of Gauss leave a share of overlap / reach, 0.014 at most, of the edges' part.
        scale = np.linalg.norm(force)
        assert force == pytest.approx(slope, abs=2e-3 * scale)
        assert torque == pytest.approx(turning, abs=2e-3 * scale * CORE[1])


def test_a_box_that_leaves_over_the_cylinder_s_end_loses_its_force_in_proportion():
    full = box_cylinder(*flat_box(1e-4))[0]
    for share in (0.75, 0.5, 0.25, 0.01):
        along = HALF_LENGTH + (1.0 - 2.0 * share) * CORE[1]
        force, _, _ = line_wrench(flat_box(1e-4, along=along))
        # What it still holds, 1/2 o^2 times its height, it gives away as it leaves.
        assert force == pytest.approx((0.0, 0.5 * 1e-4**2, share * full), rel=1e-7, abs=1e-18)
    assert box_cylinder(*flat_box(1e-4, along=HALF_LENGTH + CORE[1]))[0] == 0.0


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_box_against_the_end_of_a_cylinder_is_pushed_out_along_the_axis(side):
    depth = 3e-4
    arguments = list(flat_box(0.0))
    arguments[0] = (0.01, side * (HALF_LENGTH + CORE[1] - depth), 0.02)
    area, length, normal, point, *_ = box_cylinder(*arguments)
    assert normal == pytest.approx((0.0, side, 0.0), abs=1e-15)
    assert area / length == pytest.approx(depth, rel=1e-9)
    assert point == pytest.approx((0.01, side * HALF_LENGTH, 0.02), abs=1e-12)
    arguments[0] = (0.01, side * (HALF_LENGTH + CORE[1] + 1e-12), 0.02)
    assert box_cylinder(*arguments)[0] == 0.0


@pytest.mark.parametrize("half_width", [0.0125, 0.025, 0.05])
def test_a_box_skewed_by_any_angle_carries_at_least_the_line_across_its_face(half_width):
    core = (0.0125, half_width, 0.001)
    for angle in np.linspace(0.0, 0.5 * np.pi, 181):
        orientation = quaternion(Rotation.from_euler("z", angle))
        centre = (0.0, 0.0, RADIUS + EDGE + core[2] - 2e-4)
        area, length, *_ = box_cylinder(
            centre, orientation, core, EDGE, (0.0, 0.0, 0.0), AXIS, RADIUS, HALF_LENGTH
        )
        line = 2 * min(core[1] / max(np.cos(angle), 1e-12), core[0] / max(np.sin(angle), 1e-12))
        # The edges beside the line may add to it; 1e-4: the regularisation shifts the line's ends.
        assert area > 2e-4 * line * (1 - 1e-4)
        assert length > line * (1 - 1e-4)
        assert area < 2e-4 * line * 1.4


SWEEPS = {
    "yaw by a quarter turn": lambda u: (Rotation.from_euler("z", 0.5 * np.pi * u), 0.0),
    "tilt until only an end touches": lambda u: (Rotation.from_euler("x", 0.2 * u), 0.0),
    "roll from the face over the edge to the side": lambda u: (
        Rotation.from_euler("y", 0.5 * np.pi * u),
        0.0,
    ),
    "leave over the end while tilted": lambda u: (Rotation.from_euler("x", 0.01), 0.17 + 0.04 * u),
    "come against the end": lambda u: (Rotation.from_euler("x", 1e-3), HALF_LENGTH + CORE[1] - 4e-4 * u),
    "yaw beside the end": lambda u: (Rotation.from_euler("z", 0.5 * np.pi * u), HALF_LENGTH),
}


@pytest.mark.parametrize("core", [CORE, (CORE[0], 2 * CORE[1], CORE[2]), (2 * CORE[0], CORE[1], CORE[2])])
@pytest.mark.parametrize("sweep", SWEEPS)
def test_the_line_contact_has_no_jump_in_a_sweep(sweep, core):
    def force_at(u):
        rotation, along = SWEEPS[sweep](u)
        return np.array(box_cylinder(*flat_box(2e-4, rotation, along, core))[0])

    force = np.array([force_at(u) for u in np.linspace(0.0, 1.0, 2001)])
    # A continuous force with slopes of the order of itself over a twentieth of the sweep moves by 1 % a sample. Where a
    # tilted box first reaches over the end its force begins with 1/2 o^2 along the axis, o < 3.3e-4 m.
    assert np.abs(np.diff(force)).max() < max(0.01 * force.max(), 0.5 * 3.3e-4**2)


def test_a_box_far_from_a_cylinder_does_not_touch_it():
    assert box_cylinder(*flat_box(-1e-9))[1] == 0.0


def test_a_box_whose_middle_lies_on_the_axis_gets_a_finite_contact():
    arguments = list(flat_box(0.0))
    arguments[0] = (0.0, 0.0, 0.0)
    area, length, normal, point, *_ = box_cylinder(*arguments)
    assert np.isfinite([area, length, *normal, *point]).all()
    assert np.linalg.norm(normal) == pytest.approx(1.0)
    assert area > 0.0


@pytest.mark.parametrize("core", [(0.0, 0.0, 0.0), (0.01, 0.0, 0.0), (0.0, 0.01, 0.0), (0.01, 0.01, 0.0)])
def test_boxes_that_are_all_edge_radius_touch_along_the_flat_of_a_lesser_one(core):
    """A ball, a capsule across and along the axis, a slab without flat sides."""
    centre = (0.0, 0.0, RADIUS + EDGE - 1e-4)
    area, length, normal, point, *_ = box_cylinder(
        centre, UPRIGHT, core, EDGE, (0.0, 0.0, 0.0), AXIS, RADIUS, HALF_LENGTH
    )
    assert np.isfinite([area, length, *normal, *point]).all()
    assert length == pytest.approx(2 * core[1] + 0.4 * EDGE, rel=1e-12)
    assert area == pytest.approx(length * 1e-4, rel=1e-9)


@pytest.mark.parametrize("flat", [0.0, 1e-6, 1e-4])
def test_a_belt_without_flat_sides_is_held_by_an_upright_guide_roller(flat):
    """Its edge is a half round of 5 mm: nearly the force of two crossed cylinders, at any thickness of the flat."""
    half, overlap = 0.005, 2e-4
    edge = half - flat
    centre = (0.02 + RADIUS - overlap, 0.0, 0.1)
    area, length, normal, point, *_ = box_cylinder(
        centre, UPRIGHT, (0.02 - edge, 0.02 - edge, flat), edge, (0.0, 0.0, 0.1), (0.0, 0.0, 1.0), RADIUS, 0.1
    )
    assert normal == pytest.approx((1.0, 0.0, 0.0), abs=1e-12)
    assert point == pytest.approx((RADIUS, 0.0, 0.1), abs=1e-12)
    assert area == pytest.approx(length * overlap, rel=1e-9)
    # Hertz: 4/3 sqrt(R*) d^(3/2) of crossed radii 5 and 66 mm against pi/4 l d; a factor of 2 is the law's choice.
    hertz = 4 / 3 * np.sqrt(np.sqrt(half * RADIUS) * half * RADIUS / (half + RADIUS) / np.sqrt(half * RADIUS))
    assert 0.5 < np.pi / 4 * area / (hertz * overlap**1.5) < 2.0


@pytest.fixture
def rng():
    return np.random.default_rng(5)
