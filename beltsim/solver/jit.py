"""How the kernels are compiled: one decorator for each role."""

from __future__ import annotations

import functools

import numba
import numba.extending
from llvmlite import ir
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.types import Dispatcher, void

from beltsim.solver.cache import Store, cache_folder

__all__ = [
    "align_stack",
    "callee",
    "inner",
    "kernel",
    "only_with",
    "parallel_kernel",
    "uncounted",
    "vector_kernel",
]

# Contraction only. Full fastmath would fold isnan and isfinite to constants, and with reordering the copies of one loop
# that numba links into several kernels gave other last bits: results depended on the threads (both measured).
RELAXED = {"contract", "nsz"}

STORE = Store(cache_folder())
numba.config.CACHE_DIR = str(STORE.folder)


class NoAlias(CompilerBase):
    """numba's usual compiler, with the promise that array arguments do not overlap.

    Without it LLVM gives up on checking some thirty arrays at run time and the loop stays scalar (7 ns against 50 ns a
    bond). The caller must really pass disjoint arrays; reading the same array at two places is fine.
    """

    def define_pipelines(self):
        """The default pipeline with noalias set."""
        self.state.flags.noalias = True
        return [DefaultPassBuilder.define_nopython_pipeline(self.state)]


@numba.extending.intrinsic
def align_stack(_typing_context):
    """Begin the function's stack at a cache line.

    The vectors of a long loop that do not fit into the registers live there, and by chance, from run to run, three of
    four of them would lie across two lines (measured: 25 % of the time of the bond law). LLVM aligns the stack if it
    holds anything that asks for it: an unused place whose address an empty instruction takes.
    """

    def emit(context, builder, *_):
        place = builder.alloca(ir.VectorType(ir.DoubleType(), 8))
        place.align = 64
        builder.asm(ir.FunctionType(ir.VoidType(), [place.type]), "", "r", [place], side_effect=True)
        return context.get_dummy_value()

    return void(), emit


FORMULAS = {
    "error_model": "numpy",  # division by zero gives inf instead of a branch and an exception in every formula
    "fastmath": RELAXED,
    "no_cfunc_wrapper": True,  # nobody takes a C pointer; it took 6 % of the compile time
}
INLINE = FORMULAS | {"forceinline": True, "no_cpython_wrapper": True}
"""Options of `inner`, for functions that numba picks by type (numba.extending.overload)."""


def compiled(function, *, cache: bool, **options):
    """numba's compiler of a function; what goes to the cache is saved there under a lock."""
    dispatcher = numba.njit(function, cache=cache, **(FORMULAS | options))
    if cache:
        STORE.guard(dispatcher)
    return dispatcher


class Callee:
    """A function that kernels call, compiled without the way in from Python, which took a fifth of all compile time.

    A call from Python, as in tests, compiles that way then; numba by itself would crash.
    """

    def __init__(self, function, **options):
        self.compiled = compiled(function, no_cpython_wrapper=True, **options)
        functools.update_wrapper(self, function)

    @property
    def _numba_type_(self):
        return Dispatcher(self.compiled)

    @functools.cached_property
    def entry(self):
        """The way in from Python."""
        callee = self.compiled
        return numba.njit(lambda *arguments: callee(*arguments))

    def __call__(self, *arguments):
        return self.entry(*arguments)


inner = functools.partial(Callee, cache=False, forceinline=True)
"""What kernels call: always inlined, since one call that is left keeps a loop from being vectorised."""

uncounted = functools.partial(Callee, cache=False, forceinline=True, _nrt=False)
"""`inner` for what takes NamedTuples within loops: numba counts no references to the arrays in them.

Each array taken from a tuple is else counted up and down, atomically (the search for walls that carry spheres: 500 ns
with, 65 ns without). What is not counted may neither make arrays nor return them, not even in a tuple.
"""

callee = functools.partial(Callee, cache=True)
"""What kernels call and is not inlined, as most passes."""

parallel_kernel = functools.partial(Callee, cache=True, parallel=True)
"""Loops over chunks for several threads, with the body of the serial loop."""

vector_kernel = functools.partial(Callee, cache=True, pipeline_class=NoAlias)
"""Loops that must be vectorised: arguments do not overlap, indices are unsigned, no call of the maths library."""

kernel = functools.partial(compiled, cache=True)
"""Whatever Python calls, and passes; only kernels and callees go to the cache."""


def only_with(group, value):
    """`value`, or None in scenes without a group; a branch on it would have the type of both."""
    return None if group is None else value


@numba.extending.overload(only_with, jit_options=INLINE)
def _only_with(group, value):  # noqa: ARG001 - types, not values
    if isinstance(group, numba.types.NoneType):
        return lambda group, value: None  # noqa: ARG005
    return lambda group, value: value  # noqa: ARG005
