"""The pass over pairs of rounded boxes: belt on belt, the edges of a pipe, loose boxes.

Damping acts where the foundation presses, so that it stops rocking too, and in proportion to its stiffness: a pair
takes the share of the reduced mass that its stiffness has in that of a whole face. So a box that falls flat on a belt
has the restitution e however many cells of the belt it meets, for the reduced mass 1 / (1 / m_1 + 1 / m_2) of two
boxes, what is held being infinitely heavy; a box that strikes with an edge or a corner rebounds with more. Friction
acts at the centre of the pressure with one spring a pair; boxes have no rolling resistance.
"""

from __future__ import annotations

import math

import numpy as np

from beltsim.solver.box_box import box_box, face_area, thinnest
from beltsim.solver.contact import face_law
from beltsim.solver.contacts import NONE, forget, law_of, put_loads, reduced_mass, surface, touch
from beltsim.solver.jit import inner, maker, pass_kernel
from beltsim.solver.ledger import note_normal
from beltsim.solver.shapes import sphere_box
from beltsim.solver.vectors import add, at, at4, cross, dot, norm, plus, scaled, sub


@inner
def body_of(particles, k):
    """Position, orientation, velocity and spin of particle k."""
    return (
        at(particles.position, k),
        at4(particles.orientation, k),
        at(particles.velocity, k),
        at(particles.angular_velocity, k),
    )


@inner
def half_thickness(core, edge_radius):
    """Half of the outer size of a box in its thinnest direction [m]."""
    return core[thinnest(core)] + edge_radius


@pass_kernel
def box_box_pass(particles, shapes, laws, contacts, time_step):
    """Contacts between rounded boxes."""
    first, second, radius = contacts.first, contacts.second, shapes.radius
    for k in range(first.size):
        i, j = first[k], second[k]
        body_i, body_j = body_of(particles, i), body_of(particles, j)
        core_i, core_j = at(shapes.core, i), at(shapes.core, j)
        energy, elastic, viscous, area, point = box_box(body_i, core_i, radius[i], body_j, core_j, radius[j])
        pressure = norm(elastic[0])
        if area <= 0.0 or pressure <= 0.0:
            contacts.overlap[k] = -1.0
            if contacts.stiffness[k] > 0.0:
                forget(contacts, k)
            continue
        contacts.overlap[k] = pressure / area
        face = min(face_area(core_i, radius[i]), face_area(core_j, radius[j]))
        thickness = 0.5 * (half_thickness(core_i, radius[i]) + half_thickness(core_j, radius[j]))
        law = law_of(laws, shapes.material[i], shapes.material[j])
        modulus, shear_modulus, damping = face_law(law, thickness, face)
        mass = reduced_mass(particles.mass, particles.mobility, i, j) * area / face
        resistance = 2.0 * damping * math.sqrt(mass * modulus / area)
        force, torque_i, torque_j = total(modulus, elastic, resistance, viscous)
        # The power of the damping as one force and one speed of its size.
        power = max(0.0, -resistance * power_of(viscous, body_i, body_j))
        share = math.sqrt(power)
        note_normal(contacts.book, k, modulus * energy, share, share, time_step)

        normal = scaled(elastic[0], 1.0 / pressure)
        arm_i, arm_j = sub(point, body_i[0]), sub(point, body_j[0])
        relative = sub(surface(body_i[2], body_i[3], arm_i), surface(body_j[2], body_j[3], arm_j))
        bound = law.friction * max(dot(force, normal), 0.0)
        shear = shear_modulus * area
        friction = touch(contacts, k, NONE, normal, shear, damping, mass, bound, relative, time_step)
        put_loads(
            contacts.loads,
            k,
            add(force, friction),
            add(torque_i, cross(arm_i, friction)),
            sub(torque_j, cross(arm_j, friction)),
        )


@inner
def power_of(loads, body_i, body_j):
    """Power of a force on the first body, its opposite on the second, and two torques."""
    power = dot(loads[0], sub(body_i[2], body_j[2]))
    return power + dot(loads[1], body_i[3]) + dot(loads[2], body_j[3])


@inner
def total(modulus, elastic, resistance, viscous):
    """Force and both torques of the foundation and its damping."""
    return (
        plus(scaled(elastic[0], modulus), resistance, viscous[0]),
        plus(scaled(elastic[1], modulus), resistance, viscous[1]),
        plus(scaled(elastic[2], modulus), resistance, viscous[2]),
    )


@maker
def box_energies(particles, shapes, laws, first, second):
    """Elastic energy [J] of pairs of boxes, (pairs,); above 0 just where they touch or overlap."""
    energies = np.zeros(first.size)
    radius = shapes.radius
    for k in range(first.size):
        i, j = first[k], second[k]
        core_i, core_j = at(shapes.core, i), at(shapes.core, j)
        energy, _, _, _, _ = box_box(
            body_of(particles, i), core_i, radius[i], body_of(particles, j), core_j, radius[j]
        )
        face = min(face_area(core_i, radius[i]), face_area(core_j, radius[j]))
        thickness = 0.5 * (half_thickness(core_i, radius[i]) + half_thickness(core_j, radius[j]))
        modulus, _, _ = face_law(law_of(laws, shapes.material[i], shapes.material[j]), thickness, face)
        energies[k] = modulus * energy
    return energies


@maker
def pairs_overlap(particles, shapes, first, second):
    """Which pairs of boxes and spheres touch or overlap, (pairs,) bool."""
    overlap = np.zeros(first.size, np.bool_)
    radius = shapes.radius
    for k in range(first.size):
        i, j = first[k], second[k]
        core_i, core_j = at(shapes.core, i), at(shapes.core, j)
        body_i, body_j = body_of(particles, i), body_of(particles, j)
        if max(core_i) == 0.0:
            depth, _ = sphere_box(body_i[0], radius[i], body_j[0], body_j[1], core_j, radius[j])
        elif max(core_j) == 0.0:
            depth, _ = sphere_box(body_j[0], radius[j], body_i[0], body_i[1], core_i, radius[i])
        else:
            _, _, _, depth, _ = box_box(body_i, core_i, radius[i], body_j, core_j, radius[j])
        overlap[k] = depth > 0.0
    return overlap


__all__ = ["box_box_pass", "box_energies", "pairs_overlap"]
