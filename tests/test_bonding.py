"""Bonds of a deck: stiffness, sections, reduction, rules of fibres, stress-free state, damping and strength."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from beltsim import inp
from beltsim.scene import build
from beltsim.verify.strips import Strip, add_belt_types, add_strip, case_deck, line, straight, strip_deck

E, NU, B, T, PITCH = 50e6, 0.3, 0.1, 0.01, 0.05
G = E / 2.6
AREA, INERTIA_2, INERTIA_3 = B * T, B * T**3 / 12.0, T * B**3 / 12.0


def pair(strip=None, **changes):
    """The kinds of one bond of the reference strip, with changed parameters."""
    strip = strip or Strip(bonds=20, **changes)
    deck = case_deck()
    add_strip(deck, strip, line(2, strip.pitch))
    return build(deck)


def stiffnesses(**changes):
    kinds = pair(**changes).kinds
    return kinds.stiffness[:, 0], kinds.angular_stiffness[:, 0]


def test_stiffness_of_a_rectangular_timoshenko_bond():
    stiffness, angular = stiffnesses()
    phi_2 = 12.0 * E * INERTIA_2 / (5.0 / 6.0 * G * AREA * PITCH**2)
    phi_3 = 12.0 * E * INERTIA_3 / (5.0 / 6.0 * G * AREA * PITCH**2)
    expected = [
        E * AREA / PITCH,
        12.0 * E * INERTIA_3 / (PITCH**3 * (1.0 + phi_3)),
        12.0 * E * INERTIA_2 / (PITCH**3 * (1.0 + phi_2)),
    ]
    np.testing.assert_allclose(stiffness, expected, rtol=1e-13)
    np.testing.assert_allclose(angular[1:], [E * INERTIA_2 / PITCH, E * INERTIA_3 / PITCH], rtol=1e-13)


def test_spring_shear_is_the_shear_area_over_the_length():
    stiffness, _ = stiffnesses(shear="SPRING")
    np.testing.assert_allclose(stiffness[1:], 5.0 / 6.0 * G * AREA / PITCH, rtol=1e-13)


def test_torsion_of_a_lone_strip_is_saint_venants():
    _, angular = stiffnesses()
    # Timoshenko and Goodier, table of k1 for b/t = 10: J = 0.312 b t^3, three digits.
    assert angular[0] * PITCH / G == pytest.approx(0.312 * B * T**3, rel=2e-3)


def test_torsion_of_a_square_section_is_saint_venants():
    _, angular = stiffnesses(width=0.01)
    assert angular[0] * PITCH / G == pytest.approx(0.1406 * T**4, rel=2e-3)  # k1 for b/t = 1, four digits


def test_torsion_in_a_grid_is_half_the_plates():
    _, angular = stiffnesses(torsion="GRID")
    assert angular[0] == pytest.approx(G * B * T**3 / 6.0 / PITCH, rel=1e-13)


def test_torsion_does_not_ask_which_side_is_the_longer():
    _, flat = stiffnesses()
    _, upright = stiffnesses(width=T, thickness=B)
    assert upright[0] == flat[0]
    np.testing.assert_allclose(upright[1:], flat[:0:-1], rtol=1e-13)


def test_round_section():
    radius = 0.005
    stiffness, angular = stiffnesses(radius=radius)
    area, inertia = math.pi * radius**2, math.pi * radius**4 / 4.0
    kappa = 6.0 * (1.0 + NU) / (7.0 + 6.0 * NU)
    phi = 12.0 * E * inertia / (kappa * G * area * PITCH**2)
    shear = 12.0 * E * inertia / (PITCH**3 * (1.0 + phi))
    np.testing.assert_allclose(stiffness, [E * area / PITCH, shear, shear], rtol=1e-13)
    np.testing.assert_allclose(angular * PITCH, [2.0 * G * inertia, E * inertia, E * inertia], rtol=1e-13)


@pytest.mark.parametrize("factor", [1.0, 0.1, 1e-6])
@pytest.mark.parametrize("bonds", [5, 10, 40])
def test_a_chain_bends_out_of_plane_like_a_beam_of_f_ei_exactly(bonds, factor):
    strip = Strip(bonds=bonds, reduction=factor)
    scene = build(strip_deck(strip))
    shear, bending = scene.kinds.stiffness[2, 0], scene.kinds.angular_stiffness[1, 0]
    # Statics of a cantilever under a unit tip load: shear 1 in each bond, moment 1 - s at each bond's middle.
    lever = strip.length - (np.arange(bonds) + 0.5) * strip.pitch
    deflection = bonds / shear + np.sum(lever**2) / bending
    beam = 1.0 / (3.0 * factor * E * INERTIA_2) + 1.0 / (5.0 / 6.0 * G * AREA)
    assert deflection == pytest.approx(beam, rel=1e-12)  # rest lengths are rounded to 1e-16, cubed


def test_the_reduction_factor_acts_on_out_of_plane_bending_only():
    full, reduced = stiffnesses(), stiffnesses(reduction=0.1)
    np.testing.assert_array_equal(reduced[0][:2], full[0][:2])
    np.testing.assert_array_equal(reduced[1][[0, 2]], full[1][[0, 2]])
    assert reduced[1][1] == pytest.approx(0.1 * full[1][1], rel=1e-15)


def test_no_bending_stiffness_is_a_string_without_shear_out_of_plane():
    stiffness, angular = stiffnesses(reduction=0.0)
    assert stiffness[2] == 0.0
    assert angular[1] == 0.0
    assert stiffness[0] > 0.0


def test_in_plane_reduction_acts_in_plane_only():
    deck = strip_deck(Strip(bonds=1, length=PITCH))
    deck.blocks("BOND TYPE")[0].parameters["IN PLANE REDUCTION FACTOR"] = 0.25
    kinds, full = build(deck).kinds, pair().kinds
    assert kinds.angular_stiffness[2, 0] == pytest.approx(0.25 * full.angular_stiffness[2, 0], rel=1e-15)
    assert kinds.angular_stiffness[1, 0] == full.angular_stiffness[1, 0]
    assert kinds.stiffness[2, 0] == full.stiffness[2, 0]


def test_damping_is_a_share_of_the_critical_damping_of_the_pair():
    scene = pair(damping=0.3)
    kinds, particles = scene.kinds, scene.population.particles
    reduced = particles.mass[0] * particles.mass[1] / particles.mass.sum()
    np.testing.assert_allclose(kinds.damping, 0.6 * np.sqrt(kinds.stiffness * reduced), rtol=1e-13)
    # The bond lies along x with its thickness along z, so its axes are the particles' own.
    moments = particles.inertia
    moment = moments[:, 0] * moments[:, 1] / moments.sum(axis=1)
    expected = 0.6 * np.sqrt(kinds.angular_stiffness * moment[:, None])
    np.testing.assert_allclose(kinds.angular_damping, expected, rtol=1e-13)


def row_of_bond(position_1, orientation_1, position_2, orientation_2):
    values = (position_1, orientation_1, position_2, orientation_2)
    names = ("position_1", "orientation_1", "position_2", "orientation_2")
    return {"particles": [[1, 2]]} | {name: [value] for name, value in zip(names, values)}


def with_bond_row(**row):
    deck = case_deck()
    strip = Strip(bonds=20)
    add_belt_types(deck, strip)
    rows = {"id": [1, 2], "position": line(2, PITCH), "orientation": straight(2)}
    deck.add("PARTICLE", type="belt", rows=rows)
    deck.add("BOND", type="bond", rows=row_of_bond(**row))
    return build(deck)


def quaternion(vector):
    return Rotation.from_rotvec(vector).as_quat(scalar_first=True)


def test_a_common_rigid_motion_of_the_stress_free_state_means_the_same():
    tilt = [0.2, -0.4, 0.1]
    state = {
        "position_1": [0.0, 0.0, 0.0],
        "orientation_1": quaternion([0.0, 0.0, 0.0]),
        "position_2": [0.05, 0.001, -0.002],
        "orientation_2": quaternion(tilt),
    }
    turn = Rotation.from_rotvec([2.0, 1.0, -1.5])

    def turned(q):
        return (turn * Rotation.from_quat(q, scalar_first=True)).as_quat(scalar_first=True)

    other = {
        "position_1": turn.apply(state["position_1"]) + np.array([1.0, 2.0, 3.0]),
        "orientation_1": turned(state["orientation_1"]),
        "position_2": turn.apply(state["position_2"]) + np.array([1.0, 2.0, 3.0]),
        "orientation_2": turned(state["orientation_2"]),
    }
    one, two = with_bond_row(**state).kinds, with_bond_row(**other).kinds
    assert one.upright is None
    assert two.upright is None
    for name in one._fields[:-1]:
        # Places 3 m off are rounded to 4e-16 m, 1e-14 of the bond's length.
        np.testing.assert_allclose(getattr(two, name), getattr(one, name), rtol=1e-12, atol=1e-13)


def test_start_positions_never_enter_the_law():
    strip = Strip(bonds=20)
    rested, stretched = case_deck(), case_deck()
    add_strip(rested, strip, line(2, strip.pitch))
    add_strip(
        stretched, strip, [[0, 0, 0], [0.07, 0.01, 0.02]], orientation=[quaternion([1, 0, 0]), [1, 0, 0, 0]]
    )
    one, two = build(rested).kinds, build(stretched).kinds
    for name in one._fields:
        np.testing.assert_array_equal(getattr(two, name), getattr(one, name))


def test_elongation_in_the_row_is_a_shorter_rest_length():
    scene = with_bond_row(
        position_1=[0.0, 0.0, 0.0],
        orientation_1=[1.0, 0, 0, 0],
        position_2=[PITCH / 1.01, 0.0, 0.0],
        orientation_2=[1.0, 0, 0, 0],
    )
    assert scene.kinds.rest_length[0] == pytest.approx(PITCH / 1.01, rel=1e-15)
    assert scene.kinds.stiffness[0, 0] == pytest.approx(E * AREA / (PITCH / 1.01), rel=1e-14)


def test_the_section_lies_with_its_thickness_along_local_z():
    scene = with_bond_row(
        position_1=[0.0, 0.0, 0.0],
        orientation_1=[1.0, 0, 0, 0],
        position_2=[0.0, PITCH, 0.0],
        orientation_2=[1.0, 0, 0, 0],
    )
    triad = Rotation.from_quat(scene.kinds.triad_first[:, 0], scalar_first=True).as_matrix()
    np.testing.assert_allclose(triad[:, 0], [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(triad[:, 2], [0, 0, 1], atol=1e-15)


def test_a_bond_along_local_z_takes_local_y_for_its_thickness():
    scene = with_bond_row(
        position_1=[0.0, 0.0, 0.0],
        orientation_1=[1.0, 0, 0, 0],
        position_2=[0.0, 0.0, PITCH],
        orientation_2=[1.0, 0, 0, 0],
    )
    triad = Rotation.from_quat(scene.kinds.triad_first[:, 0], scalar_first=True).as_matrix()
    np.testing.assert_allclose(triad[:, 0], [0, 0, 1], atol=1e-15)
    np.testing.assert_allclose(triad[:, 2], [0, 1, 0], atol=1e-15)


def fibre_deck(rules):
    """Particles of three fibres in a row across, bonded in a chain 1-1-2-2-3, with bond rules."""
    deck = case_deck()
    strip = Strip(bonds=4)
    add_belt_types(deck, strip)
    names = ["fibre_001", "fibre_001", "fibre_002", "fibre_002", "fibre_003"]
    for name in dict.fromkeys(names):
        deck.add(
            "PARTICLE TYPE",
            name=name,
            shape="ROUNDED BOX",
            size_x=0.1,
            size_y=0.1,
            size_z=0.01,
            material="rubber",
            contact_group="belt",
        )
        ids = np.array([n + 1 for n, other in enumerate(names) if other == name])
        rows = {"id": ids, "position": line(5, 0.25)[ids - 1], "orientation": straight(len(ids))}
        deck.add("PARTICLE", type=name, rows=rows)
    for name, young in (("soft", 1e6), ("stiff", 1e9), ("edge", 3e7)):
        deck.add(
            "BOND TYPE",
            name=name,
            section_width=B,
            section_thickness=T,
            youngs_modulus=young,
            poisson_ratio=NU,
        )
    pairs = np.array([[1, 2], [2, 3], [3, 4], [4, 5]])
    rows = {
        "particles": pairs,
        "position_1": np.zeros((4, 3)),
        "orientation_1": straight(4),
        "position_2": np.tile([0.25, 0.0, 0.0], (4, 1)),
        "orientation_2": straight(4),
    }
    deck.add("BOND", type="bond", rows=rows)
    for a, b, name in rules:
        deck.add("BOND RULE", particle_type_a=a, particle_type_b=b, bond_type=name)
    return deck


def moduli(deck):
    scene = build(deck)
    order = np.argsort(scene.bonds.first)  # the solver sorts bonds by kind
    axial = scene.kinds.stiffness[0, scene.bonds.kind[order]]
    return list(np.round(axial * 0.25 / AREA, 3))


def test_bonds_without_a_rule_keep_their_type():
    assert moduli(fibre_deck([])) == [E] * 4


def test_fibres_get_their_own_stiffness_by_rule():
    rules = [("fibre_*", "SAME", "stiff"), ("fibre_*", "OTHER", "soft")]
    assert moduli(fibre_deck(rules)) == [1e9, 1e6, 1e9, 1e6]


def test_an_exact_rule_wins_whichever_end_it_names_first():
    rules = [("fibre_*", "SAME", "stiff"), ("fibre_*", "OTHER", "soft"), ("fibre_003", "fibre_002", "edge")]
    assert moduli(fibre_deck(rules)) == [1e9, 1e6, 1e9, 3e7]


def test_two_rules_of_equal_rank_that_differ_are_refused():
    deck = fibre_deck([("fibre_001", "fibre_*", "stiff"), ("fibre_002", "fibre_*", "soft")])
    with pytest.raises(inp.InpErrors, match="rules of equal rank"):
        inp.check_case(deck)


def test_stress_uses_the_unreduced_section():
    scene = pair(reduction=0.1, tensile_strength=1e6, shear_strength=2e6)
    area, modulus_2, modulus_3, torsion = scene.strength.section[:, 0]
    assert area == pytest.approx(AREA)
    assert modulus_2 == pytest.approx(B * T**2 / 6.0)
    assert modulus_3 == pytest.approx(T * B**2 / 6.0)
    # Largest shear stress of a rectangle b/t = 10 under torsion: M / (0.312 b t^2), three digits.
    assert torsion == pytest.approx(0.312 * B * T**2, rel=0.01)
    np.testing.assert_array_equal(scene.strength.strength[:, 0], [1e6, 2e6])


def test_bonds_without_strength_cost_nothing():
    assert pair().strength is None


def test_bonds_of_a_grid_share_few_kinds():
    scene = build(strip_deck(Strip(bonds=40)))
    # The end particles have half the mass, and with damping their bonds would differ; without, all are one kind.
    assert scene.bonds.first.size == 40
    assert scene.kinds.rest_length.size == 1
