"""Particles that are led: with a prescribed velocity, or held so that they only spin about their local z.

Both are ordinary particles to everything else: the led have no mobility and get their velocities from here, the held
keep of all torques what turns them about their axis, which stays where it is.
"""

from __future__ import annotations

from typing import NamedTuple

from beltsim.solver.jit import kernel
from beltsim.solver.motion import factor_at
from beltsim.solver.state import Array
from beltsim.solver.vectors import at, at4, axis_z, dot, exponential, product, put, put4, scaled


class Guided(NamedTuple):
    """Particles with a prescribed velocity; row h leads particle[h]."""

    particle: Array  # (h,) int32
    velocity: Array  # (3, h) m/s
    spin: Array  # (3, h) rad/s
    amplitude: Array  # (h,) int32 table of both, -1: constant


class Pivots(NamedTuple):
    """Particles that are held by their centre and axis and spin freely or under a torque; row h holds particle[h]."""

    particle: Array  # (h,) int32
    friction_torque: Array  # (h,) N m, of the bearing
    torque: Array  # (h,) N m, of the drive
    amplitude: Array  # (h,) int32 table of the torque, -1: constant
    resisting: Array  # (h,) N m, what the bearing holds against now
    driving: Array  # (h,) N m, what the drive gives now


@kernel
def guide(particles, guided, amplitudes, time):
    """Give led particles their velocities at a time."""
    for h in range(guided.particle.size):
        factor = factor_at(amplitudes, guided.amplitude[h], time)
        put(particles.velocity, guided.particle[h], scaled(at(guided.velocity, h), factor))
        put(particles.angular_velocity, guided.particle[h], scaled(at(guided.spin, h), factor))


@kernel
def turn_guided(particles, guided, amplitudes, time, time_step):
    """Turn led particles over a step with the spin of its middle, at `time`; they carry no momentum to turn them."""
    guide(particles, guided, amplitudes, time)
    for h in range(guided.particle.size):
        i = guided.particle[h]
        turn = exponential(scaled(at(particles.angular_velocity, i), time_step))
        put4(particles.orientation, i, product(turn, at4(particles.orientation, i)))


@kernel
def hold_axes(particles, pivots, amplitudes, time, time_step):
    """Replace the torques on held particles by what turns them about their axis: loads, drive and bearing friction.

    The friction stops them within a step but never turns them back: it is at most what brings them to rest in one
    step. At the start, where the step is 0, it holds them or acts against their spin.
    """
    if pivots is not None:
        for h in range(pivots.particle.size):
            i = pivots.particle[h]
            axis = axis_z(at4(particles.orientation, i))
            driving = pivots.torque[h] * factor_at(amplitudes, pivots.amplitude[h], time)
            torque = dot(at(particles.torque, i), axis) + driving
            momentum, bound = dot(at(particles.angular_momentum, i), axis), pivots.friction_torque[h]
            stopping = torque + momentum / time_step if time_step > 0.0 else torque
            if time_step == 0.0 and momentum != 0.0:
                stopping = bound if momentum > 0.0 else -bound
            resisting = min(max(stopping, -bound), bound)
            put(particles.torque, i, scaled(axis, torque - resisting))
            pivots.resisting[h], pivots.driving[h] = resisting, driving
