"""The passes over particles, and `advance`: velocity Verlet over many steps in one compiled call.

Forces see the velocities of the middle of the step (after the half kick), so damped scenes are first order in the step
and undamped ones second order; the step limit with damping ratio z is then 2/omega (sqrt(1 + z^2) - z).
Rotation: world angular momentum is kicked by the torque and kept by the free motion, which is the symplectic splitting
into rotations about the principal axes (Miller et al. 2002, J. Chem. Phys. 116, 8649), each by the rational angle
2 atan(phi / 2), which keeps the norm and needs no trigonometric function.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from beltsim.solver.bond import to_world
from beltsim.solver.bonds import bond_pass, of, of4, rows3, rows4
from beltsim.solver.box_contacts import box_box_pass
from beltsim.solver.contacts import (
    box_cylinder_pass,
    sphere_box_pass,
    sphere_part_pass,
)
from beltsim.solver.jit import inner, kernel, vector_kernel
from beltsim.solver.ledger import Ledger, note_before_push, note_first_half, note_push, note_second_half
from beltsim.solver.motion import (
    add_part_work,
    factor_at,
    fastest_part,
    move_parts,
    push_parts,
    sum_part_loads,
)
from beltsim.solver.sphere_contacts import sphere_sphere_pass
from beltsim.solver.state import Array
from beltsim.solver.vectors import (
    add,
    at,
    at4,
    axis_x,
    axis_y,
    axis_z,
    dot,
    exponential,
    plus,
    product,
    put,
    put4,
    scaled,
    sub,
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
    listed: Array  # (3, n) positions when the lists were made, m
    part_travel: Array  # (1,) how far parts may have moved since, m
    part_work: Array  # (p,) work of each part on what touches it, J
    turned: Array  # (h,) int32 particles with a prescribed spin
    turning: Array  # (3, h) rad/s
    ledger: Ledger | None = None  # if an energy book is kept


class GivenLoads(NamedTuple):
    """Loads of *FORCE blocks; row r acts on particle[r]."""

    particle: Array  # (r,) int32
    load: Array  # (6, r) N and N m
    amplitude: Array  # (r,) int32 table, -1: constant


@inner
def cycled(v):
    """Components (y, z, x) of a vector."""
    return v[1], v[2], v[0]


@inner
def cycled4(q):
    """The same of a quaternion's vector part."""
    return q[0], q[2], q[3], q[1]


@inner
def turn_about_z(momentum, moment, time_step, q):
    """Free rotation about the third principal axis: body momentum and orientation, not normalised, after it."""
    x, y, z = momentum
    u = 0.5 * time_step * z / moment
    scale = 1.0 / (1.0 + u * u)
    cosine, sine = (1.0 - u * u) * scale, 2.0 * u * scale
    turned = (q[0] - u * q[3], q[1] + u * q[2], q[2] - u * q[1], q[3] + u * q[0])
    return (cosine * x + sine * y, cosine * y - sine * x, z), turned


@inner
def turn_freely(q, momentum, inertia, time_step):
    """Orientation and body momentum of a free rigid body after a step: axes 3-2-1-2-3.

    Turning about another axis is turning about the third with the axes renamed in a cycle.
    """
    half = 0.5 * time_step
    momentum, q = turn_about_z(momentum, inertia[2], half, q)
    momentum, q = cycled(cycled(momentum)), cycled4(cycled4(q))
    momentum, q = turn_about_z(momentum, inertia[1], half, q)
    momentum, q = cycled(cycled(momentum)), cycled4(cycled4(q))
    momentum, q = turn_about_z(momentum, inertia[0], time_step, q)
    momentum, q = cycled(momentum), cycled4(q)
    momentum, q = turn_about_z(momentum, inertia[1], half, q)
    momentum, q = cycled(momentum), cycled4(q)
    momentum, q = turn_about_z(momentum, inertia[2], half, q)
    scale = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (scale * q[0], scale * q[1], scale * q[2], scale * q[3]), momentum


@inner
def world_spin(q, momentum, inertia):
    """Angular velocity in world axes from the body-frame momentum."""
    return to_world(q, (momentum[0] / inertia[0], momentum[1] / inertia[1], momentum[2] / inertia[2]))


@inner
def in_body(q, v):
    """World vector v in the frame q."""
    return dot(axis_x(q), v), dot(axis_y(q), v), dot(axis_z(q), v)


@vector_kernel
def translate(position, velocity, force, mass, moves, listed, time_step, reach, cap):
    """First half kick and drift of all centres.

    Returns how many particles are farther than `reach` from where the lists were made, how many moved more than
    `cap` in this step, and how many are not finite. Counts, not maxima: those would keep the loop scalar.
    """
    half = 0.5 * time_step
    far = fast = lost = 0
    for i in range(mass.size):
        pull = half * moves[i] / mass[i]
        moved = 0.0
        step = 0.0
        for c in range(3):
            v = velocity[c][i] + pull * force[c][i]
            x = position[c][i] + time_step * v
            velocity[c][i] = v
            position[c][i] = x
            moved += (x - listed[c][i]) * (x - listed[c][i])
            step += time_step * v * time_step * v
        far += 1 if moved > reach * reach else 0
        fast += 1 if step > cap * cap else 0
        lost += 0 if moved < 1e300 else 1
    return far, fast, lost


@vector_kernel
def turn(orientation, momentum, spin, torque, inertia, turns, time_step):
    """First half kick and free rotation of all particles; their angular velocity at the new orientation."""
    half = 0.5 * time_step
    for i in range(turns.size):
        q, moments = of4(orientation, i), of(inertia, i)
        angular = plus(of(momentum, i), half * turns[i], of(torque, i))
        q, local = turn_freely(q, in_body(q, angular), moments, time_step)
        w = world_spin(q, local, moments)
        for c in range(3):
            momentum[c][i] = angular[c]
            spin[c][i] = w[c]
        for c in range(4):
            orientation[c][i] = q[c]


@kernel
def kick_and_drift(particles, environment, time_step, reach, cap):
    """First half kick and drift of all particles; returns the counts of `translate`."""
    force, torque = rows3(particles.force), rows3(particles.torque)
    spin, orientation = rows3(particles.angular_velocity), rows4(particles.orientation)
    mobility = particles.mobility
    counts = translate(
        rows3(particles.position),
        rows3(particles.velocity),
        force,
        particles.mass,
        mobility[0],
        rows3(environment.listed),
        time_step,
        reach,
        cap,
    )
    turn(
        orientation,
        rows3(particles.angular_momentum),
        spin,
        torque,
        rows3(particles.inertia),
        mobility[1],
        time_step,
    )
    # Particles whose spin is prescribed carry no momentum: what moved nothing above is turned here.
    for n in range(environment.turned.size):
        i = environment.turned[n]
        w = at(environment.turning, n)
        put(particles.angular_velocity, i, w)
        put4(
            particles.orientation,
            i,
            product(exponential(scaled(w, time_step)), at4(particles.orientation, i)),
        )
    return counts


@vector_kernel
def weigh(force, torque, velocity, mass, gravity, drag, wind):
    """Begin the sum of all loads with gravity and global damping."""
    for i in range(mass.size):
        for c in range(3):
            force[c][i] = mass[i] * (gravity[c] - drag * (velocity[c][i] - wind[c]))
            torque[c][i] = 0.0


@vector_kernel
def kick(velocity, momentum, force, torque, mass, moves, turns, time_step):
    """Second half kick of all particles."""
    half = 0.5 * time_step
    for i in range(mass.size):
        for c in range(3):
            velocity[c][i] += half * moves[i] / mass[i] * force[c][i]
            momentum[c][i] += half * turns[i] * torque[c][i]


@kernel
def sum_loads(particles, loads, index):
    """Add the loads of one list of pairs to its particles, each particle in a fixed order."""
    force, torque = particles.force, particles.torque
    start, entry = index.start, index.entry
    for i in range(start.size - 1):
        f, t = at(force, i), at(torque, i)
        for n in range(start[i], start[i + 1]):
            k = entry[n] >> 1
            if entry[n] & 1 == 0:
                f = add(f, (loads[0, k], loads[1, k], loads[2, k]))
                t = add(t, (loads[3, k], loads[4, k], loads[5, k]))
            else:
                f = sub(f, (loads[0, k], loads[1, k], loads[2, k]))
                t = add(t, (loads[6, k], loads[7, k], loads[8, k]))
        put(force, i, f)
        put(torque, i, t)


@kernel
def add_given_loads(particles, given, amplitudes, time):
    """Add the loads of *FORCE blocks at a time; in order, since several may act on one particle."""
    for r in range(given.particle.size):
        factor = factor_at(amplitudes, given.amplitude[r], time)
        i = given.particle[r]
        for axis in range(3):
            particles.force[axis, i] += factor * given.load[axis, r]
            particles.torque[axis, i] += factor * given.load[3 + axis, r]


@kernel
def spin_of_momentum(particles):
    """Angular velocities of the full step, for output; prescribed ones stay."""
    for i in range(particles.mass.size):
        if particles.mobility[1, i] > 0.0:
            q = at4(particles.orientation, i)
            local = in_body(q, at(particles.angular_momentum, i))
            put(particles.angular_velocity, i, world_spin(q, local, at(particles.inertia, i)))


@kernel
def find_forces(particles, shapes, laws, belt, strength, lists, parts, drives, given, environment, clock):
    """All loads at the present positions, at the time of the clock.

    Groups that the scene lacks are None: numba compiles their branch away. See `advance` for the parameters.
    """
    force, torque = rows3(particles.force), rows3(particles.torque)
    velocity = rows3(particles.velocity)
    weigh(force, torque, velocity, particles.mass, environment.gravity, environment.drag, environment.wind)
    parts.force[:] = 0.0
    parts.torque[:] = 0.0
    if belt is not None:
        bonds, runs, kinds = belt
        bond_pass(particles, bonds, runs, kinds, strength, clock.step, clock.time_step)
    find_contact_forces(particles, shapes, laws, *lists, parts, drives[1].moves, clock.time_step)
    if given is not None:
        add_given_loads(particles, given, drives[2], clock.start + clock.step * clock.time_step)


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
    parts,
    moves,
    time_step,
):
    """Loads of all contacts."""
    if walls is not None:
        contacts, index, feelers, surfaces = walls
        wall_pass(particles, shapes, laws, contacts, feelers, surfaces, parts, moves, time_step)
        sum_loads(particles, contacts.loads, index)
        sum_wall_loads(parts, contacts, surfaces)
    if points is not None:
        contacts, index, surfaces = points
        wall_point_pass(particles, shapes, laws, contacts, surfaces, parts, moves, time_step)
        sum_loads(particles, contacts.loads, index)
        sum_point_loads(parts, contacts, surfaces)
    if box_boxes is not None:
        contacts, index = box_boxes
        box_box_pass(particles, shapes, laws, contacts, time_step)
        sum_loads(particles, contacts.loads, index)
    if spheres is not None:
        contacts, index = spheres
        sphere_sphere_pass(particles, shapes, laws, contacts, time_step)
        sum_loads(particles, contacts.loads, index)
    if boxes is not None:
        contacts, index = boxes
        sphere_box_pass(particles, shapes, laws, contacts, time_step)
        sum_loads(particles, contacts.loads, index)
    if sphere_parts is not None:
        contacts, index = sphere_parts
        sphere_part_pass(particles, shapes, laws, contacts, parts, time_step)
        sum_loads(particles, contacts.loads, index)
        sum_part_loads(parts, contacts)
    if box_parts is not None:
        contacts, index = box_parts
        box_cylinder_pass(particles, shapes, laws, contacts, parts, time_step)
        sum_loads(particles, contacts.loads, index)
        sum_part_loads(parts, contacts)


@kernel
def advance(particles, shapes, laws, belt, strength, lists, parts, drives, given, environment, clock, steps):
    """Up to `steps` steps.

    Parameters
    ----------
    belt : (Bonds, Runs, BondKinds) or None
    strength : BondStrength or None
    lists : (spheres, boxes, sphere_parts, box_parts), each (Contacts, Loads) or None; (walls, points): see
        `beltsim.wall_lists`, or None; box_boxes as the first
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
    for n in range(steps):
        step = clock.step + n
        time = clock.start + step * dt
        reach = 0.5 * (clock.skin - environment.part_travel[0]) - clock.cap
        far, fast, lost = kick_and_drift(particles, environment, dt, reach, clock.cap)
        if lost > 0:
            return n, LOST
        move_parts(parts, spins, slides, amplitudes, time, dt)
        now = Clock(dt, clock.start, step + 1, clock.skin, clock.cap)
        # Work over a step: the velocities of its middle with the loads of both its ends.
        ledger = environment.ledger
        add_part_work(parts, environment.part_work, 0.5 * dt)
        note_first_half(ledger, particles, parts, spins, slides, given, amplitudes, environment, time, dt)
        find_forces(particles, shapes, laws, belt, strength, lists, parts, drives, given, environment, now)
        add_part_work(parts, environment.part_work, 0.5 * dt)
        note_second_half(
            ledger, particles, parts, spins, slides, given, amplitudes, environment, time + dt, dt
        )
        note_before_push(ledger, parts)
        push_parts(parts, spins, slides, amplitudes, time + dt, dt)
        note_push(ledger, parts, spins, slides, amplitudes, time + dt, dt)
        kick(
            rows3(particles.velocity),
            rows3(particles.angular_momentum),
            rows3(particles.force),
            rows3(particles.torque),
            particles.mass,
            particles.mobility[0],
            particles.mobility[1],
            dt,
        )
        environment.part_travel[0] += dt * fastest_part(parts, slides)
        # Nobody beyond `reach`, nobody faster than `cap`: no pair gets from beyond the skin into touch next step.
        if belt is not None and belt[0].wound[0] > 0:
            return n + 1, WOUND_UP
        if fast > 0:
            return n + 1, TOO_FAST
        if far > 0 or environment.part_travel[0] > 0.25 * clock.skin:
            return n + 1, LISTS_STALE
    return steps, DONE
