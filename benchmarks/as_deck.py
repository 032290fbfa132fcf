"""A scene of `scenes.py` in the words of beltsim: an INP deck made in Python, and its state."""

from __future__ import annotations

import numpy as np
from scenes import (
    BELT_RADIUS,
    BOND_DAMPING,
    BOND_RADIUS,
    BOND_YOUNG,
    FRICTION,
    GRAINS,
    GRAVITY,
    HELD,
    IDLER_RADIUS,
    POISSON,
    RESTITUTION,
    TIME_STEP,
    YOUNG,
    Scene,
    belt_mass,
    upright,
)

from beltsim import inp
from beltsim.engine import State, begin_stage, state_of
from beltsim.run import prepare
from beltsim.scene import build

HALF = np.sqrt(0.5)
FACING = {  # orientations that turn local z towards the free side of a wall
    ("x", -1): (HALF, 0.0, HALF, 0.0),
    ("x", 1): (HALF, 0.0, -HALF, 0.0),
    ("y", -1): (HALF, -HALF, 0.0, 0.0),
    ("y", 1): (HALF, HALF, 0.0, 0.0),
    ("z", -1): (1.0, 0.0, 0.0, 0.0),
}


def deck_of(scene: Scene, drag: float = 0.0) -> inp.Deck:
    """The deck of a scene; `drag` [1/s] is there for settling."""
    deck = inp.Deck()
    deck.add("FORMAT", name="BELTSIM", version=1)
    density = scene.grain_density or 1000.0
    for name in ("stuff", "smooth"):
        deck.add("MATERIAL", name=name, density=density, youngs_modulus=YOUNG, poisson_ratio=POISSON)
    for name, friction in (("*", FRICTION), ("smooth", 0.0)):
        deck.add(
            "CONTACT PROPERTY", material_a=name, material_b="*", friction=friction, restitution=RESTITUTION
        )
    add_particles(deck, scene)
    add_bonds(deck, scene)
    add_parts(deck, scene)
    deck.add("GRAVITY", rows={"acceleration": [(0.0, 0.0, -GRAVITY)]})
    if drag:
        deck.add("DAMPING", mass_proportional=drag)
    deck.add("STEP", duration=1000.0, time_step=TIME_STEP)
    return deck


def add_particles(deck: inp.Deck, scene: Scene) -> None:
    """A particle type for each kind of belt particle and each size of grains; the belt stays in grid order."""
    ids = 1 + np.arange(scene.count)
    if len(scene.rest):
        add_belt_types(deck, with_contacts=bool(scene.idlers))
    stretches = np.flatnonzero(np.diff(scene.kind[: len(scene.rest)])) + 1
    for rows in np.split(np.arange(len(scene.rest)), stretches):
        if rows.size:
            add_rows(deck, scene, "held" if scene.kind[rows[0]] == HELD else "belt", ids, rows)
    for number, radius in enumerate(np.unique(scene.radius[scene.kind == GRAINS])):
        name = f"grain_{number}"
        deck.add("PARTICLE TYPE", name=name, shape="SPHERE", radius=radius, material="stuff")
        add_rows(deck, scene, name, ids, np.flatnonzero((scene.kind == GRAINS) & (scene.radius == radius)))
    rows = {"id": ids, "velocity": scene.velocity, "angular_velocity": scene.spin}
    deck.add("INITIAL VELOCITY", rows=rows)


def add_belt_types(deck: inp.Deck, with_contacts: bool) -> None:
    """Belt particles: boxes where nothing touches them, as belts have; spheres where LAMMPS must do the same."""
    mass = belt_mass()
    deck.add("CONTACT GROUP", name="belt")
    size = 2.0 * BELT_RADIUS
    shape = {"shape": "SPHERE", "radius": BELT_RADIUS}
    if not with_contacts:
        shape = {"shape": "ROUNDED BOX", "size_x": size, "size_y": size, "size_z": size, "edge_radius": 0.005}
    inertia = {f"inertia_{axis}": 0.4 * mass * BELT_RADIUS**2 for axis in "xyz"}
    for name, fixed in (("belt", "NO"), ("held", "YES")):
        deck.add(
            "PARTICLE TYPE",
            name=name,
            mass=mass,
            **inertia,
            **shape,
            material="stuff",
            contact_group="belt",
            fixed=fixed,
        )


def add_rows(deck: inp.Deck, scene: Scene, name: str, ids: np.ndarray, rows: np.ndarray) -> None:
    """Particles of one type."""
    columns = {"id": ids[rows], "position": scene.position[rows], "orientation": scene.orientation[rows]}
    deck.add("PARTICLE", type=name, rows=columns)


def add_bonds(deck: inp.Deck, scene: Scene) -> None:
    """Bonds of round section: one bending stiffness for both directions, as LAMMPS has."""
    if not len(scene.bonds):
        return
    deck.add(
        "BOND TYPE",
        name="rubber",
        radius=BOND_RADIUS,
        youngs_modulus=BOND_YOUNG,
        poisson_ratio=POISSON,
        damping_factor=BOND_DAMPING,
        shear="SPRING",
    )
    first, second = scene.bonds.T
    turn = upright(len(scene.bonds))
    rows = {
        "particles": scene.bonds + 1,
        "position_1": scene.rest[first],
        "orientation_1": turn,
        "position_2": scene.rest[second],
        "orientation_2": turn,
    }
    deck.add("BOND", type="rubber", rows=rows)


def add_parts(deck: inp.Deck, scene: Scene) -> None:
    """Walls that grains touch and belts do not; smooth idlers that only the belt touches."""
    if len(scene.rest) and (scene.walls or scene.idlers):
        for name in ("walls", "idlers"):
            deck.add("CONTACT GROUP", name=name)
        deck.add("CONTACT GROUP PAIR", group_a="walls", group_b="belt", contact="NO")
    group = {"contact_group": "walls"} if len(scene.rest) else {}
    for axis, place, side in scene.walls:
        point = [place if axis == name else 0.0 for name in "xyz"]
        rows = {"position": [point], "orientation": [FACING[axis, side]]}
        deck.add("PART", name=f"wall_{axis}{place:g}", shape="PLANE", material="stuff", **group, rows=rows)
    for number, x in enumerate(scene.idlers):
        centre = (x, 0.5 * scene.width, -(BELT_RADIUS + IDLER_RADIUS))
        deck.add(
            "PART",
            name=f"idler_{number}",
            shape="CYLINDER",
            diameter=2.0 * IDLER_RADIUS,
            length=scene.width + 1.0,
            material="smooth",
            contact_group="idlers",
            rows={"position": [centre], "orientation": [FACING["y", -1]]},
        )


def started(deck: inp.Deck) -> State:
    """The state of a deck at the beginning of its first step, with forces."""
    state = state_of(build(deck))
    begin_stage(state, prepare(state, state.scene.steps[0], 0.0, lambda _: None, True))
    return state


def result_of(state: State) -> dict[str, np.ndarray]:
    """Positions, velocities, spins (n, 3) and orientations (n, 4), by particle id."""
    population = state.scene.population
    particles, order = population.particles, np.argsort(population.id)
    return {
        "position": particles.position.T[order],
        "velocity": particles.velocity.T[order],
        "spin": particles.angular_velocity.T[order],
        "orientation": particles.orientation.T[order],
    }
