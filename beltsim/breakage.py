"""Which bonds broke, when and how: gathered during a run, written once at its end."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from beltsim.engine import State
from beltsim.solver.bond_tiles import BROKEN_IN_TENSION


@dataclass
class Breaks:
    """Broken bonds in the order of their breaking; `bond` counts as in the deck."""

    time: list[float] = field(default_factory=list)  # s
    step: list[int] = field(default_factory=list)  # of the whole run
    bond: list[int] = field(default_factory=list)
    mode: list[int] = field(default_factory=list)  # 1 tension, 2 shear
    known: set[int] = field(default_factory=set)  # the same bonds in the solver's order

    def table(self) -> dict[str, np.ndarray]:
        """The columns as arrays."""
        return {
            "time": np.array(self.time, np.float64),
            "step": np.array(self.step, np.int64),
            "bond": np.array(self.bond, np.int64),
            "mode": np.array(self.mode, np.int8),
        }


def gather_breaks(state: State, breaks: Breaks) -> None:
    """Add the bonds that broke since the last call; call it at least once in each stage, at its end."""
    scene, stage = state.scene, state.stage
    if scene.strength is None:
        return
    strength = scene.strength
    fresh = [int(b) for b in np.flatnonzero(strength.mode) if int(b) not in breaks.known]
    deck_row = np.argsort(scene.bonding.place)
    for b in sorted(fresh, key=lambda b: (strength.broken_step[b], deck_row[b])):
        step = int(strength.broken_step[b])
        breaks.known.add(b)
        breaks.time.append(stage.start + step * stage.time_step)
        breaks.step.append(state.total_steps - state.step + step)
        breaks.bond.append(int(deck_row[b]))
        breaks.mode.append(int(strength.mode[b]))


def sentence(breaks: Breaks, scene) -> str:
    """One line about the bonds that broke."""
    first = int(scene.bonding.place[breaks.bond[0]])
    ids = scene.population.id
    mode = "tension" if breaks.mode[0] == BROKEN_IN_TENSION else "shear"
    count = f"{len(breaks.time)} bond{'s' * (len(breaks.time) > 1)}"
    pair = f"{ids[scene.bonds.first[first]]} and {ids[scene.bonds.second[first]]}"
    return f"{count} broke, first at t = {breaks.time[0]:.4g} s that of particles {pair}, in {mode}"
