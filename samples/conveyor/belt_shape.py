"""The belt of the sample conveyor: its dimensions and its mid-surface, at rest on rolls and pulleys.

Lengths in mm. x runs from the tail pulley's axis (x = 0) to the head pulley, z points up, y across.
A point of the belt has two material coordinates: `along`, the length of the middle fibre from the top of the
tail pulley in running direction, and `across`, the distance from the middle fibre, both measured in the belt.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, cos, pi, radians, sin, tan

import numpy as np


@dataclass(frozen=True)
class Conveyor:
    """Main dimensions, mm and radians; the defaults are a usual 650 mm belt on three-roll idler sets."""

    belt_width: float = 650.0
    thickness: float = 10.0
    rows: int = 260  # cells along the belt: a pitch of about 45 mm
    columns: int = 16  # cells across: 40.6 mm

    centre_distance: float = 5300.0  # tail pulley to head pulley
    head_diameter: float = 400.0
    tail_diameter: float = 320.0
    trough_level: float = 1000.0  # height of the mid-surface on the centre rolls
    trough_angle: float = radians(30.0)
    bend_length: float = 120.0  # length across the belt that bends between centre roll and wing roll
    pulley_lift: float = 0.4  # top of the pulleys above the trough's bottom, as a part of the trough's depth

    transition_start: float = 150.0  # a belt leaves the pulley flat and straight, then troughs ...
    transition_end: float = 1000.0  # ... evenly up to here; both kinks are rounded over:
    rounding: float = 300.0

    roll_diameter: float = 133.0
    roll_length: float = 250.0
    roll_gap: float = 8.0  # between the ends of neighbouring rolls, measured along the mid-surface
    full_sets: tuple[float, ...] = (1150.0, 2150.0, 3150.0, 4150.0)  # stations, x
    transition_sets: tuple[float, ...] = (575.0, 4725.0)
    return_rolls: tuple[float, ...] = (1800.0, 3500.0)
    return_diameter: float = 108.0
    face_length: float = 750.0  # of pulleys and return rolls

    @property
    def half(self) -> float:
        """Half the thickness: what lies between the mid-surface and the rolls."""
        return self.thickness / 2

    @property
    def flat_half(self) -> float:
        """Half width of the flat middle, up to the bends that lead to the wings."""
        # Centre and wing roll meet, half a gap short, where the tangents of the bend do.
        corner = (self.roll_length + self.roll_gap) / 2
        return corner - self.tangent_length(self.trough_angle)

    def tangent_length(self, angle: float) -> float:
        """From the end of the bend to the corner of its two tangents, for a bend of `angle`."""
        return self.bend_length / angle * tan(angle / 2)

    @property
    def trough_depth(self) -> float:
        """Height of the belt's edge above the trough's bottom."""
        return float(section(self, np.array(self.belt_width / 2), np.array(self.trough_angle))[1])

    @property
    def pulley_level(self) -> float:
        """Height of the mid-surface on top of both pulleys."""
        return self.trough_level + self.pulley_lift * self.trough_depth


def section(conveyor: Conveyor, across: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Trough's cross-section: y and z over the middle fibre of the points `across`, wings lifted by `angle`.

    A flat middle, two bends of constant curvature, straight wings; the length across the belt is kept.
    """
    distance = np.abs(across)
    bent = np.clip(distance - conveyor.flat_half, 0.0, conveyor.bend_length)
    wing = np.clip(distance - conveyor.flat_half - conveyor.bend_length, 0.0, None)
    turned = angle * bent / conveyor.bend_length
    # An arc's chord is arc sin(t/2)/(t/2) long and leaves it at t/2; sinc keeps this exact for a flat belt.
    chord = bent * np.sinc(turned / 2 / pi)
    y = np.minimum(distance, conveyor.flat_half) + chord * np.cos(turned / 2) + wing * np.cos(angle)
    z = chord * np.sin(turned / 2) + wing * np.sin(angle)
    return np.copysign(y, across), z


def troughing(conveyor: Conveyor, x: np.ndarray) -> np.ndarray:
    """How far the belt is troughed at x: 0 flat on the pulleys, 1 on the full idler sets."""
    start, end, width = conveyor.transition_start, conveyor.transition_end, conveyor.rounding

    def area(u):  # integral of the ramp from 0 to 1
        ramp = np.clip((u - start) / (end - start), 0.0, 1.0)
        return (end - start) * ramp**2 / 2 + np.clip(u - end, 0.0, None)

    def rounded(u):
        return (area(u + width / 2) - area(u - width / 2)) / width

    return rounded(np.minimum(x, conveyor.centre_distance - x))


def carrying_side(conveyor: Conveyor, x: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Mid-surface between the pulleys' tops: points (..., 3) for x and `across`, broadcast."""
    x, across = np.broadcast_arrays(x, across)
    part = troughing(conveyor, x)
    y, z = section(conveyor, across, part * conveyor.trough_angle)
    lift = (1 - part) * (conveyor.pulley_level - conveyor.trough_level)
    return np.stack([x, y, conveyor.trough_level + lift + z], axis=-1)


def pulley_axes(conveyor: Conveyor) -> tuple[np.ndarray, np.ndarray]:
    """Points (x, z) of the tail's and the head's axis: both pulleys carry the belt at the same level."""
    level = conveyor.pulley_level - conveyor.half
    tail = np.array([0.0, level - conveyor.tail_diameter / 2])
    head = np.array([conveyor.centre_distance, level - conveyor.head_diameter / 2])
    return tail, head


def return_slope(conveyor: Conveyor) -> float:
    """Angle by which the return side falls towards the (larger) head pulley.

    The carrying side's tangent is level, so the return side is its mirror image in the line of the two axes.
    """
    difference = (conveyor.head_diameter - conveyor.tail_diameter) / 2
    (_, _), (x, z) = (0.0, 0.0), pulley_axes(conveyor)[1] - pulley_axes(conveyor)[0]
    return 2 * asin(difference / float(np.hypot(x, z)))


def belt_nodes(conveyor: Conveyor) -> np.ndarray:
    """Grid of the endless belt's mid-surface: (rows, columns, 3), rows in running direction.

    Rows are evenly spaced along the middle fibre, columns across; the outermost columns lie half a cell inside
    the belt's edges, where the centres of the edge particles belong.
    """
    across = (
        np.arange(conveyor.columns) + 0.5
    ) / conveyor.columns * conveyor.belt_width - conveyor.belt_width / 2
    x = np.linspace(0.0, conveyor.centre_distance, 20_001)
    top = carrying_side(conveyor, x, 0.0)
    measured = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(top, axis=0), axis=1))])
    total = measured[-1] + _lower_length(conveyor)
    along = np.arange(conveyor.rows) * total / conveyor.rows
    on_top = along < measured[-1]
    carrying = carrying_side(conveyor, np.interp(along[on_top], measured, x)[:, None], across)
    middle = _lower_path(conveyor, along[~on_top] - measured[-1])
    grid = np.broadcast_to(middle[:, None, :], (len(middle), len(across), 2))
    flat = np.stack([grid[..., 0], np.broadcast_to(across, grid.shape[:2]), grid[..., 1]], axis=-1)
    return np.concatenate([carrying, flat])


def _lower_parts(conveyor: Conveyor) -> tuple[float, float, float]:
    """Lengths of the middle fibre on the head pulley, on the return side and on the tail pulley."""
    slope = return_slope(conveyor)
    tail, head = pulley_axes(conveyor)
    head_radius = conveyor.head_diameter / 2 + conveyor.half
    tail_radius = conveyor.tail_diameter / 2 + conveyor.half
    strand = float(np.hypot(*(head - tail))) * cos(slope / 2)
    return head_radius * (pi + slope), strand, tail_radius * (pi - slope)


def _lower_length(conveyor: Conveyor) -> float:
    return sum(_lower_parts(conveyor))


def _lower_path(conveyor: Conveyor, length: np.ndarray) -> np.ndarray:
    """Points (n, 2) x, z of the flat part of the belt, `length` counted from the top of the head pulley."""
    slope = return_slope(conveyor)
    tail, head = pulley_axes(conveyor)
    on_head, strand, _ = _lower_parts(conveyor)
    head_radius = conveyor.head_diameter / 2 + conveyor.half
    tail_radius = conveyor.tail_diameter / 2 + conveyor.half
    backwards = np.array([-cos(slope), sin(slope)])
    leaves = head + head_radius * np.array([-sin(slope), -cos(slope)])

    def arc(axis, radius, angle):  # angle turned since the top, clockwise
        return axis + radius * np.stack([np.sin(angle), np.cos(angle)], axis=-1)

    straight = leaves + (length - on_head)[:, None] * backwards
    turned = pi + slope + (length - on_head - strand) / tail_radius
    points = np.where((length < on_head)[:, None], arc(head, head_radius, length / head_radius), straight)
    return np.where((length > on_head + strand)[:, None], arc(tail, tail_radius, turned), points)
