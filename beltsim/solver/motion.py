"""How parts move: prescribed, free or driven rotation about their axis, and sliding along one direction.

Parts are stepped as particles are: half a kick by the loads at the beginning, a drift with the velocities of the
middle, half a kick by the loads at the end. So both are at the same time whenever anybody looks.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from beltsim.solver.jit import callee, inner, kernel
from beltsim.solver.state import Array
from beltsim.solver.vectors import (
    across,
    add,
    at,
    at4,
    axis_z,
    dot,
    exponential,
    norm,
    plus,
    product,
    put,
    put4,
    rotate,
    scaled,
    sub,
    unit,
)

PRESCRIBED = 0
FREE = 1
CARRIED = 2  # the part stands for a cylinder particle that flies, and its slide has a mass below 0


class Amplitudes(NamedTuple):
    """Factors over total time, all tables in one; table a is start[a]:start[a + 1]."""

    start: Array  # (tables + 1,) int64
    time: Array  # s, ascending within a table
    factor: Array


class Spins(NamedTuple):
    """Rotation of each part about an axis through its centre: a cylinder's local z, a mesh's own."""

    mode: Array  # (p,) int8: PRESCRIBED, FREE or CARRIED
    rate: Array  # (p,) rad/s, of a prescribed rotation
    amplitude: Array  # (p,) int32 table for rate or torque, -1: constant
    inertia: Array  # (p,) kg m2
    friction_torque: Array  # (p,) N m, of the bearing
    torque: Array  # (p,) N m, of the drive
    axis: Array  # (3, p) unit, in the part's frame


class Slides(NamedTuple):
    """Translation of each part: with a given velocity, or along a direction under a force, a spring and a damper."""

    velocity: Array  # (3, p) m/s, where it is prescribed
    moves: Array  # (p,) 1, or 0 where the velocity is that of the surface only
    direction: Array  # (3, p) unit
    mass: Array  # (p,) kg; 0: the velocity is prescribed
    force: Array  # (p,) N
    amplitude: Array  # (p,) int32 table for velocity or force, -1: constant
    stiffness: Array  # (p,) N/m
    damping: Array  # (p,) N s/m
    offset: Array  # (p,) m, from the place where the spring is relaxed
    pressing: Array  # (3, p) N, what presses on a surface that only runs: no work is done on it


@inner
def factor_at(amplitudes, table, time):
    """Factor of a table at a time: linear between its rows, constant outside; 1 for table -1."""
    if table < 0:
        return 1.0
    first, last = amplitudes.start[table], amplitudes.start[table + 1] - 1
    if time <= amplitudes.time[first]:
        return amplitudes.factor[first]
    if time >= amplitudes.time[last]:
        return amplitudes.factor[last]
    row = first + np.searchsorted(amplitudes.time[first : last + 1], time, side="right") - 1
    share = (time - amplitudes.time[row]) / (amplitudes.time[row + 1] - amplitudes.time[row])
    return amplitudes.factor[row] + share * (amplitudes.factor[row + 1] - amplitudes.factor[row])


@inner
def with_friction(rate, torque, friction, inertia, time_step):
    """Rate after a step under a torque and dry bearing friction, which stops but never turns back."""
    rate += time_step * torque / inertia
    loss = time_step * friction / inertia
    if abs(rate) <= loss:
        return 0.0
    return rate - loss if rate > 0.0 else rate + loss


@kernel
def prescribe_parts(parts, spins, slides, amplitudes, time):
    """Give all parts whose motion is prescribed their velocities at a time."""
    for p in range(parts.radius.size):
        if spins.mode[p] == PRESCRIBED:
            axis = rotate(at4(parts.orientation, p), at(spins.axis, p))
            factor = factor_at(amplitudes, spins.amplitude[p], time)
            put(parts.angular_velocity, p, scaled(axis, spins.rate[p] * factor))
        if slides.mass[p] == 0.0:
            factor = factor_at(amplitudes, slides.amplitude[p], time)
            put(parts.velocity, p, scaled(at(slides.velocity, p), factor))


@callee
def move_parts(parts, slides, time_step):
    """Drift of all parts over one step, with the velocities of its middle."""
    for p in range(parts.radius.size):
        turn = exponential(scaled(at(parts.angular_velocity, p), time_step))
        # Of unit length, since each kick reads the rate along an axis that carries the length's error twice: without it
        # the rate of a driven roller was off by 1e-10 after 5,000 steps.
        put4(parts.orientation, p, unit(product(turn, at4(parts.orientation, p))))
        if slides.moves[p] != 0.0:
            velocity = at(parts.velocity, p)
            put(parts.position, p, plus(at(parts.position, p), time_step, velocity))
            if slides.mass[p] > 0.0:
                slides.offset[p] += time_step * dot(velocity, at(slides.direction, p))


@callee
def push_parts(parts, spins, slides, amplitudes, time, duration, first):
    """Half a kick of all parts that follow their loads: by those of the given time, over half a step.

    Dampers see the velocity of the middle of the step in both halves, the `first` (1.0, else 0.0) and the second:
    that is the trapezoidal rule, of second order and stable however strong the damper.
    """
    for p in range(parts.radius.size):
        if spins.mode[p] == FREE:
            axis = rotate(at4(parts.orientation, p), at(spins.axis, p))
            drive = spins.torque[p] * factor_at(amplitudes, spins.amplitude[p], time)
            torque = drive + dot(at(parts.torque, p), axis)
            rate = dot(at(parts.angular_velocity, p), axis)
            rate = with_friction(rate, torque, spins.friction_torque[p], spins.inertia[p], duration)
            put(parts.angular_velocity, p, scaled(axis, rate))
        if slides.mass[p] > 0.0:
            direction = at(slides.direction, p)
            speed = dot(at(parts.velocity, p), direction)
            force = slides.force[p] * factor_at(amplitudes, slides.amplitude[p], time)
            force += dot(at(parts.force, p), direction) - slides.stiffness[p] * slides.offset[p]
            damping = duration * slides.damping[p] / slides.mass[p]
            speed = speed - (1.0 - first) * damping * speed + duration * force / slides.mass[p]
            put(parts.velocity, p, scaled(direction, speed / (1.0 + first * damping)))


@inner
def add_part_work(parts, slides, work, duration):
    """Add what each part does at its present loads and velocities, over a duration [s], on all that touches it [J]."""
    for p in range(parts.radius.size):
        taken = dot(sub(at(parts.force, p), at(slides.pressing, p)), at(parts.velocity, p))
        taken += dot(at(parts.torque, p), at(parts.angular_velocity, p))
        work[p] -= duration * taken


@inner
def fastest_part(parts, slides):
    """Largest speed [m/s] at which a part comes to new places; turning about its own axis is none."""
    fastest = 0.0
    for p in range(parts.radius.size):
        speed = norm(at(parts.velocity, p)) if slides.moves[p] != 0.0 else 0.0
        spin = at(parts.angular_velocity, p)
        swing = norm(spin)
        if parts.half_length[p] > 0.0:  # no mesh, which comes to new places however it turns
            swing = norm(across(spin, axis_z(at4(parts.orientation, p))))
        if swing > 1e-9 * norm(spin):  # rounding of a spin about the axis stays far below
            speed += swing * math.hypot(parts.radius[p], parts.half_length[p])
        fastest = max(fastest, speed)
    return fastest


@inner
def sum_part_loads(parts, contacts):
    """Add the contact loads of a part list (rows are parts) to the parts."""
    for p in range(parts.radius.size):
        force, torque = at(parts.force, p), at(parts.torque, p)
        for k in range(contacts.start[p], contacts.start[p + 1]):
            loads = contacts.loads
            force = add(force, (-loads[0, k], -loads[1, k], -loads[2, k]))
            torque = add(torque, (loads[6, k], loads[7, k], loads[8, k]))
        put(parts.force, p, force)
        put(parts.torque, p, torque)
