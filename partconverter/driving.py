"""How a belt turns its rollers: on which side it touches, which way it runs there, hence sense and speed.

Where the belt wraps a roller its inner side runs slower than its middle, which has the belt's speed V: with half
the thickness h a pulley turns at V / (R + h), an idler under a straight belt at V / R.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .belts import Belt
from .rollers import Roller

# What lies deeper in the belt than this share of its thickness cuts into it; meshes are off by less.
CUT_SHARE = 0.1
# A belt that turns by more than this angle [rad] on a roller lies on it; on an idler it bends by a few hundredths.
WRAP = 0.2
# Driven speeds are rounded to so many digits, so that rollers of one size turn alike.
SPEED_DIGITS = 5
# At most so many rollers are named in one warning.
MOST_NAMES = 6


class Touch(NamedTuple):
    """Where a belt touches a roller.

    gap : least distance between the surfaces [m], negative = cut in; speed : angular velocity about the axis
    [rad/s]; carrying : whether the roller lies on the carrying side; station : place on the belt
    """

    gap: float
    speed: float
    carrying: bool
    station: float


def driven(
    rollers: list[Roller], belt: Belt, *, touch_gap: float | None = None
) -> tuple[list[Roller], list[str]]:
    """Rollers with the spin that the belt gives them, and warnings.

    A roller is touched if the surfaces are less than `touch_gap` [m] apart (default half the belt's thickness).
    """
    from scipy.spatial import cKDTree

    tree = cKDTree(belt.position)
    thickness = 2 * float(np.median(belt.half_thickness))
    limit = thickness / 2 if touch_gap is None else touch_gap
    found, apart, cutting = [], [], []
    for roller in rollers:
        touch = touch_of(roller, belt, tree, limit)
        if touch is None or touch.gap > limit:
            apart.append((roller, touch))
            found.append(roller)
            continue
        if touch.gap < -CUT_SHARE * thickness:
            cutting.append((roller, touch))
        spin = float(f"{touch.speed:.{SPEED_DIGITS}g}") + 0.0
        station = None if np.isnan(touch.station) else touch.station
        found.append(replace(roller, speed=spin, station=station))
    return found, [*_warn_apart(apart), *_warn_cutting(cutting)]


def touch_of(roller: Roller, belt: Belt, tree, limit: float) -> Touch | None:
    """How the belt lies on a roller, None if no part of the belt passes it within reach."""
    radius, axis = roller.diameter / 2, np.array(roller.axis)
    reach = radius + limit + belt.half_thickness.max() + belt.pitch.max() + belt.half_width.max()
    rows = np.array(tree.query_ball_point(roller.centre, np.hypot(roller.length / 2, reach)), int)
    if not len(rows):
        return None
    offset = belt.position[np.sort(rows)] - roller.centre
    rows, height = np.sort(rows), offset @ axis
    normal, normal_length = _across(belt.normal[rows], axis)
    along, along_length = _across(belt.along[rows], axis)
    distance = np.einsum("ij,ij->i", offset, normal)
    beside = np.abs(np.einsum("ij,ij->i", offset, along))
    # A particle counts where it passes over the axis: flat on it, half a pitch before or behind, and within the
    # drum, or with its edge if the drum is so narrow that it lies between two centres.
    passing = (beside <= 0.51 * belt.pitch[rows]) & (normal_length > 0.5) & (along_length > 0.5)
    over = passing & (np.abs(height) <= roller.length / 2)
    if not over.any():
        over = passing & (np.abs(height) <= roller.length / 2 + belt.half_width[rows])
    if not over.any():
        return None
    gap = np.abs(distance) - radius - belt.half_thickness[rows]
    least = gap[over].min()
    # The lowest particles decide; those farther off belong to another strand or a hanging edge.
    on = over & (gap <= least + max(limit, 0.0))
    return _touch(roller, belt, rows[on], distance[on], normal[on], along[on], float(least))


def _touch(roller, belt, rows, distance, normal, along, gap) -> Touch:
    radius, axis = roller.diameter / 2, np.array(roller.axis)
    side = np.sign(distance)
    outward = side[:, None] * normal
    half = float(np.median(belt.half_thickness[rows]))
    lever = radius + half if _turn(axis, outward) > WRAP else radius
    # w (axis x outward) R = v along the belt's inner surface.
    sense = np.einsum("ij,ij->i", np.cross(axis, outward), along)
    speed = float((sense * belt.speed[rows]).mean()) / lever
    return Touch(gap, speed, bool(side.sum() < 0), _middle(belt.station[rows], belt.station))


def _across(vectors: np.ndarray, axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vectors without their part along an axis, at length 1, and that part's complement."""
    flat = vectors - np.outer(vectors @ axis, axis)
    length = np.linalg.norm(flat, axis=1)
    return flat / np.maximum(length, 1e-300)[:, None], length


def _turn(axis, outward) -> float:
    """Angle by which the belt's normals turn round the axis [rad]."""
    middle = _across(outward.mean(axis=0)[None], axis)[0][0]
    angle = np.arctan2(np.cross(middle, outward) @ axis, outward @ middle)
    return float(np.ptp(angle))


def _middle(stations: np.ndarray, all_stations: np.ndarray) -> float:
    """Middle station of a contact, that of the belt's first row if the contact runs over its seam."""
    known = np.sort(stations[~np.isnan(stations)])
    if not len(known):
        return float("nan")
    length = np.nanmax(all_stations) - np.nanmin(all_stations)
    return float(known[0]) if known[-1] - known[0] > length / 2 else float(np.median(known))


def _warn_apart(apart) -> list[str]:
    if not apart:
        return []
    names = [
        f"{_called(roller)} ({'out of reach' if touch is None else f'{1000 * touch.gap:.3g} mm apart'})"
        for roller, touch in apart[:MOST_NAMES]
    ]
    return [
        f"no belt touches {len(apart)} of the cylinders, they are not driven: {_listed(names, len(apart))}"
    ]


def _warn_cutting(cutting) -> list[str]:
    if not cutting:
        return []
    names = [f"{_called(roller)} ({-1000 * touch.gap:.3g} mm)" for roller, touch in cutting[:MOST_NAMES]]
    return [f"{len(cutting)} of the cylinders cut into the belt: {_listed(names, len(cutting))}"]


def _called(roller: Roller) -> str:
    x, y, z = (1000 * v for v in roller.centre)
    return roller.name or roller.cad_name or f"the one at ({x:.4g}, {y:.4g}, {z:.4g}) mm"


def _listed(names: list[str], count: int) -> str:
    more = f" and {count - len(names)} more" if count > len(names) else ""
    return ", ".join(names) + more
