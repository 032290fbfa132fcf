"""How the kernels are compiled: one decorator for each role.

What steps call takes arrays and makes none, so numba counts no references to them. It else counts each array that is
taken from a tuple up and down, atomically: the search for walls that carry spheres took 500 ns with it and 65 ns
without, and a quarter of all compile time went there. Views are borrowed like the arrays that they show; scratch space
is on the stack (`scratch.py`).
"""

from __future__ import annotations

import functools

import numba
import numba.extending
from llvmlite import ir
from numba.core import types

from beltsim.solver.cache import Store, cache_folder
from beltsim.solver.compiling import Checked, Inlined, Loaded, NoAlias, StandsAlone, holds_array
from beltsim.solver.standing import by_name

__all__ = [
    "align_stack",
    "callee",
    "inner",
    "inner_maker",
    "kernel",
    "maker",
    "only_with",
    "pass_kernel",
    "vector_kernel",
]

# Contraction only. Full fastmath would fold isnan and isfinite to constants, and with reordering the copies of one loop
# that numba links into several kernels gave other last bits: results depended on the threads (both measured).
RELAXED = {"contract", "nsz"}

STORE = Store(cache_folder())
numba.config.CACHE_DIR = str(STORE.folder)


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

    return types.void(), emit


FORMULAS = {
    "error_model": "numpy",  # division by zero gives inf instead of a branch and an exception in every formula
    "fastmath": RELAXED,
    "no_cfunc_wrapper": True,  # nobody takes a C pointer; it took 6 % of the compile time
    "forceinline": False,  # if not said, numba takes it from the caller that happens to be compiled
    "_nrt": False,
}
INLINE = FORMULAS | {"forceinline": True, "no_cpython_wrapper": True}
"""Options of `inner`, for functions that numba picks by type (numba.extending.overload)."""


def compiled(function, *, cache: bool, pipeline_class=Checked, **options):
    """numba's compiler of a function; what goes to the cache is saved there under a lock."""
    dispatcher = numba.njit(function, cache=cache, pipeline_class=pipeline_class, **(FORMULAS | options))
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
        return types.Dispatcher(self.compiled)

    @functools.cached_property
    def entry(self):
        """The way in from Python."""
        return numba.njit(lambda *arguments: self(*arguments), pipeline_class=Loaded)

    def __call__(self, *arguments):
        return self.entry(*arguments)


inner = functools.partial(Callee, cache=False, forceinline=True, pipeline_class=Inlined)
"""What kernels call: always inlined, since one call that is left keeps a loop from being vectorised."""

callee = functools.partial(Callee, cache=False, pipeline_class=Inlined)
"""What kernels call and LLVM inlines where that pays."""

vector_kernel = functools.partial(Callee, cache=False, pipeline_class=NoAlias)
"""Loops that must be vectorised: arguments do not overlap, indices are unsigned, no call of the maths library."""


class Pass(Callee):
    """A pass of several kinds of scenes, which stands alone (`standing.py`) and is kept in the cache."""

    _numba_type_ = None  # set below, and before anything is compiled: numba then knows it

    def __init__(self, function, returns):
        super().__init__(function, cache=True, pipeline_class=StandsAlone)
        if holds_array(returns):
            raise TypeError(f"{function.__qualname__} counts no references and returns an array")
        self.function, self.returns = function, returns
        self._numba_type_ = by_name(self)

    def signature(self, arguments: tuple):
        """What it is compiled for if its arguments have some types."""
        return self.returns(*arguments)

    def ready(self, arguments: tuple) -> None:
        """Have the machine code for arguments of some types: from the cache, or compiled."""
        self.compiled.compile(self.signature(arguments))


def pass_kernel(function=None, *, returns=types.none):
    """Make a function a pass; what it `returns`, numbers, is said, so that nobody has to wait for its compilation."""
    return functools.partial(Pass, returns=returns) if function is None else Pass(function, returns)


kernel = functools.partial(compiled, cache=True, nogil=True)
"""What Python calls, whose other threads go on meanwhile: kept in the cache. It returns numbers, no arrays."""

maker = functools.partial(compiled, cache=True, nogil=True, _nrt=True)
"""What Python calls and makes arrays: references are counted. Whatever lends views is not to be called here."""

inner_maker = functools.partial(Callee, cache=False, forceinline=True, pipeline_class=Inlined, _nrt=True)
"""`inner` for what makes arrays."""


def only_with(group, value):
    """`value`, or None in scenes without a group; a branch on it would have the type of both."""
    return None if group is None else value


@numba.extending.overload(only_with, jit_options=INLINE)
def _only_with(group, value):  # noqa: ARG001 - types, not values
    if isinstance(group, numba.types.NoneType):
        return lambda group, value: None  # noqa: ARG005
    return lambda group, value: value  # noqa: ARG005
