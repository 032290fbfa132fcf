"""The passes over particles, and `advance`: velocity Verlet over many steps in one compiled call.

Forces see the velocities of the middle of the step (after the half kick), so damped scenes are first order in the step
and undamped ones second order; the step limit with damping ratio z is then 2/omega (sqrt(1 + z^2) - z).
"""

from __future__ import annotations

from typing import NamedTuple

from beltsim.solver.bonds import bond_pass
from beltsim.solver.box_contacts import box_box_pass
from beltsim.solver.box_cylinder_contacts import box_cylinder_pass
from beltsim.solver.contacts import add_loads, sphere_part_pass
from beltsim.solver.guides import Guided, Pivots, guide, hold_axes, turn_guided
from beltsim.solver.integration import kick, limits_of, weigh
from beltsim.solver.jit import callee, inner, kernel
from beltsim.solver.ledger import Ledger, note_before_push, note_first_half, note_push, note_second_half
from beltsim.solver.motion import (
    add_part_work,
    factor_at,
    fastest_part,
    move_parts,
    prescribe_parts,
    push_parts,
    sum_part_loads,
)
from beltsim.solver.rods import follow_rods, load_rods, rod_pass
from beltsim.solver.sphere_box_contacts import sphere_box_pass
from beltsim.solver.sphere_contacts import sphere_sphere_pass
from beltsim.solver.state import Array, ChunkNotes
from beltsim.solver.underway import drift_and_load
from beltsim.solver.vectors import (
    add,
    at,
    put,
)
from beltsim.solver.wall_contacts import sum_point_loads, sum_wall_loads, wall_pass, wall_point_pass

DONE = 0
LISTS_STALE = 1
TOO_FAST = 2
LOST = 3
WOUND_UP = 4


class Clock(NamedTuple):
    """What a batch of steps is to do."""

    time_step: float  # s
    start: float  # s, when step 0 was
    step: int  # time = start + step * time_step
    skin: float  # m, of the present lists
    cap: float  # m, the farthest that a particle is expected to move in one step


class Environment(NamedTuple):
    """Loads on all particles."""

    gravity: tuple  # (3,) m/s2
    drag: float  # 1/s, mass-proportional damping
    wind: tuple  # (3,) m/s, the velocity that the damping pulls towards
    notes: ChunkNotes
    part_travel: Array  # (1,) how far parts may have moved since, m
    part_work: Array  # (p,) work of each part on what touches it, J
    guided: Guided
    pivots: Pivots | None = None
    ledger: Ledger | None = None  # if an energy book is kept
    team: int | None = None  # threads; None: one, and nothing parallel is compiled


class GivenLoads(NamedTuple):
    """Loads of *FORCE blocks; row r acts on particle[r]."""

    particle: Array  # (r,) int32
    load: Array  # (6, r) N and N m
    amplitude: Array  # (r,) int32 table, -1: constant


@kernel
def sum_loads(particles, loads, index):
    """Add the loads of one list of pairs with parts to its particles, each particle in a fixed order."""
    force, torque = particles.force, particles.torque
    start, entry = index.start, index.entry
    for i in range(start.size - 1):
        if start[i] == start[i + 1]:
            continue
        f, t = at(force, i), at(torque, i)
        for n in range(start[i], start[i + 1]):
            k = entry[n]
            f = add(f, (loads[0, k], loads[1, k], loads[2, k]))
            t = add(t, (loads[3, k], loads[4, k], loads[5, k]))
        put(force, i, f)
        put(torque, i, t)


@callee
def add_given_loads(particles, given, amplitudes, time):
    """Add the loads of *FORCE blocks at a time; in order, since several may act on one particle."""
    for r in range(given.particle.size):
        factor = factor_at(amplitudes, given.amplitude[r], time)
        i = given.particle[r]
        for axis in range(3):
            particles.force[axis, i] += factor * given.load[axis, r]
            particles.torque[axis, i] += factor * given.load[3 + axis, r]


@callee
def find_forces(
    particles, shapes, laws, belt, strength, lists, parts, drives, given, environment, clock, underway
):
    """All loads at the present positions, at the time of the clock.

    The sum of loads has been begun (`weigh`), with what `drift_and_load` found if `underway`. Groups that the scene
    lacks are None: numba compiles their branch away. See `advance` for the parameters.
    """
    follow_rods(particles, parts, lists.rods)
    for p in range(parts.force.shape[1]):
        put(parts.force, p, (0.0, 0.0, 0.0))
        put(parts.torque, p, (0.0, 0.0, 0.0))
        put(drives[1].pressing, p, (0.0, 0.0, 0.0))
    if belt is not None and not underway:
        bonds, runs, kinds = belt
        bond_pass(particles, bonds, runs, kinds, strength, clock.step, clock.time_step, environment.team)
    find_contact_forces(
        particles, shapes, laws, lists.spheres, lists.boxes, lists.sphere_parts, lists.box_parts, lists.walls,
        lists.points, lists.box_boxes, lists.rods, parts, drives[1], clock.time_step, environment.team,
        belt is None and underway,
    )  # fmt: skip
    load_rods(particles, parts, lists.rods)
    time = clock.start + clock.step * clock.time_step
    if given is not None:
        add_given_loads(particles, given, drives[2], time)
    hold_axes(particles, environment.pivots, drives[2], time, clock.time_step)


@inner
def find_contact_forces(
    particles,
    shapes,
    laws,
    spheres,
    boxes,
    sphere_parts,
    box_parts,
    walls,
    points,
    box_boxes,
    rods,
    parts,
    slides,
    time_step,
    team,
    touched,
):
    """Loads of all contacts, without those between spheres if they have `touched` already."""
    if spheres is not None and not touched:
        sphere_sphere_pass(particles, shapes, laws, spheres, time_step, team)
    if walls is not None:
        contacts, index, feelers, surfaces = walls
        wall_pass(particles, shapes, laws, contacts, feelers, surfaces, parts, slides, time_step)
        sum_loads(particles, contacts.loads, index)
        sum_wall_loads(parts, contacts, surfaces)
    if points is not None:
        contacts, index, surfaces = points
        wall_point_pass(particles, shapes, laws, contacts, surfaces, parts, slides, time_step)
        sum_loads(particles, contacts.loads, index)
        sum_point_loads(parts, contacts, surfaces)
    if box_boxes is not None:
        box_box_pass(particles, shapes, laws, box_boxes[0], time_step)
        add_loads(particles, box_boxes[0], True)
    if boxes is not None:
        sphere_box_pass(particles, shapes, laws, boxes[0], time_step)
        add_loads(particles, boxes[0], True)
    if sphere_parts is not None:
        sphere_part_pass(particles, shapes, laws, sphere_parts[0], parts, rods, time_step, team)
        add_loads(particles, sphere_parts[0], False)
        sum_part_loads(parts, sphere_parts[0])
    if box_parts is not None:
        box_cylinder_pass(particles, shapes, laws, box_parts[0], parts, time_step)
        add_loads(particles, box_parts[0], False)
        sum_part_loads(parts, box_parts[0])
    if rods is not None:
        rod_pass(particles, shapes, laws, rods.contacts, parts, rods.rods, time_step)
        add_loads(particles, rods.contacts, False)
        sum_part_loads(parts, rods.contacts)


@inner
def kick_parts(ledger, parts, drives, time, duration, first):
    """The first or the second half of the push of parts, and what a book notes of it; see `motion.push_parts`."""
    note_before_push(ledger, parts)
    push_parts(parts, *drives, time, duration, first)
    note_push(ledger, parts, *drives, time, duration)


@kernel
def advance(particles, shapes, laws, belt, strength, lists, parts, drives, given, environment, clock, steps):
    """Up to `steps` steps; with none, the loads at the clock's moment and no more: one compiled call for both.

    Parameters
    ----------
    belt : (Bonds, Runs, BondKinds) or None
    strength : BondStrength or None
    lists : `lists.Lists`, those of walls with the triangles behind: None for what the scene lacks
    drives : (Spins, Slides, Amplitudes)
    given : GivenLoads or None

    Returns
    -------
    done : whole steps that were made
    reason : DONE; LISTS_STALE; TOO_FAST: some particle moved more than `clock.cap` in the last step; LOST: some
        particle is not finite, and the step is not finished; WOUND_UP: some bond is turned by almost 180 degrees
    """
    spins, slides, amplitudes = drives
    dt = clock.time_step
    if steps == 0:
        weigh(particles, environment)
        find_forces(
            particles, shapes, laws, belt, strength, lists, parts, drives, given, environment, clock, False
        )
    # Duration of the second half kick that goes with the next drift: one way through memory, not two.
    left = 0.0
    for n in range(steps):
        step = clock.step + n
        time = clock.start + step * dt
        limits = limits_of(clock.skin, environment.part_travel[0], clock.cap)
        guide(particles, environment.guided, amplitudes, time + 0.5 * dt)
        now = Clock(dt, clock.start, step + 1, clock.skin, clock.cap)
        counts, underway = drift_and_load(
            particles, shapes, laws, belt, strength, lists.spheres, environment, environment.ledger,
            environment.team, left, limits, now,
        )  # fmt: skip
        far, fast, lost = counts
        if lost > 0:
            return n, LOST
        turn_guided(particles, environment.guided, amplitudes, time + 0.5 * dt, dt)
        kick_parts(environment.ledger, parts, drives, time, 0.5 * dt, 1.0)
        prescribe_parts(parts, spins, slides, amplitudes, time + 0.5 * dt)
        move_parts(parts, slides, dt)
        environment.part_travel[0] += dt * fastest_part(parts, slides)
        # Work over a step: the velocities of its middle with the loads of both its ends.
        ledger = environment.ledger
        add_part_work(parts, slides, environment.part_work, 0.5 * dt)
        note_first_half(ledger, particles, parts, spins, slides, given, amplitudes, environment, time, dt)
        if ledger is not None:
            weigh(particles, environment)
        find_forces(
            particles, shapes, laws, belt, strength, lists, parts, drives, given, environment, now, underway
        )
        add_part_work(parts, slides, environment.part_work, 0.5 * dt)
        note_second_half(
            ledger, particles, parts, spins, slides, given, amplitudes, environment, time + dt, dt
        )
        kick_parts(ledger, parts, drives, time + dt, 0.5 * dt, 0.0)
        prescribe_parts(parts, spins, slides, amplitudes, time + dt)
        reason = why_stop(belt, environment, clock, fast, far)
        left = 0.5 * dt if ledger is None and reason == DONE and n + 1 < steps else 0.0
        if left == 0.0:
            kick(particles, dt)
            guide(particles, environment.guided, amplitudes, time + dt)
        if reason != DONE:
            return n + 1, reason
    return steps, DONE


@inner
def why_stop(belt, environment, clock, fast, far):
    """Why no more steps are to be made with these lists; DONE if they serve on.

    With nobody too far and nobody too fast (`integration.Limits`) no pair gets from beyond the skin into touch in the
    next step.
    """
    if belt is not None and belt[0].wound[0] > 0:
        return WOUND_UP
    if fast > 0:
        return TOO_FAST
    if far > 0 or environment.part_travel[0] > 0.25 * clock.skin:
        return LISTS_STALE
    return DONE
