"""Which triangles, and for boxes which planes, are near which particle.

A tree of boxes around the triangles of each mesh is made once, in the frame of its part: it never changes, however the
part moves, and a mesh with nobody near costs one look at its root for each particle. Everything here is made anew with
the lists only.
"""

from __future__ import annotations

import numpy as np

from beltsim.solver.jit import inner, maker
from beltsim.solver.stretches import with_room
from beltsim.solver.triangles import distance_to_box, nearest_on_triangle
from beltsim.solver.vectors import at, at4, axis_z, dot, norm, rotate_back, sub

LEAF = 4  # triangles in a leaf: 1 and 8 were slower


@inner
def corners_of(walls, t):
    """The three vertices of triangle t, in the frame of its part."""
    return (
        at(walls.vertex, walls.triangle[0, t]),
        at(walls.vertex, walls.triangle[1, t]),
        at(walls.vertex, walls.triangle[2, t]),
    )


@inner
def into_part(point, parts, p):
    """A point of the world in the frame of part p."""
    return rotate_back(at4(parts.orientation, p), sub(point, at(parts.position, p)))


@inner
def next_node(k):
    """The node after the subtree of node k in the order of a walk that goes down first; 0 at the end."""
    while k & 1:
        k >>= 1
    return k + 1 if k > 0 else 0


@inner
def is_in_reach(point, reach, ball, t):
    """Whether a point is closer than `reach` to the ball around triangle t."""
    out, limit = sub(point, at(ball, t)), reach + ball[3, t]
    return dot(out, out) < limit * limit


@inner
def near_triangles(local, reach, w, walls, tree, found, total):
    """Add the triangles of mesh w that are closer than `reach` to a local point: their new number, -1 without room.

    They come in ascending order: the tree is walked from left to right.
    """
    base, leaves = tree.base[w], tree.leaves[w]
    last = tree.first[w] + tree.count[w]
    k = 1
    while k > 0:
        node = base + k
        hit = distance_to_box(local, at(tree.low, node), at(tree.high, node)) < reach
        if hit and k < leaves:
            k = 2 * k
            continue
        if hit:
            begin = tree.first[w] + LEAF * (k - leaves)
            for t in range(begin, min(begin + LEAF, last)):
                if is_in_reach(local, reach, walls.ball, t):
                    nearest, _ = nearest_on_triangle(local, *corners_of(walls, t))
                    if norm(sub(local, nearest)) < reach:
                        if total == found.size:
                            return -1
                        found[total] = t
                        total += 1
        k = next_node(k)
    return total


@inner
def near_walls(position, shapes, i, is_box, walls, tree, parts, part_group, skin, found):
    """Write down the walls near particle i: their number, -1 without room. Only boxes feel planes here."""
    centre, reach, total = at(position, i), shapes.bounding[i] + skin, 0
    for w in range(tree.part.size):
        p = tree.part[w]
        if shapes.may_touch[shapes.group[i], part_group[p]]:
            total = near_triangles(into_part(centre, parts, p), reach, w, walls, tree, found, total)
            if total < 0:
                return total
    if is_box:
        for p in range(parts.radius.size):
            if np.isinf(parts.radius[p]) and shapes.may_touch[shapes.group[i], part_group[p]]:
                d = sub(centre, at(parts.position, p))
                if dot(d, axis_z(at4(parts.orientation, p))) < reach:
                    if total == found.size:
                        return -1
                    found[total] = walls.part.size + p
                    total += 1
    return total


@maker
def wall_pairs(position, shapes, feelers, walls, tree, parts, part_group, skin):
    """Pairs of feelers with walls: triangles, and for the corners of boxes planes.

    All corners of a box get the walls near its bounding sphere, so that it may turn as it likes between two lists.

    Returns
    -------
    start : (feelers + 1,) int64
    first : (pairs,) int32 particle
    second : (pairs,) int32 triangle, or number of triangles + part for a plane; ascending within a row
    """
    particle, rows = feelers.particle, feelers.particle.size
    start = np.zeros(rows + 1, np.int64)
    first = np.empty(max(16, rows), np.int32)
    second = np.empty(max(16, rows), np.int32)
    found = np.empty(64, np.int32)
    total, row = 0, 0
    while row < rows:
        i, after = particle[row], row + 1
        while after < rows and particle[after] == i:
            after += 1
        is_box = after - row > 1
        near = near_walls(position, shapes, i, is_box, walls, tree, parts, part_group, skin, found)
        while near < 0:
            found = np.empty(2 * found.size, np.int32)
            near = near_walls(position, shapes, i, is_box, walls, tree, parts, part_group, skin, found)
        first = with_room(first, total + near * (after - row))
        second = with_room(second, total + near * (after - row))
        while row < after:
            for n in range(near):
                first[total], second[total] = i, found[n]
                total += 1
            row += 1
            start[row] = total
    return start, first[:total].copy(), second[:total].copy()


@maker
def point_pairs(position, shapes, feelers, contacts, walls, parts, skin):
    """Pairs of boxes with the points of folds and rims near them.

    `contacts` are the pairs of `wall_pairs`. Returns `start` (particles + 1,) int64 and `second` (pairs,) int32, the
    points, ascending within a row.
    """
    count = position.shape[1]
    start = np.zeros(count + 1, np.int64)
    second = np.empty(64, np.int32)
    total = 0
    done = 0  # rows of `start` that are filled
    triangles = walls.part.size
    for row in range(feelers.particle.size - 1):
        i = feelers.particle[row]
        is_first_corner = (row == 0 or feelers.particle[row - 1] != i) and feelers.particle[row + 1] == i
        if not is_first_corner:
            continue
        while done < i:
            done += 1
            start[done] = total
        for k in range(contacts.start[row], contacts.start[row + 1]):
            t = contacts.second[k]
            if t >= triangles:
                continue
            local = into_part(at(position, i), parts, walls.part[t])
            for v in range(walls.point_start[t], walls.point_start[t + 1]):
                if norm(sub(local, at(walls.point, v))) < shapes.bounding[i] + skin:
                    second = with_room(second, total + 1)
                    second[total] = v
                    total += 1
    while done < count:
        done += 1
        start[done] = total
    return start, second[:total].copy()
