"""Strips at rest: extension, own weight, deflection, reduced bending, torsion."""

from __future__ import annotations

import math

import numpy as np

from beltsim.verify.case import Case, Findings, Plot, Row, Series
from beltsim.verify.stepping import position_of, put_load, run_for, settle, start
from beltsim.verify.strips import Strip, strip_deck

BENDING = 0.329742  # Hz, first frequency of the reference cantilever
AXIAL = 51.031  # Hz, of its extension
GRAVITY = 9.81  # m/s2


def shear_compliance(strip: Strip) -> float:
    """L / (k G A) of a rectangular strip [m/N]."""
    return strip.length / (5.0 / 6.0 * strip.shear_modulus * strip.area)


def axial_extension() -> Findings:
    """Extension under a force of 500 N, for several numbers of bonds."""
    rows = []
    for bonds in (5, 20):
        state = start(strip_deck(Strip(bonds=bonds)), clamped=[0])
        put_load(state, bonds, force=(500.0, 0.0, 0.0))
        settle(state, AXIAL, 6)
        extension = position_of(state)[bonds, 0] - 1.0
        rows.append(Row(f"extension, {bonds} bonds", "m", 0.01, extension, 1e-9))
    return Findings(rows)


def own_weight_along() -> Findings:
    """Extension of a hanging strip under its own weight."""
    strip = Strip()
    state = start(strip_deck(strip, gravity=(GRAVITY, 0.0, 0.0)), clamped=[0])
    settle(state, AXIAL, 5)
    target = strip.density * GRAVITY / (2.0 * strip.young)
    return Findings([Row("extension", "m", target, position_of(state)[-1, 0] - 1.0, 1e-6)])


def tip_deflection(strip: Strip, load: float, frequency: float) -> float:
    """Deflection [m] of a cantilever under a tip load [N]."""
    state = start(strip_deck(strip), clamped=[0])
    put_load(state, strip.bonds, force=(0.0, 0.0, load))
    settle(state, frequency, 4)
    return float(position_of(state)[-1, 2])


def cantilever() -> Findings:
    """Tip deflection under a tip load, and under own weight."""
    strip = Strip(damping=0.3)
    target = 0.01 * (1.0 / (3.0 * strip.bending) + shear_compliance(strip))
    row = Row("tip deflection, P = 0.01 N", "m", target, tip_deflection(strip, 0.01, BENDING), 1e-4)
    state = start(strip_deck(strip, gravity=(0.0, 0.0, -0.0981)), clamped=[0])
    settle(state, BENDING, 4)
    target = strip.line_mass * 0.0981 / (8.0 * strip.bending)
    weight = Row("tip deflection, own weight at 0.0981 m/s2", "m", target, -position_of(state)[-1, 2], 0.01)
    return Findings([row, weight])


def simply_supported() -> Findings:
    """Midspan deflection of a pinned strip under a force in the middle and under own weight.

    Both ends are held along the strip too: loads are a twentieth of the usual ones, so that the stretch that comes
    with the sag, (w/t)^2, stays below 1e-4.
    """
    strip, share = Strip(damping=0.3), 0.05
    state = start(strip_deck(strip), pinned=[0, 20])
    load = 0.01 * share
    put_load(state, 10, force=(0.0, 0.0, -load))
    settle(state, 0.9256, 4)
    target = load * (1.0 / (48.0 * strip.bending) + 0.25 * shear_compliance(strip))
    middle = Row("P L^3 / 48 E I", "m", target, -position_of(state)[10, 2], 0.01)
    gravity = 0.0981 * share
    state = start(strip_deck(strip, gravity=(0.0, 0.0, -gravity)), pinned=[0, 20])
    settle(state, 0.9256, 4)
    target = 5.0 * strip.line_mass * gravity / (384.0 * strip.bending)
    return Findings([middle, Row("5 q L^4 / 384 E I", "m", target, -position_of(state)[10, 2], 0.01)])


def reduction() -> Findings:
    """A reduction factor of 0.1: ten times the deflection, the extension unchanged."""
    strip = Strip(reduction=0.1, damping=0.3)
    target = 0.001 * (10.0 / (3.0 * strip.bending) + shear_compliance(strip))
    found = tip_deflection(strip, 0.001, BENDING * math.sqrt(0.1))
    state = start(strip_deck(strip), clamped=[0])
    put_load(state, strip.bonds, force=(500.0, 0.0, 0.0))
    settle(state, AXIAL, 5)
    extension = position_of(state)[-1, 0] - 1.0
    return Findings(
        [
            Row("tip deflection, P = 0.001 N", "m", target, found, 1e-3),
            Row("extension, F = 500 N", "m", 0.01, extension, 1e-6),
        ]
    )


def saint_venant(strip: Strip) -> float:
    """Torsion constant [m4] that the solver uses for a rectangle, b >= t."""
    ratio = strip.thickness / strip.width
    return strip.width * strip.thickness**3 / 3.0 * (1.0 - 0.63 * ratio + 0.052 * ratio**5)


def torsion() -> Findings:
    """End rotation under a torque of 0.05 N m, against two formulas of the torsion constant."""
    # Global damping slows no rotation: the bonds' own is made near critical for the first mode.
    strip = Strip(bonds=10, damping=8.0)
    state = start(strip_deck(strip), clamped=[0])
    put_load(state, 10, torque=(0.05, 0.0, 0.0))
    run_for(state, 1.0)
    q = state.scene.population.particles.orientation[:, 10]
    found = 2.0 * math.atan2(q[1], q[0])
    return Findings(
        [
            Row(
                "end rotation, J as the solver's",
                "rad",
                0.05 / (strip.shear_modulus * saint_venant(strip)),
                found,
                1e-6,
            ),
            Row("end rotation, J of the series", "rad", 0.0832466, found, 1e-4),
        ]
    )


def mesh_convergence() -> Findings:
    """Tip deflection for more and more bonds: exact for beam bonds, 1/(4 N^2) off for spring bonds."""
    numbers = np.array([3, 5, 10, 20])
    plot_series, rows = [], []
    for shear in ("TIMOSHENKO", "SPRING"):
        errors = []
        for bonds in numbers:
            strip = Strip(bonds=int(bonds), shear=shear, damping=0.3)
            exact = 1e-4 * (1.0 / (3.0 * strip.bending) + shear_compliance(strip))
            errors.append(tip_deflection(strip, 1e-4, BENDING) / exact - 1.0)
        plot_series.append(Series(f"SHEAR={shear}", numbers.astype(float), 100.0 * np.array(errors), True))
        if shear == "SPRING":
            rows += [
                Row(f"relative error, {n} spring bonds", "-", -0.25 / n**2, e, 0.02)
                for n, e in zip(numbers, errors)
            ]
        else:
            rows.append(
                Row("largest relative error, beam bonds", "-", 0.0, max(map(abs, errors)), 1e-6, True)
            )
    fine = np.linspace(3, 20, 100)
    plot_series.append(Series("-1/(4 N²)", fine, -25.0 / fine**2))
    plot = Plot("cantilever", "Tip deflection of a cantilever", "bonds", "error [%]", plot_series)
    return Findings(rows, [plot])


CASES = {
    "A1": Case("Axial extension", "F L / E A", axial_extension),
    "A1b": Case("Hanging under own weight", "ρ g L² / 2 E", own_weight_along),
    "B1": Case("Cantilever", "P L³/3EI + P L/κGA; q L⁴/8EI", cantilever),
    "B1s": Case("Cantilever, number of bonds", "2-node Timoshenko element", mesh_convergence, quick=False),
    "B4": Case("Pinned beam, deflection", "P L³/48EI; 5 q L⁴/384EI", simply_supported, quick=False),
    "B5": Case("Bending reduction factor 0.1", "effective E I = f E I", reduction, quick=False),
    "C1": Case("Torsion", "T L / G J, Saint-Venant", torsion),
}
