"""What a second thread gains: whole steps of S1, S2 and S3, and this machine's own loops beside them.

    python benchmarks/threads.py [S1 S2 S3] [--rounds 5]

prints a table and puts it into benchmarks/results/solver.json. Wall-clock time, one thread and two by turns from one
state; the machine's own figures are a triad that misses the caches and a polynomial that never leaves the registers.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import statistics
import time

import numba
import numpy as np
from as_deck import deck_of, result_of, started
from machine import polynomial, triad
from solver_speed import SCENES, WARM, save, span

from beltsim.engine import advance_by
from beltsim.threads import start_team

STEPS = 300
TEAMS = (None, 2)


@numba.njit(parallel=True)
def triads(a, b, c):
    """A triad for each row."""
    for row in numba.prange(a.shape[0]):
        triad(a[row], b[row], c[row])


@numba.njit(parallel=True)
def polynomials(x, y, rounds):
    """A polynomial for each row."""
    for row in numba.prange(x.shape[0]):
        polynomial(x[row], y[row], rounds)


def seconds(call) -> float:
    """Least wall-clock time of five calls, the first one apart."""
    call()
    found = []
    for _ in range(5):
        start = time.perf_counter()
        call()
        found.append(time.perf_counter() - start)
    return min(found)


def machine_gain() -> dict[str, float]:
    """How much more two threads do than one, of a triad in 512 MiB and of multiply-adds."""
    n = (256 << 20) // 24
    large = [np.ones((2, n)) for _ in range(3)]
    small = np.full((2, 512), 0.4), np.ones((2, 512))

    def on(threads, call):
        numba.set_num_threads(threads)
        return seconds(call)

    return {
        name: on(1, call) / on(2, call)
        for name, call in {
            "triad": lambda: triads(*large),
            "multiply-add": lambda: polynomials(*small, 20_000),
        }.items()
    }


def timed(scene, team: int | None) -> tuple[float, str]:
    """Wall-clock nanoseconds a particle-step with a team, and a hash of all bits of the result."""
    state = started(deck_of(scene))
    state.team = team
    start_team(team)
    advance_by(state, WARM)
    start = time.perf_counter()
    advance_by(state, STEPS)
    cost = 1e9 * (time.perf_counter() - start) / STEPS / scene.count
    digest = hashlib.sha256()
    for name, values in sorted(result_of(state).items()):
        digest.update(name.encode() + np.ascontiguousarray(values).tobytes())
    return cost, digest.hexdigest()


def gain(name: str, rounds: int) -> dict:
    """Cost of a scene with one thread and two, by turns."""
    scene = SCENES[name]()
    for team in TEAMS:
        timed(scene, team)  # compile
    found, bits = {team: [] for team in TEAMS}, set()
    for _ in range(rounds):
        for team in TEAMS:
            cost, result = timed(scene, team)
            found[team].append(cost)
            bits.add(result)
    return {
        "one": span(found[None]),
        "two": span(found[2]),
        "gain": statistics.median(found[None]) / statistics.median(found[2]),
        "same_bits": len(bits) == 1,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", default=list(SCENES), help="S1, S2, S3; default all")
    parser.add_argument("--rounds", type=int, default=5, help="runs of each, by turns; default 5")
    given = parser.parse_args()
    start_team(max(filter(None, TEAMS)))  # numba would start threads that wait in another way
    part = {"machine": machine_gain(), "load": os.getloadavg()[0]}
    print({name: f"{value:.2f}" for name, value in part["machine"].items()})
    for name in given.scenes:
        row = part[name] = gain(name, given.rounds)
        bits = "same bits" if row["same_bits"] else "OTHER BITS"
        print(
            f"{name}: {row['one']['median']:.1f} and {row['two']['median']:.1f} ns, {row['gain']:.2f} x, {bits}"
        )
    save("threads", part)


if __name__ == "__main__":
    main()
