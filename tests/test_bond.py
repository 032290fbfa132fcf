"""The bond law against its energy: gradient, balance, objectivity, and the cases where such laws go wrong."""

import math
from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from beltsim.scene.bodies import make_particles
from beltsim.scene.bond_runs import in_runs
from beltsim.solver.bond import half_angle_excess
from beltsim.solver.bonds import bond_measures, bond_pass
from beltsim.solver.state import BondKinds, Bonds

COUNT = 200


def rotation(quaternions):
    return Rotation.from_quat(np.asarray(quaternions).T, scalar_first=True)


def columns(rotations):
    return np.ascontiguousarray(rotations.as_quat(scalar_first=True).T)


def pairs_of_particles(seed=1, count=COUNT, largest=170.0, damping=False):
    """`count` separate bonds in random states: particles, bonds, kinds. Bond b joins particles 2b and 2b + 1."""
    random = np.random.default_rng(seed)
    triad_i, triad_j = Rotation.random(count, rng=random), Rotation.random(count, rng=random)
    axis = random.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    angle = np.radians(largest) * random.random(count)
    frame_i = Rotation.random(count, rng=random)
    frame_j = frame_i * Rotation.from_rotvec(axis * angle[:, None])
    position = random.normal(size=(2 * count, 3))
    orientation = np.empty((2 * count, 4))
    orientation[0::2] = (frame_i * triad_i.inv()).as_quat(scalar_first=True)
    orientation[1::2] = (frame_j * triad_j.inv()).as_quat(scalar_first=True)
    particles = make_particles(position, orientation, np.ones(2 * count), np.ones((2 * count, 3)))
    kinds = BondKinds(
        rest_length=0.5 + random.random(count),
        triad_first=columns(triad_i),
        triad_second=columns(triad_j),
        stiffness=0.5 + random.random((3, count)),
        angular_stiffness=0.5 + random.random((3, count)),
        damping=random.random((3, count)) * damping,
        angular_damping=random.random((3, count)) * damping,
    )
    ends = np.arange(count, dtype=np.int32)
    return particles, bonds_between(2 * ends, 2 * ends + 1), kinds


def bonds_between(first, second):
    count = first.size
    return Bonds(
        first.astype(np.int32),
        second.astype(np.int32),
        np.arange(count, dtype=np.int32),
        np.ones(count, np.int8),
        np.zeros(1, np.int64),
    )


def loads(particles, bonds, kinds):
    """Force on the first, torques on the first and on the second particle of each bond, (3, m) each."""
    particles.force[:] = particles.torque[:] = 0.0
    order, runs = in_runs(bonds.first, bonds.second, bonds.kind)
    np.testing.assert_array_equal(order, np.arange(order.size))
    bond_pass(particles, bonds, runs, kinds, None, 0)
    # Every particle has one bond, so its loads are the bond's.
    return (
        particles.force[:, bonds.first],
        particles.torque[:, bonds.first],
        particles.torque[:, bonds.second],
    )


def energies(particles, bonds, kinds):
    """The energy of each bond, written down as in the theory, with rotation vectors and matrices."""
    i, j = bonds.first, bonds.second
    first = rotation(particles.orientation[:, i]) * rotation(kinds.triad_first)
    second = rotation(particles.orientation[:, j]) * rotation(kinds.triad_second)
    turn = (first.inv() * second).as_rotvec()
    middle = first * Rotation.from_rotvec(0.5 * turn)
    e = middle.inv().apply((particles.position[:, j] - particles.position[:, i]).T)
    e[:, 0] = np.linalg.norm(e, axis=1) - kinds.rest_length
    return 0.5 * np.sum(kinds.stiffness.T * e**2 + kinds.angular_stiffness.T * turn**2, axis=1)


def moved(particles, slots, shift=(0, 0, 0), turn=(0, 0, 0)):
    """The particles with some shifted and turned by small amounts, in world axes."""
    position, orientation = particles.position.copy(), particles.orientation.copy()
    position[:, slots] += np.asarray(shift, float)[:, None]
    orientation[:, slots] = columns(Rotation.from_rotvec(turn) * rotation(orientation[:, slots]))
    return particles._replace(position=position, orientation=orientation)


@pytest.mark.parametrize("end", [0, 1])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_loads_are_the_gradient_of_the_energy_up_to_170_degrees(end, axis):
    particles, bonds, kinds = pairs_of_particles()
    force, torque_1, torque_2 = loads(particles, bonds, kinds)
    slots = bonds.first if end == 0 else bonds.second
    h, unit = 1e-5, np.eye(3)[axis]

    def slope(name):
        ahead = energies(moved(particles, slots, **{name: h * unit}), bonds, kinds)
        behind = energies(moved(particles, slots, **{name: -h * unit}), bonds, kinds)
        return -(ahead - behind) / (2.0 * h)

    # Central differences: h^2 U'''/6 = 2e-10 for derivatives of order 10, rounding 1e-15 * 10 / h = 1e-9.
    np.testing.assert_allclose((force if end == 0 else -force)[axis], slope("shift"), atol=5e-9)
    np.testing.assert_allclose((torque_1 if end == 0 else torque_2)[axis], slope("turn"), atol=5e-9)


def test_measured_energy_is_the_sum_of_the_energies():
    particles, bonds, kinds = pairs_of_particles()
    _, energy = bond_measures(particles, bonds, kinds)
    assert energy == pytest.approx(energies(particles, bonds, kinds).sum(), rel=1e-13)


def test_torques_balance_the_couple_of_the_force():
    particles, bonds, kinds = pairs_of_particles()
    force, torque_1, torque_2 = loads(particles, bonds, kinds)
    d = particles.position[:, bonds.second] - particles.position[:, bonds.first]
    couple = np.cross(d.T, force.T).T
    np.testing.assert_allclose(torque_1 + torque_2, couple, atol=2e-14)  # rounding of terms up to 10


def test_a_common_rigid_motion_turns_the_loads_with_it():
    particles, bonds, kinds = pairs_of_particles()
    before = loads(particles, bonds, kinds)
    turn = Rotation.from_rotvec([1.1, -0.7, 2.0])
    after = loads(
        particles._replace(
            position=np.ascontiguousarray(
                turn.apply(particles.position.T).T + np.array([[3.0], [-2.0], [1.0]])
            ),
            orientation=columns(turn * rotation(particles.orientation)),
        ),
        bonds,
        kinds,
    )
    for old, new in zip(before, after):
        np.testing.assert_allclose(
            new, turn.apply(old.T).T, atol=2e-13
        )  # rounding at 3 m off, terms up to 10


def test_the_sign_of_a_quaternion_does_not_matter():
    particles, bonds, kinds = pairs_of_particles()
    before = loads(particles, bonds, kinds)
    particles.orientation[:, ::3] *= -1.0
    kinds.triad_second[:, ::2] *= -1.0
    for old, new in zip(before, loads(particles, bonds, kinds)):
        np.testing.assert_array_equal(new, old)


def test_a_bond_written_from_its_other_end_gives_the_same_loads():
    particles, bonds, kinds = pairs_of_particles()
    force, torque_1, torque_2 = loads(particles, bonds, kinds)
    # Half a turn about e3 makes e1 point from the second particle to the first.
    half_turn = Rotation.from_rotvec([0.0, 0.0, math.pi])
    swapped = kinds._replace(
        triad_first=columns(rotation(kinds.triad_second) * half_turn),
        triad_second=columns(rotation(kinds.triad_first) * half_turn),
    )
    back = loads(particles, bonds_between(bonds.second, bonds.first), swapped)
    for old, new in zip((-force, torque_2, torque_1), back):
        np.testing.assert_allclose(new, old, atol=2e-14)


def aligned_bond(turn=(0.0, 0.0, 0.0), stretch=1.0, initial=(0.0, 0.0, 0.0)):
    """One bond of length 1 along x whose second particle is turned; `initial` is turned in the stress-free state."""
    orientation = np.stack([np.array([1.0, 0, 0, 0]), Rotation.from_rotvec(turn).as_quat(scalar_first=True)])
    position = np.array([[0.0, 0, 0], [stretch, 0, 0]])
    particles = make_particles(position, orientation, np.ones(2), np.ones((2, 3)))
    one = np.ones((3, 1))
    kinds = BondKinds(
        np.ones(1),
        np.array([[1.0], [0], [0], [0]]),
        columns(Rotation.from_rotvec([initial]).inv()),
        np.array([[7.0], [0], [0]]),
        np.array([[2.0], [3.0], [5.0]]),
        0.0 * one,
        0.0 * one,
    )
    return particles, bonds_between(np.array([0]), np.array([1])), kinds


def test_stretch_gives_tension_along_the_bond_only():
    force, torque_1, torque_2 = loads(*aligned_bond(stretch=1.01))
    np.testing.assert_allclose(force[:, 0], [0.07, 0.0, 0.0], atol=1e-15)
    assert not torque_1.any()
    assert not torque_2.any()


@pytest.mark.parametrize("angle", [1e-12, 1e-8, 1e-4, 0.06, 0.0633, 0.07, 1.0, math.radians(170.0), 3.14159])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_turn_about_a_section_axis_gives_its_stiffness_times_the_angle(angle, axis):
    turn = angle * np.eye(3)[axis]
    bond = aligned_bond(turn)
    measures, _ = bond_measures(*bond)
    stiffness = (2.0, 3.0, 5.0)[axis]
    # From a quaternion, sin of half the angle: exact to rounding at small angles, and to 1e-16 / cos near 180 degrees.
    assert measures[3 if axis == 0 else 2, 0] == pytest.approx(
        stiffness * angle, rel=1e-12 if angle < 3 else 1e-9
    )
    if axis == 0:
        _, torque_1, torque_2 = loads(*bond)
        np.testing.assert_allclose(torque_1[:, 0], stiffness * turn, rtol=1e-9)
        np.testing.assert_allclose(torque_2[:, 0], -stiffness * turn, rtol=1e-9)


def test_170_degrees_in_the_stress_free_state_give_no_load():
    turn = np.radians(170.0) * np.array([0.6, 0.0, 0.8])
    force, torque_1, torque_2 = loads(*aligned_bond(turn, initial=turn))
    for load in (torque_1, torque_2):
        np.testing.assert_allclose(load, 0.0, atol=1e-14)
    # The mid frame of a stress-free state is its bond triad: only rounding is left of the force.
    np.testing.assert_allclose(force, 0.0, atol=1e-14)


def half_angle_series(w):
    """(t/2) / sin(t/2) from w = 1 - cos(t/2), exactly: t/2 = 2 asin(y) with 2 y^2 = w, and the series of asin(y)."""
    total, term = Fraction(1), Fraction(1)
    for n in range(1, 70):  # terms fall by half each
        term *= w * Fraction(n, 2 * n + 1)
        total += term
    return total


@pytest.mark.parametrize("w", [0.0, 1e-30, 1e-12, *np.linspace(0.001, 1.0, 40)])
def test_the_half_angle_over_its_sine_is_exact_to_the_last_digits_at_any_angle(w):
    exact = half_angle_series(Fraction(float(w)))
    found = 1 + Fraction(float(w)) * Fraction(half_angle_excess(float(w)))
    # The polynomial is off by 2e-16, rounding of its terms adds as much.
    assert abs(float(found / exact - 1)) < 5e-16


def test_the_half_angle_over_its_sine_is_the_textbooks():
    half = np.linspace(0.01, 0.5 * math.pi, 50)
    found = [1.0 + (1.0 - math.cos(angle)) * half_angle_excess(1.0 - math.cos(angle)) for angle in half]
    np.testing.assert_allclose(found, half / np.sin(half), rtol=1e-14)


def viscous(particles, bonds, kinds, velocity, spin):
    """Viscous parts of force and torques for velocities (3, n) and spins (3, n)."""
    at_rest = loads(particles, bonds, kinds)
    moving = loads(particles._replace(velocity=velocity, angular_velocity=spin), bonds, kinds)
    return [new - old for old, new in zip(at_rest, moving)]


def test_a_rigid_rotation_is_not_damped():
    particles, bonds, kinds = pairs_of_particles(damping=True)
    spin = np.array([1.0, -2.0, 0.5])
    velocity = np.cross(spin, particles.position.T).T + np.array([[3.0], [1.0], [-2.0]])
    spins = np.tile(spin[:, None], (1, velocity.shape[1]))
    for load in viscous(particles, bonds, kinds, np.ascontiguousarray(velocity), spins):
        np.testing.assert_allclose(load, 0.0, atol=5e-14)


def test_damping_takes_energy_and_leaves_both_momenta():
    particles, bonds, kinds = pairs_of_particles(damping=True)
    random = np.random.default_rng(2)
    velocity, spin = random.normal(size=(2, *particles.position.shape))
    force, torque_1, torque_2 = viscous(particles, bonds, kinds, velocity, spin)
    i, j = bonds.first, bonds.second
    power = np.sum(
        force * (velocity[:, i] - velocity[:, j]) + torque_1 * spin[:, i] + torque_2 * spin[:, j], axis=0
    )
    assert np.all(power < 0.0)
    d = particles.position[:, j] - particles.position[:, i]
    np.testing.assert_allclose(torque_1 + torque_2, np.cross(d.T, force.T).T, atol=5e-14)


def test_broken_bonds_measure_nothing():
    particles, bonds, kinds = pairs_of_particles(count=2)
    bonds.intact[0] = 0
    measures, energy = bond_measures(particles, bonds, kinds)
    assert not measures[:, 0].any()
    assert energy == pytest.approx(energies(particles, bonds, kinds)[1], rel=1e-13)
