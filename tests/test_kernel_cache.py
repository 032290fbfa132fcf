"""The cache of compiled kernels: never stale, bounded, safe for several processes, and no reason to stop a run."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from beltsim.solver import cache
from beltsim.solver.cache import MARK, Store, prune

DAY = 86400.0


def folder_used(parent: Path, number: int, days: float) -> Path:
    """A cache folder with something in it, last used some days ago."""
    place = parent / f"{number:016x}"
    (place / "solver_x").mkdir(parents=True)
    (place / "solver_x" / "kernel.nbi").write_text("x")
    (place / MARK).touch()
    stamp = time.time() - days * DAY
    os.utime(place / MARK, (stamp, stamp))
    return place


def left(parent: Path) -> list[int]:
    """Numbers of the folders that are there."""
    return sorted(int(place.name, 16) for place in parent.iterdir())


def test_folder_is_named_after_all_that_the_machine_code_depends_on(monkeypatch):
    """numba, llvmlite and the CPU; the sources are read from the folder of the solver."""
    before = cache.state_of_sources()
    assert cache.state_of_sources() == before
    for owner, name in ((cache.numba, "__version__"), (cache.llvmlite, "__version__")):
        with monkeypatch.context() as changed:
            changed.setattr(owner, name, "0.0")
            assert cache.state_of_sources() != before
    with monkeypatch.context() as changed:
        changed.setattr(cache.llvmlite.binding, "get_host_cpu_name", lambda: "abacus")
        assert cache.state_of_sources() != before


def test_any_edit_of_the_solver_gets_a_folder_of_its_own(tmp_path, monkeypatch):
    """The hash covers every source file, by name and content."""
    monkeypatch.setattr(cache, "__file__", str(tmp_path / "cache.py"))
    law = tmp_path / "law.py"
    law.write_text("k = 1\n")
    first = cache.state_of_sources()
    law.write_text("k = 2\n")
    second = cache.state_of_sources()
    law.rename(tmp_path / "rule.py")
    assert len({first, second, cache.state_of_sources()}) == 3


def test_what_nobody_used_for_a_month_goes(tmp_path):
    """Age counts from the last use, not from when the folder was made."""
    for number, days in ((1, 0.1), (2, 29.0), (3, 31.0)):
        folder_used(tmp_path, number, days)
    prune(tmp_path / f"{9:016x}")
    assert left(tmp_path) == [1, 2]


def test_many_folders_are_thinned_to_the_last_used(tmp_path):
    """So that a day of upgrades or edits fills no disk; strangers' files are not touched."""
    for number in range(cache.KEPT + 5):
        folder_used(tmp_path, number, days=0.1 * number)
    stranger = tmp_path / "notes"
    stranger.mkdir()
    prune(tmp_path / f"{0:016x}")
    stranger.rmdir()
    assert left(tmp_path) == list(range(cache.KEPT + 1))  # the one in use is not counted


@pytest.mark.skipif(cache.fcntl is None, reason="no file locks here")
def test_folder_in_use_by_another_process_stays(tmp_path):
    """However old: a long run may yet load or save kernels there. When the process has ended, it goes."""
    place = folder_used(tmp_path, 1, days=0.0)
    code = f"""
from pathlib import Path
from beltsim.solver.cache import Store
store = Store(Path({str(place)!r}))
print("ready", flush=True)
input()
"""
    words, pipe = [sys.executable, "-c", code], subprocess.PIPE
    with subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        stamp = time.time() - 40 * DAY
        os.utime(place / MARK, (stamp, stamp))
        prune(tmp_path / f"{9:016x}")
        assert left(tmp_path) == [1]
        process.communicate("\n")
    prune(tmp_path / f"{9:016x}")
    assert left(tmp_path) == []


def test_using_a_folder_makes_it_young_again(tmp_path):
    """And a process that finds its folder removed makes it anew."""
    place = folder_used(tmp_path, 1, days=40.0)
    Store(place)
    assert time.time() - cache.last_use(place) < 60.0
    assert Store(tmp_path / f"{2:016x}").lasting
    assert left(tmp_path) == [1, 2]


def test_folder_that_cannot_be_written_is_copied_for_this_process(tmp_path, monkeypatch):
    """As in a container image that was warmed by another user: its kernels are used all the same."""

    def refuse(folder):
        raise PermissionError(13, "Permission denied", str(folder))

    place = folder_used(tmp_path, 1, days=1.0)
    monkeypatch.setattr(cache, "hold", refuse)
    (place / "solver_x").chmod(0o555)
    store = Store(place)
    assert not store.lasting
    assert (store.folder / "solver_x" / "kernel.nbi").read_text() == "x"
    assert (store.folder / "solver_x").stat().st_mode & 0o700 == 0o700


KERNEL = """
from beltsim.solver import jit

@jit.kernel
def twice(x):
    return 2 * x

if __name__ == "__main__":
    store = jit.STORE
    print(twice(21), sum(twice.stats.cache_hits.values()), store.lasting, store.folder.exists(), store.folder)
"""


@pytest.fixture
def twice(tmp_path):
    """A script with one kernel, run with a cache folder; what it prints."""
    script = tmp_path / "script.py"
    script.write_text(KERNEL)

    def call(place: Path) -> list[str]:
        env = os.environ | {"NUMBA_CACHE_DIR": str(place), "PYTHONPATH": os.pathsep.join(sys.path)}
        done = subprocess.run([sys.executable, script], env=env, capture_output=True, text=True, check=True)
        return done.stdout.split()

    return call


def test_kernels_are_loaded_by_the_next_process(twice, tmp_path):
    """Saved under the lock, then found: the second run hits."""
    assert twice(tmp_path / "cache")[:3] == ["42", "0", "True"]
    assert twice(tmp_path / "cache")[:3] == ["42", "1", "True"]


@pytest.mark.parametrize("ending", ["nbc", "nbi"])
def test_files_that_are_not_what_was_saved_are_made_anew(ending, twice, tmp_path):
    """As after a crash of the machine: the run goes on, and the next one finds the kernel again."""
    place = tmp_path / "cache"
    twice(place)
    for path in place.rglob(f"*.{ending}"):
        path.write_bytes(b"junk")
    assert twice(place)[:3] == ["42", "0", "True"]
    assert twice(place)[:3] == ["42", "1", "True"]


def test_run_goes_on_where_nothing_can_be_kept(twice, tmp_path):
    """A home that is read only or no folder at all; what was compiled is gone with the process."""
    (tmp_path / "file").write_text("in the way")
    result, hits, lasting, there, folder = twice(tmp_path / "file")
    assert (result, hits, lasting, there) == ("42", "0", "False", "True")
    assert not Path(folder).exists()


def test_kernel_that_cannot_be_saved_runs_all_the_same(tmp_path, monkeypatch):
    """A full disk costs the next start its time, no more."""

    class Full:
        class _cache:
            @staticmethod
            def save_overload(*_):
                raise OSError(28, "No space left on device")

            @staticmethod
            def load_overload(*_):
                return None

    Store(tmp_path / f"{1:016x}").guard(Full)
    Full._cache.save_overload(None, None)  # says nothing
