"""Strips that swing: wave speed, frequencies of extension, bending and torsion."""

from __future__ import annotations

import math

import numpy as np

from beltsim.engine import advance_by
from beltsim.verify.case import Case, Findings, Plot, Row, Series
from beltsim.verify.stepping import frequency_of, position_of, projection, put_load, sampled, start
from beltsim.verify.strips import Strip, strip_deck


def front() -> Findings:
    """Speed of a front of strain, timed where half of it has come through two places."""
    strip = Strip(bonds=200)
    state = start(strip_deck(strip), clamped=[0])
    put_load(state, strip.bonds, force=(50.0, 0.0, 0.0))
    final = 50.0 / math.sqrt(strip.axial * strip.line_mass)  # m/s behind the front
    particles, near, far = state.scene.population.particles, 150, 50
    times, speeds = [], []
    while state.time < 0.9 * strip.length / 204.124:
        advance_by(state, 1)
        times.append(state.time)
        speeds.append(particles.velocity[0, [near, far]].copy())
    times, speeds = np.array(times), np.array(speeds) / final
    passed = [
        np.interp(0.5, speeds[: np.argmax(speeds[:, k] > 0.75), k], times[: np.argmax(speeds[:, k] > 0.75)])
        for k in (0, 1)
    ]
    result = (near - far) * strip.pitch / (passed[1] - passed[0])
    target = math.sqrt(strip.young / strip.density)
    plot = Plot(
        "wave", "A front of strain passes two places", "time [ms]", "speed / speed behind the front",
        [Series(f"{p} m from the pulled end", 1e3 * times, speeds[:, k]) for k, p in ((0, 0.25), (1, 0.75))],
    )  # fmt: skip
    return Findings([Row("speed of the front", "m/s", target, result, 0.01)], [plot])


def axial_frequency() -> Findings:
    """First axial frequency, fixed and free, against that of the chain."""
    rows = []
    for bonds in (10, 20, 40):
        shape = np.sin(0.5 * np.pi * np.arange(bonds + 1) / bonds)
        deck = strip_deck(Strip(bonds=bonds), safety=0.2)
        state = start(deck, clamped=[0], velocity=np.outer(shape, [1e-3, 0.0, 0.0]))
        rest = position_of(state)[:, 0].copy()
        found = frequency_of(*sampled(state, 0.04, 200, lambda s, u=shape, x=rest: projection(s, u, 0, x)))
        chain = 204.1241452 * bonds / math.pi * math.sin(math.pi / (4 * bonds))
        rows.append(Row(f"frequency, {bonds} bonds", "Hz", chain, found, 1e-4))
    return Findings(rows)


def bending_shape(x: np.ndarray, beta: float, free: bool) -> tuple[np.ndarray, np.ndarray]:
    """Mode of an Euler-Bernoulli beam of length 1, fixed or free at 0 and free at 1, and its slope."""
    s = 1.0 if free else -1.0
    ratio = (np.cosh(beta) - s * np.cos(beta)) / (np.sinh(beta) - s * np.sin(beta))
    shape = np.cosh(beta * x) + s * np.cos(beta * x) - ratio * (np.sinh(beta * x) + s * np.sin(beta * x))
    slope = np.sinh(beta * x) - s * np.sin(beta * x) - ratio * (np.cosh(beta * x) + s * np.cos(beta * x))
    return shape, beta * slope


def bending_frequency(strip: Strip, shape, slope, expected: float, **held) -> float:
    """Frequency [Hz] of a strip that starts in a mode of bending."""
    spin = np.outer(slope / strip.length, [0.0, -1e-4, 0.0])
    velocity = np.outer(shape, [0.0, 0.0, 1e-4])
    for slots in held.values():
        velocity[slots] = spin[slots] = 0.0
    if "pinned" in held:
        spin[held["pinned"]] = np.outer(slope[held["pinned"]] / strip.length, [0.0, -1e-4, 0.0])
    state = start(strip_deck(strip), velocity=velocity, spin=spin, **held)
    return frequency_of(*sampled(state, 1.2 / expected, 120, lambda s: projection(s, shape, 2, 0.0 * shape)))


def chain_frequencies(strip: Strip, free: bool) -> np.ndarray:
    """Frequencies [Hz] of a chain of beam bonds with half end masses, from its matrices; rigid motions left out.

    Each bond is k_s g g' + k_b h h' with g = (-1, -p/2, 1, -p/2), h = (0, -1, 0, 1); particles have the rotary inertia
    m (p^2 + t^2) / 12.
    """
    from scipy.linalg import eigh

    p = strip.pitch
    shear = 1.0 / (p**3 / (12.0 * strip.bending) + p / (5.0 / 6.0 * strip.shear_modulus * strip.area))
    g, h = np.array([-1.0, -0.5 * p, 1.0, -0.5 * p]), np.array([0.0, -1.0, 0.0, 1.0])
    element = shear * np.outer(g, g) + strip.bending / p * np.outer(h, h)
    size = 2 * (strip.bonds + 1)
    stiffness = np.zeros((size, size))
    for b in range(strip.bonds):
        stiffness[2 * b : 2 * b + 4, 2 * b : 2 * b + 4] += element
    mass = np.full(strip.bonds + 1, strip.line_mass * p)
    mass[[0, -1]] *= 0.5
    masses = np.column_stack([mass, mass * (p * p + strip.thickness**2) / 12.0]).ravel()
    held = 0 if free else 2
    squares = eigh(stiffness[held:, held:], np.diag(masses[held:]), eigvals_only=True)
    return np.sqrt(squares[2 if free else 0 :]) / (2.0 * np.pi)


def frequency_rows(bonds: int, modes, free: bool) -> list[Row]:
    """Rows of some modes (number, beta L, frequency of the continuous beam) of a strip with a number of bonds."""
    strip, rows = Strip(bonds=bonds), []
    held = {} if free else {"clamped": [0]}
    exact = chain_frequencies(strip, free)
    for n, beta, target in modes:
        shapes = bending_shape(np.arange(bonds + 1) / bonds, beta, free)
        found = bending_frequency(strip, *shapes, target, **held)
        rows.append(Row(f"mode {n}, {bonds} bonds", "Hz", target, found, 0.01))
        rows.append(Row(f"mode {n}, matrices of the same chain", "Hz", exact[n - 1], found, 1e-3))
    return rows


def cantilever_frequencies() -> Findings:
    """First three frequencies of a cantilever with rotary inertia and shear (Huang)."""
    modes = (1, 1.8751041, 0.329716), (2, 4.6940911, 2.065311), (3, 7.8547574, 5.778486)
    return Findings([*frequency_rows(20, modes[:2], False), *frequency_rows(40, modes[2:], False)])


def bending_order() -> Findings:
    """The error of a frequency falls with the square of the pitch."""
    numbers, errors = np.array([5, 10, 20, 40]), []
    for bonds in numbers:
        shapes = bending_shape(np.arange(bonds + 1) / bonds, 4.6940911, False)
        found = bending_frequency(Strip(bonds=int(bonds)), *shapes, 2.065311, clamped=[0])
        errors.append(abs(found / 2.065311 - 1.0))
    order = -np.polyfit(np.log(numbers[:3]), np.log(errors[:3]), 1)[0]
    reference = errors[0] * (numbers[0] / numbers) ** 2
    plot = Plot(
        "frequency_order", "Second bending frequency of a cantilever", "log10 bonds", "log10 relative error",
        [
            Series("solver", np.log10(numbers), np.log10(errors), True),
            Series("order 2", np.log10(numbers), np.log10(reference)),
        ],
    )  # fmt: skip
    return Findings([Row("order in the pitch", "-", 2.0, order, 0.2, True)], [plot])


def free_frequencies() -> Findings:
    """First three frequencies of a free strip."""
    modes = (1, 4.7300407, 2.098233), (2, 7.8532046, 5.783859), (3, 10.9956079, 11.338677)
    return Findings([*frequency_rows(40, modes[:2], True), *frequency_rows(60, modes[2:], True)])


def pinned_frequency() -> Findings:
    """First frequency of a pinned strip."""
    x = np.arange(21) / 20
    found = bending_frequency(
        Strip(bonds=20), np.sin(np.pi * x), np.pi * np.cos(np.pi * x), 0.925601, pinned=[0, 20]
    )
    return Findings([Row("first frequency", "Hz", 0.925601, found, 0.01)])


def reduced_frequency() -> Findings:
    """Frequency with a reduction factor of 0.1."""
    strip = Strip(bonds=20, reduction=0.1)
    found = bending_frequency(
        strip, *bending_shape(np.arange(21) / 20, 1.8751041, False), 0.104274, clamped=[0]
    )
    return Findings([Row("first frequency, f = 0.1", "Hz", 0.104274, found, 2e-3)])


def torsional_frequency(strip: Strip, target: float) -> float:
    """First torsional frequency [Hz] of a strip fixed at one end."""
    shape = np.sin(0.5 * np.pi * np.arange(strip.bonds + 1) / strip.bonds)
    state = start(strip_deck(strip), clamped=[0], spin=np.outer(shape, [0.1, 0.0, 0.0]))
    inertia = state.scene.population.particles.inertia[0]

    def twist(s):
        q = s.scene.population.particles.orientation
        return float((inertia * shape) @ (2.0 * np.arctan2(q[1], q[0])))

    return frequency_of(*sampled(state, 1.2 / target, 120, twist))


def torsional_frequencies() -> Findings:
    """First torsional frequencies of a flat strip and of a round rope."""
    flat = torsional_frequency(Strip(bonds=20), 6.09651)
    rope = torsional_frequency(Strip(bonds=40, radius=0.005), 31.6481)
    return Findings(
        [
            Row("strip 100 x 10 mm", "Hz", 6.09651, flat, 0.01),
            Row("round, radius 5 mm", "Hz", 31.6481, rope, 1e-3),
        ]
    )


CASES = {
    "A2": Case("Wave speed", "√(E/ρ)", front),
    "A3": Case("Axial frequency", "chain of half end masses: (c N/πL) sin(π/4N)", axial_frequency),
    "B2": Case("Cantilever frequencies", "Timoshenko beam (Huang 1961)", cantilever_frequencies),
    "B2s": Case(
        "Cantilever frequency, number of bonds", "lumped masses: order 2", bending_order, quick=False
    ),
    "B3": Case("Frequencies of a free strip", "Euler-Bernoulli", free_frequencies),
    "B4f": Case("Frequency of a pinned strip", "(π/2L²) √(EI/ρA)", pinned_frequency),
    "B5f": Case("Frequency with reduced bending", "√f of the full one", reduced_frequency),
    "C1b": Case("Torsional frequencies", "√(GJ/ρI_p)/4L; round: √(G/ρ)/4L", torsional_frequencies),
}
