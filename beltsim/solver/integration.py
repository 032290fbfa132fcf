"""The passes over particles that integrate their motion: velocity Verlet, and gravity and damping on all of them.

Rotation: world angular momentum is kicked by the torque and kept by the free motion, which is the symplectic splitting
into rotations about the principal axes (Miller et al. 2002, J. Chem. Phys. 116, 8649), each by the rational angle
2 atan(phi / 2), which keeps the norm and needs no trigonometric function.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import types

from beltsim.solver.chunks import chunk_of, chunks_in
from beltsim.solver.jit import callee, inner, kernel, pass_kernel, vector_kernel
from beltsim.solver.sharing import share
from beltsim.solver.vectors import (
    at,
    at4,
    axes_of,
    dot,
    from_axes,
    in_axes,
    of,
    of4,
    plus,
    product,
    put,
    rows3,
    rows4,
    scaled,
    sub,
    times,
    unit,
)


@inner
def cycled(v):
    """Components (y, z, x) of a vector."""
    return v[1], v[2], v[0]


@inner
def cycled4(q):
    """The same of a quaternion's vector part."""
    return q[0], q[2], q[3], q[1]


@inner
def turn_about_z(momentum, pliancy, time_step, q):
    """Free rotation about the third principal axis: body momentum and orientation, not normalised, after it."""
    x, y, z = momentum
    u = 0.5 * time_step * z * pliancy
    scale = 1.0 / (1.0 + u * u)
    cosine, sine = (1.0 - u * u) * scale, 2.0 * u * scale
    turned = (q[0] - u * q[3], q[1] + u * q[2], q[2] - u * q[1], q[3] + u * q[0])
    return (cosine * x + sine * y, cosine * y - sine * x, z), turned


@inner
def turn_freely(q, momentum, pliancy, time_step):
    """Orientation and body momentum of a free rigid body after a step: axes 3-2-1-2-3; `pliancy` is 1 / inertia.

    Turning about another axis is turning about the third with the axes renamed in a cycle.
    """
    half = 0.5 * time_step
    momentum, q = turn_about_z(momentum, pliancy[2], half, q)
    momentum, q = cycled(cycled(momentum)), cycled4(cycled4(q))
    momentum, q = turn_about_z(momentum, pliancy[1], half, q)
    momentum, q = cycled(cycled(momentum)), cycled4(cycled4(q))
    momentum, q = turn_about_z(momentum, pliancy[0], time_step, q)
    momentum, q = cycled(momentum), cycled4(q)
    momentum, q = turn_about_z(momentum, pliancy[1], half, q)
    momentum, q = cycled(momentum), cycled4(q)
    momentum, q = turn_about_z(momentum, pliancy[2], half, q)
    return unit(q), momentum


@inner
def world_spin(q, momentum, pliancy):
    """Angular velocity in world axes from the body-frame momentum."""
    return from_axes(axes_of(q), times(momentum, pliancy))


@inner
def inverse(moments):
    """1 / moment about each axis by one division, which takes as long as twenty multiplications."""
    a, b, c = moments
    share = 1.0 / (a * b * c)
    return share * b * c, share * a * c, share * a * b


@inner
def in_body(q, v):
    """World vector v in the frame q."""
    return in_axes(axes_of(q), v)


CALM = 8
"""Steps for which a chunk need not be looked at: fetching where the lists were made took 2 % of S1 at a million
particles."""


class Limits(NamedTuple):
    """What the lists allow in a step [m]."""

    reach: float  # distance of a particle from where the lists were made
    near: (
        float  # distance within which nobody can get beyond `reach` in `CALM` steps; negative: there is none
    )
    cap: float  # way of a particle in one step


@inner
def limits_of(skin, part_travel, cap):
    """Limits of lists with a skin, when parts may have travelled so far, of a quarter of the skin."""
    reach = 0.5 * (skin - part_travel) - cap
    return Limits(reach, reach - 0.125 * skin - CALM * cap, cap)


@vector_kernel
def translate(start, alike, count, position, velocity, force, mass, moves, before, time_step, cap):
    """First half kick and drift of the centres of a chunk, after what the last kick left over: one of a time `before`.

    Bodies are those from particle `alike` on. Returns how many particles moved more than `cap` in this step, and how
    many are not finite. Counts, not maxima: those would keep the loop scalar.
    """
    half = 0.5 * time_step
    fast = lost = 0
    for n in range(count):
        i, body = start + np.uint64(n), alike + np.uint64(n)
        share = moves[body] / mass[body]
        step = 0.0
        for c in range(3):
            # Two kicks, as if they were made one by one: results do not depend on how a run is cut into batches.
            v = velocity[c][i] + before * share * force[c][i]
            v = v + half * share * force[c][i]
            x = position[c][i] + time_step * v
            velocity[c][i] = v
            position[c][i] = x
            step += time_step * v * time_step * v
        fast += 1 if step > cap * cap else 0
        lost += 0 if step < 1e300 else 1
    return fast, lost


@vector_kernel
def count_far(start, count, position, listed, reach, near):
    """How many particles of a chunk are farther than `reach` from where the lists were made, and than `near`."""
    far = farther = 0
    for n in range(count):
        i = start + np.uint64(n)
        moved = sub(of(position, i), of(listed, i))
        square = dot(moved, moved)
        far += 1 if square > reach * reach else 0
        farther += 1 if square > near * near else 0
    return far, farther


@inner
def look_round(c, position, notes, reach, near):
    """How many particles of chunk c are too far from where the lists were made for these lists.

    Where all have stayed within `near`, nobody can be too far for the next `CALM` steps.
    """
    if notes.calm[c] > 0:
        notes.calm[c] -= 1
        return 0
    start, count = chunk_of(c, position[0].size)
    far, farther = count_far(start, count, position, rows3(notes.listed), reach, near)
    notes.calm[c] = CALM if near > 0.0 and farther == 0 else 0
    return far


@inner
def kicked_twice(momentum, torque, first, second):
    """Angular momentum after two kicks by a torque over two times."""
    return plus(plus(momentum, first, torque), second, torque)


@vector_kernel
def count_round(alike, count, inertia):
    """How many particles of a chunk have three equal moments of inertia."""
    found = 0
    for n in range(count):
        a, b, c = of(inertia, alike + np.uint64(n))
        found += 1 if (a == b) & (b == c) else 0
    return found


@vector_kernel
def turn_round(start, alike, count, orientation, momentum, spin, torque, inertia, turns, before, time_step):
    """`turn` for particles with three equal moments: a third of the time, since free motion keeps their spin."""
    half = 0.5 * time_step
    for n in range(count):
        i, body = start + np.uint64(n), alike + np.uint64(n)
        angular = kicked_twice(of(momentum, i), of(torque, i), before * turns[body], half * turns[body])
        w = scaled(angular, 1.0 / inertia[0][body])
        q = unit(product((1.0, half * w[0], half * w[1], half * w[2]), of4(orientation, i)))
        for c in range(3):
            momentum[c][i] = angular[c]
            spin[c][i] = w[c]
        for c in range(4):
            orientation[c][i] = q[c]


@vector_kernel
def turn(start, alike, count, orientation, momentum, spin, torque, inertia, turns, before, time_step):
    """First half kick and free rotation of a chunk of particles; their angular velocity at the new orientation.

    `alike` and `before` as in `translate`.
    """
    half = 0.5 * time_step
    for n in range(count):
        i, body = start + np.uint64(n), alike + np.uint64(n)
        q, pliancy = of4(orientation, i), inverse(of(inertia, body))
        angular = kicked_twice(of(momentum, i), of(torque, i), before * turns[body], half * turns[body])
        q, local = turn_freely(q, in_body(q, angular), pliancy, time_step)
        w = world_spin(q, local, pliancy)
        for c in range(3):
            momentum[c][i] = angular[c]
            spin[c][i] = w[c]
        for c in range(4):
            orientation[c][i] = q[c]


@vector_kernel
def begin_sum(start, alike, count, force, torque, velocity, mass, gravity, drag, wind):
    """Begin the sum of all loads with gravity and global damping."""
    for n in range(count):
        i, body = start + np.uint64(n), alike + np.uint64(n)
        for c in range(3):
            force[c][i] = mass[body] * (gravity[c] - drag * (velocity[c][i] - wind[c]))
            torque[c][i] = 0.0


@callee
def weigh_chunk(c, particles, notes, gravity, drag, wind):
    """Begin the sum of all loads on chunk c with gravity and global damping."""
    start, count = chunk_of(c, particles.mass.size)
    alike, _ = chunk_of(notes.alike[c], particles.mass.size)
    force, torque, velocity = rows3(particles.force), rows3(particles.torque), rows3(particles.velocity)
    begin_sum(start, alike, count, force, torque, velocity, particles.mass, gravity, drag, wind)


@pass_kernel(returns=types.UniTuple(types.int64, 3))
def drift_chunk(c, particles, notes, gravity, drag, wind, ledger, before, time_step, limits):
    """First half kick and drift of chunk c; returns how many particles are too far, too fast and lost (`Limits`).

    Without an energy book, which needs the old loads once more, the sum of the new ones is begun too: the chunk's state
    is in the cache.
    """
    force, torque = rows3(particles.force), rows3(particles.torque)
    inertia, mobility, velocity = rows3(particles.inertia), particles.mobility, rows3(particles.velocity)
    start, count = chunk_of(c, particles.mass.size)
    alike, _ = chunk_of(notes.alike[c], particles.mass.size)
    position = rows3(particles.position)
    fast, lost = translate(
        start,
        alike,
        count,
        position,
        velocity,
        force,
        particles.mass,
        mobility[0],
        before,
        time_step,
        limits.cap,
    )
    far = look_round(c, position, notes, limits.reach, limits.near)
    state = rows4(particles.orientation), rows3(particles.angular_momentum), rows3(particles.angular_velocity)
    if count_round(alike, count, inertia) == count:
        turn_round(start, alike, count, *state, torque, inertia, mobility[1], before, time_step)
    else:
        turn(start, alike, count, *state, torque, inertia, mobility[1], before, time_step)
    if ledger is None:
        weigh_chunk(c, particles, notes, gravity, drag, wind)
    return far, fast, lost


@callee
def kick_and_drift(particles, environment, team, before, time_step, limits):
    """First half kick and drift of all particles; returns the counts of `drift_chunk`, `before` as in `translate`."""
    far = fast = lost = 0
    notes, gravity, drag = environment.notes, environment.gravity, environment.drag
    work = (
        particles, notes, gravity, drag, environment.wind, environment.ledger, before, time_step, limits,
    )  # fmt: skip
    chunks = chunks_in(particles.mass.size)
    if team is None:
        for c in range(chunks):
            counts = drift_chunk(c, *work)
            far, fast, lost = far + counts[0], fast + counts[1], lost + counts[2]
    else:
        far, fast, lost = share(drift_chunk, 0, chunks, 1, team, work)
    return far, fast, lost


@vector_kernel
def last_half_kick(start, count, velocity, momentum, force, torque, mass, moves, turns, time_step):
    """Second half kick of a chunk of particles."""
    half = 0.5 * time_step
    for n in range(count):
        i = start + np.uint64(n)
        share = moves[i] / mass[i]
        for c in range(3):
            velocity[c][i] += half * share * force[c][i]
            momentum[c][i] += half * turns[i] * torque[c][i]


@callee
def weigh(particles, environment):
    """Begin the sum of all loads with gravity and global damping; by one thread, since few steps need it."""
    for c in range(chunks_in(particles.mass.size)):
        weigh_chunk(c, particles, environment.notes, environment.gravity, environment.drag, environment.wind)


@callee
def kick_chunk(c, particles, time_step):
    """Second half kick of chunk c."""
    start, count = chunk_of(c, particles.mass.size)
    last_half_kick(
        start,
        count,
        rows3(particles.velocity),
        rows3(particles.angular_momentum),
        rows3(particles.force),
        rows3(particles.torque),
        particles.mass,
        particles.mobility[0],
        particles.mobility[1],
        time_step,
    )


@kernel
def kick(particles, time_step):
    """Second half kick of all particles; by one thread, since few steps need it."""
    for c in range(chunks_in(particles.mass.size)):
        kick_chunk(c, particles, time_step)


@kernel
def spin_of_momentum(particles):
    """Angular velocities of the full step, for output; prescribed ones stay."""
    for i in range(particles.mass.size):
        if particles.mobility[1, i] > 0.0:
            q = at4(particles.orientation, i)
            local = in_body(q, at(particles.angular_momentum, i))
            put(particles.angular_velocity, i, world_spin(q, local, inverse(at(particles.inertia, i))))
