"""How the kernels are compiled: one decorator for each role, and a cache that is never stale.

numba stamps a cached kernel with the hash of its own file only, so an edit of a law in another file would
silently run the old machine code (measured: the old result came back). The cache folder is therefore named
after the hash of all sources in this folder, set before any kernel is defined.
"""

from __future__ import annotations

import functools
import hashlib
import os
from pathlib import Path

import numba
import numba.extending
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.types import Dispatcher

__all__ = ["callee", "inner", "kernel", "only_with", "vector_kernel"]

# Contraction and reordering only: full fastmath would fold isnan and isfinite to constants (measured).
RELAXED = {"contract", "nsz", "arcp", "reassoc", "afn"}


def _sources_hash() -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    package = Path(__file__).parent
    for source in sorted(package.glob("*.py")):
        digest.update(source.name.encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Folder of the compiled kernels of exactly these sources."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return (Path(given) if given else home) / "beltsim-kernels" / _sources_hash()


numba.config.CACHE_DIR = str(cache_folder())


class NoAlias(CompilerBase):
    """numba's usual compiler, with the promise that array arguments do not overlap.

    Without it LLVM gives up on checking some thirty arrays at run time and the loop stays scalar (7 ns against 50 ns a
    bond). The caller must really pass disjoint arrays; reading the same array at two places is fine.
    """

    def define_pipelines(self):
        """The default pipeline with noalias set."""
        self.state.flags.noalias = True
        return [DefaultPassBuilder.define_nopython_pipeline(self.state)]


FORMULAS = {
    "error_model": "numpy",  # division by zero gives inf instead of a branch and an exception in every formula
    "fastmath": RELAXED,
    "no_cfunc_wrapper": True,  # nobody takes a C pointer; it took 6 % of the compile time
}
INLINE = FORMULAS | {"forceinline": True, "no_cpython_wrapper": True}
"""Options of `inner`, for functions that numba picks by type (numba.extending.overload)."""


class Callee:
    """A function that kernels call, compiled without the way in from Python, which took a fifth of all compile time.

    A call from Python, as in tests, compiles that way then; numba by itself would crash.
    """

    def __init__(self, function, **options):
        self.compiled = numba.njit(function, **(FORMULAS | {"no_cpython_wrapper": True} | options))
        functools.update_wrapper(self, function)

    @property
    def _numba_type_(self):
        return Dispatcher(self.compiled)

    @functools.cached_property
    def entry(self):
        """The way in from Python."""
        compiled = self.compiled
        return numba.njit(lambda *arguments: compiled(*arguments))

    def __call__(self, *arguments):
        return self.entry(*arguments)


inner = functools.partial(Callee, forceinline=True)
"""What kernels call: always inlined, since one call that is left keeps a loop from being vectorised."""

callee = functools.partial(Callee, cache=True)
"""What kernels call and is not inlined, as most passes."""

vector_kernel = functools.partial(Callee, cache=True, pipeline_class=NoAlias)
"""Loops that must be vectorised: arguments do not overlap, indices are unsigned, no call of the maths library."""

kernel = functools.partial(numba.njit, cache=True, **FORMULAS)
"""Whatever Python calls, and passes; only kernels and callees go to the cache."""


def only_with(group, value):
    """`value`, or None in scenes without a group; a branch on it would have the type of both."""
    return None if group is None else value


@numba.extending.overload(only_with, jit_options=INLINE)
def _only_with(group, value):  # noqa: ARG001 - types, not values
    if isinstance(group, numba.types.NoneType):
        return lambda group, value: None  # noqa: ARG005
    return lambda group, value: value  # noqa: ARG005
