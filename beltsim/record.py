"""What a run records: the contents of its trajectory and one frame of the present state."""

from __future__ import annotations

import numpy as np

from beltsim import energy
from beltsim.engine import State
from beltsim.inp import Block
from beltsim.measures import Measures, observables_of, readings
from beltsim.scene import Scene
from beltsim.solver.bonds import bond_measures
from beltsim.solver.state import Particles
from beltsim.trajectory import Contents, Frame, PartDescription
from beltsim.trajectory.layout import FIELDS

OBSERVABLES = (
    ("kinetic_energy", "J", 1),
    ("rotational_energy", "J", 1),
    ("bond_energy", "J", 1),
    ("gravitational_energy", "J", 1),
    ("momentum", "kg m s-1", 3),
    ("particle_mass", "kg", 1),
    ("inserted_mass", "kg", 1),
    ("removed_mass", "kg", 1),
    ("broken_bonds", "1", 1),
)
MEASURE_ROWS = ("axial_force", "shear_force", "bending_moment", "twist_moment", "elongation", "bending")


def contents_of(scene: Scene, arriving: int, output: Block | None, measures: Measures) -> Contents:
    """Contents of the trajectory of a scene into which `arriving` particles can come.

    Slots that can change their particle type leave their properties to the frames.
    """
    population = scene.population
    bodies = population.bodies
    leaving = scene.domain is not None and population.permanent < population.count
    dynamic = bool(scene.sources) or leaving
    slots = population.count + arriving
    coming = {bodies[s].name for s in np.unique(population.species[population.permanent :])}
    coming |= {name for block in scene.sources for name in type_names(block)}
    fixed = not dynamic or len(coming) == 1
    filler = next((n for n, body in enumerate(bodies) if body.name in coming), 0)
    species = np.concatenate([population.species, np.full(arriving, filler)]).astype(np.int32)

    def filled(values, name):
        return (
            np.concatenate([values, np.repeat([getattr(bodies[filler], name)], arriving, axis=0)])
            if slots
            else None
        )

    fields = output["FIELDS"] if output is not None else ("VELOCITY", "ORIENTATION")
    bonds = scene.bonds
    place = scene.bonding.place if scene.bonding else None
    return Contents(
        slots=slots,
        species=tuple(body.name for body in bodies),
        dynamic=dynamic,
        id=None if dynamic else population.id,
        species_of=species if fixed else None,
        mass=filled(population.particles.mass, "mass") if fixed else None,
        radius=filled(radius_of(scene), "edge_radius") if fixed else None,
        half_extent=filled(population.half_extent, "half_extent") if fixed else None,
        edge_radius=filled(population.edge_radius, "edge_radius") if fixed else None,
        bonds=None
        if bonds is None
        else np.stack([bonds.first, bonds.second], axis=1)[place].astype(np.int64),
        parts=tuple(descriptions(scene)),
        fields=frozenset(name for name in fields if name in FIELDS),
        observables=OBSERVABLES
        + observables_of(measures)
        + (energy.OBSERVABLES if keeps_energy(output) else ()),
        shapes=tuple(body.shape for body in bodies),
        colors=tuple(body.block.get("COLOR") or "" for body in bodies),
        double=output is not None and output["PRECISION"] == "DOUBLE",
        compress=output is not None and bool(output["COMPRESS"]),
    )


def keeps_energy(output: Block | None) -> bool:
    """Whether an *OUTPUT asks for the energy book."""
    return output is not None and "ENERGY" in output["FIELDS"]


def type_names(block: Block) -> list[str]:
    """Particle types that a *SOURCE brings."""
    return [name for name, _ in block.rows["fractions"]] or [block["PARTICLE TYPE"]]


def radius_of(scene: Scene) -> np.ndarray:
    """Radius (n,) [m] that stands for a particle's size: a sphere's own, else the bounding radius."""
    round_ones = np.array([body.shape == "SPHERE" for body in scene.population.bodies], bool)
    population = scene.population
    return np.where(round_ones[population.species], population.edge_radius, scene.shapes.bounding)


def descriptions(scene: Scene) -> list[PartDescription]:
    """What stays the same about each *PART; cylinder particles are among the particles."""
    parts, found = scene.machinery.parts, []
    meshes = {mesh.part: mesh for mesh in scene.machinery.meshes}
    for p, info in enumerate(scene.machinery.info):
        if info.particle < 0:
            sizes, surface = {}, ()
            if p in meshes:
                surface = meshes[p].vertices, meshes[p].triangles
            elif np.isfinite(parts.radius[p]):
                sizes = {
                    "diameter": 2.0 * float(parts.radius[p]),
                    "length": 2.0 * float(parts.half_length[p]),
                    "edge_radius": float(parts.edge_radius[p]),
                }
            found.append(PartDescription(info.name, info.shape, info.part_class, sizes, info.color, *surface))
    return found


def follow_cylinders(scene: Scene) -> None:
    """Copy the state of parts that stand for held cylinder particles to those particles."""
    particles, parts = scene.population.particles, scene.machinery.parts
    for p, info in enumerate(scene.machinery.info):
        if info.particle >= 0 and not info.flies:
            for name in ("position", "orientation", "velocity", "angular_velocity", "force", "torque"):
                getattr(particles, name)[:, info.particle] = getattr(parts, name)[:, p]


def frame_of(state: State, contents: Contents, tally: dict[str, float], measures: Measures) -> Frame:
    """The present state as a frame; `tally` holds the inserted and removed mass."""
    scene, population = state.scene, state.scene.population
    follow_cylinders(scene)
    particles = population.particles
    of_bonds, bond_energy = np.zeros((6, 0)), 0.0
    if scene.bonds is not None:
        of_bonds, bond_energy = bond_measures(particles, scene.bonds, scene.kinds)
    bonds = {}
    if scene.bonds is not None:
        place = scene.bonding.place
        bonds = dict(zip(MEASURE_ROWS, of_bonds[:, place]))
        bonds["broken"] = (scene.bonds.intact[place] == 0).astype(np.uint8)
    varying = contents.species_of is None
    # Spheres are sorted by place as they move; frames keep the order of the deck where nobody comes or leaves.
    sorted_anew = contents.id is not None and not np.array_equal(population.id, contents.id)
    slots = population.slots_of(contents.id) if sorted_anew else slice(None)
    return Frame(
        step=state.total_steps,
        time=state.time,
        position=particles.position.T[slots],
        velocity=particles.velocity.T[slots],
        orientation=particles.orientation.T[slots],
        angular_velocity=particles.angular_velocity.T[slots],
        force=particles.force.T[slots],
        torque=particles.torque.T[slots],
        id=population.id[slots],
        species_of=population.species[slots] if varying else None,
        mass=particles.mass[slots] if varying else None,
        radius=radius_of(scene)[slots] if varying else None,
        half_extent=population.half_extent[slots] if varying else None,
        edge_radius=population.edge_radius[slots] if varying else None,
        bonds=bonds,
        parts=part_states(scene),
        observables=energies(scene, particles, bond_energy)
        | tally
        | {"broken_bonds": broken(scene)}
        | readings(measures, scene, state.time, of_bonds[0], state.part_work)
        | ({} if state.account is None else energy.balance(state)),
    )


def part_states(scene: Scene) -> dict[str, dict[str, np.ndarray]]:
    """Position, orientation, angular velocity, force and torque of each *PART."""
    parts = scene.machinery.parts
    names = ("position", "orientation", "angular_velocity", "force", "torque")
    return {
        info.name: {name: getattr(parts, name)[:, p].copy() for name in names}
        for p, info in enumerate(scene.machinery.info)
        if info.particle < 0
    }


def energies(scene: Scene, particles: Particles, bond_energy: float) -> dict:
    """Energies and momentum of all particles."""
    mass, velocity = particles.mass, particles.velocity
    spin = 0.5 * float(np.sum(particles.angular_velocity * particles.angular_momentum))
    return {
        "kinetic_energy": 0.5 * float(np.sum(mass * velocity**2)),
        "rotational_energy": spin,
        "bond_energy": float(bond_energy),
        "gravitational_energy": -float(scene.gravity @ (particles.position @ mass)),
        "momentum": velocity @ mass,
        "particle_mass": float(mass.sum()),
    }


def broken(scene: Scene) -> int:
    """Number of broken bonds."""
    return 0 if scene.bonds is None else int(np.count_nonzero(scene.bonds.intact == 0))
