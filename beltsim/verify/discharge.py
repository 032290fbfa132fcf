"""Grains thrown off a head pulley: where they leave it, and their parabola."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import numpy as np

from beltsim.engine import State, advance_by
from beltsim.inp import Deck
from beltsim.verify.case import Case, Findings, Plot, Row, Series
from beltsim.verify.loops import add_loop, add_pulley
from beltsim.verify.spheres import RIGID, Stuff, add_mesh, add_spheres, contact_deck
from beltsim.verify.stepping import position_of, start, steps_in
from beltsim.verify.strips import Strip

G = 9.81
GRAIN, FRICTION = 0.005, 0.8  # m, radius; of grains on the belt
PULLEY, THICKNESS = 0.2, 0.01  # m
DROP = 0.5  # m below the top of its path, where a grain's place is compared
AXIS = 0.25  # m, place of the head pulley of the bonded belt
SLOW, FAST = 1.1, 2.0  # m/s, the two sides of sqrt(g R)
STONE = Stuff(5e7, 0.3, 2500.0)


def ride(speed: float, carried: float, radius: float, friction: float) -> tuple[float, float]:
    """Angle from the top [rad] and speed [m/s] at which a grain that cannot roll leaves a pulley.

    It comes to the tangent point at `speed`; on the bend friction carries it along at the speed `carried` until it
    slides ahead. It leaves where v^2 = g r cos(angle): at once if it is faster than that (Booth 1934).
    """
    angle, step = 0.0, 1e-5
    while speed**2 < G * radius * math.cos(angle):
        pressure = G * math.cos(angle) - speed**2 / radius
        needed = -G * math.sin(angle) + (carried - speed) * speed / (step * radius)
        push = min(max(needed, -friction * pressure), friction * pressure)
        speed += (G * math.sin(angle) + push) * step * radius / speed
        angle += step
    return angle, speed


def fall(angle: float, speed: float, radius: float, depth: np.ndarray) -> np.ndarray:
    """Distance [m] ahead of the pulley's axis at depths below the top of a grain's path, after it has left."""
    down = speed * math.sin(angle)
    time = (np.sqrt(down**2 + 2.0 * G * (depth - radius * (1.0 - math.cos(angle)))) - down) / G
    return radius * math.sin(angle) + speed * math.cos(angle) * time


def rigid_belt(speed: float, friction: float, folder: Path) -> State:
    """A flat belt whose surface moves, then its head pulley at x = 0: one grain on it, 0.1 m before the axis."""
    deck = bulk_deck(friction)
    flat = [[-0.5, -0.1, PULLEY], [0.0, -0.1, PULLEY], [0.0, 0.1, PULLEY], [-0.5, 0.1, PULLEY]]
    add_mesh(deck, folder / "belt.obj", flat, [[0, 1, 2], [0, 2, 3]], "belt", "steel")
    deck.add("MOTION", part="belt", type="SURFACE VELOCITY", rows={"vector": [[speed, 0.0, 0.0]]})
    add_pulley(deck, "head", 0.0, PULLEY)
    deck.add("MOTION", part="head", type="ROTATION", angular_velocity=speed / PULLEY)
    add_grains(deck, [[-0.1, 0.0, PULLEY + GRAIN]])
    return start(deck, velocity=[[speed, 0.0, 0.0]])


def bonded_belt(speed: float) -> State:
    """A loop of a bonded belt at 3 kN around two pulleys; the axis of the head pulley is at x = 0.25 m.

    Six grains lie before it on different places of the belt's particles. The span is short and tight: the belt,
    straight at the start, then falls into its sag of 0.1 mm without throwing grains up.
    """
    deck = bulk_deck(FRICTION)
    path = PULLEY + 0.5 * THICKNESS
    strip = Strip(bonds=184, length=2.3, thickness=THICKNESS, damping=0.2, reduction=0.1)
    _, along = add_loop(deck, strip, PULLEY, 2.0 * AXIS, 0.06)
    for name, x in (("head", AXIS), ("tail", -AXIS)):
        add_pulley(deck, name, x, PULLEY)
        deck.add("MOTION", part=name, type="ROTATION", angular_velocity=speed / path)
    x = AXIS - 0.1 - 0.0146 * np.arange(6)
    add_grains(deck, np.column_stack([x, 0 * x, 0 * x + path + 0.5 * THICKNESS + GRAIN]))
    grains = np.tile([1.0, 0.0, 0.0], (6, 1))
    spin = np.zeros((len(along) + 6, 3))
    spin[: len(along), 1] = np.where(np.abs(along[:, 2]) > 1e-9, speed / path, 0.0)
    return start(deck, velocity=speed * np.vstack([along, grains]), spin=spin)


def bulk_deck(friction: float) -> Deck:
    """A deck with gravity, grains' stuff and steel."""
    return contact_deck(friction=friction, restitution=0.2, gravity=(0.0, 0.0, -G), grain=STONE, steel=RIGID)


def add_grains(deck: Deck, places) -> None:
    """Grains that cannot turn: their inertia is huge."""
    add_spheres(deck, "grain", "grain", GRAIN, places, **{f"inertia_{axis}": 1e3 for axis in "xyz"})


def thrown_off(state: State, axis: float, grains: int, radius: float) -> tuple[np.ndarray, np.ndarray, list]:
    """Angle [°] of the last touch and distance ahead at `DROP` [m] of each grain, and their paths (k, 2) [m]."""
    particles = state.scene.population.particles
    weight = G * particles.mass[-grains:]
    every, paths, touching = steps_in(state, 2e-4), [], []
    while not paths or np.any(paths[-1][:, 1] > -DROP):
        advance_by(state, every)
        paths.append(position_of(state)[-grains:, [0, 2]] - [axis, radius])
        touching.append(np.abs(particles.force[2, -grains:] + weight) > 1e-9 * weight)
    paths, touching = np.array(paths).transpose(1, 0, 2), np.array(touching).T
    angles, places = [], []
    for path, touch in zip(paths, touching):
        last = np.flatnonzero(touch)[-1]
        angles.append(math.degrees(math.atan2(path[last, 0], path[last, 1] + radius)))
        places.append(np.interp(DROP, -path[last:, 1], path[last:, 0]))
    return np.array(angles), np.array(places), list(paths)


def off_rigid_belts() -> Findings:
    """One grain on a rigid belt: held fast by friction, slow with usual friction, and fast."""
    rows, series = [], []
    radius = PULLEY + GRAIN
    for label, speed, friction in (
        ("slow, held fast (friction 100)", SLOW, 100.0),
        ("slow", SLOW, FRICTION),
        ("fast", FAST, FRICTION),
    ):
        with tempfile.TemporaryDirectory() as folder:
            state = rigid_belt(speed, friction, Path(folder))
        angles, places, paths = thrown_off(state, 0.0, 1, radius)
        leaving = ride(speed, speed, radius, friction)
        # The touch ends late: the dent of 10 um, which the last, small forces leave, opens at 1 mm/s.
        rows.append(
            Row(f"angle of the last touch, {label}", "°", math.degrees(leaving[0]), angles[0], 1.0, True)
        )
        rows.append(ahead(label, leaving, radius, places[0], 2e-3))
        series += curves(label, leaving, radius, paths[0])
    target = math.degrees(math.acos(SLOW**2 / (G * radius)))
    rows.insert(1, Row("cos α = v²/gR, slow, held fast", "°", target, rows[0].result, 1.0, True))
    plot = Plot("discharge_rigid", "Grains off the head pulley of a rigid belt", "x [m]", "z [m]", series)
    return Findings(rows, [plot])


def ahead(label: str, leaving: tuple[float, float], radius: float, found: float, tolerance: float) -> Row:
    """The row of the parabola's place at `DROP`."""
    target = float(fall(*leaving, radius, np.array([DROP]))[0])
    return Row(f"distance ahead {DROP:g} m below, {label}", "m", target, found, tolerance)


def curves(label: str, leaving: tuple[float, float], radius: float, path: np.ndarray) -> list[Series]:
    """The parabola of the theory from where the grain leaves, and the solver's path."""
    depth = np.linspace(radius * (1.0 - math.cos(leaving[0])), DROP, 60)
    solver = path[(path[:, 0] > -0.05) & (path[:, 1] > -DROP)][::40]
    return [
        Series(f"theory, {label}", fall(*leaving, radius, depth), -depth),
        Series(f"solver, {label}", solver[:, 0], solver[:, 1], True),
    ]


def off_bonded_belts() -> Findings:
    """Six grains on a bonded belt, slow and fast: they ride on its outer side, which the bend makes faster."""
    rows, series = [], []
    outer = PULLEY + THICKNESS
    for label, speed in (("slow", SLOW), ("fast", FAST)):
        angles, places, paths = thrown_off(bonded_belt(speed), AXIS, 6, outer + GRAIN)
        leaving = ride(speed, speed * outer / (PULLEY + 0.5 * THICKNESS), outer + GRAIN, FRICTION)
        rows.append(
            Row(f"angle of the last touch, {label}", "°", math.degrees(leaving[0]), angles.mean(), 2.0, True)
        )
        rows.append(ahead(label, leaving, outer + GRAIN, float(places.mean()), 0.01))
        series += curves(label, leaving, outer + GRAIN, paths[0])
    plot = Plot("discharge_bonded", "Grains off the head pulley of a bonded belt", "x [m]", "z [m]", series)
    return Findings(rows, [plot])


RIDE = (
    "A grain that is held fast leaves where v² = g R cos α. With usual friction it slides ahead before, gets faster "
    "and leaves earlier: the target is the equation of that motion. Above √(g R) = 1.4 m/s it leaves where the belt "
    "begins to bend. R is the radius of the path of its centre; grains do not roll here."
)
CASES = {
    "T1": Case("Discharge, rigid belt", "Booth 1934; CEMA", off_rigid_belts, quick=False, note=RIDE),
    "T2": Case("Discharge, bonded belt", "as T1", off_bonded_belts, quick=False),
}
