"""The energy book: where all energy of a scene is, and what brought or took it since the start.

    energies now + losses = energies at the start + work + energy brought by bulk - energy taken out by bulk + residual

The springs are evaluated, the losses and works are summed up step by step (`solver.ledger`) from the loads that really
acted, each by itself; the residual is what they do not explain: the error of the time integration, of second order in
the step where the motion is smooth. Bodies whose motion is prescribed count as infinitely heavy: their energy of motion
is left out, what moves them is a drive.

What velocity Verlet conserves of a vibration is not its energy but that less dt^2/8 of force^2/mass, exactly if the
springs are linear (`held_back`). The stretched belt of the sample releases 12 J into fast vibrations in its first 20
steps; without this term 0.45 J of them seemed lost, with it the book closes to some 1e-3 J.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from beltsim.scene import Scene
from beltsim.solver import ledger as rows
from beltsim.solver.bonds import bond_measures
from beltsim.solver.ledger import Ledger
from beltsim.solver.motion import FREE

ENERGIES = (
    "kinetic",
    "rotational",
    "parts",
    "gravitational",
    "bonds",
    "contact_normal",
    "contact_tangential",
    "contact_rolling",
    "integration",
)
LOSSES = (
    "bond_damping",
    "contact_damping",
    "friction",
    "rolling",
    "spring_change",
    "global_damping",
    "bearings",
    "breakage",
)
WORKS = ("drives", "forces", "brought", "taken")

OBSERVABLES = (
    *((f"energy_{name}", "J", 1) for name in ENERGIES),
    *((f"loss_{name}", "J", 1) for name in LOSSES),
    *((f"work_{name}", "J", 1) for name in WORKS),
    ("energy_residual", "J", 1),
)

LOSS_ROWS = {
    "contact_damping": rows.LOST_DAMPING,
    "friction": rows.LOST_FRICTION,
    "rolling": rows.LOST_ROLLING,
    "spring_change": rows.LOST_SPRING,
}
SPRING_ROWS = {
    "contact_normal": rows.NORMAL,
    "contact_tangential": rows.TANGENTIAL,
    "contact_rolling": rows.ROLLING,
}


@dataclass
class Account:
    """The book of a run, kept from its first step."""

    ledger: Ledger
    past: np.ndarray  # (CONTACT_ROWS,) J, losses in contact lists that are no more
    start: dict[str, float] | None = None  # energies when the book was opened
    moved: dict[str, float] = field(default_factory=lambda: {"brought": 0.0, "taken": 0.0, "drives": 0.0})
    largest: dict[str, float] = field(default_factory=dict)  # of the change of each term so far


def account_of(scene: Scene) -> Account:
    """An empty book; from now on the bonds keep theirs too."""
    parts = len(scene.machinery.info)
    ledger = Ledger(np.zeros(rows.TOTAL_ROWS), np.zeros((3, parts)), np.zeros((3, parts)))
    if scene.bonding is not None:
        book = np.zeros((rows.BOND_ROWS, scene.runs.bond.size))
        scene.bonding.bonds = scene.bonds._replace(book=book)
    return Account(ledger, np.zeros(rows.CONTACT_ROWS))


# --- energies ------------------------------------------------------------------------------------------------------


def energies(state) -> dict[str, float]:
    """All energies [J] of the scene at this moment."""
    scene = state.scene
    particles = scene.population.particles
    of_bonds = 0.0 if scene.bonds is None else bond_measures(particles, scene.bonds, scene.kinds)[1]
    return (
        energy_of_motion(particles, scene.gravity, np.ones(particles.mass.size, bool))
        | {"parts": energy_of_parts(state), "bonds": float(of_bonds), "integration": held_back(state)}
        | {name: float(contact_sums(state)[row]) for name, row in SPRING_ROWS.items()}
    )


def energy_of_motion(particles, gravity: np.ndarray, chosen: np.ndarray) -> dict[str, float]:
    """Energies [J] of chosen particles (n,) bool that do not depend on others."""
    mass, moves, turns = particles.mass[chosen], *particles.mobility[:, chosen]
    spin = np.sum(particles.angular_velocity[:, chosen] * particles.angular_momentum[:, chosen], axis=0)
    return {
        "kinetic": 0.5 * float(np.sum(moves * mass * np.sum(particles.velocity[:, chosen] ** 2, axis=0))),
        "rotational": 0.5 * float(np.sum(turns * spin)),
        "gravitational": -float(gravity @ (particles.position[:, chosen] @ mass)),
    }


def held_back(state) -> float:
    """What velocity Verlet conserves beside the energy [J]: -dt^2/8 (force^2/mass + torque^2/inertia) of what moves.

    Of a linear vibration 1/2 m v^2 + 1/2 k x^2 (1 - (omega dt)^2/4) stays as it is: k x is the force.
    """
    particles, step = state.scene.population.particles, state.stage.time_step
    moves, turns = particles.mobility
    frame = Rotation.from_quat(particles.orientation[[1, 2, 3, 0]].T)
    torque = frame.inv().apply(particles.torque.T).T
    pushed = moves * np.sum(particles.force**2, axis=0) / particles.mass
    turned = turns * np.sum(torque**2 / particles.inertia, axis=0)
    return -0.125 * step**2 * float(np.sum(pushed + turned))


def energy_of_parts(state) -> float:
    """Energy [J] of motion of parts that follow their loads, and of their suspensions."""
    parts, spins, slides = state.scene.machinery.parts, state.stage.spins, state.stage.slides
    turning = spins.inertia * np.sum(parts.angular_velocity**2, axis=0) * (spins.mode == FREE)
    mass = np.maximum(slides.mass, 0.0)  # below 0: a cylinder that flies
    moving = mass * np.sum(parts.velocity**2, axis=0)
    springs = slides.stiffness * slides.offset**2 * (slides.mass > 0.0)
    return 0.5 * float(np.sum(turning + moving + springs))


def energy_in_motion(state) -> float:
    """Energy [J] of motion and place of all particles and parts that follow their loads."""
    particles = state.scene.population.particles
    chosen = np.ones(particles.mass.size, bool)
    return sum(energy_of_motion(particles, state.scene.gravity, chosen).values()) + energy_of_parts(state)


def contact_sums(state) -> np.ndarray:
    """Sums (CONTACT_ROWS,) [J] of the books of all present contact lists."""
    total = np.zeros(rows.CONTACT_ROWS)
    for family in state.lists:
        if family is not None:
            total += family[0].book.sum(axis=1)
    return total


# --- what happens between the steps --------------------------------------------------------------------------------


def with_books(lists):
    """The same contact lists with empty books."""
    return type(lists)(
        *(
            None
            if family is None
            else with_first(
                family, family[0]._replace(book=np.zeros((rows.CONTACT_ROWS, family[0].first.size)))
            )
            for family in lists
        )
    )


def with_first(family: tuple, contacts) -> tuple:
    """A list of contacts and what belongs to it, with other contacts."""
    rest = (contacts, *family[1:])
    return type(family)(*rest) if hasattr(family, "_fields") else rest


def close_lists(account: Account, lists) -> None:
    """Keep the losses of lists that are made anew."""
    if lists is not None:
        for family in lists:
            if family is not None:
                account.past[rows.CARRIED :] += family[0].book[rows.CARRIED :].sum(axis=1)


def open_stage(state, before: float, held: float) -> None:
    """At the start of a stage other things are led, and the step is another one.

    `before` and `held` are what `energy_in_motion` and `held_back` said until then [J].
    """
    account = state.account
    if account.start is None:
        forget_losses(state)
        account.start = energies(state)
    else:
        account.moved["drives"] += energy_in_motion(state) - before
        account.start["integration"] += held_back(state) - held


def forget_losses(state) -> None:
    """Begin all sums at zero: the first look at the forces fills the springs of what touches at the start."""
    for family in state.lists:
        if family is not None:
            family[0].book[rows.CARRIED :] = 0.0


def note_arrivals(state, ids: np.ndarray) -> None:
    """Bulk came, by its ids: where it stands depends on how spheres were sorted meanwhile."""
    population = state.scene.population
    new = np.isin(population.id, ids)
    own = energy_of_motion(population.particles, state.scene.gravity, new)
    state.account.moved["brought"] += sum(own.values())


def departing(state, leaves: np.ndarray) -> float:
    """Energy [J] of motion of the particles that leave (n,) bool, and of all contacts' springs while they are there."""
    scene = state.scene
    own = energy_of_motion(scene.population.particles, scene.gravity, leaves)
    return sum(own.values()) + springs(state)


def note_departures(state, before: float) -> None:
    """Bulk is gone, and the springs of its contacts with it; `before` is what `departing` said."""
    state.account.moved["taken"] += before - springs(state)


def springs(state) -> float:
    """Energy [J] of all contacts' springs."""
    return float(contact_sums(state)[list(SPRING_ROWS.values())].sum())


# --- the balance ---------------------------------------------------------------------------------------------------


def balance(state) -> dict[str, float]:
    """All terms of the book [J] by the names of the observables, the residual last."""
    account = state.account
    now, lost, done = energies(state), losses(state), works(account, state)
    stored = sum(now.values()) - sum(account.start.values())
    residual = stored + sum(lost.values()) - done["drives"] - done["forces"] - done["brought"] + done["taken"]
    return (
        {f"energy_{name}": now[name] for name in ENERGIES}
        | {f"loss_{name}": lost[name] for name in LOSSES}
        | {f"work_{name}": done[name] for name in WORKS}
        | {"energy_residual": residual}
    )


def losses(state) -> dict[str, float]:
    """Energy [J] lost since the start, by mechanism."""
    account, bonds = state.account, state.scene.bonds
    of_contacts = account.past + contact_sums(state)
    total = account.ledger.total
    of_bonds = np.zeros(rows.BOND_ROWS) if bonds is None else bonds.book.sum(axis=1)
    return {name: float(of_contacts[row]) for name, row in LOSS_ROWS.items()} | {
        "bond_damping": float(of_bonds[rows.BOND_DAMPING]),
        "breakage": float(of_bonds[rows.BOND_BREAKAGE]),
        "global_damping": float(total[rows.GLOBAL_DAMPING]),
        "bearings": float(total[rows.BEARINGS]),
    }


def works(account: Account, state) -> dict[str, float]:  # noqa: ARG001
    """Energy [J] that drives, loads and bulk brought since the start, and that bulk took along."""
    total = account.ledger.total
    return {
        "drives": float(total[rows.DRIVES]) + account.moved["drives"],
        "forces": float(total[rows.FORCES]),
        "brought": account.moved["brought"],
        "taken": account.moved["taken"],
    }


def drift(account: Account, terms: dict[str, float]) -> float:
    """Residual over the largest change that any term of the book has shown so far; 0 before anything changed."""
    for name, _, _ in OBSERVABLES:
        value = terms[name]
        if name != "energy_residual":
            first = (
                account.start.get(name.removeprefix("energy_"), 0.0) if name.startswith("energy_") else 0.0
            )
            account.largest[name] = max(account.largest.get(name, 0.0), abs(value - first))
    scale = max(account.largest.values(), default=0.0)
    return abs(terms["energy_residual"]) / scale if scale > 0.0 else 0.0
