"""Pulleys and rolls of the sample conveyor, placed against its belt, and the steel frame around them; mm."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, sin

import numpy as np
from belt_shape import Conveyor, carrying_side, pulley_axes, return_slope, troughing

ACROSS = (0.0, 1.0, 0.0)
_STRINGER_OFFSET = 470.0  # from the middle; the wing rolls end at 420


@dataclass(frozen=True)
class Roll:
    """A drum: its name, diameter and length, the centre of its axis and the axis' direction."""

    name: str
    diameter: float
    length: float
    centre: tuple[float, float, float]
    axis: tuple[float, float, float] = ACROSS


@dataclass(frozen=True)
class Box:
    """A beam, plate or foot of the frame: its name, edge lengths and centre, edges along x, y and z."""

    name: str
    size: tuple[float, float, float]
    centre: tuple[float, float, float]


def rolls(conveyor: Conveyor) -> list[Roll]:
    """All pulleys and rolls, each one just touching the belt."""
    sets = sorted([*conveyor.full_sets, *conveyor.transition_sets])
    carrying = [roll for number, x in enumerate(sets, 1) for roll in _idler_set(conveyor, number, x)]
    returning = [_return_roll(conveyor, number, x) for number, x in enumerate(conveyor.return_rolls, 1)]
    return [*_pulleys(conveyor), *carrying, *returning]


def _pulleys(conveyor: Conveyor) -> list[Roll]:
    (tail_x, tail_z), (head_x, head_z) = pulley_axes(conveyor)
    return [
        Roll("tail pulley", conveyor.tail_diameter, conveyor.face_length, _rounded((tail_x, 0.0, tail_z))),
        Roll("head pulley", conveyor.head_diameter, conveyor.face_length, _rounded((head_x, 0.0, head_z))),
    ]


def _idler_set(conveyor: Conveyor, number: int, x: float) -> list[Roll]:
    """Centre roll and two wing rolls at station x, lowered until none of them cuts into the belt."""
    belt = _belt_near(conveyor, x)
    angle = float(troughing(conveyor, np.array(x))) * conveyor.trough_angle
    bottom = float(carrying_side(conveyor, np.array(x), np.array(0.0))[2])
    # Where the surfaces of centre roll and wing roll would meet; half the gap is left on either side.
    corner = conveyor.flat_half + conveyor.tangent_length(angle)
    inner = (conveyor.roll_gap + conveyor.roll_length) / 2
    below = conveyor.roll_diameter / 2 + conveyor.half
    found = []
    for place, side in (("centre", 0.0), ("left", 1.0), ("right", -1.0)):
        tilt = side * angle
        direction, normal = np.array([0.0, cos(tilt), sin(tilt)]), np.array([0.0, -sin(tilt), cos(tilt)])
        surface = np.array([x, side * corner, bottom]) + side * inner * direction
        roll = Roll(
            f"idler set {number} {place} roll",
            conveyor.roll_diameter,
            conveyor.roll_length,
            tuple(surface - below * normal),
            tuple(float(part) for part in direction),
        )
        found.append(_lowered(roll, conveyor, belt, normal))
    return found


def _return_roll(conveyor: Conveyor, number: int, x: float) -> Roll:
    slope = return_slope(conveyor)
    tail = np.array([pulley_axes(conveyor)[0][0], 0.0, pulley_axes(conveyor)[0][1]])
    downwards = np.array([-sin(slope), 0.0, -cos(slope)])
    along = np.array([cos(slope), 0.0, -sin(slope)])
    leaves = tail + (conveyor.tail_diameter / 2 + conveyor.half) * downwards
    on_belt = leaves + (x - leaves[0]) / along[0] * along
    centre = on_belt + (conveyor.half + conveyor.return_diameter / 2) * downwards
    return Roll(f"return roll {number}", conveyor.return_diameter, conveyor.face_length, _rounded(centre))


def _belt_near(conveyor: Conveyor, x: float) -> np.ndarray:
    """Points (n, 3) of the carrying side within a roll's radius of station x, 2 mm x 5 mm apart."""
    along = x + np.linspace(-0.5, 0.5, 67) * conveyor.roll_diameter
    across = np.linspace(-0.5, 0.5, 131) * conveyor.belt_width
    return carrying_side(conveyor, along[:, None], across).reshape(-1, 3)


def clearance(roll: Roll, points: np.ndarray) -> float:
    """Least distance between the roll's surface and those of `points` (n, 3) that lie between its ends."""
    offset = points - np.array(roll.centre)
    beside = offset @ np.array(roll.axis)
    offset = offset[np.abs(beside) <= roll.length / 2]
    radial = np.linalg.norm(offset - np.outer(offset @ np.array(roll.axis), roll.axis), axis=1)
    return float(radial.min()) - roll.diameter / 2


def _lowered(roll: Roll, conveyor: Conveyor, belt: np.ndarray, normal: np.ndarray) -> Roll:
    """The roll moved against `normal` until half a belt's thickness lies between it and the mid-surface."""
    for _ in range(20):  # the clearance grows nearly as the roll sinks, so a few turns reach the micrometre
        sink = conveyor.half - clearance(roll, belt)
        roll = replace(roll, centre=tuple(np.array(roll.centre) - sink * normal))
    return replace(roll, centre=_rounded(roll.centre))


def _rounded(point) -> tuple[float, float, float]:
    """A point in steps of a micrometre, as it would be drawn."""
    return tuple(round(float(value), 3) + 0.0 for value in point)


def frame(conveyor: Conveyor) -> list[Box]:
    """Stringers, feet, cross beams, hangers and bearing plates: everything that is not a roll."""
    length, half = conveyor.centre_distance, _STRINGER_OFFSET
    beam_level, under = conveyor.trough_level - 200.0, conveyor.trough_level - 240.0
    stations = sorted([*conveyor.full_sets, *conveyor.transition_sets])
    feet = (400.0, length / 2, length - 400.0)
    boxes = [
        Box(f"cross beam {number}", (60.0, 2 * half - 60.0, 60.0), (x, 0.0, beam_level))
        for number, x in enumerate(stations, 1)
    ]
    for name, y in (("left", half), ("right", -half)):
        boxes.append(Box(f"stringer {name}", (length + 300.0, 60.0, 120.0), (length / 2, y, under + 60.0)))
        boxes += [
            Box(f"foot {name} {number}", (80.0, 60.0, under), (x, y, under / 2))
            for number, x in enumerate(feet, 1)
        ]
        boxes += [
            Box(f"hanger {name} {number}", (40.0, 12.0, 160.0), (x, y, under - 80.0))
            for number, x in enumerate(conveyor.return_rolls, 1)
        ]
        for pulley, (x, z) in zip(("tail", "head"), pulley_axes(conveyor), strict=True):
            plate = np.copysign(conveyor.face_length / 2 + 20.0, y)
            boxes.append(Box(f"bearing plate {pulley} {name}", (360.0, 15.0, 420.0), _rounded((x, plate, z))))
    return boxes
