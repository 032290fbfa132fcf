"""Quantities of the command line, the unit of a mesh file, and whether it looks right."""

from __future__ import annotations

import re
from fractions import Fraction

import click
import numpy as np

from beltsim.inp.units import UNITS, to_si

MESH_UNITS = UNITS["length"]
DIMENSIONS = {
    "length": MESH_UNITS,
    "velocity": UNITS["velocity"],
    "pressure": UNITS["pressure"],
    "density": UNITS["density"],
    "tensile stiffness": {"N/mm": Fraction(1000), "kN/m": Fraction(1000), "N/m": Fraction(1)},
    "bending stiffness": {
        "N m": Fraction(1),
        "Nm": Fraction(1),
        "N mm": Fraction(1, 1000),
        "Nmm": Fraction(1, 1000),
    },
    "mass per area": {"kg/m2": Fraction(1), "kg/m²": Fraction(1)},
    "ratio": {"": Fraction(1), "%": Fraction(1, 100)},
}
NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)")


class Quantity(click.ParamType):
    """A number with an optional unit, as `10mm` or `4000 N/mm`; without one the first unit of its dimension."""

    def __init__(self, dimension: str, *, zero: bool = False, negative: bool = False):
        self.dimension, self.zero, self.negative = dimension, zero, negative
        self.name = next(iter(DIMENSIONS[dimension])) or "number"

    def convert(self, value, param, ctx):
        """SI float of the text."""
        if not isinstance(value, str):
            return value
        try:
            return parsed(value, self.dimension, zero=self.zero, negative=self.negative)
        except ValueError as error:
            return self.fail(str(error), param, ctx)


def parsed(text: str, dimension: str, *, zero: bool = False, negative: bool = False) -> float:
    """SI value of `text`; ValueError says what is wrong with it."""
    match = NUMBER.fullmatch(text.strip())
    units = DIMENSIONS[dimension]
    if not match:
        raise ValueError(f"'{text}' is not a number with a unit such as 1.5{next(iter(units))}")
    number, unit = match.groups()
    factor = units.get(unit) if unit else next(iter(units.values()))
    if factor is None:
        raise ValueError(f"unit '{unit}' in '{text}', expected one of {', '.join(u for u in units if u)}")
    value = to_si(number, factor) if np.isfinite(float(number)) else float("inf")
    if not np.isfinite(value) or (value < 0 and not negative) or (value == 0 and not zero and not negative):
        raise ValueError(f"'{text}' is out of range: {'at least' if zero else 'above'} 0 and finite")
    return value


def scale_of_solid(unit: str, thickness: float, warnings: list[str]) -> tuple[str, float]:
    """The same for a solid belt, whose facets tell nothing but whose thickness does."""
    if unit == "auto":
        unit = "mm" if thickness > 0.5 else "m"
        warnings.append(
            f"the mesh has no unit: took {unit}, since the belt is {thickness:.4g} thick; --unit states it"
        )
    scale = float(MESH_UNITS[unit])
    if not 5e-4 <= thickness * scale <= 0.1:
        warnings.append(f"the belt is {thickness * scale:.4g} m thick in unit {unit}: is the unit right?")
    return unit, scale


def scale_of(unit: str, edge: float, warnings: list[str]) -> tuple[str, float]:
    """Unit and metres per file unit; "auto" infers it from the median edge of the mesh, in file units."""
    if unit == "auto":
        unit = "mm" if edge > 1 else "m"
        warnings.append(
            f"the mesh has no unit: took {unit}, since its median edge is {edge:.4g}; --unit states it"
        )
    scale = float(MESH_UNITS[unit])
    if not 1e-3 <= edge * scale <= 1.0:
        warnings.append(f"the median edge is {edge * scale:.4g} m in unit {unit}: is the unit right?")
    return unit, scale
