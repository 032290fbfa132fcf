"""Cylinder particles that fly: particles to what moves them, parts to what touches them.

Their part follows them before the forces and gives its loads back after, so that spheres and boxes touch them as they
touch any roller. What is left stands here: cylinders that fly against planes, rollers and one another.

Each half of a cylinder is a contact of its own, so that both together resist a tilt and a turn. Along the axis it is a
row of discs: where they overlap the other body, the integral of the overlap is a line contact, and the force does not
jump under a tilt. The flat end adds its centre and three points of its rim, which carry a cylinder that stands, as a
rigid punch would, by the square of the sine of the angle between end and axis.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from beltsim.solver.contact import damped_normal, line_law
from beltsim.solver.contacts import NONE, forget, law_of, put_loads, resisted, surface, touch
from beltsim.solver.jit import callee, inner, pass_kernel
from beltsim.solver.ledger import note_normal, note_rolling
from beltsim.solver.shapes import any_normal, sphere_cylinder, sphere_plane
from beltsim.solver.state import Array
from beltsim.solver.vectors import (
    add,
    at,
    at4,
    axis_z,
    cross,
    dot,
    norm,
    plus,
    put,
    put4,
    scaled,
    sub,
)
from beltsim.solver.wall_contacts import moved_mass

THIRDS = 40  # steps of the search for the deepest disc: 1e-7 of the half length
HALVINGS = 30
RIM = math.sqrt(0.75)


class Rods(NamedTuple):
    """Cylinder particles that fly."""

    particle: Array  # (f,) int32
    part: Array  # (f,) int32, its part
    inverse_mass: Array  # (p,) 1/kg of all parts; 0: as heavy as can be


@callee
def follow_rods(particles, parts, listed):
    """Bring the parts of cylinders that fly to where those are."""
    if listed is not None:
        rods = listed.rods
        for n in range(rods.particle.size):
            i, p = rods.particle[n], rods.part[n]
            put(parts.position, p, at(particles.position, i))
            put(parts.velocity, p, at(particles.velocity, i))
            put(parts.angular_velocity, p, at(particles.angular_velocity, i))
            put4(parts.orientation, p, at4(particles.orientation, i))


@callee
def load_rods(particles, parts, listed):
    """Give the loads on the parts of cylinders that fly to those."""
    if listed is not None:
        rods = listed.rods
        for n in range(rods.particle.size):
            i, p = rods.particle[n], rods.part[n]
            put(particles.force, i, add(at(particles.force, i), at(parts.force, p)))
            put(particles.torque, i, add(at(particles.torque, i), at(parts.torque, p)))


@inner
def ball_on_part(centre, radius, parts, p):
    """Overlap and normal of a ball and a cylinder or plane p."""
    middle, axis = at(parts.position, p), axis_z(at4(parts.orientation, p))
    if math.isinf(parts.radius[p]):
        return sphere_plane(centre, radius, middle, axis)
    return sphere_cylinder(
        centre, radius, middle, axis, parts.radius[p], parts.half_length[p], parts.edge_radius[p]
    )


@inner
def disc_on_part(place, rod, parts, p):
    """Overlap and normal of a cylinder's disc at a place [m] along its axis; `rod`: centre, axis, radius, edge."""
    centre, axis, radius, edge = rod
    overlap, normal = ball_on_part(plus(centre, place, axis), radius, parts, p)
    lean = dot(normal, axis)
    return overlap - (radius - edge) * (1.0 - math.sqrt(max(0.0, 1.0 - lean * lean))), normal


@inner
def deepest_disc(rod, length, parts, p):
    """Place of the disc that overlaps part p most: the overlap has one maximum along the axis, as both are convex."""
    low, high = 0.0, length
    for _ in range(THIRDS):
        third = (high - low) / 3.0
        if disc_on_part(low + third, rod, parts, p)[0] < disc_on_part(high - third, rod, parts, p)[0]:
            low += third
        else:
            high -= third
    return low if high < 0.5 * length else high


@inner
def end_of_overlap(inside, outside, rod, parts, p):
    """Place between an overlapping disc and the end `outside` where the overlap ends."""
    if disc_on_part(outside, rod, parts, p)[0] > 0.0:
        return outside
    for _ in range(HALVINGS):
        middle = 0.5 * (inside + outside)
        if disc_on_part(middle, rod, parts, p)[0] > 0.0:
            inside = middle
        else:
            outside = middle
    return inside


@inner
def surface_point(place, rod, normal):
    """The point of a cylinder's disc that lies farthest against a normal."""
    centre, axis, radius, edge = rod
    flat = plus(normal, -dot(normal, axis), axis)
    size = norm(flat)
    outward = scaled(flat, 1.0 / size) if size > 1e-12 else any_normal(axis)
    return plus(plus(plus(centre, place, axis), edge - radius, outward), -edge, normal)


@inner
def line_on_part(rod, length, parts, p):
    """Line contact of the discs: overlap integral [m2], length [m], normal, point and integral of o^2 [m3]."""
    deepest = deepest_disc(rod, length, parts, p)
    if disc_on_part(deepest, rod, parts, p)[0] <= 0.0:
        return 0.0, 0.0, NONE, NONE, 0.0
    a = end_of_overlap(deepest, 0.0, rod, parts, p)
    b = end_of_overlap(deepest, length, rod, parts, p)
    middle, sixth = 0.5 * (a + b), (b - a) / 6.0
    # Simpson's rule: exact on planes and parallel rollers, where the overlap is linear.
    low = max(0.0, disc_on_part(a, rod, parts, p)[0])
    mean = 4.0 * max(0.0, disc_on_part(middle, rod, parts, p)[0])
    high = max(0.0, disc_on_part(b, rod, parts, p)[0])
    area = sixth * (low + mean + high)
    if area <= 0.0:
        return 0.0, 0.0, NONE, NONE, 0.0
    place = sixth * (low * a + mean * middle + high * b) / area
    normal = disc_on_part(place, rod, parts, p)[1]
    squares = sixth * (low * low + 0.25 * mean * mean + high * high)
    return area, b - a, normal, surface_point(place, rod, normal), squares


@inner
def half_on_part(rod, length, parts, p):
    """Contact of half a cylinder, from its middle to the end that its axis points to, with part p.

    The end's stiffness grows with its angle, so it pulls the cylinder upright with the couple that makes it store what
    it takes: without it an impact on a rim gained or lost 2 % of its energy.

    Returns
    -------
    area, length, normal, point : as of `shapes.box_cylinder`
    squares : integral of the squared overlap [m3], twice the energy stored over the stiffness per length
    couple : (3,) on the cylinder [m3], over that stiffness
    """
    centre, axis, radius, edge = rod
    area, extent, normal, point, squares = line_on_part(rod, length, parts, p)
    push, moment, total = scaled(normal, area), scaled(point, area), area
    end = plus(centre, length, axis)
    _, towards = ball_on_part(end, edge, parts, p)
    facing = -dot(towards, axis)
    couple = NONE
    if facing > 0.0:
        share = facing * facing * 2.0 * radius / math.pi
        down = plus(sub(surface_point(length, rod, towards), end), edge, towards)
        side = cross(axis, down)
        for n in range(4):
            corner = end
            if n == 1:
                corner = add(end, down)
            elif n > 1:
                corner = plus(plus(end, -0.5, down), RIM if n == 2 else -RIM, side)
            overlap, outward = ball_on_part(corner, edge, parts, p)
            if overlap > 0.0:
                part = share * overlap
                push, total, extent = plus(push, part, outward), total + part, extent + share
                moment = plus(moment, part, plus(corner, -edge, outward))
                squares += part * overlap
                couple = plus(couple, part * overlap / facing, cross(axis, towards))
    size = norm(push)
    if size <= 0.0:
        return 0.0, 0.0, NONE, NONE, 0.0, NONE
    return size, extent, scaled(push, 1.0 / size), scaled(moment, 1.0 / total), squares, couple


@inner
def resisted_roll(
    contacts, k, law, rod, other, spin, normal, softened, stiffness, inertia, pressed, time_step
):
    """Rolling moment on half a cylinder, which rolls about its axis only: its length resists all other turns.

    `other` is the radius of what it rolls on, `inertia` that of the whole cylinder about the line; see `resisted`.
    """
    _, axis, radius, _ = rod
    reduced = radius if math.isinf(other) else radius * other / (radius + other)
    rolls = scaled(axis, dot(spin, axis))
    moment, spring = resisted(
        at(contacts.rolling, k),
        law,
        reduced,
        rolls,
        normal,
        time_step,
        stiffness,
        softened,
        0.5 * inertia,
        pressed,
    )
    arm = law.rolling_friction * reduced
    note_rolling(contacts.book, k, normal, rolls, time_step, moment, spring, 2.25 * stiffness * arm * arm)
    put(contacts.rolling, k, spring)
    return moment


@pass_kernel
def rod_pass(particles, shapes, laws, contacts, parts, rods, time_step):
    """Contacts of both halves of cylinders that fly with parts; `contacts.beside[0]` is 0 or 1, which half."""
    for k in range(contacts.first.size):
        i, p = contacts.first[k], contacts.second[k]
        core, edge, centre = at(shapes.core, i), shapes.radius[i], at(particles.position, i)
        axis = scaled(axis_z(at4(particles.orientation, i)), 2.0 * contacts.beside[0, k] - 1.0)
        rod = centre, axis, core[0] + edge, edge
        area, length, normal, point, squares, couple = half_on_part(rod, core[2], parts, p)
        contacts.overlap[k] = area / length if length > 0.0 else -1.0
        if length <= 0.0:
            if contacts.stiffness[k] > 0.0:
                forget(contacts, k)
            continue
        arm_i, arm_p = sub(point, centre), sub(point, at(parts.position, p))
        spin_i, spin_p = at(particles.angular_velocity, i), at(parts.angular_velocity, p)
        relative = sub(
            surface(at(particles.velocity, i), spin_i, arm_i), surface(at(parts.velocity, p), spin_p, arm_p)
        )
        law = law_of(laws, shapes.material[i], parts.material[p])
        mass = 1.0 / (1.0 / moved_mass(particles, i, arm_i, normal) + rods.inverse_mass[p])
        elastic, stiffness, shear_stiffness, damping = line_law(law, area, length, 2.0 * (core[2] + edge))
        approach = -dot(relative, normal)
        normal_force = damped_normal(elastic, stiffness, damping, mass, approach)
        per_length = elastic / area
        note_normal(contacts.book, k, 0.5 * per_length * squares, normal_force - elastic, approach, time_step)
        pressed, force = max(normal_force, 0.0), scaled(normal, normal_force)
        bound, old = law.friction * pressed, contacts.stiffness[k]
        inertia = particles.inertia[2, i] + particles.mass[i] * rod[2] * rod[2]
        moment = resisted_roll(
            contacts,
            k,
            law,
            rod,
            parts.radius[p],
            sub(spin_i, spin_p),
            normal,
            shear_stiffness / old if shear_stiffness < old else 1.0,
            stiffness,
            inertia,
            pressed,
            time_step,
        )
        force = touch(contacts, k, force, normal, shear_stiffness, damping, mass, bound, relative, time_step)
        couple = add(scaled(couple, per_length), moment)
        put_loads(
            contacts.loads, k, force, add(cross(arm_i, force), couple), sub(cross(force, arm_p), couple)
        )
