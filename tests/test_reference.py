"""The slow reference obeys the laws it is to be trusted for, and the table of targets agrees with its formulas."""

import math

import numpy as np
import pytest
from reference import (
    Body,
    bond_between,
    chain_loads,
    chain_tangent,
    energy,
    equilibrium,
    frequencies,
    head_on,
    loads,
    oblique,
    quaternion,
    rotation,
    section_stiffness,
    straight_chain,
    strains,
)
from scipy.spatial.transform import Rotation
from targets import (
    CHUNG_OOI_ELASTIC,
    STRIP,
    STRIP_VALUES,
    axial_extension,
    axial_frequency,
    axial_frequency_of_chain,
    cantilever_frequencies,
    cantilever_tip,
    end_twist,
    euler_load,
    euler_load_of_chain,
    roll_up_moment,
    saint_venant_constant,
    sliding_rebound,
    sphere_on_rigid_wall,
)

STIFFNESS = ([5.0, 2.0, 3.0], [0.4, 0.7, 1.1])


def random_state(seed):
    """A bond of random stress-free state, and its two bodies moved at random, up to 1 rad apart."""
    random = np.random.default_rng(seed)
    turns = Rotation.random(2, random_state=seed)
    a, b = (Body(random.normal(size=3), turn) for turn in turns)
    bond = bond_between(a, b, *STIFFNESS)
    return bond, a.moved(0.3 * random.normal(size=6)), b.moved(0.3 * random.normal(size=6))


@pytest.mark.parametrize("seed", range(5))
def test_the_stress_free_state_has_no_energy_and_no_loads(seed):
    random = np.random.default_rng(seed)
    a, b = (Body(random.normal(size=3), turn) for turn in Rotation.random(2, random_state=seed))
    bond = bond_between(a, b, *STIFFNESS)
    # Strains of some 1e-16, squared, times stiffnesses of 5.
    assert energy(bond, a, b) < 1e-29
    # The error of the differences is step^4 = 1e-12 times k L^2, about 50 here.
    np.testing.assert_allclose(loads(bond, a, b), 0, atol=1e-10)


@pytest.mark.parametrize("seed", range(5))
def test_a_common_rigid_motion_changes_no_energy(seed):
    bond, a, b = random_state(seed)
    turn, shift = Rotation.random(random_state=seed + 100), np.array([3.0, -2.0, 7.0])
    moved = [Body(turn.apply(body.position) + shift, turn * body.turn) for body in (a, b)]
    assert energy(bond, *moved) == pytest.approx(energy(bond, a, b), rel=1e-13)


@pytest.mark.parametrize("seed", range(5))
def test_loads_balance_in_force_and_moment(seed):
    bond, a, b = random_state(seed)
    on_a, on_b = loads(bond, a, b)
    scale = np.abs(on_a).max()
    np.testing.assert_allclose(on_a[:3] + on_b[:3], 0, atol=1e-9 * scale)
    moment = np.cross(a.position, on_a[:3]) + np.cross(b.position, on_b[:3]) + on_a[3:] + on_b[3:]
    np.testing.assert_allclose(moment, 0, atol=1e-9 * scale)


@pytest.mark.parametrize("seed", range(5))
def test_it_does_not_matter_which_body_comes_first(seed):
    random = np.random.default_rng(seed)
    a, b = (Body(random.normal(size=3), turn) for turn in Rotation.random(2, random_state=seed))
    bond, mirrored = bond_between(a, b, *STIFFNESS), bond_between(b, a, *STIFFNESS)
    a, b = a.moved(0.3 * random.normal(size=6)), b.moved(0.3 * random.normal(size=6))
    assert energy(mirrored, b, a) == pytest.approx(energy(bond, a, b), rel=1e-12)


def test_quaternions_of_both_signs_are_one_rotation():
    q = np.array([0.5, -0.1, 0.7, 0.2])
    q /= np.linalg.norm(q)
    np.testing.assert_allclose(rotation(q).as_matrix(), rotation(-q).as_matrix(), atol=1e-15)
    assert abs(quaternion(rotation(q)) @ q) == pytest.approx(1, abs=1e-15)


def pair():
    """Two bodies 1 m apart along x, and their bond."""
    a, b = (Body(np.array([x, 0.0, 0.0]), Rotation.identity()) for x in (0.0, 1.0))
    return bond_between(a, b, *STIFFNESS), a, b


def test_stretch_gives_the_axial_stiffness():
    bond, a, b = pair()
    on_a, on_b = loads(bond, a, b.moved(np.array([0.1, 0, 0, 0, 0, 0])))
    np.testing.assert_allclose(on_a, [0.5, 0, 0, 0, 0, 0], atol=1e-11)
    np.testing.assert_allclose(on_b, [-0.5, 0, 0, 0, 0, 0], atol=1e-11)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("degrees", [1, 90, 170])
def test_a_relative_rotation_gives_its_moment_up_to_170_degrees(axis, degrees):
    angle = math.radians(degrees)
    turn = np.zeros(3)
    turn[axis] = angle
    bond, a, b = pair()
    # The second body goes to where the mid frame wants it: no displacement, moments only.
    halfway = Rotation.from_rotvec(turn / 2)
    b = Body(halfway.apply([1.0, 0, 0]), Rotation.from_rotvec(turn))
    e, angles = strains(bond, a, b)
    np.testing.assert_allclose(e, 0, atol=1e-15)
    np.testing.assert_allclose(angles, turn, atol=1e-14)
    on_a, on_b = loads(bond, a, b)
    expected = np.zeros(6)
    expected[3 + axis] = STIFFNESS[1][axis] * angle
    np.testing.assert_allclose(on_a, expected, atol=1e-9)
    np.testing.assert_allclose(on_b, -expected, atol=1e-9)


def test_a_sideways_shift_gives_shear_and_half_of_its_couple_to_each_body():
    bond, a, b = pair()
    shift = 1e-3
    on_a, on_b = loads(bond, a, b.moved(np.array([0, 0, shift, 0, 0, 0])))
    force = STIFFNESS[0][2] * shift
    # The chord is longer by w^2/2, and this tension has no couple.
    length = math.hypot(1.0, shift)
    tension = STIFFNESS[0][0] * (length - 1.0) / length
    # d x f = (1, 0, w) x (0, 0, f): -f about y, half of it on each.
    np.testing.assert_allclose(on_a, [tension, 0, force + tension * shift, 0, -force / 2, 0], atol=1e-11)
    np.testing.assert_allclose(on_b, [-tension, 0, -force - tension * shift, 0, -force / 2, 0], atol=1e-11)


# --- chains against beam theory -----------------------------------------------------------------------------------


def tip_compliance(bonds, **options):
    """Tip deflection under a unit load, of small displacements [m/N]."""
    stiffness = chain_tangent(*straight_chain(STRIP, bonds, **options))[6:, 6:]
    load = np.zeros(len(stiffness))
    load[-4] = 1.0
    return np.linalg.solve(stiffness, load)[-4]


@pytest.mark.parametrize("bonds", [1, 3, 8])
def test_a_chain_of_beam_bonds_is_a_timoshenko_cantilever_for_any_number_of_bonds(bonds):
    # The tangent is good to 1e-10 of its largest stiffness, 1e4 times the bending's at one bond: 1e-6, and a solve.
    assert tip_compliance(bonds) == pytest.approx(cantilever_tip(STRIP, 1.0), rel=1e-5)


def test_the_cantilever_at_rest_under_its_target_load():
    bodies, chain = straight_chain(STRIP, 6)
    at_rest = equilibrium(bodies, chain, np.array([0, 0, -0.01, 0, 0, 0]))
    # P L^2 / EI = 0.024: large deflections take off 2e-5.
    assert -at_rest[-1].position[2] == pytest.approx(cantilever_tip(STRIP, 0.01), rel=1e-4)


@pytest.mark.parametrize("bonds", [2, 5])
def test_shear_springs_leave_the_known_error_of_one_over_four_n_squared(bonds):
    bending = 1 / (3 * STRIP.bending_rigidity) * (1 - 1 / (4 * bonds**2))
    expected = bending + 1 / STRIP.shear_rigidity
    assert tip_compliance(bonds, shear="SPRING") == pytest.approx(expected, rel=1e-5)


def test_the_reduction_factor_scales_bending_and_leaves_the_axial_stiffness():
    full, reduced = (section_stiffness(STRIP, 0.1, reduction=f) for f in (1.0, 0.1))
    assert reduced[0][0] == full[0][0]
    assert reduced[1][1] == pytest.approx(0.1 * full[1][1], rel=1e-15)
    np.testing.assert_array_equal(reduced[1][[0, 2]], full[1][[0, 2]])
    soft = 10 / (3 * STRIP.bending_rigidity) + 1 / STRIP.shear_rigidity
    assert tip_compliance(4, reduction=0.1) == pytest.approx(soft, rel=1e-5)


def test_axial_extension_and_end_twist():
    bodies, chain = straight_chain(STRIP, 4)
    at_rest = equilibrium(bodies, chain, np.array([500.0, 0, 0, 0, 0, 0]))
    assert at_rest[-1].position[0] - 1 == pytest.approx(axial_extension(STRIP, 500.0), rel=1e-9)
    at_rest = equilibrium(bodies, chain, np.array([0, 0, 0, 0.05, 0, 0]))
    # The bond's closed form of J is within 3e-5 of the series.
    assert at_rest[-1].turn.as_rotvec()[0] == pytest.approx(end_twist(STRIP, 0.05), rel=3e-5)


def test_a_strip_rolled_up_by_its_end_moment_closes_and_is_at_rest():
    bonds = 12
    _, chain = straight_chain(STRIP, bonds)
    bend = Rotation.from_rotvec([0, -2 * math.pi / bonds, 0])
    half = Rotation.from_rotvec([0, -math.pi / bonds, 0])
    bodies = [Body(np.zeros(3), Rotation.identity())]
    for bond in chain:
        last = bodies[-1]
        reach = (last.turn * half).apply([bond.length, 0, 0])
        bodies.append(Body(last.position + reach, last.turn * bend))
    np.testing.assert_allclose(bodies[-1].position, 0, atol=1e-12)
    total = chain_loads(bodies, chain)
    moment = roll_up_moment(STRIP)
    # Stiff axial springs (6e5 N/m) and differences of 1e-3: rounding leaves 1e-9.
    np.testing.assert_allclose(total[1:-1], 0, atol=1e-8)
    np.testing.assert_allclose(total[0], [0, 0, 0, 0, -moment, 0], atol=1e-8)
    np.testing.assert_allclose(total[-1], [0, 0, 0, 0, moment, 0], atol=1e-8)


@pytest.mark.parametrize(("share", "stable"), [(0.98, True), (1.02, False)])
def test_a_column_buckles_at_eulers_load(share, stable):
    bodies, chain = straight_chain(STRIP, 8, shear="SPRING")
    load = share * euler_load_of_chain(STRIP, 8)
    shortened = [Body(body.position * (1 - load / STRIP.axial_rigidity), body.turn) for body in bodies]
    # A dead load's potential is linear: the tangent of the bonds alone decides.
    softest = np.linalg.eigvalsh(chain_tangent(shortened, chain)[6:, 6:])[0]
    assert (softest > 0) == stable


def test_frequencies_of_a_chain():
    bonds = 10
    bodies, chain = straight_chain(STRIP, bonds)
    found = frequencies(bodies, chain, STRIP)
    axial = axial_frequency_of_chain(STRIP, bonds)
    # The tangent is good to 1e-10 of its largest stiffness, a bit less than the axial one.
    assert np.abs(found / axial - 1).min() < 1e-6
    # Second order in 1/N: within 1 % at N = 20 (the target), so within 4 % at 10.
    for frequency in cantilever_frequencies(STRIP)[:2]:
        assert np.abs(found / frequency - 1).min() < 0.04


def test_table_of_strip_values():
    values = STRIP_VALUES
    assert axial_extension(STRIP, 500) == pytest.approx(values["axial_extension of 500 N"], rel=1e-12)
    assert axial_frequency(STRIP) == pytest.approx(values["axial_frequency"], abs=1e-4)
    assert cantilever_tip(STRIP, 0.01) == pytest.approx(values["cantilever_tip of 0.01 N"], abs=1e-9)
    assert cantilever_frequencies(STRIP) == pytest.approx(values["cantilever_frequencies"], abs=1e-6)
    constant = saint_venant_constant(STRIP.width, STRIP.thickness)
    assert constant == pytest.approx(values["saint_venant_constant"], rel=1e-5)
    assert end_twist(STRIP, 0.05) == pytest.approx(values["end_twist of 0.05 N m"], rel=1e-5)
    assert roll_up_moment(STRIP) == pytest.approx(values["roll_up_moment"], abs=1e-6)
    assert euler_load(STRIP) == pytest.approx(values["euler_load"], abs=1e-6)
    for bonds in (10, 20, 40):
        axial, load = axial_frequency_of_chain(STRIP, bonds), euler_load_of_chain(STRIP, bonds)
        assert axial == pytest.approx(values["axial_frequency_of_chain"][bonds], abs=1e-4)
        assert load == pytest.approx(values["euler_load_of_chain"][bonds], abs=1e-6)


# --- impacts ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CHUNG_OOI_ELASTIC)
def test_elastic_impacts_of_chung_and_ooi(name):
    impact, force, overlap, duration = CHUNG_OOI_ELASTIC[name]
    # The table has five digits; its durations are made with 2.9432 for 2.94328.
    assert impact.largest_force == pytest.approx(force, rel=2e-5)
    assert impact.largest_overlap == pytest.approx(overlap, rel=2e-5)
    assert impact.duration == pytest.approx(duration, rel=4e-5)
    found = head_on(impact)
    # Sampled 200 times an impact, the peak is missed by at most (pi / 400)^2 / 2 = 3e-5.
    assert found[0] == pytest.approx(impact.largest_force, rel=1e-4)
    assert found[1] == pytest.approx(impact.largest_overlap, rel=1e-4)
    assert found[2] == pytest.approx(impact.duration, rel=1e-6)
    assert found[3] == pytest.approx(impact.speed, rel=1e-8)


@pytest.mark.parametrize("restitution", [0.2, 0.5, 0.9])
def test_damping_gives_the_restitution_it_is_made_for(restitution):
    impact, *_ = CHUNG_OOI_ELASTIC["2 aluminium"]
    # The relation is exact; the damping force has an infinite slope at first touch, which costs the integrator digits.
    assert head_on(impact, restitution)[3] == pytest.approx(restitution * impact.speed, rel=1e-4)


@pytest.mark.parametrize("degrees", [60, 75, 85])
def test_a_sphere_that_slides_all_through_an_impact(degrees):
    speed, friction, radius = 3.9, 0.092, 2.5e-3
    angle = math.radians(degrees)
    assert 3.5 * friction * 2 < math.tan(angle)
    impact = sphere_on_rigid_wall(3.8e11, 0.23, 4000, radius, speed * math.cos(angle))
    ratio = 2 * (1 - 0.23) / (2 - 0.23)
    normal, tangential, spin = oblique(impact, ratio, speed * math.sin(angle), friction, radius)
    expected_ratio, expected_spin = sliding_rebound(speed, angle, 1.0, friction, radius)
    assert normal == pytest.approx(impact.speed, rel=1e-4)
    # The spring takes a moment to reach the bound: 1e-3 is the usual demand on any stiffness.
    assert tangential / (speed * math.sin(angle)) == pytest.approx(expected_ratio, rel=1e-3)
    assert spin == pytest.approx(expected_spin, rel=1e-3)


def test_energy_is_never_made_in_an_oblique_elastic_impact():
    radius = 2.5e-3
    for degrees in (5, 15, 30, 45):
        angle = math.radians(degrees)
        impact = sphere_on_rigid_wall(3.8e11, 0.23, 4000, radius, 3.9 * math.cos(angle))
        ratio = 2 * (1 - 0.23) / (2 - 0.23)
        normal, tangential, spin = oblique(impact, ratio, 3.9 * math.sin(angle), 0.092, radius)
        assert normal**2 + tangential**2 + 0.4 * (radius * spin) ** 2 <= 3.9**2 * (1 + 1e-6)
