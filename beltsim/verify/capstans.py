"""Belts over one pulley or two alike: capstan with its corrections, its limit of grip, centrifugal tension."""

from __future__ import annotations

import math

import numpy as np

from beltsim.engine import State, advance_by
from beltsim.solver.steps import GivenLoads
from beltsim.verify.case import Case, Findings, Row
from beltsim.verify.loops import add_loop, add_pulley, over_one, pulley_case
from beltsim.verify.stepping import axial_forces, position_of, put_load, run_for, start, steps_in
from beltsim.verify.strips import Strip, add_strip

RADIUS, FRICTION = 0.1, 0.3
THIN = Strip(bonds=60, length=60 * 0.0137, reduction=0.005, damping=0.3)
STIFF = Strip(bonds=60, length=60 * 0.0137, damping=0.3)


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


def capstan_run(slack: float, strip: Strip, speed: float = 0.1) -> tuple[float, float]:
    """Tensions [N] on both sides of a belt that is drawn over a fixed pulley, means over several pitches."""
    path = RADIUS + 0.5 * strip.thickness
    pitch = strip.pitch * (1.0 + slack / strip.axial)
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
    return float(np.mean(tight)), float(np.mean(loose))


def capstan() -> Findings:
    """A belt drawn over a fixed pulley: without bending stiffness, and with it at three slack tensions."""
    path = RADIUS + 0.005
    friction = FRICTION * RADIUS / path  # friction acts at the belt's underside, tension in its middle
    rows = []
    tight, loose = capstan_run(200.0, THIN)
    rows.append(Row("T1/T2, thin belt, exponent μθ R/(R + t/2)", "-", 2.453702, tight / loose, 0.02))
    for slack in (100.0, 200.0, 500.0):
        tight, loose = capstan_run(slack, STIFF)
        target = stiff_capstan(loose, STIFF.bending, friction, path)
        rows.append(Row(f"T1/T2 with bending stiffness, T2 = {slack:g} N", "-", target, tight / loose, 0.03))
    return Findings(rows)


def hung_over(tight: float, slack: float) -> State:
    """A thin belt over a fixed pulley, its ends loaded by `slack` [N] each; then one load grows to `tight` slowly."""
    strip = THIN
    path, last = RADIUS + 0.5 * strip.thickness, strip.bonds
    pitch = strip.pitch * (1.0 + slack / strip.axial)
    place, orientation = over_one((np.arange(last + 1) - last / 2) * pitch, path)
    deck = pulley_case(FRICTION)
    add_strip(deck, strip, place, orientation=orientation)
    add_pulley(deck, "pulley", 0.0, RADIUS)
    state = start(deck)
    state.stage.drag = 50.0
    for share in np.linspace(0.0, 1.0, 41):
        load = np.zeros((6, 2))
        load[2] = -slack, -(slack + share * (tight - slack))
        state.stage.given = GivenLoads(np.array([0, last], np.int32), load, np.full(2, -1, np.int32))
        run_for(state, 0.01)
    state.stage.drag = 0.0
    return state


def grip() -> Findings:
    """A thin belt hung over a fixed pulley with unequal loads: it holds below Euler's ratio and runs off above it."""
    slack, rows = 200.0, []
    ratio = math.exp(FRICTION * math.pi * RADIUS / (RADIUS + 0.5 * THIN.thickness))
    for share in (0.99, 1.01):
        state = hung_over(share * ratio * slack, slack)
        run_for(state, 0.2)
        speed = float(np.abs(state.scene.population.particles.velocity[2]).max())
        # Friction that exceeds the limit by 1 % leaves (T1 - T2 e^mu theta) / mass = 5 m/s2, at once.
        slips = float(speed > 0.1)
        rows.append(
            Row(f"{share:g} of the limit slips (1) or grips (0)", "-", float(share > 1.0), slips, 0.0, True)
        )
        if not slips:
            rows.append(Row(f"speed at {share:g} of the limit", "m/s", 0.0, speed, 1e-3, True))
    return Findings(rows)


def capstan_quick() -> Findings:
    """One tension of H1."""
    tight, loose = capstan_run(200.0, THIN)
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


CASES = {
    "H1": Case(
        "Capstan", "Euler with friction at the underside; lift-off of a stiff belt", capstan, quick=False
    ),
    "H1q": Case("Capstan, thin belt", "as H1", capstan_quick),
    "H1g": Case("Capstan, limit of grip", "Euler with friction at the underside", grip, quick=False),
    "H4": Case("Centrifugal tension", "shaft force − 2 ρA v²", centrifugal, quick=False),
}
