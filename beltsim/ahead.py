"""Compiling for a new kind of scene by two processes: passes in one, what makes lists and `advance` in the other.

Passes are compiled for lists without pairs, whose types are the same. The second process begins with them and with what
is wanted after the first step; whoever is free takes the next one. What it compiles goes to the cache, where the first
one finds it.
"""

from __future__ import annotations

import gc
import os
import signal
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import numba
import numpy as np

from beltsim.energy import with_books
from beltsim.engine import State
from beltsim.lists import ListedSpheres, Lists
from beltsim.solver.bonds import bond_chunk, bond_measures
from beltsim.solver.box_cylinder_contacts import box_cylinder_pass
from beltsim.solver.cache import holds
from beltsim.solver.chunks import alike_chunks, notes_of
from beltsim.solver.contacts import sphere_part_chunk
from beltsim.solver.crossings import crossings_of
from beltsim.solver.integration import Limits, drift_chunk, spin_of_momentum
from beltsim.solver.jit import STORE, Pass
from beltsim.solver.neighbours import carry_history, empty_contacts
from beltsim.solver.sphere_box_contacts import sphere_box_pass
from beltsim.solver.sphere_contacts import sphere_chunk, sphere_piece
from beltsim.solver.standing import awaited
from beltsim.solver.timestep import contact_row_sums

Job = tuple[object, object]  # a dispatcher of numba, and what it is to be compiled for

STEP = 0.1
"""Some time [s]: only its type counts."""


def without_pairs(state: State) -> Lists:
    """Lists of the families that most scenes have, without pairs."""
    families = state.families
    start, nobody = np.zeros(1, np.int64), np.zeros(0, np.int32)
    spheres = empty_contacts(start, nobody, nobody, rolls=families.rolling, summed=False)
    crossings = crossings_of(start, nobody, 0)
    listed = ListedSpheres(spheres, crossings, families.sphere_material)
    pairs = (empty_contacts(start, nobody, nobody),)
    lists = Lists(
        spheres=listed if families.spheres else None,
        boxes=pairs if families.spheres and families.boxes else None,
        sphere_parts=pairs if families.spheres and families.parts and not families.rods else None,
        box_parts=pairs if families.boxes and families.parts else None,
        walls=None,
        points=None,
        box_boxes=None,
    )
    return lists if state.account is None else with_books(lists)


def jobs_of(state: State) -> list[Job]:
    """The passes that the steps of a scene call, those that take longest to compile first, and what comes after it."""
    found = [*passes_over_contacts(state), *passes_over_particles(state)]
    passes = [(each.compiled, each.signature(typed(arguments))) for each, arguments in found]
    return passes + [(each, typed(arguments)) for each, arguments in kernels_beside(state)]


def typed(values: tuple) -> tuple:
    """The types that numba gives to some arguments."""
    return tuple(map(numba.typeof, values))


def passes_over_contacts(state: State) -> Iterator[tuple[Pass, tuple]]:
    """Passes over pairs and their arguments, of any values."""
    scene, lists = state.scene, without_pairs(state)
    bodies = (scene.population.particles, scene.shapes, scene.laws)
    if lists.boxes is not None:
        yield sphere_box_pass, (*bodies, lists.boxes[0], STEP)
    if lists.box_parts is not None:
        yield box_cylinder_pass, (*bodies, lists.box_parts[0], scene.machinery.parts, STEP)
    if lists.spheres is not None:
        yield sphere_piece, (0, *bodies, lists.spheres, STEP)
        if state.team is not None:
            yield sphere_chunk, (0, *bodies, lists.spheres, STEP)
    if lists.sphere_parts is not None:
        yield sphere_part_chunk, (0, *bodies, lists.sphere_parts[0], scene.machinery.parts, None, STEP)


def passes_over_particles(state: State) -> Iterator[tuple[Pass, tuple]]:
    """Passes over bonds and particles and their arguments, of any values."""
    scene, particles = state.scene, state.scene.population.particles
    if scene.bonds is not None:
        belt = (particles, scene.bonds, scene.runs, scene.kinds, scene.strength, 0, STEP)
        yield bond_chunk, (0, *belt)
    ledger = None if state.account is None else state.account.ledger
    air = (tuple(scene.gravity), STEP, (STEP, STEP, STEP))
    notes = notes_of(particles.position, alike_chunks(particles))
    motion = (particles, notes, *air, ledger, STEP, STEP, Limits(STEP, STEP, STEP))
    yield drift_chunk, (0, *motion)


def kernels_beside(state: State) -> Iterator[tuple[object, tuple]]:
    """What a run calls once it has begun, and its arguments, of any values."""
    scene, particles = state.scene, state.scene.population.particles
    if scene.bonds is not None:
        yield bond_measures, (particles, scene.bonds, scene.kinds)
    lists = without_pairs(state)
    for family in (lists.spheres, lists.boxes or lists.sphere_parts or lists.box_parts):
        if family is not None:
            pairs = family[0]
            yield carry_history, (pairs, pairs, *[pairs.second] * 2, *[pairs.start] * 2, False)
    if any(family is not None for family in lists):
        nobody, sums = np.zeros(0, np.int32), np.zeros(0)
        yield contact_row_sums, (particles, scene.shapes, nobody, nobody, sums, STEP, False, False, sums)
    yield spin_of_momentum, (particles,)


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
def helped(jobs: list[Job], cpus: int) -> Iterator[None]:
    """A second process for jobs that the cache lacks, if there are several and a CPU for it.

    Once a kernel needs its passes, or else at the end, this process does what is left and waits for the other one,
    which ends with the context.
    """
    missing = [job for job in jobs if not holds(*job)]
    if cpus < 2 or len(missing) < 2 or not STORE.lasting or not hasattr(os, "fork"):
        yield
        return
    turns, give = os.pipe()
    os.write(give, bytes(range(len(missing))))
    os.close(give)
    child = fork()
    if child == 0:
        work_and_die(missing, turns)

    running = [child]

    def finish() -> None:
        if running:
            take_turns(missing, turns)
            os.waitpid(child, 0)
            running.clear()

    awaited.append(finish)
    try:
        yield
        finish()
    finally:
        awaited.clear()
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
        dispatcher, signature = jobs[number[0]]
        dispatcher.compile(signature)


def work_and_die(jobs: list[Job], turns: int) -> None:
    """The second process, to which signals mean what they do by default and which waits for nobody."""
    awaited.clear()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)
    try:
        take_turns(jobs, turns)
    finally:
        os._exit(0)
