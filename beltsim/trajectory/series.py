"""Datasets that grow by one row each frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from beltsim.trajectory.layout import Frame, TrajectoryError, empty_value

if TYPE_CHECKING:
    import h5py


@dataclass(frozen=True)
class Series:
    """A growing dataset (T, ...) and where its rows come from."""

    dataset: h5py.Dataset
    take: Callable[[Frame], Any]
    per_particle: bool
    """Rows are (N, ...), of which the frame brings the first n; the other slots keep the fill value."""

    def row(self, frame: Frame) -> np.ndarray:
        """Values of one frame; raises `TrajectoryError` if they are missing or of the wrong shape."""
        values = self.take(frame)
        shape = self.dataset.shape[1:]
        expected = (frame.active, *shape[1:]) if self.per_particle else shape
        check_shape(self.dataset.name, values, expected)
        return np.asarray(values, self.dataset.dtype)

    def write(self, t: int, row: np.ndarray) -> None:
        """Write row t."""
        self.dataset.resize(t + 1, axis=0)
        if self.per_particle:
            self.dataset[t, : len(row)] = row
        else:
            self.dataset[t] = row


def check_shape(name: str, values: Any, expected: tuple[int, ...]) -> None:
    """Raise `TrajectoryError` if there are no values or if their shape is another."""
    if values is None or np.shape(values) != expected:
        found = "nothing" if values is None else f"shape {np.shape(values)}"
        raise TrajectoryError(f"{name}: found {found}, expected shape {expected}")


def grow(
    group: h5py.Group,
    name: str,
    shape: tuple[int, ...],
    dtype: str,
    take: Callable[[Frame], Any],
    *,
    per_particle: bool = False,
    compress: bool = False,
) -> Series:
    """A new empty dataset (0, *shape) that can grow. gzip is the one filter that VTK reads too."""
    packing = {"compression": "gzip", "compression_opts": 1, "shuffle": True} if compress else {}
    dataset = group.create_dataset(
        name,
        shape=(0, *shape),
        maxshape=(None, *shape),
        chunks=_chunk_shape(shape, compress),
        dtype=dtype,
        fillvalue=empty_value(dtype) if per_particle else None,
        **packing,
    )
    return Series(dataset, take, per_particle)


def _chunk_shape(row: tuple[int, ...], compress: bool) -> tuple[int, ...]:
    """One frame a chunk, at most 65536 rows of it; 64 frames where one is tiny (times, parts).

    Never several frames if compressed: a chunk that is written again then moves, and a kill meanwhile loses it.
    """
    if not compress and (not row or row[0] < 16):
        return (64, *row)
    return (1, min(row[0], 65536), *row[1:])
