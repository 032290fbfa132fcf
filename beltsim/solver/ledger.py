"""What the steps note down when an energy book is kept; without one nothing of it is compiled.

Work over a step is the half sum of the loads at its ends times the velocities of its middle: just what the two half
kicks of velocity Verlet give to the particles, so that a loss has no remainder of first order in the step. Springs are
state functions and are only evaluated. All book arguments are None in scenes without a book.
"""

from __future__ import annotations

from typing import NamedTuple

from beltsim.solver.jit import inner
from beltsim.solver.motion import FREE, PRESCRIBED, factor_at
from beltsim.solver.state import Array
from beltsim.solver.vectors import (
    across,
    add,
    at,
    at4,
    axis_z,
    dot,
    norm,
    plus,
    put,
    rotate,
    scaled,
    sub,
)

# Rows of the book of a list of contacts, a column for each pair.
VISCOUS = 0  # normal viscous force of the step before, N
HELD = 1  # to 3: tangential force of the step before, N
TURNED = 4  # to 6: rolling moment of the step before, N m
NORMAL, TANGENTIAL, ROLLING = 7, 8, 9  # energies of the springs, J
# What the next half kick takes, if the contact ends before, J
LATE_NORMAL, LATE_TANGENTIAL, LATE_ROLLING = 10, 11, 12
OVERLAP = 13  # of the step before, m
CARRIED = 14  # rows before this one are the history of a pair
LOST_DAMPING, LOST_FRICTION, LOST_ROLLING, LOST_SPRING = 14, 15, 16, 17  # J, since the list was made
CONTACT_ROWS = 18

# Rows of the book of bonds: viscous force, half its couple and viscous moment of the step before, then losses in J.
BOND_DAMPING, BOND_BREAKAGE = 9, 10
BOND_ROWS = 11

# Rows of the totals, J.
GLOBAL_DAMPING, BEARINGS, DRIVES, FORCES = 0, 1, 2, 3
TOTAL_ROWS = 4


class Ledger(NamedTuple):
    """Work that belongs to no pair."""

    total: Array  # (TOTAL_ROWS,) J
    spin: Array  # (3, p) rad/s of parts before their present push
    velocity: Array  # (3, p) m/s


# --- contacts ------------------------------------------------------------------------------------------------------


@inner
def stored(elastic, stiffness, overlap):
    """Energy [J] of a force with one share in the overlap d and one in d^(3/2), from its value and its slope at d.

    With F = a d^(3/2) + b d and S = F': U = 2/5 a d^(5/2) + b d^2 / 2 = d (0.7 F - 0.2 S d).
    """
    return overlap * (0.7 * elastic - 0.2 * stiffness * overlap)


@inner
def note_normal(book, k, energy, viscous, approach, time_step, overlap=None):
    """Damping of pair k along its normal: viscous force [N] and rate of the overlap [m/s]; `energy` of its spring.

    The force of the step before acted in the first half of this one, where the overlap grew at another rate, that of
    the geometry of then: with the overlap [m] given that half is what both halves grew less the second.
    """
    if book is not None:
        second = 0.5 * time_step * approach
        first = second if overlap is None else overlap - book[OVERLAP, k] - second
        book[LOST_DAMPING, k] += book[VISCOUS, k] * first + viscous * second
        book[LATE_NORMAL, k] = viscous * second
        book[VISCOUS, k] = viscous
        book[OVERLAP, k] = 0.0 if overlap is None else overlap
        book[NORMAL, k] = energy


@inner
def noted_at(book, row, k):
    """The vector of pair k that was noted in a row and the next two in the step before."""
    return book[row, k], book[row + 1, k], book[row + 2, k]


@inner
def turned_into(v, normal):
    """Vector v turned into the plane across a normal with its length kept, as friction's history is."""
    flat = across(v, normal)
    length = norm(flat)
    return scaled(flat, norm(v) / length) if length > 0.0 else flat


@inner
def energy_of(force, stiffness):
    """F^2 / 2 k [J]."""
    return 0.5 * dot(force, force) / stiffness if stiffness > 0.0 else 0.0


@inner
def note_friction(book, k, normal, velocity, time_step, before, after, force, bound):
    """Tangential work of pair k in a step: its spring, its stiffness's change, its damper or its sliding.

    `before`, `after` are spring force [N] and stiffness [N/m]; `force` is the whole tangential force. A spring that is
    stiffened with its force kept, or softened with its deflection kept, loses F^2 / 2k^2 |dk|.
    """
    if book is not None:
        travel = scaled(across(velocity, normal), time_step)
        work = -0.5 * dot(add(turned_into(noted_at(book, HELD, k), normal), force), travel)
        spring, old, new = turned_into(before[0], normal), before[1], after[1]
        kept, ratio = spring, old / new if new > old else 1.0
        if new < old:
            kept, ratio = scaled(spring, new / old), new / old
        slides = norm(force) >= bound * (1.0 - 1e-12)
        energy = energy_of(after[0], new)
        loss = book[TANGENTIAL, k] * (1.0 - ratio) - 0.5 * dot(sub(spring, kept), travel)
        rest = work - (energy - book[TANGENTIAL, k]) - loss
        book[LOST_FRICTION if slides else LOST_DAMPING, k] += rest
        book[LOST_SPRING, k] += loss
        book[LATE_TANGENTIAL, k] = -0.5 * dot(force, travel)
        book[TANGENTIAL, k] = energy
        for row in range(3):
            book[HELD + row, k] = force[row]


@inner
def note_rolling(book, k, normal, spin, time_step, moment, spring, stiffness):
    """Work of the rolling resistance of pair k: whole moment and that of its spring [N m], angular stiffness [N m]."""
    if book is not None:
        turn = scaled(across(spin, normal), time_step)
        energy = energy_of(spring, stiffness)
        work = -0.5 * dot(add(noted_at(book, TURNED, k), moment), turn)
        book[LOST_ROLLING, k] += work - (energy - book[ROLLING, k])
        book[LATE_ROLLING, k] = -0.5 * dot(moment, turn)
        book[ROLLING, k] = energy
        for row in range(3):
            book[TURNED + row, k] = moment[row]


@inner
def note_end(book, k):
    """Pair k parts: what its springs still held is lost."""
    if book is not None:
        book[LOST_DAMPING, k] += book[LATE_NORMAL, k]
        book[LOST_FRICTION, k] += book[LATE_TANGENTIAL, k]
        book[LOST_SPRING, k] += book[TANGENTIAL, k]
        book[LOST_ROLLING, k] += book[ROLLING, k] + book[LATE_ROLLING, k]
        for row in range(CARRIED):
            book[row, k] = 0.0


@inner
def hand_on(book, k, other):
    """Pair k takes the history of another pair of its list over."""
    if book is not None:
        for row in range(CARRIED):
            book[row, k] = book[row, other]
            book[row, other] = 0.0


@inner
def carry_book(new, old, k, before, sign):
    """The history of pair `before` of an old list goes to pair k of the new one; -1: with its partners exchanged."""
    if new is not None:
        for row in range(CARRIED):
            new[row, k] = old[row, before]
        for row in range(HELD, TURNED + 3):
            new[row, k] *= sign


# --- particles and parts -------------------------------------------------------------------------------------------


@inner
def note_first_half(ledger, particles, parts, spins, slides, given, amplitudes, environment, time, time_step):
    """Work of the loads at the beginning of a step; velocities are those of its middle, loads still the old ones."""
    if ledger is not None:
        half, drag, wind = 0.5 * time_step, environment.drag, environment.wind
        mass, mobility = particles.mass, particles.mobility
        if drag > 0.0:
            for i in range(mass.size):
                v = at(particles.velocity, i)
                before = plus(v, -time_step * mobility[0, i] / mass[i], at(particles.force, i))
                ledger.total[GLOBAL_DAMPING] += half * mass[i] * drag * dot(sub(before, wind), v)
        note_works(ledger, particles, parts, spins, slides, given, amplitudes, environment, time, half)


@inner
def note_second_half(
    ledger, particles, parts, spins, slides, given, amplitudes, environment, time, time_step
):
    """Work of the loads at the end of a step, with the velocities of its middle; the loads are the new ones."""
    if ledger is not None:
        half, drag, wind = 0.5 * time_step, environment.drag, environment.wind
        mass = particles.mass
        if drag > 0.0:
            for i in range(mass.size):
                v = at(particles.velocity, i)
                ledger.total[GLOBAL_DAMPING] += half * mass[i] * drag * dot(sub(v, wind), v)
        note_works(ledger, particles, parts, spins, slides, given, amplitudes, environment, time, half)


@inner
def note_works(ledger, particles, parts, spins, slides, given, amplitudes, environment, time, duration):
    """Work of drives and *FORCE loads at the present loads and velocities over a duration [s]."""
    note_holding(ledger, particles, duration)
    note_given(ledger, particles, given, amplitudes, time, duration)
    note_prescribed(ledger, parts, spins, slides, duration)
    note_pivots(ledger, particles, environment.pivots, duration)


@inner
def note_holding(ledger, particles, duration):
    """What holds particles to their prescribed motion works against all their loads."""
    mobility = particles.mobility
    for i in range(particles.mass.size):
        if mobility[0, i] == 0.0:
            ledger.total[DRIVES] -= duration * dot(at(particles.force, i), at(particles.velocity, i))
        if mobility[1, i] == 0.0:
            ledger.total[DRIVES] -= duration * dot(at(particles.torque, i), at(particles.angular_velocity, i))


@inner
def note_given(ledger, particles, given, amplitudes, time, duration):
    """Work of *FORCE loads."""
    if given is not None:
        for r in range(given.particle.size):
            i = given.particle[r]
            power = dot(at(given.load, r), at(particles.velocity, i))
            power += dot(at(given.load[3:], r), at(particles.angular_velocity, i))
            ledger.total[FORCES] += duration * factor_at(amplitudes, given.amplitude[r], time) * power


@inner
def note_pivots(ledger, particles, pivots, duration):
    """Work of the drives and losses in the bearings of particles that spin about their axis."""
    if pivots is not None:
        for h in range(pivots.particle.size):
            i = pivots.particle[h]
            rate = dot(at(particles.angular_velocity, i), axis_z(at4(particles.orientation, i)))
            ledger.total[DRIVES] += duration * pivots.driving[h] * rate
            ledger.total[BEARINGS] += duration * pivots.resisting[h] * rate


@inner
def note_prescribed(ledger, parts, spins, slides, duration):
    """Work of the drives of parts whose motion is prescribed, on all that touches them."""
    for p in range(parts.radius.size):
        if spins.mode[p] == PRESCRIBED:
            ledger.total[DRIVES] -= duration * dot(at(parts.torque, p), at(parts.angular_velocity, p))
        if slides.mass[p] == 0.0:
            load = sub(at(parts.force, p), at(slides.pressing, p))
            ledger.total[DRIVES] -= duration * dot(load, at(parts.velocity, p))


@inner
def note_before_push(ledger, parts):
    """Keep the velocities of parts before they are pushed."""
    if ledger is not None:
        for p in range(parts.radius.size):
            put(ledger.spin, p, at(parts.angular_velocity, p))
            put(ledger.velocity, p, at(parts.velocity, p))


@inner
def note_push(ledger, parts, spins, slides, amplitudes, time, duration):
    """Work of drives and bearings in a push of the parts that follow their loads, by those of a time.

    What of the impulse is not found in the motion, friction and dampers took.
    """
    if ledger is not None:
        for p in range(parts.radius.size):
            if spins.mode[p] == FREE:
                axis = rotate(at4(parts.orientation, p), at(spins.axis, p))
                old, new = dot(at(ledger.spin, p), axis), dot(at(parts.angular_velocity, p), axis)
                drive = spins.torque[p] * factor_at(amplitudes, spins.amplitude[p], time)
                impulse = duration * (drive + dot(at(parts.torque, p), axis))
                mean = 0.5 * (old + new)
                ledger.total[DRIVES] += duration * drive * mean
                ledger.total[BEARINGS] += (impulse - spins.inertia[p] * (new - old)) * mean
            if slides.mass[p] > 0.0:
                direction = at(slides.direction, p)
                old, new = dot(at(ledger.velocity, p), direction), dot(at(parts.velocity, p), direction)
                pull = slides.force[p] * factor_at(amplitudes, slides.amplitude[p], time)
                load = pull + dot(at(parts.force, p), direction) - slides.stiffness[p] * slides.offset[p]
                mean = 0.5 * (old + new)
                ledger.total[DRIVES] += duration * pull * mean
                ledger.total[BEARINGS] += (duration * load - slides.mass[p] * (new - old)) * mean
