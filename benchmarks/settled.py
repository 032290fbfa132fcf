"""The settled states of S2 and S3, made by beltsim once and kept in a cache folder.

    python benchmarks/settled.py

makes what is not there yet: some minutes each. The folder is $BELTSIM_BENCHMARKS, or beltsim-benchmarks in the user's
cache.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
from as_deck import deck_of, result_of, started
from scenes import Scene, box_scene, loose_box, loose_load

from beltsim.engine import advance_by

DRAG = 4.0  # 1/s, takes out the energy of the fall
FALLING, RESTING = 0.40, 0.10  # s with and without it


def folder() -> Path:
    """Where settled states are kept."""
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    found = Path(os.environ.get("BELTSIM_BENCHMARKS") or home / "beltsim-benchmarks")
    found.mkdir(parents=True, exist_ok=True)
    return found


def settle(scene: Scene) -> Scene:
    """The scene after a fall with drag and a rest without."""
    for duration, drag in ((FALLING, DRAG), (RESTING, 0.0)):
        state = started(deck_of(scene, drag))
        advance_by(state, round(duration / state.stage.time_step))
        scene = replace(scene, **result_of(state))
    return scene


def settled(name: str) -> Scene:
    """S2 or S3 at rest."""
    scene = {"S2": loose_box, "S3": loose_load}[name]()
    path = folder() / f"{name}_settled.npz"
    if not path.exists():
        found = settle(scene)
        state = {key: getattr(found, key) for key in ("position", "velocity", "spin", "orientation")}
        temporary = path.with_suffix(".part.npz")
        np.savez_compressed(temporary, **state)
        temporary.replace(path)
    return replace(scene, **np.load(path))


def box(size: int = 1) -> Scene:
    """S2 times `size`, a square number: settled boxes side by side."""
    one = settled("S2")
    return box_scene(one.position, one.velocity, one.spin, one.radius, round(size**0.5))


def load() -> Scene:
    """S3."""
    return settled("S3")


if __name__ == "__main__":
    for wanted in ("S2", "S3"):
        print(wanted, settled(wanted).count, "particles in", folder())
