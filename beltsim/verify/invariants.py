"""What must stay: energy, momenta; and what breaking may do to them."""

from __future__ import annotations

import math

import numpy as np

from beltsim.engine import advance_by
from beltsim.verify.case import Case, Findings, Plot, Row, Series
from beltsim.verify.stepping import energy_of, momenta_of, run_for, start
from beltsim.verify.strips import Strip, add_strip, case_deck, strip_deck


def bent(strip: Strip, amplitude: float) -> np.ndarray:
    """Velocities (n, 3) of a cantilever that swings to a tip amplitude [m] in about its first mode."""
    x = np.arange(strip.bonds + 1) / strip.bonds
    shape = 1.0 - np.cos(0.5 * np.pi * x)
    return np.outer(shape, [0.0, 0.0, amplitude * 2.0 * math.pi * 0.33])


def energy_history(steps: int, samples: int = 200) -> tuple[np.ndarray, np.ndarray]:
    """Relative energy error of a swinging strip over many steps at half the stability limit."""
    strip = Strip(bonds=20)
    state = start(strip_deck(strip, safety=0.5), clamped=[0], velocity=bent(strip, 0.2))
    first, errors = energy_of(state), []
    for _ in range(samples):
        advance_by(state, steps // samples)
        errors.append(energy_of(state) / first - 1.0)
    return steps // samples * np.arange(1, samples + 1), np.array(errors)


def energy(steps: int) -> Findings:
    """Energy of an undamped strip in large motion: bounded, and without a trend."""
    counts, errors = energy_history(steps)
    slope = np.polyfit(counts, errors, 1)[0]
    rows = [
        Row(f"largest energy error in {steps:.0e} steps", "-", 0.0, np.max(np.abs(errors)), 1e-3, True),
        Row("its trend over the run", "-", 0.0, slope * steps, 1e-5, True),
    ]
    plot = Plot(
        "energy",
        "Energy error of an undamped strip",
        "steps",
        "error / 1e-6",
        [Series("solver", counts, 1e6 * errors)],
    )
    return Findings(rows, [plot])


def largest_energy_error(safety: float, integrator: str) -> float:
    """Largest relative energy error of a strip with random velocities within 20 ms, looked at 100 times."""
    velocity = 0.1 * np.random.default_rng(4).normal(size=(11, 3))
    state = start(strip_deck(Strip(bonds=10), safety=safety, integrator=integrator), velocity=velocity)
    first, looks = energy_of(state), []
    for _ in range(100):
        run_for(state, 2e-4)
        looks.append(abs(energy_of(state) / first - 1.0))
    return max(looks)


def energy_order() -> Findings:
    """Energy error and step: second order for velocity Verlet, fourth for the reference integrator."""
    rows, series = [], []
    safeties = np.array([0.4, 0.2, 0.1])
    for integrator, order in (("VERLET", 2.0), ("PEFRL", 4.0)):
        errors = np.array([largest_energy_error(safety, integrator) for safety in safeties])
        found = np.polyfit(np.log(safeties), np.log(errors), 1)[0]
        rows.append(Row(f"order of the energy error, {integrator}", "-", order, found, 0.25, True))
        series.append(Series(integrator, np.log10(safeties), np.log10(errors), True))
        line = errors[0] * (safeties / safeties[0]) ** order
        series.append(Series(f"order {order:g}", np.log10(safeties), np.log10(line)))
    plot = Plot(
        "energy_order", "Energy error and step", "log10 of step / limit", "log10 of energy error", series
    )
    return Findings(rows, [plot])


def momentum() -> Findings:
    """Momentum and angular momentum of a free strip, with damping, over 10,000 steps."""
    random = np.random.default_rng(4)
    strip = Strip(bonds=20, damping=0.05)
    velocity, spin = 0.5 * random.normal(size=(21, 3)), 5.0 * random.normal(size=(21, 3))
    state = start(strip_deck(strip), velocity=velocity, spin=spin)
    linear, angular = momenta_of(state)
    particles = state.scene.population.particles
    scale = float(np.sum(particles.mass * np.linalg.norm(particles.velocity, axis=0)))
    advance_by(state, 10000)
    after = momenta_of(state)
    return Findings(
        [
            Row("change of momentum / Σ m v", "-", 0.0, np.abs(after[0] - linear).max() / scale, 1e-12, True),
            Row(
                "change of angular momentum / Σ m v L",
                "-",
                0.0,
                np.abs(after[1] - angular).max() / scale,
                1e-12,
                True,
            ),
        ]
    )


def pulled(stress: float, strength: float) -> bool:
    """Whether a bond of a tensile strength breaks under a stress [Pa]."""
    strip = Strip(bonds=1, length=0.05, tensile_strength=strength)
    deck = case_deck()
    add_strip(deck, strip, [[0.0, 0.0, 0.0], [0.05 * (1.0 + stress / strip.young), 0.0, 0.0]])
    state = start(deck, clamped=[0, 1])
    return not state.scene.bonds.intact[0]


def breakage() -> Findings:
    """The stress at which a bond breaks, and what a strip torn apart keeps."""
    strength, low, high = 1e6, 0.9e6, 1.1e6
    while high - low > 1e-7 * strength:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if pulled(middle, strength) else (middle, high)
    strip = Strip(bonds=20, tensile_strength=2e6)
    velocity = np.zeros((21, 3))
    velocity[:, 0] = np.linspace(-10.0, 10.0, 21)
    state = start(strip_deck(strip, safety=0.2), velocity=velocity)
    (linear, _), first = momenta_of(state), energy_of(state)
    energies = []
    for _ in range(400):
        advance_by(state, 1)
        energies.append(energy_of(state))
    bonds, record = state.scene.bonds, state.scene.strength
    unrecorded = np.count_nonzero((bonds.intact == 0) != (record.broken_step >= 0))
    return Findings(
        [
            Row("stress at breaking", "Pa", strength, high, 1e-6),
            Row("broken bonds without a record", "-", 0.0, float(unrecorded), 0.0, True),
            Row("energy gained, of the first", "-", 0.0, max(0.0, max(energies) / first - 1.0), 0.01, True),
            Row(
                "change of momentum", "kg m/s", 0.0, np.abs(momenta_of(state)[0] - linear).max(), 1e-12, True
            ),
        ]
    )


CASES = {
    "K1": Case(
        "Energy without damping, a million steps",
        "symplectic: bounded, no trend",
        lambda: energy(1_000_000),
        quick=False,
    ),
    "K1q": Case("Energy without damping", "as K1", lambda: energy(20_000)),
    "K1o": Case("Energy error and step", "velocity Verlet: order 2; PEFRL: order 4", energy_order),
    "K2": Case("Momenta", "pair loads balance to rounding", momentum),
    "X1": Case("Breakage", "N/A at the strength; nothing gained", breakage),
}
