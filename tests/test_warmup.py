"""`beltsim warmup`: kernels are ready before the first run, and only where they last."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
import scenes

from beltsim import inp
from beltsim.console import ExitCode
from beltsim.engine import advance_by
from beltsim.scene import build
from beltsim.scene.bonding import upright_of
from beltsim.solver.state import BondKinds
from beltsim.solver.steps import advance
from beltsim.warmup import BELT_CONVEYOR, deck_of

COMMAND = [sys.executable, "-c", "from beltsim.cli import main; main()"]


@pytest.fixture
def ball(tmp_path):
    """A deck of one ball with two steps, the second of which has a load: a kernel of its own."""
    deck = scenes.case(time_step=1e-3, duration=0.01)
    (particle,) = scenes.add_spheres(deck, (0.0, 0.0, 1.0), radius=0.05)
    deck.blocks("STEP")[0].parameters["NAME"] = "free"
    deck.add("STEP", name="pushed", duration=0.01, time_step=1e-3)
    push = {"id": [particle], "force": [[1.0, 0.0, 0.0]], "torque": [[0.0, 0.0, 0.0]]}
    deck.add("FORCE", step="pushed", rows=push)
    path = tmp_path / "ball.inp"
    path.write_bytes(inp.dumps(deck))
    return path


def test_a_run_after_a_warmup_compiles_nothing(ball, tmp_path):
    """All steps of the deck: the run adds no kernel to the cache. The summary says where the cache is and how big."""
    env = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "NUMBA_NUM_THREADS": "1"}
    done = subprocess.run([*COMMAND, "warmup", str(ball), "--json"], env=env, capture_output=True, check=True)
    summary = json.loads(done.stdout)
    folder = summary["cache"]["folder"]
    assert folder.startswith(str(tmp_path))
    assert summary["cache"]["bytes"] > 10_000
    assert list(summary["timings"]) == [str(ball)]
    kernels = sorted((tmp_path / "cache").rglob("*.nb?"))
    assert kernels
    stamps = [path.stat().st_mtime_ns for path in kernels]
    subprocess.run([*COMMAND, "run", str(ball), "-q"], env=env, check=True)
    assert sorted((tmp_path / "cache").rglob("*.nb?")) == kernels
    assert [path.stat().st_mtime_ns for path in kernels] == stamps


def test_a_cache_that_would_not_last_is_refused(tmp_path):
    """There is nothing to warm where nothing can be written."""
    (tmp_path / "file").write_text("in the way")
    env = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "file")}
    done = subprocess.run([*COMMAND, "warmup"], env=env, capture_output=True, text=True, check=False)
    assert done.returncode == ExitCode.USAGE
    assert done.stderr == "the cache folder may not be written to; NUMBA_CACHE_DIR names another place\n"


def test_the_belt_of_the_usual_deck_has_the_gaps_of_any_grid():
    """Between its rows; kernels for runs without gaps would not serve a belt that was converted."""
    bonds = build(deck_of(None)).bonds
    assert bonds.whole.tolist() == [1, 1, 1, 0, 1, 1, 1, 0, 1, 1, 1]


def test_kinds_of_bonds_have_one_layout_however_many_there_are():
    """With another one for several kinds, a belt that was converted would need kernels of its own."""
    kinds = build(deck_of(None)).kinds
    two = BondKinds(*(np.repeat(each, 2, axis=-1) for each in kinds))
    assert upright_of(two).flags.c_contiguous


def test_the_usual_deck_is_of_the_kind_of_a_loaded_conveyor():
    """Belt, bulk to come, free and driven rollers: its compiled step is the one that a conveyor takes."""
    state = scenes.start(deck_of(None))
    before = len(advance.signatures)
    advance_by(state, 1)
    larger = BELT_CONVEYOR.replace("RADIUS=20 mm", "RADIUS=25 mm").replace("0.15, 0, -0.06", "0.18, 0, -0.06")
    other = scenes.start(inp.read_text(larger))
    advance_by(other, 1)
    assert len(advance.signatures) == max(1, before)
