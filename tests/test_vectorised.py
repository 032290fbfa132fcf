"""The hot loops are vectorised: their machine code holds as many packed operations as scalar ones of the remainders.

A loop that LLVM cannot vectorise still gives right results, ten times as slowly, and no other test would see it.
"""

import re

import llvmlite.binding
import numba
import numpy as np
import pytest

from beltsim.solver import bond_tiles, box_cylinder_contacts, integration, sphere_contacts
from beltsim.solver.contact import HertzPair
from beltsim.solver.jit import callee, compiled, inner_maker, kernel, maker, vector_kernel
from beltsim.solver.scratch import clear, scratch_row, scratch_rows
from beltsim.solver.state import Laws

FEATURES = llvmlite.binding.get_host_cpu_features()
pytestmark = pytest.mark.skipif(
    not (FEATURES.get("avx2") or FEATURES.get("avx512f")), reason="the CPU has neither AVX2 nor AVX-512"
)

ARITHMETIC = r"\bv(?:add|sub|mul|div|sqrt|fn?m(?:add|sub)\d+)"
ROWS3, ROWS4 = (np.zeros(8),) * 3, (np.zeros(8),) * 4
ONE, THREE, FOUR = np.zeros(8), (1.0, 1.0, 1.0), (1.0, 0.0, 0.0, 0.0)
START = np.uint64(0)
LOADS = (np.zeros(8),) * 9
STATE = (ROWS3, ROWS3, ROWS4, ROWS3)


def kind(upright):
    """What bonds of a kind share; see `bond_tiles.kind_of`."""
    return upright, (FOUR, FOUR), 1.0, 1.0, (THREE, THREE, THREE, THREE)


def tile(upright=None, limits=None, whole=None, over=None, book=None):
    """Arguments of `bond_tile`."""
    return (START, START, START, 8, *STATE, kind(upright), limits, whole, over, LOADS, book, 0.5)


MARKS = np.zeros(8, np.int8)
TURNS = (START, START, 8, ROWS4, ROWS3, ROWS3, ROWS3, ROWS3, ONE, 0.1, 0.1)
IDS, NUMBERS = np.zeros(8, np.uint32), np.zeros(8, np.uint64)


def touching(law=None, laws=None, rolls=None):
    """Arguments of `touching_loads`, of one law or of `laws` by material."""
    state = (ROWS3, ROWS3, ROWS3, ROWS3, (ONE, ONE), (ONE, ONE), ONE, ROWS3, ONE, ROWS3, LOADS)
    return (*state, law, laws, IDS, (IDS, IDS), NUMBERS, rolls, None, 0.1, 8)


BODIES = (ROWS3, ROWS4, ROWS3, ONE), (ROWS3, ROWS4, ONE, ONE)
LAW = HertzPair(*(1.0 for _ in HertzPair._fields))
LAWS = Laws(*(np.ones((2, 2)) for _ in Laws._fields))
LOOPS = {
    "gaps of spheres": (sphere_contacts.find_gaps, (IDS, IDS, ROWS3, ONE, START, 8, ONE)),
    "contacts of spheres": (sphere_contacts.touching_loads, touching(LAW, LAWS)),
    "contacts of spheres that resist rolling": (
        sphere_contacts.touching_loads,
        touching(LAW, LAWS, np.zeros((3, 8))),
    ),
    "contacts of spheres of several materials": (sphere_contacts.touching_loads, touching(None, LAWS)),
    "lines of boxes on cylinders": (
        box_cylinder_contacts.find_lines,
        (IDS, 8, IDS, IDS, *BODIES, (np.zeros(8),) * 13),
    ),
    "bonds with gaps": (bond_tiles.bond_tile, tile(whole=MARKS)),
    "bonds along the axes": (bond_tiles.bond_tile, tile(np.zeros((12, 1)), whole=MARKS)),
    "breakable bonds": (bond_tiles.bond_tile, tile(limits=(FOUR, 1.0, 1.0), whole=MARKS, over=MARKS)),
    "bonds with a book": (bond_tiles.bond_tile, tile(whole=MARKS, book=np.zeros((11, 8)))),
    "loads of bonds": (bond_tiles.add_tile, (START, START, 8, LOADS, ROWS3, ROWS3)),
    "drift": (
        integration.translate,
        (START, START, 8, ROWS3, ROWS3, ROWS3, ONE, ONE, 0.1, 0.1, 1.0),
    ),
    "distance since the lists": (integration.count_far, (START, 8, ROWS3, ROWS3, 1.0, 1.0)),
    "rotation": (integration.turn, TURNS),
    "rotation of round particles": (integration.turn_round, TURNS),
    "gravity": (integration.begin_sum, (START, START, 8, ROWS3, ROWS3, ROWS3, ONE, THREE, 0.1, THREE)),
    "last kick": (integration.last_half_kick, (START, 8, ROWS3, ROWS3, ROWS3, ROWS3, ONE, ONE, ONE, 0.1)),
}


def assembly(loop, arguments):
    """Machine code of a kernel that is nothing but a call of the loop with arguments of these types."""
    dispatcher = compiled(lambda *given: loop(*given), cache=False, no_cpython_wrapper=True)
    dispatcher.compile((numba.types.StarArgTuple.from_types(tuple(map(numba.typeof, arguments))),))
    return next(iter(dispatcher.inspect_asm().values()))


def operations(code):
    """Packed operations on at least four doubles, and scalar ones."""
    packed = re.findall(ARITHMETIC + r"pd\s.*%[yz]mm", code)
    return len(packed), len(re.findall(ARITHMETIC + r"sd\s", code))


@pytest.mark.parametrize("name", LOOPS)
def test_hot_loops_are_vectorised(name):
    packed, scalar = operations(assembly(*LOOPS[name]))
    assert packed > 5
    # What is left beyond the last whole vector runs through a scalar copy of the loop, each operation once.
    assert packed > 0.7 * scalar


def test_a_loop_that_cannot_be_vectorised_is_told_from_one_that_can():
    @vector_kernel
    def running_product(values, sums):
        for n in range(values.size - 1):
            sums[n + 1] = sums[n] * values[n] + 1.0

    packed, scalar = operations(assembly(running_product, (np.zeros(8), np.zeros(8))))
    assert packed < 0.7 * scalar


def test_borrowed_arrays_are_not_given_back():
    """What counts no references lends views: who counts may not take them, and who does not may not take new ones."""

    @callee
    def first_half(values):
        return values[: values.size // 2], values.size

    @maker
    def owner(values):
        return first_half(values)[0].copy()

    @inner_maker
    def fresh(count):
        return np.zeros(count)

    @kernel
    def spender(values):
        return fresh(values.size).size

    for function in (owner, spender):
        with pytest.raises(TypeError, match="one counts references and one does not"):
            function(np.zeros(4))


def test_scratch_space_is_aligned_and_zero_where_asked():
    @kernel
    def probe(found):
        tile, numbers = scratch_rows(3, 5), scratch_row(7, np.int64)
        clear(tile, numbers)
        found[0], found[1] = tile.ctypes.data % 64, numbers.ctypes.data % 64
        tile[2, 4], numbers[6] = 1.0, 1
        return tile.sum() + numbers.sum()

    found = np.full(2, -1)
    assert probe(found) == 2.0
    assert not found.any()
