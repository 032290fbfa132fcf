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

__all__ = ["inner", "kernel"]

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

# Division by zero gives inf as in numpy instead of a branch and an exception in every formula.
# `inner` for what kernels call, `kernel` for passes and whatever Python calls: only these go to the cache.
inner = functools.partial(numba.njit, error_model="numpy", fastmath=RELAXED)
kernel = functools.partial(numba.njit, error_model="numpy", fastmath=RELAXED, cache=True)
