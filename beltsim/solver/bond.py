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
    axis_x,
    axis_y,
    axis_z,
    conjugate,
    cross,
    dot,
    norm,
    plus,
    product,
    scaled,
    sub,
    times,
)

TINY = 1e-300


@inner
def arcsine_slope(z):
    """(asin(s) / s - 1) / z of z = s^2 for s up to 1/2, to the last digit (the rational form of fdlibm's e_asin.c)."""
    p = 2.01212532134862925881e-01 + z * (
        -4.00555345006794114027e-02 + z * (7.91534994289814532176e-04 + z * 3.47933107596021167570e-05)
    )
    p = 1.66666666666666657415e-01 + z * (-3.25565818622400915405e-01 + z * p)
    q = 2.02094576023350569471e00 + z * (-6.88283971605453293030e-01 + z * 7.70381505559019352791e-02)
    return p / (1.0 + z * (-2.40339491173441421878e00 + z * q))


@inner
def half_angle_ratio(x):
    """(t/2) / sin(t/2) of a rotation by t, and (1 - that) / x, from x = sin^2(t/2) for t below 180 degrees.

    Exact at any angle without a call of the maths library, so that the loop over bonds is vectorised: beyond 60 degrees
    asin(s) = pi/2 - 2 asin(sqrt((1 - s) / 2)).
    """
    s = math.sqrt(x)
    small = x < 0.25
    z = x if small else 0.5 * (1.0 - s)
    slope = arcsine_slope(z)
    large = (0.5 * math.pi - 2.0 * math.sqrt(z) * (1.0 + z * slope)) / s
    ratio = 1.0 + x * slope if small else large
    return ratio, -slope if small else (1.0 - large) / x


@inner
def to_world(q, v):
    """Vector v of the frame q in world axes, from the frame's axes, which the law needs anyway."""
    return add(add(scaled(axis_x(q), v[0]), scaled(axis_y(q), v[1])), scaled(axis_z(q), v[2]))


@inner
def bond_strain(d, triad_i, triad_j, rest_length):
    """Strains of a bond.

    Parameters
    ----------
    d : (3,) vector from the first to the second centre [m]
    triad_i, triad_j : quaternions of the bond triads carried by the two particles
    rest_length : [m]

    Returns
    -------
    mid : quaternion of the mid frame
    e : (3,) stretch, and displacement across in the mid frame [m]
    chord : (3,) d in the mid frame [m]
    r : (3,) vector part of the relative rotation, sin(t/2) times its axis
    r0 : its scalar part, never negative
    """
    r0, rx, ry, rz = product(conjugate(triad_i), triad_j)
    # q and -q are the same rotation: take the one of less than 180 degrees.
    sign = 1.0 if r0 >= 0.0 else -1.0
    r0 *= sign
    r = (sign * rx, sign * ry, sign * rz)
    # The mean of two unit quaternions is exactly halfway: |p + s|^2 = 2 (1 + r0).
    scale = 1.0 / math.sqrt(2.0 * (1.0 + r0))
    mid = (
        scale * (triad_i[0] + sign * triad_j[0]),
        scale * (triad_i[1] + sign * triad_j[1]),
        scale * (triad_i[2] + sign * triad_j[2]),
        scale * (triad_i[3] + sign * triad_j[3]),
    )
    chord = (dot(axis_x(mid), d), dot(axis_y(mid), d), dot(axis_z(mid), d))
    e = (norm(d) - rest_length, chord[1], chord[2])
    return mid, e, chord, r, r0


@inner
def bond_loads(d, triad_i, triad_j, rest_length, stiffness, angular_stiffness):
    """Elastic loads of a bond: mid frame, local force, local moments, the exact torque terms.

    Returns
    -------
    mid : quaternion of the mid frame
    e, rotation : (3,) strains: stretch and displacement across [m], rotation vector [rad], in the mid frame
    force, moment : (3,) work conjugate to them: tension and shear [N], twist and two bending moments [N m]
    pull : (3,) force on the first particle, mid frame [N]: the tension acts along the chord
    torque : (3,) M + q: the exact torque of the moments on the first particle, mid frame [N m]

    Source: variation of the energy in the module's head; the term q = 1/2 tan(t/4) c x u comes from the turning of
    the mid frame, and without it energy is not conserved at large rotation (error 7e-3 against 8e-5 at 37 degrees).
    """
    mid, e, chord, r, r0 = bond_strain(d, triad_i, triad_j, rest_length)
    force = times(stiffness, e)
    shear = (0.0, force[1], force[2])
    pull = plus(shear, force[0] / max(e[0] + rest_length, TINY), chord)
    ratio, slope = half_angle_ratio(dot(r, r))
    rotation = scaled(r, 2.0 * ratio)
    moment = times(angular_stiffness, rotation)
    exact = plus(scaled(moment, ratio), slope * dot(r, moment), r)
    couple = cross(chord, shear)  # the tension has none
    turning = scaled(cross(couple, r), 0.5 / (1.0 + r0))
    return mid, e, rotation, force, moment, pull, add(exact, turning)


@inner
def bond_damping(mid, d, relative_velocity, spin_i, spin_j, damping, angular_damping):
    """Viscous force and moment of a bond in its mid frame, on the first particle.

    The rates are those of the strains (a common rigid motion has none), so the damping is objective, conserves both
    momenta and can only take energy away.
    """
    stretch, twist = bond_rates(mid, d, relative_velocity, spin_i, spin_j)
    return times(damping, stretch), times(angular_damping, twist)


@inner
def bond_rates(mid, d, relative_velocity, spin_i, spin_j):
    """Rates of a bond's strains in its mid frame: of stretch and displacement across [m/s], of rotation [rad/s]."""
    mean_spin = scaled(add(spin_i, spin_j), 0.5)
    rate = sub(relative_velocity, cross(mean_spin, d))
    twist = sub(spin_j, spin_i)
    x, y, z = axis_x(mid), axis_y(mid), axis_z(mid)
    return (dot(x, rate), dot(y, rate), dot(z, rate)), (dot(x, twist), dot(y, twist), dot(z, twist))


@inner
def bond_reaction(mid, d, force, torque):
    """World force on the first particle and world torques on both, from loads in the mid frame.

    T_i = c/2 + M + q and T_j = c/2 - M - q with the couple c = d x f, so that total angular momentum is conserved.
    """
    f = to_world(mid, force)
    t = to_world(mid, torque)
    half_couple = scaled(cross(d, f), 0.5)
    return f, add(half_couple, t), sub(half_couple, t)


@inner
def bond_stress(force, moment, section):
    """Largest tensile stress and largest shear stress in the section [Pa].

    `section` = (area, bending modulus about the width, about the thickness, torsion modulus), of the unreduced
    section: N/A + |M2|/W2 + |M3|/W3 and |V|/A + |M1|/Wt (Potyondy and Cundall 2004, eqs 15 and 16).
    """
    area, bending_2, bending_3, torsion = section
    tension = force[0] / area + abs(moment[1]) / bending_2 + abs(moment[2]) / bending_3
    shear = norm((0.0, force[1], force[2])) / area + abs(moment[0]) / torsion
    return tension, shear
