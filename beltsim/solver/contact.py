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
"""

from __future__ import annotations

import math

from beltsim.solver.jit import inner
from beltsim.solver.vectors import across, add, norm, plus, scaled, sub

LINE_STIFFNESS = math.pi / 4.0
HERTZ_DAMPING = math.sqrt(5.0 / 6.0)


def damping_of_restitution(restitution: float) -> float:
    """Damping ratio b of a linear spring whose rebound has the restitution e; 0 for e = 1."""
    log = math.log(restitution)
    return -log / math.sqrt(math.pi**2 + log**2)


@inner
def hertz(overlap, radius, modulus):
    """Elastic force [N] and stiffness [N/m] of two spheres of reduced radius [m] and modulus E* [Pa]."""
    stiffness = 2.0 * modulus * math.sqrt(radius * overlap)
    return 2.0 / 3.0 * stiffness * overlap, stiffness


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
    length = norm(turned)
    if length > 0.0:
        turned = scaled(turned, norm(spring) / length)
    if stiffness < old_stiffness:
        turned = scaled(turned, stiffness / old_stiffness)
    spring = plus(turned, -stiffness * time_step, sliding)
    viscous = scaled(sliding, -2.0 * damping * math.sqrt(mass * stiffness))
    force = add(spring, viscous)
    size = norm(force)
    if size > bound:
        # Sliding: spring and damper together hold the bound. A spring that kept the viscous share as well rebounds
        # spinning spheres with up to 0.1 too much of their surface velocity.
        force = scaled(force, bound / size)
        spring = sub(force, viscous)
    return force, spring


@inner
def rolling_moment(old, relative_spin, normal, time_step, normal_stiffness, arm, bound):
    """Elastic-plastic rolling resistance (type C, Ai et al. 2011, Powder Technology 206, 269, eqs 13-17).

    `arm` = rolling friction times the reduced radius [m]; k_r = 2.25 k_n arm^2; |M| <= bound = arm F_n. Returns the
    moment on the first body, which is also what is remembered.
    """
    moment = across(old, normal)
    rolling = across(relative_spin, normal)
    moment = plus(moment, -2.25 * normal_stiffness * arm * arm * time_step, rolling)
    size = norm(moment)
    if size > bound:
        moment = scaled(moment, bound / size)
    return moment
