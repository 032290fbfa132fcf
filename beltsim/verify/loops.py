"""Belts around cylinders: the path of a belt over one pulley and around two, and their decks."""

from __future__ import annotations

import math

import numpy as np

from beltsim.inp import Deck
from beltsim.verify.strips import Strip, add_strip, case_deck

ACROSS = (math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0)  # local z to world y


def turned(beta: np.ndarray) -> np.ndarray:
    """Orientations (n, 4) whose local x is (cos b, 0, -sin b) and local z (sin b, 0, cos b): turned by b about y."""
    zero = np.zeros_like(beta)
    return np.column_stack([np.cos(0.5 * beta), zero, np.sin(0.5 * beta), zero])


def over_one(s: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Places and orientations along a belt that goes up, over half a circle and down; s = 0 is its top."""
    quarter = 0.5 * math.pi * radius
    beta = np.clip(s / radius, -0.5 * math.pi, 0.5 * math.pi)
    down = np.maximum(np.abs(s) - quarter, 0.0)
    return np.column_stack([radius * np.sin(beta), 0.0 * s, radius * np.cos(beta) - down]), turned(beta)


def around_two(s: np.ndarray, radius: float, distance: float) -> tuple[np.ndarray, np.ndarray]:
    """Places and orientations along a loop around two equal circles; s = 0 is the middle of its upper span."""
    half, arc = 0.5 * distance, math.pi * radius
    place, beta = np.zeros((s.size, 3)), np.zeros(s.size)
    for k, length in enumerate(np.mod(s, 2.0 * (arc + distance))):
        if length < half:
            place[k] = length, 0.0, radius
        elif length < half + arc:
            beta[k] = (length - half) / radius
            place[k] = half + radius * math.sin(beta[k]), 0.0, radius * math.cos(beta[k])
        elif length < half + arc + distance:
            beta[k] = math.pi
            place[k] = half - (length - half - arc), 0.0, -radius
        elif length < half + 2.0 * arc + distance:
            beta[k] = math.pi + (length - half - arc - distance) / radius
            place[k] = -half + radius * math.sin(beta[k]), 0.0, radius * math.cos(beta[k])
        else:
            beta[k] = 2.0 * math.pi
            place[k] = length - 2.0 * (arc + distance), 0.0, radius
    return place, turned(beta)


def add_pulley(deck: Deck, name: str, x: float, radius: float) -> None:
    """A steel cylinder with its axis along y."""
    rows = {"position": [[x, 0.0, 0.0]], "orientation": [ACROSS]}
    deck.add(
        "PART", name=name, shape="CYLINDER", diameter=2.0 * radius, length=0.3, material="steel", rows=rows
    )


def pulley_case(friction: float, safety: float = 0.8) -> Deck:
    """A deck with the steel of pulleys and its contact with belts."""
    deck = case_deck(safety=safety)
    deck.add("MATERIAL", name="steel", density=7800.0, youngs_modulus=2e11, poisson_ratio=0.3)
    deck.add("CONTACT PROPERTY", material_a="*", material_b="*", friction=friction, restitution=0.5)
    return deck


def add_loop(
    deck: Deck, strip: Strip, radius: float, distance: float, strain: float
) -> tuple[np.ndarray, np.ndarray]:
    """Add a closed belt around two pulleys of `radius` with a uniform elastic strain; returns places and directions.

    The strip's `bonds` are those of the loop; its pitch is made to fit.
    """
    path = radius + 0.5 * strip.thickness
    s = (np.arange(strip.bonds) + 0.5) / strip.bonds * 2.0 * (math.pi * path + distance)
    place, orientation = around_two(s, path, distance)
    chords = np.linalg.norm(np.roll(place, -1, axis=0) - place, axis=1)
    add_strip(deck, strip, place, orientation=orientation, closed=True, rest=chords.mean() / (1.0 + strain))
    beta = 2.0 * np.arctan2(orientation[:, 2], orientation[:, 0])
    return place, np.column_stack([np.cos(beta), 0.0 * beta, -np.sin(beta)])
