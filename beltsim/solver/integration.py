"""The passes over particles that integrate their motion: velocity Verlet, and gravity and damping on all of them.

Rotation: world angular momentum is kicked by the torque and kept by the free motion, which is the symplectic splitting
into rotations about the principal axes (Miller et al. 2002, J. Chem. Phys. 116, 8649), each by the rational angle
2 atan(phi / 2), which keeps the norm and needs no trigonometric function.
"""

from __future__ import annotations

import math

from beltsim.solver.bond import to_world
from beltsim.solver.bonds import of, of4, rows3, rows4
from beltsim.solver.jit import callee, inner, kernel, vector_kernel
from beltsim.solver.vectors import (
    at,
    at4,
    axis_x,
    axis_y,
    axis_z,
    dot,
    plus,
    put,
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
    return counts


@vector_kernel
def begin_sum(force, torque, velocity, mass, gravity, drag, wind):
    """Begin the sum of all loads with gravity and global damping."""
    for i in range(mass.size):
        for c in range(3):
            force[c][i] = mass[i] * (gravity[c] - drag * (velocity[c][i] - wind[c]))
            torque[c][i] = 0.0


@vector_kernel
def last_half_kick(velocity, momentum, force, torque, mass, moves, turns, time_step):
    """Second half kick of all particles."""
    half = 0.5 * time_step
    for i in range(mass.size):
        for c in range(3):
            velocity[c][i] += half * moves[i] / mass[i] * force[c][i]
            momentum[c][i] += half * turns[i] * torque[c][i]


@callee
def weigh(particles, environment):
    """Begin the sum of all loads with gravity and global damping."""
    begin_sum(
        rows3(particles.force),
        rows3(particles.torque),
        rows3(particles.velocity),
        particles.mass,
        environment.gravity,
        environment.drag,
        environment.wind,
    )


@kernel
def kick(particles, time_step):
    """Second half kick of all particles."""
    last_half_kick(
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
def spin_of_momentum(particles):
    """Angular velocities of the full step, for output; prescribed ones stay."""
    for i in range(particles.mass.size):
        if particles.mobility[1, i] > 0.0:
            q = at4(particles.orientation, i)
            local = in_body(q, at(particles.angular_momentum, i))
            put(particles.angular_velocity, i, world_spin(q, local, at(particles.inertia, i)))
