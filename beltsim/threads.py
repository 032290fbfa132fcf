"""How many threads a run takes, and starting them. Results are the same to the last bit for any count."""

from __future__ import annotations

import os
from pathlib import Path

ENOUGH_TO_SHARE = 3000
"""Particles from which a second thread pays: below, handing out the work costs what it saves."""


SPINS = "1000"
"""How often a thread of GNU OpenMP looks for work before it sleeps.

By default it looks for milliseconds, and where other programs want the CPUs, two threads were 300 times as slow as one.
With 100 it sleeps between any two passes (the loaded belt of the benchmarks: 35 to 60 ns a particle-step); with 1000 it
takes 22 ns, and 59 where another program keeps one of two CPUs busy, with 5000 98.
"""


def permitted() -> int:
    """Threads that this process may use: NUMBA_NUM_THREADS where it is set, else its CPUs (affinity and quota)."""
    given = os.environ.get("NUMBA_NUM_THREADS", "")
    if given.isdigit() and int(given) > 0:
        return int(given)
    quota = quota_of(own_group())
    return max(1, min(affinity(), affinity() if quota is None else int(quota)))


def affinity() -> int:
    """CPUs that the scheduler may put this process on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def own_group() -> Path:
    """Folder of this process's control group, version 2; elsewhere a path that does not exist."""
    root = Path("/sys/fs/cgroup")
    try:
        for line in Path("/proc/self/cgroup").read_text().splitlines():
            if line.startswith("0::"):
                return root / line[3:].strip("/")
    except OSError:
        pass
    return root


def quota_of(group: Path) -> float | None:
    """CPUs that a control group and those above it may use, None if none of them has a limit."""
    found = []
    for folder in (group, *group.parents):
        try:
            most, period = (folder / "cpu.max").read_text().split()
            found.append(float(most) / float(period))
        except (OSError, ValueError):  # no such file, or "max"
            continue
    return min(found, default=None)


def too_many(asked: int | None) -> list[str]:
    """A word about threads that are asked for but not permitted."""
    if asked is None or asked <= permitted():
        return []
    return [f"warning: {asked} threads are asked for, {permitted()} may be used and are taken"]


def team_of(asked: int | None, particles: int) -> int | None:
    """Threads of a run, None for a serial one.

    `asked` is None to choose: all that are permitted, but one for scenes too small to gain.
    """
    if asked is None:
        asked = permitted() if particles >= ENOUGH_TO_SHARE else 1
    count = min(asked, permitted())
    return count if count > 1 else None


def start_team(team: int | None) -> dict:
    """Start the threads of a team; returns what the provenance says of them.

    OpenMP where it loads, since handing out work costs 3 us with it and 30 us with numba's own queue.
    """
    if team is None:
        return {"threads": 1}
    import numba

    os.environ.setdefault("GOMP_SPINCOUNT", SPINS)
    if "NUMBA_THREADING_LAYER_PRIORITY" not in os.environ:
        numba.config.THREADING_LAYER_PRIORITY = ["omp", "workqueue", "tbb"]
    numba.set_num_threads(team)
    return {"threads": team, "threading_layer": numba.threading_layer()}
