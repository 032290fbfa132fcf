"""Would it pay to step the bonds more often than the contacts? A trial on the loaded conveyor, not in the solver.

    python benchmarks/multirate.py

steps it by the impulse method (r-RESPA): the contacts kick all particles once in an outer step, bonds and gravity in
each of its inner ones. It drives the compiled kernels from Python, so its own run time says nothing; the gain follows
from what the passes take. Rolls turn at the speed that they have. A table goes to stdout, the figures to
results/multirate.json.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from conveyor import loaded
from kernel_shares import seconds

from beltsim import checkpoint
from beltsim.console import CommandError
from beltsim.engine import State, advance_by, renew_lists, solver_arguments
from beltsim.lists import Lists
from beltsim.scene.bodies import BOX
from beltsim.scene.touching import of_shape
from beltsim.solver.bonds import bond_measures
from beltsim.solver.integration import kick
from beltsim.solver.motion import PRESCRIBED
from beltsim.solver.steps import DONE, LISTS_STALE, TOO_FAST, advance
from beltsim.solver.timestep import bond_row_sums

SPAN = 0.02  # s of each run
FINE = 4  # the reference takes steps of a fourth
OUTER = (0.5, 0.7, 0.9, 1.2, 1.5, 1.6, 2.0, 2.4, 3.2)  # over the limit of undamped bonds
LOST = 0.05  # of kinetic energy off the reference: unstable


def steady(state: State) -> None:
    """Let all parts go on turning as they do: a torque from contacts would need an outer kick of its own."""
    parts, spins = state.scene.machinery.parts, state.stage.spins
    w, x, y, z = parts.orientation
    axis = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    spins.rate[:] = np.sum(axis * parts.angular_velocity, axis=0)
    spins.amplitude[:] = -1
    spins.mode[:] = PRESCRIBED


def bonds_alone(state: State) -> tuple:
    """Arguments of `advance` without contacts."""
    arguments = list(solver_arguments(state))
    arguments[5] = Lists(*[None] * len(Lists._fields))
    return tuple(arguments)


def contacts_alone(state: State, outer: float) -> tuple:
    """Arguments of `advance` without bonds and gravity; springs of contacts grow over an outer step [s]."""
    arguments = list(solver_arguments(state))
    arguments[3] = arguments[4] = None
    arguments[-2] = arguments[-2]._replace(gravity=(0.0, 0.0, 0.0))
    arguments[-1] = arguments[-1]._replace(time_step=outer)
    return tuple(arguments)


def outer_step(state: State, inner: int) -> None:
    """One outer step; the loads of the contacts are those of its beginning and of its end.

    Contacts see the mean velocities of the step: those of its end lack half the push of the contacts but none of the
    bonds', and springs would creep with the difference (places were 30 times as far off).
    """
    particles, outer = state.scene.population.particles, inner * state.stage.time_step
    kick(particles, outer)
    advance(*bonds_alone(state), 0)
    before, spin = particles.position.copy(), np.zeros_like(particles.angular_velocity)
    stale = False
    for _ in range(inner):
        _, reason = advance(*bonds_alone(state), 1)
        spin += particles.angular_velocity / inner
        state.step, state.total_steps = state.step + 1, state.total_steps + 1
        if reason not in (DONE, LISTS_STALE, TOO_FAST):
            raise CommandError("lost")
        stale = stale or reason != DONE
    velocity = particles.velocity.copy()
    particles.velocity[:] = (particles.position - before) / outer
    particles.angular_velocity[:] = spin
    advance(*contacts_alone(state, outer), 0)
    particles.velocity[:] = velocity
    kick(particles, outer)
    if stale:
        renew_lists(state)


def run(state: State, start: dict, step: float, inner: int) -> dict | None:
    """Measures after `SPAN` from a checkpoint with inner steps of `step` [s]; None if it blows up.

    With one inner step, the solver's own scheme.
    """
    checkpoint.put_back(start, state)
    steady(state)
    count = round(SPAN / (inner * step))
    state.stage.time_step = SPAN / (count * inner)
    try:
        if inner == 1:
            advance_by(state, count)
        else:
            advance(*contacts_alone(state, 0.0), 0)
            for _ in range(count):
                outer_step(state, inner)
    except CommandError:
        return None
    return measures(state)


def measures(state: State) -> dict:
    """Kinetic energy [J], mean tension of the bonds [N], places of the belt [m]."""
    p = state.scene.population.particles
    belt = of_shape(state.scene.population, BOX)
    loads, _ = bond_measures(p, state.scene.bonds, state.scene.kinds)
    energy = 0.5 * float(np.sum(p.mass * p.velocity**2))
    return {"energy": energy, "tension": float(loads[0].mean()), "places": p.position[:, belt].copy()}


def errors(found: dict | None, exact: dict) -> dict | None:
    """How far a run is off; None if it is unstable."""
    if found is None or not np.isfinite(found["energy"]):
        return None
    energy, tension = (abs(found[name] / exact[name] - 1.0) for name in ("energy", "tension"))
    if energy > LOST:
        return None
    apart = float(np.sqrt(np.mean(np.sum((found["places"] - exact["places"]) ** 2, axis=0))))
    return {"energy": energy, "tension": tension, "micrometres": 1e6 * apart}


def undamped_limit(state: State) -> float:
    """Verlet's limit [s] of the bonds without damping: the Gershgorin bound that the solver takes."""
    scene = state.scene
    kinds = scene.kinds
    rows = bond_row_sums(
        scene.population.particles, scene.bonds, kinds, kinds.stiffness, kinds.angular_stiffness, True
    )
    return 2.0 / float(np.sqrt(rows.max()))


def costs(state: State, start: dict) -> dict:
    """Microseconds of bonds and motion, of contacts, and of lists, a step of the solver's."""
    checkpoint.put_back(start, state)
    steady(state)
    builds, steps = state.list_builds, 400
    advance_by(state, steps)
    every = (state.list_builds - builds) / steps
    nothing = list(bonds_alone(state))
    nothing[-1] = nothing[-1]._replace(time_step=0.0)
    contacts = contacts_alone(state, 0.0)
    empty = list(contacts)
    empty[5] = (None,) * len(Lists._fields)
    slow = seconds(lambda: advance(*contacts, 0)) - seconds(lambda: advance(*empty, 0))
    fast = seconds(lambda: advance(*nothing, 50)) / 50
    return {
        "bonds and motion": 1e6 * fast,
        "contacts": 1e6 * slow,
        "lists": 1e6 * every * seconds(lambda: renew_lists(state)),
    }


def verdict(rows: list[dict]) -> str:
    """What the trial says: the best speed at the error of the solver's own step, and at twice that."""
    own = rows[0]["errors"]["micrometres"]
    stable = [row for row in rows if row["errors"] is not None]
    equal, twice = (
        max(row["gain"] for row in stable if row["errors"]["micrometres"] <= times * own) for times in (1, 2)
    )
    decision = "worth its code" if equal >= 1.3 else "not worth its code, for which 1.3 was asked"
    return (
        f"At equal error two rates are {equal:.2f} times as fast as one, at twice the error {twice:.2f} times: "
        f"{decision}. The largest outer step tried that did not blow up in so short a time is "
        f"{max(row['outer'] for row in stable):g} of the limit; the resonance that undamped bonds have at 1.57 did not "
        "show with these damped ones."
    )


def main() -> None:
    """Trial, table, figures."""
    state = loaded()
    start, limit = checkpoint.take(state), undamped_limit(state)
    share, step = costs(state, start), state.stage.time_step
    exact = run(state, start, step / FINE, 1)
    rows = []
    single = sum(share.values())
    for times in (step / limit, *OUTER):
        inner, each = int(np.ceil(times * limit / step - 1e-9)), step / (times * limit)
        cost = share["lists"] + (share["bonds and motion"] * inner + share["contacts"]) * each
        off = errors(run(state, start, times * limit / inner, inner), exact)
        rows.append({"outer": times, "inner": inner, "gain": single / cost, "errors": off})
        print(rows[-1], flush=True)
    found = {"limit": limit, "span": SPAN, "microseconds": share, "rows": rows, "verdict": verdict(rows)}
    (Path(__file__).parent / "results" / "multirate.json").write_text(json.dumps(found, indent=1) + "\n")
    print(found["microseconds"], f"limit {limit:.3g} s")


if __name__ == "__main__":
    main()
