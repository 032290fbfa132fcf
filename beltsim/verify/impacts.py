"""Impacts of spheres in closed form: Hertz, restitution, gross sliding, bouncing."""

from __future__ import annotations

import math

import numpy as np

from beltsim.engine import advance_by
from beltsim.verify.case import Case, Findings, Plot, Row, Series
from beltsim.verify.spheres import RIGID, Stuff, add_floor, add_spheres, contact_deck, impacts
from beltsim.verify.stepping import run_for, start

OXIDE = Stuff(3.8e11, 0.23, 4000.0)
RUBBER = Stuff(5e6, 0.45, 1200.0)


def restitution() -> Findings:
    """Restitution of a sphere on a plane for all values of it."""
    given = np.array([0.1, 0.2, 0.4, 0.5, 0.6, 0.8, 0.9, 0.95, 0.98, 1.0])
    found = []
    for e in given:
        out = impacts(RUBBER, 0.01, [[0.0, 0.0, -1.0]], restitution=float(e), steps=4000)
        found.append(out.velocity[0, 2])
    rows = [Row(f"restitution for e = {e:g}", "-", e, r, 2e-3) for e, r in zip(given, found)]
    series = [Series("given", given, given), Series("solver", given, np.array(found), True)]
    return Findings(rows, [Plot("restitution", "Restitution", "given", "found", series)])


def gross_sliding() -> Findings:
    """Oblique impacts that slide all through: tangential restitution and spin, at three angles from the normal."""
    friction, speed, radius = 0.1, 2.0, 0.01
    angles = np.radians([40.0, 60.0, 80.0])
    velocity = speed * np.column_stack([np.sin(angles), 0 * angles, -np.cos(angles)])
    rows = []
    for e, tolerance in ((1.0, 1e-3), (0.8, 1e-2)):
        out = impacts(RUBBER, radius, velocity, friction=friction, restitution=e, steps=4000)
        for k, angle in enumerate(angles):
            where = f"at {math.degrees(angle):.0f}°, e = {e:g}"
            target = 1.0 - friction * (1.0 + e) / math.tan(angle)
            rows.append(Row(f"e_t {where}", "-", target, out.velocity[k, 0] / velocity[k, 0], tolerance))
            target = 2.5 * friction * (1.0 + e) * speed * math.cos(angle) / radius
            rows.append(Row(f"spin {where}", "rad/s", target, out.spin[k, 1], tolerance))
    return Findings(rows)


def order_of_impact() -> Findings:
    """Error of the rebound speed of an elastic impact for shorter and shorter steps."""
    steps, errors = np.array([25, 50, 100, 200]), []
    for n in steps:
        out = impacts(RUBBER, 0.01, [[0.0, 0.0, -1.0]], steps=int(n))
        errors.append(abs(out.velocity[0, 2] - 1.0))
    rows = [Row("error at 100 steps an impact", "-", 0.0, errors[2], 1e-3, True)]
    series = [
        Series("solver", np.log10(steps), np.log10(np.maximum(errors, 1e-16)), True),
        Series("a slope of order 2", np.log10(steps), np.log10(errors[0] * (steps[0] / steps) ** 2)),
    ]
    plot = Plot(
        "impact_order",
        "Elastic impact: error of the rebound speed",
        "log10 steps an impact",
        "log10 error",
        series,
    )
    return Findings(rows, [plot])


def bouncing() -> Findings:
    """Heights of a bouncing sphere: each e^2 of the one before."""
    height, e, radius = 0.1, 0.8, 0.005
    deck = contact_deck(
        time_step=2e-6, restitution=e, gravity=(0.0, 0.0, -9.81), ball=Stuff(1e8, 0.3, 2500.0), wall=RIGID
    )
    add_spheres(deck, "ball", "ball", radius, [0.0, 0.0, radius + height])
    add_floor(deck, "wall")
    state = start(deck, allow_unstable=True)
    particles = state.scene.population.particles
    heights, times, trace = [], [], []
    rising = False
    while len(heights) < 3:
        advance_by(state, 100)
        speed, z = particles.velocity[2, 0], particles.position[2, 0] - radius
        times.append(state.time)
        trace.append(z)
        if rising and speed <= 0.0:
            heights.append(z + speed**2 / (2.0 * 9.81))
        rising = speed > 0.0
    rows = [
        Row(f"height after bounce {k}", "m", height * e ** (2 * k), h, 5e-3) for k, h in enumerate(heights, 1)
    ]
    plot = Plot(
        "bouncing",
        "A bouncing sphere, e = 0.8",
        "time [s]",
        "height [m]",
        [Series("solver", np.array(times), np.array(trace))],
    )
    return Findings(rows, [plot])


def linear_bounces() -> tuple[float, list[float]]:
    """Fall time [s] of a sphere with a stiff linear contact, e = 0.5, and when it touches the floor."""
    height, radius = 0.1, 0.005
    deck = contact_deck(
        time_step=2e-6, restitution=0.5, gravity=(0.0, 0.0, -9.81), ball=Stuff(1e8, 0.3, 2500.0), wall=RIGID
    )
    deck.add("CONTACT MODEL", type="LINEAR")
    deck.blocks("CONTACT PROPERTY")[0].parameters |= {"NORMAL STIFFNESS": 1e5, "TANGENTIAL STIFFNESS": 1e5}
    add_spheres(deck, "ball", "ball", radius, [0.0, 0.0, radius + height])
    add_floor(deck, "wall")
    state = start(deck, allow_unstable=True)
    particles, touches, before = state.scene.population.particles, [], False
    while len(touches) < 5:
        advance_by(state, 10)
        touching = bool(particles.position[2, 0] < radius)
        if touching and not before:
            touches.append(state.time)
        before = touching
    return math.sqrt(2.0 * height / 9.81), touches


def linear_bouncing() -> Findings:
    """A linear contact bounces the same at any speed: the touches come faster and faster, towards a last time."""
    fall, touches = linear_bounces()
    targets = fall * (1.0 + 2.0 * np.cumsum(np.concatenate([[0.0], 0.5 ** np.arange(1, 5)])))
    # With e = 0.5 what is to come of a geometric series is as long as its last member.
    end = 2.0 * touches[-1] - touches[-2]
    rows = [Row(f"time of touch {k}", "s", t, f, 5e-3) for k, (t, f) in enumerate(zip(targets, touches), 1)]
    rows.append(Row("end of bouncing", "s", 3.0 * fall, end, 5e-3))
    return Findings(rows)


def column() -> Findings:
    """Overlaps in a column of five spheres at rest: contact k from the top carries k weights."""
    radius, count = 0.01, 5
    deck = contact_deck(restitution=0.3, gravity=(0.0, 0.0, -9.81), ball=RUBBER, wall=RIGID)
    heights = radius * (1.0 + 2.0 * np.arange(count))
    add_spheres(deck, "ball", "ball", radius, np.column_stack([0 * heights, 0 * heights, heights]))
    add_floor(deck, "wall")
    state = start(deck)
    state.stage.drag = 30.0
    run_for(state, 2.0)
    particles = state.scene.population.particles
    z, mass = particles.position[2], particles.mass[0]
    rows = []
    for k in range(1, count + 1):
        modulus, reduced = RUBBER.plane_modulus / 2.0, radius / 2.0
        if k == count:
            modulus, reduced = RUBBER.plane_modulus, radius
        target = (3.0 * k * mass * 9.81 / (4.0 * modulus * math.sqrt(reduced))) ** (2.0 / 3.0)
        below = -radius if k == count else z[count - k - 1]
        rows.append(
            Row(
                f"overlap of contact {k} from the top",
                "m",
                target,
                2.0 * radius - (z[count - k] - below),
                1e-4,
            )
        )
    return Findings(rows)


SLIDING = (
    "With damping the tail of the normal force pulls and has no friction, so friction's impulse is a little more than "
    "the coefficient times the normal impulse: 0.45 % at e = 0.8."
)
CASES = {
    "P1": Case(
        "Restitution",
        "e as given, attractive tail kept (Antypov & Elliott 2011)",
        restitution,
        note="The damped force is kept to the end of the overlap, also where it pulls; only so it gives e exactly.",
    ),
    "P2": Case(
        "Oblique impact, gross sliding",
        "e_t = 1 − μ(1 + e) cot θ; ω = 5μ(1 + e) v cos θ/2R",
        gross_sliding,
        note=SLIDING,
    ),
    "P3": Case("Elastic impact and step", "velocity Verlet: at least order 2", order_of_impact),
    "P4": Case("Bouncing sphere", "h_k = h₀ e^{2k}", bouncing),
    "P4l": Case("Bouncing, linear contact", "(1 + e)/(1 − e) √(2h₀/g)", linear_bouncing, quick=False),
    "P5": Case("Column of spheres", "Hertz: δ = (3 k m g/4E*√R*)^{2/3}", column),
}
