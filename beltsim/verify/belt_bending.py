"""Large bending: buckling, elastica, roll-up."""

from __future__ import annotations

import math

import numpy as np

from beltsim.verify.case import Case, Findings, Plot, Row, Series
from beltsim.verify.stepping import growth, position_of, projection, put_load, ramp, sampled, settle, start
from beltsim.verify.strips import Strip, strip_deck

BENDING = 0.329742  # Hz

# Dead tip load P L^2 / E I: tip deflection w, tip abscissa x (both over L) and slope [rad]. Elliptic integrals,
# equal to Bisshopp and Drucker 1945 and Mattiasson 1981.
ELASTICA = {
    0.25: (0.082746, 0.995882, 0.124292),
    0.5: (0.162144, 0.984081, 0.244534),
    1.0: (0.301721, 0.943567, 0.461352),
    2.0: (0.493457, 0.839358, 0.781750),
    3.0: (0.603253, 0.745580, 0.986017),
    4.0: (0.669964, 0.671059, 1.121239),
    5.0: (0.713792, 0.612372, 1.215368),
    6.0: (0.744571, 0.565411, 1.283697),
    8.0: (0.784982, 0.495172, 1.374432),
    10.0: (0.810609, 0.445004, 1.430286),
}


def sway(share: float, strip: Strip, critical: float) -> float:
    """Growth [1/s2] of the first mode of a cantilever under a share of its critical load."""
    shape = 1.0 - np.cos(0.5 * np.pi * np.arange(strip.bonds + 1) / strip.bonds)
    state = start(strip_deck(strip), clamped=[0], velocity=np.outer(shape, [0.0, 0.0, 1e-6]))
    put_load(state, strip.bonds, force=(-share * critical, 0.0, 0.0))
    return growth(*sampled(state, 8.0, 80, lambda s: projection(s, shape, 2, 0.0 * shape)))


def bulge(share: float, strip: Strip, critical: float, held: str) -> float:
    """Growth [1/s2] of the first mode of a strip between ends that are `held` (pinned or clamped) nearer together."""
    x, last = np.arange(strip.bonds + 1) / strip.bonds, strip.bonds
    shape = np.sin(np.pi * x) if held == "pinned" else 1.0 - np.cos(2.0 * np.pi * x)
    deck = strip_deck(strip, stretch=1.0 - share * critical / strip.axial)
    state = start(deck, **{held: [0, last]}, velocity=np.outer(shape, [0.0, 0.0, 1e-6]))
    return growth(*sampled(state, 2.0, 80, lambda s: projection(s, shape, 2, 0.0 * shape)))


def no_growth(growth_at, critical: float) -> tuple[float, float, float]:
    """Growths at 0.98 and 1.02 of a load, and the load [N] between them at which a linear growth is zero."""
    below, above = growth_at(0.98), growth_at(1.02)
    return below, above, critical * (0.98 - below * 0.04 / (above - below))


def buckling() -> Findings:
    """A pushed cantilever returns below Euler's load and leaves above it; the load between held ends."""
    strip = Strip(bonds=20)
    critical = math.pi**2 * strip.bending / 4.0
    # The growth is linear in the load: its zero is the critical load.
    below, above, load = no_growth(lambda share: sway(share, strip, critical), critical)
    rows = [
        Row("0.98 of the load returns (1) or leaves (0)", "-", 1.0, float(below < 0.0), 0.0),
        Row("1.02 of the load returns (1) or leaves (0)", "-", 0.0, float(above < 0.0), 0.0, True),
        Row("load of no growth", "N", critical, load, 5e-3),
    ]
    strip = Strip(bonds=40)
    for held, times in (("pinned", 4.0), ("clamped", 16.0)):
        load = no_growth(
            lambda share, c=times * critical, h=held: bulge(share, strip, c, h), times * critical
        )[2]
        rows.append(Row(f"load of no growth, both ends {held}", "N", times * critical, load, 5e-3))
    return Findings(rows)


def elastica_tip(strip: Strip, alpha: float) -> tuple[float, float, float]:
    """Deflection, abscissa and slope of the tip under a dead load alpha E I / L^2."""
    state = start(strip_deck(strip), clamped=[0])
    state.stage.drag = 4.0 * math.pi * BENDING
    ramp(state, strip.bonds, (0.0, 0.0, -alpha * strip.bending), (0.0, 0.0, 0.0), duration=1.0)
    settle(state, BENDING, 4)
    q = state.scene.population.particles.orientation[:, -1]
    x, _, z = position_of(state)[-1]
    return -z, x, 2.0 * math.atan2(q[2], q[0])


def elastica(loads) -> Findings:
    """Tip of a cantilever under dead loads."""
    strip = Strip(bonds=40, damping=0.3)
    rows, tips = [], []
    for alpha in loads:
        tips.append(elastica_tip(strip, alpha))
        for label, unit, target, found in zip(
            ("w", "x/L", "slope"), ("-", "-", "rad"), ELASTICA[alpha], tips[-1]
        ):
            rows.append(Row(f"{label} at P L²/EI = {alpha:g}", unit, target, found, 2e-3, True))
    tips, exact = np.array(tips), np.array(list(ELASTICA.values()))
    every = np.array(list(ELASTICA))
    series = []
    for k, label in enumerate(("w", "x/L")):
        series += [
            Series(f"{label}, elliptic integrals", every, exact[:, k]),
            Series(f"{label}, solver", np.array(loads, float), tips[:, k], True),
        ]
    return Findings(
        rows, [Plot("elastica", "Tip of a cantilever under a dead load", "P L²/EI", "w, x/L", series)]
    )


def roll_up() -> Findings:
    """An end moment 2 pi E I / L closes a strip to a circle, exactly for any number of bonds."""
    rows, plots = [], []
    for bonds in (10, 20):
        strip = Strip(bonds=bonds, damping=0.3)
        state = start(strip_deck(strip), clamped=[0])
        state.stage.drag = 4.0 * math.pi * BENDING
        moment = 2.0 * math.pi * strip.bending
        shapes = []
        for share in (0.25, 0.5, 0.75, 1.0):
            ramp(state, bonds, (0, 0, 0), (0.0, -share * moment, 0.0), duration=0.01, stages=1)
            settle(state, BENDING, 4 if share == 1.0 else 1.5)
            state.stage.drag = 4.0 * math.pi * BENDING
            shapes.append(position_of(state).copy())
        rows.append(
            Row(f"distance of the ends, {bonds} bonds", "m", 0.0, np.linalg.norm(shapes[-1][-1]), 1e-6, True)
        )
        series = [
            Series(f"{share:g} of the moment", x[:, 0], x[:, 2])
            for share, x in zip((0.25, 0.5, 0.75, 1.0), shapes)
        ]
        plots = [Plot("roll_up", "Roll-up of a strip by an end moment", "x [m]", "z [m]", series)]
    return Findings(rows, plots)


CASES = {
    "D1": Case("Buckling", "Euler, π² EI / 4 L²; π² EI / L²; 4 π² EI / L²", buckling),
    "E1": Case(
        "Elastica",
        "elliptic integrals; Bisshopp & Drucker 1945, Mattiasson 1981",
        lambda: elastica(list(ELASTICA)),
        quick=False,
    ),
    "E1q": Case("Elastica, one load", "as E1", lambda: elastica([1.0])),
    "E2": Case("Roll-up", "2π/N for each bond", roll_up),
}
