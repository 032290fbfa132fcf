"""The scenes that programs are compared on, in numbers only: no program's own words stand here.

S1 "strip"   a bonded belt alone, both short ends held, under gravity and set swinging
S2 "box"     a settled box of 20,000 spheres of sixteen sizes, Hertz-Mindlin with friction
S3 "load"    a bonded belt of spheres over five smooth idlers, 5,000 loose spheres on it

`as_deck.py` and `as_lammps.py` say a scene in the words of beltsim and of LAMMPS. The settled states of S2 and S3 are
made by beltsim itself, see `settled.py`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

GRAVITY = 9.81  # m/s2
TIME_STEP = 2.0e-5  # s, of every scene and every program
YOUNG, POISSON, FRICTION, RESTITUTION = 1.0e7, 0.3, 0.5, 0.5  # of whatever touches

PITCH, BELT_RADIUS, BELT_DENSITY = 0.05, 0.025, 1200.0  # m, m, kg/m3
BOND_YOUNG, BOND_RADIUS, BOND_DAMPING = 50.0e6, 0.01, 0.05  # Pa, m, share of critical

SIZE_CLASSES = 16
GRAIN = {"S2": (5.0e-3, 0.10, 2500.0), "S3": (0.025, 0.20, 2000.0)}  # mean radius m, spread, density kg/m3
BOX_SIDE, BOX_GRAINS = 0.25, 20_000
IDLERS, IDLER_RADIUS = (1.0, 3.0, 5.0, 7.0, 9.0), 0.10  # x m, m
LOAD_BELT, LOAD_GRAINS = (200, 20), 5_000

BELT, HELD, GRAINS = 0, 1, 2  # what a particle is: row of Scene.kind


@dataclass
class Scene:
    """A scene and the state it starts from; the belt's particles come first, rows along x, in grid order."""

    name: str
    kind: np.ndarray  # (n,) BELT, HELD or GRAINS
    radius: np.ndarray  # (n,) m
    position: np.ndarray  # (n, 3) m
    velocity: np.ndarray  # (n, 3) m/s
    spin: np.ndarray  # (n, 3) rad/s
    orientation: np.ndarray  # (n, 4) w, x, y, z
    grain_density: float = 0.0  # kg/m3
    rest: np.ndarray = field(
        default_factory=lambda: np.zeros((0, 3))
    )  # (belt, 3) m, where all bonds are free
    bonds: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    walls: list[tuple[str, float, int]] = field(
        default_factory=list
    )  # axis, place m, side of the solid -1 or 1
    idlers: tuple[float, ...] = ()  # x m, axes along y, below the belt
    width: float = 0.0  # m, of the belt

    @property
    def count(self) -> int:
        """Number of particles."""
        return self.radius.size


def bond_stiffness() -> dict[str, float]:
    """Stiffness of a bond of round section in N/m and N m, and its damping in N s/m and N m s."""
    area, inertia = math.pi * BOND_RADIUS**2, math.pi * BOND_RADIUS**4 / 4.0
    shear = BOND_YOUNG / (2.0 * (1.0 + POISSON))
    factor = 6.0 * (1.0 + POISSON) / (7.0 + 6.0 * POISSON)
    found = {
        "normal": BOND_YOUNG * area / PITCH,
        "shear": factor * shear * area / PITCH,
        "twist": shear * 2.0 * inertia / PITCH,
        "bend": BOND_YOUNG * inertia / PITCH,
    }
    mass = belt_mass()
    reduced = {"normal": mass / 2, "shear": mass / 2}
    for name, stiffness in list(found.items()):
        weight = reduced.get(name, 0.2 * mass * BELT_RADIUS**2)
        found[f"{name}_damping"] = 2.0 * BOND_DAMPING * math.sqrt(stiffness * weight)
    return found


def belt_mass() -> float:
    """Mass [kg] of a belt particle, a sphere's in every program."""
    return 4.0 / 3.0 * math.pi * BELT_RADIUS**3 * BELT_DENSITY


def grid(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places (n, 3), bonds (m, 2) and kinds (n,) of a flat belt whose first and last rows are held."""
    i, j = np.divmod(np.arange(rows * columns), columns)
    places = np.stack([i * PITCH, j * PITCH, np.zeros(i.size)], axis=1)
    number = np.arange(i.size).reshape(rows, columns)
    along = np.stack([number[:-1].ravel(), number[1:].ravel()], axis=1)
    across = np.stack([number[:, :-1].ravel(), number[:, 1:].ravel()], axis=1)
    kind = np.where((i == 0) | (i == rows - 1), HELD, BELT)
    return places, np.concatenate([along, across]), kind


def strip(size: int = 1) -> Scene:
    """S1: 400 x 40 particles times `size`, a square number; waves in all directions, so that every spring works."""
    scale = math.isqrt(size)
    places, bonds, kind = grid(400 * scale, 40 * scale)
    n = len(places)
    wave = 2.0 * np.pi / (12.0 * PITCH)
    x, y = places[:, 0], places[:, 1]
    velocity = np.stack(
        [0.2 * np.sin(wave * y), 0.2 * np.sin(wave * x), 0.5 * np.sin(wave * x) * np.cos(wave * y)], 1
    )
    velocity[kind == HELD] = 0.0
    return Scene(
        "S1",
        kind,
        np.full(n, BELT_RADIUS),
        places,
        velocity,
        np.zeros((n, 3)),
        upright(n),
        rest=places,
        bonds=bonds,
    )


def upright(n: int) -> np.ndarray:
    """Orientations (n, 4) that turn nothing."""
    return np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))


def grain_sizes(scene: str, count: int) -> np.ndarray:
    """Radii (count,) [m] of sixteen sizes in a random order."""
    mean, spread, _ = GRAIN[scene]
    chosen = np.random.default_rng(20251).integers(SIZE_CLASSES, size=count)
    return mean * (1.0 + spread * np.linspace(-1.0, 1.0, SIZE_CLASSES)[chosen])


def loose_layers(scene: str, count: int, low: tuple, high: tuple) -> np.ndarray:
    """Places (count, 3) of grains on a jittered lattice from `low` upwards, within `high` along x and y."""
    mean, spread, _ = GRAIN[scene]
    pitch = 2.04 * mean * (1.0 + spread)
    columns, rows = int((high[0] - low[0]) / pitch), int((high[1] - low[1]) / pitch)
    k = np.arange(count)
    jitter = np.random.default_rng(20252).uniform(-0.01, 0.01, (count, 2)) * mean
    x = low[0] + (k % columns + 0.5) * (high[0] - low[0]) / columns + jitter[:, 0]
    y = low[1] + (k // columns % rows + 0.5) * (high[1] - low[1]) / rows + jitter[:, 1]
    return np.stack([x, y, low[2] + (k // (columns * rows) + 0.6) * pitch], axis=1)


def loose_box() -> Scene:
    """S2 before it has settled."""
    radius = grain_sizes("S2", BOX_GRAINS)
    position = loose_layers("S2", BOX_GRAINS, (0.0, 0.0, 0.0), (BOX_SIDE, BOX_SIDE))
    return box_scene(position, np.zeros_like(position), np.zeros_like(position), radius, 1)


def box_scene(position, velocity, spin, radius, tiles: int) -> Scene:
    """S2: `tiles` x `tiles` copies of a state of the box side by side, walls around them all."""
    shift = [(i * BOX_SIDE, j * BOX_SIDE, 0.0) for i in range(tiles) for j in range(tiles)]
    copies = tiles * tiles
    position = np.concatenate([position + np.array(s) for s in shift])
    velocity, spin, radius = (
        np.tile(velocity, (copies, 1)),
        np.tile(spin, (copies, 1)),
        np.tile(radius, copies),
    )
    n, side = radius.size, tiles * BOX_SIDE
    walls = [("x", 0.0, -1), ("x", side, 1), ("y", 0.0, -1), ("y", side, 1), ("z", 0.0, -1)]
    return Scene(
        "S2", np.full(n, GRAINS), radius, position, velocity, spin, upright(n), GRAIN["S2"][2], walls=walls
    )


def loose_load() -> Scene:
    """S3 before the grains have fallen on the belt."""
    places, bonds, kind = grid(*LOAD_BELT)
    length, width = places[:, 0].max(), places[:, 1].max()
    radius = grain_sizes("S3", LOAD_GRAINS)
    grains = loose_layers(
        "S3", LOAD_GRAINS, (0.5, -0.5 * PITCH, BELT_RADIUS), (length - 0.5, width + 0.5 * PITCH)
    )
    n = len(places) + len(grains)
    return Scene(
        "S3",
        np.concatenate([kind, np.full(len(grains), GRAINS)]),
        np.concatenate([np.full(len(places), BELT_RADIUS), radius]),
        np.concatenate([places, grains]),
        np.zeros((n, 3)),
        np.zeros((n, 3)),
        upright(n),
        GRAIN["S3"][2],
        rest=places,
        bonds=bonds,
        walls=[("y", -0.5 * PITCH, -1), ("y", width + 0.5 * PITCH, 1)],
        idlers=IDLERS,
        width=width,
    )
