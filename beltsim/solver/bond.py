"""The bond: a massless beam between the centres of two particles, exact at any rotation below 180 degrees.

Each particle carries the triad of the stress-free bond. The rotation between the two triads and the distance in the
frame halfway between them are the only strains, so the law is objective, symmetric and the exact gradient of the
energy  U = 1/2 (k_n e1^2 + k_s2 e2^2 + k_s3 e3^2 + k_t t1^2 + k_b2 t2^2 + k_b3 t3^2)  (e1: stretch |d| - l; e2, e3:
displacement across and t: rotation vector, in the mid frame; 1 along the bond, 2 along the section's width, 3 along its
thickness). With the stretch measured along the mid frame instead, particles that turn away from the chord would relax
the tension T, and where T > k_s3 l (always without bending stiffness) they do: a strip stretched by 15 % blew up.
Beam bond after Obermayr et al. 2013 (Computers and Geotechnics 49, 299); bending reduction after Fimbinger 2021.

Signs: the force and the torques returned act on the first particle and on the two particles; the force on the second
particle is the opposite of that on the first.
"""

from __future__ import annotations

import math

from beltsim.solver.jit import inner
from beltsim.solver.vectors import (
    add,
    conjugate,
    cross,
    dot,
    from_axes,
    in_axes,
    norm,
    plus,
    product,
    scaled,
    sub,
    times,
)

TINY = 1e-300


@inner
def half_angle_excess(w):
    """g of (t/2) / sin(t/2) = 1 + w g, from w = 1 - cos(t/2), for rotations t up to 180 degrees.

    The series sum of 2^n n!^2 / (2 n + 1)! w^n has its only singularity at 360 degrees, so that one polynomial, the
    series economised on [0, 1], serves all angles to 2e-16 without a branch, a root or a call of the maths library.
    """
    z = w * w
    even = -7.32249344127648607e-04
    even = even * z - 6.51332312107856786e-03
    even = even * z - 1.24372109168862238e-02
    even = even * z - 7.44136986986428280e-03
    even = even * z - 1.44587741015869188e-03
    even = even * z + 4.39505465619232326e-04
    even = even * z + 2.48380762869796975e-03
    even = even * z + 1.15439975454832040e-02
    even = even * z + 5.71428571330070759e-02
    even = even * z + 3.33333333333333259e-01
    odd = 9.14657065429789416e-05
    odd = odd * z + 2.77597208686406914e-03
    odd = odd * z + 1.05523913690604987e-02
    odd = odd * z + 1.10423470674427451e-02
    odd = odd * z + 3.96108648568707991e-03
    odd = odd * z + 7.50910825927491254e-04
    odd = odd * z + 1.19028439042083282e-03
    odd = odd * z + 5.32823917767310997e-03
    odd = odd * z + 2.53968259078437807e-02
    odd = odd * z + 1.33333333333408605e-01
    return even + w * odd


@inner
def mean_axes(p, q, share):
    """Axes of the frame halfway between two unit quaternions, with share = 2 / |p + q|^2: no root is needed."""
    w, x, y, z = p[0] + q[0], p[1] + q[1], p[2] + q[2], p[3] + q[3]
    sx, sy, sz = share * x, share * y, share * z
    xx, yy, zz = sx * x, sy * y, sz * z
    wx, wy, wz = sx * w, sy * w, sz * w
    return (
        (1.0 - (yy + zz), sx * y + wz, sx * z - wy),
        (sx * y - wz, 1.0 - (xx + zz), sy * z + wx),
        (sx * z + wy, sy * z - wx, 1.0 - (xx + yy)),
    )


@inner
def bond_strain(d, triad_i, triad_j):
    """How a bond lies.

    Parameters
    ----------
    d : (3,) vector from the first to the second centre [m]
    triad_i, triad_j : quaternions of the bond triads carried by the two particles

    Returns
    -------
    axes : of the mid frame
    length, per_length : |d| [m] and its inverse; neither is NaN where the centres meet
    r : (3,) vector part of the relative rotation, sin(t/2) times its axis
    r0 : its scalar part cos(t/2), never negative
    share : 1 / (1 + r0)
    """
    r0, rx, ry, rz = product(conjugate(triad_i), triad_j)
    # q and -q are the same rotation: take the one of less than 180 degrees.
    turned = r0 < 0.0
    r0 = -r0 if turned else r0
    r = (-rx if turned else rx, -ry if turned else ry, -rz if turned else rz)
    w, x, y, z = triad_j
    near = (-w if turned else w, -x if turned else x, -y if turned else y, -z if turned else z)
    length = math.sqrt(dot(d, d) + TINY)
    # One division for both inverses: it takes as long as twenty multiplications.
    inverse = 1.0 / (length * (1.0 + r0))
    share = inverse * length
    # The mean of two unit quaternions is exactly halfway: |p + q|^2 = 2 (1 + r0).
    return mean_axes(triad_i, near, share), length, inverse * (1.0 + r0), r, r0, share


@inner
def bond_loads(d, triad_i, triad_j, rest_length, stretching, shearing, angular_stiffness):
    """Elastic loads of a bond: mid frame, local forces, local moments, the exact torque terms.

    Parameters
    ----------
    d, triad_i, triad_j, rest_length : see `bond_strain`; [m]
    stretching : stiffness along the chord [N/m]
    shearing, angular_stiffness : (3,) about the axes of the triads [N/m, N m]; no shear along the bond

    Returns
    -------
    axes : of the mid frame
    strains : stretch [m], (3,) chord [m] and rotation vector [rad] in the mid frame
    loads : work conjugate to them: tension [N], (3,) shear force [N] and moment [N m]
    pull : (3,) force on the first particle, mid frame [N]: the tension acts along the chord
    torque : (3,) M + q: the exact torque of the moments on the first particle, mid frame [N m]
    r0 : cosine of half the angle of the relative rotation

    Source: variation of the energy in the module's head; the term q = 1/2 tan(t/4) c x u comes from the turning of
    the mid frame, and without it energy is not conserved at large rotation (error 7e-3 against 8e-5 at 37 degrees).
    """
    axes, length, per_length, r, r0, share = bond_strain(d, triad_i, triad_j)
    chord = in_axes(axes, d)
    stretch = length - rest_length
    tension = stretching * stretch
    shear = times(shearing, chord)
    pull = plus(shear, tension * per_length, chord)
    excess = half_angle_excess(1.0 - r0)
    ratio = 1.0 + (1.0 - r0) * excess
    rotation = scaled(r, 2.0 * ratio)
    moment = times(angular_stiffness, rotation)
    # (1 - ratio) / |r|^2, with |r|^2 = (1 - r0) (1 + r0).
    exact = plus(scaled(moment, ratio), -excess * share * dot(r, moment), r)
    couple = cross(chord, shear)  # the tension has none
    turning = cross(scaled(couple, 0.5 * share), r)
    return axes, (stretch, chord, rotation), (tension, shear, moment), pull, add(exact, turning), r0


@inner
def bond_damping(axes, d, relative_velocity, spin_i, spin_j, damping, angular_damping):
    """Viscous force and moment of a bond in its mid frame, on the first particle.

    The rates are those of the strains (a common rigid motion has none), so the damping is objective, conserves both
    momenta and can only take energy away.
    """
    stretch, twist = bond_rates(axes, d, relative_velocity, spin_i, spin_j)
    return times(damping, stretch), times(angular_damping, twist)


@inner
def bond_rates(axes, d, relative_velocity, spin_i, spin_j):
    """Rates of a bond's strains in its mid frame: of stretch and displacement across [m/s], of rotation [rad/s]."""
    rate = sub(relative_velocity, cross(add(spin_i, spin_j), scaled(d, 0.5)))
    twist = sub(spin_j, spin_i)
    return in_axes(axes, rate), in_axes(axes, twist)


@inner
def bond_reaction(axes, d, force, torque):
    """World force on the first particle and world torques on both, from loads in the mid frame.

    T_i = c/2 + M + q and T_j = c/2 - M - q with the couple c = d x f, so that total angular momentum is conserved.
    """
    f = from_axes(axes, force)
    t = from_axes(axes, torque)
    half_couple = cross(scaled(d, 0.5), f)
    return f, add(half_couple, t), sub(half_couple, t)


@inner
def bond_stress(tension, shear, moment, section):
    """Largest tensile stress and largest shear stress in the section [Pa].

    `section` = (area, bending modulus about the width, about the thickness, torsion modulus), of the unreduced
    section: N/A + |M2|/W2 + |M3|/W3 and |V|/A + |M1|/Wt (Potyondy and Cundall 2004, eqs 15 and 16).
    """
    area, bending_2, bending_3, torsion = section
    tensile = tension / area + abs(moment[1]) / bending_2 + abs(moment[2]) / bending_3
    return tensile, norm(shear) / area + abs(moment[0]) / torsion
