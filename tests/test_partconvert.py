"""The command partconvert: what it writes where, its tables, its refusals and exit codes."""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import sat_solids as solids
from click.testing import CliRunner
from sat_solids import Body, box, cylinder, roller, write_sat

from beltsim import inp
from partconverter.cli import main

DATA = Path(__file__).parent / "data" / "sat"


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Run the command in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return lambda *words, **more: CliRunner().invoke(main, [str(word) for word in words], **more)


@pytest.fixture
def frame(tmp_path):
    """A small assembly: a pulley, three idlers with their shafts as own bodies, a beam."""
    bodies = [Body([roller(400, 750, 80, 950, (0, 0, 0), (0, 1, 0))], "head pulley")]
    for i in range(3):
        centre = (1000 * (i + 1), 0, 150)
        bodies.append(Body([cylinder(108, 600, centre, (0, 1, 0), bore=90)], f"idler {i + 1}"))
        bodies.append(Body([cylinder(20, 700, centre, (0, 1, 0))], f"shaft {i + 1}"))
    bodies.append(Body([box((3000, 80, 80), (1500, 0, -300))], "beam"))
    path = tmp_path / "frame.sat"
    path.write_text(write_sat(bodies))
    return path


def test_one_cylinder_of_twenty_millimetres_at_the_origin(run):
    result = run(DATA / "dagmc_cylinder.sat")
    assert result.exit_code == 0
    (part,) = inp.read_text(result.stdout).blocks("PART")
    assert (part["SHAPE"], part["DIAMETER"], part["LENGTH"], part["EDGE RADIUS"]) == (
        "CYLINDER",
        0.02,
        0.02,
        0.0,
    )
    assert part.rows["position"].tolist() == [[0, 0, 0]]
    assert part.rows["orientation"].tolist() == [[1, 0, 0, 0]]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("dagmc_cones.sat", "1 solid without an outer cylinder"),
        ("nist_mallet.sat", "1 solid with an outer cylinder, but not turned round its axis"),
        ("ezdxf_cube777.sat", "1 solid without an outer cylinder"),
        ("ezdxf_prism.sat", "1 solid without an outer cylinder"),
        ("knut_ro460_ri300_w44_sym.sat", "1 body of wires without faces"),
    ],
)
def test_a_file_without_rollers_ends_with_4_and_says_what_is_in_it(run, tmp_path, name, words):
    result = run(DATA / name, "-o", "parts.inp")
    assert result.exit_code == 4
    assert words in result.stderr
    assert not list(tmp_path.iterdir())
    assert result.stdout == ""


def test_stdout_is_the_deck_alone_and_o_writes_the_same(run, frame):
    piped = run("-", input=frame.read_bytes())
    assert piped.exit_code == 0
    assert run(frame, "-o", "parts.inp").stdout == ""
    written = Path("parts.inp").read_bytes()
    assert written.replace(b"frame.sat", b"<stdin>") == piped.stdout.encode()
    assert run(frame).stdout.encode() == written


def test_the_deck_reads_back_and_says_how_it_came_about(run, frame):
    deck = inp.read_text(run(frame, "--diameter-limit", "300mm", "--quantity-limit", "1").stdout)
    infos = {block["TITLE"]: block.rows["text"] for block in deck.blocks("INFO")}
    assert list(infos) == ["CONVERSION SETTINGS", "RESULT"]
    told = infos["CONVERSION SETTINGS"]
    assert "length = drum" in told
    assert "diameter limit = 0.3" in told
    assert f"sha256 = {hashlib.sha256(frame.read_bytes()).hexdigest()}" in told
    result = infos["RESULT"]
    assert {"solids = 8", "cylinders = 7", "pulleys = 1", "idlers = 6", "left out = 1"} <= set(result)
    assert any("diameter at or above 0.3 m" in line for line in result)
    assert deck.blocks("MATERIAL")[0]["NAME"] == "steel"


def test_shafts_in_tubes_are_questioned_and_merged_when_asked(run, frame):
    assert "--merge-coaxial" in run(frame).stderr
    merged = run(frame, "--merge-coaxial")
    assert "share an axis" not in merged.stderr
    assert [p["DIAMETER"] for p in inp.read_text(merged.stdout).blocks("PART")] == [0.4, 0.108, 0.108, 0.108]


def test_filters_leave_out_and_an_empty_rest_ends_with_4(run, frame):
    assert len(inp.read_text(run(frame, "--min-diameter", "50mm").stdout).blocks("PART")) == 4
    assert len(inp.read_text(run(frame, "--max-diameter", "0.3").stdout).blocks("PART")) == 6
    only = run(frame, "--only", "pulley", "--diameter-limit", "300 mm")
    assert [p["NAME"] for p in inp.read_text(only.stdout).blocks("PART")] == ["pulley_001"]
    nothing = run(frame, "--only", "pulley")
    assert nothing.exit_code == 4
    assert "none of the 7 cylinders passes" in nothing.stderr


@pytest.mark.parametrize(("length", "expected"), [("drum", 0.75), ("face", 0.75), ("overall", 0.95)])
def test_the_length_is_chosen(run, frame, length, expected):
    deck = inp.read_text(run(frame, "--length", length, "--min-diameter", "300mm").stdout)
    assert deck.blocks("PART")[0]["LENGTH"] == expected


def test_auto_writes_pulleys_as_parts_and_idlers_as_particles(run, frame):
    words = (
        "--as",
        "auto",
        "--diameter-limit",
        "300mm",
        "--min-diameter",
        "50mm",
        "--edge-radius",
        "2mm",
        "--first-id",
        500,
    )
    deck = inp.read_text(
        run(frame, *words, "--name-prefix", "b_", "--material", "iron", "--colour-by", "geometry").stdout
    )
    assert [p["NAME"] for p in deck.blocks("PART")] == ["b_pulley_001"]
    (kind,) = deck.blocks("PARTICLE TYPE")
    assert (kind["NAME"], kind["FIXED"], kind["EDGE RADIUS"]) == ("b_idler_d108x600", "POSITION", 0.002)
    assert kind["MATERIAL"] == "iron"
    assert deck.blocks("PARTICLE")[0].rows["id"].tolist() == [500, 501, 502]


def test_the_list_shows_every_cylinder_with_its_count(run, frame):
    result = run(frame, "--list", "--name-by", "cad", "--diameter-limit", "300mm", "--min-diameter", "50mm")
    head, first, *rest = result.stdout.splitlines()[1:]
    assert head.split() == [
        "name",
        "class",
        "diameter",
        "length",
        "x",
        "y",
        "z",
        "identical",
        "written",
        "as",
    ]
    assert first.split() == ["head_pulley", "PULLEY", "400.00", "750.00", "0.00", "0.00", "0.00", "1", "part"]
    assert [line.split()[0] for line in rest] == ["idler_1", "idler_2", "idler_3"]
    assert {line.split()[7] for line in rest} == {"3"}
    assert "*PART" not in result.stdout


def test_json_has_counts_cylinders_and_what_was_left_out(run, frame):
    result = run(frame, "--json", "-o", "parts.inp")
    told = json.loads(result.stdout)
    assert told["schema_version"] == 1
    assert told["status"] == "ok"
    assert told["counts"]["cylinders"] == len(told["cylinders"]) == 7
    assert told["cylinders"][0]["diameter"] == 0.4
    assert told["left_out"] == [
        {"line": told["left_out"][0]["line"], "cad_name": "beam", "reason": "no cylinder", "detail": ""}
    ]
    assert told["outputs"][0]["sha256"] == hashlib.sha256(Path("parts.inp").read_bytes()).hexdigest()


def test_json_of_a_file_without_rollers_says_what_is_in_it(run):
    result = run(DATA / "nist_mallet.sat", "--json")
    told = json.loads(result.stdout)
    assert (result.exit_code, told["status"], told["cylinders"]) == (4, "nothing to convert", [])
    assert told["left_out"][0]["reason"] == "not a body of revolution"


def test_a_belt_drives_what_it_touches(run, frame):
    from test_part_driving import loop_deck

    with Path("belt.inp").open("wb") as stream:
        inp.write(loop_deck(), stream)
    Path("drum.sat").write_text(
        write_sat([cylinder(400, 300, (0, 0, 0), (0, 1, 0)), cylinder(50, 300, (0, 0, 3000))])
    )
    result = run("drum.sat", "--belt", "belt.inp", "--belt-speed", "2.05m/s", "--ramp", "1.5")
    deck = inp.read_text(result.stdout)
    (motion,) = deck.blocks("MOTION")
    assert motion["ANGULAR VELOCITY"] == pytest.approx(10, rel=1e-4)
    assert deck.blocks("AMPLITUDE")[0].rows["time"].tolist() == [0, 1.5]
    assert "no belt touches 1 of the cylinders" in result.stderr
    assert run("drum.sat", "--belt", "missing.inp", "--belt-speed", "1").exit_code == 3


def test_a_preview_is_drawn(run, frame):
    assert run(frame, "--preview", "view.html", "-o", "parts.inp").exit_code == 0
    assert "<html" in Path("view.html").read_text()[:200].lower()
    assert run(frame, "--preview", "view.gif").exit_code == 2


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (("missing.sat",), 3, "missing.sat"),
        (("frame.sat", "--unit", "parsec"), 2, "parsec"),
        (("frame.sat", "--diameter-limit", "300mn"), 2, "unit 'mn'"),
        (("frame.sat", "--diameter-limit", "-1"), 2, "out of range"),
        (("frame.sat", "--diameter-limit", "300"), 2, "for millimetres write --diameter-limit 300mm"),
        (("frame.sat", "--min-diameter", "50"), 2, "for millimetres write --min-diameter 50mm"),
        (("frame.sat", "--edge-radius", "nan"), 2, "not a number"),
        (("frame.sat", "--belt-speed", "2"), 2, "need --belt"),
        (("frame.sat", "--ramp", "2"), 2, "need --belt"),
        (("frame.sat", "--min-diameter", "2", "--max-diameter", "1"), 2, "above"),
        (("frame.sat", "--pulley-colour", "red"), 2, "not a colour"),
        (("frame.sat", "--name-prefix", "a b"), 2, "--name-prefix"),
        (("frame.sat", "--material", ""), 2, "--material"),
        (("frame.sat", "--list", "--json"), 2, "one of them"),
        (("frame.sat", "--list", "-o", "-"), 2, "stdout"),
        (("frame.sat", "-o", "frame.sat"), 2, "would replace the input"),
        (("frame.sat", "-o", "frame.sat", "--overwrite"), 2, "would replace the input"),
        (("frame.sat", "-o", "broken.sat"), 2, "--overwrite"),
        (("frame.sat", "-o", "no/such/folder.inp"), 2, "no/such"),
        (("frame.sat", "--belt", "frame.sat", "--belt-speed", "1"), 3, "frame.sat:1"),
        (("broken.sat",), 3, "broken.sat:"),
    ],
)
def test_wrong_use_ends_with_its_code_and_one_clear_message(run, frame, tmp_path, words, code, message):
    Path("broken.sat").write_text(frame.read_text()[:2000])
    before = sorted(tmp_path.iterdir())
    result = run(*words)
    assert (result.exit_code, result.stdout) == (code, "")
    assert message in result.stderr
    assert "Traceback" not in result.stderr
    assert sorted(tmp_path.iterdir()) == before


def test_quiet_says_nothing(run, frame):
    assert run(frame, "-q", "-o", "parts.inp").stderr == ""


def test_help_imports_nothing_heavy():
    code = (
        "import sys\nfrom partconverter.cli import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
        "print([m for m in ('numba', 'scipy', 'trimesh', 'h5py', 'embreex') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_every_option_has_help():
    assert all(option.help for option in main.params if option.param_type_name == "option")


def test_the_manual_and_the_command_have_the_same_options():
    manual = (Path(__file__).parent.parent / "docs" / "partconvert.md").read_text()
    named = set(re.findall(r"--[a-z][a-z-]+", manual)) - {"--version"}
    known = {name for option in main.params for name in option.opts if name.startswith("--")}
    assert named <= known
    assert known - named <= {"--overwrite", "--quiet", "--output", "--version"}


def test_two_files_fit_one_case(run, tmp_path):
    for name in ("a", "b"):
        Path(f"{name}.sat").write_text(write_sat(solids.conveyor(2)[0]))
    first = run("a.sat", "--as", "auto", "--diameter-limit", "300mm", "--name-prefix", "a_")
    second = run(
        "b.sat", "--as", "auto", "--diameter-limit", "300mm", "--name-prefix", "b_", "--first-id", 1000
    )
    both = inp.read_text(first.stdout + second.stdout)
    assert len(both.blocks("PART")) == 8
