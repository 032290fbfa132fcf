"""Belts under tension without much bending stiffness: strings at rest and a string that runs through guides."""

from __future__ import annotations

import math

import numpy as np

from beltsim.verify.case import Case, Findings, Plot, Row, Series
from beltsim.verify.loops import ACROSS
from beltsim.verify.stepping import frequency_of, position_of, projection, run_for, sampled, start
from beltsim.verify.strips import Strip, add_strip, case_deck, line, strip_deck


def string(reduction: float, stretch: float, bonds: int = 50) -> Strip:
    """A strip that weighs 1.2 kg/m and is 1 m long when stretched by a factor."""
    return Strip(bonds=bonds, length=1.0 / stretch, reduction=reduction, density=1200.0 * stretch)


def string_frequency(strip: Strip, stretch: float, target: float) -> float:
    """First lateral frequency [Hz] of a stretched strip with pinned ends."""
    last = strip.bonds
    shape = np.sin(np.pi * np.arange(last + 1) / last)
    velocity = np.outer(shape, [0.0, 0.0, 1e-3])
    velocity[[0, last]] = 0.0
    state = start(strip_deck(strip, stretch=stretch), pinned=[0, last], velocity=velocity)
    return frequency_of(*sampled(state, 1.5 / target, 150, lambda s: projection(s, shape, 2, 0.0 * shape)))


def tensioned() -> Findings:
    """Strings at 200 N without and with bending stiffness, and at 15 % elongation."""
    rows = []
    for label, reduction, stretch, target in (
        ("T = 200 N, no bending stiffness", 0.0, 1.004, 6.45497),
        ("T = 200 N, E I = 0.4167 N m2", 1.0, 1.004, 6.52100),
        ("15 % elongation, no bending stiffness", 0.0, 1.15, 0.5 * math.sqrt(7500.0 / 1.2)),
    ):
        found = string_frequency(string(reduction, stretch), stretch, target)
        rows.append(Row(label, "Hz", target, found, 5e-3))
    return Findings(rows)


def moving_string() -> Findings:
    """A string that runs at 3 m/s through two frictionless guides 1 m apart: Skutch's frequency."""
    speed, tension, pitch = 3.0, 200.0, 0.02
    stretch = 1.0 + tension / 50e3
    strip = Strip(bonds=1, length=pitch / stretch, density=1200.0 * stretch, reduction=0.001, young=50e6)
    count = round(4.2 / pitch) + 1
    x = line(count, pitch) - [2.6, 0.0, 0.0]
    deck = case_deck()
    add_strip(deck, strip, x)
    add_guides(deck, (0.0, 1.0), strip.thickness)
    kick = np.where((x[:, 0] > 0.0) & (x[:, 0] < 1.0), np.sin(np.pi * x[:, 0]), 0.0)
    velocity = np.column_stack([np.full(count, speed), np.zeros(count), 0.02 * kick])
    state = start(deck, pinned=[0, count - 1], velocity=velocity)

    def middle(s):
        place = position_of(s)
        return float(np.interp(0.5, place[:, 0], place[:, 2]))

    interval, values = sampled(state, 0.5, 500, middle)
    times = interval * np.arange(values.size)
    c = math.sqrt(tension / 1.2)
    target = (c * c - speed * speed) / (2.0 * c)
    found = period_fit(times, values, target)
    fine = np.linspace(0.0, times[-1], 400)
    plot = Plot(
        "moving_string", "Middle of a string that runs through two guides", "time [s]", "z [mm]",
        [
            Series("solver", times, 1e3 * values),
            Series("sine of Skutch's frequency", fine, 1e3 * np.abs(values).max() * np.sin(2 * np.pi * target * fine)),
        ],
    )  # fmt: skip
    rows = [Row("first frequency at 3 m/s", "Hz", target, found, 0.02)]
    for label, way in (("with the motion", 1.0), ("against it", -1.0)):
        rows.append(Row(f"speed of a wave {label}", "m/s", c + way * speed, wave_speed(speed, way), 0.01))
    return Findings(rows, [plot])


def wave_speed(speed: float, way: float) -> float:
    """Speed [m/s] of the half of a bump that runs with (1) or against (-1) the motion of a string of 200 N."""
    strip = string(0.0, 1.004, bonds=100)
    last = strip.bonds
    x = np.linspace(-0.5, 0.5, last + 1)
    velocity = np.column_stack([0 * x + speed, 0 * x, 1e-2 * np.exp(-((x / 0.05) ** 2))])
    state = start(strip_deck(strip, stretch=1.004), pinned=[0, last], velocity=velocity)
    origin, places = 0.5, []
    for _ in range(2):
        run_for(state, 0.01)
        place, lift = position_of(state)[:, 0] - origin, state.scene.population.particles.velocity[2]
        ahead = way * (place - speed * state.time) > 0.0
        places.append((state.time, np.sum((place * lift)[ahead]) / np.sum(lift[ahead])))
    (t1, x1), (t2, x2) = places
    return way * (x2 - x1) / (t2 - t1)


def add_guides(deck, places, thickness: float) -> None:
    """Pairs of frictionless bars that hold a strip from above and from below."""
    deck.add("MATERIAL", name="steel", density=7800.0, youngs_modulus=2e11, poisson_ratio=0.3)
    deck.add("CONTACT PROPERTY", material_a="*", material_b="*", friction=0.0, restitution=0.5)
    for n, x in enumerate(places):
        for side, z in (("above", 1.0), ("below", -1.0)):
            rows = {"position": [[x, 0.0, z * (0.01 + 0.5 * thickness)]], "orientation": [ACROSS]}
            deck.add(
                "PART",
                name=f"guide_{n}_{side}",
                shape="CYLINDER",
                diameter=0.02,
                length=0.2,
                material="steel",
                rows=rows,
            )


def period_fit(times: np.ndarray, values: np.ndarray, guess: float) -> float:
    """Frequency [Hz] whose first five harmonics fit a periodic signal best."""
    from scipy.optimize import minimize_scalar

    def misfit(frequency):
        phases = 2.0 * np.pi * frequency * np.outer(times, np.arange(1, 6))
        basis = np.hstack([np.ones((times.size, 1)), np.sin(phases), np.cos(phases)])
        return float(np.linalg.lstsq(basis, values, rcond=None)[1].sum())

    return float(minimize_scalar(misfit, bounds=(0.85 * guess, 1.15 * guess), method="bounded").x)


CASES = {
    "G1": Case("String", "√(T/ρA)/2l · √(1 + π²EI/Tl²)", tensioned),
    "G2": Case("Moving string", "(c² − v²)/2cl, Skutch 1897; c ± v", moving_string),
}
