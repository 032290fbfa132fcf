"""The foundation between two rounded boxes, against its formula written out slowly, and its symmetries."""

import itertools

import numpy as np
import pytest
from numba import njit
from scipy.spatial.transform import Rotation

from beltsim.solver import box_box
from beltsim.solver.contact import HertzPair, LinearPair, face_law

EDGE = 0.004
CELL = (0.0125, 0.0125, 0.001)  # core of a belt cell of 25 mm pitch and 10 mm thickness
PLATE = (0.05, 0.04, 0.002)
CUBE = (0.012, 0.012, 0.012)
REST = (0.0, 0.0, 0.0)


@njit
def both(first, core_1, radius_1, second, core_2, radius_2):
    return box_box.box_box(first, core_1, radius_1, second, core_2, radius_2)


def body(place, turned=None, velocity=REST, spin=REST):
    turned = Rotation.identity() if turned is None else turned
    return tuple(
        tuple(map(float, part)) for part in (place, turned.as_quat(scalar_first=True), velocity, spin)
    )


def foundation(first, core_1, second, core_2, radius_1=EDGE, radius_2=EDGE):
    """Energy, elastic and viscous loads (3, 3), touching area and centre of the pressure, for K = 1."""
    energy, elastic, viscous, area, point = both(first, core_1, radius_1, second, core_2, radius_2)
    return energy, np.array(elastic), np.array(viscous), area, np.array(point)


# --- the same law, written out ------------------------------------------------------------------------------------


def smooth_step(u, reach):
    u = np.clip(u / reach, -1.0, 1.0)
    return np.where(u < 0.0, 0.5 * (1.0 + u) ** 2, 1.0 - 0.5 * (1.0 - u) ** 2)


def phi(points, core, reach):
    """Field of a box at local points (n, 3)."""
    thin = 2 - int(np.argmin(core[::-1]))
    value = reach**2 * np.ones(len(points))
    for k, half in enumerate(core):
        y = points[:, k]
        if k == thin or half < 0.125 * reach:
            middle = 0.25 * reach
            slope = max(0.0, reach - abs(half - middle)) / reach**2
            rounded = smooth_step(half - middle, reach) + 0.5 * slope * (middle - y**2 / middle)
            value *= np.where(np.abs(y) < middle, rounded, smooth_step(half - np.abs(y), reach))
        else:
            value *= smooth_step(y + half, reach) - smooth_step(y - half, reach)
    return value


def points_of(core, edge, reach):
    """Points (n, 3) on the surface of a core and their weights (n,)."""
    widths = [max(2.0 * half, edge) for half in core]
    counts = [0 if 2.0 * half < 0.05 * reach else int(np.ceil(2.0 * half / (1.25 * reach))) for half in core]
    places, shares, ends = [], [], []
    for half, count, width in zip(core, counts, widths):
        places.append(np.linspace(-half, half, count + 1) if count else np.zeros(1))
        share = np.full(count + 1, width / max(count, 1))
        end = np.zeros(count + 1)
        if count:
            share[[0, -1]] *= 0.5
            end[[0, -1]] = 1.0
        else:
            end[:] = 2.0
        shares.append(share)
        ends.append(end)
    points, weights, on_face = [], [], []
    thin = 2 - int(np.argmin(core[::-1]))
    for index in itertools.product(*(range(len(place)) for place in places)):
        points.append([places[k][index[k]] for k in range(3)])
        weights.append(
            sum(
                ends[k][index[k]] * np.prod([shares[m][index[m]] for m in range(3) if m != k])
                for k in range(3)
            )
        )
        on_face.append(index[thin] == 0)
    weights, on_face = np.array(weights), np.array(on_face)
    area = np.prod([width for k, width in enumerate(widths) if k != thin])
    return np.array(points), weights * area / weights[on_face].sum()


def slow_energy(pose_1, core_1, pose_2, core_2, edge_1=EDGE, edge_2=EDGE):
    """U / K of two boxes with poses (place, Rotation): every point in the other's field."""
    total = 0.0
    for (place, turned), core, edge, (other, its_turn), its_core in (
        (pose_1, core_1, edge_1, pose_2, core_2),
        (pose_2, core_2, edge_2, pose_1, core_1),
    ):
        points, weights = points_of(core, edge, edge_1 + edge_2)
        local = its_turn.inv().apply(turned.apply(points) + np.subtract(place, other))
        total += 0.5 * np.sum(weights * phi(local, its_core, edge_1 + edge_2))
    return total


def slow_loads(pose_1, core_1, pose_2, core_2, step=1e-7):
    """Force on the first box and torques on both, as differences of the slow energy."""

    def moved(shift, turn, which):
        poses = [pose_1, pose_2]
        place, turned = poses[which]
        poses[which] = (np.add(place, shift), Rotation.from_rotvec(turn) * turned)
        return slow_energy(poses[0], core_1, poses[1], core_2)

    loads = np.zeros((3, 3))
    angle = step / 0.01
    for k, unit in enumerate(np.eye(3)):
        loads[0, k] = -(moved(step * unit, REST, 0) - moved(-step * unit, REST, 0)) / (2 * step)
        for which in (0, 1):
            energies = [moved(REST, sign * angle * unit, which) for sign in (1, -1)]
            loads[1 + which, k] = -(energies[0] - energies[1]) / (2 * angle)
    return loads


DOWN_EDGE = Rotation.from_euler("x", 45, degrees=True)
DOWN_CORNER = Rotation.from_euler("xy", [45, -35.264389682754654], degrees=True)
MEETINGS = {
    "face on face": (CELL, (0.003, -0.002, 0.0099), None, PLATE),
    "face on face, turned": (CELL, (0.02, 0.01, 0.0107), Rotation.from_euler("z", 0.4), PLATE),
    "face on face, tilted": (CELL, (0.02, 0.01, 0.0109), Rotation.from_euler("xy", [0.01, 0.02]), PLATE),
    "edge on face": (CUBE, (0.004, 0.003, 0.002 + 2 * EDGE + 0.012 * np.sqrt(2) - 1e-4), DOWN_EDGE, PLATE),
    "corner on face": (
        CUBE,
        (0.004, 0.003, 0.002 + 2 * EDGE + 0.012 * np.sqrt(3) - 1e-4),
        DOWN_CORNER,
        PLATE,
    ),
    "side by side": (CELL, (0.025 + 2 * EDGE - 1e-4, 0.003, 0.0005), None, CELL),
    "edge across edge": (
        CUBE,
        (0.05 + 0.004, 0.0, 0.002 + 0.004 + 0.012 * np.sqrt(2)),
        Rotation.from_euler("xz", [45, 90], degrees=True),
        PLATE,
    ),
    "corner to corner": (CUBE, (0.012 * np.sqrt(3) * 2 + 2 * EDGE - 4e-3, 0.0, 0.0), None, CUBE),
}


@pytest.mark.parametrize("name", MEETINGS)
def test_forces_and_moments_are_those_of_the_energy_written_out(name):
    core, place, turned, other = MEETINGS[name]
    turned = Rotation.identity() if turned is None else turned
    its_turn = Rotation.identity()
    if name == "corner to corner":
        turned = its_turn = Rotation.align_vectors([[1.0, 0.0, 0.0]], [np.ones(3)])[0]
    energy, elastic, *_ = foundation(body(place, turned), core, body(REST, its_turn), other)
    poses = (np.array(place), turned), (np.zeros(3), its_turn)
    assert energy == pytest.approx(slow_energy(poses[0], core, poses[1], other), rel=1e-11)
    assert energy > 0.0
    wanted = slow_loads(poses[0], core, poses[1], other)
    # Differences over 1e-7 m: rounding 1e-9 of the force, and 1e-7 / overlap where the force has a kink.
    size = np.linalg.norm(wanted[0])
    np.testing.assert_allclose(elastic[0], wanted[0], atol=1e-5 * size)
    np.testing.assert_allclose(elastic[1:], wanted[1:], atol=1e-5 * size * 0.02)


def test_a_face_in_the_middle_of_a_wide_one_presses_with_its_area_times_the_overlap():
    overlap = 1e-4
    place = (0.0, 0.0, CELL[2] + PLATE[2] + 2 * EDGE - overlap)
    energy, elastic, _, area, point = foundation(body(place), CELL, body(REST), PLATE)
    face = (2 * CELL[0]) ** 2
    # The plate's points see the cell's smoothed rim at the spacing of 10 mm: (h / pi R)^2 = 16 % of one row at most.
    assert elastic[0] == pytest.approx([0.0, 0.0, face * overlap], rel=0.05, abs=1e-12)
    assert energy == pytest.approx(0.5 * elastic[0, 2] * overlap, rel=1e-9)
    # Points under the smoothed rim are pushed outwards too, by at most overlap / R of what lifts them.
    assert area == pytest.approx(elastic[0, 2] / overlap, rel=overlap / (2 * EDGE))
    assert point == pytest.approx([0.0, 0.0, CELL[2] + PLATE[2]], abs=0.01)


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.0125, 0.0), (0.0031, 0.0102), (0.0125, 0.0125)])
@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 4])
def test_cells_of_a_belt_are_one_surface_wherever_a_face_lies_on_them(shift, angle):
    overlap = 1e-4
    face = body((*shift, 2 * CELL[2] + 2 * EDGE - overlap), Rotation.from_euler("z", angle))
    total, torque = np.zeros(3), np.zeros(3)
    for i, j in itertools.product(range(-3, 4), repeat=2):
        cell = body((0.025 * i, 0.025 * j, 0.0))
        _, elastic, _, _, _, _ = box_box.points_in_field(face, CELL, EDGE, cell, CELL, 2 * EDGE)
        total += elastic[0]
        torque += elastic[1]
    area = (2 * CELL[0]) ** 2
    assert total == pytest.approx([0.0, 0.0, area * overlap], abs=1e-12 * area * overlap)
    assert torque == pytest.approx(REST, abs=1e-12 * area * overlap)


@pytest.mark.parametrize("edge", [0.001, 0.004, 0.005])
def test_a_belt_that_lies_on_a_belt_feels_no_grid_below(edge, rng):
    overlap, pitch = 5e-5, 0.025
    core = (0.5 * pitch, 0.5 * pitch, 0.005 - edge)
    cells = np.array(list(itertools.product(pitch * np.arange(-5, 6), repeat=2)))
    own = np.array(list(itertools.product(pitch * np.arange(-1.5, 2), repeat=2)))
    forces = []
    for _ in range(12):
        angle, shift = rng.uniform(0.0, np.pi / 4), rng.uniform(-pitch, pitch, 2)
        turned = Rotation.from_euler("z", angle)
        places = turned.apply(np.column_stack([own, np.zeros(len(own))]))[:, :2] + shift
        total = 0.0
        for place in places:
            upper = body((*place, 0.01 - overlap), turned)
            near = cells[np.max(np.abs(cells - place), axis=1) < 2.0 * pitch]
            for cell in near:
                total += foundation(upper, core, body((*cell, 0.0)), core, edge, edge)[1][0, 2]
        forces.append(total / (overlap * len(own) * pitch**2))
    # A belt of four by four cells, whose ends cross rows of points: ends apart nothing would be left.
    assert np.ptp(forces) < 0.02
    assert np.mean(forces) == pytest.approx(1.0, abs=0.01)


# --- symmetries ---------------------------------------------------------------------------------------------------


def random_pairs(rng, count):
    """Poses, cores and motions of pairs of boxes of all kinds that touch."""
    found = 0
    while found < count:
        cores = [tuple(rng.uniform(0.0005, 0.02, 3)) for _ in range(2)]
        radii = rng.uniform(0.002, 0.006, 2)
        poses = [(rng.uniform(-0.012, 0.012, 3), Rotation.random(random_state=rng)) for _ in range(2)]
        motion = rng.normal(size=(4, 3))
        bodies = [body(*pose, motion[2 * k], motion[2 * k + 1]) for k, pose in enumerate(poses)]
        if foundation(bodies[0], cores[0], bodies[1], cores[1], *radii)[3] > 0.0:
            found += 1
            yield bodies, cores, radii, poses


def test_action_equals_reaction_and_the_order_of_the_boxes_does_not_matter(rng):
    for (one, two), (core_1, core_2), (radius_1, radius_2), _ in random_pairs(rng, 100):
        energy, elastic, viscous, area, point = foundation(one, core_1, two, core_2, radius_1, radius_2)
        other = foundation(two, core_2, one, core_1, radius_2, radius_1)
        for loads, back in ((elastic, other[1]), (viscous, other[2])):
            size = np.abs(loads[0]).max()
            np.testing.assert_allclose(back[0], -loads[0], atol=1e-12 * size)
            np.testing.assert_allclose(back[1:], loads[:0:-1], atol=1e-12 * size)
            arm = np.subtract(one[0], two[0])
            assert np.cross(arm, loads[0]) + loads[1] + loads[2] == pytest.approx(REST, abs=1e-12 * size)
        assert (energy, area) == pytest.approx((other[0], other[3]), rel=1e-12)
        assert point == pytest.approx(other[4], abs=1e-12)


def test_turned_and_moved_together_two_boxes_feel_turned_forces(rng):
    for (one, two), (core_1, core_2), radii, poses in random_pairs(rng, 60):
        turn, shift = Rotation.random(random_state=rng), rng.uniform(-1.0, 1.0, 3)
        moved = [
            body(turn.apply(place) + shift, turn * turned, turn.apply(given[2]), turn.apply(given[3]))
            for (place, turned), given in zip(poses, (one, two))
        ]
        before = foundation(one, core_1, two, core_2, *radii)
        after = foundation(moved[0], core_1, moved[1], core_2, *radii)
        for k in (1, 2):
            # Places 1 m off are rounded to 1e-16 m, of overlaps around 1e-3 m.
            size = np.abs(before[k][0]).max()
            np.testing.assert_allclose(after[k], turn.apply(before[k]), atol=1e-11 * size)
        assert after[4] == pytest.approx(turn.apply(before[4]) + shift, abs=1e-11)


def test_damping_only_takes_energy_and_none_from_a_common_rigid_motion(rng):
    for (one, two), (core_1, core_2), radii, _ in random_pairs(rng, 60):
        loads = foundation(one, core_1, two, core_2, *radii)[2]
        power = (
            np.dot(loads[0], np.subtract(one[2], two[2]))
            + np.dot(loads[1], one[3])
            + np.dot(loads[2], two[3])
        )
        assert power <= 0.0
        spin = np.array(one[3])
        carried = [(*given[:2], tuple(np.cross(spin, given[0])), tuple(spin)) for given in (one, two)]
        still = foundation(carried[0], core_1, carried[1], core_2, *radii)[2]
        assert np.abs(still).max() <= 1e-13 * np.abs(loads).max()


@pytest.mark.parametrize("seed", range(6))
def test_forces_change_gradually_on_any_way(seed):
    rng = np.random.default_rng(seed)
    (_, two), (core_1, core_2), radii, poses = next(random_pairs(rng, 1))
    centre, away = np.array(two[0]), poses[0][0] - np.array(two[0])
    away /= np.linalg.norm(away)
    touching = [
        s for s in np.linspace(0.0, 0.1, 1001) if fits(centre + s * away, poses, core_1, two, core_2, radii)
    ]
    # Both cores stay outside each other: nobody passes anybody's middle, where the law has no meaning.
    start = centre + (max(touching) - 0.5 * radii.sum()) * away
    way, axis = 0.25 * radii.sum() * unit(rng), 0.1 * unit(rng)

    def largest_jump(steps):
        loads = []
        for s in np.linspace(-1.0, 1.0, steps):
            moved = body(start + s * way, Rotation.from_rotvec(s * axis) * poses[0][1])
            loads.append(foundation(moved, core_1, two, core_2, *radii)[1][0])
        return np.abs(np.diff(loads, axis=0)).max()

    # Lipschitz: four times finer steps have about a fourth of the largest change.
    assert 0.0 < largest_jump(4001) < 0.3 * largest_jump(1001)


def unit(rng):
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def fits(place, poses, core_1, two, core_2, radii):
    return foundation(body(place, poses[0][1]), core_1, two, core_2, *radii)[3] > 0.0


def test_bars_that_cross_press_with_the_area_they_cross_on_wherever_their_points_are():
    bar, edge, overlap = (0.048, 0.003, 0.003), 0.002, 1e-4
    forces = []
    for angle in (90, 50):
        turned = Rotation.from_euler("z", angle, degrees=True)
        for shift in itertools.product(np.linspace(0.0, 0.0096, 23), repeat=2):
            upper = body((*shift, 2 * bar[2] + 2 * edge - overlap), turned)
            area = 36e-6 / np.sin(np.radians(angle))
            forces.append(foundation(upper, bar, body(REST), bar, edge, edge)[1][0, 2] / (area * overlap))
    # Points stand 4.8 mm apart, the bars are 6 mm wide, and the fields end over 8 mm: within 3 % was measured.
    assert 0.96 < min(forces) < max(forces) < 1.01


def test_boxes_that_do_not_reach_each_other_feel_nothing():
    for gap in ((0.025 + 2 * EDGE, 0.0, 0.0), (0.0, 0.0, 2 * CELL[2] + 2 * EDGE), (1.0, 2.0, 3.0)):
        energy, elastic, viscous, area, _ = foundation(body(gap), CELL, body(REST), CELL)
        assert (energy, area) == (0.0, 0.0)
        assert not np.any(elastic)
        assert not np.any(viscous)


def test_stiffness_of_faces_follows_from_the_moduli_or_is_given():
    hertz = HertzPair(2.75e6, 0.8e6, 0.1, 0.5, 0.0, 0.0)
    # Two layers of 5 mm of E / (1 - nu^2) = 5.5 MPa in series: 5.5e6 / 0.01 Pa/m.
    assert face_law(hertz, 0.005, 6.25e-4) == pytest.approx((5.5e8, 6.4e8, 0.1))
    linear = LinearPair(1e5, 4e4, 0.2, 0.5, 0.0, 0.0)
    assert face_law(linear, 0.005, 5e-4) == pytest.approx((2e8, 8e7, 0.2))


@pytest.fixture
def rng():
    return np.random.default_rng(7)
