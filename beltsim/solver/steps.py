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

from beltsim.solver.bonds import bond_pass
from beltsim.solver.contacts import (
    box_cylinder_pass,
    sphere_box_pass,
    sphere_part_pass,
    sphere_sphere_pass,
)
from beltsim.solver.jit import inner, kernel
from beltsim.solver.motion import factor_at, fastest_part, move_parts, push_parts, sum_part_loads
from beltsim.solver.state import Array
from beltsim.solver.vectors import (
    add,
    at,
    at4,
    dot,
    exponential,
    plus,
    product,
    put,
    put4,
    rotate,
    rotate_back,
    scaled,
    sub,
)

DONE = 0
LISTS_STALE = 1
MOVED_TOO_FAR = 2


class Clock(NamedTuple):
    """What a batch of steps is to do."""

    time_step: float  # s
    start: float  # s, when step 0 was
    step: int  # time = start + step * time_step
    skin: float  # m, of the present lists
    cap: float  # m, the farthest that a particle may move in one step


class Environment(NamedTuple):
    """Loads on all particles."""

    gravity: tuple  # (3,) m/s2
    drag: float  # 1/s, mass-proportional damping
    wind: tuple  # (3,) m/s, the velocity that the damping pulls towards
    listed: Array  # (3, n) positions when the lists were made, m
    part_travel: Array  # (1,) how far parts may have moved since, m


class GivenLoads(NamedTuple):
    """Loads of *FORCE blocks; row r acts on particle[r]."""

    particle: Array  # (r,) int32
    load: Array  # (6, r) N and N m
    amplitude: Array  # (r,) int32 table, -1: constant


@inner
def turn_about(axis, momentum, inertia, time_step, orientation):
    """Free rotation about one principal axis: body momentum and orientation after it."""
    u = 0.5 * time_step * momentum[axis] / inertia[axis]
    scale = 1.0 / (1.0 + u * u)
    cosine, sine = (1.0 - u * u) * scale, 2.0 * u * scale
    root = math.sqrt(scale)
    x, y, z = momentum
    if axis == 0:
        momentum = (x, cosine * y + sine * z, cosine * z - sine * y)
        step = (root, root * u, 0.0, 0.0)
    elif axis == 1:
        momentum = (cosine * x - sine * z, y, cosine * z + sine * x)
        step = (root, 0.0, root * u, 0.0)
    else:
        momentum = (cosine * x + sine * y, cosine * y - sine * x, z)
        step = (root, 0.0, 0.0, root * u)
    return momentum, product(orientation, step)


@inner
def turn_freely(orientation, momentum, inertia, time_step):
    """Orientation and body momentum of a free rigid body after a step: axes 3-2-1-2-3."""
    half = 0.5 * time_step
    momentum, orientation = turn_about(2, momentum, inertia, half, orientation)
    momentum, orientation = turn_about(1, momentum, inertia, half, orientation)
    momentum, orientation = turn_about(0, momentum, inertia, time_step, orientation)
    momentum, orientation = turn_about(1, momentum, inertia, half, orientation)
    momentum, orientation = turn_about(2, momentum, inertia, half, orientation)
    return orientation, momentum


@inner
def world_spin(orientation, momentum, inertia):
    """Angular velocity from the body-frame momentum."""
    local = (momentum[0] / inertia[0], momentum[1] / inertia[1], momentum[2] / inertia[2])
    return rotate(orientation, local)


@kernel
def kick_and_drift(particles, listed, time_step, cap):
    """First half kick and drift of all particles.

    Returns the farthest squared distance from where the lists were made [m2], the largest squared speed, and how many
    particles moved more than `cap` in this step or are not finite.
    """
    position, velocity, orientation = particles.position, particles.velocity, particles.orientation
    momentum, spin = particles.angular_momentum, particles.angular_velocity
    force, torque, mass = particles.force, particles.torque, particles.mass
    inertia, mobility = particles.inertia, particles.mobility
    half = 0.5 * time_step
    farthest = 0.0
    fastest = 0.0
    lost = 0
    for i in range(mass.size):
        v = plus(at(velocity, i), half * mobility[0, i] / mass[i], at(force, i))
        put(velocity, i, v)
        x = plus(at(position, i), time_step, v)
        put(position, i, x)
        q, moments = at4(orientation, i), at(inertia, i)
        if mobility[1, i] > 0.0:
            angular = plus(at(momentum, i), half, at(torque, i))
            put(momentum, i, angular)
            if moments[0] == moments[1] and moments[1] == moments[2]:
                w = scaled(angular, 1.0 / moments[0])
                q = product(exponential(scaled(w, time_step)), q)
            else:
                q, local = turn_freely(q, rotate_back(q, angular), moments, time_step)
                w = world_spin(q, local, moments)
            put(spin, i, w)
        else:
            q = product(exponential(scaled(at(spin, i), time_step)), q)
        # One Newton step of the norm: its drift, 1e-16 a step, stays at rounding for any number of steps.
        correction = 1.5 - 0.5 * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
        put4(orientation, i, (q[0] * correction, q[1] * correction, q[2] * correction, q[3] * correction))
        moved = sub(x, at(listed, i))
        farthest = max(farthest, dot(moved, moved))
        fastest = max(fastest, dot(v, v))
        lost += 0 if dot(v, v) * time_step * time_step <= cap * cap else 1
    return farthest, fastest, lost


@kernel
def start_loads(particles, environment):
    """Begin the sum of each particle's loads with gravity and global damping."""
    force, torque, mass, velocity = particles.force, particles.torque, particles.mass, particles.velocity
    gravity, drag, wind = environment.gravity, environment.drag, environment.wind
    for i in range(mass.size):
        pull = sub(gravity, scaled(sub(at(velocity, i), wind), drag))
        put(force, i, scaled(pull, mass[i]))
        put(torque, i, (0.0, 0.0, 0.0))


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
def second_kick(particles, time_step):
    """Second half kick of all particles."""
    velocity, momentum = particles.velocity, particles.angular_momentum
    force, torque, mass, mobility = particles.force, particles.torque, particles.mass, particles.mobility
    half = 0.5 * time_step
    for i in range(mass.size):
        put(velocity, i, plus(at(velocity, i), half * mobility[0, i] / mass[i], at(force, i)))
        if mobility[1, i] > 0.0:
            put(momentum, i, plus(at(momentum, i), half, at(torque, i)))


@kernel
def spin_of_momentum(particles):
    """Angular velocities of the full step, for output and for forces at the start."""
    orientation, momentum = particles.orientation, particles.angular_momentum
    spin, inertia, mobility = particles.angular_velocity, particles.inertia, particles.mobility
    for i in range(inertia.shape[1]):
        if mobility[1, i] > 0.0:
            q = at4(orientation, i)
            put(spin, i, world_spin(q, rotate_back(q, at(momentum, i)), at(inertia, i)))


@kernel
def find_forces(particles, shapes, laws, belt, strength, lists, parts, drives, given, environment, clock):
    """All loads at the present positions, at the time of the clock.

    Groups that the scene lacks are None: numba compiles their branch away. See `advance` for the parameters.
    """
    start_loads(particles, environment)
    parts.force[:] = 0.0
    parts.torque[:] = 0.0
    if belt is not None:
        bonds, runs, kinds = belt
        bond_pass(particles, bonds, runs, kinds, strength, clock.step)
    find_contact_forces(particles, shapes, laws, *lists, parts, clock.time_step)
    if given is not None:
        add_given_loads(particles, given, drives[2], clock.start + clock.step * clock.time_step)


@inner
def find_contact_forces(particles, shapes, laws, spheres, boxes, sphere_parts, box_parts, parts, time_step):
    """Loads of all contacts."""
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
    lists : (spheres, boxes, sphere_parts, box_parts), each (Contacts, Loads) or None
    drives : (Spins, Slides, Amplitudes)
    given : GivenLoads or None

    Returns
    -------
    done : whole steps that were made
    reason : DONE, LISTS_STALE or MOVED_TOO_FAR (that step is not finished)
    """
    spins, slides, amplitudes = drives
    dt = clock.time_step
    for n in range(steps):
        step = clock.step + n
        time = clock.start + step * dt
        farthest, fastest, lost = kick_and_drift(particles, environment.listed, dt, clock.cap)
        if lost > 0:
            return n, MOVED_TOO_FAR
        move_parts(parts, spins, slides, amplitudes, time, dt)
        now = Clock(dt, clock.start, step + 1, clock.skin, clock.cap)
        find_forces(particles, shapes, laws, belt, strength, lists, parts, drives, given, environment, now)
        push_parts(parts, spins, slides, amplitudes, time + dt, dt)
        second_kick(particles, dt)
        environment.part_travel[0] += dt * fastest_part(parts, slides)
        # Stale as soon as the next step, half as fast again, could bring a pair from beyond the skin into touch.
        reach = 2.0 * (math.sqrt(farthest) + 1.5 * dt * math.sqrt(fastest))
        if reach + environment.part_travel[0] > clock.skin:
            return n + 1, LISTS_STALE
    return steps, DONE
