"""The pass over line contacts of rounded boxes with cylinders, in stages over chunks of pairs.

First a bound of the overlap of all listed pairs, since half of them are apart; then the geometry and the law of the
others in a tile; then what was found goes to its places. Stages with arithmetic are vectorised.
"""

from __future__ import annotations

import numpy as np

from beltsim.solver.box_cylinder import TINY, box_cylinder, with_flats
from beltsim.solver.contact import damped_normal, friction_force, line_law
from beltsim.solver.contacts import forget, law_of, put_loads, surface
from beltsim.solver.jit import callee, inner, pass_kernel, vector_kernel
from beltsim.solver.ledger import note_friction, note_normal
from beltsim.solver.scratch import scratch_row, scratch_rows
from beltsim.solver.vectors import (
    across,
    add,
    at,
    axis_x,
    axis_y,
    axis_z,
    cross,
    dot,
    norm,
    of,
    of4,
    put,
    rows3,
    rows4,
    scaled,
    sub,
)

CHUNK = 256
"""Pairs at a time, so that their tiles stay in the cache; fixed, so that results depend on no count of threads."""

AREA, LENGTH, NORMAL, POINT, WHOLE, LEVER, SQUARES = 0, 1, 2, 5, 8, 9, 10  # rows of the tile of lines
FORCE, TORQUE_1, TORQUE_2, SPRING, STIFFNESS = 0, 3, 6, 9, 12  # rows of the tile of loads
TILE_ROWS = 13


@vector_kernel
def bound_overlaps(first, second, begin, count, boxes, rollers, overlaps):
    """Upper bounds of overlaps: of the box and the stretch of the axis that the box covers.

    That stretch is a segment, so its distance from the box is that of its middle from the box grown by the segment's
    half sizes: exact for a box whose edge is parallel to the axis.

    Parameters
    ----------
    first, second : (pairs,) uint32; `begin` uint64 and `count` say which pairs
    boxes : rows of position, orientation and core, and edge radii
    rollers : rows of position and orientation, radii and half lengths
    """
    position, orientation, core, edge = boxes
    middle, turned, radius, _ = rollers
    for n in range(count):
        k = begin + np.uint64(n)
        i, p = first[k], second[k]
        half, rounding = with_flats(of(core, i), edge[i])
        axis, q = axis_z(of4(turned, p)), of4(orientation, i)
        x, y, z = axis_x(q), axis_y(q), axis_z(q)
        radial = across(sub(of(position, i), of(middle, p)), axis)
        along = (abs(dot(x, axis)), abs(dot(y, axis)), abs(dot(z, axis)))
        covered = dot(half, along)
        out_x = max(abs(dot(x, radial)) - half[0] - covered * along[0], 0.0)
        out_y = max(abs(dot(y, radial)) - half[1] - covered * along[1], 0.0)
        out_z = max(abs(dot(z, radial)) - half[2] - covered * along[2], 0.0)
        overlaps[k] = radius[p] + rounding - norm((out_x, out_y, out_z))


@vector_kernel
def find_lines(near, count, first, second, boxes, rollers, lines):
    """Geometry of the pairs `near` into the tile of lines; parameters as of `bound_overlaps`."""
    position, orientation, core, edge = boxes
    middle, turned, radius, half_length = rollers
    for n in range(count):
        i, p = first[near[n]], second[near[n]]
        area, length, normal, point, whole, lever, squares = box_cylinder(
            of(position, i),
            of4(orientation, i),
            of(core, i),
            edge[i],
            of(middle, p),
            axis_z(of4(turned, p)),
            radius[p],
            half_length[p],
        )
        lines[AREA][n] = area
        lines[LENGTH][n] = length
        lines[WHOLE][n] = whole
        lines[LEVER][n] = lever
        lines[SQUARES][n] = squares
        for row in range(3):
            lines[NORMAL + row][n] = normal[row]
            lines[POINT + row][n] = point[row]


@vector_kernel
def load_lines(near, count, first, second, boxes, rollers, laws, lines, history, book, time_step, tile):
    """Loads and new history of the pairs `near`, from the tile of lines into the tile of loads.

    Parameters
    ----------
    boxes, rollers : rows of position, velocity and angular velocity, and materials (uint32); of boxes their masses too
    history : rows of the springs, and stiffnesses, of all pairs
    """
    position, velocity, spin, material, mass = boxes
    middle, moving, turning, surfaced = rollers
    springs, stiffnesses = history
    for n in range(count):
        k = near[n]
        i, p = first[k], second[k]
        area, length, normal, point = lines[AREA][n], lines[LENGTH][n], of(lines[2:5], n), of(lines[5:8], n)
        arm_i, arm_p = sub(point, of(position, i)), sub(point, of(middle, p))
        relative = sub(
            surface(of(velocity, i), of(spin, i), arm_i), surface(of(moving, p), of(turning, p), arm_p)
        )
        law = law_of(laws, material[i], surfaced[p])
        elastic, stiffness, shear_stiffness, damping = line_law(law, area, length, lines[WHOLE][n])
        approach = -dot(relative, normal)
        normal_force = damped_normal(elastic, stiffness, damping, mass[i], approach)
        bound = law.friction * max(normal_force, 0.0)
        spring, old = of(springs, k), stiffnesses[k]
        tangential, kept = friction_force(
            relative, normal, time_step, spring, old, shear_stiffness, damping, mass[i], bound
        )
        energy = 0.5 * elastic / max(area, TINY) * lines[SQUARES][n]
        note_normal(book, k, energy, normal_force - elastic, approach, time_step)
        before, after = (spring, old), (kept, shear_stiffness)
        note_friction(book, k, normal, relative, time_step, before, after, tangential, bound)
        force = add(scaled(normal, normal_force), tangential)
        couple = scaled(normal, elastic * lines[LEVER][n])
        torque_i, torque_p = add(cross(arm_i, force), couple), sub(cross(force, arm_p), couple)
        tile[STIFFNESS][n] = shear_stiffness
        for row in range(3):
            tile[FORCE + row][n] = force[row]
            tile[TORQUE_1 + row][n] = torque_i[row]
            tile[TORQUE_2 + row][n] = torque_p[row]
            tile[SPRING + row][n] = kept[row]


@inner
def thirteen(a):
    """The rows of a tile."""
    return a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9], a[10], a[11], a[12]


@callee
def box_cylinder_chunk(particles, shapes, laws, contacts, parts, time_step, begin, end):
    """Line contacts of the pairs begin to end, `CHUNK` at most; writes to nothing else."""
    first, second = contacts.first.view(np.uint32), contacts.second.view(np.uint32)
    overlaps, stiffnesses = contacts.overlap, contacts.stiffness
    position, middle = rows3(particles.position), rows3(parts.position)
    boxes = (position, rows4(particles.orientation), rows3(shapes.core), shapes.radius)
    rollers = (middle, rows4(parts.orientation), parts.radius, parts.half_length)
    bound_overlaps(first, second, np.uint64(begin), end - begin, boxes, rollers, overlaps)
    near, count = scratch_row(CHUNK, np.uint32), 0
    for k in range(begin, end):
        if overlaps[k] > 0.0:
            near[count] = k
            count += 1
        elif stiffnesses[k] > 0.0:
            forget(contacts, k)
    if count == 0:
        return
    lines, tile = scratch_rows(TILE_ROWS, CHUNK), scratch_rows(TILE_ROWS, CHUNK)
    find_lines(near, count, first, second, boxes, rollers, thirteen(lines))
    load_lines(
        near,
        count,
        first,
        second,
        (
            position,
            rows3(particles.velocity),
            rows3(particles.angular_velocity),
            shapes.material.view(np.uint32),
            particles.mass,
        ),
        (middle, rows3(parts.velocity), rows3(parts.angular_velocity), parts.material.view(np.uint32)),
        laws,
        thirteen(lines),
        (rows3(contacts.spring), stiffnesses),
        contacts.book,
        time_step,
        thirteen(tile),
    )
    for n in range(count):
        k = near[n]
        if lines[LENGTH, n] > 0.0:
            overlaps[k] = lines[AREA, n] / lines[LENGTH, n]
            stiffnesses[k] = tile[STIFFNESS, n]
            put(contacts.spring, k, at(tile[SPRING:STIFFNESS], n))
            put_loads(contacts.loads, k, at(tile, n), at(tile[TORQUE_1:], n), at(tile[TORQUE_2:], n))
        else:
            overlaps[k] = -1.0
            if stiffnesses[k] > 0.0:
                forget(contacts, k)


@pass_kernel
def box_cylinder_pass(particles, shapes, laws, contacts, parts, time_step):
    """Line contacts of rounded boxes with cylinders."""
    pairs = contacts.first.size
    for begin in range(0, pairs, CHUNK):
        box_cylinder_chunk(
            particles, shapes, laws, contacts, parts, time_step, begin, min(begin + CHUNK, pairs)
        )
