"""What a second thread gains: whole steps of S1, S2 and S3, and this machine's own loops beside them.

    python benchmarks/threads.py [S1 S2 S3] [--rounds 5]

prints a table and puts it into benchmarks/results/solver.json. Wall-clock time, one thread and two by turns from one
state; the machine's own figures are a triad that misses the caches and a polynomial that never leaves the registers.

The host of a virtual machine moves its CPUs: side by side they meet in 0.8 us, in different parts of the chip in 2 us,
and then threads that share a small scene gain next to nothing. So each round says how long a meeting took.
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
NEAR = 1.3
"""us that a meeting takes at most while both CPUs share a cache."""
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


@numba.njit(parallel=True)
def meetings(places, count):
    """Loops in which each thread does next to nothing, one after the other."""
    for _ in range(count):
        for row in numba.prange(places.shape[0]):
            places[row, 0] += 1.0


def meeting() -> float:
    """How long [us] it takes to hand out work to two threads and to have them back."""
    numba.set_num_threads(2)
    return 1e6 * seconds(lambda: meetings(np.ones((2, 64)), 2000)) / 2000


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
    apart = []
    for _ in range(rounds):
        before = meeting()
        for team in TEAMS:
            cost, result = timed(scene, team)
            found[team].append(cost)
            bits.add(result)
        apart.append(max(before, meeting()))
    gains = [one / two for one, two in zip(found[None], found[2])]
    near = [each for each, time in zip(gains, apart) if time < NEAR]
    return {
        "one": span(found[None]),
        "two": span(found[2]),
        "gain": statistics.median(gains),
        "near": {"rounds": len(near), "of": rounds, "gain": statistics.median(near) if near else None},
        "meeting": span(apart),
        "same_bits": len(bits) == 1,
    }


def in_words(near: dict) -> str:
    """The gain in the rounds in which both CPUs shared a cache, and how many those were."""
    gain = "-" if near["gain"] is None else f"{near['gain']:.2f}"
    return f"{gain} ({near['rounds']} of {near['of']} rounds)"


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
            f"{name}: {row['one']['median']:.1f} and {row['two']['median']:.1f} ns, {row['gain']:.2f} x, {bits}; "
            f"side by side {in_words(row['near'])}"
        )
    save("threads", part)


if __name__ == "__main__":
    main()
