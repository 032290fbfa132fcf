"""Two rounded boxes: an elastic foundation between their cores, whose energy adds up over the boxes of a belt.

A box carries a field around its core of half extents a: phi(y) = R^2 X(y_x) Y(y_y) Z(y_z) with R = r_1 + r_2 and the
smoothed step s(u) = 0, (u + R)^2 / 2 R^2, 1 - (R - u)^2 / 2 R^2, 1 that rises between u = -R and R. Across the box,
Z = s(a - |y|), so that a point of the other core at the depth d below the reach R costs phi = d^2 / 2 for d <= R; a
parabola rounds it off within R / 4 of the middle, for edges of thin belts that meet side by side. Along the box,
X = s(y + a) - s(y - a): the fields of boxes whose cores tile a flat belt add up to one surface without seams, exactly
and at any shift, since each s cancels against the neighbour's. The other core feels the field with points on its
surface, which carry its area: w each, those of a flat face the area of the face together. Both sides count half:

    U = K / 2 (sum_p w_p phi_2(p) + sum_q w_q phi_1(q)),   K [Pa/m] the stiffness of the foundation per area

So the law is conservative (forces and moments are derivatives of U), objective, symmetric, and continuous: s has a
continuous slope, so faces, edges and corners fade into one another, and no history has to change hands at a seam: a
pair's stiffness comes and goes over 2 R of sliding, its friction over a thousandth of that.

Exact: a flat face that lies on a belt has the stiffness K times its core's area, wherever it lies. By sampling: points
stand at most 1.25 R apart, so the end of a belt that slides over another feels their rows (0.3 % of the force for a
belt of three 25 mm cells with edges of 4 mm, 1.5 % with edges of 1 mm, nothing for a belt without ends). Side on side:
about K times the thickness per length; the outermost R of a free rim carries less. A core shorter than R
along the box, a < R, carries less too, 1 - (1 - a / R)^2. Overlaps beyond R push less, those past the middle of a box
pull through: nothing here is meant for boxes inside one another.
"""

from __future__ import annotations

import math

from beltsim.solver.jit import inner, kernel
from beltsim.solver.vectors import (
    add,
    axis_x,
    axis_y,
    axis_z,
    cross,
    dot,
    plus,
    rotate,
    rotate_back,
    scaled,
    sub,
)

SPACING = 1.25  # of the points, over R: at 2 crossed bars could pass between them
FLAT = 0.05  # cores thinner than this share of R have one layer of points
NARROW = (
    0.125  # cores narrower than this share of R end like thin ones: s(y + a) - s(y - a) would vanish there
)
MIDDLE = 0.25  # of R: how far from the middle of a thin box its field is rounded off
NONE = (0.0, 0.0, 0.0)


@inner
def step_of(u, reach):
    """Smoothed step s(u) and its slope."""
    if u <= -reach:
        return 0.0, 0.0
    if u >= reach:
        return 1.0, 0.0
    if u < 0.0:
        rise = (u + reach) / reach
        return 0.5 * rise * rise, rise / reach
    rise = (reach - u) / reach
    return 1.0 - 0.5 * rise * rise, rise / reach


@inner
def across_box(y, half, reach):
    """s(a - |y|) and its slope, rounded off in the middle of the box."""
    middle = MIDDLE * reach
    if abs(y) < middle:
        value, slope = step_of(half - middle, reach)
        return value + 0.5 * slope * (middle - y * y / middle), -slope * y / middle
    value, slope = step_of(half - abs(y), reach)
    return value, -slope if y > 0.0 else slope


@inner
def along_box(y, half, reach):
    """s(y + a) - s(y - a) and its slope."""
    above, above_slope = step_of(y + half, reach)
    below, below_slope = step_of(y - half, reach)
    return above - below, above_slope - below_slope


@inner
def profile(y, half, thin, reach):
    """Profile of a field in one direction, and its slope; `thin` for the direction across the box."""
    if thin or half < NARROW * reach:
        return across_box(y, half, reach)
    return along_box(y, half, reach)


@inner
def thinnest(core):
    """The axis along which a core is thinnest, 2 if axes are equal."""
    if core[2] <= core[0] and core[2] <= core[1]:
        return 2
    return 1 if core[1] <= core[0] else 0


@inner
def field(y, core, thin, reach):
    """phi [m2] of a box at a point of its frame, and its gradient [m]."""
    z, dz = profile(y[2], core[2], thin == 2, reach)
    if z <= 0.0:
        return 0.0, NONE
    x, dx = profile(y[0], core[0], thin == 0, reach)
    y_, dy = profile(y[1], core[1], thin == 1, reach)
    scale = reach * reach
    return scale * x * y_ * z, (scale * dx * y_ * z, scale * x * dy * z, scale * x * y_ * dz)


@inner
def intervals(half, reach):
    """Between how many points a side of a core is divided; 0 for a single layer."""
    if 2.0 * half < FLAT * reach:
        return 0
    return math.ceil(2.0 * half / (SPACING * reach))


@inner
def width_of(half, edge_radius):
    """Width [m] that a side of a core counts for: rounded edges carry, however thin the core."""
    return max(2.0 * half, edge_radius)


@inner
def face_area(core, edge_radius):
    """Area [m2] of the widest faces of a core."""
    x, y, z = width_of(core[0], edge_radius), width_of(core[1], edge_radius), width_of(core[2], edge_radius)
    thin = thinnest(core)
    return x * y if thin == 2 else (x * z if thin == 1 else y * z)


@inner
def share_at(i, count, width):
    """Trapezoidal weight [m] of point i of a side, and how many of its ends it is."""
    if count == 0:
        return width, 2.0
    if i == 0 or i == count:
        return 0.5 * width / count, 1.0
    return width / count, 0.0


@inner
def weight_scale(core, counts, widths):
    """Factor that makes the points of a widest face sum to its area, those of its rim with their share of the sides."""
    thin = thinnest(core)
    a, b = (0, 1) if thin == 2 else ((0, 2) if thin == 1 else (1, 2))
    end, ends = share_at(0, counts[thin], widths[thin])
    area = widths[a] * widths[b]
    return area / (ends * area + 2.0 * (widths[a] + widths[b]) * end)


@inner
def points_within(half, count, centre, extent):
    """First and last of the points along a side that can lie within `extent` of `centre`."""
    if count == 0:
        return (0, 0) if abs(centre) <= extent + half else (0, -1)
    spacing = 2.0 * half / count
    first = int(max(0.0, math.ceil((centre - extent + half) / spacing)))
    last = int(min(float(count), math.floor((centre + extent + half) / spacing)))
    return first, last


@inner
def place_of(i, half, count):
    """Coordinate of point i along a side."""
    return 0.0 if count == 0 else half * (2.0 * i / count - 1.0)


@kernel
def points_in_field(body, core, edge_radius, other, other_core, reach):
    """What the points of one box feel in the field of another.

    Parameters
    ----------
    body, other : (position, orientation, velocity, spin) of both boxes
    core, other_core : (3,) half extents [m]
    edge_radius : of the box with the points [m]
    reach : sum of both edge radii [m]

    Returns
    -------
    energy : sum of w phi [m4]
    elastic, viscous : (force, torque on this box, torque on the other) in world axes, the elastic one for K = 1 and the
        viscous one for a damping of 1 per stiffness [m3, m4] and [m3/s, m4/s]
    area : what touches, so that K times it is the stiffness [m2]
    pressure, moment : sum of the points' forces and of force times place relative to the other box's centre
    """
    turned = other[1]
    centre = rotate_back(turned, sub(body[0], other[0]))
    axes = (
        rotate_back(turned, axis_x(body[1])),
        rotate_back(turned, axis_y(body[1])),
        rotate_back(turned, axis_z(body[1])),
    )
    speed, own_spin = rotate_back(turned, sub(body[2], other[2])), rotate_back(turned, body[3])
    other_spin = rotate_back(turned, other[3])
    nx, ny, nz = intervals(core[0], reach), intervals(core[1], reach), intervals(core[2], reach)
    counts = (nx, ny, nz)
    widths = (width_of(core[0], edge_radius), width_of(core[1], edge_radius), width_of(core[2], edge_radius))
    scale = weight_scale(core, counts, widths)
    thin = thinnest(other_core)
    grown = (other_core[0] + reach, other_core[1] + reach, other_core[2] + reach)
    x_first, x_last = points_within(core[0], nx, -dot(centre, axes[0]), extent_along(axes[0], grown))
    y_first, y_last = points_within(core[1], ny, -dot(centre, axes[1]), extent_along(axes[1], grown))
    z_first, z_last = points_within(core[2], nz, -dot(centre, axes[2]), extent_along(axes[2], grown))
    energy, area, pressure = 0.0, 0.0, 0.0
    force, torque, other_torque = NONE, NONE, NONE
    drag, drag_torque, other_drag_torque, moment = NONE, NONE, NONE, NONE
    for ix in range(x_first, x_last + 1):
        wx, x_ends = share_at(ix, nx, widths[0])
        arm_x = scaled(axes[0], place_of(ix, core[0], nx))
        for iy in range(y_first, y_last + 1):
            wy, y_ends = share_at(iy, ny, widths[1])
            arm_xy = plus(arm_x, place_of(iy, core[1], ny), axes[1])
            for iz in range(z_first, z_last + 1):
                wz, z_ends = share_at(iz, nz, widths[2])
                weight = scale * (z_ends * wx * wy + y_ends * wx * wz + x_ends * wy * wz)
                if weight == 0.0:
                    continue
                arm = plus(arm_xy, place_of(iz, core[2], nz), axes[2])
                place = add(centre, arm)
                phi, slope = field(place, other_core, thin, reach)
                if phi <= 0.0:
                    continue
                push = scaled(slope, -weight)
                size = math.sqrt(dot(push, push))
                energy += weight * phi
                area += size * size / (2.0 * weight * phi)
                pressure += size
                moment = plus(moment, size, place)
                force = add(force, push)
                torque = add(torque, cross(arm, push))
                other_torque = add(other_torque, cross(push, place))
                velocity = sub(add(speed, cross(own_spin, arm)), cross(other_spin, place))
                resist = scaled(push, dot(velocity, slope) / (2.0 * phi))
                drag = add(drag, resist)
                drag_torque = add(drag_torque, cross(arm, resist))
                other_drag_torque = add(other_drag_torque, cross(resist, place))
    elastic = rotate(turned, force), rotate(turned, torque), rotate(turned, other_torque)
    viscous = rotate(turned, drag), rotate(turned, drag_torque), rotate(turned, other_drag_torque)
    return energy, elastic, viscous, area, pressure, rotate(turned, moment)


@inner
def extent_along(axis, half):
    """Half extent of a box along a direction of its frame."""
    return abs(axis[0]) * half[0] + abs(axis[1]) * half[1] + abs(axis[2]) * half[2]


@inner
def can_touch(first, core_1, second, core_2, reach):
    """Whether neither box's six faces separate both by more than the reach."""
    d = sub(second[0], first[0])
    return not (
        apart(d, first[1], core_1, second[1], core_2, reach)
        or apart(d, second[1], core_2, first[1], core_1, reach)
    )


@inner
def apart(d, orientation, core, other_orientation, other_core, reach):
    """Whether some face direction of a box separates it from another, `d` away."""
    x, y, z = axis_x(orientation), axis_y(orientation), axis_z(orientation)
    a, b, c = axis_x(other_orientation), axis_y(other_orientation), axis_z(other_orientation)
    return (
        abs(dot(d, z)) >= core[2] + reach + projected(z, a, b, c, other_core)
        or abs(dot(d, x)) >= core[0] + reach + projected(x, a, b, c, other_core)
        or abs(dot(d, y)) >= core[1] + reach + projected(y, a, b, c, other_core)
    )


@inner
def projected(direction, a, b, c, core):
    """Half extent along a direction of a core with the axes a, b, c."""
    return (
        core[0] * abs(dot(direction, a)) + core[1] * abs(dot(direction, b)) + core[2] * abs(dot(direction, c))
    )


@inner
def box_box(first, core_1, radius_1, second, core_2, radius_2):
    """Foundation between two rounded boxes for K = 1, both sides counted half.

    Parameters
    ----------
    first, second : (position, orientation, velocity, spin) of both boxes
    core_1, core_2, radius_1, radius_2 : half extents of the cores and edge radii [m]

    Returns
    -------
    energy, elastic, viscous, area : see `points_in_field`; forces on the first box, torques on both; area 0: no contact
    point : (3,) centre of the pressure in the world [m]
    """
    reach = radius_1 + radius_2
    nothing = (NONE, NONE, NONE)
    if not can_touch(first, core_1, second, core_2, reach):
        return 0.0, nothing, nothing, 0.0, first[0]
    energy_1, elastic_1, viscous_1, area_1, pressure_1, moment_1 = points_in_field(
        first, core_1, radius_1, second, core_2, reach
    )
    energy_2, elastic_2, viscous_2, area_2, pressure_2, moment_2 = points_in_field(
        second, core_2, radius_2, first, core_1, reach
    )
    pressure = pressure_1 + pressure_2
    if pressure <= 0.0:
        return 0.0, nothing, nothing, 0.0, first[0]
    # Places are relative to the box with the field: the second's for the first's points.
    sum_1 = plus(moment_1, pressure_1, second[0])
    sum_2 = plus(moment_2, pressure_2, first[0])
    point = scaled(add(sum_1, sum_2), 1.0 / pressure)
    return (
        0.5 * (energy_1 + energy_2),
        halves(elastic_1, elastic_2),
        halves(viscous_1, viscous_2),
        0.5 * (area_1 + area_2),
        point,
    )


@inner
def halves(one, two):
    """Loads on the first box from both sides; the second side's stand the other way round."""
    return (
        scaled(sub(one[0], two[0]), 0.5),
        scaled(add(one[1], two[2]), 0.5),
        scaled(add(one[2], two[1]), 0.5),
    )


__all__ = ["box_box", "face_area"]
