"""Contacts between spheres, in four loops over a few pairs at a time that stay in the first-level cache.

    gaps of all listed pairs, vectorised                    2.1 ns a listed pair
    the pairs that touch, put together without a branch     0.2 ns a listed pair
    their state copied side by side                         7 ns a contact
    the law, vectorised                                     4 ns a contact
    their loads added to the particles                      6 ns a contact

A branch on touching that is guessed wrong costs 8 ns a pair, and one vectorised loop that fetches each particle's state
by index 20 ns a contact, with 11 more for adding up.
"""

from __future__ import annotations

import numpy as np
from numba import types
from numba.extending import overload

from beltsim.solver.contacts import NONE, law_of, noted_loads, surface
from beltsim.solver.jit import INLINE, callee, inner, only_with, pass_kernel, vector_kernel
from beltsim.solver.ledger import note_end
from beltsim.solver.scratch import clear, scratch_row, scratch_rows
from beltsim.solver.shapes import sphere_sphere
from beltsim.solver.sharing import share
from beltsim.solver.tiles import columns_for, three
from beltsim.solver.vectors import across, cross, dot, norm, of, plus, rows3, scaled, sub

PAIRS = 128
"""Pairs at a time: 33 rows of state and loads are 33 kB."""

PLACES = PAIRS + 1
"""Where their numbers go: what does not touch is written to the next place too."""

# Rows of the scratch space that holds some touching pairs side by side: state, history and, from LOADS on, loads.
APART = 0  # from the second centre to the first, m
VELOCITY = 3  # of the first against the second, m/s
SPIN_1, SPIN_2 = 6, 9  # rad/s
SPRING = 12  # as Contacts.spring
ROLLING = 15  # as Contacts.rolling
RADIUS_1, RADIUS_2 = 18, 19  # m
MASSES = 20  # and 21: the reduced mass [kg] is their ratio
STIFFNESS = 22  # as Contacts.stiffness
INERTIA = 23  # reduced moment of inertia about the contact, kg m2
LOADS = 24  # as Contacts.loads
ROWS = 33


@vector_kernel
def find_gaps(first, second, position, radius, base, count, overlaps):
    """Overlaps of `count` pairs from pair `base` on, negative where two spheres are apart.

    They stay in the scratch space: kept for each pair they were a tenth of all that S2 fetched from memory.
    """
    for n in range(count):
        k = base + np.uint64(n)
        i, j = first[k], second[k]
        overlaps[np.uint64(n)] = radius[i] + radius[j] - norm(sub(of(position, i), of(position, j)))


@vector_kernel
def list_touching(overlaps, base, count, touching):
    """Numbers of the pairs that touch; returns how many they are."""
    found = np.uint64(0)
    for n in range(count):
        k = base + np.uint64(n)
        touching[found] = k
        found += np.uint64(1) if overlaps[np.uint64(n)] > 0.0 else np.uint64(0)
    return found


@vector_kernel
def forget_parted(overlaps, stiffnesses, base, count):
    """No tangential stiffness: no history."""
    for n in range(count):
        k = base + np.uint64(n)
        stiffnesses[k] = stiffnesses[k] if overlaps[np.uint64(n)] > 0.0 else 0.0


@inner
def note_parted(book, overlaps, stiffnesses, base, count):
    """Close the books of the pairs that have parted since the step before."""
    if book is not None:
        for n in range(count):
            k = base + np.uint64(n)
            if stiffnesses[k] > 0.0 and overlaps[n] <= 0.0:
                note_end(book, k)


@inner
def gather(particles, radius, contacts, pairs, touching, count, tile):
    """Copy the state and the history of touching pairs side by side."""
    position, velocity = rows3(particles.position), rows3(particles.velocity)
    spin, mass, moves = rows3(particles.angular_velocity), particles.mass, particles.mobility[0]
    spring, stiffness = rows3(contacts.spring), contacts.stiffness
    first, second = pairs
    for n in range(count):
        k = touching[n]
        i, j = first[k], second[k]
        for c in range(3):
            tile[APART + c, n] = position[c][i] - position[c][j]
            tile[VELOCITY + c, n] = velocity[c][i] - velocity[c][j]
            tile[SPIN_1 + c, n] = spin[c][i]
            tile[SPIN_2 + c, n] = spin[c][j]
            tile[SPRING + c, n] = spring[c][k]
        tile[RADIUS_1, n], tile[RADIUS_2, n] = radius[i], radius[j]
        # What is held moves like an infinite mass; of two held ones, which may still turn, any mass does.
        held = 1.0 if moves[i] + moves[j] == 0.0 else 0.0
        tile[MASSES, n] = mass[i] * mass[j]
        tile[MASSES + 1, n] = mass[i] * moves[j] + mass[j] * (moves[i] + held)
        tile[STIFFNESS, n] = stiffness[k]


@inner
def gather_rolling(particles, radius, rolling, pairs, touching, count, tile):
    """The same of what resists rolling, where anything does."""
    if rolling is not None:
        mass, inertia, moves = particles.mass, particles.inertia[0], particles.mobility[0]
        for n in range(count):
            k = touching[n]
            i, j = pairs[0][k], pairs[1][k]
            held = 1.0 if moves[i] + moves[j] == 0.0 else 0.0
            inverse = (moves[i] + held) / (inertia[i] + mass[i] * radius[i] * radius[i])
            inverse += moves[j] / (inertia[j] + mass[j] * radius[j] * radius[j])
            tile[INERTIA, n] = 1.0 / inverse
            for c in range(3):
                tile[ROLLING + c, n] = rolling[c, k]


@inner
def law_between(law, laws, material, pairs, k):
    """The law of all pairs if there is one, else that of the materials of pair k."""
    if law is None:
        return law_of(laws, material[pairs[0][k]], material[pairs[1][k]])
    return law


@inner
def remember(rolls, rows, n, moment):
    """Store rolling moment n, unless `rolls` is None."""
    if rolls is not None:
        for c in range(3):
            rows[c][n] = moment[c]


@inner
def slip_amid(apart, normal, gap, velocity, spins, radius_1, radius_2, time_step):
    """Velocity [m/s] of two spheres' surfaces past each other in the middle of the step, of which the velocities are.

    With the places of its end, the spring took up what half a step of the approach is across the normal as a pair
    turns: an energy of first order in the step.
    """
    half, parting = 0.5 * time_step, dot(velocity, normal)
    share = half * (1.0 / norm(apart)) if gap < radius_1 + radius_2 else 0.0
    normal = plus(scaled(normal, 1.0 + share * parting), -share, velocity)
    gap = 0.5 * (gap + half * parting)
    turning = plus(scaled(spins[0], radius_1 - gap), radius_2 - gap, spins[1])
    return across(sub(velocity, cross(turning, normal)), normal)


@vector_kernel
def touching_loads(
    apart, velocity, spin_1, spin_2, radii, masses, inertia, spring, stiffness, rolling, loads, law, laws,
    material, pairs, touching, rolls, book, time_step, count,
):  # fmt: skip
    """Loads and new history of the pairs in the scratch space, whose rows are the first eleven arguments.

    Parameters
    ----------
    law : the law of all pairs, or None: `laws`, by the materials (n,) uint32 of the particles
    pairs : first and second particles of the list, uint32
    touching : (count,) uint64 numbers of the pairs in the list
    rolls : None where no contact resists rolling
    book : energy book of the list (see `ledger`), or None
    """
    for n in range(count):
        radius_1, radius_2 = radii[0][n], radii[1][n]
        gap, normal = sphere_sphere(of(apart, n), radius_1, NONE, radius_2)
        overlap = max(gap, 0.0)
        # The point halfway into the overlap, so that both arms add up to the distance of the centres.
        arms = (scaled(normal, 0.5 * overlap - radius_1), scaled(normal, radius_2 - 0.5 * overlap))
        spins = (of(spin_1, n), of(spin_2, n))
        relative = sub(surface(of(velocity, n), spins[0], arms[0]), cross(spins[1], arms[1]))
        slip = slip_amid(of(apart, n), normal, gap, of(velocity, n), spins, radius_1, radius_2, time_step)
        reduced = radius_1 * radius_2 / (radius_1 + radius_2)
        before = stiffness[n]
        keep = 1.0 if before > 0.0 else 0.0
        history = (scaled(of(spring, n), keep), before, only_with(rolls, scaled(of(rolling, n), keep)))
        pair_law = law_between(law, laws, material, pairs, touching[n])
        force, _, torque_1, torque_2, new = noted_loads(
            book, touching[n], pair_law, overlap, reduced, masses[0][n] / masses[1][n], inertia[n],
            normal, relative, slip, spins, arms, history, time_step,
        )  # fmt: skip
        stiffness[n] = new[1]
        remember(rolls, rolling, n, new[2])
        for c in range(3):
            spring[c][n] = new[0][c]
            loads[c][n] = force[c]
            loads[3 + c][n] = torque_1[c]
            loads[6 + c][n] = torque_2[c]


@inner
def scatter(tile, count, touching, pairs, contacts, force, torque, crossings, chunk):
    """Add the loads of a tile to its particles, or to the loads that cross to other chunks; store its history."""
    spring, stiffness = rows3(contacts.spring), contacts.stiffness
    loads, loaded = crossings.loads, crossings.loaded
    crossed = crossings.place[chunk] + crossings.count[chunk]
    low, own = own_stretches(crossings, chunk)
    first, second = pairs
    for n in range(count):
        k = touching[n]
        i, j = first[k], second[k]
        stiffness[k] = tile[STIFFNESS, n]
        for c in range(3):
            spring[c][k] = tile[SPRING + c, n]
            force[c][i] += tile[LOADS + c, n]
            torque[c][i] += tile[LOADS + 3 + c, n]
        if (np.uint32(j - low[0]) < own[0]) | (np.uint32(j - low[1]) < own[1]):
            for c in range(3):
                force[c][j] -= tile[LOADS + c, n]
                torque[c][j] += tile[LOADS + 6 + c, n]
        else:
            loaded[crossed] = j
            for c in range(3):
                loads[crossed, c] = -tile[LOADS + c, n]
                loads[crossed, 3 + c] = tile[LOADS + 6 + c, n]
            crossed += 1
    crossings.count[chunk] = crossed - crossings.place[chunk]


@inner
def own_stretches(crossings, chunk):
    """First particle and number of particles, unsigned, of both stretches that a chunk owns."""
    low, high = crossings.start[:, chunk], crossings.start[:, chunk + 1]
    sizes = np.uint32(high[0] - low[0]), np.uint32(high[1] - low[1])
    return (np.uint32(low[0]), np.uint32(low[1])), sizes


@inner
def scatter_rolling(rolling, touching, count, tile):
    """Store the rolling moments, where there are any."""
    if rolling is not None:
        for n in range(count):
            for c in range(3):
                rolling[c, touching[n]] = tile[ROLLING + c, n]


@pass_kernel
def sphere_piece(piece, particles, shapes, laws, listed, time_step):
    """Contacts of one piece of the pairs; see `lists.ListedSpheres`."""
    contacts, crossings, material = listed
    chunk = crossings.owner[piece]
    tile, touching = scratch_rows(ROWS, PAIRS), scratch_row(PLACES, np.uint64)
    overlaps = scratch_row(PAIRS, np.float64)
    clear(tile, touching)
    law, stop = common_law(laws, material), crossings.pair[1, piece]
    for begin in range(crossings.pair[0, piece], stop, PAIRS):
        count = min(PAIRS, stop - begin)
        sphere_tile(
            particles, shapes, laws, law, contacts, crossings, chunk, begin, count, time_step,
            tile, touching, overlaps,
        )  # fmt: skip


@pass_kernel
def sphere_chunk(chunk, particles, shapes, laws, listed, time_step):
    """Contacts in the rows of one chunk of particles, one thread's work."""
    crossings = listed.crossings
    for piece in range(crossings.piece[chunk], crossings.piece[chunk + 1]):
        sphere_piece(piece, particles, shapes, laws, listed, time_step)


@inner
def sphere_tile(
    particles, shapes, laws, law, contacts, crossings, chunk, begin, count, time_step, tile, touching, overlaps
):  # fmt: skip
    """Contacts of `count` pairs from pair `begin` on, `PAIRS` at most, by way of the scratch space."""
    pairs = (contacts.first.view(np.uint32), contacts.second.view(np.uint32))
    position, radius, material = rows3(particles.position), shapes.radius, shapes.material.view(np.uint32)
    stiffnesses, book, base = contacts.stiffness, contacts.book, np.uint64(begin)
    find_gaps(pairs[0], pairs[1], position, radius, base, count, overlaps)
    found = np.int64(list_touching(overlaps, base, count, touching))
    note_parted(book, overlaps, stiffnesses, base, count)
    forget_parted(overlaps, stiffnesses, base, count)
    gather(particles, radius, contacts, pairs, touching, found, tile)
    gather_rolling(particles, radius, contacts.rolling, pairs, touching, found, tile)
    touching_loads(
        three(tile, APART), three(tile, VELOCITY), three(tile, SPIN_1), three(tile, SPIN_2),
        (tile[RADIUS_1], tile[RADIUS_2]), (tile[MASSES], tile[MASSES + 1]), tile[INERTIA],
        three(tile, SPRING), tile[STIFFNESS], three(tile, ROLLING),
        (*three(tile, LOADS), *three(tile, LOADS + 3), *three(tile, LOADS + 6)), law, laws, material, pairs,
        touching, contacts.rolling, book, time_step, columns_for(found, book),
    )  # fmt: skip
    scatter(
        tile, found, touching, pairs, contacts, rows3(particles.force), rows3(particles.torque), crossings, chunk
    )  # fmt: skip
    scatter_rolling(contacts.rolling, touching, found, tile)


@callee
def begin_crossing(crossings):
    """Nothing has crossed yet in this step."""
    for chunk in range(crossings.count.size):
        crossings.count[chunk] = 0


@callee
def take_crossings(particles, crossings):
    """Add the loads that crossed from one chunk to another; by one thread, since they are few."""
    force, torque = rows3(particles.force), rows3(particles.torque)
    loads, loaded = crossings.loads, crossings.loaded
    for chunk in range(crossings.count.size):
        begin = crossings.place[chunk]
        for row in range(begin, begin + crossings.count[chunk]):
            i = loaded[row]
            for c in range(3):
                force[c][i] += loads[row, c]
                torque[c][i] += loads[row, 3 + c]


@callee
def sphere_sphere_pass(particles, shapes, laws, listed, time_step, team):
    """Contacts between spheres; see `lists.ListedSpheres`. `team`: threads, None for one."""
    crossings, work = listed.crossings, (particles, shapes, laws, listed, time_step)
    begin_crossing(crossings)
    if team is None:
        for piece in range(crossings.owner.size):
            sphere_piece(piece, *work)
    else:  # each adds to its own particles, the rest crosses over afterwards
        share(sphere_chunk, 0, crossings.count.size, 1, team, work)
    take_crossings(particles, crossings)


def common_law(laws, material):
    """The law of all pairs of spheres that are of one material, None for several."""
    return None if material is None else law_of(laws, material, material)


@overload(common_law, jit_options=INLINE)
def _common_law(laws, material):  # noqa: ARG001 - types, not values
    if isinstance(material, types.NoneType):
        return lambda laws, material: None  # noqa: ARG005
    return lambda laws, material: law_of(laws, material, material)
