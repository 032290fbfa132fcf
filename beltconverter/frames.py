"""Local axes of a belt's nodes, the way it runs and the side that carries."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .piece import Grid
from .recover import extent


class Pose(NamedTuple):
    """How the user wants the belt to lie.

    up : (3,) direction of "up"; direction : (3,) wanted running direction where the belt is highest, None for the
    axis along which it is longest; longitudinal : "long", "short" or None, which sides of an open belt run along;
    flip_belts, reverse_belts : numbers, from 1, of those belts of several that are turned once more.
    """

    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    direction: tuple[float, float, float] | None = None
    longitudinal: str | None = None
    flip: bool = False
    reverse: bool = False
    flip_belts: tuple[int, ...] = ()
    reverse_belts: tuple[int, ...] = ()

    def of_belt(self, number: int) -> Pose:
        """The pose of one belt of a file."""
        flip, reverse = (
            self.flip != (number in self.flip_belts),
            self.reverse != (number in self.reverse_belts),
        )
        return self._replace(flip=flip, reverse=reverse)


def before_and_after(values: np.ndarray, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Values (R, C, ...) of the previous and the next row; the ends of an open belt repeat themselves.

    Across the seam of a Moebius belt the columns are reversed.
    """
    first, last = values[:1], values[-1:]
    if kind == "moebius":
        first, last = first[:, ::-1], last[:, ::-1]
    if kind == "open":
        first, last = last, first
    return np.concatenate([last, values[:-1]]), np.concatenate([values[1:], first])


def tangents(points: np.ndarray, kind: str) -> np.ndarray:
    """Unit tangents (R, C, 3) along axis 0, second order on uneven spacing, one-sided at the ends."""
    before, after = before_and_after(points, kind)
    back, ahead = points - before, after - points
    behind, beyond = np.linalg.norm(back, axis=2, keepdims=True), np.linalg.norm(ahead, axis=2, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        sums = np.where(behind * beyond > 0, behind / beyond * ahead + beyond / behind * back, back + ahead)
    return sums / np.linalg.norm(sums, axis=2, keepdims=True)


def frames(grid: Grid) -> np.ndarray:
    """Rotation matrices (R, C, 3, 3), body to world: columns e1 along, e2 across, e3 on the carrying side."""
    along = tangents(grid.points, grid.kind)
    across = tangents(grid.points.swapaxes(0, 1), "open").swapaxes(0, 1)
    normal = np.cross(along, across)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    return np.stack([along, np.cross(normal, along), normal], axis=-1)


def quaternions(rotation: np.ndarray) -> np.ndarray:
    """Unit quaternions (R, C, 4), w first, continuous along rows and columns; the first has w >= 0."""
    quaternion = _shepperd(rotation)
    quaternion[0] = _continuous(quaternion[0][:, None])[:, 0]
    if quaternion[0, 0, 0] < 0:
        quaternion[0] = -quaternion[0]
    return _continuous(quaternion) + 0.0


def _continuous(quaternion: np.ndarray) -> np.ndarray:
    dots = np.sum(quaternion[1:] * quaternion[:-1], axis=2)
    signs = np.cumprod(np.where(dots < 0, -1.0, 1.0), axis=0)
    return np.concatenate([quaternion[:1], quaternion[1:] * signs[..., None]])


def _shepperd(rotation: np.ndarray) -> np.ndarray:
    """Quaternions (..., 4) of rotation matrices (..., 3, 3) by the largest of the four diagonal sums."""
    r = rotation
    diagonal = np.stack([r[..., 0, 0], r[..., 1, 1], r[..., 2, 2]], axis=-1)
    trace = diagonal.sum(axis=-1)
    squares = np.concatenate(
        [(1 + trace)[..., None], 1 + 2 * diagonal - trace[..., None]], axis=-1
    )  # 4 q_k^2
    skew = np.stack(
        [r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]], axis=-1
    )
    products = np.empty((*r.shape[:-2], 4, 4))  # 4 q_a q_b
    products[..., 0, 0] = squares[..., 0]
    products[..., 0, 1:] = products[..., 1:, 0] = skew
    products[..., 1:, 1:] = r + r.swapaxes(-1, -2)
    for k in range(1, 4):
        products[..., k, k] = squares[..., k]
    largest = np.argmax(squares, axis=-1)
    quaternion = np.take_along_axis(products, largest[..., None, None], axis=-2)[..., 0, :]
    return quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True)


def oriented(grid: Grid, pose: Pose, warnings: list[str]) -> Grid:
    """The grid with its rows in running direction and its columns so that local z is on the carrying side."""
    points = grid.points
    if grid.kind == "open" and _runs_across(points, pose, warnings):
        points = points.swapaxes(0, 1)
    if _runs_backwards(Grid(points, grid.kind), pose) != pose.reverse:
        points = points[::-1]
    if _carries_below(Grid(points, grid.kind), pose, warnings) != pose.flip:
        points = points[:, ::-1]
    return Grid(np.ascontiguousarray(points), grid.kind)


def _runs_across(points: np.ndarray, pose: Pose, warnings: list[str]) -> bool:
    """Whether an open belt runs along the grid's second axis."""
    along, across = extent(points, 0), extent(points, 1)
    if pose.longitudinal:
        return (across > along) == (pose.longitudinal == "long")
    if pose.direction is not None:
        ends = [np.mean(points[-1] - points[0], axis=0), np.mean(points[:, -1] - points[:, 0], axis=0)]
        one, other = (abs(np.dot(end, pose.direction)) / np.linalg.norm(end) for end in ends)
        return bool(other > one)
    if abs(along - across) <= 1e-3 * along:
        warnings.append(
            "the open belt is as long as wide: --direction or --longitudinal says which way it runs"
        )
        return False
    return across > along


def _runs_backwards(grid: Grid, pose: Pose) -> bool:
    wanted = np.array(pose.direction if pose.direction is not None else (0.0, 0.0, 0.0))
    if pose.direction is None:
        spread = np.ptp(grid.points.reshape(-1, 3), axis=0)
        wanted[int(np.argmax(np.where(np.abs(_unit(pose.up)) > 0.9, -1.0, spread)))] = 1.0
    if grid.kind == "open":
        running = np.mean(grid.points[-1] - grid.points[0], axis=0)
    else:
        running = tangents(grid.points, grid.kind)[highest_row(grid.points, pose)].mean(axis=0)
    return bool(np.dot(running, wanted) < 0)


def highest_row(points: np.ndarray, pose: Pose) -> int:
    """The row (from 0) of a grid (R, C, 3) that lies highest, the first of equals."""
    return int(np.argmax(np.mean(points @ _unit(pose.up), axis=1)))


def _unit(vector: tuple[float, float, float]) -> np.ndarray:
    return np.array(vector) / np.linalg.norm(vector)


def _carries_below(grid: Grid, pose: Pose, warnings: list[str]) -> bool:
    """Whether local z points to the side that does not carry, with the columns as they are.

    An endless belt carries outside. Local z points out of the loop if the transverse axis agrees with the vector
    area of the loop. Only the middle column is asked: over all columns a pipe belt, whose edges close, would vote
    the wrong way.
    """
    axes = frames(grid)
    if grid.kind != "endless":
        shown = (axes[..., 2] @ _unit(pose.up))[: 1 if grid.kind == "moebius" else None]
        if grid.kind == "moebius":
            warnings.append(
                "a Moebius belt has one side only: its first row decides which way up its particles are"
            )
        elif abs(np.mean(np.sign(shown))) < 0.2:
            warnings.append(
                "about as much of the belt faces up as down: check which side carries (--up, --flip)"
            )
        return bool(np.mean(np.sign(shown)) < 0)
    middle = grid.points.shape[1] // 2
    loop = grid.points[:, middle] - grid.points[:, middle].mean(axis=0)
    after = np.roll(loop, -1, axis=0)
    area = np.cross(loop, after).sum(axis=0) / 2
    girth = np.linalg.norm(after - loop, axis=1).sum()
    if np.linalg.norm(area) < 1e-3 * girth**2 / (4 * np.pi):
        warnings.append("the loop encloses no area to speak of: check which side carries (--flip)")
    return bool(np.mean(axes[:, middle, :, 1] @ area) < 0)


def angular_velocities(grid: Grid, axes: np.ndarray, speed: float) -> np.ndarray:
    """Angular velocities (R, C, 3), rad/s, of particles that run along the belt at `speed` m/s.

    omega = V log(R_next R_before^T) / (s_next - s_before): V/R on a pulley, and the twist of a turnover.
    """
    before, after = before_and_after(axes, grid.kind)
    if grid.kind == "moebius":
        turn = np.diag([1.0, -1.0, -1.0])  # across the seam the neighbour's y and z axes point the other way
        before[0], after[-1] = before[0] @ turn, after[-1] @ turn
    previous, following = before_and_after(grid.points, grid.kind)
    way = np.linalg.norm(grid.points - previous, axis=2) + np.linalg.norm(following - grid.points, axis=2)
    return speed * _rotation_vectors(after @ before.swapaxes(-1, -2)) / way[..., None]


def _rotation_vectors(rotation: np.ndarray) -> np.ndarray:
    quaternion = _shepperd(rotation)
    quaternion = np.where(quaternion[..., :1] < 0, -quaternion, quaternion)
    sine = np.linalg.norm(quaternion[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, quaternion[..., :1])
    return quaternion[..., 1:] * np.where(sine > 1e-12, angle / np.where(sine > 0, sine, 1.0), 2.0)
