"""`beltsim warmup`: compile the kernels of some decks now, so that a first run, as in a container, starts at once."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import click

from beltsim.console import UsageProblem, guarded, say, summary

ROWS, COLUMNS = 3, 4
"""Of the belt: between the rows of any grid, its runs of bonds have gaps, but not if it were smaller."""

NODES = [(COLUMNS * row + column + 1, row, column) for row in range(ROWS) for column in range(COLUMNS)]
CELLS = "\n".join(f"{node}, {0.05 * column:g}, {0.05 * row:g}, 0, 1, 0, 0, 0" for node, row, column in NODES)
BONDS = "\n".join(
    f"{node}, {node + 1}, 0, 0, 0, 1, 0, 0, 0, 0.05, 0, 0, 1, 0, 0, 0"
    for node, _, column in NODES
    if column + 1 < COLUMNS
)

BELT_CONVEYOR = f"""*FORMAT, NAME=BELTSIM, VERSION=1
*MATERIAL, NAME=stuff, DENSITY=1100, YOUNGS MODULUS=5 MPa, POISSON RATIO=0.45
*CONTACT PROPERTY, MATERIAL A=stuff, MATERIAL B=stuff, FRICTION=0.4, RESTITUTION=0.3, ROLLING FRICTION=0.1
*CONTACT GROUP, NAME=belt, BELT=belt
*PARTICLE TYPE, NAME=cell, SHAPE=ROUNDED BOX, SIZE X=58 mm, SIZE Y=58 mm, SIZE Z=10 mm, EDGE RADIUS=4 mm, \
MATERIAL=stuff, CONTACT GROUP=belt
*PARTICLE, TYPE=cell
{CELLS}
*BOND TYPE, NAME=fabric, SECTION WIDTH=50 mm, SECTION THICKNESS=10 mm, YOUNGS MODULUS=20 MPa, POISSON RATIO=0.3, \
DAMPING FACTOR=0.05
*BOND, TYPE=fabric
{BONDS}
*PARTICLE TYPE, NAME=grain, SHAPE=SPHERE, RADIUS=20 mm, MATERIAL=stuff
*PART, NAME=pulley, SHAPE=CYLINDER, DIAMETER=100 mm, LENGTH=200 mm, MATERIAL=stuff
0, 0, -0.06, 0.70710678, -0.70710678, 0, 0
*PART, NAME=idler, SHAPE=CYLINDER, DIAMETER=100 mm, LENGTH=200 mm, MATERIAL=stuff
0.15, 0, -0.06, 0.70710678, -0.70710678, 0, 0
*AMPLITUDE, NAME=ramp
0, 0
1, 1
*MOTION, PART=pulley, TYPE=ROTATION, ANGULAR VELOCITY=1, AMPLITUDE=ramp
*MOTION, PART=idler, TYPE=FREE ROTATION, INERTIA=0.01, FRICTION TORQUE=0.1
*GRAVITY
0, 0, -9.81
*SOURCE, NAME=feed, MASS RATE=1, SEED=1
0, -0.1, 0.1, 0.2, 0.1, 0.2
0, 0, -1
grain, 1
*STEP, DURATION=1
*OUTPUT, INTERVAL=1
"""
"""Small, but of the kind of a belt conveyor with bulk: kernels depend on what a scene has, not on how much of it."""


@click.command("warmup")
@click.argument("cases", nargs=-1, type=click.Path(exists=True, dir_okay=False))
@click.option("--json", "as_json", is_flag=True, help="Print a summary as one JSON object on stdout.")
@click.option("-q", "--quiet", is_flag=True, help="No messages but errors.")
@guarded
def warmup_command(cases: tuple[str, ...], as_json: bool, quiet: bool) -> None:
    """Compile the kernels that the INP decks CASES need, and keep them for later runs.

    Without decks: those of a belt conveyor with bulk. Serial kernels and those for threads are made where this machine
    has several CPUs. The folder is named after the CPU too, so warm up on the kind of machine that will run; where
    NUMBA_CACHE_DIR points to another place, let it point there in later runs.

    \b
    Example:
        NUMBA_CACHE_DIR=/opt/kernels beltsim warmup case.inp
    """  # noqa: D301 - click wants the character itself
    from beltsim.signals import signals
    from beltsim.solver.jit import STORE

    if not STORE.lasting:
        raise UsageProblem("the cache folder may not be written to; NUMBA_CACHE_DIR names another place")
    clock, timings = time.perf_counter(), {}
    with signals():
        for name in cases or (None,):
            timings[name or "belt conveyor"] = seconds = compile_for(name)
            say(f"{name or 'belt conveyor with bulk'}: {seconds:.1f} s", quiet=quiet)
    size = sum(file.stat().st_size for file in STORE.folder.rglob("*") if file.is_file())
    total = time.perf_counter() - clock
    say(f"kernels ready in {total:.1f} s: {size / 1e6:.1f} MB in {STORE.folder}", quiet=quiet)
    if as_json:
        click.echo(summary("ok", timings=timings, cache={"folder": str(STORE.folder), "bytes": size}))


def compile_for(name: str | None) -> float:
    """Compile all that a run of a deck needs by making one step of each *STEP; returns the seconds."""
    from beltsim.threads import permitted

    clock = time.perf_counter()
    for threads in sorted({1, permitted()}):
        deck = deck_of(name)
        for block in deck.blocks("STEP"):
            block.parameters["DURATION"] = 1e-12
            with tempfile.TemporaryDirectory() as folder:
                one_step(deck, block, str(Path(folder) / "warmup.h5"), threads)
    return time.perf_counter() - clock


def deck_of(name: str | None):
    """A deck that was named, or the usual one."""
    from beltsim import inp

    if name is not None:
        return inp.read_case(name)
    deck = inp.read_text(BELT_CONVEYOR)
    inp.check_case(deck)
    return deck


def one_step(deck, block, path: str, threads: int) -> None:
    """Run a deck as if a *STEP of it were its only one."""
    from beltsim.run import run
    from beltsim.scene import build

    scene = build(deck)
    scene.steps = [block]
    run(deck, scene, path, threads=threads, allow_unstable=True)
