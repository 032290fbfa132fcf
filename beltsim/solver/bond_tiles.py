"""The loops over bonds, vectorised: the loads of up to `TILE` bonds between consecutive particles, and their sums."""

from __future__ import annotations

import numpy as np

from beltsim.solver.bond import bond_damping, bond_loads, bond_reaction, bond_stress
from beltsim.solver.jit import align_stack, inner, vector_kernel
from beltsim.solver.ledger import BOND_DAMPING
from beltsim.solver.vectors import add, at, at4, cross, from_axes, of, of4, product, scaled, sub

TILE = 256
"""Bonds whose loads are held at a time: 18 kB, so that they stay in the first-level cache."""

WOUND = 0.0208
"""Cosine of half the relative rotation of a bond, of 178 degrees, at which a run stops: beyond 180 the moment would
change its sign."""

BROKEN_IN_TENSION = 1
BROKEN_IN_SHEAR = 2


@inner
def springs_of(kinds, upright, t):
    """Stiffness and damping of bonds of kind t about their triads, or about the particles' axes: `kinds.upright`."""
    if upright is None:
        return (
            (0.0, kinds.stiffness[1, t], kinds.stiffness[2, t]),
            at(kinds.angular_stiffness, t),
            at(kinds.damping, t),
            at(kinds.angular_damping, t),
        )
    return at(upright, t), at(upright[3:], t), at(upright[6:], t), at(upright[9:], t)


@inner
def kind_of(kinds, upright, t):
    """Everything that bonds of kind t share."""
    triads = at4(kinds.triad_first, t), at4(kinds.triad_second, t)
    return upright, triads, kinds.rest_length[t], kinds.stiffness[0, t], springs_of(kinds, upright, t)


@inner
def carried(orientation, triad, upright):
    """The triad that a particle carries, in world axes; its own axes do where all triads lie along such."""
    if upright is None:
        return product(orientation, triad)
    return orientation


@inner
def elastic_loads(d, orientation_i, orientation_j, kind):
    """Elastic loads of a bond of a kind between two particles a vector d apart (see `bond.bond_loads`)."""
    upright, triads, length, stretching, (shearing, angular_stiffness, _, _) = kind
    triad_i, triad_j = carried(orientation_i, triads[0], upright), carried(orientation_j, triads[1], upright)
    return bond_loads(d, triad_i, triad_j, length, stretching, shearing, angular_stiffness)


@inner
def chosen(v, holds):
    """Vector v, or zeros: a choice, since zero times what a gap holds need not be zero."""
    return v[0] if holds else 0.0, v[1] if holds else 0.0, v[2] if holds else 0.0


@vector_kernel
def bond_tile(
    first,
    second,
    slot,
    count,
    position,
    velocity,
    orientation,
    spin,
    kind,
    limits,
    whole,
    over,
    loads,
    book,
    half,
):
    """Loads of `count` bonds between consecutive particles, into the first columns of `loads`.

    Parameters
    ----------
    first, second, slot : uint64, the first bond's particles and its own slot
    position, velocity, orientation, spin : rows of the state
    kind : see `kind_of`
    limits : (section, tensile strength, shear strength), or None for bonds that cannot break
    whole : (slots,) int8, 0 in gaps and for broken bonds; None where there are neither
    over : (TILE,) int8 for breakable bonds, else None; gets the mode of a new break
    loads : nine rows (TILE,): force on the first particle, torques on the first and on the second
    book : energy book of all slots (see `ledger`), or None
    half : half a step [s]

    Returns how many bonds are turned almost all the way round (`WOUND`), and how many break.
    """
    align_stack()
    wound = breaking = 0
    damping, angular_damping = kind[4][2], kind[4][3]
    for m in range(count):
        n = np.uint64(m)
        i, j = first + n, second + n
        d = sub(of(position, j), of(position, i))
        axes, _, elastic, pull, torque, r0 = elastic_loads(d, of4(orientation, i), of4(orientation, j), kind)
        relative = sub(of(velocity, j), of(velocity, i))
        viscous, viscous_torque = bond_damping(
            axes, d, relative, of(spin, i), of(spin, j), damping, angular_damping
        )
        holds = True
        if whole is not None:
            holds = whole[slot + n] != 0
        if limits is not None:
            section, tensile, shear = limits
            tension, slide = bond_stress(*elastic, section)
            mode = BROKEN_IN_TENSION if tension >= tensile else (BROKEN_IN_SHEAR if slide >= shear else 0)
            mode = mode if holds else 0
            over[n] = mode
            breaking += 1 if mode != 0 else 0
            holds = holds & (mode == 0)
        wound += 1 if holds & (r0 < WOUND) else 0
        viscous, viscous_torque = chosen(viscous, holds), chosen(viscous_torque, holds)
        pull, torque = add(chosen(pull, holds), viscous), add(chosen(torque, holds), viscous_torque)
        f, torque_i, torque_j = bond_reaction(axes, d, pull, torque)
        if book is not None:
            pulled, twisted = from_axes(axes, viscous), from_axes(axes, viscous_torque)
            half_couple = scaled(cross(d, pulled), 0.5)
            both, apart = add(of(spin, i), of(spin, j)), sub(of(spin, j), of(spin, i))
            b = slot + n
            loss = 0.0
            for row in range(3):
                loss += (book[row, b] + pulled[row]) * relative[row]
                loss -= (book[3 + row, b] + half_couple[row]) * both[row]
                loss += (book[6 + row, b] + twisted[row]) * apart[row]
                book[row, b] = pulled[row]
                book[3 + row, b] = half_couple[row]
                book[6 + row, b] = twisted[row]
            book[BOND_DAMPING, b] += half * loss
        for row in range(3):
            loads[row][n] = f[row]
            loads[3 + row][n] = torque_i[row]
            loads[6 + row][n] = torque_j[row]
    return wound, breaking


@vector_kernel
def add_tile(first, second, count, loads, force, torque):
    """Add the loads of `bond_tile` to consecutive particles; the second gets the opposite force."""
    for m in range(count):
        n = np.uint64(m)
        i = first + n
        for row in range(3):
            force[row][i] += loads[row][n]
            torque[row][i] += loads[3 + row][n]
    for m in range(count):
        n = np.uint64(m)
        j = second + n
        for row in range(3):
            force[row][j] -= loads[row][n]
            torque[row][j] += loads[6 + row][n]
