"""From turned bodies to parts: sizes, identical geometries, classes, coaxial bodies, order, names, quaternions."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest
from sat_solids import cylinder, roller, write_sat

from beltsim import inp
from beltsim.view.scenery import rotation_matrices
from partconverter import coaxial
from partconverter import rollers as roll
from partconverter.drums import Span
from partconverter.finding import find_rollers
from partconverter.parts import deck_of
from partconverter.rollers import Roller


def one(
    diameter=0.133, length=0.38, centre=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0), overall=None, **more
) -> Roller:
    span, whole = Span(-length / 2, length / 2), Span(-(overall or length) / 2, (overall or length) / 2)
    return Roller(centre, axis, diameter, span, span, whole, **more)


def ready(rollers, **limits):
    rollers = roll.classified(roll.identified(roll.sized(rollers)), **limits)
    return roll.named(roll.ordered(rollers))


# --- sizes -----------------------------------------------------------------------------------------------------


def test_the_written_length_is_drum_face_or_overall_with_its_own_middle():
    body = Roller(
        (0, 0, 0), (0, 0, 1), 0.2, Span(-0.1, 0.1), Span(-0.15, 0.1), Span(-0.15, 0.3), fillet=0.005
    )
    for length, expected, middle, edge in (
        ("drum", 0.25, -0.025, 0.005),
        ("face", 0.2, 0.0, 0.0),
        ("overall", 0.45, 0.075, 0.0),
    ):
        sized = roll.sized([body], length=length)[0]
        assert (sized.length, sized.centre[2], sized.edge_radius) == pytest.approx((expected, middle, edge))


def test_a_given_edge_radius_fits_into_the_cylinder():
    assert roll.sized([one()], edge_radius=0.002)[0].edge_radius == 0.002
    assert roll.sized([one()], edge_radius=1.0)[0].edge_radius == 0.133 / 2
    assert roll.sized([one(length=0.02)], edge_radius=1.0)[0].edge_radius == 0.01
    assert roll.sized([one(fillet=0.004)], edge_radius=0.0)[0].edge_radius == 0.0


def test_sizes_that_rounding_would_part_are_one_geometry():
    rollers = roll.identified(roll.sized([one(0.1080049), one(0.1080051), one(0.108), one(0.133)]))
    assert [r.identical for r in rollers] == [3, 3, 3, 1]
    assert len({r.diameter for r in rollers[:3]}) == 1


def test_place_and_direction_play_no_part_in_identity_but_every_size_does():
    same = [one(), one(centre=(1, 2, 3)), one(axis=(0, sqrt(0.5), sqrt(0.5)))]
    others = [one(length=0.4), one(overall=0.5), one(bore=0.1), one(fillet=0.01)]
    rollers = roll.identified(roll.sized(same + others))
    assert [r.identical for r in rollers] == [3, 3, 3, 1, 1, 1, 1]


def test_a_row_of_sizes_each_near_the_next_does_not_run_together():
    rollers = roll.identified(roll.sized([one(0.1 + 0.000008 * i) for i in range(10)]))
    # All of a kind are written with one size, which must lie within the tolerance of each.
    assert max(abs(r.diameter - (0.1 + 0.000008 * i)) for i, r in enumerate(rollers)) <= 1e-5
    assert len({r.diameter for r in rollers}) == 5


def test_the_tolerance_is_the_users():
    rollers = roll.sized([one(0.108), one(0.1085)])
    assert roll.identified(rollers)[0].identical == 1
    assert roll.identified(rollers, 0.001)[0].identical == 2


# --- classes ---------------------------------------------------------------------------------------------------


def test_diameter_at_or_above_the_limit_makes_a_pulley():
    rollers = ready([one(0.3), one(0.299), one(0.133)], diameter_limit=0.3)
    assert {r.diameter: r.kind for r in rollers} == {0.3: "PULLEY", 0.299: "IDLER", 0.133: "IDLER"}


def test_a_count_at_or_below_the_quantity_limit_makes_a_pulley():
    rollers = ready([one(0.133)] * 3 + [one(0.1)] * 2, quantity_limit=2)
    assert {(r.diameter, r.kind) for r in rollers} == {(0.133, "IDLER"), (0.1, "PULLEY")}


def test_the_rule_that_decided_is_told():
    rollers = ready([one(0.3)] * 5 + [one(0.1)] + [one(0.2)] * 5, diameter_limit=0.3, quantity_limit=2)
    rules = {r.diameter: r.rule for r in rollers}
    assert rules[0.3] == "diameter at or above 0.3 m"
    assert rules[0.1] == "not more than 2 of its kind"
    assert rules[0.2] == "diameter below 0.3 m and more than 2 of its kind"
    assert ready([one()])[0].rule == "no limit was given"


# --- coaxial bodies --------------------------------------------------------------------------------------------


def from_text(*bodies):
    return find_rollers(write_sat(bodies).encode(), "x").rollers


def test_tube_inner_tube_and_shaft_become_one_roller():
    bodies = (cylinder(20, 450), cylinder(100, 360, bore=90), cylinder(133, 380, bore=120))
    merged = coaxial.merge_coaxial(from_text(*bodies))
    assert len(merged) == 1
    assert merged[0].diameter == 0.133
    assert merged[0].overall.length == pytest.approx(0.45)
    assert merged[0].bore == 0
    assert merged[0].notes == (
        "merged with a coaxial body 100 x 360 mm",
        "merged with a coaxial body 20 x 450 mm",
    )


def test_two_tubes_on_one_shaft_stay_two_rollers():
    bodies = (cylinder(20, 900), cylinder(133, 380, (0, 0, -220)), cylinder(133, 380, (0, 0, 220)))
    assert [r.diameter for r in coaxial.merge_coaxial(from_text(*bodies))] == [0.133, 0.133]


@pytest.mark.parametrize(
    "other",
    [cylinder(20, 450, (1, 0, 0)), cylinder(20, 450, (0, 0, 500)), cylinder(20, 450, axis=(0.01, 0, 1))],
    ids=["beside", "behind", "tilted"],
)
def test_bodies_that_are_not_coaxial_stay(other):
    assert len(coaxial.merge_coaxial(from_text(cylinder(133, 380), other))) == 2


def test_the_sweep_finds_the_pairs_that_all_against_all_finds():
    rng = np.random.default_rng(1)
    rollers = [
        one(centre=(0.1 * rng.integers(3), 0.2 * rng.integers(20), 0.0), overall=0.3 + 0.3 * rng.integers(3))
        for _ in range(120)
    ]
    slow = {(i, j) for i in range(120) for j in range(i) if coaxial.are_coaxial(rollers[i], rollers[j])}
    fast = {(max(pair), min(pair)) for pair in coaxial.coaxial_pairs(rollers)}
    assert fast == slow
    assert 0 < len(slow) < 120 * 119 / 2


# --- order and names -------------------------------------------------------------------------------------------


def test_rollers_are_sorted_along_the_longest_side():
    places = [(3.0, 0.4, 1.0), (1.0, -0.4, 1.0), (1.0, 0.4, 1.0), (2.0, 0.0, 0.9)]
    rollers = ready([one(centre=place) for place in places])
    assert [r.centre for r in rollers] == [places[1], places[2], places[3], places[0]]
    assert [r.name for r in rollers] == ["idler_001", "idler_002", "idler_003", "idler_004"]


def test_the_order_can_be_chosen_and_a_belt_comes_first():
    rollers = [one(centre=(float(x), -float(x), 0.0)) for x in (2, 0, 1)]
    assert [r.centre[0] for r in roll.ordered(roll.sized(rollers), "y")] == [2, 1, 0]
    assert [r.centre[0] for r in roll.ordered(roll.sized(rollers), "file")] == [2, 0, 1]
    touched = [replace(r, station=s) for r, s in zip(roll.sized(rollers), (5.0, None, 7.0))]
    assert [r.centre[0] for r in roll.ordered(touched)] == [2, 1, 0]


def test_names_follow_class_geometry_or_cad_and_are_unique():
    rollers = [
        one(cad_name="Idler 7"),
        one(cad_name="Idler 7"),
        one(0.4, cad_name='Head, "drive" = *'),
        one(),
    ]
    rollers = roll.classified(roll.identified(roll.sized(rollers)), diameter_limit=0.3)

    def names(**how):
        return [r.name for r in roll.named(rollers, **how)]

    assert names() == ["idler_001", "idler_002", "pulley_001", "idler_003"]
    assert names(by="geometry", prefix="b_")[:3] == [
        "b_idler_d133x380_001",
        "b_idler_d133x380_002",
        "b_pulley_d400x380_001",
    ]
    assert names(by="cad") == ["Idler_7_001", "Idler_7_002", "Head_drive", "idler_001"]


def test_a_cad_name_that_looks_numbered_takes_no_name_twice():
    rollers = [one(cad_name="idler_001"), one(), one(cad_name="x"), one(cad_name="x"), one(cad_name="x_001")]
    found = [r.name for r in roll.named(roll.sized(rollers), by="cad")]
    assert len(set(found)) == len(found)


@pytest.mark.parametrize(
    "name", ["Rolle ø 7", "a,b", "x = 1", "#7", "**", "  ", "a\tb\x01c", "é*?", '"q"', "SAME", "-1"]
)
def test_any_cad_name_gives_a_name_that_reads_back(name):
    rollers = roll.named(ready([one(cad_name=name), one(cad_name="other")]), by="cad")
    deck = deck_of([replace(r, speed=1.0) for r in rollers])
    assert inp.read_text(inp.dumps(deck)) == deck


# --- decks -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "axis", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, 1, 0), (0.6, 0, 0.8), (-0.36, 0.48, -0.8)]
)
def test_the_quaternion_turns_local_z_to_the_axis(axis):
    turned = rotation_matrices(np.array([roll.quaternion_of(axis)]))[0] @ [0, 0, 1]
    assert turned == pytest.approx(axis, abs=1e-15)


def test_parts_particles_and_auto_hold_the_same_cylinders():
    rollers = ready(
        [one(0.4, cad_name="head")] + [one(centre=(float(x), 0.0, 1.0)) for x in range(5)], diameter_limit=0.3
    )
    for output, parts, particles in (("parts", 6, 0), ("particles", 0, 6), ("auto", 1, 5)):
        deck = deck_of(rollers, output=output, first_id=100)
        text = inp.dumps(deck)
        assert inp.read_text(text) == deck
        assert len(deck.blocks("PART")) == parts
        assert sum(len(block) for block in deck.blocks("PARTICLE")) == particles
        for block in deck.blocks("PARTICLE TYPE"):
            assert block["FIXED"] == "POSITION"
        places = [block.rows["position"] for block in (*deck.blocks("PART"), *deck.blocks("PARTICLE"))]
        assert sorted(map(tuple, np.concatenate(places))) == sorted(r.centre for r in rollers)
    assert [block["CLASS"] for block in deck.blocks("PARTICLE TYPE")] == ["IDLER"]
    assert list(deck.blocks("PARTICLE")[0].rows["id"]) == [100, 101, 102, 103, 104]


def test_rollers_of_one_size_and_two_spins_are_two_particle_types_with_a_motion_each():
    rollers = [replace(r, speed=s) for r, s in zip(ready([one()] * 3), (5.0, -5.0, None))]
    deck = deck_of(rollers, output="particles", ramp=2.0, prefix="a_")
    names = [block["NAME"] for block in deck.blocks("PARTICLE TYPE")]
    assert names == ["a_idler_d133x380_1", "a_idler_d133x380_2", "a_idler_d133x380_3"]
    motions = {m["PARTICLE TYPE"]: m["ANGULAR VELOCITY"] for m in deck.blocks("MOTION")}
    assert motions == {names[0]: 5.0, names[1]: -5.0}
    assert {m["AMPLITUDE"] for m in deck.blocks("MOTION")} == {"a_ramp"}
    assert list(deck.blocks("AMPLITUDE")[0].rows["time"]) == [0.0, 2.0]


def test_colours_follow_class_or_geometry():
    rollers = ready([one(0.4), one(), one(0.1)], diameter_limit=0.3)
    by_class = [block["COLOR"] for block in deck_of(rollers).blocks("PART")]
    assert sorted(by_class) == ["#3366cc", "#3366cc", "#cc3333"]
    assert len({block["COLOR"] for block in deck_of(rollers, colour_by="geometry").blocks("PART")}) == 3
    assert all("COLOR" not in block for block in deck_of(rollers, colour_by="none").blocks("PART"))


def test_sizes_in_inches_and_turned_bodies_give_clean_numbers():
    found = from_text(roller(133, 380, 25, 440, (0.1, 0.2, 0.3), (1, 1, 1)))
    assert roll.sized(found)[0].length == 0.38
    assert roll.sized(found)[0].diameter == 0.133
