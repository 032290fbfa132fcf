"""Passes that stand alone: called by name, found by every process that needs them, shared out among threads."""

import os
import subprocess
import sys

import numba
import numpy as np
import pytest
from numba import types

from beltsim.solver.jit import compiled, kernel, pass_kernel
from beltsim.solver.sharing import share
from beltsim.solver.standing import symbol_of

PROGRAM = """
import sys
import numpy as np
from numba import types
from beltsim.solver.jit import kernel, pass_kernel
from beltsim.solver.standing import symbol_of

@pass_kernel(returns=types.int64)
def count_below(values, limit):
    found = 0
    for value in values:
        if value < limit:
            found += 1
    return found

@kernel
def twice(values, limit):
    return 2 * count_below(values, limit)

print(twice(np.arange(10.0), 3.5), [sum(one.stats.cache_hits.values()) for one in (twice, count_below.compiled)])
"""


@pass_kernel(returns=types.UniTuple(types.int64, 2))
def tick(n, seen, weights):
    """Note that n was called; returns n and 1."""
    seen[n] += weights[0]
    return n, 1


@pass_kernel
def tock(n, seen):
    if n == 5:
        raise ValueError("five")
    seen[n] += 1


@kernel
def ticks(begin, stop, stride, team, seen, weights):
    return share(tick, begin, stop, stride, team, (seen, weights))


@kernel
def tocks(team, seen):
    share(tock, 0, seen.size, 1, team, (seen,))
    return seen.sum()


@pytest.mark.parametrize("team", [1, 2, 3, 7])
@pytest.mark.parametrize("numbers", [range(10), range(1, 10, 2), range(4, 5), range(3, 3), range(5, 2)])
def test_threads_call_a_pass_once_for_each_number_and_add_up_what_it_returns(numbers, team):
    """Also where there are more threads than numbers, or none of these."""
    seen = np.zeros(10, np.int64)
    found = ticks(numbers.start, numbers.stop, numbers.step, team, seen, (1, None))
    assert found == (sum(numbers), len(numbers))
    assert np.flatnonzero(seen).tolist() == list(numbers)
    assert seen.max(initial=0) <= 1


@pytest.mark.parametrize("team", [1, 2])
def test_an_error_in_a_thread_reaches_the_caller(team):
    assert tocks(team, np.zeros(5, np.int64)) == 5
    with pytest.raises(ValueError, match="five"):
        tocks(team, np.zeros(10, np.int64))


def test_a_kernel_holds_the_name_of_its_pass_and_not_its_code():
    fresh = compiled(ticks.py_func, cache=False)  # of one from the cache there is machine code only
    fresh(0, 1, 1, 1, np.zeros(1, np.int64), (1, None))
    (made,) = fresh.overloads.values()
    arguments = (types.int64, types.int64[::1], types.Tuple((types.int64, types.none)))
    assert made.library.get_function(symbol_of(tick.function, arguments)).is_declaration


def test_only_who_has_passes_loaded_calls_them():
    """LLVM would end the process for a name that it cannot find."""

    @numba.njit
    def stranger(seen):
        return tick(0, seen, (1, None))

    with pytest.raises(Exception, match="would not have it loaded"):
        stranger(np.zeros(1, np.int64))


def test_a_pass_that_no_other_process_could_find_is_refused():
    with pytest.raises(TypeError, match="another process"):

        @pass_kernel
        def hidden(values):
            values[0] = 1.0


def test_a_pass_returns_numbers():
    with pytest.raises(TypeError, match="returns an array"):
        pass_kernel(returns=types.float64[:])(symbol_of)


@pytest.fixture
def program(tmp_path):
    """Starts a process that calls a kernel with a pass, with a cache of its own."""
    (tmp_path / "program.py").write_text(PROGRAM)
    env = os.environ | {
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
        "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path]),
    }
    words, pipe = [sys.executable, "-c", "import program"], subprocess.PIPE
    return lambda: subprocess.Popen(words, env=env, stdout=pipe, stderr=pipe, text=True)


def test_a_kernel_from_the_cache_brings_its_passes_along(program, tmp_path):
    """And compiles them where the cache has lost them, as when a process was killed or a disk full."""
    assert program().communicate() == ("8 [0, 0]\n", "")
    assert program().communicate() == ("8 [1, 1]\n", "")
    lost = list(tmp_path.rglob("*count_below*.nb*"))
    assert len(lost) == 2
    for file in lost:
        file.unlink()
    assert program().communicate() == ("8 [1, 0]\n", "")
    assert program().communicate() == ("8 [1, 1]\n", "")


def test_processes_that_compile_the_same_kernel_at_once_agree_on_names(program):
    """Whoever saves last: its kernel finds the pass that another process compiled."""
    for each in [program(), program(), program()]:
        assert each.communicate()[0].startswith("8 [")
    assert program().communicate() == ("8 [1, 1]\n", "")
