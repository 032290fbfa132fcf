"""Mass, inertia and sizes of particle types; particles in slot order."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from beltsim import inp
from beltsim.inp import Block, Deck
from beltsim.solver.state import Particles

SPHERE, BOX, CYLINDER = "SPHERE", "ROUNDED BOX", "CYLINDER"


@dataclass(frozen=True)
class Body:
    """A particle type: what every particle of it has unless its own row says otherwise."""

    name: str
    shape: str
    half_extent: tuple[float, float, float]  # m, outer
    edge_radius: float  # m; the radius of a sphere
    mass: float  # kg
    inertia: tuple[float, float, float]  # kg m2
    material: str
    group: str | None
    fixed: str  # NO, YES or POSITION
    block: Block


def rounded_box_volume(size: tuple, r: float) -> float:
    """Volume of a box of outer `size` whose edges are rounded with radius r (Steiner's formula of the core)."""
    a, b, c = (side - 2.0 * r for side in size)
    return (
        a * b * c
        + 2.0 * r * (a * b + b * c + c * a)
        + math.pi * r * r * (a + b + c)
        + 4.0 / 3.0 * math.pi * r**3
    )


def rounded_cylinder_volume(radius: float, length: float, r: float) -> float:
    """Volume of a cylinder of outer sizes whose end edges are rounded with radius r."""
    core = radius - r
    rounded = core * core * r + core * math.pi * r * r / 2.0 + 2.0 / 3.0 * r**3
    return math.pi * (radius * radius * (length - 2.0 * r) + 2.0 * rounded)


def body_of(block: Block, densities: dict[str, float]) -> Body:
    """The particle type of a *PARTICLE TYPE block."""
    shape, r = block["SHAPE"], block.get("EDGE RADIUS") or 0.0
    density = densities[block["MATERIAL"]]
    if shape == SPHERE:
        r = block["RADIUS"]
        size, volume = (2.0 * r,) * 3, 4.0 / 3.0 * math.pi * r**3
        shares = (0.4 * r * r,) * 3
    elif shape == BOX:
        size = x, y, z = block["SIZE X"], block["SIZE Y"], block["SIZE Z"]
        volume = rounded_box_volume(size, r)
        shares = ((y * y + z * z) / 12.0, (x * x + z * z) / 12.0, (x * x + y * y) / 12.0)
    else:
        radius, length = 0.5 * block["DIAMETER"], block["LENGTH"]
        size, volume = (2.0 * radius, 2.0 * radius, length), rounded_cylinder_volume(radius, length, r)
        across = (3.0 * radius * radius + length * length) / 12.0
        shares = (across, across, 0.5 * radius * radius)
    mass = block.get("MASS") or density * volume
    inertia = tuple(block.get(f"INERTIA {axis}") or mass * share for axis, share in zip("XYZ", shares))
    return Body(
        block["NAME"],
        shape,
        tuple(0.5 * side for side in size),
        r,
        mass,
        inertia,
        block["MATERIAL"],
        block.get("CONTACT GROUP"),
        block["FIXED"],
        block,
    )


@dataclass
class Population:
    """All particles in slot order: first those that stay (bonded, fixed or not spheres), then free spheres."""

    bodies: list[Body]  # row = species
    id: np.ndarray  # (n,) int64
    species: np.ndarray  # (n,) int32
    half_extent: np.ndarray  # (n, 3) m
    edge_radius: np.ndarray  # (n,) m
    particles: Particles
    permanent: int  # how many stay for the whole run

    @property
    def count(self) -> int:
        """Number of particles."""
        return self.id.size

    def present(self, ids: np.ndarray) -> np.ndarray:
        """Which of the ids (n,) bool are there: bulk may have left."""
        return np.isin(ids, self.id)

    def slots_of(self, ids: np.ndarray) -> np.ndarray:
        """Slots of particle ids that are there."""
        order = np.argsort(self.id, kind="stable")
        return order[np.searchsorted(self.id, ids, sorter=order)]


def make_particles(
    position: np.ndarray, orientation: np.ndarray, mass: np.ndarray, inertia: np.ndarray
) -> Particles:
    """Particles at rest that move freely, from rows (n, 3), (n, 4), (n,), (n, 3)."""
    n = mass.size

    return Particles(
        position=in_lines(position.T),
        velocity=in_lines(np.zeros((3, n))),
        orientation=in_lines(orientation.T),
        angular_momentum=in_lines(np.zeros((3, n))),
        angular_velocity=in_lines(np.zeros((3, n))),
        force=in_lines(np.zeros((3, n))),
        torque=in_lines(np.zeros((3, n))),
        mass=in_lines(mass),
        inertia=in_lines(inertia.T),
        mobility=in_lines(np.ones((2, n))),
    )


def in_lines(values: np.ndarray) -> np.ndarray:
    """A copy that begins at a cache line: vectors of eight do not lie across two (a strip of 400 x 40: 10 %)."""
    room = np.empty(values.size + 7)
    skipped = -room.ctypes.data // room.itemsize % 8
    lines = room[skipped : skipped + values.size].reshape(values.shape)
    lines[:] = values
    return lines


def populate(deck: Deck) -> Population:
    """All particles of a deck, with sizes and velocities of their own rows."""
    densities = {block["NAME"]: block["DENSITY"] for block in deck.blocks("MATERIAL")}
    bodies = [body_of(block, densities) for block in inp.by_name(deck, "PARTICLE TYPE").values()]
    rows = {body.name: row for row, body in enumerate(bodies)}
    blocks = deck.blocks("PARTICLE")
    ids = stack([block.rows["id"] for block in blocks], (0,), np.int64)
    species = stack([np.full(len(block), rows[block["TYPE"]]) for block in blocks], (0,), np.int32)
    position = stack([block.rows["position"] for block in blocks], (0, 3))
    orientation = stack([block.rows["orientation"] for block in blocks], (0, 4))
    order, permanent = slot_order(deck, bodies, ids, species)
    ids, species, position, orientation = ids[order], species[order], position[order], orientation[order]

    half_extent = table(bodies, "half_extent", 3)[species]
    edge_radius = table(bodies, "edge_radius", 0)[species]
    mass, inertia = table(bodies, "mass", 0)[species], table(bodies, "inertia", 3)[species]
    population = Population(bodies, ids, species, half_extent, edge_radius, None, permanent)
    for block in deck.blocks("PARTICLE SIZE"):
        slots = population.slots_of(block.rows["id"])
        half_extent[slots] = 0.5 * block.rows["size"]
        mass[slots], inertia[slots] = block.rows["mass"], block.rows["inertia"]
    population.particles = make_particles(position, orientation, mass, inertia)
    set_velocities(deck, population)
    hold_fixed(population)
    return population


def slot_order(
    deck: Deck, bodies: list[Body], ids: np.ndarray, species: np.ndarray
) -> tuple[np.ndarray, int]:
    """Order of the slots, and how many particles stay for the whole run."""
    bonded = stack([block.rows["particles"].ravel() for block in deck.blocks("BOND")], (0,), np.int64)
    may_leave = np.array([body.shape == SPHERE and body.fixed == "NO" for body in bodies], bool)
    leaves = may_leave[species] & ~np.isin(ids, bonded) if bodies else np.zeros(0, bool)
    return np.argsort(leaves, kind="stable"), int(np.count_nonzero(~leaves))


def set_velocities(deck: Deck, population: Population) -> None:
    """Velocities of *INITIAL VELOCITY."""
    particles = population.particles
    for block in deck.blocks("INITIAL VELOCITY"):
        slots = population.slots_of(block.rows["id"])
        particles.velocity[:, slots] = block.rows["velocity"].T
        particles.angular_velocity[:, slots] = block.rows["angular_velocity"].T
    particles.angular_momentum[:] = world_momentum(particles)


def world_momentum(particles: Particles) -> np.ndarray:
    """Angular momentum (3, n) in world axes, from the angular velocity."""
    from scipy.spatial.transform import Rotation

    if particles.mass.size == 0:
        return np.zeros((3, 0))
    frame = Rotation.from_quat(particles.orientation.T, scalar_first=True)
    local = frame.inv().apply(particles.angular_velocity.T) * particles.inertia.T
    return np.ascontiguousarray(frame.apply(local).T)


def own_mobility(population: Population) -> np.ndarray:
    """Mobility (2, n) of all particles by their types alone. Cylinders that only spin do so as parts."""
    moves = np.array([body.fixed == "NO" for body in population.bodies], np.float64)
    spins = [body.fixed == "POSITION" and body.shape != CYLINDER for body in population.bodies]
    if not population.bodies:
        return np.ones((2, population.count))
    return np.ascontiguousarray(np.stack([moves, np.maximum(moves, spins)])[:, population.species])


def hold_fixed(population: Population) -> None:
    """Take the mobility and the initial velocity of particles whose type is FIXED."""
    particles = population.particles
    particles.mobility[:] = own_mobility(population)
    moves, turns = particles.mobility > 0.0
    particles.velocity[:, ~moves] = 0.0
    particles.angular_velocity[:, ~turns] = 0.0
    particles.angular_momentum[:, ~turns] = 0.0


def stack(arrays: list, empty: tuple, dtype=np.float64) -> np.ndarray:
    """The arrays one after the other; an empty one of shape `empty` if there are none."""
    return np.concatenate(arrays).astype(dtype) if arrays else np.zeros(empty, dtype)


def table(bodies: list[Body], name: str, width: int) -> np.ndarray:
    """One property of all types, (types,) or (types, width)."""
    values = np.array([getattr(body, name) for body in bodies], dtype=np.float64)
    return values.reshape(-1, width) if width else values
