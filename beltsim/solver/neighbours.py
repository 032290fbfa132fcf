"""Which pairs are near enough to be tested, and how contact history is carried from one list to the next.

A list holds all pairs whose surfaces are closer than the skin; it serves until some particle has moved half the skin.
Lists are sorted by their first index, so that every order of summation is fixed.
"""

from __future__ import annotations

import numpy as np

from beltsim.solver.hashgrid import cell_of, hash_points, is_in, members_of
from beltsim.solver.jit import inner, kernel
from beltsim.solver.ledger import carry_book
from beltsim.solver.state import Array, Contacts, Loads
from beltsim.solver.vectors import at, at4, axis_z, dot, norm, plus, sub


@inner
def may_pair(shapes, i, j):
    """Whether the contact groups of i and j let them touch."""
    return shapes.may_touch[shapes.group[i], shapes.group[j]]


@inner
def are_bonded(bonded_start, bonded, i, j):
    """Whether j is among the bonded neighbours of i."""
    found = False
    for n in range(bonded_start[i], bonded_start[i + 1]):
        found = found or bonded[n] == j
    return found


@inner
def near(position, shapes, i, j, skin):
    """Whether the bounding spheres of i and j are closer than the skin."""
    d = sub(at(position, i), at(position, j))
    reach = shapes.bounding[i] + shapes.bounding[j] + skin
    return dot(d, d) < reach * reach


@kernel
def particle_pairs(position, shapes, owners, grid, skin, half, bonded_start, bonded):
    """Pairs of `owners` with the members of a grid.

    Parameters
    ----------
    owners : (n,) int32 ascending; row i of the result belongs to particle i, empty for others
    half : the members are the owners themselves: list each pair once, at the lower particle
    bonded_start, bonded : whom each particle must not touch (`beltsim.exclusions`)

    Returns
    -------
    start : (particles + 1,) int64
    second : (pairs,) int32, ascending within a row
    """
    count = position.shape[1]
    start = np.zeros(count + 1, np.int64)
    second = np.empty(max(16, 8 * owners.size), np.int32)
    total = 0
    row = 0
    for n in range(owners.size):
        i = owners[n]
        while row <= i:
            start[row] = total
            row += 1
        ix = cell_of(position[0, i], grid.cell)
        iy = cell_of(position[1, i], grid.cell)
        iz = cell_of(position[2, i], grid.cell)
        begin = total
        for dx in range(-1, 2):
            for dy in range(-1, 2):
                for dz in range(-1, 2):
                    first, last = members_of(grid, ix + dx, iy + dy, iz + dz)
                    for place in range(first, last):
                        j = grid.member[place]
                        if half and j <= i:
                            continue
                        if not is_in(grid, place, ix + dx, iy + dy, iz + dz):
                            continue
                        if not near(position, shapes, i, j, skin) or not may_pair(shapes, i, j):
                            continue
                        if are_bonded(bonded_start, bonded, i, j):
                            continue
                        if total == second.size:
                            larger = np.empty(2 * second.size, np.int32)
                            larger[:total] = second
                            second = larger
                        second[total] = j
                        total += 1
        second[begin:total] = np.sort(second[begin:total])
    while row <= count:
        start[row] = total
        row += 1
    return start, second[:total].copy()


@inner
def part_reach(parts, p):
    """Half sizes of the world box around part p; infinite for a plane."""
    axis = axis_z(at4(parts.orientation, p))
    radius, half_length = parts.radius[p], parts.half_length[p]
    x = abs(axis[0]) * half_length + radius * np.sqrt(max(0.0, 1.0 - axis[0] * axis[0]))
    y = abs(axis[1]) * half_length + radius * np.sqrt(max(0.0, 1.0 - axis[1] * axis[1]))
    z = abs(axis[2]) * half_length + radius * np.sqrt(max(0.0, 1.0 - axis[2] * axis[2]))
    return x, y, z


@inner
def near_part(position, shapes, parts, i, p, skin):
    """Whether particle i is closer than the skin to part p."""
    d = sub(at(position, i), at(parts.position, p))
    axis = axis_z(at4(parts.orientation, p))
    height = dot(d, axis)
    reach = shapes.bounding[i] + skin
    if np.isinf(parts.radius[p]):
        return height < reach
    return (
        abs(height) < parts.half_length[p] + reach and norm(plus(d, -height, axis)) < parts.radius[p] + reach
    )


@kernel
def part_pairs(position, shapes, chosen, grid, parts, part_group, skin, planes):
    """Pairs of the particles `chosen` (those of the grid) with cylinders and, if `planes`, planes; row p: part p.

    Returns `start` (parts + 1,) and `first` (pairs,) int32, the particles, ascending within a row.
    """
    count = parts.radius.size
    start = np.zeros(count + 1, np.int64)
    first = np.empty(max(16, 2 * chosen.size), np.int32)
    total = 0
    for p in range(count):
        begin = total
        if parts.half_length[p] == 0.0 or (np.isinf(parts.radius[p]) and not planes):
            start[p + 1] = total
            continue
        candidates = candidates_near(chosen, grid, parts, p)
        for n in range(candidates.size):
            i = candidates[n]
            if not near_part(position, shapes, parts, i, p, skin):
                continue
            if not shapes.may_touch[shapes.group[i], part_group[p]]:
                continue
            if total == first.size:
                larger = np.empty(2 * first.size, np.int32)
                larger[:total] = first
                first = larger
            first[total] = i
            total += 1
        first[begin:total] = np.sort(first[begin:total])
        start[p + 1] = total
    return start, first[:total].copy()


@inner
def candidates_near(chosen, grid, parts, p):
    """Particles in the cells that the box around part p covers; all if that is more cells than particles."""
    if np.isinf(parts.radius[p]):
        return chosen
    reach = part_reach(parts, p)
    margin = grid.cell  # at least the largest bounding radius and the skin
    low = np.empty(3, np.int64)
    high = np.empty(3, np.int64)
    cells = 1.0
    for axis in range(3):
        low[axis] = cell_of(parts.position[axis, p] - reach[axis] - margin, grid.cell)
        high[axis] = cell_of(parts.position[axis, p] + reach[axis] + margin, grid.cell)
        cells *= high[axis] - low[axis] + 1.0
    if cells > chosen.size:
        return chosen
    found = np.empty(chosen.size, np.int32)
    total = 0
    for ix in range(low[0], high[0] + 1):
        for iy in range(low[1], high[1] + 1):
            for iz in range(low[2], high[2] + 1):
                first, last = members_of(grid, ix, iy, iz)
                for place in range(first, last):
                    if is_in(grid, place, ix, iy, iz):
                        found[total] = grid.member[place]
                        total += 1
    return found[:total].copy()


@kernel
def carry_history(new, old, new_key, old_key, row_origin, key_origin):
    """Copy the history of pairs that stand in both lists.

    Parameters
    ----------
    new, old : Contacts
    new_key, old_key : the arrays that tell the pairs of a row apart (`second`, or `first` for part lists)
    row_origin, key_origin : index in the old list of each row and key of the new one, -1 for none
    """
    for row in range(new.start.size - 1):
        old_row = row_origin[row]
        if old_row < 0 or old_row >= old.start.size - 1:
            continue
        for k in range(new.start[row], new.start[row + 1]):
            wanted = key_origin[new_key[k]]
            if wanted < 0:
                continue
            for before in range(old.start[old_row], old.start[old_row + 1]):
                if old_key[before] == wanted:
                    if old.stiffness[before] > 0.0:
                        new.stiffness[k] = old.stiffness[before]
                        for axis in range(3):
                            new.spring[axis, k] = old.spring[axis, before]
                            new.rolling[axis, k] = old.rolling[axis, before]
                        carry_book(new.book, old.book, k, before)
                    break


@kernel
def link_neighbours(start, second, bonded_start, bonded, beside):
    """For each pair (sphere, box), the pairs of the same sphere with the box's first four bonded neighbours."""
    for row in range(start.size - 1):
        for k in range(start[row], start[row + 1]):
            found = 0
            for n in range(bonded_start[second[k]], bonded_start[second[k] + 1]):
                for other in range(start[row], start[row + 1]):
                    if second[other] == bonded[n] and found < 4:
                        beside[found, k] = other
                        found += 1


def empty_contacts(start: Array, first: Array, second: Array) -> Contacts:
    """Contacts without history for the pairs given."""
    pairs = first.size
    return Contacts(
        start=start,
        first=first,
        second=second,
        spring=np.zeros((3, pairs)),
        stiffness=np.zeros(pairs),
        rolling=np.zeros((3, pairs)),
        loads=np.zeros((9, pairs)),
        overlap=np.full(pairs, -1.0),
        beside=np.full((4, pairs), -1, np.int32),
    )


@kernel
def sort_loads(particles, first, second, both):
    """Which pairs load each particle (`state.Loads`); `both` is False where the second is a part."""
    start = np.zeros(particles + 1, np.int64)
    for k in range(first.size):
        start[first[k] + 1] += 1
        if both:
            start[second[k] + 1] += 1
    for i in range(particles):
        start[i + 1] += start[i]
    entry = np.empty(start[particles], np.int64)
    free = start[:-1].copy()
    for k in range(first.size):
        entry[free[first[k]]] = 2 * k
        free[first[k]] += 1
        if both:
            entry[free[second[k]]] = 2 * k + 1
            free[second[k]] += 1
    return Loads(start, entry)


def grid_of(position: Array, chosen: Array, bounding: Array, skin: float):
    """HashGrid of particles whose cells are wide enough for any pair of bounding spheres."""
    return hash_points(position, chosen, 2.0 * bounding + skin)
