"""Contacts between spheres: the pass over the whole list of near pairs, vectorised.

The law gives zeros where the overlap is zero, so pairs that do not touch need no branch: the loop runs over all listed
pairs, some 1.5 for each contact, and is still faster than a scalar one over the contacts alone.
"""

from __future__ import annotations

import numpy as np

from beltsim.solver.bonds import of, rows3
from beltsim.solver.contacts import law_of, note_point, point_loads, surface
from beltsim.solver.jit import kernel, vector_kernel
from beltsim.solver.shapes import sphere_sphere
from beltsim.solver.vectors import scaled, sub


@vector_kernel
def sphere_pairs(
    first, second, state, shapes, laws, overlaps, springs, stiffnesses, rollings, loads, book, time_step
):
    """Loads and history of all pairs.

    Parameters
    ----------
    first, second : (pairs,) uint32: signed ones would need a wrap-around check that keeps the loop scalar
    state : rows of position, velocity and angular velocity, masses, moments of inertia, and 1 or 0 for what moves
    shapes : radii and materials (uint32)
    springs, rollings : three rows each; loads : nine rows, force on the first, torque on the first and the second
    book : energy book of the pairs (see `ledger`), or None
    """
    position, velocity, spin, mass, inertia, moves = state
    radius, material = shapes
    for k in range(first.size):
        i, j = first[k], second[k]
        gap, normal = sphere_sphere(of(position, i), radius[i], of(position, j), radius[j])
        overlap = max(gap, 0.0)
        # The point halfway into the overlap, so that both arms add up to the distance of the centres.
        arms = (scaled(normal, 0.5 * overlap - radius[i]), scaled(normal, radius[j] - 0.5 * overlap))
        spins = (of(spin, i), of(spin, j))
        relative = sub(
            surface(of(velocity, i), spins[0], arms[0]), surface(of(velocity, j), spins[1], arms[1])
        )
        # What is held moves like an infinite mass; of two held ones, which may still turn, any mass does.
        held = 1.0 if moves[i] + moves[j] == 0.0 else 0.0
        inverse = (moves[i] + held) / mass[i] + moves[j] / mass[j]
        rolling_inverse = (moves[i] + held) / (inertia[i] + mass[i] * radius[i] * radius[i])
        rolling_inverse += moves[j] / (inertia[j] + mass[j] * radius[j] * radius[j])
        reduced = radius[i] * radius[j] / (radius[i] + radius[j])
        history = (of(springs, k), stiffnesses[k], of(rollings, k))
        law = law_of(laws, material[i], material[j])
        masses = 1.0 / inverse, 1.0 / rolling_inverse
        force, moment, torque_1, torque_2, new = point_loads(
            law, overlap, reduced, *masses, normal, relative, spins, arms, history, time_step
        )
        spin_12 = sub(spins[0], spins[1])
        note_point(
            book, k, law, overlap, reduced, normal, relative, spin_12, history, new, force, moment, time_step
        )
        overlaps[k] = gap
        stiffnesses[k] = new[1]
        for row in range(3):
            springs[row][k] = new[0][row]
            rollings[row][k] = new[2][row]
            loads[row][k] = force[row]
            loads[3 + row][k] = torque_1[row]
            loads[6 + row][k] = torque_2[row]


@kernel
def sphere_sphere_pass(particles, shapes, laws, contacts, time_step):
    """Contacts between spheres."""
    loads = contacts.loads
    sphere_pairs(
        contacts.first.view(np.uint32),
        contacts.second.view(np.uint32),
        (
            rows3(particles.position),
            rows3(particles.velocity),
            rows3(particles.angular_velocity),
            particles.mass,
            particles.inertia[0],
            particles.mobility[0],
        ),
        (shapes.radius, shapes.material.view(np.uint32)),
        laws,
        contacts.overlap,
        rows3(contacts.spring),
        contacts.stiffness,
        rows3(contacts.rolling),
        (loads[0], loads[1], loads[2], loads[3], loads[4], loads[5], loads[6], loads[7], loads[8]),
        contacts.book,
        time_step,
    )
