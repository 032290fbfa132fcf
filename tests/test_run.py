"""`beltsim run` as a user meets it: from decks to trajectories, exit codes, wrong input, signals, joined decks."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

from beltconverter.cli import main as beltconvert
from beltsim import signals, trajectory
from beltsim.cli import main as beltsim
from beltsim.console import ExitCode, guarded
from partconverter.cli import main as partconvert

TAIL = """
*CONTACT PROPERTY, MATERIAL A=*, MATERIAL B=*, FRICTION=0.4, RESTITUTION=0.3
*GRAVITY
0, 0, -9.81
"""
STEP = "*STEP, DURATION=0.02\n*OUTPUT, INTERVAL=0.005\n"

BALL = """*FORMAT, NAME=BELTSIM, VERSION=1
*MATERIAL, NAME=rubber, DENSITY=1000, YOUNGS MODULUS=1e6, POISSON RATIO=0.4
*CONTACT PROPERTY, MATERIAL A=rubber, MATERIAL B=rubber, FRICTION=0.3, RESTITUTION=0.8
*PARTICLE TYPE, NAME=ball, SHAPE=SPHERE, RADIUS=0.05, MATERIAL=rubber
*PARTICLE, TYPE=ball
7, 0, 0, 1, 1, 0, 0, 0
*GRAVITY
0, 0, -10
"""


def run(*arguments, **more):
    """The command's result."""
    return CliRunner().invoke(beltsim, ["run", *map(str, arguments)], **more)


@pytest.fixture
def ball(tmp_path) -> Path:
    """A deck of one ball that falls for 0.1 s."""
    path = tmp_path / "ball.inp"
    path.write_text(BALL + "*STEP, DURATION=0.1, TIME STEP=1e-3\n*OUTPUT, INTERVAL=0.01\n")
    return path


def strip_stl(rows: int = 8, columns: int = 3, pitch: float = 50.0) -> str:
    """ASCII STL in mm of a flat open strip."""
    lines = ["solid strip"]
    for i in range(rows - 1):
        for j in range(columns - 1):
            corners = [(pitch * (i + a), pitch * (j + b), 60.0) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
            for facet in (corners[:3], [corners[0], corners[2], corners[3]]):
                lines += ["facet normal 0 0 1", " outer loop"]
                lines += [f"  vertex {x:.6g} {y:.6g} {z:.6g}" for x, y, z in facet]
                lines += [" endloop", "endfacet"]
    return "\n".join([*lines, "endsolid strip", ""])


def test_free_fall_is_exact_for_velocity_verlet(ball):
    """Position 1 - g t^2 / 2 and velocity -g t at every frame: the scheme is exact for constant force."""
    assert run(ball).exit_code == 0
    with trajectory.read(ball.with_suffix(".h5")) as frames:
        assert len(frames) == 11
        for frame in frames:
            # Frames are single precision.
            assert frame.position[0, 2] == pytest.approx(1.0 - 5.0 * frame.time**2, abs=1e-7)
            assert frame.velocity[0, 2] == pytest.approx(-10.0 * frame.time, abs=1e-6)
        assert frames[-1].time == pytest.approx(0.1, abs=1e-12)


def test_from_cad_files_to_a_trajectory_through_the_three_commands(tmp_path, monkeypatch):
    """A strip laid on two rollers, fed with spheres: files, joined text through stdin, and the picture."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(Path(__file__).parent.parent / "samples"))
    from sat_writer import cylinder, write_sat

    Path("strip.stl").write_text(strip_stl())
    rollers = [cylinder(100.0, 300.0, (x, 50.0, 4.9), (0.0, 1.0, 0.0)) for x in (50.0, 300.0)]
    Path("rollers.sat").write_text(write_sat(rollers))
    runner = CliRunner()
    belt = runner.invoke(beltconvert, ["strip.stl", "-o", "belt.inp", "--unit", "mm"])
    parts = runner.invoke(partconvert, ["rollers.sat", "-o", "parts.inp", "--diameter-limit", "300mm"])
    assert belt.exit_code == 0, belt.output
    assert parts.exit_code == 0, parts.output
    bulk = (
        "*MOTION, PART=idler_*, TYPE=FREE ROTATION, INERTIA=0.01\n"
        "*PARTICLE TYPE, NAME=stone, SHAPE=SPHERE, RADIUS=0.01, MATERIAL=rubber\n"
        "*SOURCE, NAME=feed, PARTICLE TYPE=stone, MASS RATE=2, SEED=3\n0.1, 0, 0.08, 0.25, 0.1, 0.12\n0, 0, -1\n"
    )
    Path("case.inp").write_text(
        "*FORMAT, NAME=BELTSIM, VERSION=1\n*INCLUDE, INPUT=belt.inp\n*INCLUDE, INPUT=parts.inp\n"
        + TAIL
        + bulk
        + STEP
    )
    result = run("case.inp", "--json")
    assert result.exit_code == 0, result.output
    body = json.loads(result.stdout)
    assert body["counts"]["bonds"] == 8 * 2 + 7 * 3
    assert body["inserted_mass"]["feed"] > 0.0

    joined = (
        b"".join(Path(name).read_bytes() for name in ("belt.inp", "parts.inp"))
        + (TAIL + bulk + STEP).encode()
    )
    assert run("-", "-o", "joined.h5", input=joined).exit_code == 0
    with trajectory.read("case.h5") as one, trajectory.read("joined.h5") as other:
        assert len(one) == len(other) == 5
        assert np.array_equal(
            one[-1].position, other[-1].position
        )  # the same bits from files and from a pipe
        belt_rows = one[-1].position[: 8 * 3]
        # It lies on the rollers (0.0549 + 0.005) and sags between them, and bulk has come.
        assert belt_rows[:, 2].max() < 0.0612
        assert len(one[-1].position) > 8 * 3


def test_a_bond_that_breaks_is_recorded_once_with_time_and_mode(tmp_path):
    """Two balls flying apart at 1 m/s break their bond when it carries its strength: after strain / rate seconds."""
    length, strength, young = 0.2, 1e4, 1e6
    path = tmp_path / "apart.inp"
    text = BALL.replace("7, 0, 0, 1, 1, 0, 0, 0\n", "7, 0, 0, 0, 1, 0, 0, 0\n9, 0.2, 0, 0, 1, 0, 0, 0\n")
    text = text.split("*GRAVITY")[0] + (
        "*MOTION, PARTICLES=9, TYPE=VELOCITY\n1, 0, 0\n*MOTION, PARTICLES=7, TYPE=VELOCITY\n0, 0, 0\n"
        f"*BOND TYPE, NAME=b, RADIUS=0.01, YOUNGS MODULUS={young:g}, POISSON RATIO=0.3, TENSILE STRENGTH={strength:g}\n"
        "*BOND, TYPE=b\n7, 9, 0,0,0, 1,0,0,0, 0.2,0,0, 1,0,0,0\n"
        "*STEP, DURATION=0.01, TIME STEP=1e-5\n*OUTPUT, INTERVAL=0.005, FIELDS=BOND FORCE, PRECISION=DOUBLE\n"
    )
    path.write_text(text)
    result = run(path)
    assert result.exit_code == 0, result.output
    assert "1 bond broke, first at t = 0.002 s that of particles 7 and 9, in tension" in result.output
    with h5py.File(path.with_suffix(".h5")) as file:
        breaks = file["beltsim/breaks"]
        expected = strength / young * length / 1.0
        assert breaks["time"][:] == pytest.approx([expected], abs=1.1e-5)  # within one step
        assert (breaks["bond"][:], breaks["mode"][:]) == ([0], [1])


def test_an_existing_trajectory_is_kept_unless_told(ball):
    assert run(ball).exit_code == 0
    again = run(ball)
    assert again.exit_code == ExitCode.USAGE
    assert "--overwrite" in again.output
    assert run(ball, "--overwrite").exit_code == 0


def test_all_errors_of_a_deck_come_at_once_and_nothing_is_written(ball, tmp_path):
    ball.write_text(
        ball.read_text().replace("RADIUS=0.05", "RADUIS=0.05").replace("RESTITUTION=0.8", "RESTITUTION=2")
    )
    result = run(ball)
    assert result.exit_code == ExitCode.INVALID_INPUT
    assert "RADUIS" in result.output
    assert "RESTITUTION" in result.output
    assert f"{ball}:4" in result.output
    assert "Traceback" not in result.output
    assert [path.name for path in tmp_path.iterdir()] == ["ball.inp"]


def test_a_step_above_the_limit_is_refused_and_named(ball):
    """A floor makes contacts: the impact sets the limit."""
    floor = "*PART, NAME=floor, SHAPE=PLANE, MATERIAL=rubber\n0, 0, 0, 1, 0, 0, 0\n"
    text = ball.read_text().replace("TIME STEP=1e-3", "TIME STEP=0.01") + floor
    ball.write_text(text)
    result = run(ball)
    assert result.exit_code == ExitCode.INVALID_INPUT
    assert "stability limit" in result.output
    assert "ball" in result.output


def test_a_blow_up_stops_with_its_own_code_and_keeps_the_frames(tmp_path):
    """Two balls half inside each other, stepped far above the limit by force."""
    path = tmp_path / "burst.inp"
    text = BALL.replace("7, 0, 0, 1, 1, 0, 0, 0\n", "7, 0, 0, 1, 1, 0, 0, 0\n8, 0.04, 0, 1, 1, 0, 0, 0\n")
    text = text.replace("YOUNGS MODULUS=1e6", "YOUNGS MODULUS=1e9")
    path.write_text(text + "*STEP, DURATION=0.1, TIME STEP=5e-3\n*OUTPUT, INTERVAL=0.01\n")
    result = run(path, "--allow-unstable")
    assert result.exit_code == ExitCode.BLOW_UP
    assert "blow-up at t =" in result.output
    assert "particle" in result.output
    with trajectory.read(path.with_suffix(".h5")) as frames:
        assert len(frames) >= 1
        assert np.all(np.isfinite(frames[0].position))


@pytest.mark.parametrize("text", ["", "hello", "\x00\x01\x02", "*FORMAT, NAME=BELTSIM, VERSION=1\n"])
def test_a_file_that_is_no_case_is_refused_without_a_traceback(tmp_path, text):
    path = tmp_path / "no.inp"
    path.write_text(text)
    result = run(path)
    assert result.exit_code == ExitCode.INVALID_INPUT
    assert str(path) in result.output
    assert "Traceback" not in result.output


def test_a_file_that_is_not_there_is_named(tmp_path):
    result = run(tmp_path / "nothing.inp")
    assert result.exit_code in (ExitCode.INVALID_INPUT, ExitCode.USAGE)
    assert "nothing.inp" in result.output


def test_an_interrupt_ends_the_run_in_good_order(ball):
    """SIGINT: exit code 130, and every frame that was written can be read."""
    text = ball.read_text().replace("0, 0, -10", "0, 0, 0").replace("DURATION=0.1", "DURATION=1e6")
    ball.write_text(text.replace("INTERVAL=0.01", "INTERVAL=10"))
    process = subprocess.Popen(
        [sys.executable, "-m", "beltsim.cli", "run", str(ball)], stderr=subprocess.PIPE
    )
    path = ball.with_suffix(".h5")
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and (not path.exists() or path.stat().st_size < 10_000):
        time.sleep(0.2)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=120)
    assert process.returncode == ExitCode.INTERRUPTED, errors
    with trajectory.read(path) as frames:
        assert len(frames) >= 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_kernels_compile_ends_the_run_at_once(ball, tmp_path, number):
    """Nothing is left behind: an earlier trajectory stays as it was, the cache holds whole kernels only."""
    earlier = ball.with_suffix(".h5")
    earlier.write_text("as it was")
    env = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    words = [sys.executable, "-m", "beltsim.cli", "run", str(ball), "--overwrite"]
    with subprocess.Popen(words, stderr=subprocess.PIPE, env=env, text=True) as process:
        while "preparing kernels" not in process.stderr.readline():
            pass
        time.sleep(1.0)
        process.send_signal(number)
        # One pass of LLVM over one kernel cannot be interrupted; all kernels of this scene take far longer to compile.
        _, errors = process.communicate(timeout=60)
    expected = ExitCode.INTERRUPTED if number == signal.SIGINT else ExitCode.TERMINATED
    assert process.returncode == expected, errors
    assert errors == "stopped while preparing, between two frames\n"
    assert earlier.read_text() == "as it was"
    assert not [path for path in (tmp_path / "cache").rglob("*") if ".tmp." in path.name]


def test_a_signal_on_the_way_out_of_everything_is_an_end_in_good_order(capsys):
    """Sent again, it may come while another error leaves the run already, when nobody looks for it but the command."""

    @guarded
    def command():
        with signals.signals() as stop:
            stop.code = ExitCode.TERMINATED
        raise signals.AtOnce(stop.code)

    with pytest.raises(SystemExit) as end:
        command()
    assert end.value.code == ExitCode.TERMINATED
    assert capsys.readouterr().err == "stopped while preparing, between two frames\n"


class Dying:
    """Something in whose finalizer a signal comes: what is thrown there is lost."""

    def __del__(self):
        signal.raise_signal(signal.SIGINT)


def wait():
    time.sleep(10.0)


def fail():
    raise ValueError("what a compiler that was cut short says")


@pytest.mark.parametrize("after", [wait, fail])
def test_a_signal_whose_exception_is_lost_ends_the_run_all_the_same(capfd, monkeypatch, after):
    """It comes again a moment later; what fails meanwhile counts as that end, and nothing is said of the loss."""
    monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)  # the process goes on here

    def lost():
        with signals.signals():
            Dying()
            after()

    with pytest.raises(signals.Stopped) as stopped:
        lost()
    assert stopped.value.exit_code == ExitCode.INTERRUPTED
    assert capfd.readouterr().err == ""


def test_other_errors_are_no_signals():
    with pytest.raises(ValueError, match="cut short"), signals.signals():
        fail()


def test_an_output_that_is_the_input_is_refused(ball):
    """--overwrite replaces an earlier trajectory, never the deck or what it includes."""
    text = ball.read_text()
    part = ball.with_name("part.inp")
    part.write_text("*GRAVITY\n0, 0, -10\n")
    ball.write_text(text.replace("*GRAVITY\n0, 0, -10\n", "*INCLUDE, INPUT=part.inp\n"))
    for target in (ball, part):
        result = run(ball, "-o", target, "--overwrite")
        assert result.exit_code == ExitCode.USAGE, result.output
        assert "would replace the input" in result.output
    assert part.read_text().startswith("*GRAVITY")


def test_a_folder_is_no_case(tmp_path):
    result = run(tmp_path)
    assert result.exit_code == ExitCode.INVALID_INPUT
    assert "Traceback" not in result.output


def test_deep_overlap_before_the_first_step_is_said(tmp_path):
    """With both ids and the overlap, before anything bursts apart."""
    path = tmp_path / "deep.inp"
    text = BALL.replace("7, 0, 0, 1, 1, 0, 0, 0\n", "7, 0, 0, 1, 1, 0, 0, 0\n8, 0.05, 0, 1, 1, 0, 0, 0\n")
    path.write_text(text + "*STEP, DURATION=0.001\n")
    result = run(path, "--json")
    assert "particle 7 and particle 8 overlap by 0.05 m (100 % of the radius)" in result.output
    assert json.loads(result.stdout)["warnings"]
