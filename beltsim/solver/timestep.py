"""The stable time step: mass-scaled Gershgorin rows over all bonds, with damping and contacts.

For M x'' + C x' + K x = 0 every row sum of |K_ab| / sqrt(M_a M_b) bounds omega^2, and those of C bound 2 zeta omega. On
belt grids the bound is 0.91 to 1.00 of the exact limit; the usual sqrt(m/k) of one bond is 9 to 12 % too large there.
Velocity Verlet with the velocities of the half step needs dt < 2/omega (sqrt(1 + zeta^2) - zeta).
"""

from __future__ import annotations

import math

import numpy as np

from beltsim.solver.jit import inner, kernel, maker
from beltsim.solver.vectors import at, at4, axis_x, axis_y, axis_z, norm, sub

IMPACT_STEPS = 20  # steps in a Hertz impact: fewer give a wrong restitution


@inner
def strain_rows(triad, half_length, side, rows):
    """Derivatives of the six bond strains by the six local motions of one particle, into `rows` (6, 6)."""
    axes = (axis_x(triad), axis_y(triad), axis_z(triad))
    for c in range(3):
        for k in range(3):
            rows[k, c] = side * axes[k][c]
            rows[k, 3 + c] = 0.0
            rows[3 + k, c] = 0.0
            rows[3 + k, 3 + c] = side * axes[k][c]
        # Shear is the motion across less the turning of the bond: half the length times both rotations.
        rows[1, 3 + c] = -half_length * axes[2][c]
        rows[2, 3 + c] = half_length * axes[1][c]


@inner
def masses_of(mass, inertia, i, out):
    """Masses of the six motions of particle i."""
    for c in range(3):
        out[c] = mass[i]
        out[3 + c] = inertia[c, i]


@maker
def bond_row_sums(particles, bonds, kinds, stiffness, angular_stiffness, tension):
    """Gershgorin row sums (6, n) of all particles: omega^2 from stiffness, or 2 zeta omega from damping.

    Parameters
    ----------
    stiffness, angular_stiffness : (3, kinds) of `kinds`, or its damping
    tension : add the bonds' present axial force over their length to the shear stiffness
    """
    mass, inertia = particles.mass, particles.inertia
    sums = np.zeros((6, mass.size))
    # Of one particle's own block the bonds are summed before their size is taken: shear and rotation cancel there
    # between opposite bonds, which is 5 % of the step on belt grids.
    own = np.zeros((6, 6, mass.size))
    rows = np.zeros((2, 6, 6))
    masses = np.zeros((2, 6))
    values = np.zeros(6)
    for b in range(bonds.first.size):
        i, j, t = bonds.first[b], bonds.second[b], bonds.kind[b]
        length = kinds.rest_length[t]
        strain_rows(at4(kinds.triad_first, t), 0.5 * length, -1.0, rows[0])
        strain_rows(at4(kinds.triad_second, t), 0.5 * length, 1.0, rows[1])
        masses_of(mass, inertia, i, masses[0])
        masses_of(mass, inertia, j, masses[1])
        for k in range(3):
            values[k] = stiffness[k, t]
            values[3 + k] = angular_stiffness[k, t]
        if tension:
            d = norm(sub(at(particles.position, j), at(particles.position, i)))
            pull = max(0.0, stiffness[0, t] * (d - length)) / max(d, length)
            values[1] += pull
            values[2] += pull
        for a in range(12):
            particle = i if a < 6 else j
            for c in range(12):
                entry = 0.0
                for k in range(6):
                    entry += values[k] * rows[a // 6, k, a % 6] * rows[c // 6, k, c % 6]
                entry /= math.sqrt(masses[a // 6, a % 6] * masses[c // 6, c % 6])
                if a // 6 == c // 6:
                    own[a % 6, c % 6, particle] += entry
                else:
                    sums[a % 6, particle] += abs(entry)
    for i in range(mass.size):
        for a in range(6):
            for c in range(6):
                sums[a, i] += abs(own[a, c, i])
    return sums


def damped_limit(frequency_squared: float, rate: float) -> float:
    """Largest stable step [s] for bounds on omega^2 [1/s2] and on 2 zeta omega [1/s]."""
    if frequency_squared <= 0.0 and rate <= 0.0:
        return math.inf
    # 2/omega (sqrt(1 + z^2) - z) with z = rate / (2 omega), written so that omega = 0 needs no division.
    return 4.0 / (math.sqrt(4.0 * frequency_squared + rate * rate) + rate)


def impact_overlap(radius: float, modulus: float, mass: float, speed: float) -> float:
    """Largest overlap [m] of a Hertz impact: (5 m v^2 / 4 K)^(2/5), K = 4/3 E* sqrt(R*)."""
    return (15.0 * mass * speed * speed / (16.0 * modulus * math.sqrt(radius))) ** 0.4


def impact_duration(radius: float, modulus: float, mass: float, speed: float) -> float:
    """Duration [s] of a Hertz impact: 2.9432 overlap / speed."""
    return math.inf if speed <= 0.0 else 2.9432 * impact_overlap(radius, modulus, mass, speed) / speed


@kernel
def contact_row_sums(particles, shapes, first, second, stiffness, ratio, with_parts, faces, sums):
    """Add the present contacts' share to each particle's bound on omega^2.

    A contact of stiffness k_n, k_t = `ratio` k_n at an arm a adds at most (k_n + k_t (1 + m a^2 / I)) / m for itself
    and the geometric mean of both partners' shares for the coupling. Parts do not move in response. Of `faces`, which
    press beside a box's centre too, k_n has the arm as well.
    """
    mass, inertia = particles.mass, particles.inertia
    for k in range(first.size):
        tangential = stiffness[k]
        if tangential <= 0.0:
            continue
        i = first[k]
        own = own_share(mass, inertia, shapes, i, tangential, ratio, faces)
        sums[i] += own
        if not with_parts:
            j = second[k]
            other = own_share(mass, inertia, shapes, j, tangential, ratio, faces)
            mixed = math.sqrt(own * other)
            sums[i] += mixed
            sums[j] += other + mixed


@inner
def own_share(mass, inertia, shapes, i, tangential, ratio, faces):
    """Share of one contact in the bound of particle i, [1/s2].

    No arm is longer than the bounding radius; the springs of a face spread over it, so that a third of its square acts.
    """
    least = min(inertia[0, i], min(inertia[1, i], inertia[2, i]))
    lever = mass[i] * shapes.bounding[i] ** 2 / least
    if faces:
        return tangential * (1.0 / ratio + 1.0) * (1.0 + lever / 3.0) / mass[i]
    return tangential * (1.0 / ratio + 1.0 + lever) / mass[i]


__all__ = [
    "IMPACT_STEPS",
    "bond_row_sums",
    "contact_row_sums",
    "damped_limit",
    "impact_duration",
    "impact_overlap",
]
