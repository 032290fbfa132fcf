"""Bulk that flows out of a flat-bottomed bin through a round hole: the law of Beverloo."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import numpy as np

from beltsim.inp import Deck
from beltsim.run import run
from beltsim.scene import build
from beltsim.verify.case import Case, Findings, Plot, Row, Series
from beltsim.verify.spheres import RIGID, Stuff, add_floor, add_mesh, add_spheres, contact_deck
from beltsim.verify.stepping import position_of, run_for, start

G = 9.81
GRAIN = 0.01  # m, diameter
WIDTH = 0.16  # m, of the square bin
BEADS = Stuff(5e6, 0.3, 2500.0)
COEFFICIENT, OFFSET = (
    0.58,
    1.4,
)  # C and k of the law: 0.55 to 0.65, and the diameters by which the hole is narrower
HOLES = {4.5: 1.6, 6.0: 0.9, 8.0: 0.5}  # hole over grain diameter -> s, some 500 to 800 grains each
STEADY = 0.15  # s after opening


def bin_deck(duration: float) -> Deck:
    """Four walls of a square bin, without a floor."""
    deck = contact_deck(friction=0.5, restitution=0.5, gravity=(0.0, 0.0, -G), beads=BEADS, wall=RIGID)
    deck.blocks("STEP")[0].parameters["DURATION"] = duration
    half, root = 0.5 * WIDTH, math.sqrt(0.5)
    for name, x, y in (("left", 1.0, 0.0), ("right", -1.0, 0.0), ("front", 0.0, 1.0), ("back", 0.0, -1.0)):
        turned = [root, -root * y, root * x, 0.0]  # local z to the inward normal (x, y, 0)
        rows = {"position": [[-half * x, -half * y, 0.0]], "orientation": [turned]}
        deck.add("PART", name=name, shape="PLANE", material="wall", rows=rows)
    return deck


def packing() -> np.ndarray:
    """Places (n, 3) [m] of 3375 grains that have settled in the closed bin, from random velocities."""
    random = np.random.default_rng(7)
    layer = (np.arange(15) - 7.0) * 1.05 * GRAIN
    height = 0.6 * GRAIN + 1.05 * GRAIN * np.arange(15)
    places = np.stack(np.meshgrid(layer, layer, height, indexing="ij"), axis=-1).reshape(-1, 3)
    deck = bin_deck(1.0)
    add_floor(deck, "wall")
    add_spheres(deck, "bead", "beads", 0.5 * GRAIN, places)
    state = start(deck, velocity=random.uniform(-0.3, 0.3, places.shape))
    run_for(state, 0.4)
    return position_of(state).copy()


def bulk_density(places: np.ndarray) -> float:
    """Mass per volume [kg/m3] of a packing, between three diameters above the floor and three below its top."""
    low, high = 3.0 * GRAIN, np.quantile(places[:, 2], 0.98) - 3.0 * GRAIN
    inside = np.count_nonzero((places[:, 2] > low) & (places[:, 2] < high))
    return inside * BEADS.density * math.pi / 6.0 * GRAIN**3 / (WIDTH**2 * (high - low))


def holed_floor(hole: float, corners: int = 24) -> tuple[list, list]:
    """Vertices and triangles of a square floor with a hole of a diameter [m]: a polygon of the circle's area."""
    angle = 2.0 * np.pi * np.arange(corners) / corners
    ray = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    inner = 0.5 * hole / math.sqrt(corners / (2.0 * np.pi) * math.sin(2.0 * np.pi / corners))
    outer = 0.51 * WIDTH / np.abs(ray).max(axis=1)
    here = np.arange(corners)
    ahead = (here + 1) % corners
    triangles = np.vstack([
        np.column_stack([here, here + corners, ahead + corners]), np.column_stack([here, ahead + corners, ahead])
    ])  # fmt: skip
    return np.vstack([inner * ray, outer[:, None] * ray]), triangles


def outflow(places: np.ndarray, hole: float, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and mass [kg] that has left a bin through a hole in its floor."""
    import h5py

    deck = bin_deck(end)
    add_spheres(deck, "bead", "beads", 0.5 * GRAIN, places)
    deck.add("DOMAIN", rows={"box": [[-1.0, -1.0, -0.1, 1.0, 1.0, 1.0]]})
    deck.add("OUTPUT", interval=0.02)
    rows = {"point": [[0.0, 0.0, -0.05]], "normal": [[0.0, 0.0, -1.0]]}
    deck.add("MEASURE", name="out", type="MASS FLOW", rows=rows)
    with tempfile.TemporaryDirectory() as folder:
        add_mesh(deck, Path(folder) / "floor.obj", *holed_floor(hole), "floor", "wall")
        path = Path(folder) / "out.h5"
        run(deck, build(deck), str(path))
        with h5py.File(path) as file:
            mass = np.ravel(file["/observables/out_mass/value"][()])
    return 0.02 * np.arange(mass.size), mass


def beverloo() -> Findings:
    """Mass flow through three holes: the law's exponent, and its coefficient with the usual offset."""
    places = packing()
    density, flows, series = bulk_density(places), [], []
    for ratio, end in HOLES.items():
        times, mass = outflow(places, ratio * GRAIN, end)
        steady = times >= STEADY
        flows.append(np.polyfit(times[steady], mass[steady], 1)[0])
        series.append(Series(f"D = {ratio:g} d", times, mass, True))
        series.append(Series(f"law, D = {ratio:g} d", times, law(ratio, density) * times))
    ratios, flows = np.array(list(HOLES)), np.array(flows)
    exponent = np.polyfit(np.log(ratios - OFFSET), np.log(flows), 1)[0]
    rows = [Row("exponent of D − 1.4 d", "-", 2.5, exponent, 0.15, True)]
    rows += [
        Row(f"mass flow, D = {ratio:g} d", "kg/s", law(ratio, density), flow, 0.2)
        for ratio, flow in zip(ratios, flows)
    ]
    plot = Plot("beverloo", "Outflow of a flat-bottomed bin", "time [s]", "mass [kg]", series)
    return Findings(rows, [plot])


def law(ratio: float, density: float) -> float:
    """Mass flow [kg/s] of Beverloo's law through a hole of so many grain diameters."""
    return COEFFICIENT * density * math.sqrt(G) * ((ratio - OFFSET) * GRAIN) ** 2.5


GRAINS = (
    "3375 spheres of 10 mm, friction 0.5, in a bin of 160 x 160 mm; the hole is a polygon of the circle's area, the "
    "bulk density that of the packing. The coefficient depends on the grains (0.55 to 0.65 in experiments), so a flow "
    "may be 20 % off; a shift of k by 0.1 changes the exponent by 0.06."
)
CASES = {
    "S2": Case(
        "Flow through a hole",
        "W = 0.58 ρ √g (D − 1.4 d)^2.5, Beverloo et al. 1961",
        beverloo,
        quick=False,
        note=GRAINS,
    )
}
