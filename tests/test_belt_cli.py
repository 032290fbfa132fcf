"""`beltconvert` as a person types it."""

import json
import subprocess
import sys

import belts
import numpy as np
import pytest
from click.testing import CliRunner

from beltconverter.cli import main
from beltsim import inp
from beltsim.console import sha256_of

RING = belts.racetrack(60, 8, trough=0.6)
TEXT = belts.ascii_stl(belts.corners_of(RING))


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Runs the command in an empty folder that holds `belt.stl`."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "belt.stl").write_bytes(TEXT)
    return lambda *words, **more: CliRunner().invoke(main, [str(word) for word in words], **more)


def test_a_plain_call_writes_a_belt_that_reads_back_and_says_what_it_is(run, tmp_path):
    result = run("belt.stl", "-o", "belt.inp")
    assert result.exit_code == 0, result.stderr
    assert result.stdout == ""
    assert "belt: endless, 60 rows x 8 columns, 480 particles, 900 bonds" in result.stderr
    assert "initial strain" in result.stderr
    deck = inp.read(tmp_path / "belt.inp")
    assert sum(len(block) for block in deck.blocks("PARTICLE")) == 480
    assert sum(len(block) for block in deck.blocks("BOND")) == 900


def test_without_output_the_belt_goes_to_stdout_and_nothing_else_does(run):
    result = run("belt.stl", "--unit", "m")
    assert result.exit_code == 0
    assert sum(len(block) for block in inp.read_text(result.stdout_bytes).blocks("PARTICLE")) == 480


def test_stdin_and_file_give_the_same_belt(run):
    piped = run("-", "--unit", "m", input=TEXT).stdout_bytes
    read = run("belt.stl", "--unit", "m").stdout_bytes
    assert piped.split(b"*MATERIAL")[1] == read.split(b"*MATERIAL")[1]


def test_a_converted_belt_and_steps_make_a_case_that_passes_every_check(run):
    tail = "*STEP, DURATION=1\n*OUTPUT, INTERVAL=0.1\n*GRAVITY\n0, 0, -9.81\n"
    options = [
        [],
        ["--touching-edges", "2"],
        ["--fibres", "rows", "--edge", "half"],
        ["--shape", "sphere", "--edge", "half"],
    ]
    for words in options:
        text = run("belt.stl", "--unit", "m", "--belt-speed", "2.5m/s", *words).stdout
        inp.check_case(inp.read_text(text + tail))


def test_json_has_counts_figures_warnings_and_the_hash_of_the_output(run, tmp_path):
    result = run("belt.stl", "-o", "belt.inp", "--json")
    body = json.loads(result.stdout)
    assert body["schema_version"] == 1
    assert body["status"] == "ok"
    assert body["counts"] == {"belts": 1, "particles": 480, "bonds": 900}
    assert body["outputs"] == [{"path": "belt.inp", "sha256": sha256_of(tmp_path / "belt.inp")}]
    assert len(body["belts"][0]["strain_row_max"]) == 60
    assert any("took m" in warning for warning in body["warnings"])
    assert set(body["timings"]) == {"read", "grid", "belt", "write"}


def test_the_deck_keeps_what_it_was_made_from(run, tmp_path):
    (tmp_path / "out").mkdir()
    run("belt.stl", "-o", "out/belt.inp", "--unit", "mm", "--elongation", "101%")
    deck = inp.read(tmp_path / "out" / "belt.inp")
    (source,) = deck.blocks("MESH SOURCE")
    assert source.path().resolve() == (tmp_path / "belt.stl").resolve()
    assert source["UNIT"] == "MM"
    assert source["SHA256"] == sha256_of(tmp_path / "belt.stl")
    assert "elongation_along = 1.01" in source.rows["text"]


@pytest.mark.parametrize(
    ("unit", "scale"), [("m", 1.0), ("mm", 1e-3), ("cm", 1e-2), ("in", 0.0254), ("ft", 0.3048)]
)
def test_the_unit_scales_the_belt(run, unit, scale):
    deck = inp.read_text(run("belt.stl", "--unit", unit).stdout)
    found = np.concatenate([block.rows["position"] for block in deck.blocks("PARTICLE")])
    assert np.ptp(found[:, 0]) == pytest.approx(scale * np.ptp(RING.points[..., 0]), rel=1e-8)


def test_a_unit_that_looks_wrong_is_said_and_never_refused(run):
    result = run("belt.stl", "-o", "belt.inp", "--unit", "mm")
    assert result.exit_code == 0
    assert "is the unit right?" in result.stderr


def test_millimetres_are_inferred_with_a_warning(run, tmp_path):
    (tmp_path / "mm.stl").write_bytes(belts.binary_stl(1000 * belts.corners_of(RING)))
    result = run("mm.stl", "-o", "belt.inp")
    assert "warning: the mesh has no unit: took mm" in result.stderr
    assert "length 5.5" in result.stderr


def test_previews_are_drawn(run, tmp_path, monkeypatch):
    monkeypatch.setattr(
        "beltsim.view.png.SAMPLES", ((0.0, 0.0),)
    )  # a quarter of the rays: a coarse picture will do
    result = run("belt.stl", "-o", "belt.inp", "--preview", "belt.png")
    assert result.exit_code == 0, result.stderr
    assert (tmp_path / "belt.png").read_bytes().startswith(b"\x89PNG")
    result = run("belt.stl", "-o", "belt2.inp", "--preview", "belt.html", "--fibres", "rows")
    assert result.exit_code == 0, result.stderr
    assert "<html" in (tmp_path / "belt.html").read_text()[:500].lower()


def test_zones_come_from_a_table_too(run, tmp_path):
    (tmp_path / "zones.csv").write_text(
        "name, columns, rows, tensile-stiffness, thickness\ncord, 2 4-5, , 9000 N/mm,\nsplice, , 1-3, , 20mm\n"
    )
    deck = inp.read_text(run("belt.stl", "--zones", "zones.csv").stdout)
    counts = {block["TYPE"]: len(block) for block in deck.blocks("PARTICLE")}
    assert counts == {"belt": 57 * 5, "belt_cord": 57 * 3, "belt_splice": 3 * 8}


WRONG = {
    "elongation as a share": (["--elongation", "1%"], "no length relative"),
    "a unit of force": (["--thickness", "10N"], "unit 'N'"),
    "a negative thickness": (["--thickness", "-1mm"], "out of range"),
    "a zero direction": (["--up", "0,0,0"], "is not a direction"),
    "stiffness said twice": (
        ["--tensile-stiffness", "4000", "--youngs-modulus", "1e8"],
        "say the same thing twice",
    ),
    "too much bending stiffness": (["--bending-stiffness", "1e5"], "check the units"),
    "an edge radius beyond half the thickness": (["--edge-radius", "6mm"], "more than half the thickness"),
    "a name with a wildcard": (["--name", "belt*"], "expected a word"),
    "a zone without a colon": (["--zone", "cord"], "expected 'name:"),
    "a zone of an unknown property": (["--zone", "cord: colour=2"], "'colour'"),
    "a zone beyond the belt": (["--zone", "cord: columns=7-9"], "7-9 is not within 1-8"),
    "edges wider than the belt": (["--touching-edges", "5"], "8 columns only"),
    "two products on stdout": (["--json", "-o", "-"], "both print to stdout"),
    "a picture of no known kind": (["--preview", "belt.jpg"], "ends in .png or .html"),
    "an unknown option": (["--speed", "2"], "No such option"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_option_is_a_usage_error_that_says_why(run, name, tmp_path):
    words, found = WRONG[name]
    result = run("belt.stl", *(["-o", "belt.inp"] if "-o" not in words else []), *words)
    assert result.exit_code == 2, result.stderr
    assert found in result.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["belt.stl"]


def test_help_lists_every_option_with_a_text_and_imports_nothing_heavy():
    for option in main.params:
        assert option.name == "mesh" or option.help
    code = (
        "import sys; from beltconverter.cli import main\n"
        "try: main(['--help'])\n"
        "except SystemExit: pass\n"
        "heavy = {'scipy', 'numba', 'trimesh', 'h5py', 'meshio', 'embreex'} & set(sys.modules)\n"
        "sys.exit(', '.join(sorted(heavy)) or 0)"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr


def test_quiet_says_nothing(run):
    assert run("belt.stl", "-o", "belt.inp", "-q").stderr == ""
