"""The bond passes: loads of all bonds, breakage, and the measures of bonds for output.

Most bonds form runs: bonds of one kind whose first and second particles are consecutive, as all bonds along a belt and
all across it. A run needs no index list, and its loop is vectorised (5 ns a bond on one core against 50 ns for a
scalar list). Where a bond is missing on the way, between the rows of a grid, the run has a gap: a slot whose loads are
left out, cheaper than a run for every row of 39 bonds, 7 of them beyond the last whole vector (15 ns a bond). Bonds
outside runs are gathered into a scratch state first and then go through the same loop: one law, one compiled loop, any
network.

Runs are cut into pieces in the order of their particles, so that bonds along and across find what they share in the
first-level cache. The pieces of a chunk of particles load that chunk and the next one only, so that threads can share
out the even chunks and then the odd ones; what reaches farther, like the seam of a loop, comes last, by one thread.
"""

from __future__ import annotations

import numpy as np
from numba import types

from beltsim.solver.bond import bond_rates
from beltsim.solver.bond_tiles import TILE, add_tile, bond_tile, elastic_loads, kind_of
from beltsim.solver.jit import callee, inner, maker, pass_kernel
from beltsim.solver.ledger import BOND_BREAKAGE
from beltsim.solver.scratch import scratch_row, scratch_rows
from beltsim.solver.sharing import share
from beltsim.solver.vectors import at, at4, dot, norm, rows3, rows4, sub

PADDED = TILE + 40
"""Columns of scratch arrays: rows five cache lines off a power of two do not fight for the same places in the cache."""

BOTH = 2 * PADDED
"""The same for the first and the second particles of bonds."""


@inner
def gather(particles, bonds, numbers, scratch):
    """Copy the state of scattered bonds' particles: the first in columns 0.., the second in PADDED.."""
    for n in range(numbers.size):
        for side in range(2):
            k = bonds.first[numbers[n]] if side == 0 else bonds.second[numbers[n]]
            column = n + side * PADDED
            for row in range(3):
                scratch[row, column] = particles.position[row, k]
                scratch[3 + row, column] = particles.velocity[row, k]
                scratch[10 + row, column] = particles.angular_velocity[row, k]
            for row in range(4):
                scratch[6 + row, column] = particles.orientation[row, k]


@inner
def scatter(particles, bonds, numbers, loads):
    """Add the loads of scattered bonds to their particles, in the order of the bonds."""
    for n in range(numbers.size):
        i, j = bonds.first[numbers[n]], bonds.second[numbers[n]]
        for row in range(3):
            particles.force[row, i] += loads[row, n]
            particles.torque[row, i] += loads[3 + row, n]
            particles.force[row, j] -= loads[row, n]
            particles.torque[row, j] += loads[6 + row, n]


@inner
def record_breaks(particles, bonds, runs, kinds, strength, base, count, over, step, half):
    """Mark and record the bonds that broke in this tile; each breaks once."""
    for n in range(count):
        if over[n] != 0:
            b = runs.bond[base + n]
            bonds.whole[base + n] = 0
            bonds.intact[b] = 0
            strength.broken_step[b] = step
            strength.mode[b] = over[n]
            note_breakage(bonds.book, particles, bonds, kinds, b, base + n, half)


@inner
def note_breakage(book, particles, bonds, kinds, b, slot, half):
    """The elastic energy of bond b is lost, less what its load would still have put into it in half a step [s]."""
    if book is not None:
        i, j, kind = bonds.first[b], bonds.second[b], kind_of(kinds, None, bonds.kind[b])
        d = sub(at(particles.position, j), at(particles.position, i))
        axes, strains, loads, _, _, _ = elastic_loads(
            d, at4(particles.orientation, i), at4(particles.orientation, j), kind
        )
        relative = sub(at(particles.velocity, j), at(particles.velocity, i))
        spin_i, spin_j = at(particles.angular_velocity, i), at(particles.angular_velocity, j)
        stretch, twist = bond_rates(axes, d, relative, spin_i, spin_j)
        tension, shear, moment = loads
        power = tension * stretch[0] + dot(shear, stretch) + dot(moment, twist)
        book[BOND_BREAKAGE, slot] += energy_of(strains, loads) - half * power


@inner
def energy_of(strains, loads):
    """Elastic energy of a bond [J]."""
    stretch, chord, rotation = strains
    tension, shear, moment = loads
    return 0.5 * (tension * stretch + dot(shear, chord) + dot(moment, rotation))


@callee
def scattered_piece(r, particles, bonds, runs, kinds, limits, over, loads, half):
    """Add the loads of the scattered bonds of piece r; returns the counts of `bond_tile`."""
    base, count = runs.base[r], runs.count[r]
    numbers = runs.bond[base : base + count]
    scratch = scratch_rows(13, BOTH)
    gather(particles, bonds, numbers, scratch)
    counts = bond_tile(
        np.uint64(0),
        np.uint64(PADDED),
        np.uint64(base),
        count,
        (scratch[0], scratch[1], scratch[2]),
        (scratch[3], scratch[4], scratch[5]),
        (scratch[6], scratch[7], scratch[8], scratch[9]),
        (scratch[10], scratch[11], scratch[12]),
        kind_of(kinds, kinds.upright, runs.kind[r]),
        limits,
        bonds.whole,
        over,
        (loads[0], loads[1], loads[2], loads[3], loads[4], loads[5], loads[6], loads[7], loads[8]),
        bonds.book,
        half,
    )
    scatter(particles, bonds, numbers, loads)
    return counts


@pass_kernel(returns=types.int64)
def bond_chunk(c, particles, bonds, runs, kinds, strength, step, time_step):
    """Add the loads of the pieces of chunk c, after the last one those that reach farther than the next chunk.

    Returns how many bonds are wound up.
    """
    start, stop = runs.chunk[c], runs.base.size
    if c + 1 < runs.chunk.size:
        stop = runs.chunk[c + 1]
    position, velocity = rows3(particles.position), rows3(particles.velocity)
    orientation, spin = rows4(particles.orientation), rows3(particles.angular_velocity)
    force, torque = rows3(particles.force), rows3(particles.torque)
    loads = scratch_rows(9, PADDED)
    out = (loads[0], loads[1], loads[2], loads[3], loads[4], loads[5], loads[6], loads[7], loads[8])
    over = None if strength is None else scratch_row(TILE, np.int8)
    half, wound = 0.5 * time_step, 0
    for r in range(start, stop):
        t, base, count = runs.kind[r], runs.base[r], runs.count[r]
        limits = None
        if strength is not None:
            limits = (at4(strength.section, t), strength.strength[0, t], strength.strength[1, t])
        if runs.first[r] >= 0:
            i, j = np.uint64(runs.first[r]), np.uint64(runs.second[r])
            kind = kind_of(kinds, kinds.upright, t)
            twisted, breaking = bond_tile(
                i, j, np.uint64(base), count, position, velocity, orientation, spin, kind, limits, bonds.whole, over,
                out, bonds.book, half,
            )  # fmt: skip
            add_tile(i, j, count, out, force, torque)
        else:
            twisted, breaking = scattered_piece(r, particles, bonds, runs, kinds, limits, over, loads, half)
        wound += twisted
        if strength is not None and breaking > 0:
            record_breaks(particles, bonds, runs, kinds, strength, base, count, over, step, half)
    return wound


@inner
def in_turn(n, chunks):
    """The n-th chunk of a single thread, 0 2 1 4 3 6 5 ...: odd ones just after both their neighbours."""
    if n % 2 == 0:
        return max(n - 1, 0)
    return min(n + 1, chunks - 1)


@inner
def last_loaded(n, chunks):
    """The last chunk that the first n + 1 chunks in turn load: each loads the next one too."""
    return max(in_turn(n, chunks), in_turn(max(n - 1, 0), chunks)) + 1


@callee
def bonds_across(particles, bonds, runs, kinds, strength, step, time_step):
    """`bond_chunk` for the pieces that reach farther than the next chunk, like the seam of a loop."""
    return bond_chunk(runs.chunk.size - 1, particles, bonds, runs, kinds, strength, step, time_step)


@callee
def bond_pass(particles, bonds, runs, kinds, strength, step, time_step=0.0, team=None):
    """Add the elastic and viscous loads of all intact bonds to their particles.

    A bond whose elastic stress reaches its strength breaks: it is recorded with the step, and its loads are gone in the
    same step. `strength` is None where no bond can break.
    """
    work, chunks, wound = (particles, bonds, runs, kinds, strength, step, time_step), runs.chunk.size - 1, 0
    if team is None:
        for n in range(chunks):
            wound += bond_chunk(in_turn(n, chunks), *work)
    else:  # the even ones and then the odd ones, since each chunk loads the next one too
        wound += share(bond_chunk, 0, chunks, 2, team, work)
        wound += share(bond_chunk, 1, chunks, 2, team, work)
    bonds.wound[0] = wound + bonds_across(particles, bonds, runs, kinds, strength, step, time_step)


@maker
def bond_measures(particles, bonds, kinds):
    """Loads and strains of all bonds for output, zero for broken ones.

    Returns
    -------
    (7, m) : axial force [N, tension positive], shear force [N], bending moment [N m], twist moment [N m],
        elongation [-], bending angle [rad], whole relative rotation [rad]
    energy : elastic energy of all bonds [J]
    """
    first, second, intact = bonds.first, bonds.second, bonds.intact
    measures = np.zeros((7, first.size))
    energy = 0.0
    for b in range(first.size):
        if intact[b]:
            i, j, kind = first[b], second[b], kind_of(kinds, None, bonds.kind[b])
            d = sub(at(particles.position, j), at(particles.position, i))
            _, strains, loads, _, _, _ = elastic_loads(
                d, at4(particles.orientation, i), at4(particles.orientation, j), kind
            )
            stretch, _, rotation = strains
            tension, shear, moment = loads
            measures[0, b] = tension
            measures[1, b] = norm(shear)
            measures[2, b] = norm((0.0, moment[1], moment[2]))
            measures[3, b] = moment[0]
            measures[4, b] = stretch / kinds.rest_length[bonds.kind[b]]
            measures[5, b] = norm((0.0, rotation[1], rotation[2]))
            measures[6, b] = norm(rotation)
            energy += energy_of(strains, loads)
    return measures, energy
