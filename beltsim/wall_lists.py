"""The lists of particles near meshes and of boxes near planes, and how their history is carried over."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from beltsim.solver.neighbours import carry_history, empty_contacts, owners_of, sort_loads
from beltsim.solver.state import Contacts, Feelers, Loads, Particles, Parts, Shapes, Walls, WallTree
from beltsim.solver.wall_pairs import point_pairs, wall_pairs

CORNERS = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


class ListedWalls(NamedTuple):
    """Feelers near walls; rows of the contacts are feelers."""

    contacts: Contacts
    loads: Loads
    feelers: Feelers


class ListedPoints(NamedTuple):
    """Boxes near points of folds and rims."""

    contacts: Contacts
    loads: Loads


def feelers_of(spheres: np.ndarray, boxes: np.ndarray, shapes: Shapes) -> Feelers:
    """Feelers of spheres and boxes, given by their slots, in the order of the slots."""
    slots = np.sort(np.concatenate([spheres, boxes]))
    is_box = np.isin(slots, boxes)
    particle = np.repeat(slots, np.where(is_box, 8, 1)).astype(np.int32)
    offset = np.zeros((3, particle.size))
    corner = np.repeat(is_box, np.where(is_box, 8, 1))
    offset[:, corner] = shapes.core[:, particle[corner]] * np.tile(CORNERS, (boxes.size, 1)).T
    return Feelers(particle, offset)


def list_walls(
    particles: Particles,
    shapes: Shapes,
    parts: Parts,
    part_group: np.ndarray,
    walls: Walls,
    tree: WallTree,
    skin: float,
    chosen: tuple[np.ndarray, np.ndarray],
) -> ListedWalls:
    """Pairs of feelers and walls at the present positions; `chosen` = slots of spheres and of boxes."""
    spheres = chosen[0] if tree.part.size else chosen[0][:0]
    feelers = feelers_of(spheres, chosen[1], shapes)
    start, first, second = wall_pairs(
        particles.position, shapes, feelers, walls, tree, parts, part_group, skin
    )
    loads = sort_loads(particles.mass.size, first)
    return ListedWalls(empty_contacts(start, first, second), loads, feelers)


def list_points(
    particles: Particles, shapes: Shapes, parts: Parts, walls: Walls, near: ListedWalls, skin: float
) -> ListedPoints:
    """Pairs of boxes and points of the walls near them."""
    start, second = point_pairs(particles.position, shapes, near.feelers, near.contacts, walls, parts, skin)
    first = owners_of(start)
    loads = sort_loads(particles.mass.size, first)
    return ListedPoints(empty_contacts(start, first, second), loads)


def part_of_pairs(near: ListedWalls, walls: Walls) -> np.ndarray:
    """Part (pairs,) of the wall of each pair: of a triangle, or beyond those a plane."""
    triangles, second = walls.part.size, near.contacts.second
    planes = np.arange(int(second.max(initial=0)) + 1 - triangles) if second.size else np.zeros(0, int)
    return np.concatenate([walls.part, planes])[second].astype(np.int64)


def part_of_points(near: ListedPoints, walls: Walls) -> np.ndarray:
    """Part (pairs,) of the point of each pair."""
    return walls.point_part[near.contacts.second]


def carry_walls(new: ListedWalls, old: ListedWalls, origin: np.ndarray) -> None:
    """Copy contact history from the old list; `origin` is the old slot of each particle, -1 for new ones."""
    same = np.arange(int(new.contacts.second.max(initial=0)) + 1, dtype=np.int64)
    rows = row_origin(new.feelers.particle, old.feelers.particle, origin)
    carry_history(new.contacts, old.contacts, new.contacts.second, old.contacts.second, rows, same, False)


def row_origin(new: np.ndarray, old: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """Old row of each feeler: the same corner of the same particle; -1 for particles without one."""
    corner = np.arange(new.size) - np.searchsorted(new, new)
    slot = origin[new]
    place = np.searchsorted(old, slot) + corner
    known = (slot >= 0) & (place < old.size)
    return (
        np.where(known & (old[np.minimum(place, old.size - 1)] == slot), place, -1) if old.size else known - 1
    )


def carry_points(new: ListedPoints, old: ListedPoints, origin: np.ndarray) -> None:
    """Copy contact history from the old list, likewise."""
    same = np.arange(int(new.contacts.second.max(initial=0)) + 1, dtype=np.int64)
    carry_history(new.contacts, old.contacts, new.contacts.second, old.contacts.second, origin, same, False)
