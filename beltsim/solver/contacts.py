"""The contact passes: one for each pair of shapes, all with the same law. No formula stands here.

Each pass writes only to its own pairs; particles sum their loads afterwards (`steps.sum_loads`), in a fixed order, so
that results do not depend on the number of threads.
"""

from __future__ import annotations

import math

from numba.extending import overload

from beltsim.solver.contact import (
    HertzPair,
    LinearPair,
    damped_normal,
    friction_force,
    line_law,
    point_law,
    rolling_moment,
)
from beltsim.solver.jit import INLINE, callee, inner
from beltsim.solver.ledger import hand_on, note_end, note_friction, note_normal, note_rolling, stored
from beltsim.solver.shapes import (
    box_cylinder,
    sorted_box_axes,
    sphere_box,
    sphere_cylinder,
    sphere_plane,
)
from beltsim.solver.state import LinearLaws
from beltsim.solver.vectors import add, at, at4, axis_z, cross, dot, norm, plus, put, scaled, sub

NONE = (0.0, 0.0, 0.0)


@inner
def put_loads(loads, k, force, torque_first, torque_second):
    """Store the loads of pair k; the force on the second is the opposite of that on the first."""
    for row in range(3):
        loads[row, k] = force[row]
        loads[3 + row, k] = torque_first[row]
        loads[6 + row, k] = torque_second[row]


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
def point_loads(law, overlap, radius, mass, inertia, normal, relative, spins, arms, history, time_step):
    """Loads and new history of a contact of rounded surfaces; nothing but zeros where the overlap is zero.

    Parameters
    ----------
    mass, inertia : reduced mass [kg] and reduced moment of inertia about the contact [kg m2]
    relative : (3,) surface velocity of the first against the second
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
        relative, normal, time_step, spring, old, shear_stiffness, damping, mass, law.friction * pressed
    )
    spin = sub(spins[0], spins[1])
    moment, rolling = resisted(rolling, law, radius, spin, normal, time_step, stiffness, inertia, pressed)
    force = add(scaled(normal, normal_force), tangential)
    torque_1 = add(cross(arms[0], force), moment)
    torque_2 = sub(cross(force, arms[1]), moment)
    return force, moment, torque_1, torque_2, (spring, shear_stiffness, rolling)


@inner
def resisted(rolling, law, radius, spin, normal, time_step, stiffness, inertia, pressed):
    """Rolling moment on the first body and that of its spring; none without a history of it."""
    if rolling is None:
        return NONE, NONE
    arm = law.rolling_friction * radius
    return rolling_moment(
        rolling, spin, normal, time_step, stiffness, arm, law.rolling_damping, inertia, arm * pressed
    )


@inner
def note_point(book, k, law, overlap, radius, normal, relative, spin, old, new, force, moment, time_step):
    """Note what happened in pair k, from the history before and after (see `point_loads`), force and moment."""
    if book is not None:
        elastic, stiffness, _, _ = point_law(law, overlap, radius)
        normal_force = dot(force, normal)
        viscous, approach = normal_force - elastic, -dot(relative, normal)
        note_normal(book, k, stored(elastic, stiffness, overlap), viscous, approach, time_step)
        tangential = plus(force, -normal_force, normal)
        bound = law.friction * max(normal_force, 0.0)
        note_friction(book, k, normal, relative, time_step, old[:2], new[:2], tangential, bound)
        arm = law.rolling_friction * radius
        note_rolling(book, k, normal, spin, time_step, moment, new[2], 2.25 * stiffness * arm * arm)


@inner
def point_contact(contacts, k, overlap, normal, radius, mass, inertia, law, relative, spins, arms, time_step):
    """Loads and history of a touching pair k of rounded surfaces; see `point_loads`."""
    history = (at(contacts.spring, k), contacts.stiffness[k], at(contacts.rolling, k))
    force, moment, torque_1, torque_2, new = point_loads(
        law, overlap, radius, mass, inertia, normal, relative, spins, arms, history, time_step
    )
    put(contacts.spring, k, new[0])
    contacts.stiffness[k] = new[1]
    put(contacts.rolling, k, new[2])
    put_loads(contacts.loads, k, force, torque_1, torque_2)
    spin = sub(spins[0], spins[1])
    note_point(
        contacts.book, k, law, overlap, radius, normal, relative, spin, history, new, force, moment, time_step
    )


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
def inertia_about(particles, i, arm):
    """Least moment of inertia [kg m2] of particle i about an axis across the arm at its end; held ones have it too."""
    inertia = particles.inertia
    least = min(inertia[0, i], min(inertia[1, i], inertia[2, i]))
    return least + particles.mass[i] * dot(arm, arm)


@inner
def reduced_inertia(particles, i, arm_i, j, arm_j):
    """Reduced moment of inertia [kg m2] of particles i and j about their contact, as `reduced_mass`."""
    first, second = inertia_about(particles, i, arm_i), inertia_about(particles, j, arm_j)
    inverse = particles.mobility[0, i] / first + particles.mobility[0, j] / second
    return 1.0 / inverse if inverse > 0.0 else first


@inner
def surface(velocity, spin, arm):
    """Velocity of a body's material point at `arm` from its centre."""
    return add(velocity, cross(spin, arm))


@callee
def sphere_box_pass(particles, shapes, laws, contacts, time_step):
    """Contacts of spheres with rounded boxes; the bonded boxes of a belt are one surface.

    Boxes of a belt overlap, so a sphere near a seam lies on two or four of them. Only a box that the sphere overlaps
    more deeply than its bonded neighbours carries it, and the history is handed on: a sphere that rolls over a flat
    belt feels no seam, since the deepest one keeps force and normal continuous there (weighting all boxes by their
    overlap dips by several per cent beside each seam), while one wedged between a belt's wings still touches both.
    """
    position, orientation, core = particles.position, particles.orientation, shapes.core
    radius, start = shapes.radius, contacts.start
    first, second, overlaps = contacts.first, contacts.second, contacts.overlap
    for i in range(start.size - 1):
        for k in range(start[i], start[i + 1]):
            j = second[k]
            overlap, _ = sphere_box(
                at(position, i), radius[i], at(position, j), at4(orientation, j), at(core, j), radius[j]
            )
            overlaps[k] = overlap
        for k in range(start[i], start[i + 1]):
            if is_deepest(contacts, k):
                inherit(contacts, k)
        for k in range(start[i], start[i + 1]):
            if is_deepest(contacts, k):
                sphere_on_box(particles, shapes, laws, contacts, k, first[k], second[k], time_step)
            elif contacts.stiffness[k] > 0.0:
                forget(contacts, k)


@inner
def is_deepest(contacts, k):
    """Whether pair k touches and no bonded neighbour of its box overlaps more; equals go to the lower pair."""
    overlap = contacts.overlap[k]
    if overlap <= 0.0:
        return False
    for n in range(4):
        other = contacts.beside[n, k]
        if other >= 0:
            rival = contacts.overlap[other]
            if rival > overlap or (rival == overlap and other < k):
                return False
    return True


@inner
def inherit(contacts, k):
    """Hand the history of a bonded neighbour that carries no more on to pair k, which begins to carry."""
    if contacts.stiffness[k] > 0.0:
        return
    for n in range(4):
        other = contacts.beside[n, k]
        if other >= 0 and contacts.stiffness[other] > 0.0 and not is_deepest(contacts, other):
            contacts.stiffness[k] = contacts.stiffness[other]
            put(contacts.spring, k, at(contacts.spring, other))
            put(contacts.rolling, k, at(contacts.rolling, other))
            hand_on(contacts.book, k, other)
            return


@inner
def sphere_on_box(particles, shapes, laws, contacts, k, i, j, time_step):
    """Loads of the sphere i on the box j, a flat face for the sphere's radius."""
    centre, box_centre = at(particles.position, i), at(particles.position, j)
    radius = shapes.radius[i]
    overlap, normal = sphere_box(
        centre, radius, box_centre, at4(particles.orientation, j), at(shapes.core, j), shapes.radius[j]
    )
    arm_i = scaled(normal, 0.5 * overlap - radius)
    arm_j = sub(add(centre, arm_i), box_centre)
    spin_i, spin_j = at(particles.angular_velocity, i), at(particles.angular_velocity, j)
    velocity_i = surface(at(particles.velocity, i), spin_i, arm_i)
    velocity_j = surface(at(particles.velocity, j), spin_j, arm_j)
    point_contact(
        contacts,
        k,
        overlap,
        normal,
        radius,
        reduced_mass(particles.mass, particles.mobility, i, j),
        reduced_inertia(particles, i, arm_i, j, arm_j),
        law_of(laws, shapes.material[i], shapes.material[j]),
        sub(velocity_i, velocity_j),
        (spin_i, spin_j),
        (arm_i, arm_j),
        time_step,
    )


@callee
def sphere_part_pass(particles, shapes, laws, contacts, parts, time_step):
    """Contacts of spheres with cylinders and planes (parts of infinite radius)."""
    position, velocity, spin = particles.position, particles.velocity, particles.angular_velocity
    mass, radius, material = particles.mass, shapes.radius, shapes.material
    first, second, overlaps = contacts.first, contacts.second, contacts.overlap
    for k in range(first.size):
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
            mass[i],
            inertia_about(particles, i, arm_i),
            law_of(laws, material[i], parts.material[p]),
            relative,
            (spin_i, spin_p),
            (arm_i, arm_p),
            time_step,
        )


@callee
def box_cylinder_pass(particles, shapes, laws, contacts, parts, time_step):
    """Line contacts of rounded boxes with cylinders."""
    position, velocity, spin = particles.position, particles.velocity, particles.angular_velocity
    orientation, mass, core = particles.orientation, particles.mass, shapes.core
    first, second, overlaps, loads = contacts.first, contacts.second, contacts.overlap, contacts.loads
    for k in range(first.size):
        i, p = first[k], second[k]
        centre, middle, axis = at(position, i), at(parts.position, p), axis_z(at4(parts.orientation, p))
        area, length, normal, point = box_cylinder(
            centre,
            at4(orientation, i),
            at(core, i),
            shapes.radius[i],
            middle,
            axis,
            parts.radius[p],
            parts.half_length[p],
        )
        overlaps[k] = area / length if length > 0.0 else -1.0
        if length <= 0.0:
            if contacts.stiffness[k] > 0.0:
                forget(contacts, k)
            continue
        arm_i, arm_p = sub(point, centre), sub(point, middle)
        relative = sub(
            surface(at(velocity, i), at(spin, i), arm_i),
            surface(at(parts.velocity, p), at(parts.angular_velocity, p), arm_p),
        )
        law = law_of(laws, shapes.material[i], parts.material[p])
        whole = 2.0 * norm(sorted_box_axes(at4(orientation, i), at(core, i), axis)[0])
        elastic, stiffness, shear_stiffness, damping = line_law(law, area, length, whole)
        approach = -dot(relative, normal)
        normal_force = damped_normal(elastic, stiffness, damping, mass[i], approach)
        energy = stored(elastic, stiffness, overlaps[k])
        note_normal(contacts.book, k, energy, normal_force - elastic, approach, time_step)
        bound = law.friction * max(normal_force, 0.0)
        force = scaled(normal, normal_force)
        force = touch(
            contacts, k, force, normal, shear_stiffness, damping, mass[i], bound, relative, time_step
        )
        put_loads(loads, k, force, cross(arm_i, force), cross(force, arm_p))
