"""Which particles are near which cylinders and planes."""

from __future__ import annotations

import numpy as np

from beltsim.solver.columns import ROW, cell_of, column_of, columns_of
from beltsim.solver.jit import inner, inner_maker, maker
from beltsim.solver.state import Array, Parts, Shapes
from beltsim.solver.stretches import first_from, sort_stretch, with_room
from beltsim.solver.vectors import add, at, at4, axis_z, dot, norm, plus, sub


def part_pairs(
    position: Array,
    shapes: Shapes,
    chosen: Array,
    parts: Parts,
    part_group: Array,
    skin: float,
    planes: bool,
) -> tuple[Array, Array]:
    """Pairs of the particles `chosen` with cylinders and, if `planes`, planes that are closer than the skin.

    Returns `start` (parts + 1,) int64, row p: part p, and `first` (pairs,) int32, the particles, ascending in a row.
    """
    widest = float(shapes.bounding[chosen].max(initial=0.0))
    columns = columns_of(position, shapes.bounding, chosen, 2.0 * widest + skin)
    return near_parts(columns, shapes, parts, part_group, skin, planes)


@maker
def near_parts(columns, shapes, parts, part_group, skin, planes):
    """Pairs of all members of some columns with parts, as `part_pairs` returns them."""
    count = parts.radius.size
    start = np.zeros(count + 1, np.int64)
    first = np.empty(16 + columns.member.size, np.int32)
    total = 0
    for p in range(count):
        begin = total
        if parts.half_length[p] > 0.0 and (planes or not np.isinf(parts.radius[p])):
            box = box_around(parts, p, columns.widest + skin)
            for c in columns_in(columns, box):
                first = with_room(first, total + columns.start[c + 1] - columns.start[c])
                total = near_in_column(columns, c, box, shapes, parts, part_group, p, skin, first, total)
            sort_stretch(first, first, begin, total)
        start[p + 1] = total
    return start, first[:total].copy()


@inner
def box_around(parts, p, margin):
    """Lower and upper corner of the world box around part p and a margin; infinite for a plane."""
    axis, centre = axis_z(at4(parts.orientation, p)), at(parts.position, p)
    size = (0.0, 0.0, 0.0)
    for k in range(3):
        across = np.sqrt(max(0.0, 1.0 - axis[k] * axis[k]))
        half = abs(axis[k]) * parts.half_length[p] + parts.radius[p] * across + margin
        size = (size[1], size[2], half)
    if np.isinf(parts.radius[p]):
        size = (np.inf, np.inf, np.inf)
    return sub(centre, size), add(centre, size)


@inner_maker
def columns_in(columns, box):
    """Numbers of the columns that a box reaches; of all if it covers more cells than there are columns."""
    low, high = box
    x, y = cell_of(low[0], columns.cell), cell_of(low[1], columns.cell)
    rows, breadth = cell_of(high[0], columns.cell) - x + 1, cell_of(high[1], columns.cell) - y + 1
    if float(rows) * float(breadth) > columns.key.size:
        return np.arange(columns.key.size)
    found = np.empty(rows * breadth, np.int64)
    total = 0
    for n in range(found.size):
        c = column_of(columns, (x + n // breadth) * ROW + y + n % breadth)
        found[total] = c
        total += c >= 0
    return found[:total].copy()


@inner
def near_in_column(columns, c, box, shapes, parts, part_group, p, skin, first, total):
    """Add the members of a column that are near part p; their new number."""
    end = columns.start[c + 1]
    place = first_from(columns.z, columns.start[c], end, box[0][2])
    while place < end and columns.z[place] <= box[1][2]:
        i = columns.member[place]
        point = columns.x[place], columns.y[place], columns.z[place]
        if is_near(point, columns.radius[place] + skin, parts, p):
            first[total] = i
            total += shapes.may_touch[shapes.group[i], part_group[p]]
        place += 1
    return total


@inner
def is_near(point, reach, parts, p):
    """Whether a point is closer than `reach` to a cylinder or plane p."""
    d = sub(point, at(parts.position, p))
    axis = axis_z(at4(parts.orientation, p))
    height = dot(d, axis)
    if np.isinf(parts.radius[p]):
        return height < reach
    return (
        abs(height) < parts.half_length[p] + reach and norm(plus(d, -height, axis)) < parts.radius[p] + reach
    )
