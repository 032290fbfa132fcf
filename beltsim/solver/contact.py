"""The contact laws: from overlap, relative velocity and history to a force. Pure functions, no indices.

Signs: normals point from the second body to the first; forces act on the first body; overlap is positive in contact.

Hertz-Mindlin with viscous damping and Coulomb friction:
    normal      F_n = 4/3 E* sqrt(R*) d^(3/2) + 2 g sqrt(m* S_n) d',   S_n = 2 E* sqrt(R* d)
    tangential  dF_t = S_t du_t, S_t = 8 G* sqrt(R* d); on unloading F_t shrinks with S_t, so that no energy is made
    friction    |F_t| <= friction * max(F_n, 0)
The attractive tail of the damped normal force is kept until the overlap ends: only then does g = sqrt(5/6) b,
b = -ln e / sqrt(pi^2 + ln^2 e), give the restitution e exactly (Antypov and Elliott 2011; clipped, e = 0.5 would come
out as 0.55).

Line contact of a flat face on a cylinder: F_n = pi/4 E* l d per length l, linear in the overlap and independent of the
radius; the same damping with the linear g = b, and the same ratio S_t / S_n = 4 G* / E*.

Corner of a rounded box on a plane or a mesh: the Hertz force of its rounding and a quarter of the flat punch of the
box's largest face, F_n = 4/3 E* sqrt(r) d^(3/2) + 1/4 2/sqrt(pi) E* sqrt(A) d. A box that lies flat has the stiffness
of the punch (King 1987, Int. J. Solids Structures 23, 1657), and as the energy depends on the depths of the corners
only, no tilt makes energy or a jump.

Two rounded boxes: an elastic foundation of the stiffness K = E* / h per area, h the mean of both half thicknesses, as
each body yields from its face to its middle (`box_box` says how it adds up over faces, edges and corners); g = b.

Linear spring-dashpot: F_n = k_n d + 2 b sqrt(m* k_n) d', the same history and friction with k_t. A whole line contact
has the stiffness k_n, a part of it its share, each corner of a box a quarter, and the smaller of two boxes' faces k_n.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba.extending import overload

from beltsim.solver.jit import INLINE, inner
from beltsim.solver.vectors import across, add, dot, norm, plus, scaled, sub

LINE_STIFFNESS = math.pi / 4.0
HERTZ_DAMPING = math.sqrt(5.0 / 6.0)
TINY = 1e-300
PUNCH_STIFFNESS = 2.0 / math.sqrt(math.pi)  # of a flat punch, over E* sqrt(A)


def damping_of_restitution(restitution: float) -> float:
    """Damping ratio b of a linear spring whose rebound has the restitution e; 0 for e = 1."""
    log = math.log(restitution)
    return -log / math.sqrt(math.pi**2 + log**2)


class HertzPair(NamedTuple):
    """Hertz-Mindlin parameters of two materials."""

    normal_modulus: float  # E*, Pa
    shear_modulus: float  # G*, Pa
    damping: float  # ratio b of the linear spring
    friction: float
    rolling_friction: float
    rolling_damping: float  # ratio of the rocking


class LinearPair(NamedTuple):
    """Spring-dashpot parameters of two materials, the same at any overlap and radius."""

    normal_stiffness: float  # N/m
    tangential_stiffness: float  # N/m
    damping: float
    friction: float
    rolling_friction: float
    rolling_damping: float


@inner
def hertz(overlap, radius, modulus):
    """Elastic force [N] and stiffness [N/m] of two spheres of reduced radius [m] and modulus E* [Pa]."""
    stiffness = 2.0 * modulus * math.sqrt(radius * overlap)
    return 2.0 / 3.0 * stiffness * overlap, stiffness


@inner
def shear_ratio(pair):
    """S_t / S_n = 4 G* / E*; 0 for materials that have no contact property, so that they push nothing."""
    return 4.0 * pair.shear_modulus / max(pair.normal_modulus, TINY)


@inner
def hertz_point(pair, overlap, radius):
    """Elastic force, normal and tangential stiffness and damping ratio of two rounded surfaces, Hertz-Mindlin."""
    elastic, stiffness = hertz(overlap, radius, pair.normal_modulus)
    return (
        elastic,
        stiffness,
        stiffness * shear_ratio(pair),
        HERTZ_DAMPING * pair.damping,
    )


@inner
def linear_point(pair, overlap, radius):  # noqa: ARG001 - one signature for all laws
    """The same of a linear spring-dashpot; no stiffness where nothing touches."""
    touches = 1.0 if overlap > 0.0 else 0.0
    stiffness = touches * pair.normal_stiffness
    return stiffness * overlap, stiffness, touches * pair.tangential_stiffness, pair.damping


@inner
def hertz_line(pair, area, length, whole):  # noqa: ARG001
    """Elastic force, normal and tangential stiffness and damping ratio of a flat face along a cylinder.

    `area` is the integral of the overlap along the `length` that touches, of a line `whole` long.
    """
    per_length = LINE_STIFFNESS * pair.normal_modulus
    stiffness = per_length * length
    return (
        per_length * area,
        stiffness,
        stiffness * shear_ratio(pair),
        pair.damping,
    )


@inner
def linear_line(pair, area, length, whole):
    """The same of a linear spring-dashpot: the stiffness is that of the whole line."""
    share = length / whole
    elastic = pair.normal_stiffness * area / whole
    return elastic, share * pair.normal_stiffness, share * pair.tangential_stiffness, pair.damping


@inner
def hertz_corner(pair, overlap, radius, side):
    """Elastic force, normal and tangential stiffness and damping ratio of a box corner of edge radius [m].

    `side` is the root of the area of the box's largest face [m].
    """
    elastic, stiffness = hertz(overlap, radius, pair.normal_modulus)
    punch = 0.25 * PUNCH_STIFFNESS * pair.normal_modulus * side
    stiffness += punch
    return (
        elastic + punch * overlap,
        stiffness,
        stiffness * shear_ratio(pair),
        pair.damping,
    )


@inner
def linear_corner(pair, overlap, radius, side):  # noqa: ARG001
    """The same of a linear spring-dashpot: four corners make a face."""
    stiffness = 0.25 * pair.normal_stiffness
    return stiffness * overlap, stiffness, 0.25 * pair.tangential_stiffness, pair.damping


@inner
def hertz_face(pair, half_thickness, area):  # noqa: ARG001
    """Normal and tangential stiffness per area [Pa/m] and damping ratio of two faces that lie on each other.

    `half_thickness` is the mean of both bodies [m], `area` that of the smaller face [m2].
    """
    return pair.normal_modulus / half_thickness, 4.0 * pair.shear_modulus / half_thickness, pair.damping


@inner
def linear_face(pair, half_thickness, area):  # noqa: ARG001
    """The same of a linear spring-dashpot: its stiffness is that of the smaller face."""
    return pair.normal_stiffness / area, pair.tangential_stiffness / area, pair.damping


def point_law(pair, overlap, radius):
    """Springs of a point contact by the law of `pair`; compiled code has the one law of its scene only."""
    law = linear_point if isinstance(pair, LinearPair) else hertz_point
    return law(pair, overlap, radius)


def line_law(pair, area, length, whole):
    """Springs of a line contact, likewise."""
    law = linear_line if isinstance(pair, LinearPair) else hertz_line
    return law(pair, area, length, whole)


def corner_law(pair, overlap, radius, side):
    """Springs of a box corner, likewise."""
    law = linear_corner if isinstance(pair, LinearPair) else hertz_corner
    return law(pair, overlap, radius, side)


def face_law(pair, half_thickness, area):
    """Foundation of two faces, likewise."""
    law = linear_face if isinstance(pair, LinearPair) else hertz_face
    return law(pair, half_thickness, area)


@overload(point_law, jit_options=INLINE)
def _point_law(pair, overlap, radius):  # noqa: ARG001 - types, not values
    if pair.instance_class is LinearPair:
        return lambda pair, overlap, radius: linear_point(pair, overlap, radius)
    return lambda pair, overlap, radius: hertz_point(pair, overlap, radius)


@overload(line_law, jit_options=INLINE)
def _line_law(pair, area, length, whole):  # noqa: ARG001
    if pair.instance_class is LinearPair:
        return lambda pair, area, length, whole: linear_line(pair, area, length, whole)
    return lambda pair, area, length, whole: hertz_line(pair, area, length, whole)


@overload(corner_law, jit_options=INLINE)
def _corner_law(pair, overlap, radius, side):  # noqa: ARG001
    if pair.instance_class is LinearPair:
        return lambda pair, overlap, radius, side: linear_corner(pair, overlap, radius, side)
    return lambda pair, overlap, radius, side: hertz_corner(pair, overlap, radius, side)


@overload(face_law, jit_options=INLINE)
def _face_law(pair, half_thickness, area):  # noqa: ARG001
    if pair.instance_class is LinearPair:
        return lambda pair, half_thickness, area: linear_face(pair, half_thickness, area)
    return lambda pair, half_thickness, area: hertz_face(pair, half_thickness, area)


@inner
def damped_normal(elastic, stiffness, damping, mass, approach):
    """Normal force with viscous damping; `approach` is the rate at which the overlap grows [m/s]."""
    return elastic + 2.0 * damping * math.sqrt(mass * stiffness) * approach


@inner
def friction_force(velocity, normal, time_step, spring, old_stiffness, stiffness, damping, mass, bound):
    """Friction of a contact whose surfaces move past each other, and the spring force to remember.

    Parameters
    ----------
    velocity : (3,) of the first surface relative to the second [m/s]
    spring, old_stiffness : (3,) spring force [N] and S_t [N/m] of the step before; the force is turned into the
        new tangent plane with its length kept
    stiffness : S_t now [N/m]
    damping, mass : damping ratio and reduced mass [kg]
    bound : largest friction force [N]
    """
    sliding = across(velocity, normal)
    turned = across(spring, normal)
    left = dot(turned, turned)
    if left > 0.0:
        turned = scaled(turned, math.sqrt(dot(spring, spring) / left))
    if stiffness < old_stiffness:
        turned = scaled(turned, stiffness / old_stiffness)
    spring = plus(turned, -stiffness * time_step, sliding)
    viscous = scaled(sliding, -2.0 * damping * math.sqrt(mass * stiffness))
    force = add(spring, viscous)
    size = norm(force)
    if size > bound:
        # Sliding: spring and damper together hold the bound. A spring that kept the viscous share as well rebounds
        # spinning spheres with up to 0.1 too much of their surface velocity. One that is wound up the other way by a
        # damper beyond the bound would make energy.
        direction = scaled(force, 1.0 / size)
        force = scaled(direction, bound)
        spring = sub(force, viscous)
        spring = plus(spring, -min(dot(spring, direction), 0.0), direction)
    return force, spring


@inner
def rolling_moment(old, relative_spin, normal, time_step, normal_stiffness, arm, damping, inertia, bound):
    """Elastic-plastic rolling resistance (type C, Ai et al. 2011, Powder Technology 206, 269, eqs 13-17).

    A spring k_r = 2.25 k_n arm^2 and a damper 2 damping sqrt(inertia k_r); the spring alone and both together hold
    the bound. So a full moment is the bound at any speed, as without the damper (f = 0 in eq. 17), but reached without
    a jump.

    Parameters
    ----------
    old : (3,) moment of the spring in the step before [N m]
    arm : rolling friction times the reduced radius [m]; bound = arm F_n [N m]
    damping, inertia : share of critical, and both bodies' reduced moment of inertia about the contact [kg m2]

    Returns
    -------
    moment on the first body, moment of the spring to remember
    """
    rolling = across(relative_spin, normal)
    stiffness = 2.25 * normal_stiffness * arm * arm
    spring = plus(across(old, normal), -stiffness * time_step, rolling)
    size = norm(spring)
    if size > bound:
        spring = scaled(spring, bound / size)
    moment = plus(spring, -2.0 * damping * math.sqrt(inertia * stiffness), rolling)
    size = norm(moment)
    if size > bound:
        moment = scaled(moment, bound / size)
    return moment, spring
