"""How long beltsim takes to start: help, a warm run to its first step, and the first compilation ever.

python benchmarks/startup.py [ROUNDS]

Every figure is of a process of its own; compilations get a fresh cache each. A table goes to stdout, the figures to
results/startup.json. On a busy machine CPU seconds say more than those of the clock.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import conveyor
from settled import folder

HERE = Path(__file__).parent
COMMAND = [sys.executable, "-c", "from beltsim.cli import main; main()"]
LIMITS = {"--help": 0.3, "warm": 2.0, "cold": 15.0}  # s of the clock, on a quiet machine


def spent(words: list[str], cache: Path) -> dict:
    """Clock and CPU seconds of a command."""
    env = os.environ | {"NUMBA_CACHE_DIR": str(cache)}
    clock, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([*COMMAND, *words], env=env, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return {"clock": time.perf_counter() - clock, "cpu": cpu}


def least(rounds: int, call) -> dict:
    """The least of each figure over some rounds."""
    return least_of([call() for _ in range(rounds)])


def least_of(found: list[dict]) -> dict:
    """The least of each figure."""
    return {name: min(each[name] for each in found) for name in found[0]}


def first_step(case: Path, scratch: Path, *options: str) -> list[str]:
    """The words of a run that ends after one step."""
    return ["run", str(case), "-o", str(scratch / "out.h5"), "--overwrite", "--until", "1e-9", "-q", *options]


def starts(case: Path, threads: str) -> dict:
    """A run with an empty cache, and the least of three more; the compilation is what the first one took longer."""
    with tempfile.TemporaryDirectory() as name:
        scratch = Path(name)
        words = first_step(case, scratch, "--threads", threads)
        first = spent(words, scratch / "cache")
        warm = least(3, lambda: spent(words, scratch / "cache"))
        size = sum(file.stat().st_size for file in (scratch / "cache").rglob("*") if file.is_file())
    return {
        "warm": warm,
        "cold": {name: first[name] - warm[name] for name in warm} | {"megabytes": size / 1e6},
    }


def measure(rounds: int) -> dict:
    """All figures."""
    conveyor.case()
    case = folder() / "conveyor" / "case.inp"
    with tempfile.TemporaryDirectory() as name:
        found = {"--help": least(3 * rounds, lambda: spent(["--help"], Path(name)))}
    for threads in ("1", "auto"):
        each = [starts(case, threads) for _ in range(rounds)]
        for kind in ("warm", "cold"):
            found[f"{kind}, {threads}"] = least_of([row[kind] for row in each])
    return found


def main() -> None:
    """Measure, print, and keep."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    load = os.getloadavg()[0]
    found = {"cores": len(os.sched_getaffinity(0)), "rounds": rounds, "figures": measure(rounds)}
    found["load"] = max(load, os.getloadavg()[0])
    (HERE / "results" / "startup.json").write_text(json.dumps(found, indent=1) + "\n")
    for name, each in found["figures"].items():
        limit = LIMITS[name.split(",")[0]]
        print(f"{name:12s}  clock {each['clock']:6.2f} s  CPU {each['cpu']:6.2f} s  wanted {limit:g} s")
    print(f"load {found['load']:.1f} on {found['cores']} cores, least of {rounds}")


if __name__ == "__main__":
    main()
