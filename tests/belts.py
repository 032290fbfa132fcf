"""Made belts whose rows and columns are known: geometry, triangulation and the spoiling of files."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Made(NamedTuple):
    """A belt grid (R, C, 3) as it was made, and its kind: "open", "endless" or "moebius"."""

    points: np.ndarray
    kind: str


def flat(rows: int, columns: int, pitch: float = 0.05, width: float = 0.05, skew: float = 0.0) -> Made:
    """Open belt in the plane z = 0 that runs along x; skew in rad shears its rows."""
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    x = i * pitch + j * width * np.tan(skew)
    return Made(np.stack([x, j * width, 0.0 * x], axis=-1), "open")


def racetrack(rows: int, columns: int, *, radius=0.4, straight=1.5, width=0.5, **shape) -> Made:
    """Endless belt round two pulleys, axes along y, rows from s = 0; `shape` goes to `surface`."""
    length = 2 * straight + 2 * np.pi * radius
    return strip(
        np.arange(rows) / rows * length, columns, radius=radius, straight=straight, width=width, **shape
    )


def strip(
    s, columns, *, radius=0.4, straight=1.5, width=0.5, skew=0.0, chevron=False, kind="endless", **shape
) -> Made:
    """Belt with rows at arc lengths s (R,) of the racetrack; `skew` in rad shifts the rows along the belt."""
    y = np.linspace(-width / 2, width / 2, columns)
    shift = np.tan(skew) * (np.abs(y) if chevron else y)
    along = s[:, None] + shift
    return Made(
        surface(
            along, np.broadcast_to(y, along.shape), radius=radius, straight=straight, width=width, **shape
        ),
        kind,
    )


def surface(s, y, *, radius, straight, width, trough=0.0, pipe=0.0, turnover=False) -> np.ndarray:
    """Points at arc length s and transverse place y: troughed or rolled on the upper strand, turned on the lower.

    trough : wing angle, rad, of a three-roll trough; pipe : turn of the rolled section, rad (2 pi closes it);
    turnover : the lower strand is turned by 180 degrees and back.
    """
    length = 2 * straight + 2 * np.pi * radius
    t = np.mod(s, length)
    foot, outward = _path(t, radius, straight)
    upper = _bump(t, 0.0, straight)
    angle, fold = trough * upper, width / 6
    wing = np.maximum(np.abs(y) - fold, 0.0)
    u, v = np.sign(y) * (np.minimum(np.abs(y), fold) + wing * np.cos(angle)), wing * np.sin(angle)
    if pipe:
        bend = np.maximum(pipe * upper / width, 1e-9)
        u, v = np.sin(bend * y) / bend, 2 * np.sin(bend * y / 2) ** 2 / bend
    turn = np.pi * _bump(t, straight + np.pi * radius, straight) if turnover else 0.0 * t
    u, v = u * np.cos(turn) - v * np.sin(turn), u * np.sin(turn) + v * np.cos(turn)
    return foot + u[..., None] * np.array([0.0, 1.0, 0.0]) + v[..., None] * outward


def _bump(t, start, length):
    """0 outside [start, start + length], 1 in its middle fifth, smooth between."""
    x = np.clip(np.minimum(t - start, start + length - t) / (0.4 * length), 0.0, 1.0)
    return x * x * (3 - 2 * x)


def _path(t, radius, straight):
    """Point and outward normal of the racetrack: upper strand +x first, then the pulley at x = straight."""
    half = np.pi * radius
    on_right = np.clip(t - straight, 0.0, half) / radius
    on_left = np.clip(t - 2 * straight - half, 0.0, half) / radius
    angle = on_right + on_left  # turned clockwise, seen against y
    x = np.minimum(t, straight) - np.clip(t - straight - half, 0.0, straight)
    outward = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=-1)
    centre = np.stack([x, 0 * x, 0 * x], axis=-1)
    return centre + radius * outward, outward


def moebius(rows: int, columns: int, radius: float = 0.5, width: float = 0.3) -> Made:
    """Ring with half a twist: row R is row 0 with its columns reversed."""
    a = np.arange(rows)[:, None] / rows * 2 * np.pi
    y = np.linspace(-width / 2, width / 2, columns)
    r = radius + y * np.cos(a / 2)
    return Made(np.stack([r * np.cos(a), r * np.sin(a), y * np.sin(a / 2)], axis=-1), "moebius")


def facets_of(made: Made, diagonals="random", rng=None) -> np.ndarray:
    """Node triples (F, 3) into the flattened grid, two facets of a cell side by side.

    diagonals : "uniform", "other", "alternating" or "random".
    """
    rows, columns = made.points.shape[:2]
    node = np.arange(rows * columns).reshape(rows, columns)
    if made.kind != "open":
        node = np.concatenate([node, node[:1, ::-1] if made.kind == "moebius" else node[:1]])
    a, b, c, d = node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]
    i, j = np.indices(a.shape)
    rng = rng or np.random.default_rng(0)
    pick = {
        "uniform": a >= 0,
        "other": a < 0,
        "alternating": (i + j) % 2 == 0,
        "random": rng.random(a.shape) < 0.5,
    }
    one = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=-2)
    two = np.stack([np.stack([a, b, d], -1), np.stack([b, c, d], -1)], axis=-2)
    return np.where(pick[diagonals][..., None, None], one, two).reshape(-1, 3)


def spoiled(facets: np.ndarray, rng, *, shuffled=True, winding=True) -> np.ndarray:
    """The facets in random order, random rotation and random winding."""
    facets = facets[rng.permutation(len(facets))] if shuffled else facets
    turns = rng.integers(0, 3, len(facets))
    facets = np.take_along_axis(facets, (np.arange(3) + turns[:, None]) % 3, axis=1)
    flips = rng.random(len(facets)) < (0.5 if winding else 0.0)
    return np.where(flips[:, None], facets[:, ::-1], facets)


def corners_of(made: Made, facets: np.ndarray | None = None) -> np.ndarray:
    """Corner points (F, 3, 3)."""
    return made.points.reshape(-1, 3)[facets_of(made) if facets is None else facets]


def ascii_stl(corners: np.ndarray, digits: int = 9, name: str = "belt") -> bytes:
    """ASCII STL with that many digits."""
    lines = [f"solid {name}"]
    for triangle in corners.tolist():
        lines += ["  facet normal 0 0 1", "    outer loop"]
        lines += [f"      vertex {x:.{digits}g} {y:.{digits}g} {z:.{digits}g}" for x, y, z in triangle]
        lines += ["    endloop", "  endfacet"]
    return ("\n".join([*lines, f"endsolid {name}"]) + "\n").encode()


def binary_stl(corners: np.ndarray, header: bytes = b"solid made by a CAD system") -> bytes:
    """Binary STL; its header begins with "solid", as that of many writers does."""
    record = np.zeros(
        len(corners), np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    )
    record["corners"] = corners
    return header.ljust(80, b" ") + np.uint32(len(corners)).tobytes() + record.tobytes()


def is_same_grid(found: np.ndarray, kind: str, made: Made, tolerance: float) -> bool:
    """Whether `found` (R, C, 3) is the made grid up to where it starts, which way it runs and which side is up."""
    if kind != made.kind:
        return False
    candidates = [found] if kind != "open" else [found, found.swapaxes(0, 1)]
    return any(
        _matches(one[a, b], made, tolerance)
        for one in candidates
        if one.shape == made.points.shape
        for a, b in FLIPS
    )


FLIPS = [(slice(None, None, a), slice(None, None, b)) for a in (1, -1) for b in (1, -1)]


def _matches(found: np.ndarray, made: Made, tolerance: float) -> bool:
    rows = len(found)
    truth = made.points
    starts = [0]
    if made.kind != "open":
        truth = np.concatenate([truth, truth[:, ::-1] if made.kind == "moebius" else truth])
        starts = range(len(truth) - rows + 1)
    near = [k for k in starts if np.abs(truth[k, 0] - found[0, 0]).max() <= tolerance]
    return any(np.abs(truth[k : k + rows] - found).max() <= tolerance for k in near)


def solid_of(made: Made, thickness: float, rng=None, rounding=1) -> np.ndarray:
    """Corners (F, 3, 3) of the closed solid of an endless belt whose mid-surface is `made`, random diagonals.

    Its edges are flat, or half circles of `rounding` facets.
    """
    points = made.points
    along = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    across = np.gradient(points, axis=1)
    normal = np.cross(along, across)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    across /= np.linalg.norm(across, axis=2, keepdims=True)
    top, bottom = points + thickness / 2 * normal, points - thickness / 2 * normal
    rims = []
    for k, outward in ((-1, 1), (0, -1)):
        angle = np.linspace(0, np.pi, rounding + 1)[:, None]
        bulge = np.cos(angle) * normal[:, None, k] + outward * np.sin(angle) * across[:, None, k]
        rim = points[:, None, k] + thickness / 2 * bulge
        rim[:, 0], rim[:, -1] = top[:, k], bottom[:, k]
        rims.append(rim)
    rng = rng or np.random.default_rng(0)
    grids = [top, bottom[:, ::-1], rims[0], rims[1][:, ::-1]]
    return np.concatenate(
        [corners_of(m, facets_of(m, "random", rng)) for m in (Made(g, "endless") for g in grids)]
    )
