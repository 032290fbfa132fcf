"""What went wrong when a run blows up: which particle, when, and what pushed it hardest."""

from __future__ import annotations

import numpy as np

from beltsim.lists import BETWEEN_PARTICLES, sphere_overlaps
from beltsim.scene import Scene
from beltsim.solver.bonds import bond_measures
from beltsim.solver.state import Contacts, Laws
from beltsim.wall_lists import part_of_pairs, part_of_points


def diagnosis(state) -> str:
    """Which particle moved too far, when, and what pushed it."""
    particles, population = state.scene.population.particles, state.scene.population
    speed = np.linalg.norm(particles.velocity, axis=0)
    bad = np.flatnonzero(~np.isfinite(speed))
    culprit = int(bad[0]) if bad.size else int(np.argmax(speed))
    place = ", ".join(f"{value:.4g}" for value in particles.position[:, culprit])
    moved = speed[culprit] * state.stage.time_step
    return (
        f"blow-up at t = {state.time:.6g} s: particle {population.id[culprit]} "
        f"({population.bodies[population.species[culprit]].name}) at ({place}) moves {moved:.3g} m per step "
        f"({speed[culprit]:.3g} m/s), more than the contact margin of {0.5 * state.skin:.3g} m; "
        f"{largest_load(state, culprit)}"
    )


def wound_diagnosis(state) -> str:
    """Which bond is turned almost all the way round, and when."""
    scene, id = state.scene, state.scene.population.id
    measures, _ = bond_measures(scene.population.particles, scene.bonds, scene.kinds)
    worst = int(np.argmax(measures[6]))
    return (
        f"blow-up at t = {state.time:.6g} s: the bond of particles {id[scene.bonds.first[worst]]} and "
        f"{id[scene.bonds.second[worst]]} is turned by {np.degrees(measures[6, worst]):.1f} degrees; beyond 180 its "
        "moment would change its sign"
    )


def largest_load(state, slot: int) -> str:
    """What pushed a particle hardest."""
    scene, population = state.scene, state.scene.population
    loads = [(0.0, "no bond or contact loads it")]
    if scene.bonds is not None:
        measures, _ = bond_measures(population.particles, scene.bonds, scene.kinds)
        force = np.hypot(measures[0], measures[1])
        loads += partners(scene.bonds, force, slot, "bond with particle", population.id)
    if state.lists is None:  # before the first list
        return heaviest(loads)
    parts = np.array([part.name for part in scene.machinery.info])
    loads += of_walls(state, slot, parts)
    for name in ("spheres", "boxes", "box_boxes", "sphere_parts", "box_parts", "rods"):
        family = getattr(state.lists, name)
        if family is not None:
            force = contact_forces(scene, family[0])
            both = name in BETWEEN_PARTICLES
            text, names = ("particle", population.id) if both else ("part", parts)
            loads += partners(family[0], force, slot, f"contact with {text}", names, both)
    return heaviest(loads)


def contact_forces(scene: Scene, contacts: Contacts) -> np.ndarray:
    """Force (pairs,) [N] of each contact; of spheres, whose loads are not kept, that of their springs."""
    if contacts.loads is not None:
        return np.linalg.norm(contacts.loads[:3], axis=0)
    radius, material = scene.shapes.radius, scene.shapes.material
    i, j = contacts.first, contacts.second
    overlap = np.maximum(sphere_overlaps(contacts, scene.population.particles, scene.shapes), 0.0)
    elastic = scene.laws[0][material[i], material[j]] * overlap
    if isinstance(scene.laws, Laws):
        elastic *= 4.0 / 3.0 * np.sqrt(radius[i] * radius[j] / (radius[i] + radius[j]) * overlap)
    return np.hypot(elastic, np.linalg.norm(contacts.spring, axis=0) * (contacts.stiffness > 0.0))


def of_walls(state, slot: int, parts: np.ndarray) -> list[tuple[float, str]]:
    """Forces of meshes and planes on the corners of boxes, and of meshes on spheres, each with the part's name."""
    found = []
    for family, part_of in ((state.lists.walls, part_of_pairs), (state.lists.points, part_of_points)):
        if family is not None:
            pairs = np.flatnonzero(family.contacts.first == slot)
            force = np.linalg.norm(family.contacts.loads[:3, pairs], axis=0)
            names = parts[part_of(family, state.scene.machinery.walls)[pairs]]
            found += [(float(size), f"contact with part {name}") for size, name in zip(force, names)]
    return found


def heaviest(loads: list[tuple[float, str]]) -> str:
    """The largest of some loads in words; one that is no number counts as the largest."""
    force, text = max(loads, key=lambda load: load[0] if np.isfinite(load[0]) else np.inf)
    return text if force == 0.0 else f"its largest load, {force:.4g} N, is the {text}"


def partners(pairs, force, slot: int, text: str, names, both: bool = True) -> list[tuple[float, str]]:
    """Forces on a particle from a list of pairs, each with the name of the partner."""
    first = [
        (float(force[k]), f"{text} {names[pairs.second[k]]}") for k in np.flatnonzero(pairs.first == slot)
    ]
    if not both:
        return first
    return first + [
        (float(force[k]), f"{text} {names[pairs.first[k]]}") for k in np.flatnonzero(pairs.second == slot)
    ]
