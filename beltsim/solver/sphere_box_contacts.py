"""The pass over contacts of spheres with rounded boxes, in stages over chunks of spheres.

First the overlap of all listed pairs, most of which are apart; then which box carries each sphere, and the few spheres
that lie on several; then the law of the pairs that carry alone, in a tile, and what it finds goes to its places. Stages
with arithmetic are vectorised.

The bonded boxes of a belt are one surface (`belt_surface`): a sphere that rolls over a flat belt feels no seam, while
one wedged between a belt's wings touches both.
"""

from __future__ import annotations

import math

import numpy as np

from beltsim.solver.belt_surface import inherit, leads, load_surfaces
from beltsim.solver.contacts import NONE, about_end, forget, law_of, noted_loads, surface
from beltsim.solver.jit import callee, inner, pass_kernel, vector_kernel
from beltsim.solver.scratch import clear, scratch_row, scratch_rows
from beltsim.solver.shapes import box_gap, sphere_box
from beltsim.solver.tiles import columns_for, three
from beltsim.solver.vectors import add, cross, of, of4, rows3, rows4, scaled, sub

CHUNK = 1024
"""Particles whose pairs are done at a time; fixed, so that results depend on no count of threads."""

PAIRS = 128
"""Pairs that carry, at a time: 41 rows of state and loads are 41 kB."""

# Rows of the scratch space that holds the pairs that carry side by side: state, history and, from LOADS on, loads.
APART = 0  # from the box's centre to the sphere's, m
VELOCITY = 3  # of the sphere against the box, m/s
SPIN_1, SPIN_2 = 6, 9  # rad/s
ORIENTATION = 12  # of the box
CORE = 16  # as Shapes.core
RADII = 19  # of the sphere, of the box's edges, m
MASSES = 21  # kg; infinite for what is held, unless both are
INERTIAS = 23  # least moments of inertia, kg m2
SPRING, ROLLING, STIFFNESS = 25, 28, 31  # as in Contacts
LOADS = 32  # as Contacts.loads
ROWS = 41


@vector_kernel
def find_overlaps(first, second, begin, count, position, orientation, core, radius, overlaps):
    """Overlaps of `count` pairs from pair `begin` (uint64) on; `first`, `second` are uint32, the others rows."""
    for n in range(count):
        k = begin + np.uint64(n)
        i, j = first[k], second[k]
        reach = radius[i] + radius[j]
        overlaps[k] = reach - box_gap(of(position, i), of(position, j), of4(orientation, j), of(core, j))


@callee
def find_carriers(contacts, begin, end):
    """Number of pairs begin to end that carry, noted from there on; what ends hands its history on or loses it."""
    overlaps, stiffnesses = contacts.overlap, contacts.stiffness
    carriers, ended = contacts.carriers[begin:end], contacts.carriers[begin:end][::-1]
    count = ends = 0
    for k in range(begin, end):
        if overlaps[k] > 0.0 and leads(contacts, k):
            carriers[count] = k
            count += 1
        elif stiffnesses[k] != 0.0:
            ended[ends] = k
            ends += 1
    for n in range(count):
        if stiffnesses[carriers[n]] <= 0.0:
            stiffnesses[carriers[n]] = 0.0
            inherit(contacts, carriers[n])
    for n in range(ends):
        forget(contacts, ended[n])
    return count


@inner
def gather(particles, shapes, contacts, carriers, count, tile):
    """Copy the state and the history of the pairs that carry side by side."""
    for n in range(count):
        k = carriers[n]
        i, j = contacts.first[k], contacts.second[k]
        mass, inertia, moves = particles.mass, particles.inertia, particles.mobility[0]
        for c in range(3):
            tile[APART + c, n] = particles.position[c, i] - particles.position[c, j]
            tile[VELOCITY + c, n] = particles.velocity[c, i] - particles.velocity[c, j]
            tile[SPIN_1 + c, n] = particles.angular_velocity[c, i]
            tile[SPIN_2 + c, n] = particles.angular_velocity[c, j]
            tile[CORE + c, n] = shapes.core[c, j]
            tile[SPRING + c, n] = contacts.spring[c, k]
            tile[ROLLING + c, n] = contacts.rolling[c, k]
        for c in range(4):
            tile[ORIENTATION + c, n] = particles.orientation[c, j]
        tile[RADII, n], tile[RADII + 1, n] = shapes.radius[i], shapes.radius[j]
        # What is held moves like an infinite mass; of two held ones any mass does.
        held = moves[i] + moves[j] == 0.0
        tile[MASSES, n] = mass[i] if moves[i] > 0.0 or held else math.inf
        tile[MASSES + 1, n] = mass[j] if moves[j] > 0.0 else math.inf
        tile[INERTIAS, n] = inertia[0, i]
        tile[INERTIAS + 1, n] = min(inertia[0, j], min(inertia[1, j], inertia[2, j]))
        tile[STIFFNESS, n] = contacts.stiffness[k]


@vector_kernel
def load_spheres(
    apart, velocity, spin_1, spin_2, orientation, core, radii, masses, inertias, spring, rolling, stiffness, loads,
    laws, material, pairs, carriers, book, time_step, count,
):  # fmt: skip
    """Loads and new history of the pairs in the scratch space, whose rows are the first thirteen arguments.

    `material` (n,) uint32 of the particles, `pairs` first and second particles of the list, `carriers` (count,) the
    numbers of the pairs in the list; `book` is its energy book (see `ledger`), or None.
    """
    for n in range(count):
        k, d, radius = carriers[n], of(apart, n), radii[0][n]
        overlap, normal = sphere_box(d, radius, NONE, of4(orientation, n), of(core, n), radii[1][n])
        arm = scaled(normal, 0.5 * overlap - radius)
        arms, spins = (arm, add(d, arm)), (of(spin_1, n), of(spin_2, n))
        relative = sub(surface(of(velocity, n), spins[0], arms[0]), cross(spins[1], arms[1]))
        inverse = 1.0 / masses[0][n] + 1.0 / masses[1][n]
        turning = 1.0 / about_end(masses[0][n], inertias[0][n], arms[0])
        turning += 1.0 / about_end(masses[1][n], inertias[1][n], arms[1])
        history = (of(spring, n), stiffness[n], of(rolling, n))
        law = law_of(laws, material[pairs[0][k]], material[pairs[1][k]])
        # A box is a flat face for the sphere's radius.
        force, _, torque_1, torque_2, new = noted_loads(
            book, k, law, overlap, radius, 1.0 / inverse, 1.0 / turning,
            normal, relative, relative, spins, arms, history, time_step,
        )  # fmt: skip
        stiffness[n] = new[1]
        for c in range(3):
            spring[c][n] = new[0][c]
            rolling[c][n] = new[2][c]
            loads[c][n] = force[c]
            loads[3 + c][n] = torque_1[c]
            loads[6 + c][n] = torque_2[c]


@inner
def scatter(tile, count, carriers, contacts):
    """Put loads and history of the pairs in the scratch space to their places."""
    for n in range(count):
        k = carriers[n]
        contacts.stiffness[k] = tile[STIFFNESS, n]
        for c in range(3):
            contacts.spring[c, k] = tile[SPRING + c, n]
            contacts.rolling[c, k] = tile[ROLLING + c, n]
        for c in range(9):
            contacts.loads[c, k] = tile[LOADS + c, n]


@callee
def sphere_box_chunk(particles, shapes, laws, contacts, time_step, begin, end):
    """Contacts of the pairs begin to end, all those of some spheres; writes to nothing else."""
    first, second = contacts.first.view(np.uint32), contacts.second.view(np.uint32)
    find_overlaps(
        first,
        second,
        np.uint64(begin),
        end - begin,
        rows3(particles.position),
        rows4(particles.orientation),
        rows3(shapes.core),
        shapes.radius,
        contacts.overlap,
    )
    count = find_carriers(contacts, begin, end)
    count = load_surfaces(particles, shapes, laws, contacts, contacts.carriers[begin:end], count, time_step)
    tile, carriers = scratch_rows(ROWS, PAIRS), scratch_row(PAIRS, np.uint32)
    clear(tile, carriers)
    loads = (*three(tile, LOADS), *three(tile, LOADS + 3), *three(tile, LOADS + 6))
    for done in range(0, count, PAIRS):
        now = min(PAIRS, count - done)
        for n in range(now):
            carriers[n] = contacts.carriers[begin + done + n]
        gather(particles, shapes, contacts, carriers, now, tile)
        load_spheres(
            three(tile, APART), three(tile, VELOCITY), three(tile, SPIN_1), three(tile, SPIN_2),
            (tile[ORIENTATION], *three(tile, ORIENTATION + 1)), three(tile, CORE), (tile[RADII], tile[RADII + 1]),
            (tile[MASSES], tile[MASSES + 1]), (tile[INERTIAS], tile[INERTIAS + 1]), three(tile, SPRING),
            three(tile, ROLLING), tile[STIFFNESS], loads, laws, shapes.material.view(np.uint32), (first, second),
            carriers, contacts.book, time_step, columns_for(now, contacts.book),
        )  # fmt: skip
        scatter(tile, now, carriers, contacts)


@pass_kernel
def sphere_box_pass(particles, shapes, laws, contacts, time_step):
    """Contacts of spheres with rounded boxes."""
    rows = contacts.start.size - 1
    for row in range(0, rows, CHUNK):
        begin, end = contacts.start[row], contacts.start[min(row + CHUNK, rows)]
        if end > begin:
            sphere_box_chunk(particles, shapes, laws, contacts, time_step, begin, end)
