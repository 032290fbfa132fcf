"""Threads: how many a run takes, and that results do not depend on it, to the last bit."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import scenes

from beltsim import threads, trajectory
from beltsim.checkpoint import take
from beltsim.engine import begin_stage, state_of
from beltsim.lists import overlaps_of
from beltsim.run import prepare
from beltsim.scene import build

TEAMS = (None, 1, 2, 3)


def loaded_strip():
    """A belt on two rollers under four layers of balls, and balls beside it on a roller: every pair of these shapes."""
    deck = scenes.case(time_step=5e-5, gravity=(0.5, 0.0, -9.81), friction=0.4, restitution=0.5, rolling=0.1)
    scenes.add_grid(deck, 60, 24, fixed="NO", young=2e7)
    for name, x in (("tail", 0.1), ("head", 1.1)):
        scenes.add_cylinder(deck, name=name, diameter=0.1, length=1.0, point=(x, 0.23, -0.0549))
    at = np.mgrid[0:58, 0:22, 0:4].reshape(3, -1).T * 0.02
    at[:, :2] += np.random.default_rng(1).uniform(-2e-4, 2e-4, (len(at), 2))
    at += (0.02, 0.02, 0.0149)
    scenes.add_spheres(deck, at, radius=0.01, velocity=(0.0, 0.0, -1.0))
    beside = [(0.1, -0.2 + 0.03 * k, 0.00509) for k in range(6)]
    scenes.add_spheres(deck, beside, name="pebble", radius=0.01)
    return deck


def long_strip():
    """A belt of five chunks of particles, whose bonds are done while its particles drift, unless threads share both."""
    deck = scenes.case(time_step=5e-5, gravity=(0.5, 0.0, -9.81))
    scenes.add_grid(deck, 200, 24, fixed="NO", young=2e7)
    return deck


def leaves(tree) -> list:
    """All leaves of a checkpoint, in order."""
    return [leaf for value in tree.values() for leaf in leaves(value)] if isinstance(tree, dict) else [tree]


def fingerprint(scene, team: int | None) -> str:
    """Hash of everything in the state after a run of a scene with a team."""
    state = state_of(build(scene()))
    state.team = team
    threads.start_team(team)
    begin_stage(state, prepare(state, state.scene.steps[0], 0.0, lambda _: None, True))
    scenes.advance(state, 300)
    if scene is loaded_strip:
        assert state.list_builds > 2  # lists are made anew on the way
        bodies = state.scene.population.particles, state.scene.shapes
        touching = [overlaps_of(family, *bodies) for family in state.lists if family is not None]
        assert len(touching) == 4
        assert all(np.any(overlap > 0.0) for overlap in touching)
    digest = hashlib.sha256()
    for leaf in leaves(take(state)):
        digest.update(leaf.tobytes() if isinstance(leaf, np.ndarray) else repr(leaf).encode())
    return digest.hexdigest()


@pytest.mark.parametrize("scene", [loaded_strip, long_strip])
def test_results_do_not_depend_on_the_number_of_threads(scene):
    """Every bit of the state: positions, histories, loads, lists; serial, and with more threads than CPUs."""
    name = scene.__name__
    code = f"from test_threads import *; print(*[fingerprint({name}, team) for team in TEAMS])"
    more = {"NUMBA_NUM_THREADS": str(TEAMS[-1]), "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=Path(__file__).parent,
        env=os.environ | more,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    hashes = done.stdout.split()
    assert len(hashes) == len(TEAMS)
    assert len(set(hashes)) == 1


def test_small_scenes_run_on_one_thread_unless_asked_otherwise(monkeypatch):
    """auto takes what is permitted once it pays; a count that is asked for is taken, but never more than permitted."""
    monkeypatch.setenv("NUMBA_NUM_THREADS", "4")
    enough = threads.ENOUGH_TO_SHARE
    assert threads.team_of(None, enough - 1) is None
    assert threads.team_of(None, enough) == 4
    assert threads.team_of(2, 1) == 2
    assert threads.team_of(1, enough) is None
    assert threads.team_of(9, enough) == 4
    assert threads.too_many(4) == threads.too_many(None) == []
    assert threads.too_many(9) == ["warning: 9 threads are asked for, 4 may be used and are taken"]


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="the system binds no process to CPUs")
def test_cpus_that_are_forbidden_are_not_used(monkeypatch):
    """A process bound to one CPU, as by taskset or a job scheduler, gets one thread."""
    monkeypatch.delenv("NUMBA_NUM_THREADS", raising=False)
    before = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(before)})
        assert threads.permitted() == 1
    finally:
        os.sched_setaffinity(0, before)


def test_quota_of_a_container_is_kept(tmp_path):
    """The tightest limit of a control group and those above it, in CPUs; "max" is none."""
    group = tmp_path / "above" / "group"
    group.mkdir(parents=True)
    assert threads.quota_of(group) is None
    (group / "cpu.max").write_text("max 100000\n")
    assert threads.quota_of(group) is None
    (group.parent / "cpu.max").write_text("150000 100000\n")
    assert threads.quota_of(group) == 1.5


def test_provenance_says_how_many_threads_ran(tmp_path):
    """--threads in a fresh process; the layer is named where there is more than one."""
    case = tmp_path / "ball.inp"
    deck = scenes.case(time_step=1e-3, gravity=(0.0, 0.0, -10.0), duration=0.01)
    scenes.add_spheres(deck, (0.0, 0.0, 1.0), radius=0.05)
    from beltsim import inp

    case.write_bytes(inp.dumps(deck))
    code = "from beltsim.cli import main; main()"
    for asked, expected in (("1", {1}), ("2", {2}), ("auto", {1})):
        words = [sys.executable, "-c", code, "run", str(case), "--threads", asked, "--overwrite", "-q"]
        env = os.environ | {"NUMBA_NUM_THREADS": "2"}
        subprocess.run(words, env=env, check=True)
        with trajectory.read(case.with_suffix(".h5")) as frames:
            assert frames.provenance["threads"] in expected
            assert ("threading_layer" in frames.provenance) == (asked == "2")
