"""The skin of the lists of near pairs, which tunes itself as a run goes on.

A wide skin lists many pairs that every step tests, a narrow one has lists made anew often. With a typical radius r and
a skin s, pairs within the reach 2 r + s grow with its cube, and the steps that lists serve with s. So a step costs
    tests (2 r + s')^3 / (2 r + s)^3 + build / (steps s' / s)
and near s the least is at s' = sqrt(build s (2 r + s) / (3 tests steps)). Nothing is timed: costs are those of one
machine, measured once, so that a run is the same run everywhere.
"""

from __future__ import annotations

import math

import numpy as np

from beltsim.lists import Lists

BUILD = 400.0  # ns a particle
TEST = {  # ns a step for one more pair in the list, which does not touch
    "spheres": 2.5,
    "boxes": 4.0,
    "sphere_parts": 4.0,
    "box_parts": 10.0,
    "walls": 30.0,
    "points": 30.0,
    "box_boxes": 30.0,
    "rods": 800.0,
}
FIRST = 0.25  # of the typical radius
NARROWEST, WIDEST = 0.5, 4.0  # of the first skin
PACE = 1.25  # the most by which a skin changes at a time


def first_skin(bounding: np.ndarray) -> float:
    """Skin [m] to begin with, a quarter of the median bounding radius."""
    return FIRST * float(np.median(bounding)) if bounding.size else 1.0


def tuned(skin: float, first: float, lists: Lists, particles: int, steps: int) -> float:
    """A better skin [m] after lists of `skin` that served for some steps until particles had moved too far.

    `first` is the skin at the beginning of the run, from which it does not go too far.
    """
    tests = sum(
        TEST[name] * family[0].first.size for name, family in zip(Lists._fields, lists) if family is not None
    )
    if tests == 0.0:
        return min(skin * PACE, WIDEST * first)
    reach = 2.0 * first / FIRST + skin
    best = math.sqrt(BUILD * particles * skin * reach / (3.0 * tests * max(steps, 1)))
    slowly = min(max(best, skin / PACE), skin * PACE)
    return min(max(slowly, NARROWEST * first), WIDEST * first)
