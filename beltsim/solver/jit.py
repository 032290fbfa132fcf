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

__all__ = ["inner", "kernel", "only_with", "vector_kernel"]

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


# Division by zero gives inf as in numpy instead of a branch and an exception in every formula.
_njit = functools.partial(numba.njit, error_model="numpy", fastmath=RELAXED)

INLINE = {"forceinline": True, "error_model": "numpy", "fastmath": RELAXED}
"""Options of `inner`, for functions that numba picks by type (numba.extending.overload)."""

inner = functools.partial(_njit, forceinline=True)
"""What kernels call: always inlined, since one call that is left keeps a loop from being vectorised."""

kernel = functools.partial(_njit, cache=True)
"""Passes, and whatever Python calls: only these go to the cache."""

vector_kernel = functools.partial(_njit, cache=True, pipeline_class=NoAlias)
"""Loops that must be vectorised: arguments do not overlap, indices are unsigned, no call of the maths library."""


def only_with(group, value):
    """`value`, or None in scenes without a group; a branch on it would have the type of both."""
    return None if group is None else value


@numba.extending.overload(only_with, jit_options=INLINE)
def _only_with(group, value):  # noqa: ARG001 - types, not values
    if isinstance(group, numba.types.NoneType):
        return lambda group, value: None  # noqa: ARG005
    return lambda group, value: value  # noqa: ARG005
