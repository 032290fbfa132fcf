"""The lists of near pairs of a scene, one for each pair of shapes that it has, and when they are made anew."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from beltsim.exclusions import Excluded, by_particle
from beltsim.rod_lists import ListedRods, carry_rods, list_rods
from beltsim.solver.crossings import crossings_of
from beltsim.solver.neighbours import (
    carry_history,
    empty_contacts,
    link_neighbours,
    owners_of,
)
from beltsim.solver.part_pairs import part_pairs
from beltsim.solver.particle_pairs import particle_pairs
from beltsim.solver.rods import Rods
from beltsim.solver.state import Contacts, Crossings, Particles, Parts, Shapes, Walls, WallTree
from beltsim.solver.together import together
from beltsim.wall_lists import (
    ListedPoints,
    ListedWalls,
    carry_points,
    carry_walls,
    list_points,
    list_walls,
)

Listed = tuple[Contacts]


class ListedSpheres(NamedTuple):
    """Pairs of spheres."""

    contacts: Contacts
    crossings: Crossings
    material: int | None  # of all spheres that may ever be there, None for several


class Lists(NamedTuple):
    """Lists of near pairs; None for a family that the scene can never have."""

    spheres: ListedSpheres | None
    boxes: Listed | None  # spheres with boxes
    sphere_parts: Listed | None
    box_parts: Listed | None
    walls: ListedWalls | None  # spheres and boxes with meshes, boxes with planes
    points: ListedPoints | None  # boxes with folds and rims of meshes
    box_boxes: Listed | None
    rods: ListedRods | None = None  # cylinders that fly with planes, rollers and one another


BETWEEN_PARTICLES = ("spheres", "boxes", "box_boxes")
"""Families whose pairs load two particles; the others load a particle and a part."""


class Families(NamedTuple):
    """Which pairs of shapes a scene has, for the whole run: the compiled steps are made for them."""

    spheres: bool
    sphere_material: int | None  # of all spheres, None for several
    rolling: bool  # some material has rolling friction
    boxes: bool
    parts: bool
    walls: bool
    points: bool
    box_boxes: bool
    rods: bool


class Bonded(NamedTuple):
    """Bonded neighbours of each particle; across a bond that broke, a belt is no longer one surface."""

    start: np.ndarray  # (n + 1,) int64
    member: np.ndarray  # (2 m,) int32


def bonded_neighbours(count: int, bonds) -> Bonded:
    """Neighbours of all `count` particles by intact bonds, ascending; `bonds` is a Bonds or None."""
    if bonds is None:
        return Bonded(np.zeros(count + 1, np.int64), np.zeros(0, np.int32))
    whole = bonds.intact != 0
    ends = np.concatenate([bonds.first[whole], bonds.second[whole]])
    others = np.concatenate([bonds.second[whole], bonds.first[whole]])
    order = np.lexsort((others, ends))
    start = np.zeros(count + 1, np.int64)
    np.cumsum(np.bincount(ends, minlength=count), out=start[1:])
    return Bonded(start, others[order].astype(np.int32))


def make_lists(
    particles: Particles,
    shapes: Shapes,
    parts: Parts,
    part_group: np.ndarray,
    families: Families,
    bonded: Bonded,
    skin: float,
    chosen: tuple[np.ndarray, np.ndarray],
    walls: tuple[Walls, WallTree],
    excluded: Excluded,
    rods: Rods | None,
    permanent: int,
    team: int | None = None,
) -> Lists:
    """All lists at the present positions, without history.

    `chosen` = slots of spheres and of boxes; `excluded` = pairs that do not touch; `rods` = cylinders that fly;
    `permanent` = how many particles stay for the whole run; `team` = threads, None for one.
    """
    spheres, boxes = chosen
    position = particles.position
    apart = by_particle(excluded, particles.mass.size)

    def near(owners, members=None):
        return particle_pairs(position, shapes, owners, members, skin, apart, team)

    def among(start, second, **kept):
        return empty_contacts(start, owners_of(start), second, **kept)

    def with_parts(slots, planes):
        start, first = part_pairs(position, shapes, slots, parts, part_group, skin, planes)
        return empty_contacts(start, first, owners_of(start))

    def between_spheres(start, second):
        contacts = among(start, second, rolls=families.rolling, summed=False)
        return ListedSpheres(contacts, crossings_of(start, second, permanent), families.sphere_material)

    on_boxes = None
    if families.spheres and families.boxes:
        on_boxes = among(*near(spheres, boxes))
        link_neighbours(on_boxes.start, on_boxes.second, *bonded, on_boxes.beside)
    near_walls = near_points = None
    if families.walls:
        near_walls = list_walls(particles, shapes, parts, part_group, *walls, skin, chosen)
    if families.points:
        near_points = list_points(particles, shapes, parts, walls[0], near_walls, skin)
    found = near(spheres) if families.spheres else None
    of_spheres, of_parts, of_box_parts = together(
        team,
        [
            lambda: between_spheres(*found) if families.spheres else None,
            lambda: (with_parts(spheres, True),) if families.spheres and families.parts else None,
            lambda: (with_parts(boxes, False),) if families.boxes and families.parts else None,
        ],
    )
    return Lists(
        of_spheres,
        (on_boxes,) if on_boxes is not None else None,
        of_parts,
        of_box_parts,
        near_walls,
        near_points,
        (among(*near(boxes)),) if families.box_boxes else None,
        list_rods(particles, shapes, parts, part_group, rods, skin) if families.rods else None,
    )


def sphere_overlaps(contacts: Contacts, particles: Particles, shapes: Shapes) -> np.ndarray:
    """Overlaps (pairs,) [m] of pairs of spheres, negative where they are apart, which no pass keeps."""
    first, second = contacts.first, contacts.second
    apart = np.linalg.norm(particles.position[:, first] - particles.position[:, second], axis=0)
    return shapes.radius[first] + shapes.radius[second] - apart


def overlaps_of(family: Listed | ListedSpheres, particles: Particles, shapes: Shapes) -> np.ndarray:
    """Overlaps (pairs,) [m] of a family's pairs at the last forces."""
    contacts = family[0]
    return sphere_overlaps(contacts, particles, shapes) if contacts.overlap is None else contacts.overlap


def with_surfaces(lists: Lists, walls: Walls) -> Lists:
    """The lists as the steps take them: those of walls bring the triangles, which no checkpoint needs."""
    of_walls = {name: getattr(lists, name) for name in ("walls", "points")}
    return lists._replace(
        **{name: (*family, walls) for name, family in of_walls.items() if family is not None}
    )


def carry(new: Lists, old: Lists, origin: np.ndarray, parts: int) -> None:
    """Copy contact history from the old lists; `origin` is the old slot of each particle, -1 for new ones."""
    same_part = np.arange(parts, dtype=np.int64)
    if new.walls is not None:
        carry_walls(new.walls, old.walls, origin)
    if new.points is not None:
        carry_points(new.points, old.points, origin)
    if new.rods is not None:
        carry_rods(new.rods, old.rods, origin, parts)
    for name in ("spheres", "boxes", "box_boxes", "sphere_parts", "box_parts"):
        if getattr(new, name) is None:
            continue
        contacts, before = getattr(new, name)[0], getattr(old, name)[0]
        if name in BETWEEN_PARTICLES:
            half = name != "boxes"
            carry_history(contacts, before, contacts.second, before.second, origin, origin, half)
        else:
            carry_history(contacts, before, contacts.first, before.first, same_part, origin, False)
