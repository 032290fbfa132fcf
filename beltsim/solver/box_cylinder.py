"""Line contact of a rounded box and a cylinder: its face that looks at the axis, and the mantle or the end.

Nothing is chosen but the face, and where that changes the nearest points lie on an edge that both faces have, but for a
box that tumbles past 45 degrees between its ends and the face: its corner then has another way (`line_pressure`).

Without branches, loops and calls, so that a pass over many pairs is vectorised.
"""

from __future__ import annotations

import math

from beltsim.solver.cylinder_end import against_end
from beltsim.solver.jit import inner
from beltsim.solver.line_pressure import TINY, pressed_face
from beltsim.solver.vectors import across, add, axis_x, axis_y, axis_z, cross, dot, norm, plus, scaled, sub

SHARPEST = 0.8
"""Largest edge radius over the least half size: a box that is all rounding has no flat for a line to lie on."""


@inner
def pick(condition, a, b):
    """Vector a if the condition holds, else b."""
    return (a[0] if condition else b[0], a[1] if condition else b[1], a[2] if condition else b[2])


@inner
def with_flats(core, edge_radius):
    """Core half extents and edge radius of a box of the same outer size that is rounded less where it has no flat."""
    half = edge_radius + min(core[0], core[1], core[2])
    less = max(0.0, edge_radius - SHARPEST * half)
    return add(core, (less, less, less)), edge_radius - less


@inner
def oriented_face(centre, orientation, core, axis):
    """The face of a box that looks at an axis through the origin.

    Returns its middle and its half edges: the box's direction most parallel to the axis, the other, and the one into
    the box.
    """
    x, y, z = axis_x(orientation), axis_y(orientation), axis_z(orientation)
    radial = across(centre, axis)
    # How far the axis is beyond each pair of faces.
    out_x, out_y, out_z = dot(x, radial), dot(y, radial), dot(z, radial)
    beyond_x, beyond_y, beyond_z = abs(out_x) - core[0], abs(out_y) - core[1], abs(out_z) - core[2]
    side_x = -core[0] if out_x > 0.0 else core[0]
    side_y = -core[1] if out_y > 0.0 else core[1]
    side_z = -core[2] if out_z > 0.0 else core[2]
    # Compared without their lengths: the direction decides, not the size.
    px, py, pz = abs(dot(x, axis)), abs(dot(y, axis)), abs(dot(z, axis))
    is_y = (py >= px) & (py >= pz)
    is_z = (pz > px) & (pz > py)
    x, y, z = scaled(x, side_x), scaled(y, side_y), scaled(z, side_z)
    along = pick(is_y, y, pick(is_z, z, x))
    one, other = pick(is_y | is_z, x, y), pick(is_z, y, z)
    beyond_one = beyond_x if is_y | is_z else beyond_y
    beyond_other = beyond_y if is_z else beyond_z
    looks = beyond_one > beyond_other
    inward, beside = pick(looks, one, other), pick(looks, other, one)
    return add(centre, inward), along, beside, inward


@inner
def in_frame(v, x, y, z):
    """Components of a vector along three directions."""
    return dot(v, x), dot(v, y), dot(v, z)


@inner
def from_frame(v, x, y, z):
    """The vector of components along three directions."""
    return plus(plus(scaled(x, v[0]), v[1], y), v[2], z)


@inner
def box_cylinder(box_centre, orientation, core, edge_radius, middle, axis, cylinder_radius, half_length):
    """Line contact of a rounded box and a cylinder, with its mantle or its end (`cylinder_end`).

    Returns
    -------
    area : force over the stiffness per length: the integral of the overlap over the height, summed as a vector [m^2]
    length : height that touches [m]; 0 if nothing does
    normal : (3,) from the cylinder to the box
    point : (3,) of the force's line, near the surface [m]
    whole : height of the box's core, were it not turned against the axis in its face [m]
    lever : of the couple about the normal on the box, over the force [m]
    squares : integral of the squared overlap [m^3], twice the energy over the stiffness per length
    """
    core, edge_radius = with_flats(core, edge_radius)
    centre = sub(box_centre, middle)
    face, along, beside, inward = oriented_face(centre, orientation, core, axis)
    heights = dot(along, axis), dot(beside, axis), dot(inward, axis)
    cut = plus(beside, -heights[1] / heights[0], along)
    x = scaled(cut, 1.0 / norm(cut))
    y = cross(axis, x)
    face, along, beside = (
        in_frame(face, x, y, axis),
        in_frame(along, x, y, axis),
        in_frame(beside, x, y, axis),
    )
    pressed = pressed_face(face, along, beside, cylinder_radius + edge_radius, half_length)
    length, squares, force, moment = against_end(
        pressed,
        face,
        along,
        beside,
        in_frame(inward, x, y, axis),
        2.0 * max(core[0], core[1], core[2]),
        cylinder_radius,
        half_length,
    )
    # On the axis of this wrench, so that what is left of the moment turns about the force.
    square = dot(force, force)
    share = 1.0 / max(square, TINY)
    area = math.sqrt(square)
    radial = math.sqrt(force[0] * force[0] + force[1] * force[1])
    outward = share * (radial * cylinder_radius + abs(force[2]) * half_length)
    point = plus(scaled(cross(force, moment), share), outward, force)
    normal = scaled(from_frame(force, x, y, axis), share * area)
    touches = square > TINY
    return (
        area,
        length if touches else 0.0,
        normal,
        add(middle, from_frame(point, x, y, axis)),
        2.0 * norm(heights),
        share * dot(force, moment),
        squares,
    )
