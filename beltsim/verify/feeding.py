"""Bulk fed onto a moving belt: the force that its acceleration costs."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from beltsim.run import run
from beltsim.scene import build
from beltsim.verify.case import Case, Findings, Plot, Row, Series
from beltsim.verify.spheres import RIGID, Stuff, add_floor, contact_deck

RATE, BELT, FEED = 10.0, 2.0, 0.5  # kg/s, m/s, m/s along the belt


def fed_belt():
    """A deck: spheres that cannot turn (their inertia is huge) fall on a rigid belt and leave behind x = 1 m."""
    gravel = Stuff(5e6, 0.3, 2500.0)
    deck = contact_deck(friction=0.5, restitution=0.2, gravity=(0.0, 0.0, -9.81), gravel=gravel, belt=RIGID)
    deck.blocks("STEP")[0].parameters["DURATION"] = 1.5
    inertia = {f"inertia_{axis}": 1e3 for axis in "xyz"}
    deck.add("PARTICLE TYPE", name="gravel", shape="SPHERE", radius=0.01, material="gravel", **inertia)
    add_floor(deck, "belt")
    deck.add("MOTION", part="floor", type="SURFACE VELOCITY", rows={"vector": [[BELT, 0.0, 0.0]]})
    box = [0.0, -0.5, 0.02, 0.1, 0.5, 0.12]
    rows = {"box": [box], "velocity": [[FEED, 0.0, -0.5]]}
    deck.add("SOURCE", name="feed", particle_type="gravel", mass_rate=RATE, rows=rows)
    deck.add("DOMAIN", rows={"box": [[-1.0, -1.0, -1.0, 1.0, 1.0, 1.0]]})
    deck.add("OUTPUT", interval=0.002)
    deck.add("MEASURE", name="drive", type="POWER", part="floor", rows={})
    return deck


def belt_force() -> Findings:
    """Mean force along a belt that carries a steady feed away."""
    import h5py

    deck = fed_belt()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "fed.h5"
        tally = run(deck, build(deck), str(path))
        with h5py.File(path) as file:
            force = file["/parts/floor/force/value"][:, 0]
            power = np.ravel(file["/observables/drive/value"][()])
            times = 0.002 * np.arange(force.size)
    steady = times > 0.6
    mean, rate = -float(force[steady].mean()), tally.achieved("feed")
    rows = [
        Row("achieved rate of the source", "kg/s", RATE, rate, 0.01),
        Row("force of the belt", "N", RATE * (BELT - FEED), mean, 0.03),
        Row("power of its drive", "W", RATE * (BELT - FEED) * BELT, power[steady].mean(), 0.03),
    ]
    smooth = np.convolve(-force, np.full(25, 1.0 / 25.0), mode="valid")
    series = [
        Series("solver, mean over 50 ms", times[12 : 12 + smooth.size], smooth),
        Series("rate × (belt − feed speed)", times, np.full(times.size, RATE * (BELT - FEED))),
    ]
    return Findings(rows, [Plot("feeding", "Feed on a moving belt", "time [s]", "force [N]", series)])


CASES = {
    "S1": Case("Feed on a moving belt", "momentum flux, ṁ (V − v₀); ṁ (V − v₀) V", belt_force, quick=False)
}
