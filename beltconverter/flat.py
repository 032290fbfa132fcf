"""The stress-free belt: flat, with one length for the whole belt or for each row of cells."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .frames import before_and_after
from .piece import Grid

NEARLY_EQUAL = 1.05  # rows of cells whose lengths differ by less are one nominal length


class Flat(NamedTuple):
    """Stress-free distances of neighbouring particles, m.

    lengths : (S, C) along, from row i to the next (S = R for a ring, R - 1 for an open belt).
    widths, shifts : (R, C - 1) across and along, from column j to j + 1 (shifts are zero without skew).
    chords : (S, C) distances along in the mesh; stated for the whole belt: `mode` is "belt", "row" or "bond".
    """

    lengths: np.ndarray
    widths: np.ndarray
    shifts: np.ndarray
    chords: np.ndarray
    mode: str

    @property
    def strains(self) -> np.ndarray:
        """Initial strain (S, C) of the longitudinal bonds."""
        return self.chords / self.lengths - 1


def arcs(chords: np.ndarray, one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Arc lengths of chords between nodes whose tangents are `one` and `two`: l t/2 / sin(t/2), t the turn.

    A reference taken from chords would leave the cells that start on a pulley short for ever: by 0.26 % at
    100 mm cells on a radius of 400 mm, a tension ripple that travels with the belt.
    """
    half = np.arctan2(np.linalg.norm(np.cross(one, two), axis=-1), np.sum(one * two, axis=-1)) / 2
    return chords / np.sinc(half / np.pi)


def flattened(grid: Grid, axes: np.ndarray, mode: str, along: float, across: float) -> Flat:
    """Stress-free state of a grid meshed at `along` and `across` times its stress-free size.

    Lengths come from the middle fibre, one for all columns, so that the longer edge paths in trough transitions
    keep their true extra tension. `mode` "belt" takes one length for all rows, "row" one each, "bond" every
    bond's own (erases those tensions), "auto" takes "belt" if the rows are nearly equal, else "row". Widths are
    the median over all rows: a fold of a trough, which one cell spans with its chord, does not shrink the belt.
    """
    _, after = before_and_after(grid.points, grid.kind)
    _, axes_after = before_and_after(axes, grid.kind)
    rows = slice(None) if grid.is_ring else slice(-1)
    chords = np.linalg.norm(after - grid.points, axis=2)[rows]
    paths = arcs(chords, axes[rows, ..., 0], axes_after[rows, ..., 0])
    columns = grid.points.shape[1]
    fibre = paths[:, (columns - 1) // 2 : columns // 2 + 1].mean(axis=1)
    if mode == "auto":
        mode = "belt" if fibre.max() < NEARLY_EQUAL * fibre.min() else "row"
    lengths = {"belt": np.full_like(fibre, fibre.mean())[:, None], "row": fibre[:, None], "bond": paths}[
        mode
    ] / along
    widths, shifts = _across(grid, axes)
    if mode != "bond":
        widths, shifts = (
            np.broadcast_to(np.median(values, axis=0), values.shape) for values in (widths, shifts)
        )
    shifts = np.where(np.abs(shifts) < 1e-6 * widths, 0.0, shifts)
    return Flat(np.broadcast_to(lengths, chords.shape), widths / across, shifts / along, chords, mode)


def _across(grid: Grid, axes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance (R, C - 1) of neighbouring columns across the running direction, and their shift along it."""
    edge = np.diff(grid.points, axis=1)
    running = axes[:, 1:, :, 0] + axes[:, :-1, :, 0]
    running /= np.linalg.norm(running, axis=2, keepdims=True)
    shift = np.sum(edge * running, axis=2)
    chord = np.sqrt(np.maximum(np.sum(edge * edge, axis=2) - shift**2, 0.0))
    return arcs(chord, axes[:, :-1, :, 1], axes[:, 1:, :, 1]), shift


def tributary(distances: np.ndarray, *, ring: bool, half_ends: bool) -> np.ndarray:
    """Part (n, ...) of axis 0 that belongs to each node, from the distances to the next node.

    At the ends of a line a node has the full cell on its outer side too (the belt's edge lies half a cell beyond
    the node), or with `half_ends` nothing (the node lies on the belt's edge).
    """
    if ring:
        return (distances + np.roll(distances, 1, axis=0)) / 2
    outer = 0.0 if half_ends else 1.0
    padded = np.concatenate([outer * distances[:1], distances, outer * distances[-1:]])
    return (padded[1:] + padded[:-1]) / 2
