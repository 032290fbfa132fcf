"""A deck that is to be run: its frame, references, bond rules and contact properties."""

import re

import numpy as np
import pytest

from beltsim import inp

HEAD = """\
*FORMAT, NAME=BELTSIM, VERSION=1
*MATERIAL, NAME=rubber, DENSITY=1200, YOUNGS MODULUS=5e6, POISSON RATIO=0.45
*MATERIAL, NAME=steel, DENSITY=7850, YOUNGS MODULUS=2e11, POISSON RATIO=0.3
*MATERIAL, NAME=coal, DENSITY=1400, YOUNGS MODULUS=1e7, POISSON RATIO=0.25
*CONTACT GROUP, NAME=left, BELT=belt
*CONTACT GROUP, NAME=right, BELT=belt
*CONTACT GROUP, NAME=other, BELT=second belt
*STEP, NAME=run, DURATION=1
"""
PULLEY = "*PART, NAME=pulley, SHAPE=CYLINDER, DIAMETER=1, LENGTH=1, MATERIAL=steel\n0,0,0,1,0,0,0\n"
CONTACTS = "*CONTACT PROPERTY, MATERIAL A=*, MATERIAL B=*, FRICTION=0.5, RESTITUTION=0.5\n"


def sphere(name, material, *more):
    return (
        ", ".join([f"*PARTICLE TYPE, NAME={name}, SHAPE=SPHERE, RADIUS=0.01, MATERIAL={material}", *more])
        + "\n"
    )


def particles(kind, *ids):
    return f"*PARTICLE, TYPE={kind}\n" + "".join(f"{i}, {i},0,0, 1,0,0,0\n" for i in ids)


def bonds(*pairs, kind="cord"):
    rows = "".join(f"{a},{b}, 0,0,0, 1,0,0,0, 1,0,0, 1,0,0,0\n" for a, b in pairs)
    return f"*BOND TYPE, NAME={kind}, RADIUS=1, YOUNGS MODULUS=1, POISSON RATIO=0\n*BOND, TYPE={kind}\n{rows}"


def prop(a, b, friction=0.5):
    return f"*CONTACT PROPERTY, MATERIAL A={a}, MATERIAL B={b}, FRICTION={friction}, RESTITUTION=0.5\n"


def problems_of(text):
    deck = inp.read_text(text)
    try:
        inp.check_case(deck)
    except inp.InpErrors as errors:
        return errors.problems
    return []


def missing_pairs(text):
    """The material pairs that are called able to touch without a property; no other problem is expected."""
    pattern = r".*found no \*CONTACT PROPERTY for (\w+) and (\w+), which can touch: .*"
    return sorted(re.fullmatch(pattern, problem).groups() for problem in problems_of(text))


# --- frame ------------------------------------------------------------------------------------------------------


def test_a_whole_small_case_is_accepted():
    assert problems_of(HEAD + CONTACTS + sphere("a", "coal") + particles("a", 1, 2) + PULLEY) == []


def test_a_converter_s_file_is_read_without_steps_materials_or_the_format_first():
    deck = inp.read_text(PULLEY + "*FORMAT, NAME=BELTSIM, VERSION=1\n")
    assert len(deck) == 2


def test_a_case_begins_with_the_format_and_has_a_step(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.inp").write_text("** c\n*GRAVITY\n0,0,1\n")
    with pytest.raises(inp.InpErrors) as caught:
        inp.read_case("case.inp")
    assert caught.value.problems == [
        "case.inp:1: found no *STEP, expected at least one *STEP, DURATION=...",
        "case.inp:2: found *GRAVITY first, expected *FORMAT, NAME=BELTSIM, VERSION=1 first",
    ]


@pytest.mark.parametrize("text", ["", "\n** nothing\n"])
def test_an_empty_case_is_refused_but_is_a_deck(text, tmp_path):
    path = tmp_path / "case.inp"
    path.write_text(text)
    assert len(inp.read(path)) == 0
    with pytest.raises(inp.InpErrors, match=":1: found no keywords"):
        inp.read_case(path)


def test_joined_files_make_one_case(tmp_path):
    belt = HEAD + CONTACTS + sphere("a", "coal") + particles("a", 1, 2)
    tail = "*FORMAT, NAME=BELTSIM, VERSION=1\n*OUTPUT, INTERVAL=0.1\n"
    path = tmp_path / "case.inp"
    path.write_text(belt + PULLEY + tail)
    deck = inp.read_case(path)
    assert [len(deck.blocks(keyword)) for keyword in ("FORMAT", "PART", "OUTPUT")] == [1, 1, 1]


# --- references ---------------------------------------------------------------------------------------------------

DANGLING = {
    "*PARTICLE, TYPE=a\n1,0,0,0,1,0,0,0\n": "TYPE=a, expected the name of a *PARTICLE TYPE",
    PULLEY.replace("steel", "steal"): "MATERIAL=steal, expected the name of a *MATERIAL; did you mean steel?",
    PULLEY.replace(
        "steel\n", "steel, CONTACT GROUP=lift\n"
    ): "the name of a *CONTACT GROUP; did you mean left?",
    "*CONTACT GROUP PAIR, GROUP A=left, GROUP B=rite, CONTACT=YES\n": "GROUP B=rite, expected",
    prop("rub*", "*"): "MATERIAL A=rub*, expected the name of a *MATERIAL",
    "*MOTION, PART=idler_*, TYPE=ROTATION, ANGULAR VELOCITY=1\n": "expected a pattern that matches a *PART",
    PULLEY + "*MOTION, PART=pully, TYPE=ROTATION, ANGULAR VELOCITY=1\n": "did you mean pulley?",
    "*DAMPING, MASS PROPORTIONAL=1, STEP=ran\n": "STEP=ran, expected the name of a *STEP; did you mean run?",
    "*FORCE, AMPLITUDE=ramp\n": "AMPLITUDE=ramp, expected the name of a *AMPLITUDE",
    "*FORCE\n3,0,0,0,0,0,0\n": "the id 3, expected the id of a *PARTICLE",
    "*INITIAL VELOCITY\n3,0,0,0,0,0,0\n": "the id 3, expected the id of a *PARTICLE",
    bonds((3, 4)): "the id 3, expected the id of a *PARTICLE",
    "*BOND, TYPE=cord\n": "TYPE=cord, expected the name of a *BOND TYPE",
    '*MOTION, PARTICLES="5-7", TYPE=ROTATION, ANGULAR VELOCITY=1\n': "the id 5 in PARTICLES",
    '*MOTION, PARTICLES="5-900000000000000000", TYPE=ROTATION, ANGULAR VELOCITY=1\n': "the id 5 in PARTICLES",
    "*SOURCE, NAME=s, MASS RATE=1\n0,0,0,1,1,1\n0,0,0\nrock, 1\n": "'rock', expected the name of a *PARTICLE TYPE",
    "*FILL, PARTICLE TYPE=coal, BELT=bolt, HEIGHT=1\n"
    + CONTACTS
    + sphere("coal", "coal"): "did you mean belt?",
    "*PART, NAME=p, SHAPE=MESH, INPUT=gone.stl, MATERIAL=steel\n": "INPUT=gone.stl, which is no file",
}


@pytest.mark.parametrize("text", DANGLING)
def test_a_dangling_reference_is_named(text):
    (problem,) = problems_of(HEAD + text)
    assert DANGLING[text] in problem


def test_a_particle_missing_from_one_row_is_named_at_that_row():
    text = HEAD + CONTACTS + sphere("a", "coal") + particles("a", 1, 2, 3) + bonds((1, 2), (2, 9), (2, 3))
    (problem,) = problems_of(text)
    line = text.splitlines().index("2,9, 0,0,0, 1,0,0,0, 1,0,0, 1,0,0,0") + 1
    assert problem == f"text:{line}: found the id 9, expected the id of a *PARTICLE"


MOTIONS = {
    "*MOTION, PART=pulley, TYPE=SURFACE VELOCITY\n1,0,0\n": "cylinders have ROTATION",
    '*MOTION, PART=pull*, TYPE=ROTATION, ANGULAR VELOCITY=1, AXIS="0,0,1"\n': "a cylinder turns about local z",
    "*MOTION, PART=chute, TYPE=ROTATION, ANGULAR VELOCITY=1\n": "TYPE=ROTATION of the mesh chute without AXIS",
    "*MOTION, PART=floor, TYPE=ROTATION, ANGULAR VELOCITY=1\n": "expected a CYLINDER or MESH",
}


@pytest.mark.parametrize("text", MOTIONS)
def test_a_motion_that_its_part_cannot_make_is_refused(text, tmp_path, monkeypatch):
    (tmp_path / "chute.stl").touch()
    monkeypatch.chdir(tmp_path)
    parts = "*PART, NAME=chute, SHAPE=MESH, INPUT=chute.stl, MATERIAL=steel\n" + PULLEY
    (problem,) = problems_of(
        HEAD + parts + "*PART, NAME=floor, SHAPE=PLANE, MATERIAL=steel\n0,0,0,1,0,0,0\n" + text
    )
    assert MOTIONS[text] in problem


# --- bond rules ---------------------------------------------------------------------------------------------------

BELT = (
    HEAD
    + CONTACTS
    + "".join(sphere(f"fibre_{i}", "rubber") + particles(f"fibre_{i}", 10 * i, 10 * i + 1) for i in (1, 2))
    + bonds((10, 11), (20, 21), (10, 20), (11, 21))
    + bonds(kind="one")
    + bonds(kind="two")
)


def rule(a, b, kind):
    return f"*BOND RULE, PARTICLE TYPE A={a}, PARTICLE TYPE B={b}, BOND TYPE={kind}\n"


@pytest.mark.parametrize(
    ("rules", "within", "between"),
    [
        ("", "cord", "cord"),
        (rule("fibre_*", "OTHER", "two"), "cord", "two"),
        (rule("fibre_*", "SAME", "one"), "one", "cord"),
        (rule("fibre_*", "SAME", "one") + rule("fibre_*", "OTHER", "two"), "one", "two"),
        (rule("fibre_*", "fibre_*", "one") + rule("fibre_1", "OTHER", "two"), "one", "two"),
        (rule("fibre_2", "fibre_1", "two") + rule("*", "*", "one"), "one", "two"),
        (rule("fibre_?", "fibre_1", "one") + rule("fibre_1", "fibre_2", "two"), "one", "two"),
        (rule("fibre_1", "SAME", "two") + rule("fibre_*", "fibre_1", "one"), "two", "one"),
        (rule("fibre_1", "SAME", "one") + rule("fibre_1", "SAME", "one"), "one", "cord"),
    ],
)
def test_the_rule_with_more_exact_names_gives_the_bond_type(rules, within, between):
    assert problems_of(BELT + rules) == []
    deck = inp.read_text(BELT + rules)
    assert inp.bond_type_of(deck, "fibre_1", "fibre_1", "cord") == within
    assert inp.bond_type_of(deck, "fibre_1", "fibre_2", "cord") == between
    assert inp.bond_type_of(deck, "fibre_2", "fibre_1", "cord") == between


def test_rules_of_equal_rank_that_differ_are_an_error_where_bonds_meet_them():
    (problem,) = problems_of(BELT + rule("fibre_*", "OTHER", "one") + rule("*_2", "fibre_?", "two"))
    assert "found a rule for fibre_1 and fibre_2 that differs from" in problem


def test_rules_of_equal_rank_may_differ_where_no_bond_meets_them():
    lone = sphere("lone", "rubber")
    assert problems_of(BELT + lone + rule("lone", "*", "one") + rule("lon?", "lone", "two")) == []


# --- which materials touch ------------------------------------------------------------------------------------------


def test_bulk_touches_bulk_and_parts():
    text = HEAD + PULLEY + sphere("a", "coal") + particles("a", 1, 2)
    assert missing_pairs(text) == [("coal", "coal"), ("coal", "steel")]


def test_a_lone_particle_does_not_touch_its_own_kind():
    assert missing_pairs(HEAD + sphere("a", "coal") + particles("a", 1)) == []


def test_a_source_adds_as_many_as_it_likes():
    source = "*SOURCE, NAME=s, PARTICLE TYPE=a, MASS RATE=1\n0,0,0,1,1,1\n0,0,0\n"
    assert missing_pairs(HEAD + sphere("a", "coal") + source) == [("coal", "coal")]


def test_a_source_of_fractions_adds_each_of_them():
    source = "*SOURCE, NAME=s, MASS RATE=1\n0,0,0,1,1,1\n0,0,0\na, 0.5\nb, 0.5\n"
    text = HEAD + sphere("a", "coal") + sphere("b", "rubber") + source
    assert missing_pairs(text) == [("coal", "coal"), ("coal", "rubber"), ("rubber", "rubber")]


def test_a_type_without_particles_touches_nothing():
    assert missing_pairs(HEAD + PULLEY + sphere("a", "coal")) == []


def test_parts_and_held_particles_never_touch_one_another():
    idler = sphere("idler", "coal", "FIXED=POSITION") + particles("idler", 1, 2)
    assert missing_pairs(HEAD + PULLEY + PULLEY.replace("pulley", "tail") + idler) == []


def left_right(*more):
    text = HEAD + sphere("l", "rubber", "CONTACT GROUP=left") + sphere("r", "coal", "CONTACT GROUP=right")
    return text + particles("l", 1, 2) + particles("r", 3, 4) + "".join(more)


def pair(a, b, contact):
    return f"*CONTACT GROUP PAIR, GROUP A={a}, GROUP B={b}, CONTACT={contact}\n"


def test_groups_of_one_belt_do_not_touch():
    assert missing_pairs(left_right()) == []


def test_particles_of_a_group_without_a_belt_do_not_touch():
    text = (
        HEAD
        + "*CONTACT GROUP, NAME=rope\n"
        + sphere("r", "rubber", "CONTACT GROUP=rope")
        + particles("r", 1, 2)
    )
    assert missing_pairs(text) == []


def test_groups_of_one_belt_touch_if_a_pair_says_so_in_either_order():
    assert missing_pairs(left_right(pair("right", "left", "YES"))) == [("coal", "rubber")]


def test_particles_within_a_group_touch_if_a_pair_says_so():
    assert missing_pairs(left_right(pair("left", "left", "YES"))) == [("rubber", "rubber")]


def test_different_belts_touch_unless_a_pair_says_no():
    text = HEAD + sphere("l", "rubber", "CONTACT GROUP=left") + sphere("o", "coal", "CONTACT GROUP=other")
    text += particles("l", 1, 2) + particles("o", 3, 4)
    assert missing_pairs(text) == [("coal", "rubber")]
    assert missing_pairs(text + pair("left", "other", "NO")) == []


def test_a_belt_touches_parts_and_bulk_without_a_group():
    text = left_right(PULLEY)
    assert missing_pairs(text) == [("coal", "steel"), ("rubber", "steel")]


def test_a_part_in_a_group_is_touched_as_the_pair_says():
    text = left_right(PULLEY.replace("steel\n", "steel, CONTACT GROUP=other\n"))
    assert missing_pairs(text) == [("coal", "steel"), ("rubber", "steel")]
    assert missing_pairs(text + pair("left", "other", "NO")) == [("coal", "steel")]


def test_bonded_pairs_never_touch_while_they_cannot_break():
    text = HEAD + sphere("a", "rubber") + particles("a", 1, 2)
    assert missing_pairs(text + bonds((1, 2))) == []
    breaking = bonds((1, 2)).replace("RATIO=0\n", "RATIO=0, TENSILE STRENGTH=1e6\n")
    assert missing_pairs(text + breaking) == [("rubber", "rubber")]
    chain = HEAD + sphere("a", "rubber") + particles("a", 1, 2, 3) + bonds((1, 2), (2, 3))
    assert missing_pairs(chain) == [("rubber", "rubber")]


# --- contact properties -----------------------------------------------------------------------------------------------


def test_the_exact_pair_beats_one_star_beats_two():
    deck = inp.read_text(prop("*", "*", 0.1) + prop("steel", "*", 0.2) + prop("rubber", "steel", 0.3))
    friction = {
        pair: inp.contact_property(deck, *pair)["FRICTION"]
        for pair in [
            ("steel", "rubber"),
            ("rubber", "steel"),
            ("coal", "steel"),
            ("coal", "rubber"),
            ("steel", "steel"),
        ]
    }
    assert list(friction.values()) == [0.3, 0.3, 0.2, 0.1, 0.2]


def test_without_a_matching_property_there_is_none():
    assert inp.contact_property(inp.read_text(prop("steel", "*")), "coal", "rubber") is None


def test_one_star_satisfies_a_pair_and_two_of_them_that_both_match_are_an_error():
    text = HEAD + PULLEY + sphere("a", "coal") + particles("a", 1)
    assert problems_of(text + prop("*", "steel")) == []
    (problem,) = problems_of(text + prop("*", "steel") + prop("coal", "*"))
    assert "found two properties of equal rank for coal and steel" in problem


# --- look-ups ---------------------------------------------------------------------------------------------------------


def test_patterns_match_as_in_a_shell_but_only_with_star_and_question_mark():
    names = ["idler_1", "idler_22", "idler[1]", "pulley"]
    assert inp.matching(names, "idler_*") == ["idler_1", "idler_22"]
    assert inp.matching(names, "idler_?") == ["idler_1"]
    assert inp.matching(names, "idler[1]") == ["idler[1]"]
    assert inp.matching(names, "Pulley") == []


def test_a_thing_is_found_by_its_name():
    deck = inp.read_text(HEAD)
    assert inp.named(deck, "MATERIAL", "steel")["DENSITY"] == 7850
    assert list(inp.by_name(deck, "CONTACT GROUP")) == ["left", "right", "other"]
    with pytest.raises(KeyError):
        inp.named(deck, "MATERIAL", "Steel")


def test_ids_expand_ascending_and_once():
    (block,) = inp.read_text('*MOTION, PARTICLES="12, 1-4 3", TYPE=ROTATION, ANGULAR VELOCITY=1\n').blocks()
    assert inp.expand_ids(block["PARTICLES"]).tolist() == [1, 2, 3, 4, 12]


def test_a_deck_made_in_python_is_checked_like_a_text():
    deck = inp.Deck()
    deck.add("FORMAT", name="BELTSIM", version=1)
    deck.add("PART", name="p", shape="CYLINDER", diameter=1, material="m")
    deck.add("FORCE", rows={"id": [1], "force": np.zeros((1, 3)), "torque": np.zeros((1, 3))})
    with pytest.raises(inp.InpErrors) as caught:
        inp.check_case(deck)
    assert [problem.split(": found ")[0] for problem in caught.value.problems] == [
        "deck:1",
        "deck:2",
        "deck:2",
        "deck:2",
        "deck:3",
    ]
