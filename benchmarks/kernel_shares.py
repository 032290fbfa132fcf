"""Where the time of a step goes: each pass by itself, on the state of a scene.

A pass is timed as the solver runs it: through `advance` with every other group left out, which compiles them away.
Without a step, it finds the forces and no more.
Springs do not grow meanwhile: the time step is zero.
"""

from __future__ import annotations

import time

from beltsim.engine import State, advance_by, renew_lists, solver_arguments
from beltsim.lists import Lists, overlaps_of
from beltsim.solver.integration import Limits, kick_and_drift
from beltsim.solver.steps import advance

ENOUGH = 0.1  # s of CPU for each figure


def seconds(call) -> float:
    """CPU seconds of a call, the least of three means, compilation apart."""
    call()
    found = []
    for _ in range(3):
        start, count = time.process_time(), 0
        while time.process_time() - start < ENOUGH:
            call()
            count += 1
        found.append((time.process_time() - start) / count)
    return min(found)


def forces_with(state: State, belt: bool, family: str | None):
    """A call that finds the forces with the bonds or one list of contacts, or with neither."""
    arguments = list(solver_arguments(state, time_step=0.0))
    if not belt:
        arguments[3] = None
    arguments[5] = Lists(
        *(None if name != family else value for name, value in zip(Lists._fields, arguments[5]))
    )
    return lambda: advance(*arguments, 0)


def shares(state: State, steps: int = 200) -> dict:
    """Microseconds a step of each pass, what whole steps take, and how many pairs there are."""
    waiting = time.process_time()
    while time.process_time() < waiting + 0.5:  # a core that has waited is half as fast for some 50 ms
        advance_by(state, steps)
    builds, start = state.list_builds, time.process_time()
    advance_by(state, steps)
    whole = (time.process_time() - start) / steps
    each_list = (state.list_builds - builds) / steps
    particles, environment = state.scene.population.particles, solver_arguments(state)[-2]
    base = seconds(forces_with(state, False, None))
    found = {
        "motion": seconds(
            lambda: kick_and_drift(particles, environment, environment.team, 0.0, 0.0, Limits(1.0, 1.0, 1.0))
        ),
    }
    if state.scene.bonds is not None:
        found["bonds"] = seconds(forces_with(state, True, None)) - base
    pairs = {}
    for name, family in zip(Lists._fields, state.lists):
        if family is None or family[0].first.size == 0:
            continue
        contacts = family[0]
        found[f"{name}: law and adding up"] = max(0.0, seconds(forces_with(state, False, name)) - base)
        pairs[name] = {
            "listed": int(contacts.first.size),
            "touching": int(
                (overlaps_of(family, state.scene.population.particles, state.scene.shapes) > 0.0).sum()
            ),
        }
    found["lists"] = seconds(lambda: renew_lists(state)) * each_list
    return {
        "microseconds": {name: 1e6 * value for name, value in found.items()},
        "whole": 1e6 * whole,
        "steps_per_list": 1.0 / each_list if each_list else None,
        "pairs": pairs,
        "particles": state.scene.population.count,
    }
