"""Compiling for a new kind of scene by two processes: passes in one, what makes lists in the other.

Passes are compiled for lists without pairs, whose types are the same; whoever is free takes the next one. What the
second process compiles goes to the cache, where the first one finds it.
"""

from __future__ import annotations

import gc
import os
import signal
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numba
import numpy as np

from beltsim.energy import with_books
from beltsim.engine import State
from beltsim.lists import ListedSpheres, Lists
from beltsim.solver.bonds import add_bonds, bond_chunks
from beltsim.solver.box_cylinder_contacts import box_cylinder_pass
from beltsim.solver.cache import holds
from beltsim.solver.contacts import sphere_part_pass
from beltsim.solver.integration import drift_chunk, drift_chunks
from beltsim.solver.jit import STORE, Callee
from beltsim.solver.neighbours import empty_contacts
from beltsim.solver.sphere_box_contacts import sphere_box_pass
from beltsim.solver.sphere_contacts import sphere_sphere_pass
from beltsim.solver.state import Crossings

Job = tuple[object, tuple]  # a dispatcher of numba and the types of its arguments

STEP = 0.1
"""Some time [s]: only its type counts."""


def without_pairs(families) -> Lists:
    """Lists of the families that most scenes have, without pairs."""
    start, nobody = np.zeros(1, np.int64), np.zeros(0, np.int32)
    spheres = empty_contacts(start, nobody, nobody, rolls=families.rolling, summed=False)
    crossings = Crossings(np.zeros((2, 2), np.int64), nobody, np.zeros((6, 0)), nobody)
    listed = ListedSpheres(spheres, crossings, families.sphere_material)
    pairs = (empty_contacts(start, nobody, nobody),)
    return Lists(
        spheres=listed if families.spheres else None,
        boxes=pairs if families.spheres and families.boxes else None,
        sphere_parts=pairs if families.spheres and families.parts and not families.rods else None,
        box_parts=pairs if families.boxes and families.parts else None,
        walls=None,
        points=None,
        box_boxes=None,
    )


def passes_of(state: State) -> list[Job]:
    """The passes that the steps of a scene call, those that take longest to compile first."""
    found = [*passes_over_contacts(state), *passes_over_particles(state)]
    return [(each.compiled, tuple(map(numba.typeof, arguments))) for each, arguments in found]


def passes_over_contacts(state: State) -> Iterator[tuple[Callee, tuple]]:
    """Passes over pairs and their arguments, of any values."""
    scene, lists = state.scene, without_pairs(state.families)
    if state.account is not None:
        lists = with_books(lists)
    bodies = (scene.population.particles, scene.shapes, scene.laws)
    if lists.boxes is not None:
        yield sphere_box_pass, (*bodies, lists.boxes[0], STEP)
    if lists.box_parts is not None:
        yield box_cylinder_pass, (*bodies, lists.box_parts[0], scene.machinery.parts, STEP)
    if lists.spheres is not None:
        yield sphere_sphere_pass, (*bodies, lists.spheres, STEP, state.team)
    if lists.sphere_parts is not None:
        yield (
            sphere_part_pass,
            (*bodies, lists.sphere_parts[0], scene.machinery.parts, None, STEP, state.team),
        )


def passes_over_particles(state: State) -> Iterator[tuple[Callee, tuple]]:
    """Passes over bonds and particles and their arguments, of any values; with threads, what shares them out."""
    scene, particles = state.scene, state.scene.population.particles
    if scene.bonds is not None:
        belt = (particles, scene.bonds, scene.runs, scene.kinds, scene.strength, 0, STEP)
        yield (add_bonds, (0, 0, *belt)) if state.team is None else (bond_chunks, (0, *belt))
    ledger = None if state.account is None else state.account.ledger
    air = (tuple(scene.gravity), STEP, (STEP, STEP, STEP))
    motion = (particles, particles.position, *air, ledger, STEP, STEP, STEP, STEP)
    yield (drift_chunk, (0, *motion)) if state.team is None else (drift_chunks, motion)


@contextmanager
def without_collection() -> Iterator[None]:
    """Cyclic garbage waits, whose collection takes a tenth of all compile time."""
    before = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if before:
            gc.enable()


@contextmanager
def helped(jobs: list[Job], cpus: int) -> Iterator[Callable[[], None]]:
    """A second process for jobs that the cache lacks, if there are several and a CPU for it.

    Yields a function that does what is left of them and waits for the other process, which ends with the context.
    """
    missing = [job for job in jobs if not holds(*job)]
    if cpus < 2 or len(missing) < 2 or not STORE.lasting or not hasattr(os, "fork"):
        yield lambda: None
        return
    turns, give = os.pipe()
    os.write(give, bytes(range(len(missing))))
    os.close(give)
    child = fork()
    if child == 0:
        work_and_die(missing, turns)

    running = [child]

    def finish() -> None:
        take_turns(missing, turns)
        os.waitpid(child, 0)
        running.clear()

    try:
        yield finish
    finally:
        os.close(turns)
        for process in running:
            os.kill(process, signal.SIGKILL)
            os.waitpid(process, 0)


def fork() -> int:
    """os.fork without the warning of Python 3.12 about threads: those of numerical libraries, which sleep."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return os.fork()


def take_turns(jobs: list[Job], turns: int) -> None:
    """Compile jobs until both processes have taken all: each byte in the pipe is the number of one."""
    while number := os.read(turns, 1):
        dispatcher, types = jobs[number[0]]
        dispatcher.compile(types)


def work_and_die(jobs: list[Job], turns: int) -> None:
    """The second process, to which signals mean what they do by default."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)
    try:
        take_turns(jobs, turns)
    finally:
        os._exit(0)
