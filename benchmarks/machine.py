"""What this machine can do on one core: fused multiply-adds from registers, and bandwidth of a triad."""

from __future__ import annotations

import platform
import time
from datetime import UTC, datetime
from pathlib import Path

import numba
import numpy as np

TERMS = 32  # of the polynomial: fused multiply-adds for each load and store


@numba.njit(fastmath={"contract"})
def polynomial(x, y, rounds):
    """Horner's rule on vectors from the first-level cache: nothing but multiply-adds."""
    for _ in range(rounds):
        for i in range(x.size):
            value = y[i]
            for _ in range(32):
                value = value * x[i] + 0.5
            y[i] = value


@numba.njit
def triad(a, b, c):
    """a = b + s c."""
    for i in range(a.size):
        a[i] = b[i] + 0.3 * c[i]


def best_of(call, repeats: int = 7) -> float:
    """Least CPU seconds of some calls, the first one apart."""
    call()
    found = []
    for _ in range(repeats):
        start = time.process_time()
        call()
        found.append(time.process_time() - start)
    return min(found)


def flops() -> float:
    """Fused multiply-adds a second, counted as two operations each."""
    x, y = np.full(512, 0.4), np.ones(512)
    rounds = 4000
    return 2.0 * TERMS * x.size * rounds / best_of(lambda: polynomial(x, y, rounds))


def bandwidth(size: int) -> float:
    """Bytes a second of a triad over `size` bytes in all, 24 a element."""
    n = size // 24
    a, b, c = np.zeros(n), np.ones(n), np.ones(n)
    rounds = max(1, 200_000_000 // size)

    def many():
        for _ in range(rounds):
            triad(a, b, c)

    return 24.0 * n * rounds / best_of(many, 5)


def cpu_name() -> str:
    """The processor's name as the system tells it."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def limits() -> dict:
    """The machine, and its limits."""
    import os

    import llvmlite

    return {
        "cpu": cpu_name(),
        "llvm_target": llvmlite.binding.get_host_cpu_name(),
        "cores": os.cpu_count(),
        "date": datetime.now(UTC).date().isoformat(),
        "versions": {
            "python": platform.python_version(),
            "numba": numba.__version__,
            "llvmlite": llvmlite.__version__,
            "numpy": np.__version__,
        },
        "gflops": flops() / 1e9,
        "triad": {str(size): bandwidth(size) / 1e9 for size in (1 << 20, 8 << 20, 512 << 20)},
    }
