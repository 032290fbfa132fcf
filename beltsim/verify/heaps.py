"""Heaps: what their slope does and does not depend on. There is no closed form of it."""

from __future__ import annotations

import math

import numpy as np

from beltsim.verify.case import Case, Findings, Row
from beltsim.verify.spheres import RIGID, Stuff, add_floor, add_spheres, contact_deck
from beltsim.verify.stepping import position_of, run_for, start

G = 9.81
RADIUS = 0.005  # m
BLOCK = (16, 3, 10)  # grains along x, across the slot and in height
STONE = Stuff(2e7, 0.3, 2500.0)


def heap_angle(friction: float, rolling: float, gravity: float = G, seed: int = 1) -> float:
    """Slope [°] of the heap that a block of grains between two smooth walls falls to.

    Of a triangle's area the mean height is a third of its height and the mean distance a third of its half base, so
    their ratio is the tangent; it needs no fit to a ragged surface.
    """
    deck = contact_deck(
        friction=friction,
        rolling=rolling,
        restitution=0.3,
        gravity=(0.0, 0.0, -gravity),
        grain=STONE,
        floor=RIGID,
        glass=RIGID,
    )
    deck.add("CONTACT PROPERTY", material_a="grain", material_b="glass", friction=0.0, restitution=0.3)
    random = np.random.default_rng(seed)
    pitch = 2.05 * RADIUS
    steps = [np.arange(n) - 0.5 * (n - 1) for n in BLOCK[:2]] + [np.arange(BLOCK[2]) + 0.5]
    places = pitch * np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3)
    add_spheres(deck, "grain", "grain", RADIUS, places)
    add_floor(deck, "floor")
    half = 0.5 * BLOCK[1] * pitch
    for name, side in (("front", -1.0), ("back", 1.0)):
        turned = [math.sqrt(0.5), side * math.sqrt(0.5), 0.0, 0.0]  # local z to the slot's middle
        deck.add(
            "PART",
            name=name,
            shape="PLANE",
            material="glass",
            rows={"position": [[0.0, side * half, 0.0]], "orientation": [turned]},
        )
    time = math.sqrt(G / gravity)
    state = start(deck, velocity=0.1 / time * random.uniform(-1.0, 1.0, places.shape))
    run_for(state, 0.8 * time)
    x, _, z = position_of(state).T
    return math.degrees(math.atan2(np.mean(z - RADIUS), np.mean(np.abs(x - np.median(x)))))


def slopes() -> Findings:
    """Steeper with friction and with rolling resistance, and the same whatever gravity."""
    # Heaps of 480 grains scatter by half a degree: means of four.
    usual, heavy = (np.mean([heap_angle(0.6, 0.1, g, seed) for seed in range(4)]) for g in (G, 4.0 * G))
    smooth, rolling = heap_angle(0.15, 0.1), heap_angle(0.6, 0.0)
    return Findings(
        [
            Row("at four times the gravity", "°", usual, heavy, 1.0, True),
            Row(
                "steeper (1) than with a quarter of the friction", "-", 1.0, float(usual > smooth + 2.0), 0.0
            ),
            Row("steeper (1) than without rolling resistance", "-", 1.0, float(usual > rolling + 2.0), 0.0),
        ]
    )


CASES = {"S3": Case("Slope of a heap", "friction and rolling resistance, not gravity", slopes, quick=False)}
