"""Where two shapes touch: pure geometry, one function for each pair of shapes.

A rounded box is a core box grown by its edge radius, a sphere is a point grown by its radius, a rounded cylinder is a
core cylinder grown by its edge radius: every pair reduces to the nearest points of two cores.
Normals are unit vectors from the second shape to the first.
"""

from __future__ import annotations

import math

from beltsim.solver.jit import inner
from beltsim.solver.vectors import (
    axis_x,
    axis_y,
    axis_z,
    dot,
    norm,
    plus,
    rotate,
    rotate_back,
    scaled,
    sub,
)

TINY = 1e-300


@inner
def clamp(value, limit):
    """Value within -limit..limit."""
    return min(max(value, -limit), limit)


@inner
def sphere_sphere(centre_1, radius_1, centre_2, radius_2):
    """Overlap and normal of two spheres; coincident centres get the normal +z."""
    d = sub(centre_1, centre_2)
    distance = norm(d)
    normal = scaled(d, 1.0 / distance) if distance > TINY else (0.0, 0.0, 1.0)
    return radius_1 + radius_2 - distance, normal


@inner
def box_gap(point, box_centre, orientation, core):
    """Distance of a point from a core box, negative inside; the distance of `sphere_box`, without branches."""
    d = sub(point, box_centre)
    x = abs(dot(axis_x(orientation), d)) - core[0]
    y = abs(dot(axis_y(orientation), d)) - core[1]
    z = abs(dot(axis_z(orientation), d)) - core[2]
    return norm((max(x, 0.0), max(y, 0.0), max(z, 0.0))) + min(max(x, y, z), 0.0)


@inner
def sphere_box(centre, radius, box_centre, orientation, core, edge_radius):
    """Overlap and normal of a sphere and a rounded box.

    Parameters
    ----------
    centre, radius : of the sphere [m]
    box_centre, orientation : (3,) and (4,)
    core : (3,) half extents of the box without its edge radius [m]; all zero for a sphere
    edge_radius : [m]

    A centre inside the core is pushed out through the nearest face.
    """
    local = rotate_back(orientation, sub(centre, box_centre))
    nearest = (clamp(local[0], core[0]), clamp(local[1], core[1]), clamp(local[2], core[2]))
    out = sub(local, nearest)
    distance = norm(out)
    if distance > TINY:
        return radius + edge_radius - distance, rotate(orientation, scaled(out, 1.0 / distance))
    depth, normal = nearest_face(local, core)
    return radius + edge_radius + depth, rotate(orientation, normal)


@inner
def nearest_face(local, core):
    """Depth of a point inside a box below its nearest face, and that face's normal, both local."""
    depth_x = core[0] - abs(local[0])
    depth_y = core[1] - abs(local[1])
    depth_z = core[2] - abs(local[2])
    if depth_z <= depth_x and depth_z <= depth_y:
        return depth_z, (0.0, 0.0, 1.0 if local[2] >= 0.0 else -1.0)
    if depth_y <= depth_x:
        return depth_y, (0.0, 1.0 if local[1] >= 0.0 else -1.0, 0.0)
    return depth_x, (1.0 if local[0] >= 0.0 else -1.0, 0.0, 0.0)


@inner
def sphere_cylinder(centre, radius, middle, axis, cylinder_radius, half_length, edge_radius):
    """Overlap and normal of a sphere and a finite cylinder with rounded edges.

    `cylinder_radius` and `half_length` are outer sizes, the edge radius is inside them. A centre inside the core is
    pushed out through the mantle or the end, whichever is nearer; on the axis the direction is fixed by the axis.
    """
    core_radius = cylinder_radius - edge_radius
    core_length = half_length - edge_radius
    d = sub(centre, middle)
    height = dot(d, axis)
    radial = plus(d, -height, axis)
    distance = norm(radial)
    outward = scaled(radial, 1.0 / distance) if distance > TINY else any_normal(axis)
    out_radial = distance - min(distance, core_radius)
    out_height = height - clamp(height, core_length)
    out = math.sqrt(out_radial * out_radial + out_height * out_height)
    if out > TINY:
        normal = scaled(plus(scaled(outward, out_radial), out_height, axis), 1.0 / out)
        return radius + edge_radius - out, normal
    if core_radius - distance <= core_length - abs(height):
        return radius + edge_radius + core_radius - distance, outward
    end = 1.0 if height >= 0.0 else -1.0
    return radius + edge_radius + core_length - abs(height), scaled(axis, end)


@inner
def any_normal(axis):
    """A unit vector normal to `axis`, always the same one."""
    x, y, z = axis
    if abs(x) < 0.6:
        other = (0.0, z, -y)
    else:
        other = (-z, 0.0, x)
    return scaled(other, 1.0 / norm(other))


@inner
def sphere_plane(centre, radius, point, normal):
    """Overlap and normal of a sphere and a half space, solid below its plane."""
    return radius - dot(sub(centre, point), normal), normal
