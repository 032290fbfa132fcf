"""Belts on pulleys: capstan with its corrections, centrifugal tension, two pulleys with torque."""

from __future__ import annotations

import math

import numpy as np

from beltsim.engine import State, advance_by
from beltsim.verify.case import Case, Findings, Plot, Row, Series
from beltsim.verify.loops import add_loop, add_pulley, over_one, pulley_case
from beltsim.verify.stepping import axial_forces, position_of, put_load, run_for, start, steps_in
from beltsim.verify.strips import Strip, add_strip

RADIUS, FRICTION = 0.1, 0.3


def stiff_capstan(slack: float, bending: float, friction: float, radius: float) -> float:
    """Ratio of tensions over half a turn for a belt that lifts off by psi, cos psi = 1 - EI / (2 r^2 T), at both ends.

    T1 (cos p1 - m sin p1) = T2 (cos p2 + m sin p2) exp(m (pi - p1 - p2)), from the elastica's invariant
    T + EI k^2 / 2 = const.
    """
    from scipy.optimize import brentq

    def lift(tension):
        return math.acos(1.0 - bending / (2.0 * radius**2 * tension))

    def surplus(tight):
        p1, p2 = lift(tight), lift(slack)
        left = tight * (math.cos(p1) - friction * math.sin(p1))
        right = slack * (math.cos(p2) + friction * math.sin(p2))
        return left - right * math.exp(friction * (math.pi - p1 - p2))

    return brentq(surplus, slack, 5.0 * slack) / slack


def capstan_run(slack: float, strip: Strip, speed: float = 0.1) -> tuple[float, float, State]:
    """Tensions [N] on both sides of a belt that is drawn over a fixed pulley, means over several pitches."""
    path = RADIUS + 0.5 * strip.thickness
    stretch = 1.0 + slack / strip.axial
    pitch = strip.pitch * stretch
    count = strip.bonds + 1
    place, orientation = over_one((np.arange(count) - strip.bonds / 2) * pitch, path)
    deck = pulley_case(FRICTION)
    add_strip(deck, strip, place, orientation=orientation)
    add_pulley(deck, "pulley", 0.0, RADIUS)
    state = start(deck, pinned=[0])
    put_load(state, count - 1, force=(0.0, 0.0, -slack))
    run_for(state, 0.1)
    state.scene.population.particles.velocity[2, 0] = -speed
    # The spring between belt and pulley winds up over about 1 mm; two pitches on, means over three.
    run_for(state, 2.0 * pitch / speed)
    every = max(1, steps_in(state, 3.0 * pitch / speed) // 60)
    tight, loose = [], []
    for _ in range(60):
        advance_by(state, every)
        force, z = axial_forces(state), position_of(state)[:, 2]
        free = z[:-1] < -0.03
        half = np.arange(strip.bonds) < strip.bonds // 2
        tight.append(force[free & half].mean())
        loose.append(force[free & ~half].mean())
    return float(np.mean(tight)), float(np.mean(loose)), state


def capstan() -> Findings:
    """A belt drawn over a fixed pulley: without bending stiffness, and with it at three slack tensions."""
    path = RADIUS + 0.005
    friction = FRICTION * RADIUS / path  # friction acts at the belt's underside, tension in its middle
    rows = []
    soft = Strip(bonds=60, length=60 * 0.0137, reduction=0.005, damping=0.3)
    tight, loose, _ = capstan_run(200.0, soft)
    rows.append(Row("T1/T2, thin belt, exponent μθ R/(R + t/2)", "-", 2.453702, tight / loose, 0.02))
    stiff = Strip(bonds=60, length=60 * 0.0137, damping=0.3)
    for slack in (100.0, 200.0, 500.0):
        tight, loose, _ = capstan_run(slack, stiff)
        target = stiff_capstan(loose, stiff.bending, friction, path)
        rows.append(Row(f"T1/T2 with bending stiffness, T2 = {slack:g} N", "-", target, tight / loose, 0.03))
    return Findings(rows)


def capstan_quick() -> Findings:
    """One tension of H1."""
    strip = Strip(bonds=60, length=60 * 0.0137, reduction=0.005, damping=0.3)
    tight, loose, _ = capstan_run(200.0, strip)
    return Findings([Row("T1/T2, thin belt, exponent μθ R/(R + t/2)", "-", 2.453702, tight / loose, 0.02)])


def shaft_force(speed: float) -> float:
    """Force [N] that a loop with a pre-tension of 1500 N at rest puts on the axle of a frictionless pulley."""
    strip = Strip(bonds=136, length=136 * 0.025, damping=0.1)
    deck = pulley_case(0.0)
    place, along = add_loop(deck, strip, 0.2, 1.0, 0.03)
    add_pulley(deck, "head", 0.5, 0.2)
    add_pulley(deck, "tail", -0.5, 0.2)
    spin = np.where((np.abs(place[:, 0]) > 0.5)[:, None], [[0.0, speed / 0.205, 0.0]], 0.0)
    state = start(deck, velocity=speed * along, spin=spin)
    run_for(state, 0.3)
    forces = []
    for _ in range(200):
        run_for(state, 1e-3)
        forces.append(state.scene.machinery.parts.force[0, 0])
    return abs(float(np.mean(forces)))


def centrifugal() -> Findings:
    """Fixed centres: the force on the shafts falls by 2 (mass per length) v^2."""
    rest = shaft_force(0.0)
    rows = []
    for speed in (10.0, 20.0):
        # The loop's mass is spread over its present length.
        loss = rest - shaft_force(speed)
        line_mass = 136 * 1.2 * 0.025 / (2.0 * (math.pi * 0.205 + 1.0))
        rows.append(
            Row(f"fall of the shaft force at {speed:g} m/s", "N", 2.0 * line_mass * speed**2, loss, 0.02)
        )
    return Findings(rows)


def driven_pair(torque: float) -> dict:
    """A loop around a driving and a braked pulley in steady motion: tensions and creep."""
    radius, distance, speed = 0.2, 1.0, 1.0
    strip = Strip(bonds=272, length=272 * 0.0125, damping=0.2, reduction=0.02)
    deck = pulley_case(0.4)
    place, along = add_loop(deck, strip, radius, distance, 0.01)
    add_pulley(deck, "driver", 0.5, radius)
    add_pulley(deck, "driven", -0.5, radius)
    path = radius + 0.5 * strip.thickness
    rate = speed / path
    deck.add("AMPLITUDE", name="ramp", rows={"time": [0.0, 0.3], "factor": [0.0, 1.0]})
    deck.add("MOTION", part="driver", type="ROTATION", angular_velocity=rate)
    deck.add("MOTION", part="driven", type="TORQUE", torque=-torque, inertia=0.05, amplitude="ramp")
    spin = np.where((np.abs(place[:, 0]) > 0.5)[:, None], [[0.0, rate, 0.0]], 0.0)
    state = start(deck, velocity=speed * along, spin=spin)
    parts = state.scene.machinery.parts
    parts.angular_velocity[1] = rate
    run_for(state, 1.5)
    upper, lower, turns, torques = [], [], [], []
    for _ in range(100):
        run_for(state, 5e-3)
        force, at = axial_forces(state), position_of(state)
        free = np.abs(at[:, 0]) < 0.35
        upper.append(force[free & (at[:, 2] > 0)].mean())
        lower.append(force[free & (at[:, 2] < 0)].mean())
        turns.append(parts.angular_velocity[1].copy())
        torques.append(parts.torque[1].copy())
    turn = np.mean(turns, axis=0)
    tensions = sorted((float(np.mean(upper)), float(np.mean(lower))))
    return {
        "tight": tensions[1],
        "slack": tensions[0],
        "creep": float(1.0 - turn[1] / turn[0]),
        "torque": float(abs(np.mean(torques, axis=0)[0])),
    }


# Torque -> tight and slack tension [N], creep: adhesion arc at the entry, slip arc at the exit (Reynolds; Firbank
# 1970), with the exact compatibility of the loop's length.
TWO_PULLEYS = {
    10.0: (524.41, 475.63, 9.655e-4),
    20.0: (548.93, 451.36, 1.930e-3),
    40.0: (598.54, 403.42, 3.856e-3),
    60.0: (649.49, 356.81, 5.779e-3),
}


def two_pulleys(torques) -> Findings:
    """Tensions and creep of a loop between a driving and a braked pulley."""
    rows, found = [], []
    for torque in torques:
        tight, slack, creep = TWO_PULLEYS[torque]
        run = driven_pair(torque)
        found.append((run["tight"], run["slack"]))
        rows += [
            Row(f"tight side, {torque:g} N m", "N", tight, run["tight"], 0.03),
            Row(f"slack side, {torque:g} N m", "N", slack, run["slack"], 0.03),
            Row(f"torque on the driver, {torque:g} N m", "N m", torque, run["torque"], 0.02),
            Row(f"creep, {torque:g} N m", "-", creep, run["creep"], 0.1),
        ]
    found, exact = np.array(found), np.array(list(TWO_PULLEYS.values()))
    series = []
    for k, label in enumerate(("tight side", "slack side")):
        series += [
            Series(f"{label}, theory", np.array(list(TWO_PULLEYS)), exact[:, k]),
            Series(f"{label}, solver", np.array(torques, float), found[:, k], True),
        ]
    return Findings(
        rows, [Plot("two_pulleys", "Two pulleys with torque", "torque [N m]", "tension [N]", series)]
    )


PULLEYS = (
    "The theory's belt is a thin string; this one has 2 % of its bending stiffness. Tensions are 1 to 3 % low on both "
    "sides: where the belt bends onto a pulley its underside is shortened, friction there stretches what lies on the "
    "pulley (by 10 % of the tension without torque), and the length of the loop is given. The creep is 5 to 8 % high; "
    "contacts four times as stiff lower it by 1.4 % only, so most of that is not their compliance."
)
CASES = {
    "H1": Case(
        "Capstan", "Euler with friction at the underside; lift-off of a stiff belt", capstan, quick=False
    ),
    "H1q": Case("Capstan, thin belt", "as H1", capstan_quick),
    "H4": Case("Centrifugal tension", "shaft force − 2 ρA v²", centrifugal, quick=False),
    "I1": Case(
        "Two pulleys with torque",
        "creep theory, Reynolds 1874, Firbank 1970",
        lambda: two_pulleys(list(TWO_PULLEYS)),
        quick=False,
        note=PULLEYS,
    ),
    "I1q": Case("Two pulleys, 40 N m", "as I1", lambda: two_pulleys([40.0]), quick=False),
}
