"""Hanging belts: catenaries without bending stiffness, sag between supports with it."""

from __future__ import annotations

import math

import numpy as np

from beltsim.verify.case import Case, Findings, Plot, Row, Series
from beltsim.verify.stepping import axial_forces, position_of, settle, start
from beltsim.verify.strips import Strip, add_strip, case_deck, strip_deck

GRAVITY = 9.81


def elastic_catenary(weight: float, length: float, axial: float, span: float) -> tuple[float, float, float]:
    """Horizontal tension [N], sag [m] and largest tension [N] of a string between equal heights (Irvine 1981).

    `weight` [N/m] and `length` [m] are those of the unstretched string.
    """
    from scipy.optimize import brentq

    vertical = 0.5 * weight * length

    def surplus(h):
        return h * length / axial + 2.0 * h / weight * math.asinh(vertical / h) - span

    h = brentq(surplus, 1e-3 * vertical, 1e6 * vertical)
    top = math.hypot(h, vertical)
    return h, weight * length**2 / (8.0 * axial) + (top - h) / weight, top


def hung(strip: Strip, sag: float, frequency: float):
    """A strip over a span of 1 m with pinned ends at rest, from a parabola."""
    x = np.linspace(0.0, 1.0, strip.bonds + 1)
    deck = case_deck(gravity=(0.0, 0.0, -GRAVITY))
    add_strip(deck, strip, np.column_stack([x, 0.0 * x, -4.0 * sag * x * (1.0 - x)]))
    state = start(deck, pinned=[0, strip.bonds])
    return settle(state, frequency, 6)


def catenary() -> Findings:
    """A string with a sag of 0.1 m: nearly inextensible; the closed form of an inextensible one beside it."""
    arc = 1.026187
    strip = Strip(bonds=50, length=arc, reduction=0.0, young=500e6)
    state = hung(strip, 0.1, 1.7)
    h, sag, top = elastic_catenary(strip.line_mass * GRAVITY, arc, strip.axial, 1.0)
    place, force = position_of(state), axial_forces(state)
    found = -place[25, 2], force[24:26].mean(), force.max()
    rows = [
        Row("sag", "m", sag, found[0], 5e-3),
        Row("horizontal tension", "N", h, found[1], 5e-3),
        Row("largest tension", "N", top, found[2], 5e-3),
        Row("horizontal tension, inextensible", "N", 14.9072, found[1], 5e-3),
    ]
    x = np.linspace(0.0, 1.0, 200)
    q = strip.line_mass * GRAVITY
    curve = h / q * (np.cosh(q * (x - 0.5) / h) - math.cosh(0.5 * q / h))
    series = [Series("catenary", x, curve), Series("solver", place[:, 0], place[:, 2], True)]
    return Findings(rows, [Plot("catenary", "Catenary, 50 bonds", "x [m]", "z [m]", series)])


def elastic_strings() -> Findings:
    """The reference strip without bending stiffness over a span of its own length, and pre-strained by 0.2 %."""
    rows = []
    for label, length, h, sag, density in (
        ("L0 = 1 m", 1.0, 66.0141, 0.0222760, 1200.0),
        ("L0 = 1/1.002 m", 1.0 / 1.002, 119.961, 0.0122396, 1200.0),
    ):
        strip = Strip(bonds=50, length=length, reduction=0.0, density=density)
        state = hung(strip, sag, 4.0)
        rows.append(Row(f"sag, {label}", "m", sag, -position_of(state)[25, 2], 5e-3))
        rows.append(Row(f"horizontal tension, {label}", "N", h, axial_forces(state)[24:26].mean(), 5e-3))
    return Findings(rows)


def belt_sag() -> Findings:
    """A belt of 21.2 kg/m over a span of 1.2 m at 2 kN with pinned and with clamped ends.

    The sag stretches the belt a little, so targets are taken at the tension that it then has.
    """
    span, rows = 1.2, []
    for ends in ("pinned", "clamped"):
        stretch = 1.0 + 1968.0 / 50e3
        strip = Strip(bonds=120, length=span / stretch, density=21.2 / 1e-3 * stretch, damping=0.1)
        last = strip.bonds
        state = start(strip_deck(strip, gravity=(0.0, 0.0, -GRAVITY), stretch=stretch), **{ends: [0, last]})
        settle(state, 4.0, 6)
        tension = axial_forces(state)[last // 2]
        a = 0.5 * span * math.sqrt(tension / strip.bending)
        parabola = 21.2 * GRAVITY * span**2 / (8.0 * tension)
        if ends == "pinned":
            share = 1.0 - 2.0 * (1.0 - 1.0 / math.cosh(a)) / a**2
        else:
            share = 1.0 - 2.0 * math.tanh(0.5 * a) / a
        sag = -position_of(state)[last // 2, 2]
        rows.append(Row(f"sag, {ends}, at {tension:.0f} N", "m", share * parabola, sag, 0.01))
        rows.append(Row(f"tension, {ends}", "N", 2000.0, tension, 0.01))
    return Findings(rows)


CASES = {
    "F1": Case("Catenary", "H/q (cosh(q l/2H) − 1)", catenary, quick=False),
    "F2": Case("Elastic catenary", "Irvine 1981", elastic_strings),
    "F3": Case(
        "Belt sag with bending stiffness",
        "string × [1 − 2(1 − 1/cosh a)/a²]; clamped × [1 − 2 tanh(a/2)/a]",
        belt_sag,
    ),
}
