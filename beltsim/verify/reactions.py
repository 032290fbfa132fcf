"""Action and reaction: pairs of every kind touch, and momentum and angular momentum close, what parts take included."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from beltsim.engine import State, advance_by
from beltsim.inp import Deck
from beltsim.scene.bodies import world_momentum
from beltsim.verify.case import Case, Findings, Row
from beltsim.verify.loops import ACROSS
from beltsim.verify.spheres import Stuff, add_floor, add_mesh, add_spheres, contact_deck
from beltsim.verify.stepping import energy_of, momenta_of, start
from beltsim.verify.strips import Strip, add_strip

STUFF = Stuff(5e6, 0.3, 1200.0)
STEP, STEPS = 2e-5, 2000
SIZE, EDGE = (0.05, 0.06, 0.02), 0.003  # m, of boxes
TILT = (0.99498744, 0.06, -0.05, 0.06244998)  # a few degrees about all axes


def touching_deck() -> Deck:
    """A deck in which everything has friction, damping and rolling resistance."""
    deck = contact_deck(time_step=STEP, friction=0.4, restitution=0.6, rolling=0.1, stuff=STUFF)
    deck.add("CONTACT GROUP", name="one")
    deck.add("CONTACT GROUP", name="two")
    return deck


def add_box(deck: Deck, name: str, place, group: str) -> None:
    """A tilted rounded box."""
    given = {f"size_{axis}": side for axis, side in zip("xyz", SIZE)}
    given |= {"edge_radius": EDGE, "material": "stuff", "contact_group": group}
    deck.add("PARTICLE TYPE", name=name, shape="ROUNDED BOX", **given)
    first = 1 + sum(len(block) for block in deck.blocks("PARTICLE"))
    rows = {"id": [first], "position": [place], "orientation": [TILT]}
    deck.add("PARTICLE", type=name, rows=rows)


def add_roller(deck: Deck) -> None:
    """A rounded cylinder along y about the origin, free to turn."""
    given = {"diameter": 0.1, "length": 0.2, "edge_radius": 0.004, "material": "stuff"}
    rows = {"position": [[0.0, 0.0, 0.0]], "orientation": [ACROSS]}
    deck.add("PART", name="roller", shape="CYLINDER", **given, rows=rows)
    deck.add("MOTION", part="roller", type="FREE ROTATION", inertia=1e-3)


def add_wedge(deck: Deck, folder: Path) -> None:
    """A mesh: two faces that meet in a ridge along y at the origin."""
    vertices = [
        [0, -0.2, 0],
        [0, 0.2, 0],
        [-0.2, -0.2, -0.1],
        [-0.2, 0.2, -0.1],
        [0.2, -0.2, -0.1],
        [0.2, 0.2, -0.1],
    ]
    add_mesh(
        deck, folder / "wedge.obj", vertices, [[0, 1, 2], [1, 3, 2], [0, 4, 1], [1, 4, 5]], "wedge", "stuff"
    )


def pair_of_particles(first: str, second: str) -> Deck:
    """Two free particles, sphere or box, of which the first falls on the second off centre."""
    deck = touching_deck()
    height = 0.03 if first == second else 0.024
    for name, kind, place in (("a", first, [0.004, 0.006, height]), ("b", second, [0.0, 0.0, 0.0])):
        if kind == "sphere":
            add_spheres(deck, name, "stuff", 0.0125, place)
        else:
            add_box(deck, name, place, "one" if name == "a" else "two")
    return deck


def on_part(kind: str, part: str, folder: Path) -> Deck:
    """A sphere or a box that falls on a part off centre."""
    deck = touching_deck()
    top = {"cylinder": 0.05, "plane": 0.0, "mesh": 0.0}[part]
    {
        "cylinder": add_roller,
        "plane": lambda d: add_floor(d, "stuff"),
        "mesh": lambda d: add_wedge(d, folder),
    }[part](deck)
    if kind == "sphere":
        add_spheres(deck, "a", "stuff", 0.01, [0.004, 0.006, top + 0.011])
    else:
        add_box(deck, "a", [0.004, 0.006, top + 0.018], "one")
    return deck


def belt_over_roller() -> Deck:
    """A strip that falls across a roller."""
    deck = touching_deck()
    strip = Strip(bonds=12, length=0.6, damping=0.1)
    x = np.linspace(-0.3, 0.3, 13)
    add_strip(deck, strip, np.column_stack([x + 0.013, 0.0 * x, 0.0 * x + 0.0555]))
    add_roller(deck)
    return deck


def unclosed(deck: Deck) -> tuple[float, float]:
    """What momentum and angular momentum about the origin do not close by, as shares of sum m v and sum m v R.

    Parts take the time integral of their contact loads: of velocity Verlet exactly the sum of the trapezoids.
    """
    state = start(deck, allow_unstable=True)
    set_in_motion(state)
    before, loads = momenta_of(state), part_loads(state)
    particles = state.scene.population.particles
    scale = float(particles.mass @ np.linalg.norm(particles.velocity, axis=0))
    taken, largest = np.zeros((2, 3)), 0.0
    for _ in range(STEPS):
        advance_by(state, 1)
        now = part_loads(state)
        taken += 0.5 * STEP * (loads + now)
        felt = loads if deck.blocks("PART") else particles.torque
        loads, largest = now, max(largest, float(np.abs(felt).max()))
    after = momenta_of(state)
    if largest == 0.0:
        raise RuntimeError("nothing touched")
    reach = float(np.linalg.norm(particles.position, axis=0).max())
    off = [np.abs(now - then + part).max() for now, then, part in zip(after, before, taken)]
    return off[0] / scale, off[1] / (scale * reach)


def set_in_motion(state: State) -> None:
    """Random velocities and spins, and downwards what is above the origin: onto what is there."""
    particles, random = state.scene.population.particles, np.random.default_rng(11)
    particles.velocity[:] = random.uniform(-0.2, 0.2, particles.velocity.shape)
    particles.velocity[2] -= np.where(particles.position[2] > 0.0, 0.6, 0.0)
    particles.angular_velocity[:] = random.uniform(-5.0, 5.0, particles.velocity.shape)
    particles.angular_momentum[:] = world_momentum(particles)


def unkept(deck: Deck) -> float:
    """Largest relative change of the kinetic energy in one elastic impact, from one time of no touch to the next."""
    [law] = deck.blocks("CONTACT PROPERTY")
    law.parameters |= {"FRICTION": 0.0, "RESTITUTION": 1.0, "ROLLING FRICTION": 0.0}
    deck.blocks("STEP")[0].parameters["TIME STEP"] = 0.25 * STEP
    state = start(deck, allow_unstable=True)
    set_in_motion(state)
    particles, energies = state.scene.population.particles, [energy_of(state)]
    for _ in range(STEPS):
        advance_by(state, 4)
        if not particles.force.any():
            energies.append(energy_of(state))
    changes = np.diff(energies) / energies[0]
    if not changes.any():
        raise RuntimeError("nothing touched")
    return float(np.abs(changes).max())


def part_loads(state: State) -> np.ndarray:
    """Force [N] of contacts on all parts, and its moment [N m] about the origin, (2, 3)."""
    parts = state.scene.machinery.parts
    moment = np.cross(parts.position.T, parts.force.T) + parts.torque.T
    return np.array([parts.force.sum(axis=1), moment.sum(axis=0)])


def scenes(folder: Path) -> dict[str, Deck]:
    """A deck for pairs of every kind of shapes that can touch."""
    particles = ("sphere", "sphere"), ("sphere", "box"), ("box", "box")
    parts = [(kind, part) for kind in ("sphere", "box") for part in ("cylinder", "plane", "mesh")]
    return {f"{a} on {b}": pair_of_particles(a, b) for a, b in particles} | {
        f"{kind} on a {part}": on_part(kind, part, folder) for kind, part in parts
    }


def reactions() -> Findings:
    """Momentum and angular momentum over impacts with friction, damping and rolling resistance, pair by pair."""
    with tempfile.TemporaryDirectory() as folder:
        found = {label: unclosed(deck) for label, deck in scenes(Path(folder)).items()}
        found["belt on a free roller"] = unclosed(belt_over_roller())
    rows = []
    for label, (linear, angular) in found.items():
        rows.append(Row(f"momentum / Σ m v, {label}", "-", 0.0, linear, 1e-12, True))
        rows.append(Row(f"angular momentum / Σ m v R, {label}", "-", 0.0, angular, 1e-12, True))
    return Findings(rows)


def elastic() -> Findings:
    """Energy of motion before and after elastic impacts without friction, pair by pair."""
    with tempfile.TemporaryDirectory() as folder:
        found = {label: unkept(deck) for label, deck in scenes(Path(folder)).items()}
    return Findings(
        [Row(f"energy, {label}", "-", 0.0, change, 1e-3, True) for label, change in found.items()]
    )


CASES = {
    "K3": Case(
        "Momenta in contacts",
        "action = reaction; parts take ∫ F dt and ∫ (x × F + T) dt",
        reactions,
        quick=False,
        note="With friction 0.4, restitution 0.6 and rolling resistance, 2000 steps each.",
    ),
    "K4": Case(
        "Elastic impacts",
        "the force is the gradient of an energy",
        elastic,
        quick=False,
        note="Largest change in one impact.",
    ),
}
