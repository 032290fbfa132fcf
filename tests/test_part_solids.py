"""Which solids are rollers, and of what size: every spelling of every shape that a conveyor's CAD model holds."""

from __future__ import annotations

from math import cos, isclose, radians, sin, sqrt
from pathlib import Path

import pytest
import sat_solids as solids
from hypothesis import given, settings
from hypothesis import strategies as st
from sat_solids import VERSIONS, Body, box, cylinder, revolve, roller, write_sat
from scipy.spatial.transform import Rotation

from partconverter.finding import find_rollers
from partconverter.sat import SatError

DATA = Path(__file__).parent / "data" / "sat"
# Sizes of a metre at most, printed with 17 digits and turned a few times: round-off stays below a nanometre.
EXACT = 1e-9


def found(*bodies, version=700, unit_mm=1.0, **options):
    return find_rollers(write_sat(bodies, version, unit_mm).encode(), "x.sat", **options)


def only(*bodies, **options):
    result = found(*bodies, **options)
    assert len(result.rollers) == 1, result.left_out
    return result.rollers[0]


def reasons(*bodies, **options):
    result = found(*bodies, **options)
    assert not result.rollers
    return [reason for _, _, reason, _ in result.left_out]


def middle(roller, span="drum"):
    low, high = getattr(roller, span)
    return [o + (low + high) / 2 * a for o, a in zip(roller.origin, roller.axis)]


def assert_is(roller, diameter, length, centre=(0, 0, 0), axis=(0, 0, 1), overall=None):
    """Sizes in mm, whatever the sign of the axis."""
    assert roller.diameter == pytest.approx(diameter / 1000, abs=EXACT)
    assert roller.drum.length == pytest.approx(length / 1000, abs=EXACT)
    assert roller.overall.length == pytest.approx((overall or length) / 1000, abs=EXACT)
    assert middle(roller) == pytest.approx([c / 1000 for c in centre], abs=EXACT)
    size = sqrt(sum(a * a for a in axis))
    assert abs(sum(a * b for a, b in zip(roller.axis, axis))) / size == pytest.approx(1, abs=EXACT)


# --- sound files of every version -----------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
def test_a_conveyor_is_read_without_one_error_in_every_version(version):
    bodies, truth = solids.conveyor()
    result = find_rollers(write_sat(bodies, version).encode(), "x.sat")
    assert len(truth) == 204
    assert len(result.left_out) == 60
    assert {reason for _, _, reason, _ in result.left_out} == {"no cylinder"}
    assert [one.cad_name for one in result.rollers] == [b.name for b in bodies if "beam" not in b.name]
    for one, (diameter, length, centre, axis) in zip(result.rollers, truth, strict=True):
        assert_is(one, diameter, length, centre, axis, one.overall.length * 1000)


def test_real_files_hold_what_their_sources_say():
    told = {}
    for path in DATA.glob("*.sat"):
        result = find_rollers(path.read_bytes(), path.name)
        told[path.name] = [reason for _, _, reason, _ in result.left_out]
        for one in result.rollers:
            assert path.name == "dagmc_cylinder.sat"
            assert_is(one, 20, 20)
    assert told == {
        "dagmc_cylinder.sat": [],
        "dagmc_cones.sat": ["no cylinder"],
        "nist_mallet.sat": ["not a body of revolution"],
        "ezdxf_cube777.sat": ["no cylinder"],
        "ezdxf_prism.sat": ["no cylinder"],
        "knut_ro460_ri300_w44_sym.sat": [],
    }


# --- spellings of one shape ------------------------------------------------------------------------------------


@pytest.mark.parametrize("pieces", [1, 2, 3, 4, 7])
@pytest.mark.parametrize("seam", [False, True])
@pytest.mark.parametrize("hole", ["reversed", "cosine"])
@pytest.mark.parametrize("axis", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0.6, 0, -0.8), (1, 1, 1)])
def test_whole_split_and_seamed_faces_give_the_same_tube(pieces, seam, hole, axis):
    tube = cylinder(133, 380, (10, -20, 30), axis, bore=120, pieces=pieces, seam=seam, hole=hole)
    roller = only(tube)
    assert_is(roller, 133, 380, (10, -20, 30), axis)
    assert roller.bore == pytest.approx(0.120, abs=EXACT)
    assert not roller.notes


def test_a_sine_of_round_off_is_a_cylinder_and_a_real_one_a_cone():
    text = write_sat([cylinder(133, 380)])
    line = next(line for line in text.splitlines() if line.startswith("cone-surface"))
    for sine, kind in (("6.1232339957367660e-17", 1), ("1e-9", 1), ("0.0099995000374968751", 0)):
        cosine = "0.99995000374968751" if kind == 0 else "1"
        changed = text.replace(line, line.replace("I I 0 1 ", f"I I {sine} {cosine} "))
        assert len(find_rollers(changed.encode(), "x.sat").rollers) == kind


# --- shapes of rollers -----------------------------------------------------------------------------------------

FILLETS = [(0, -200), (95, -200, (95, -195)), (100, -195), (100, 195, (95, 195)), (95, 200), (0, 200)]
CHAMFERS = [(0, -200), (95, -200), (100, -195), (100, 195), (95, 200), (0, 200)]
CROWN = [(0, -200), (98, -200), (100, -100), (100, 100), (98, 200), (0, 200)]
BARREL_ENDS = [(0, -200), (99, -200, (-2401, 0)), (100, -100), (100, 100), (99, 200), (0, 200)]


def test_the_smallest_chamfer_is_a_chamfer_and_no_tip_of_a_cone():
    chamfer = [
        (0, -200),
        (199.99, -200),
        (200, -199.99),
        (200, 199.99),
        (199.99, 200),
        (30, 200),
        (30, 250),
        (0, 250),
    ]
    assert_is(only(revolve(chamfer)), 400, 400, overall=450)


@pytest.mark.parametrize("pieces", [1, 3])
@pytest.mark.parametrize(
    ("profile", "straight", "fillet"), [(FILLETS, 390, 5), (CHAMFERS, 390, 0), (CROWN, 200, 0)], ids=str
)
def test_fillets_chamfers_and_crowns_belong_to_the_drum(profile, straight, fillet, pieces):
    roller = only(revolve(profile, (5, 6, 7), (0.6, 0, 0.8), pieces=pieces))
    assert_is(roller, 200, 400, (5, 6, 7), (0.6, 0, 0.8))
    assert roller.face.length == pytest.approx(straight / 1000, abs=EXACT)
    assert roller.fillet == pytest.approx(fillet / 1000, abs=EXACT)


def test_a_crown_is_reported_with_its_end_diameter():
    assert only(revolve(CROWN)).notes == ("crowned: diameter 196 mm at its ends",)
    assert only(revolve(CHAMFERS)).notes == ()
    assert only(revolve(CROWN), unit_mm=25.4).notes == ("crowned: diameter 4978.4 mm at its ends",)


def test_a_fillet_at_one_end_only_is_no_edge_radius():
    assert only(revolve([(0, -200), (100, -200), *FILLETS[3:]])).fillet == 0


def test_journals_and_their_fillets_count_for_the_whole_length_only():
    profile = [(0, -260), (25, -260), (25, -205, (30, -205)), (30, -200), (100, -200), (100, 200), (25, 200)]
    roller = only(revolve([*profile, (25, 240), (0, 240)], (0, 50, 0), (0, 1, 0)))
    assert_is(roller, 200, 400, (0, 50, 0), (0, 1, 0), overall=500)
    assert middle(roller, "overall") == pytest.approx([0, 0.040, 0], abs=EXACT)


def test_a_steep_conical_end_is_no_part_of_the_drum():
    roller = only(revolve([(0, -300), (30, -300), (100, -200), (100, 200), (30, 300), (0, 300)]))
    assert_is(roller, 200, 400, overall=600)


def test_domes_count_for_the_whole_length():
    roller = only(revolve([(0, -100, (0, 0)), (100, 0), (100, 300, (0, 300)), (0, 400)], seam=True))
    assert_is(roller, 200, 300, (0, 0, 150), overall=500)


def test_a_bulging_end_reaches_as_far_as_its_arc():
    # A half-round rim: the torus reaches 10 beyond both of its edges.
    rim = [(80, 0), (80, -100, (90, -100)), (100, -100), (100, 0, (90, 0))]
    roller = only(revolve(rim))
    assert roller.overall.length == pytest.approx(0.120, abs=EXACT)


def test_a_stepped_bore_is_its_narrowest_part_and_a_blind_one_none():
    through = [(20, -200), (100, -200), (100, 200), (40, 200), (40, 150), (20, 150)]
    blind = [(0, -150), (0, -200), (100, -200), (100, 200), (40, 200), (40, 150), (0, 150)]
    assert only(revolve(through)).bore == pytest.approx(0.040, abs=EXACT)
    assert only(revolve(blind[1:])).bore == 0


def test_a_closed_hollow_drum_is_a_drum_without_bore():
    void = revolve([(0, 240), (190, 240), (190, -240), (0, -240)])
    roller = only(solids.with_void(cylinder(400, 500), void))
    assert_is(roller, 400, 500)
    assert roller.bore == 0


def test_several_lumps_of_a_body_are_several_rollers():
    result = found(Body([cylinder(133, 380, (0, y, 0)) for y in (0, 500, 1000)], "set"))
    assert [round(middle(roller)[1], 9) for roller in result.rollers] == [0, 0.5, 1.0]


def test_flanges_are_reported_and_the_longest_section_can_be_asked_for():
    flanged = [(0, -120), (60, -120), (60, -110), (50, -110), (50, 110), (60, 110), (60, 120), (0, 120)]
    largest = only(revolve(flanged))
    assert_is(largest, 120, 240)
    assert "--section longest" in largest.notes[0]
    assert "2 cylinders of the same diameter" in largest.notes[1]
    assert_is(only(revolve(flanged), section="longest"), 100, 220, overall=240)


def test_grooves_between_equal_sections_are_bridged():
    grooved = [(0, -100), (50, -100), (50, -5, (50, 0)), (50, 5), (50, 100), (0, 100)]
    assert_is(only(revolve(grooved)), 100, 200)


# --- shapes that are not quite rollers -------------------------------------------------------------------------


def test_a_keyed_shaft_is_recognised_with_a_warning():
    result = found(solids.extrude(solids.notched_circle(50, 14, 5), high=300))
    assert_is(result.rollers[0], 100, 300, (0, 0, 150))
    assert "3 of 6 faces do not revolve" in result.warnings[0]
    # The keyway takes 2 asin(7/50) of the circumference.
    assert "95.5 % of the circumference" in result.warnings[0]


def test_a_drum_with_drilled_ends_is_recognised_with_a_warning():
    drum = roller(400, 500, 80, 700)
    for angle in (0, 90, 180, 270):
        place = (120 * cos(radians(angle)), 120 * sin(radians(angle)), 250)
        drum = solids.drilled(drum, place, (0, 0, 1), 15, 30)
    result = found(drum)
    assert_is(result.rollers[0], 400, 500, overall=700)
    assert "do not revolve" in result.warnings[0]


def test_a_drum_with_a_hole_in_its_shell_is_recognised_with_a_warning():
    result = found(solids.radially_drilled(200, 500, 10, 30))
    assert_is(result.rollers[0], 400, 500)
    assert "2 of 5 faces do not revolve" in result.warnings[0]


def test_conical_bodies_are_listed_and_written_when_asked_for():
    tapered = [(0, -230), (10, -230), (10, -200), (50, -200), (66, 200), (10, 200), (10, 230), (0, 230)]
    for solid, diameter, length, overall in (
        (revolve(tapered), 132, 400, 460),
        (solids.double_cone(195, 200, 500), 400, 500, 500),
        (revolve([(0, -100), (98, -100, (-2401, 0)), (98, 100), (0, 100)]), 200, 200, 200),
    ):
        result = found(solid)
        assert [reason for _, _, reason, _ in result.left_out] == ["conical"]
        assert "--cones" in result.warnings[0]
        roller = only(solid, cones=True)
        # The barrel's radius in the file is a few thousand mm away from its surface: 98 is not exactly on its arc.
        assert roller.diameter == pytest.approx(diameter / 1000, abs=1e-3 if length == 200 else EXACT)
        assert roller.drum.length == pytest.approx(length / 1000, abs=EXACT)
        assert roller.overall.length == pytest.approx(overall / 1000, abs=EXACT)


@pytest.mark.parametrize(
    ("solid", "reason"),
    [
        (box((100, 900, 80)), "no cylinder"),
        (solids.extrude(solids.rectangle(400, 300), [solids.circle(40, ccw=False)], high=20), "no cylinder"),
        (solids.extrude(solids.half_disc(60), high=500), "part of a cylinder"),
        (solids.extrude(solids.rounded_rectangle(100, 50, 10), high=500), "not a body of revolution"),
        (solids.extrude(solids.rounded_rectangle(100, 50, 24.99), high=500), "not a body of revolution"),
        (solids.as_nurbs(cylinder(133, 380)), "freeform"),
        (solids.as_nurbs(roller(133, 380, 25, 430)), "freeform"),
    ],
    ids=["box", "plate with hole", "half", "rounded box", "stadium", "nurbs", "nurbs roller"],
)
def test_what_is_no_roller_is_left_out_by_name(solid, reason):
    assert reasons(solid) == [reason]


def test_nurbs_cylinders_are_reported_with_their_diameter():
    assert "looks like a cylinder of diameter 133" in found(solids.as_nurbs(cylinder(133, 380))).warnings[0]


def test_an_elliptic_cylinder_is_no_roller():
    text = write_sat([cylinder(133, 380)])
    oval = text.replace("66.5 0 1 I I 0 1 66.5", "66.5 0 0.8 I I 0 1 66.5").replace(
        "66.5 0 1 I I #", "66.5 0 0.8 I I #"
    )
    assert oval != text
    assert [left[2] for left in find_rollers(oval.encode(), "x").left_out] == ["no cylinder"]


def test_a_drum_turned_inside_out_is_reported():
    text = write_sat([cylinder(133, 380)])
    cone = next(line for line in text.splitlines() if line.startswith("cone-surface"))
    inside_out = text.replace(cone, cone.replace("I I 0 1 66.5", "I I 0 -1 66.5"))
    result = find_rollers(inside_out.encode(), "x")
    assert "inside out" in result.warnings[0]


WHOLE = """700 0 1 0
10 Sample CAD 8 ACIS 7.0 24 Mon Jan 05 08:00:00 2026
1 9.9999999999999995e-07 1e-10
body $-1 -1 $-1 $1 $-1 $-1 #
lump $-1 -1 $-1 $-1 $2 $0 #
shell $-1 -1 $-1 $-1 $-1 $3 $-1 $1 #
face $-1 -1 $-1 $-1 $-1 $2 $-1 $4 forward single #
{surface} forward_v I I I I #
End-of-ACIS-data
"""


def test_rings_and_balls_without_any_edge_are_no_cylinders():
    ring = WHOLE.format(surface="torus-surface $-1 -1 $-1 0 0 5 0 0 1 100 10 1 0 0")
    result = find_rollers(ring.encode(), "x")
    assert [left[2] for left in result.left_out] == ["conical"]
    asked_for = find_rollers(ring.encode(), "x", cones=True).rollers[0]
    assert_is(asked_for, 220, 20, (0, 0, 5))
    for surface, reason in (
        ("sphere-surface $-1 -1 $-1 0 0 0 25 1 0 0 0 0 1", "no cylinder"),
        ("plane-surface $-1 -1 $-1 0 0 0 0 0 1 1 0 0", "no cylinder"),
        ("cone-surface $-1 -1 $-1 0 0 0 0 0 1 5 0 0 1 I I 0 1 5", "damaged"),
    ):
        found_one = find_rollers(WHOLE.format(surface=surface).encode(), "x")
        assert [left[2] for left in found_one.left_out] == [reason]


def test_a_hole_larger_than_the_boss_does_not_hide_it():
    flange = solids.extrude(solids.rectangle(400, 300), [solids.circle(90, ccw=False)], high=20)
    assert reasons(flange) == ["no cylinder"]


def test_sheets_open_shells_and_wires_are_left_out():
    sheet = cylinder(133, 380)
    sheet.sides = "double"
    lid_off = cylinder(133, 380)
    lid_off.shells[0].pop()
    assert reasons(sheet) == ["sheet"]
    assert reasons(lid_off) == ["open"]
    wires = find_rollers((DATA / "knut_ro460_ri300_w44_sym.sat").read_bytes(), "knut.sat")
    assert "wires" in wires.warnings[0]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("point $-1 -1 $-1 0 66.5 -190", "point $-1 -1 $-1 0 60.5 -190"),
        ("0 0 -190 0 0 1 0 66.5 0 1 I I 0 1", "0 0 -190 0 0 1 0 65.5 0 1 I I 0 1"),
        ("plane-surface $-1 -1 $-1 0 0 190", "plane-surface $-1 -1 $-1 0 0 180"),
        ("ellipse-curve $-1 -1 $-1 0 0 190 0 0 1 0 66.5", "ellipse-curve $-1 -1 $-1 0 0 190 0 0 1 0 61.5"),
    ],
    ids=["point", "cylinder", "plane", "circle"],
)
def test_numbers_that_do_not_fit_together_are_no_roller(old, new):
    text = write_sat([cylinder(133, 380)])
    assert old in text
    result = find_rollers(text.replace(old, new, 1).encode(), "x.sat")
    assert [reason for _, _, reason, _ in result.left_out] == ["damaged"]


# --- where it stands -------------------------------------------------------------------------------------------

TILT = ((cos(0.3), sin(0.3), 0.0), (-sin(0.3), cos(0.3), 0.0), (0.0, 0.0, 1.0))
MIRROR = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))


def row_times(point, matrix):
    return tuple(sum(point[i] * matrix[i][j] for i in range(3)) for j in range(3))


@pytest.mark.parametrize("version", [106, 400, 700, 3000, 22700])
@pytest.mark.parametrize("matrix", [None, TILT, MIRROR], ids=["no turn", "turn", "mirror"])
@pytest.mark.parametrize("scale", [1.0, 2.5, 1 / 25.4])
def test_bodies_are_turned_scaled_then_shifted(version, matrix, scale):
    centre, axis, shift = (10.0, 20.0, 30.0), (0.6, 0.0, 0.8), (100.0, -200.0, 300.0)
    body = Body([roller(133, 380, 25, 440, centre, axis)], matrix=matrix, shift=shift, scale=scale)
    rows = matrix or ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    where = [scale * p + s for p, s in zip(row_times(centre, rows), shift)]
    found_one = only(body, version=version)
    assert_is(found_one, 133 * scale, 380 * scale, where, row_times(axis, rows), 440 * scale)


@pytest.mark.parametrize("unit_mm", [1.0, 10.0, 25.4, 304.8, 1000.0])
def test_the_header_says_the_unit(unit_mm):
    assert_is(only(cylinder(133 / unit_mm, 380 / unit_mm), unit_mm=unit_mm), 133, 380)


def test_header_and_transform_may_cancel_each_other():
    body = Body([cylinder(133, 380)], scale=1 / 25.4)
    assert_is(only(body, unit_mm=25.4), 133, 380)


def test_a_given_unit_overrides_the_header_and_an_odd_one_is_questioned():
    assert_is(
        find_rollers(write_sat([cylinder(0.133, 0.38)]).encode(), "x", unit_mm=1000.0).rollers[0], 133, 380
    )
    assert "is the unit wrong?" in found(cylinder(0.133, 0.38)).warnings[-1]
    assert "no usual unit" in found(cylinder(133, 380), unit_mm=7.0).warnings[0]
    assert "does not say its unit" in found(cylinder(133, 380), version=106).warnings[0]


def test_sheared_and_crooked_transforms_are_refused():
    with pytest.raises(SatError, match=r"x\.sat:\d+: found a sheared body"):
        found(Body([cylinder(133, 380)], shift=(1, 2, 3), shear=True))
    with pytest.raises(SatError, match="no rotation"):
        found(Body([cylinder(133, 380)], matrix=((1, 0.1, 0), (0, 1, 0), (0, 0, 1))))


directions = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: sum(x * x for x in v) > 0.01)
places = st.tuples(*[st.floats(-1e6, 1e6)] * 3)


@settings(max_examples=80, deadline=None, derandomize=True)
@given(
    version=st.sampled_from(VERSIONS[1:]),
    diameter=st.floats(20, 2000),
    length=st.floats(10, 3000),
    centre=places,
    axis=directions,
    turn=st.tuples(directions, st.floats(0, 3.1)),
    shift=places,
    unit_mm=st.sampled_from([1.0, 10.0, 25.4, 1000.0]),
    pieces=st.integers(1, 4),
    seam=st.booleans(),
)
def test_any_roller_is_found_anywhere(
    version, diameter, length, centre, axis, turn, shift, unit_mm, pieces, seam
):
    size = sqrt(sum(v * v for v in turn[0]))
    matrix = Rotation.from_rotvec([turn[1] * v / size for v in turn[0]]).as_matrix().T
    rows = tuple(map(tuple, matrix.tolist()))
    scaled = [v / unit_mm for v in (diameter, length, *centre, *shift)]
    shape = roller(
        scaled[0], scaled[1], scaled[0] / 5, 1.2 * scaled[1], scaled[2:5], axis, pieces=pieces, seam=seam
    )
    one = only(Body([shape], matrix=rows, shift=scaled[5:]), version=version, unit_mm=unit_mm)
    where = [p + s for p, s in zip(row_times(centre, rows), shift)]
    assert one.diameter == pytest.approx(diameter / 1000, rel=1e-12, abs=1e-11)
    # Coordinates of up to 2 km in mm have a round-off of 2e-10 mm each; a hundred operations stay below 1e-10 m.
    assert one.drum.length == pytest.approx(length / 1000, abs=1e-10)
    assert one.overall.length == pytest.approx(1.2 * length / 1000, abs=1e-10)
    assert middle(one) == pytest.approx([v / 1000 for v in where], abs=1e-9)


def test_the_axis_points_to_its_largest_positive_component():
    for axis in ((0, 0, 1), (0, 0, -1), (-1, 0, 0), (0.1, -0.9, 0.2)):
        roller = only(cylinder(133, 380, (0, 0, 0), axis))
        assert max(roller.axis, key=abs) > 0
        assert isclose(sum(a * a for a in roller.axis), 1, abs_tol=EXACT)
