"""The fine lines where belt particles meet: they show how a belt bends and what it is made of."""

from __future__ import annotations

import numpy as np

from .scenery import Boxes, rotation_matrices
from .trace import Caster, Hits

DEPTH = 0.3  # share of light that a line takes away
HALF_WIDTH = 0.55  # pixels
FADE = (6.0, 16.0)  # pixels: boxes narrower than the first have no lines, wider than the second the full ones


def seams(caster: Caster, hits: Hits, pixel: np.ndarray) -> np.ndarray:
    """Share of light (n,) that hits keep; `pixel`: size (n,) in m of a pixel at the hit."""
    kept = np.ones(len(pixel))
    for k, item in enumerate(caster.items):
        rows = np.flatnonzero((hits.item == k) & ~hits.cut) if isinstance(item, Boxes) else []
        if len(rows):
            kept[rows] = _on_boxes(item, hits.solid[rows], hits.position[rows], pixel[rows])
    return kept


def _on_boxes(boxes: Boxes, solid: np.ndarray, position: np.ndarray, pixel: np.ndarray) -> np.ndarray:
    turn = rotation_matrices(boxes.orientation[solid])
    local = np.abs(np.einsum("nji,nj->ni", turn, position - boxes.position[solid]))
    core = boxes.size[solid] / 2 - boxes.edge_radius[solid, None]
    within = (core - local)[:, :2].min(axis=1)  # from the border of the flat faces, where neighbours meet
    line = (np.abs(within) < HALF_WIDTH * pixel) & (local[:, 2] > core[:, 2])
    width = 2 * core[:, :2].min(axis=1) / pixel
    return 1 - DEPTH * line * np.clip((width - FADE[0]) / (FADE[1] - FADE[0]), 0, 1)
