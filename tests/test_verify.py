"""The verification book: quick cases hold, a row that does not is shown as failing, the command keeps its habits."""

import json
import math
from xml.etree import ElementTree

import numpy as np
import pytest
from click.testing import CliRunner

from beltsim.cli import main
from beltsim.verify import book, discharge, two_pulleys
from beltsim.verify.case import Case, Findings, Plot, Row, Series
from beltsim.verify.svg import svg, ticks

QUICK = {name: case for _, name, case in book.chosen(quick=True)}


@pytest.mark.parametrize("name", QUICK)
def test_quick_case_is_within_tolerance(name):
    rows = QUICK[name].find().rows
    assert rows
    assert [row for row in rows if not row.passed] == []


@pytest.mark.parametrize("start", [0.1, 0.8])
def test_the_target_of_a_grain_without_friction_is_that_of_a_bead_on_a_ball(start):
    angle, speed = discharge.ride(start, carried=5.0, radius=0.2, friction=0.0)
    # Energy and v^2 = g R cos: cos = 2/3 + v0^2 / 3 g R. The ride is added up in steps of 1e-5 rad.
    assert math.cos(angle) == pytest.approx(2 / 3 + start**2 / (3 * discharge.G * 0.2), abs=1e-4)
    assert speed == pytest.approx(math.sqrt(discharge.G * 0.2 * math.cos(angle)), abs=1e-4)


def test_a_grain_held_fast_leaves_where_its_weight_no_longer_holds_it_and_a_fast_one_at_once():
    angle, speed = discharge.ride(1.0, carried=1.0, radius=0.2, friction=1e5)
    assert math.cos(angle) == pytest.approx(1.0 / (discharge.G * 0.2), abs=1e-3)
    assert speed == pytest.approx(1.0, abs=1e-3)
    assert discharge.ride(1.5, carried=1.5, radius=0.2, friction=0.5) == (0.0, 1.5)


def test_a_thin_loop_slips_all_around_where_its_tensions_are_as_euler_says():
    theory = two_pulleys.Theory(two_pulleys.STRING, speed=5.0)
    tight, slack, _ = theory.under(theory.gross_slip())
    lost = two_pulleys.STRING.line_mass * 25.0
    assert (tight - lost) / (slack - lost) == pytest.approx(math.exp(0.4 * math.pi * 0.2 / 0.201), rel=1e-9)
    # Without torque the strain is that given, less what the dents of the contacts take: 0.03 %
    assert theory.under(0.0)[:2] == pytest.approx((500.0, 500.0), rel=1e-3)


def test_cases_find_the_same_in_processes_of_their_own():
    cases = book.chosen(["B4f", "K2"])
    alone, together = list(book.run_cases(cases)), list(book.run_cases(cases, jobs=2))
    assert [run.name for run in together] == ["B4f", "K2"]
    for near, far in zip(alone, together):
        assert [row.result for row in far.findings.rows] == pytest.approx(
            [row.result for row in near.findings.rows], rel=1e-9, abs=1e-12
        )


# --- rows ------------------------------------------------------------------------------------------------------


def row(result, *, target=2.0, tolerance=0.01, absolute=False):
    return Row("speed", "m/s", target, result, tolerance, absolute)


def test_errors_are_relative_to_the_target_unless_absolute():
    assert row(2.01).error == pytest.approx(0.005)
    assert row(2.01, absolute=True).error == pytest.approx(0.01)
    assert row(1e-9, target=0.0, absolute=True).passed


def test_a_row_passes_up_to_its_tolerance_and_never_with_nan():
    assert row(2.019).passed
    assert not row(2.021).passed
    assert not row(math.nan).passed
    assert not row(math.inf).passed


# --- the page --------------------------------------------------------------------------------------------------


def curve():
    x = np.linspace(0.0, 1.0, 20)
    series = [Series("theory < truth", x, x**2), Series("solver", x[::5], x[::5] ** 2, True)]
    return Plot("parabola", "A parabola & its points", "x", "y", series)


def broken():
    raise RuntimeError("no belt")


@pytest.fixture
def made_up(monkeypatch):
    """A book of three cases that take no time: one passes, one fails, one cannot run."""
    chapters = {
        "First": {
            "G": Case("Good", "theory", lambda: Findings([row(2.0)], [curve()])),
            "B": Case(
                "Bad", "theory", lambda: Findings([row(3.0), row(2.0)]), quick=False, note="It is too fast."
            ),
        },
        "Second": {
            "X": Case("Broken", "theory", broken, quick=False),
            "Gq": Case("Short", "theory", lambda: Findings([row(2.0)])),
        },
    }
    monkeypatch.setattr(book, "CHAPTERS", chapters)
    return CliRunner()


def test_a_failing_row_is_shown_as_failing_with_its_reason(made_up):
    page = book.page(list(book.run_cases(book.chosen())), "head", lambda name: f"{name}.svg")
    assert "2 of 3 rows in 3 cases are within tolerance; not all of: B, X." in page
    assert "| speed | 2 m/s | 3 m/s | 0.5 | 0.01 | **FAIL** |" in page
    assert "It is too fast." in page
    assert "**Failed:** RuntimeError: no belt" in page
    assert "![A parabola & its points](parabola.svg)" in page


def test_short_variants_are_run_only_when_quick_or_asked_for(made_up):
    assert [name for _, name, _ in book.chosen()] == ["G", "B", "X"]
    assert [name for _, name, _ in book.chosen(quick=True)] == ["G", "Gq"]
    assert [name for _, name, _ in book.chosen(["Gq", "B"])] == ["B", "Gq"]


def test_the_command_writes_the_page_and_its_plots(made_up, tmp_path):
    target = tmp_path / "verification.md"
    result = made_up.invoke(main, ["verify", "--quick", "-o", str(target)])
    assert result.exit_code == 0, result.output
    assert "![A parabola & its points](verification/parabola.svg)" in target.read_text()
    ElementTree.parse(tmp_path / "verification" / "parabola.svg")
    assert result.stdout == ""
    again = made_up.invoke(main, ["verify", "--quick", "-o", str(target)])
    assert again.exit_code == 2
    assert "--overwrite" in again.stderr
    assert made_up.invoke(main, ["verify", "--quick", "--overwrite", "-o", str(target)]).exit_code == 0


def test_without_an_output_the_page_goes_to_stdout(made_up):
    result = made_up.invoke(main, ["verify", "--only", "G"])
    assert result.exit_code == 0
    assert result.stdout.startswith("# Verification")
    assert "pass  G" in result.stderr


def test_a_row_out_of_tolerance_ends_with_exit_code_6(made_up):
    result = made_up.invoke(main, ["verify"])
    assert result.exit_code == 6
    assert "out of tolerance: B, X" in result.stderr
    assert "speed: 3, expected 2" in result.stderr


def test_an_unknown_case_is_named(made_up):
    result = made_up.invoke(main, ["verify", "--only", "G,Z9"])
    assert result.exit_code == 2
    assert "no case Z9" in result.stderr


def test_what_could_not_be_written_is_refused_before_the_run(made_up, tmp_path):
    for arguments, words in (
        (["-o", str(tmp_path / "none" / "page.md")], "does not exist"),
        (["-o", str(tmp_path / "page")], "expected a file name"),
        (["--json", "-o", "-"], "stdout"),
        (["--only", ","], "expected names"),
    ):
        result = made_up.invoke(main, ["verify", *arguments])
        assert result.exit_code == 2
        assert words in result.stderr
        assert "pass" not in result.stderr
    (tmp_path / "plots").mkdir()
    assert made_up.invoke(main, ["verify", "-o", str(tmp_path / "plots.md")]).exit_code == 2


def test_json_holds_every_row(made_up):
    result = made_up.invoke(main, ["verify", "--json", "-q"])
    assert result.exit_code == 6
    body = json.loads(result.stdout)
    assert body["status"] == "failed"
    assert body["counts"] == {"cases": 3, "cases_passed": 1, "rows": 3, "rows_passed": 2}
    bad = body["cases"][1]["rows"][0]
    assert (bad["target"], bad["result"], bad["error"], bad["passed"]) == (2.0, 3.0, 0.5, False)
    assert body["cases"][2]["trouble"] == "RuntimeError: no belt"


def test_the_list_runs_nothing(made_up):
    result = made_up.invoke(main, ["verify", "--list"])
    assert result.exit_code == 0
    assert "X      Broken (Second)" in result.stdout


# --- plots -----------------------------------------------------------------------------------------------------


def test_a_plot_is_xml_with_its_curves_and_points():
    root = ElementTree.fromstring(svg(curve()))
    names = [element.tag.rpartition("}")[2] for element in root.iter()]
    assert names.count("polyline") == 2  # the curve and its legend
    assert names.count("circle") == 5
    assert "theory < truth" in [element.text for element in root.iter()]


def test_a_constant_curve_can_be_drawn():
    flat = Plot("flat", "Flat", "x", "y", [Series("one", np.array([0.0, 1.0]), np.array([3.0, 3.0]))])
    assert "nan" not in svg(flat)


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (-3e-7, 2e-7), (1234.0, 98765.0)])
def test_ticks_are_a_few_round_numbers_inside(low, high):
    found = ticks(low, high)
    assert 3 <= len(found) <= 8
    assert low - 1e-9 * (high - low) <= min(found)
    assert max(found) <= high + 1e-9 * (high - low)
    step = np.diff(found)
    np.testing.assert_allclose(step, step[0], rtol=1e-9)


def test_names_of_cases_are_taken_in_either_case(made_up):
    from beltsim.verify import book

    names = [name for _, name, _ in book.chosen()]
    assert [name for _, name, _ in book.chosen([names[0].lower(), names[-1].upper()])] == [
        names[0],
        names[-1],
    ]
