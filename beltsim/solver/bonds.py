"""The bond passes: loads of all bonds, breakage, and the measures of bonds for output.

Bonds are sorted so that most of them form runs: consecutive bonds of one kind whose first and second particles are
consecutive too, as in every row and every column of a belt. A run needs no index list, and its loop is vectorised (7 ns
a bond on one core against 50 ns for the scalar list). Bonds outside runs are gathered into a scratch state first and
then go through the same loop: one law, one compiled loop, any network.
"""

from __future__ import annotations

import numpy as np

from beltsim.solver.bond import (
    bond_damping,
    bond_loads,
    bond_rates,
    bond_reaction,
    bond_stress,
    to_world,
)
from beltsim.solver.jit import callee, inner, kernel, vector_kernel
from beltsim.solver.ledger import BOND_BREAKAGE, BOND_DAMPING
from beltsim.solver.vectors import add, at, at4, cross, dot, norm, product, scaled, sub

TILE = 256
"""Bonds whose loads are held at a time: 18 kB, so that they stay in the first-level cache."""

WOUND = 3.1
"""Relative rotation [rad] of a bond, 178 degrees, at which a run stops: beyond 180 the moment would change its sign."""

BROKEN_IN_TENSION = 1
BROKEN_IN_SHEAR = 2


@inner
def rows3(a):
    """The three rows of an array (3, n)."""
    return a[0], a[1], a[2]


@inner
def rows4(a):
    """The four rows of an array (4, n)."""
    return a[0], a[1], a[2], a[3]


@inner
def of(rows, k):
    """Vector k of three rows."""
    return rows[0][k], rows[1][k], rows[2][k]


@inner
def of4(rows, k):
    """Quaternion k of four rows."""
    return rows[0][k], rows[1][k], rows[2][k], rows[3][k]


@inner
def kind_of(kinds, t):
    """Everything that bonds of kind t share."""
    return (
        kinds.rest_length[t],
        at4(kinds.triad_first, t),
        at4(kinds.triad_second, t),
        at(kinds.stiffness, t),
        at(kinds.angular_stiffness, t),
        at(kinds.damping, t),
        at(kinds.angular_damping, t),
    )


@inner
def elastic_loads(d, orientation_i, orientation_j, kind):
    """Elastic loads of a bond of a kind between two particles a vector d apart (see `bond.bond_loads`)."""
    length, triad_first, triad_second, stiffness, angular_stiffness, _, _ = kind
    triad_i, triad_j = product(orientation_i, triad_first), product(orientation_j, triad_second)
    return bond_loads(d, triad_i, triad_j, length, stiffness, angular_stiffness)


@vector_kernel
def bond_tile(
    first,
    second,
    base,
    count,
    position,
    velocity,
    orientation,
    spin,
    kind,
    limits,
    intact,
    over,
    loads,
    book,
    half,
):
    """Loads of `count` bonds between consecutive particles, into the first columns of `loads`.

    Parameters
    ----------
    first, second, base : uint64, the first bond's particles and its own number
    position, velocity, orientation, spin : rows of the state
    kind : see `kind_of`
    limits : (section, tensile strength, shear strength), or None for bonds that cannot break
    intact, over : (bonds,) int8 and (TILE,) int8 for breakable bonds, else None; `over` gets the mode of a new break
    loads : nine rows (TILE,): force on the first particle, torques on the first and on the second
    book : energy book of all bonds (see `ledger`), or None
    half : half a step [s]

    Returns how many bonds are turned almost all the way round (`WOUND`).
    """
    wound = 0
    for n in range(count):
        i, j = first + np.uint64(n), second + np.uint64(n)
        d = sub(of(position, j), of(position, i))
        mid, _, rotation, force, moment, pull, torque = elastic_loads(
            d, of4(orientation, i), of4(orientation, j), kind
        )
        relative = sub(of(velocity, j), of(velocity, i))
        viscous, viscous_torque = bond_damping(mid, d, relative, of(spin, i), of(spin, j), kind[5], kind[6])
        f, torque_i, torque_j = bond_reaction(mid, d, add(pull, viscous), add(torque, viscous_torque))
        keep = 1.0
        if limits is not None:
            section, tensile, shear = limits
            tension, slide = bond_stress(force, moment, section)
            mode = BROKEN_IN_TENSION if tension >= tensile else (BROKEN_IN_SHEAR if slide >= shear else 0)
            over[n] = mode
            keep = 1.0 if mode == 0 and intact[base + np.uint64(n)] != 0 else 0.0
        if book is not None:
            pulled = scaled(to_world(mid, viscous), keep)
            half_couple = scaled(cross(d, pulled), 0.5)
            twisted = scaled(to_world(mid, viscous_torque), keep)
            both, apart = add(of(spin, i), of(spin, j)), sub(of(spin, j), of(spin, i))
            b = base + np.uint64(n)
            loss = 0.0
            for row in range(3):
                loss += (book[row, b] + pulled[row]) * relative[row]
                loss -= (book[3 + row, b] + half_couple[row]) * both[row]
                loss += (book[6 + row, b] + twisted[row]) * apart[row]
                book[row, b] = pulled[row]
                book[3 + row, b] = half_couple[row]
                book[6 + row, b] = twisted[row]
            book[BOND_DAMPING, b] += half * loss
        wound += 1 if keep * dot(rotation, rotation) > WOUND * WOUND else 0
        for row in range(3):
            loads[row][n] = keep * f[row]
            loads[3 + row][n] = keep * torque_i[row]
            loads[6 + row][n] = keep * torque_j[row]
    return wound


@vector_kernel
def add_tile(first, second, count, loads, force, torque):
    """Add the loads of `bond_tile` to consecutive particles; the second gets the opposite force."""
    for n in range(count):
        i = first + np.uint64(n)
        for row in range(3):
            force[row][i] += loads[row][n]
            torque[row][i] += loads[3 + row][n]
    for n in range(count):
        j = second + np.uint64(n)
        for row in range(3):
            force[row][j] -= loads[row][n]
            torque[row][j] += loads[6 + row][n]


@inner
def gather(particles, bonds, base, count, scratch):
    """Copy the state of scattered bonds' particles: first ones to columns 0.., second ones to TILE.. of the scratch."""
    for n in range(count):
        for side in range(2):
            k = bonds.first[base + n] if side == 0 else bonds.second[base + n]
            column = n + side * TILE
            for row in range(3):
                scratch[row, column] = particles.position[row, k]
                scratch[3 + row, column] = particles.velocity[row, k]
                scratch[10 + row, column] = particles.angular_velocity[row, k]
            for row in range(4):
                scratch[6 + row, column] = particles.orientation[row, k]


@inner
def scatter(particles, bonds, base, count, loads):
    """Add the loads of scattered bonds to their particles, in the order of the bonds."""
    for n in range(count):
        i, j = bonds.first[base + n], bonds.second[base + n]
        for row in range(3):
            particles.force[row, i] += loads[row, n]
            particles.torque[row, i] += loads[3 + row, n]
            particles.force[row, j] -= loads[row, n]
            particles.torque[row, j] += loads[6 + row, n]


@inner
def record_breaks(particles, bonds, kinds, strength, base, count, over, step, half):
    """Mark and record the bonds that broke in this tile; each breaks once."""
    for n in range(count):
        b = base + n
        if over[n] != 0 and bonds.intact[b] != 0:
            bonds.intact[b] = 0
            strength.broken_step[b] = step
            strength.mode[b] = over[n]
            note_breakage(bonds.book, particles, bonds, kinds, b, half)


@inner
def note_breakage(book, particles, bonds, kinds, b, half):
    """The elastic energy of bond b is lost, less what its load would still have put into it in half a step [s]."""
    if book is not None:
        i, j, kind = bonds.first[b], bonds.second[b], kind_of(kinds, bonds.kind[b])
        d = sub(at(particles.position, j), at(particles.position, i))
        mid, e, rotation, force, moment, _, _ = elastic_loads(
            d, at4(particles.orientation, i), at4(particles.orientation, j), kind
        )
        relative = sub(at(particles.velocity, j), at(particles.velocity, i))
        spin_i, spin_j = at(particles.angular_velocity, i), at(particles.angular_velocity, j)
        stretch, twist = bond_rates(mid, d, relative, spin_i, spin_j)
        energy = 0.5 * (dot(e, force) + dot(rotation, moment))
        book[BOND_BREAKAGE, b] += energy - half * (dot(force, stretch) + dot(moment, twist))


@callee
def bond_pass(particles, bonds, runs, kinds, strength, step, time_step=0.0):
    """Add the elastic and viscous loads of all intact bonds to their particles.

    A bond whose elastic stress reaches its strength breaks: it is recorded with the step, and its loads are gone in the
    same step. `strength` is None where no bond can break.
    """
    position, velocity = rows3(particles.position), rows3(particles.velocity)
    orientation, spin = rows4(particles.orientation), rows3(particles.angular_velocity)
    force, torque = rows3(particles.force), rows3(particles.torque)
    loads, scratch, over = bonds.loads, bonds.scratch, bonds.over
    out = (loads[0], loads[1], loads[2], loads[3], loads[4], loads[5], loads[6], loads[7], loads[8])
    near, moving = (scratch[0], scratch[1], scratch[2]), (scratch[3], scratch[4], scratch[5])
    turned = (scratch[6], scratch[7], scratch[8], scratch[9])
    turning = (scratch[10], scratch[11], scratch[12])
    bonds.wound[0] = 0
    book, half = bonds.book, 0.5 * time_step
    for r in range(runs.base.size):
        t = runs.kind[r]
        kind = kind_of(kinds, t)
        limits = None
        if strength is not None:
            limits = (at4(strength.section, t), strength.strength[0, t], strength.strength[1, t])
        for start in range(0, runs.count[r], TILE):
            count = min(TILE, runs.count[r] - start)
            base = runs.base[r] + start
            if runs.first[r] >= 0:
                i, j = np.uint64(runs.first[r] + start), np.uint64(runs.second[r] + start)
                bonds.wound[0] += bond_tile(
                    i, j, np.uint64(base), count, position, velocity, orientation, spin, kind, limits,
                    None if strength is None else bonds.intact, None if strength is None else over, out, book, half,
                )  # fmt: skip
                add_tile(i, j, count, out, force, torque)
            else:
                gather(particles, bonds, base, count, scratch)
                bonds.wound[0] += bond_tile(
                    np.uint64(0), np.uint64(TILE), np.uint64(base), count, near, moving, turned, turning, kind, limits,
                    None if strength is None else bonds.intact, None if strength is None else over, out, book, half,
                )  # fmt: skip
                scatter(particles, bonds, base, count, loads)
            if strength is not None:
                record_breaks(particles, bonds, kinds, strength, base, count, over, step, half)


@kernel
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
            i, j, kind = first[b], second[b], kind_of(kinds, bonds.kind[b])
            d = sub(at(particles.position, j), at(particles.position, i))
            _, e, rotation, force, moment, _, _ = elastic_loads(
                d, at4(particles.orientation, i), at4(particles.orientation, j), kind
            )
            measures[0, b] = force[0]
            measures[1, b] = norm((0.0, force[1], force[2]))
            measures[2, b] = norm((0.0, moment[1], moment[2]))
            measures[3, b] = moment[0]
            measures[4, b] = e[0] / kind[0]
            measures[5, b] = norm((0.0, rotation[1], rotation[2]))
            measures[6, b] = norm(rotation)
            energy += 0.5 * (dot(e, force) + dot(rotation, moment))
    return measures, energy
