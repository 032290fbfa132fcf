"""Start a deck in Python and step it: supports, loads, settling, samples over time."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from beltsim.engine import State, advance_by, begin_stage, state_of
from beltsim.inp import Deck
from beltsim.run import prepare
from beltsim.scene import build
from beltsim.scene.bodies import world_momentum
from beltsim.solver.bonds import bond_measures
from beltsim.solver.steps import GivenLoads


def start(
    deck: Deck,
    *,
    clamped=(),
    pinned=(),
    velocity: np.ndarray | None = None,
    spin: np.ndarray | None = None,
    allow_unstable: bool = False,
) -> State:
    """The state of a deck at the start of its first step.

    Parameters
    ----------
    clamped, pinned : slots whose place is held, with their orientation or free to turn
    velocity, spin : (n, 3) m/s and rad/s in world axes
    """
    scene = build(deck)
    particles = scene.population.particles
    particles.mobility[:, list(clamped)] = 0.0
    particles.mobility[0, list(pinned)] = 0.0
    if velocity is not None:
        particles.velocity[:] = np.asarray(velocity).T
    if spin is not None:
        particles.angular_velocity[:] = np.asarray(spin).T
    particles.angular_momentum[:] = world_momentum(particles)
    state = state_of(scene)
    stage = prepare(state, scene.steps[0], 0.0, lambda _: None, allow_unstable)
    stage.given = no_loads() if stage.given is None else stage.given
    begin_stage(state, stage)
    return state


def no_loads() -> GivenLoads:
    """No loads, of the same type as some: the compiled steps serve both."""
    return GivenLoads(np.zeros(0, np.int32), np.zeros((6, 0)), np.zeros(0, np.int32))


def put_load(state: State, slots, force=(0.0, 0.0, 0.0), torque=(0.0, 0.0, 0.0)) -> None:
    """Replace all loads: the same force [N] and torque [N m] on each of the slots from now on."""
    slots = np.atleast_1d(np.asarray(slots, np.int32))
    load = np.tile(np.array([*force, *torque], dtype=float)[:, None], (1, slots.size))
    state.stage.given = GivenLoads(slots, load, np.full(slots.size, -1, np.int32))


def steps_in(state: State, duration: float) -> int:
    """Whole steps in a duration [s], at least one."""
    return max(1, round(duration / state.stage.time_step))


def run_for(state: State, duration: float) -> State:
    """Step for a duration [s]."""
    advance_by(state, steps_in(state, duration))
    return state


def settle(state: State, frequency: float, periods: float = 3.0) -> State:
    """Come to rest under mass-proportional damping that is critical for the slowest motion.

    What is left of a motion at `frequency` [Hz] falls by exp(-2 pi) = 1/535 each period; the damping is off afterwards.
    """
    state.stage.drag = 4.0 * math.pi * frequency
    run_for(state, periods / frequency)
    state.stage.drag = 0.0
    return state


def ramp(state: State, slots, force, torque, duration: float, stages: int = 50) -> State:
    """Bring a load up in equal small stages."""
    for k in range(1, stages + 1):
        share = k / stages
        put_load(state, slots, np.multiply(force, share), np.multiply(torque, share))
        run_for(state, duration / stages)
    return state


def sampled(
    state: State, duration: float, count: int, measure: Callable[[State], float]
) -> tuple[float, np.ndarray]:
    """Values (count + 1, ...) of a measure at equal intervals, and the interval [s]."""
    every = max(1, round(duration / count / state.stage.time_step))
    values = [measure(state)]
    for _ in range(count):
        advance_by(state, every)
        values.append(measure(state))
    return every * state.stage.time_step, np.array(values)


def growth(interval: float, values: np.ndarray) -> float:
    """The constant c [1/s2] of x'' = c x that fits the samples: -omega^2 of an oscillation.

    The mean of a sample's neighbours is cos(omega h) times it, exactly, for a pure tone of any phase.
    """
    ratio = np.sum((values[2:] + values[:-2]) * values[1:-1]) / (2.0 * np.sum(values[1:-1] ** 2))
    if ratio > 1.0:
        return (math.acosh(ratio) / interval) ** 2
    return -((math.acos(ratio) / interval) ** 2)


def frequency_of(interval: float, values: np.ndarray) -> float:
    """Frequency [Hz] of a pure tone, from samples at an interval [s]."""
    return math.sqrt(-growth(interval, values)) / (2.0 * math.pi)


def position_of(state: State) -> np.ndarray:
    """Centres (n, 3) [m]."""
    return state.scene.population.particles.position.T


def projection(state: State, shape: np.ndarray, axis: int, rest: np.ndarray) -> float:
    """How much of a mode shape (n,) there is in the displacements along an axis from `rest` (n,), by mass."""
    particles = state.scene.population.particles
    weight = particles.mass * shape
    return float(weight @ (particles.position[axis] - rest) / (weight @ shape))


def axial_forces(state: State) -> np.ndarray:
    """Tension of all bonds [N], in the order of the deck."""
    scene = state.scene
    return bond_measures(scene.population.particles, scene.bonds, scene.kinds)[0][0, scene.bonding.place]


def energy_of(state: State) -> float:
    """Kinetic, elastic and gravitational energy of all particles [J]; contacts store none of it."""
    scene = state.scene
    particles = scene.population.particles
    kinetic = 0.5 * np.sum(particles.mass * particles.velocity**2)
    kinetic += 0.5 * np.sum(particles.angular_velocity * particles.angular_momentum)
    elastic = bond_measures(particles, scene.bonds, scene.kinds)[1] if scene.bonds is not None else 0.0
    return float(kinetic + elastic - scene.gravity @ (particles.position @ particles.mass))


def momenta_of(state: State) -> tuple[np.ndarray, np.ndarray]:
    """Momentum and angular momentum about the origin of all particles."""
    particles = state.scene.population.particles
    linear = particles.mass * particles.velocity
    angular = np.cross(particles.position.T, linear.T).sum(axis=0)
    return linear.sum(axis=1), angular + particles.angular_momentum.sum(axis=1)
