"""Particles whose motion a deck prescribes or holds, step by step: *MOTION of particles, and FIXED=POSITION.

Cylinder particles are parts to all that touches them (`beltsim.scene.machinery`), and what turns them stands there.
"""

from __future__ import annotations

import numpy as np

from beltsim import inp
from beltsim.inp import Block, Deck
from beltsim.scene.bodies import CYLINDER, Population, own_mobility, world_momentum
from beltsim.scene.machinery import acts_in, table_of
from beltsim.solver.guides import Guided, Pivots


def slots_of_motion(block: Block, population: Population) -> np.ndarray:
    """Slots of the particles that a *MOTION names and that have not left."""
    if block.get("PARTICLE TYPE") is not None:
        names = [body.name for body in population.bodies]
        wanted = set(inp.matching(names, block["PARTICLE TYPE"]))
        chosen = np.array([name in wanted for name in names], bool)
        return np.flatnonzero(chosen[population.species])
    ids = block["PARTICLES"]
    ids = inp.expand_ids(ids) if isinstance(ids, str) else ids
    ids = np.asarray(ids, dtype=np.int64)
    return population.slots_of(ids[population.present(ids)])


def guides_of(
    deck: Deck, population: Population, tables: dict[str, int], step_name: str | None
) -> tuple[Guided, Pivots | None]:
    """What leads and holds particles in a step: those of a *MOTION, and all that spin about a held axis."""
    led, held = {}, {int(slot): (0.0, 0.0, -1) for slot in np.flatnonzero(spins_only(population))}
    for block in deck.blocks("MOTION"):
        if block.get("PART") is None and acts_in(block, step_name):
            slots, table = slots_of_motion(block, population), table_of(block, tables)
            if block["TYPE"] == "VELOCITY":
                led |= {int(slot): (*velocities_of(block), table) for slot in slots}
            elif block["TYPE"] == "ROTATION":
                axes = axes_of(population, slots)
                led |= {
                    int(slot): (np.zeros(3), block["ANGULAR VELOCITY"] * axis, table)
                    for slot, axis in zip(slots, axes)
                    if not is_cylinder(population, slot)
                }
            elif block["TYPE"] in ("FREE ROTATION", "TORQUE"):
                bearing = block["FRICTION TORQUE"], block.get("TORQUE") or 0.0, table
                slots = [int(slot) for slot in slots if not is_cylinder(population, slot)]
                population.particles.inertia[2, slots] = (
                    block.get("INERTIA") or population.particles.inertia[2, slots]
                )
                held |= dict.fromkeys(slots, bearing)
    return guided_of(led), pivots_of({slot: held[slot] for slot in held if slot not in led})


def spins_only(population: Population) -> np.ndarray:
    """Which particles (n,) bool are held by their position only: those that move by no force but turn."""
    moves, turns = own_mobility(population)
    return (moves == 0.0) & (turns > 0.0)


def is_cylinder(population: Population, slot: int) -> bool:
    """Whether a particle is a cylinder, which turns as a part."""
    return population.bodies[population.species[slot]].shape == CYLINDER


def velocities_of(block: Block) -> tuple[np.ndarray, np.ndarray]:
    """Velocity and angular velocity (3,) of a *MOTION, TYPE=VELOCITY; no spin where none is given."""
    vector, given = np.zeros(6), block.rows["vector"][0]
    vector[: given.size] = np.where(np.isfinite(given), given, 0.0)
    return vector[:3], vector[3:]


def axes_of(population: Population, slots: np.ndarray) -> np.ndarray:
    """Local z (h, 3) of particles in the world."""
    from scipy.spatial.transform import Rotation

    orientation = population.particles.orientation[:, slots].T
    return (
        Rotation.from_quat(orientation, scalar_first=True).apply([0.0, 0.0, 1.0])
        if len(slots)
        else orientation
    )


def guided_of(led: dict) -> Guided:
    """Led particles by slot: (velocity, spin, table)."""
    slots = sorted(led)

    def columns(k):
        return np.ascontiguousarray(np.reshape([led[slot][k] for slot in slots], (-1, 3)).T, dtype=np.float64)

    table = np.array([led[slot][2] for slot in slots], np.int32)
    return Guided(np.array(slots, np.int32), columns(0), columns(1), table)


def pivots_of(held: dict) -> Pivots | None:
    """Held particles by slot: (friction torque, torque, table); None if there are none."""
    if not held:
        return None
    slots = sorted(held)
    friction, torque, table = (np.array(column) for column in zip(*(held[slot] for slot in slots)))
    empty = np.zeros((2, len(slots)))
    return Pivots(np.array(slots, np.int32), friction, torque, table.astype(np.int32), *empty)


def engage(population: Population, guided: Guided, pivots: Pivots | None, released: np.ndarray) -> None:
    """Begin a step: who moves and turns under loads, and the momentum of those that do or did.

    What a motion led until now (slots `released`) goes on freely with the velocity that it has, or stands if its type
    is FIXED. All others keep the mobility that they have.
    """
    particles = population.particles
    mobility = particles.mobility.copy()
    mobility[:, released] = own_mobility(population)[:, released]
    mobility[:, guided.particle] = 0.0
    fresh = np.zeros(population.count, bool)
    if pivots is not None:
        slots = pivots.particle
        fresh[slots], mobility[1, slots] = True, 1.0
        axes = axes_of(population, slots).T
        along = np.sum(axes * particles.angular_velocity[:, slots], axis=0)
        particles.angular_velocity[:, slots] = axes * along
    fresh |= (mobility[1] > 0.0) & (particles.mobility[1] == 0.0)
    for row, velocity in zip(mobility[:, released], (particles.velocity, particles.angular_velocity)):
        velocity[:, released[row == 0.0]] = 0.0
    if np.any(fresh):
        particles.angular_momentum[:, fresh] = world_momentum(particles)[:, fresh]
    particles.angular_momentum[:, guided.particle] = 0.0
    particles.mobility[:] = mobility


def led_slots(guided: Guided, pivots: Pivots | None) -> np.ndarray:
    """Slots of all particles that a step leads or holds."""
    return guided.particle if pivots is None else np.concatenate([guided.particle, pivots.particle])
