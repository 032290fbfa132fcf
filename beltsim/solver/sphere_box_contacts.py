"""The pass over contacts of spheres with rounded boxes, in stages over chunks of spheres.

First the overlap of all listed pairs, most of which are apart; then which box carries each sphere; then the law of the
pairs that carry, in a tile, and what it finds goes to its places. Stages with arithmetic are vectorised.

The bonded boxes of a belt are one surface. They overlap, so a sphere near a seam lies on two or four of them. Only a
box that the sphere overlaps more deeply than its bonded neighbours carries it, and the history is handed on: a sphere
that rolls over a flat belt feels no seam, since the deepest one keeps force and normal continuous there (weighting all
boxes by their overlap dips by several per cent beside each seam), while one wedged between a belt's wings still touches
both.
"""

from __future__ import annotations

import numpy as np

from beltsim.solver.bonds import of, of4, rows3, rows4
from beltsim.solver.contacts import forget, law_of, note_point, point_loads, put_loads, surface
from beltsim.solver.jit import inner, kernel, vector_kernel
from beltsim.solver.ledger import hand_on
from beltsim.solver.shapes import box_gap, sphere_box
from beltsim.solver.vectors import add, at, dot, put, scaled, sub

CHUNK = 1024
"""Particles whose pairs are done at a time; fixed, so that results depend on no count of threads."""

FORCE, TORQUE_1, TORQUE_2, SPRING, ROLLING, STIFFNESS = 0, 3, 6, 9, 12, 15  # rows of the tile
TILE_ROWS = 16


@vector_kernel
def find_overlaps(first, second, begin, count, position, orientation, core, radius, overlaps):
    """Overlaps of `count` pairs from pair `begin` (uint64) on; `first`, `second` are uint32, the others rows."""
    for n in range(count):
        k = begin + np.uint64(n)
        i, j = first[k], second[k]
        reach = radius[i] + radius[j]
        overlaps[k] = reach - box_gap(of(position, i), of(position, j), of4(orientation, j), of(core, j))


@inner
def is_deepest(contacts, k):
    """Whether pair k touches and no bonded neighbour of its box overlaps more; equals go to the lower pair."""
    overlap = contacts.overlap[k]
    if overlap <= 0.0:
        return False
    for n in range(4):
        other = contacts.beside[n, k]
        if other >= 0:
            rival = contacts.overlap[other]
            if rival > overlap or (rival == overlap and other < k):
                return False
    return True


@inner
def inherit(contacts, k):
    """Hand the history of a bonded neighbour that carries no more on to pair k, which begins to carry."""
    for n in range(4):
        other = contacts.beside[n, k]
        if other >= 0 and contacts.stiffness[other] > 0.0 and not is_deepest(contacts, other):
            contacts.stiffness[k] = contacts.stiffness[other]
            put(contacts.spring, k, at(contacts.spring, other))
            put(contacts.rolling, k, at(contacts.rolling, other))
            hand_on(contacts.book, k, other)
            return


@inner
def find_carriers(contacts, begin, end, carriers):
    """Number of pairs begin to end that carry, put into `carriers`; what ends hands its history on or loses it."""
    overlaps, stiffnesses = contacts.overlap, contacts.stiffness
    ended = np.empty(end - begin, np.uint32)
    count = ends = 0
    for k in range(begin, end):
        if overlaps[k] > 0.0 and is_deepest(contacts, k):
            carriers[count] = k
            count += 1
        elif stiffnesses[k] > 0.0:
            ended[ends] = k
            ends += 1
    for n in range(count):
        if stiffnesses[carriers[n]] == 0.0:
            inherit(contacts, carriers[n])
    for n in range(ends):
        forget(contacts, ended[n])
    return count


@vector_kernel
def load_spheres(carriers, count, first, second, state, shapes, laws, history, book, time_step, tile):
    """Loads and new history of the pairs that carry, into the tile.

    Parameters
    ----------
    state : rows of position, velocity, orientation and angular velocity, masses, rows of the moments of inertia, and
        1 or 0 for what moves
    shapes : rows of the cores, radii and materials (uint32)
    history : rows of the springs and rolling moments, and stiffnesses, of all pairs
    """
    position, velocity, orientation, spin, mass, inertia, moves = state
    core, radius, material = shapes
    springs, rollings, stiffnesses = history
    for n in range(count):
        k = carriers[n]
        i, j = first[k], second[k]
        centre, box_centre = of(position, i), of(position, j)
        overlap, normal = sphere_box(
            centre, radius[i], box_centre, of4(orientation, j), of(core, j), radius[j]
        )
        arm = scaled(normal, 0.5 * overlap - radius[i])
        arms = (arm, sub(add(centre, arm), box_centre))
        spins = (of(spin, i), of(spin, j))
        relative = sub(
            surface(of(velocity, i), spins[0], arms[0]), surface(of(velocity, j), spins[1], arms[1])
        )
        # What is held moves like an infinite mass; of two held ones any does.
        held = 1.0 if moves[i] + moves[j] == 0.0 else 0.0
        inverse = (moves[i] + held) / mass[i] + moves[j] / mass[j]
        least = min(inertia[0][j], min(inertia[1][j], inertia[2][j]))
        turning = (moves[i] + held) / (inertia[0][i] + mass[i] * dot(arms[0], arms[0]))
        turning += moves[j] / (least + mass[j] * dot(arms[1], arms[1]))
        masses = 1.0 / inverse, 1.0 / turning
        before = (of(springs, k), stiffnesses[k], of(rollings, k))
        law = law_of(laws, material[i], material[j])
        # A box is a flat face for the sphere's radius.
        force, moment, torque_i, torque_j, after = point_loads(
            law, overlap, radius[i], *masses, normal, relative, spins, arms, before, time_step
        )
        rolling = sub(spins[0], spins[1])
        note_point(
            book,
            k,
            law,
            overlap,
            radius[i],
            normal,
            relative,
            rolling,
            before,
            after,
            force,
            moment,
            time_step,
        )
        tile[STIFFNESS][n] = after[1]
        for row in range(3):
            tile[FORCE + row][n] = force[row]
            tile[TORQUE_1 + row][n] = torque_i[row]
            tile[TORQUE_2 + row][n] = torque_j[row]
            tile[SPRING + row][n] = after[0][row]
            tile[ROLLING + row][n] = after[2][row]


@inner
def sixteen(a):
    """The rows of a tile."""
    return (
        a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9], a[10], a[11], a[12], a[13], a[14], a[15],
    )  # fmt: skip


@inner
def sphere_box_chunk(particles, shapes, laws, contacts, time_step, begin, end):
    """Contacts of the pairs begin to end, all those of some spheres; writes to nothing else."""
    first, second = contacts.first.view(np.uint32), contacts.second.view(np.uint32)
    position, orientation = rows3(particles.position), rows4(particles.orientation)
    core, radius = rows3(shapes.core), shapes.radius
    find_overlaps(
        first,
        second,
        np.uint64(begin),
        end - begin,
        position,
        orientation,
        core,
        radius,
        contacts.overlap,
    )
    carriers = np.empty(end - begin, np.uint32)
    count = find_carriers(contacts, begin, end, carriers)
    tile = np.empty((TILE_ROWS, count))
    load_spheres(
        carriers,
        count,
        first,
        second,
        (
            position,
            rows3(particles.velocity),
            orientation,
            rows3(particles.angular_velocity),
            particles.mass,
            rows3(particles.inertia),
            particles.mobility[0],
        ),
        (core, radius, shapes.material.view(np.uint32)),
        laws,
        (rows3(contacts.spring), rows3(contacts.rolling), contacts.stiffness),
        contacts.book,
        time_step,
        sixteen(tile),
    )
    for n in range(count):
        k = carriers[n]
        contacts.stiffness[k] = tile[STIFFNESS, n]
        put(contacts.spring, k, at(tile[SPRING:], n))
        put(contacts.rolling, k, at(tile[ROLLING:], n))
        put_loads(contacts.loads, k, at(tile, n), at(tile[TORQUE_1:], n), at(tile[TORQUE_2:], n))


@kernel
def sphere_box_pass(particles, shapes, laws, contacts, time_step):
    """Contacts of spheres with rounded boxes."""
    rows = contacts.start.size - 1
    for row in range(0, rows, CHUNK):
        begin, end = contacts.start[row], contacts.start[min(row + CHUNK, rows)]
        if end > begin:
            sphere_box_chunk(particles, shapes, laws, contacts, time_step, begin, end)
