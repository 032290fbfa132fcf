"""PEFRL, a fourth-order integrator for accuracy studies of scenes without damping and friction.

Omelyan, Mryglod and Folk 2002 (Computer Physics Communications 146, 188): five drifts and four kicks a step, stable
up to some 1.2 of the step that velocity Verlet can take.
It holds for forces that depend on positions only, so scenes with damping or friction are refused (`beltsim.stepsize`).
The free rotation of each drift must be of fourth order too: the symplectic splitting of `integration.turn_freely` is of
second order, and three of them with the weights of Yoshida (1990, Physics Letters A 150, 262) are of fourth.
"""

from __future__ import annotations

from beltsim.solver.integration import in_body, inverse, kick, turn_freely, weigh, world_spin
from beltsim.solver.jit import callee, inner, kernel
from beltsim.solver.steps import DONE, LISTS_STALE, LOST, TOO_FAST, Clock, find_forces
from beltsim.solver.vectors import add, at, norm, of, of4, put, rows3, rows4, scaled, sub

XI = 0.1786178958448091
LAMBDA = -0.2123418310626054
CHI = -0.06626458266981849
OUTER = 1.0 / (2.0 - 2.0 ** (1.0 / 3.0))
INNER = 1.0 - 2.0 * OUTER


@callee
def turn_to_fourth_order(orientation, momentum, spin, inertia, turns, time_step):
    """Free rotation of all particles over a drift."""
    for i in range(turns.size):
        if turns[i] > 0.0:
            q, pliancy = of4(orientation, i), inverse(of(inertia, i))
            local = in_body(q, of(momentum, i))
            q, local = turn_freely(q, local, pliancy, OUTER * time_step)
            q, local = turn_freely(q, local, pliancy, INNER * time_step)
            q, local = turn_freely(q, local, pliancy, OUTER * time_step)
            w = world_spin(q, local, pliancy)
            for c in range(3):
                spin[c][i] = w[c]
            for c in range(4):
                orientation[c][i] = q[c]


@inner
def move_on(position, velocity, listed, time_step, reach, cap):
    """Drift of all centres; returns the counts of `integration.translate`."""
    far = fast = lost = 0
    for i in range(position.shape[1]):
        step = scaled(at(velocity, i), time_step)
        place = add(at(position, i), step)
        put(position, i, place)
        moved = norm(sub(place, at(listed, i)))
        far += moved > reach
        fast += norm(step) > cap
        lost += not moved < 1e150
    return far, fast, lost


@callee
def drift(particles, environment, time_step, reach, cap):
    """Free motion of all particles; returns the counts of `integration.translate`."""
    turn_to_fourth_order(
        rows4(particles.orientation),
        rows3(particles.angular_momentum),
        rows3(particles.angular_velocity),
        rows3(particles.inertia),
        particles.mobility[1],
        time_step,
    )
    return move_on(particles.position, particles.velocity, environment.notes.listed, time_step, reach, cap)


@callee
def kick_by(particles, time_step):
    """Push of all particles by the present loads over a time."""
    # `kick` is half a step of Verlet.
    kick(particles, 2.0 * time_step)


@kernel
def advance_reference(
    particles, shapes, laws, belt, strength, lists, parts, drives, given, environment, clock, steps
):
    """Up to `steps` steps of PEFRL; parameters and result as `steps.advance`. Parts stay where they are."""
    dt = clock.time_step
    if steps == 0:
        weigh(particles, environment)
        find_forces(
            particles, shapes, laws, belt, strength, lists, parts, drives, given, environment, clock, False
        )
    for n in range(steps):
        done = 0.0
        far = fast = lost = 0
        for stage in range(5):
            share = XI if stage == 0 or stage == 4 else (CHI if stage != 2 else 1.0 - 2.0 * (CHI + XI))
            far, fast, lost = drift(
                particles, environment, share * dt, 0.5 * clock.skin - clock.cap, clock.cap
            )
            if lost > 0:
                return n, LOST
            done += share
            if stage < 4:
                now = Clock(dt, clock.start + done * dt, clock.step + n, clock.skin, clock.cap)
                weigh(particles, environment)
                find_forces(
                    particles,
                    shapes,
                    laws,
                    belt,
                    strength,
                    lists,
                    parts,
                    drives,
                    given,
                    environment,
                    now,
                    False,
                )
                push = 0.5 - LAMBDA if stage == 0 or stage == 3 else LAMBDA
                kick_by(particles, push * dt)
        if fast > 0:
            return n + 1, TOO_FAST
        if far > 0:
            return n + 1, LISTS_STALE
    return steps, DONE
