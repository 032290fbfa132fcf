"""The passes over walls: spheres and the corners of rounded boxes on triangles, boxes on planes, wall points on boxes.

A contact stands where the distance from the ball's centre to the surface has a minimum of its own. So a triangle that
is touched inside its face carries, one that is touched on an edge or a vertex carries only if no neighbour comes closer
there, and of equals the lowest: faces beat edges, edges beat vertices, a shared edge or vertex counts once, and two
walls of a corner both push. Faces that meet at less than `SMOOTH` (a rounded chute cut into facets) count as one, the
deepest carries: beyond an overlap of SMOOTH^2 / 2 = 2 % of the radius, two such contacts would be one patch and count
twice. What begins to carry takes over the history of a neighbour that no longer does.

A rounded box touches with its eight corners, balls of its edge radius, and with the points of folds and rims of meshes
that poke into its faces and edges; on a plane the corners are exact.
"""

from __future__ import annotations

import math

from beltsim.solver.contact import corner_law, damped_normal
from beltsim.solver.contacts import (
    NONE,
    forget,
    inertia_about,
    law_of,
    point_contact,
    put_loads,
    surface,
    touch,
)
from beltsim.solver.jit import callee, inner, pass_kernel
from beltsim.solver.ledger import hand_on, note_normal, stored
from beltsim.solver.shapes import sphere_box, sphere_plane
from beltsim.solver.stretches import place_of
from beltsim.solver.triangles import nearest_on_triangle, sphere_triangle
from beltsim.solver.vectors import (
    across,
    add,
    at,
    at4,
    axis_z,
    cross,
    dot,
    norm,
    plus,
    put,
    rotate,
    rotate_back,
    scaled,
    sub,
)
from beltsim.solver.wall_pairs import corners_of, into_part, is_in_reach

SMOOTH = 0.2  # rad
SAME_POINT = 1e-3  # of the ball's radius: T-joints meet within the tolerance of welding only


@pass_kernel
def wall_pass(particles, shapes, laws, contacts, feelers, walls, parts, slides, time_step):
    """Contacts of feelers with walls; rows of `contacts` are feelers.

    `beside[0]` holds who carries, 1 or 0; `beside[1]`, from the start of each row on, the pairs that touch.
    `slides` tells which parts only run: their velocity is that of their surface.
    """
    find_carriers(particles, shapes, laws, contacts, feelers, walls, parts)
    push_feelers(particles, shapes, laws, contacts, feelers, walls, parts, slides, time_step)


@inner
def rows_of_particle(particle, row):
    """Past-last row of the feelers of the particle that row begins with: one for a sphere, eight for a box."""
    after = row + 1
    while after < particle.size and particle[after] == particle[row]:
        after += 1
    return after


@callee
def push_feelers(particles, shapes, laws, contacts, feelers, walls, parts, slides, time_step):
    """Loads of all spheres and boxes on the walls that carry them or their corners."""
    start, row = contacts.start, 0
    while row < feelers.particle.size:
        rows = row, rows_of_particle(feelers.particle, row)
        row = rows[1]
        if start[rows[1]] == start[rows[0]]:
            continue
        if rows[1] - rows[0] == 1:
            sphere_on_walls(particles, shapes, laws, contacts, walls, parts, slides, rows[0], time_step)
        else:
            box_on_walls(particles, shapes, laws, contacts, feelers, walls, parts, slides, rows, time_step)


@inner
def feeler_centre(particles, feelers, row):
    """Centre of a feeler in the world."""
    i = feelers.particle[row]
    return add(at(particles.position, i), rotate(at4(particles.orientation, i), at(feelers.offset, row)))


@inner
def part_of_wall(walls, s):
    """Part of wall s: a triangle, or beyond those a plane."""
    return walls.part[s] if s < walls.part.size else s - walls.part.size


@callee
def find_carriers(particles, shapes, laws, contacts, feelers, walls, parts):
    """Mark which walls carry each feeler; what ends hands its history on or loses it.

    The normals of those that carry are left where the force will stand, in the first rows of the loads.
    """
    start, second, stiffness = contacts.start, contacts.second, contacts.stiffness
    loads, carries, triangles = contacts.loads, contacts.beside, walls.part.size
    for row in range(feelers.particle.size):
        begin, end = start[row], start[row + 1]
        if begin == end:
            continue
        last = find_touching(particles, shapes, laws, contacts, feelers, walls, parts, row)
        for n in range(begin, last):
            k = carries[1, n]
            own = second[k] >= triangles or is_own_minimum(
                particles, shapes, contacts, feelers, walls, parts, row, n, last
            )
            carries[0, k] = 1 if own else 0
        for n in range(begin, last):
            k = carries[1, n]
            if carries[0, k] == 1 and stiffness[k] == 0.0 and second[k] < triangles:
                inherit_from_beside(contacts, walls, k, begin, end)
            elif carries[0, k] == 0:
                put(loads, k, NONE)
        for k in range(begin, end):
            if carries[0, k] == 0 and stiffness[k] > 0.0:
                forget(contacts, k)


@inner
def find_touching(particles, shapes, laws, contacts, feelers, walls, parts, row):
    """Overlaps of a feeler and the walls near it; the pairs that touch are noted in order in `beside[1]`.

    Returns the place after the last note. A triangle whose ball is out of reach is not looked at: most of them.
    """
    second, overlaps, beside = contacts.second, contacts.overlap, contacts.beside
    i = feelers.particle[row]
    centre, radius = feeler_centre(particles, feelers, row), shapes.radius[i]
    last, frame, local, normal = contacts.start[row], -1, centre, NONE
    for k in range(contacts.start[row], contacts.start[row + 1]):
        s, overlap = second[k], -1.0
        p = part_of_wall(walls, s)
        if s >= walls.part.size:
            axis = axis_z(at4(parts.orientation, p))
            overlap, normal = sphere_plane(centre, radius, at(parts.position, p), axis)
        else:
            if p != frame:
                frame, local = p, into_part(centre, parts, p)
            if is_in_reach(local, radius, walls.ball, s):
                overlap, normal = sphere_triangle(local, radius, *corners_of(walls, s))
                normal = rotate(at4(parts.orientation, p), normal)
        if beside[0, k] == 1:  # it carried in the step before
            put_loads(contacts.loads, k, NONE, NONE, NONE)
        beside[0, k] = 0
        overlaps[k] = -1.0
        if overlap > 0.0 and have_law(laws, shapes, parts, i, p):
            overlaps[k], beside[1, last] = overlap, k
            put(contacts.loads, k, normal)
            last += 1
    return last


@inner
def have_law(laws, shapes, parts, i, p):
    """Whether particle i and part p have a contact property: without one, what is held may lie in a wall."""
    return laws[0][shapes.material[i], parts.material[p]] > 0.0


@inner
def is_own_minimum(particles, shapes, contacts, feelers, walls, parts, row, n, last):
    """Whether no neighbouring triangle takes note n of those that touch the feeler over."""
    second, overlaps, noted = contacts.second, contacts.overlap, contacts.beside
    k = noted[1, n]
    t, own = second[k], overlaps[k]
    for m in range(contacts.start[row], last):
        other = noted[1, m]
        if overlaps[other] < own or (overlaps[other] == own and other >= k):
            continue
        link = place_of(walls.beside, second[other], walls.beside_start[t], walls.beside_start[t + 1])
        if link >= 0 and is_taken_over(particles, shapes, feelers, walls, parts, row, t, link):
            return False
    return True


@inner
def is_taken_over(particles, shapes, feelers, walls, parts, row, t, link):
    """Whether the neighbour of triangle t at `link`, which comes closer to a feeler, stands for t as well."""
    local = into_part(feeler_centre(particles, feelers, row), parts, walls.part[t])
    nearest, in_face = nearest_on_triangle(local, *corners_of(walls, t))
    if in_face:
        return walls.alike[link]
    there, _ = nearest_on_triangle(nearest, *corners_of(walls, walls.beside[link]))
    return norm(sub(there, nearest)) < SAME_POINT * shapes.radius[feelers.particle[row]]


@inner
def inherit_from_beside(contacts, walls, k, begin, end):
    """Hand the history of a neighbouring triangle that carries no more on to pair k."""
    t = contacts.second[k]
    for n in range(walls.beside_start[t], walls.beside_start[t + 1]):
        other = place_of(contacts.second, walls.beside[n], begin, end)
        if other >= 0 and contacts.stiffness[other] > 0.0 and contacts.beside[0, other] == 0:
            contacts.stiffness[k] = contacts.stiffness[other]
            put(contacts.spring, k, at(contacts.spring, other))
            put(contacts.rolling, k, at(contacts.rolling, other))
            hand_on(contacts.book, k, other)
            forget(contacts, other)
            return


@inner
def wall_velocity(parts, slides, p, arm, normal):
    """Velocity of the surface of part p at `arm` from its centre; a belt that only runs runs along itself."""
    velocity = at(parts.velocity, p)
    if slides.moves[p] == 0.0:
        velocity = across(velocity, normal)
    return surface(velocity, at(parts.angular_velocity, p), arm)


@inner
def press(slides, p, loads, k, normal):
    """Set apart what pair k presses on a part that only runs: its surface does no work across itself."""
    if slides.moves[p] == 0.0:
        force = dot(at(loads, k), normal)
        put(slides.pressing, p, plus(at(slides.pressing, p), -force, normal))


@inner
def sphere_on_walls(particles, shapes, laws, contacts, walls, parts, slides, row, time_step):
    """Loads of a sphere on the walls that carry it."""
    for k in range(contacts.start[row], contacts.start[row + 1]):
        if not contacts.beside[0, k]:
            continue
        i, s = contacts.first[k], contacts.second[k]
        p, centre, radius = part_of_wall(walls, s), at(particles.position, i), shapes.radius[i]
        normal = at(contacts.loads, k)
        # The whole radius is the arm: a sphere rolls at its own circumference whatever its overlap.
        arm = scaled(normal, -radius)
        arm_p = sub(add(centre, arm), at(parts.position, p))
        spin = at(particles.angular_velocity, i)
        relative = sub(
            surface(at(particles.velocity, i), spin, arm), wall_velocity(parts, slides, p, arm_p, normal)
        )
        point_contact(
            contacts,
            k,
            contacts.overlap[k],
            normal,
            radius,
            particles.mass[i],
            inertia_about(particles, i, arm),
            law_of(laws, shapes.material[i], parts.material[p]),
            relative,
            (spin, at(parts.angular_velocity, p)),
            (arm, arm_p),
            time_step,
        )
        press(slides, p, contacts.loads, k, normal)


@inner
def face_side(core, radius):
    """Root of the area of a rounded box's largest flat face, never below the edge radius [m]."""
    area = 4.0 * max(core[0] * core[1], max(core[1] * core[2], core[2] * core[0]))
    return math.sqrt(max(area, radius * radius))


@inner
def moved_mass(particles, i, arm, normal):
    """Mass [kg] that particle i shows to a push along `normal` at `arm` from its centre, if it is free."""
    lever = rotate_back(at4(particles.orientation, i), cross(arm, normal))
    inverse = 1.0 / particles.mass[i]
    for axis in range(3):
        inverse += particles.mobility[1, i] * lever[axis] * lever[axis] / particles.inertia[axis, i]
    return 1.0 / inverse


@inner
def box_on_walls(particles, shapes, laws, contacts, feelers, walls, parts, slides, rows, time_step):
    """Loads of a box on the walls that carry its corners.

    The damping of all corners together is that of one spring: the mass that counts is the one at the middle of the
    corners' stiffness, shared out by stiffness. So a box that falls flat rebounds as given, and so does one on an edge.
    """
    row, after = rows
    row, after = rows
    i = feelers.particle[row]
    radius, side = shapes.radius[i], face_side(at(shapes.core, i), shapes.radius[i])
    total, moment = 0.0, NONE
    for r in range(row, after):
        centre = feeler_centre(particles, feelers, r)
        for k in range(contacts.start[r], contacts.start[r + 1]):
            if contacts.beside[0, k]:
                law = law_of(
                    laws, shapes.material[i], parts.material[part_of_wall(walls, contacts.second[k])]
                )
                _, stiffness, _, _ = corner_law(law, contacts.overlap[k], radius, side)
                total += stiffness
                moment = plus(moment, stiffness, sub(centre, at(particles.position, i)))
    if total == 0.0:  # no corner carries
        return
    middle = scaled(moment, 1.0 / total)
    for r in range(row, after):
        centre = feeler_centre(particles, feelers, r)
        for k in range(contacts.start[r], contacts.start[r + 1]):
            if contacts.beside[0, k]:
                s = contacts.second[k]
                p = part_of_wall(walls, s)
                overlap, normal = contacts.overlap[k], at(contacts.loads, k)
                law = law_of(laws, shapes.material[i], parts.material[p])
                _, stiffness, _, _ = corner_law(law, overlap, radius, side)
                mass = moved_mass(particles, i, middle, normal) * stiffness / total
                point = plus(centre, -radius, normal)
                corner_contact(
                    particles,
                    contacts,
                    k,
                    i,
                    p,
                    point,
                    overlap,
                    normal,
                    (radius, side, mass),
                    law,
                    slides,
                    parts,
                    time_step,
                )


@inner
def corner_contact(particles, contacts, k, i, p, point, overlap, normal, body, law, slides, parts, time_step):
    """Loads and history of pair k, a corner of box i on part p at a point. `body` = edge radius, face side, mass."""
    radius, side, mass = body
    arm, arm_p = sub(point, at(particles.position, i)), sub(point, at(parts.position, p))
    relative = sub(
        surface(at(particles.velocity, i), at(particles.angular_velocity, i), arm),
        wall_velocity(parts, slides, p, arm_p, normal),
    )
    elastic, stiffness, shear_stiffness, damping = corner_law(law, overlap, radius, side)
    approach = -dot(relative, normal)
    normal_force = damped_normal(elastic, stiffness, damping, mass, approach)
    energy = stored(elastic, stiffness, overlap)
    note_normal(contacts.book, k, energy, normal_force - elastic, approach, time_step)
    bound = law.friction * max(normal_force, 0.0)
    force = scaled(normal, normal_force)
    force = touch(contacts, k, force, normal, shear_stiffness, damping, mass, bound, relative, time_step)
    put_loads(contacts.loads, k, force, cross(arm, force), cross(force, arm_p))
    press(slides, p, contacts.loads, k, normal)


@pass_kernel
def wall_point_pass(particles, shapes, laws, contacts, walls, parts, slides, time_step):
    """Contacts of boxes with points of folds and rims; a point pushes as a corner of the box would."""
    for k in range(contacts.first.size):
        i, v = contacts.first[k], contacts.second[k]
        p = walls.point_part[v]
        core, radius = at(shapes.core, i), shapes.radius[i]
        point = add(at(parts.position, p), rotate(at4(parts.orientation, p), at(walls.point, v)))
        overlap, outward = sphere_box(
            point, 0.0, at(particles.position, i), at4(particles.orientation, i), core, radius
        )
        contacts.overlap[k] = overlap
        if overlap <= 0.0 or not have_law(laws, shapes, parts, i, p):
            contacts.overlap[k] = min(overlap, 0.0)
            if contacts.stiffness[k] > 0.0:
                forget(contacts, k)
            continue
        normal = scaled(outward, -1.0)
        mass = moved_mass(particles, i, sub(point, at(particles.position, i)), normal)
        corner_contact(
            particles,
            contacts,
            k,
            i,
            p,
            point,
            overlap,
            normal,
            (radius, face_side(core, radius), mass),
            law_of(laws, shapes.material[i], parts.material[p]),
            slides,
            parts,
            time_step,
        )


@inner
def sum_wall_loads(parts, contacts, walls):
    """Add the loads of all walls to their parts, in the order of the pairs."""
    loads = contacts.loads
    for k in range(contacts.first.size):
        if contacts.beside[0, k] == 1:
            add_to_part(parts, part_of_wall(walls, contacts.second[k]), loads, k)


@inner
def sum_point_loads(parts, contacts, walls):
    """The same for points of folds and rims."""
    loads = contacts.loads
    for k in range(contacts.first.size):
        if contacts.overlap[k] > 0.0:
            add_to_part(parts, walls.point_part[contacts.second[k]], loads, k)


@inner
def add_to_part(parts, p, loads, k):
    """Add the loads of pair k to part p, its second body."""
    put(parts.force, p, sub(at(parts.force, p), (loads[0, k], loads[1, k], loads[2, k])))
    put(parts.torque, p, add(at(parts.torque, p), (loads[6, k], loads[7, k], loads[8, k])))
