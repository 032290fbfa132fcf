"""Compiling by two processes: every pass once, what the steps need and nothing else, no harm if one process dies."""

import os
import subprocess
import sys
import time

import pytest

from beltsim import ahead
from beltsim.solver.standing import Need

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="the system cannot fork")


class Slow:
    """What a run takes for a dispatcher of numba: notes in a file who compiled it."""

    def __init__(self, folder, name, *, deadly=False):
        self.path, self.owner, self.deadly = folder / name, os.getpid(), deadly

    def compile(self, types):
        time.sleep(0.05)
        if self.deadly and os.getpid() != self.owner:
            os._exit(1)
        with self.path.open("a") as file:
            file.write(f"{os.getpid()} {types}\n")


@pytest.fixture
def jobs(tmp_path, monkeypatch):
    monkeypatch.setattr(ahead, "holds", lambda *_: False)
    return [(Slow(tmp_path, f"pass {k}"), (k,)) for k in range(6)]


def test_two_processes_share_the_passes_and_compile_each_once(jobs):
    with ahead.helped(jobs, 2):
        pass
    notes = [job.path.read_text().split(maxsplit=1) for job, _ in jobs]
    assert [types for _, types in notes] == [f"({k},)\n" for k in range(6)]
    assert len({process for process, _ in notes}) == 2


def test_a_kernel_that_needs_its_passes_waits_for_both_processes(jobs):
    with ahead.helped(jobs, 2):
        need = Need("os.path", "nothing", ())
        with pytest.raises(AttributeError):  # looked up once all is done
            need()
        assert all(job.path.exists() for job, _ in jobs)


def test_the_other_process_ends_with_the_context(jobs):
    """As where a signal ends the run meanwhile: nobody goes on compiling, and no process is left."""
    with pytest.raises(KeyboardInterrupt), ahead.helped(jobs, 2):
        raise KeyboardInterrupt
    assert not all(job.path.exists() for job, _ in jobs)
    with pytest.raises(ChildProcessError):
        os.waitpid(-1, os.WNOHANG)


def test_a_process_that_dies_takes_nothing_with_it(tmp_path, monkeypatch):
    monkeypatch.setattr(ahead, "holds", lambda *_: False)
    jobs = [(Slow(tmp_path, f"pass {k}", deadly=True), (k,)) for k in range(6)]
    with ahead.helped(jobs, 2):
        pass
    # The one that it was at is compiled later, with the steps that call it.
    assert sum(job.path.exists() for job, _ in jobs) >= 5


@pytest.mark.parametrize("case", ["one CPU", "all in the cache", "one missing"])
def test_nobody_is_asked_where_it_would_not_pay(jobs, case, monkeypatch):
    monkeypatch.setattr(ahead, "fork", lambda: pytest.fail("forked"))
    kept = {"one CPU": [], "all in the cache": jobs, "one missing": jobs[1:]}[case]
    monkeypatch.setattr(ahead, "holds", lambda *job: job in kept)
    with ahead.helped(jobs, 1 if case == "one CPU" else 2):
        pass


def test_what_is_compiled_ahead_is_what_the_steps_of_a_conveyor_need(tmp_path):
    """Found in the cache after a run on one CPU, which compiles nothing ahead: the same kernels for the same types."""
    code = """
from beltsim import run
from beltsim.ahead import jobs_of
from beltsim.scene import build
from beltsim.solver.cache import holds
from beltsim.warmup import deck_of
deck, states = deck_of(None), []
deck.blocks("STEP")[0].parameters["DURATION"] = 1e-12
stated = run.state_of
run.state_of = lambda scene: states.append(stated(scene)) or states[0]
run.run(deck, build(deck), "out.h5", threads=1)
jobs = jobs_of(states[0])
assert len(jobs) == 11
print([job[0].py_func.__name__ for job in jobs if not holds(*job)])
"""
    env = os.environ | {
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
        "NUMBA_NUM_THREADS": "1",
        "PYTHONPATH": os.pathsep.join(sys.path),
    }
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=env, capture_output=True, text=True, check=False
    )
    assert done.stdout == "[]\n", done.stderr
