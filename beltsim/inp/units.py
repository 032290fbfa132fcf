"""Units that a scalar parameter may carry; everything is SI once it is read."""

from __future__ import annotations

import math
from fractions import Fraction

# Fractions, so that `66.5 mm` gives exactly the float64 that `0.0665` gives.
_TURN = 2 * Fraction(math.pi)
_MILLI, _KILO, _MEGA, _GIGA = Fraction(1, 1000), Fraction(1000), Fraction(10**6), Fraction(10**9)
_ONE = Fraction(1)

# dimension -> unit -> factor to SI; the first unit of each is the SI one
UNITS: dict[str, dict[str, Fraction]] = {
    "length": {
        "m": _ONE,
        "mm": _MILLI,
        "cm": Fraction(1, 100),
        "in": Fraction("0.0254"),
        "ft": Fraction("0.3048"),
    },
    "mass": {"kg": _ONE},
    "time": {"s": _ONE, "min": Fraction(60)},
    "velocity": {"m/s": _ONE},
    "angular velocity": {"rad/s": _ONE, "rpm": _TURN / 60},
    "angle": {"rad": _ONE, "deg": _TURN / 360},
    "force": {"N": _ONE, "kN": _KILO},
    "pressure": {"Pa": _ONE, "MPa": _MEGA, "GPa": _GIGA},
    "stiffness": {"N/m": _ONE, "N/mm": _KILO},
    "mass rate": {"kg/s": _ONE, "t/h": Fraction(1000, 3600)},
    "density": {"kg/m3": _ONE},
    "inertia": {"kg m2": _ONE},
    "torque": {"N m": _ONE},
    "damping": {"N s/m": _ONE},
    "rate": {"1/s": _ONE},
}


def si_unit(dimension: str | None) -> str:
    """The SI unit of a dimension, empty for a pure number."""
    return next(iter(UNITS[dimension])) if dimension else ""


def to_si(number: str, factor: Fraction) -> float:
    """The float64 nearest to `number` (decimal text of a finite float64) times `factor`."""
    value = float(number)
    # Texts such as 1e-999999999 are zero; as fractions they would fill the memory.
    return value if value == 0.0 or factor == 1 else float(Fraction(number) * factor)
