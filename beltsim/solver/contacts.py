"""The contact passes: one for each pair of shapes, all with the same law. No formula stands here.

Each pass writes only to its own pairs; their loads are added to the particles afterwards, in a fixed order, so that
results do not depend on the number of threads.
"""

from __future__ import annotations

import math

from numba.extending import overload

from beltsim.solver.contact import (
    HertzPair,
    LinearPair,
    damped_normal,
    friction_force,
    point_law,
    rolling_moment,
)
from beltsim.solver.jit import INLINE, callee, inner, pass_kernel
from beltsim.solver.ledger import note_end, note_friction, note_normal, note_rolling, stored
from beltsim.solver.shapes import (
    sphere_cylinder,
    sphere_plane,
)
from beltsim.solver.sharing import share
from beltsim.solver.state import LinearLaws
from beltsim.solver.vectors import add, at, at4, axis_z, cross, dot, plus, put, scaled, sub

NONE = (0.0, 0.0, 0.0)


@inner
def put_loads(loads, k, force, torque_first, torque_second):
    """Store the loads of pair k; the force on the second is the opposite of that on the first."""
    for row in range(3):
        loads[row, k] = force[row]
        loads[3 + row, k] = torque_first[row]
        loads[6 + row, k] = torque_second[row]


@callee
def add_loads(particles, contacts, both):
    """Add the loads of the pairs that touch to their particles, in the order of the pairs.

    Those are the ones with a stiffness; it is negative where another pair has the history (`belt_surface`).
    `both` is False where the second is a part. Summing all pairs of each particle took four times as long: one in three
    of the listed pairs touches, and most particles have none.
    """
    first, second, stiffness, loads = contacts.first, contacts.second, contacts.stiffness, contacts.loads
    force, torque = particles.force, particles.torque
    for k in range(first.size):
        if stiffness[k] != 0.0:
            i, j = first[k], second[k]
            for row in range(3):
                force[row, i] += loads[row, k]
                torque[row, i] += loads[3 + row, k]
            if both:
                for row in range(3):
                    force[row, j] -= loads[row, k]
                    torque[row, j] += loads[6 + row, k]


@inner
def hertz_pair(laws, a, b):
    """Hertz-Mindlin parameters of the materials a and b."""
    return HertzPair(
        laws.normal_modulus[a, b],
        laws.shear_modulus[a, b],
        laws.damping[a, b],
        laws.friction[a, b],
        laws.rolling_friction[a, b],
        laws.rolling_damping[a, b],
    )


@inner
def linear_pair(laws, a, b):
    """Spring-dashpot parameters of the materials a and b."""
    return LinearPair(
        laws.normal_stiffness[a, b],
        laws.tangential_stiffness[a, b],
        laws.damping[a, b],
        laws.friction[a, b],
        laws.rolling_friction[a, b],
        laws.rolling_damping[a, b],
    )


def law_of(laws, a, b):
    """Parameters of the materials a and b, by the law of the scene."""
    return linear_pair(laws, a, b) if isinstance(laws, LinearLaws) else hertz_pair(laws, a, b)


@overload(law_of, jit_options=INLINE)
def _law_of(laws, a, b):  # noqa: ARG001 - types, not values
    if laws.instance_class is LinearLaws:
        return lambda laws, a, b: linear_pair(laws, a, b)
    return lambda laws, a, b: hertz_pair(laws, a, b)


@inner
def forget(contacts, k):
    """Pair k does not touch: no loads, no history."""
    contacts.stiffness[k] = 0.0
    put(contacts.spring, k, NONE)
    put(contacts.rolling, k, NONE)
    put_loads(contacts.loads, k, NONE, NONE, NONE)
    note_end(contacts.book, k)


@inner
def point_loads(law, overlap, radius, mass, inertia, normal, relative, slip, spins, arms, history, time_step):
    """Loads and new history of a contact of rounded surfaces; nothing but zeros where the overlap is zero.

    Parameters
    ----------
    mass, inertia : reduced mass [kg] and reduced moment of inertia about the contact [kg m2]
    relative, slip : (3,) surface velocity of the first against the second, along the normal and across
    spins, arms : of both bodies, arms from their centres to the contact point
    history : (spring force (3,), tangential stiffness, moment of the rolling spring (3,)) of the step before; the last
        is None where no contact resists rolling

    Returns
    -------
    force and rolling moment on the first, torque on the first, torque on the second, new history
    """
    spring, old, rolling = history
    elastic, stiffness, shear_stiffness, damping = point_law(law, overlap, radius)
    normal_force = damped_normal(elastic, stiffness, damping, mass, -dot(relative, normal))
    pressed = max(normal_force, 0.0)
    tangential, spring = friction_force(
        slip, normal, time_step, spring, old, shear_stiffness, damping, mass, law.friction * pressed
    )
    spin = sub(spins[0], spins[1])
    softened = shear_stiffness / old if shear_stiffness < old else 1.0
    moment, rolling = resisted(
        rolling, law, radius, spin, normal, time_step, stiffness, softened, inertia, pressed
    )
    force = add(scaled(normal, normal_force), tangential)
    torque_1 = add(cross(arms[0], force), moment)
    torque_2 = sub(cross(force, arms[1]), moment)
    return force, moment, torque_1, torque_2, (spring, shear_stiffness, rolling)


@inner
def resisted(rolling, law, radius, spin, normal, time_step, stiffness, softened, inertia, pressed):
    """Rolling moment on the first body and that of its spring; none without a history of it.

    A spring that is softened, to the share `softened`, keeps its turn as that of friction does: no energy is made.
    """
    if rolling is None:
        return NONE, NONE
    arm = law.rolling_friction * radius
    return rolling_moment(
        scaled(rolling, softened),
        spin,
        normal,
        time_step,
        stiffness,
        arm,
        law.rolling_damping,
        inertia,
        arm * pressed,
    )


@inner
def note_point(
    book, k, law, overlap, radius, normal, relative, slip, spin, old, new, force, moment, time_step
):
    """Note what happened in pair k, from the history before and after (see `point_loads`), force and moment."""
    if book is not None:
        elastic, stiffness, _, _ = point_law(law, overlap, radius)
        normal_force = dot(force, normal)
        viscous, approach = normal_force - elastic, -dot(relative, normal)
        note_normal(book, k, stored(elastic, stiffness, overlap), viscous, approach, time_step, overlap)
        tangential = plus(force, -normal_force, normal)
        bound = law.friction * max(normal_force, 0.0)
        note_friction(book, k, normal, slip, time_step, old[:2], new[:2], tangential, bound)
        arm = law.rolling_friction * radius
        note_rolling(book, k, normal, spin, time_step, moment, new[2], 2.25 * stiffness * arm * arm)


@inner
def noted_loads(
    book, k, law, overlap, radius, mass, inertia, normal, relative, slip, spins, arms, history, time_step
):
    """`point_loads` of pair k, noted in the book of its list, if there is one."""
    force, moment, torque_1, torque_2, new = point_loads(
        law, overlap, radius, mass, inertia, normal, relative, slip, spins, arms, history, time_step
    )
    spin = sub(spins[0], spins[1])
    note_point(
        book, k, law, overlap, radius, normal, relative, slip, spin, history, new, force, moment, time_step
    )
    return force, moment, torque_1, torque_2, new


@inner
def point_contact(contacts, k, overlap, normal, radius, mass, inertia, law, relative, spins, arms, time_step):
    """Loads and history of a touching pair k of rounded surfaces; see `point_loads`."""
    history = (at(contacts.spring, k), contacts.stiffness[k], at(contacts.rolling, k))
    force, _, torque_1, torque_2, new = noted_loads(
        contacts.book, k, law, overlap, radius, mass, inertia,
        normal, relative, relative, spins, arms, history, time_step,
    )  # fmt: skip
    put(contacts.spring, k, new[0])
    contacts.stiffness[k] = new[1]
    put(contacts.rolling, k, new[2])
    put_loads(contacts.loads, k, force, torque_1, torque_2)


@inner
def touch(contacts, k, force, normal, shear_stiffness, damping, mass, bound, relative, time_step):
    """Add friction to the normal force of pair k and remember its spring."""
    spring, old = at(contacts.spring, k), contacts.stiffness[k]
    before = (spring, old)
    tangential, spring = friction_force(
        relative, normal, time_step, spring, old, shear_stiffness, damping, mass, bound
    )
    after = (spring, shear_stiffness)
    note_friction(contacts.book, k, normal, relative, time_step, before, after, tangential, bound)
    put(contacts.spring, k, spring)
    contacts.stiffness[k] = shear_stiffness
    return add(force, tangential)


@inner
def reduced_mass(mass, mobility, i, j):
    """Reduced mass [kg] of particles i and j for the damping: what is held moves like an infinite mass."""
    inverse = mobility[0, i] / mass[i] + mobility[0, j] / mass[j]
    return 1.0 / inverse if inverse > 0.0 else mass[i]


@inner
def about_end(mass, inertia, arm):
    """Moment of inertia [kg m2] about the end of an arm across it."""
    return inertia + mass * dot(arm, arm)


@inner
def inertia_about(particles, i, arm):
    """Least moment of inertia [kg m2] of particle i about an axis across the arm at its end; held ones have it too."""
    inertia = particles.inertia
    least = min(inertia[0, i], min(inertia[1, i], inertia[2, i]))
    return about_end(particles.mass[i], least, arm)


@inner
def mass_beside(mass, listed, p):
    """Reduced mass [kg] of a particle and part p, which is infinitely heavy unless it stands for a flying cylinder."""
    if listed is not None:
        mass = 1.0 / (1.0 / mass + listed.rods.inverse_mass[p])
    return mass


@inner
def surface(velocity, spin, arm):
    """Velocity of a body's material point at `arm` from its centre."""
    return add(velocity, cross(spin, arm))


PAIRS = 64
"""Pairs that a thread does at a time: 2 us. With 256, two threads shared out the 660 pairs of S3 as 2 to 1."""


@pass_kernel
def sphere_part_chunk(chunk, particles, shapes, laws, contacts, parts, rods, time_step):
    """Contacts of one chunk of pairs; writes to nothing else."""
    position, velocity, spin = particles.position, particles.velocity, particles.angular_velocity
    mass, radius, material = particles.mass, shapes.radius, shapes.material
    first, second, overlaps = contacts.first, contacts.second, contacts.overlap
    for k in range(chunk * PAIRS, min((chunk + 1) * PAIRS, first.size)):
        i, p = first[k], second[k]
        centre, middle, axis = at(position, i), at(parts.position, p), axis_z(at4(parts.orientation, p))
        size = parts.radius[p]
        if math.isinf(size):
            overlap, normal = sphere_plane(centre, radius[i], middle, axis)
            reduced = radius[i]
            # The whole radius is the arm: a sphere rolls at its own circumference whatever its overlap.
            inset = 0.0
        else:
            overlap, normal = sphere_cylinder(
                centre, radius[i], middle, axis, size, parts.half_length[p], parts.edge_radius[p]
            )
            # Curved one way only: the geometric mean of the two relative radii, r and r R / (r + R).
            reduced = radius[i] * math.sqrt(size / (radius[i] + size))
            inset = 0.5 * overlap
        overlaps[k] = overlap
        if overlap <= 0.0:
            if contacts.stiffness[k] > 0.0:
                forget(contacts, k)
            continue
        arm_i = scaled(normal, inset - radius[i])
        arm_p = sub(add(centre, arm_i), middle)
        spin_i, spin_p = at(spin, i), at(parts.angular_velocity, p)
        relative = sub(surface(at(velocity, i), spin_i, arm_i), surface(at(parts.velocity, p), spin_p, arm_p))
        point_contact(
            contacts,
            k,
            overlap,
            normal,
            reduced,
            mass_beside(mass[i], rods, p),
            inertia_about(particles, i, arm_i),
            law_of(laws, material[i], parts.material[p]),
            relative,
            (spin_i, spin_p),
            (arm_i, arm_p),
            time_step,
        )


@callee
def sphere_part_pass(particles, shapes, laws, contacts, parts, rods, time_step, team):
    """Contacts of spheres with cylinders and planes (parts of infinite radius). `team`: threads, None for one."""
    work = (particles, shapes, laws, contacts, parts, rods, time_step)
    chunks = -(-contacts.first.size // PAIRS)
    if team is None:
        for chunk in range(chunks):
            sphere_part_chunk(chunk, *work)
    else:
        share(sphere_part_chunk, 0, chunks, 1, team, work)
