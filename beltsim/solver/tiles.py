"""Scratch space in which a pass puts the state of some touching pairs side by side, a column for each pair."""

from __future__ import annotations

from beltsim.solver.jit import inner

LANES = 8
"""Doubles of the widest vectors."""


@inner
def three(tile, row):
    """Three rows of the scratch space."""
    return tile[row], tile[row + 1], tile[row + 2]


@inner
def columns_for(count, book):
    """Columns over which a law runs for so many pairs: whole vectors, whose last columns nobody uses.

    Not with an energy book, which would note them.
    """
    if book is None:
        return (count + LANES - 1) // LANES * LANES
    return count
