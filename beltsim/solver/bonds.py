"""The bond passes: loads of every bond, breakage, and the loads' measures for output."""

from __future__ import annotations

import numpy as np

from beltsim.solver.bond import bond_damping, bond_loads, bond_reaction, bond_stress
from beltsim.solver.jit import inner, kernel
from beltsim.solver.vectors import add, at, at4, dot, norm, product, sub

BROKEN_IN_TENSION = 1
BROKEN_IN_SHEAR = 2


@inner
def bond_elastic(position, orientation, i, j, kinds, t):
    """Distance vector and elastic loads of the bond of kind t between particles i and j."""
    d = sub(at(position, j), at(position, i))
    triad_i = product(at4(orientation, i), at4(kinds.triad_first, t))
    triad_j = product(at4(orientation, j), at4(kinds.triad_second, t))
    stiffness, angular_stiffness = at(kinds.stiffness, t), at(kinds.angular_stiffness, t)
    return d, bond_loads(d, triad_i, triad_j, kinds.rest_length[t], stiffness, angular_stiffness)


@inner
def put_loads(loads, k, force, torque_first, torque_second):
    """Store the loads of pair k; the force on the second is the opposite of that on the first."""
    for row in range(3):
        loads[row, k] = force[row]
        loads[3 + row, k] = torque_first[row]
        loads[6 + row, k] = torque_second[row]


@kernel
def bond_pass(particles, bonds, kinds):
    """Elastic and viscous loads of all intact bonds into `bonds.loads`."""
    position, velocity = particles.position, particles.velocity
    orientation, spin = particles.orientation, particles.angular_velocity
    first, second, kind, intact, loads = bonds.first, bonds.second, bonds.kind, bonds.intact, bonds.loads
    damping, angular_damping = kinds.damping, kinds.angular_damping
    for b in range(first.size):
        if intact[b]:
            i, j, t = first[b], second[b], kind[b]
            d, elastic = bond_elastic(position, orientation, i, j, kinds, t)
            mid, _, _, force, _, torque = elastic
            relative = sub(at(velocity, j), at(velocity, i))
            viscous, viscous_torque = bond_damping(
                mid, d, relative, at(spin, i), at(spin, j), at(damping, t), at(angular_damping, t)
            )
            f, torque_i, torque_j = bond_reaction(mid, d, add(force, viscous), add(torque, viscous_torque))
            put_loads(loads, b, f, torque_i, torque_j)


@kernel
def breakage_pass(particles, bonds, kinds, strength, step):
    """Break every bond whose elastic stress reaches its strength; its loads are gone in the same step."""
    position, orientation = particles.position, particles.orientation
    first, second, kind, intact, loads = bonds.first, bonds.second, bonds.kind, bonds.intact, bonds.loads
    section, limit = strength.section, strength.strength
    broken_step, mode = strength.broken_step, strength.mode
    for b in range(first.size):
        if intact[b]:
            t = kind[b]
            _, elastic = bond_elastic(position, orientation, first[b], second[b], kinds, t)
            _, _, _, force, moment, _ = elastic
            tension, shear = bond_stress(force, moment, at4(section, t))
            if tension >= limit[0, t] or shear >= limit[1, t]:
                intact[b] = 0
                broken_step[b] = step
                mode[b] = BROKEN_IN_TENSION if tension >= limit[0, t] else BROKEN_IN_SHEAR
                put_loads(loads, b, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@kernel
def bond_measures(particles, bonds, kinds):
    """Loads and strains of all bonds for output, zero for broken ones.

    Returns
    -------
    (6, m) : axial force [N, tension positive], shear force [N], bending moment [N m], twist moment [N m],
        elongation [-], bending angle [rad]
    energy : elastic energy of all bonds [J]
    """
    first, second, kind, intact = bonds.first, bonds.second, bonds.kind, bonds.intact
    measures = np.zeros((6, first.size))
    energy = 0.0
    for b in range(first.size):
        if intact[b]:
            t = kind[b]
            _, elastic = bond_elastic(
                particles.position, particles.orientation, first[b], second[b], kinds, t
            )
            _, e, rotation, force, moment, _ = elastic
            measures[0, b] = force[0]
            measures[1, b] = norm((0.0, force[1], force[2]))
            measures[2, b] = norm((0.0, moment[1], moment[2]))
            measures[3, b] = moment[0]
            measures[4, b] = e[0] / kinds.rest_length[t]
            measures[5, b] = norm((0.0, rotation[1], rotation[2]))
            energy += 0.5 * (dot(e, force) + dot(rotation, moment))
    return measures, energy
