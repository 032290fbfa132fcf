"""Colouring by a number: the values, their range, and the colour bar that explains them."""

from __future__ import annotations

import numpy as np

from .colours import colour_map
from .errors import ViewProblem
from .scenery import Legend


def legend_of(
    label: str, values: np.ndarray, limits: tuple[float, float] | None, *, signed: bool = False
) -> Legend:
    """A colour bar for values, over `limits` or their own range; `signed` ones are centred on zero."""
    known = values[np.isfinite(values)]
    if not known.size:
        raise ViewProblem(f"colour by {label}: found nothing that has one, expected at least one particle")
    low, high = limits or (float(known.min()), float(known.max()))
    if signed and not limits:
        low, high = -max(abs(low), abs(high)), max(abs(low), abs(high))
    return Legend(label, low, high, "coolwarm" if signed else "viridis")


def paint(colour: np.ndarray, values: np.ndarray, legend: Legend) -> np.ndarray:
    """The colours (n, 3), replaced by the legend's where there is a value (n,); NaN keeps the colour."""
    known = np.isfinite(values)
    painted = colour.copy()
    painted[known] = colour_map(legend.colour_map, values[known], legend.low, legend.high)
    return painted


def largest_of_bonds(count: int, bonds: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The value of largest magnitude among each particle's bonds (count,), NaN without a bond.

    bonds: (b, 2) particle numbers from 0, values: (b,).
    """
    result = np.full(count, np.nan)
    order = np.argsort(np.abs(values), kind="stable")  # the largest is written last
    for end in (0, 1):
        other = result.copy()
        other[bonds[order, end]] = values[order]
        larger = ~(np.abs(result) >= np.abs(other)) & np.isfinite(other)
        result[larger] = other[larger]
    return result
