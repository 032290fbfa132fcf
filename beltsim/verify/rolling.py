"""Spheres and blocks that roll, slide and stick; a box on a roller."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from beltsim.solver.contact import LINE_STIFFNESS
from beltsim.verify.case import Case, Findings, Plot, Row, Series
from beltsim.verify.loops import ACROSS
from beltsim.verify.spheres import RIGID, Stuff, add_floor, add_spheres, contact_deck
from beltsim.verify.stepping import position_of, put_load, run_for, sampled, start
from beltsim.verify.strips import case_deck

G = 9.81
BALL = Stuff(5e7, 0.3, 2500.0)
RADIUS = 0.01


def resting_sphere(friction: float, slope: float = 0.0, *, velocity=(0.0, 0.0, 0.0), belt=None, inertia=None):
    """A sphere at rest in its dent on a plane that falls by `slope` [rad] towards +x; `belt` is the plane's speed."""
    gravity = (G * math.sin(slope), 0.0, -G * math.cos(slope))
    deck = contact_deck(friction=friction, restitution=0.5, gravity=gravity, ball=BALL, wall=RIGID)
    mass = 4.0 / 3.0 * math.pi * RADIUS**3 * BALL.density
    dent = (0.75 * mass * -gravity[2] / (BALL.plane_modulus * math.sqrt(RADIUS))) ** (2.0 / 3.0)
    more = {} if inertia is None else {f"inertia_{axis}": inertia for axis in "xyz"}
    add_spheres(deck, "ball", "ball", RADIUS, [0.0, 0.0, RADIUS - dent], **more)
    add_floor(deck, "wall")
    if belt is not None:
        deck.add("MOTION", part="floor", type="SURFACE VELOCITY", rows={"vector": [[belt, 0.0, 0.0]]})
    return start(deck, velocity=[velocity])


def motion(state) -> np.ndarray:
    """Place and speed along x, and the speed of rolling."""
    particles = state.scene.population.particles
    return np.array(
        [particles.position[0, 0], particles.velocity[0, 0], RADIUS * particles.angular_velocity[1, 0]]
    )


def thrown() -> Findings:
    """A sphere thrown along a plane slides, then rolls."""
    friction, speed = 0.3, 1.0
    state = resting_sphere(friction, velocity=(speed, 0.0, 0.0))
    interval, history = sampled(state, 0.2, 400, motion)
    times = interval * np.arange(len(history))
    until = 2.0 * speed / (7.0 * friction * G)
    sliding = history[:, 1] - history[:, 2] > 0.01 * speed
    last = np.count_nonzero(sliding)
    # The line of the sliding speed meets zero where rolling begins.
    fit = np.polyfit(times[: last - 2], (history[:, 1] - history[:, 2])[: last - 2], 1)
    found = -fit[1] / fit[0]
    rows = [
        Row("end of sliding", "s", until, found, 2e-3),
        Row("final speed", "m/s", 5.0 / 7.0 * speed, history[-50:, 1].mean(), 2e-3),
        Row(
            "length of sliding",
            "m",
            12.0 * speed**2 / (49.0 * friction * G),
            np.interp(found, times, history[:, 0]),
            5e-3,
        ),
    ]
    series = [Series("v", times, history[:, 1]), Series("ω R", times, history[:, 2])]
    return Findings(
        rows, [Plot("thrown", "A sphere thrown along a plane", "time [s]", "speed [m/s]", series)]
    )


def on_moving_belt() -> Findings:
    """A sphere laid at rest on a rigid belt never reaches the belt's speed: it rolls at 2/7 of it."""
    state = resting_sphere(0.3, belt=1.0)
    run_for(state, 0.2)
    history = sampled(state, 0.02, 50, motion)[1]
    return Findings(
        [
            Row("final speed / belt speed", "-", 2.0 / 7.0, history[:, 1].mean(), 2e-3),
            Row("ω R / belt speed", "-", -5.0 / 7.0, history[:, 2].mean(), 2e-3),
        ]
    )


def incline() -> Findings:
    """A sphere on an incline rolls if friction allows, else slides."""
    slope = math.radians(30.0)
    limit = 2.0 / 7.0 * math.tan(slope)
    rows = []
    for share in (1.1, 0.9):
        friction = share * limit
        state = resting_sphere(friction, slope)
        interval, history = sampled(state, 0.2, 200, motion)
        times = interval * np.arange(len(history))
        acceleration = np.polyfit(times[40:], history[40:, 1], 1)[0]
        rolling = share > 1.0
        target = (
            5.0 / 7.0 * G * math.sin(slope) if rolling else G * (math.sin(slope) - friction * math.cos(slope))
        )
        rows.append(
            Row(f"acceleration at {share:g} of the limiting friction", "m/s2", target, acceleration, 2e-3)
        )
        if not rolling:
            turning = np.polyfit(times[40:], history[40:, 2], 1)[0] / RADIUS
            rows.append(
                Row(
                    "angular acceleration, sliding",
                    "rad/s2",
                    2.5 * friction * G * math.cos(slope) / RADIUS,
                    turning,
                    2e-3,
                )
            )
    return Findings(rows)


def block() -> Findings:
    """A body that cannot turn (its moment of inertia is huge) on an incline: sticks or slides."""
    slope = math.radians(20.0)
    rows = []
    for share in (1.02, 0.98):
        friction = share * math.tan(slope)
        state = resting_sphere(friction, slope, inertia=1e3)
        # The tangential spring takes up the weight; it swings, and its viscous part calms it.
        run_for(state, 0.2)
        begin = motion(state)
        run_for(state, 0.2)
        end = motion(state)
        if share > 1.0:
            creep = abs(end[0] - begin[0]) / 0.2 / (2.0 * RADIUS)
            rows.append(Row("creep at 1.02 of the limit, sizes per second", "1/s", 0.0, creep, 1e-6, True))
        else:
            target = G * (math.sin(slope) - friction * math.cos(slope))
            rows.append(
                Row("acceleration at 0.98 of the limit", "m/s2", target, (end[1] - begin[1]) / 0.2, 2e-3)
            )
    return Findings(rows)


YOUNG, SIZE, SLIP, PRESS = 5e7, (0.05, 0.1, 0.01), 0.3, 100.0  # Pa, m, -, N: of the box on a roller


def box_on_roller(height: float, tilt=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0)):
    """A box over a roller along y, its middle at a height above the axis.

    The box is turned by the rotation vector `tilt` about the middle of its underside, then both by `turn`.
    """
    turn, tilt = Rotation.from_rotvec(turn), Rotation.from_rotvec(tilt)
    half = np.array([0.0, 0.0, 0.5 * SIZE[2]])
    place = turn.apply(np.array([0.0, 0.0, height]) - half + tilt.apply(half))
    deck = case_deck()
    deck.add("MATERIAL", name="rubber", density=1200.0, youngs_modulus=YOUNG, poisson_ratio=0.3)
    deck.add("MATERIAL", name="wall", density=1000.0, youngs_modulus=1e30, poisson_ratio=0.3)
    deck.add("CONTACT PROPERTY", material_a="*", material_b="*", friction=SLIP, restitution=0.3)
    deck.add("CONTACT GROUP", name="belt", belt="belt")
    given = {f"size_{axis}": side for axis, side in zip("xyz", SIZE)} | {
        f"inertia_{axis}": 1e3 for axis in "xyz"
    }
    deck.add(
        "PARTICLE TYPE", name="box", shape="ROUNDED BOX", material="rubber", contact_group="belt", **given
    )
    orientation = (turn * tilt).as_quat(scalar_first=True)
    deck.add("PARTICLE", type="box", rows={"id": [1], "position": [place], "orientation": [orientation]})
    along = (turn * Rotation.from_quat(ACROSS, scalar_first=True)).as_quat(scalar_first=True)
    rows = {"position": [[0.0, 0.0, 0.0]], "orientation": [along]}
    deck.add("PART", name="roller", shape="CYLINDER", diameter=0.1, length=0.3, material="wall", rows=rows)
    return start(deck)


def tilted_lines() -> Findings:
    """Force of a line contact of a given overlap: turned with its roller, and tilted by a little in every way."""
    overlap = 2.5e-5
    force = LINE_STIFFNESS * YOUNG / (1.0 - 0.09) * SIZE[1] * overlap
    rows = []
    for label, tilt, turn, tolerance in (
        ("as it lies", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1e-6),
        ("turned with its roller", (0.0, 0.0, 0.0), (0.7, -1.1, 0.4), 1e-6),
        ("tilted by 1e-3 about the roller's axis", (0.0, 1e-3, 0.0), (0.0, 0.0, 0.0), 0.02),
        ("skewed by 1e-3", (0.0, 0.0, 1e-3), (0.0, 0.0, 0.0), 0.02),
        ("tilted by 4e-4 along the line, no end lifted", (4e-4, 0.0, 0.0), (0.0, 0.0, 0.0), 0.02),
    ):
        state = box_on_roller(0.05 + 0.5 * SIZE[2] - overlap, tilt, turn)
        rows.append(
            Row(f"force, {label}", "N", force, np.linalg.norm(state.scene.machinery.parts.force), tolerance)
        )
    return Findings(rows)


def line_contact() -> Findings:
    """A box pressed on a roller: the documented law of the line contact, and friction's torque on the roller."""
    state, force, friction = box_on_roller(0.055), PRESS, SLIP
    put_load(state, 0, force=(0.0, 0.0, -force))
    state.stage.drag = 200.0
    run_for(state, 0.5)
    overlap = 0.055 - position_of(state)[0, 2]
    modulus = YOUNG / (1.0 - 0.09)
    pressed = Row(
        "overlap of a line contact", "m", force / (LINE_STIFFNESS * modulus * SIZE[1]), overlap, 1e-4
    )
    # The box is held along x from now on; the roller turns under it and slips.
    state.scene.population.particles.mobility[:] = 0.0
    state.scene.population.particles.velocity[:] = 0.0
    state.stage.drag = 0.0
    state.stage.spins.rate[:] = 10.0
    run_for(state, 0.05)
    parts = state.scene.machinery.parts
    return Findings(
        [
            pressed,
            Row("normal force of the held box", "N", force, abs(parts.force[2, 0]), 1e-3),
            Row(
                "torque of friction on the roller",
                "N m",
                friction * force * 0.05,
                abs(parts.torque[1, 0]),
                2e-3,
            ),
        ]
    )


CASES = {
    "R1": Case("Thrown sphere", "t = 2v₀/7μg, v = 5v₀/7, s = 12v₀²/49μg", thrown),
    "R2": Case("Sphere on a moving belt", "v = 2V/7, ωR = 5V/7", on_moving_belt),
    "R3": Case(
        "Sphere on an incline", "rolls for μ ≥ (2/7) tan φ: 5/7 g sin φ; else g(sin φ − μ cos φ)", incline
    ),
    "R4": Case("Block on an incline", "sticks for μ ≥ tan φ", block),
    "R5": Case("Box on a roller", "F = (π/4) E* l δ; torque μ N R", line_contact),
    "R6": Case("Line contact, tilted", "F = (π/4) E* l δ, the mean of δ along the line", tilted_lines),
}
