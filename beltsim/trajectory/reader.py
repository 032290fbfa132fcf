"""Reads a trajectory back: a sequence of frames, also of a run that goes on or was killed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

import numpy as np

from beltsim.trajectory.layout import (
    FIELDS,
    LAYOUT_VERSION,
    PARTICLES,
    PROPERTIES,
    Contents,
    Frame,
    PartDescription,
    TrajectoryError,
    escaped,
    property_field,
)

if TYPE_CHECKING:
    import h5py


def read(path: str | Path) -> Trajectory:
    """Open a trajectory; raises `TrajectoryError` if the file is none, OSError if it is not there."""
    if not Path(path).is_file():
        raise FileNotFoundError(2, "no such trajectory", str(path))
    file = _opened(path)
    found = file["beltsim"].attrs.get("layout") if "beltsim" in file else None
    if found != LAYOUT_VERSION:
        file.close()
        what = "an HDF5 file without beltsim's layout number" if found is None else f"layout {found}"
        raise TrajectoryError(f"{path}: found {what}, expected layout {LAYOUT_VERSION}")
    return Trajectory(file)


def _opened(path: str | Path) -> h5py.File:
    import h5py

    try:
        return h5py.File(path, "r")
    except OSError:
        # HDF5 wants one locking mode of all who open a file in one process: our writer opens it without locks.
        try:
            return h5py.File(path, "r", locking=False)
        except OSError as error:
            raise TrajectoryError(f"{path}: found no HDF5 file, expected a trajectory ({error})") from None


class Trajectory:
    """Frames of an open file: `len(t)`, `t[k]`, `t[2:5]`, iteration; a context manager.

    Counts the frames that were whole when the file was opened; open it again to see later ones.
    """

    def __init__(self, file: h5py.File) -> None:
        self._file = file
        self._frames = len(file["particles/all/position/time"])
        self.contents = _contents(file)

    def __len__(self) -> int:
        return self._frames

    def __getitem__(self, index: int | slice) -> Frame | list[Frame]:
        if isinstance(index, slice):
            return [self._frame(t) for t in range(self._frames)[index]]
        return self._frame(range(self._frames)[index])

    def __iter__(self) -> Iterator[Frame]:
        return (self._frame(t) for t in range(self._frames))

    def __enter__(self) -> Trajectory:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    @property
    def times(self) -> np.ndarray:
        """(T,) [s]."""
        return self._file["particles/all/position/time"][: self._frames]

    @property
    def steps(self) -> np.ndarray:
        """(T,) int64 step counts."""
        return self._file["particles/all/position/step"][: self._frames]

    def observable(self, name: str) -> np.ndarray:
        """(T,) or (T, columns): one observable over the whole run."""
        return self._file["observables"][escaped(name)]["value"][: self._frames]

    @property
    def case_text(self) -> bytes:
        """The INP text of the run."""
        return self._file["parameters/case"][()].tobytes()

    @property
    def provenance(self) -> dict:
        """What made the file."""
        import orjson

        return orjson.loads(self._file["parameters/provenance"][()])

    def _frame(self, t: int) -> Frame:
        file = self._file
        n = int(file["beltsim/active"][t])
        particles = file["particles/all"]
        properties = {
            property_field(name): _per_particle(particles, name, t, n) for name in ("id", *PROPERTIES)
        }
        return Frame(
            step=int(particles["position/step"][t]),
            time=float(particles["position/time"][t]),
            **properties,
            **{name: _per_particle(particles, name, t, n) for name in PARTICLES},
            bonds={name: dataset[t] for name, dataset in file.get("beltsim/bonds", {}).items()},
            parts=_parts(file, self.contents, t),
            observables={unquote(name): one["value"][t] for name, one in file["observables"].items()},
        )


def _per_particle(particles: h5py.Group, name: str, t: int, n: int) -> np.ndarray | None:
    """Rows of the n active particles, from the frame's data or the whole run's; None if it is not there."""
    if f"{name}/value" in particles:
        return particles[name]["value"][t, :n]
    return particles[name][:n] if name in particles else None


def _parts(file: h5py.File, contents: Contents, t: int) -> dict[str, dict[str, np.ndarray]]:
    rows = {quantity: dataset[t] for quantity, dataset in file.get("beltsim/parts", {}).items()}
    return {
        part.name: {quantity: values[p] for quantity, values in rows.items()}
        for p, part in enumerate(contents.parts)
    }


def _contents(file: h5py.File) -> Contents:
    particles = file["particles/all"]
    value = particles["position/value"]
    texts = {key: tuple(texts.asstr()[()]) for key, texts in file["beltsim/species"].items()}
    lines = file["VTKHDF/Lines/Connectivity"][()].reshape(-1, 2)
    written = {*particles, *file.get("beltsim/bonds", {})}
    constant = [
        name for name in ("id", *PROPERTIES) if name in particles and f"{name}/value" not in particles
    ]
    return Contents(
        slots=value.shape[1],
        species=texts["name"],
        shapes=texts["shape"],
        colors=texts["color"],
        dynamic="id/value" in particles,
        **{property_field(name): particles[name][()] for name in constant},
        bonds=lines if len(lines) else None,
        parts=_descriptions(file["parts"]),
        fields=frozenset(key for key, names in FIELDS.items() if written.issuperset(names)),
        observables=tuple(_observable(unquote(name), group) for name, group in file["observables"].items()),
        double=value.dtype == np.float64,
        compress=value.compression is not None,
    )


def _descriptions(parts: h5py.Group) -> tuple[PartDescription, ...]:
    """The parts in the order of their rows in /beltsim/parts, not of their names."""
    in_order = sorted(parts.items(), key=lambda item: item[1].attrs["row"])
    return tuple(_part(unquote(name), group) for name, group in in_order)


def _part(name: str, group: h5py.Group) -> PartDescription:
    attributes = group.attrs
    sizes = {name: float(size) for name, size in group["sizes"].attrs.items()}
    mesh = {key: group[key][()] for key in ("vertices", "faces") if key in group}
    return PartDescription(name, attributes["shape"], attributes["class"], sizes, attributes["color"], **mesh)


def _observable(name: str, element: h5py.Group) -> tuple[str, str, int]:
    dataset = element["value"]
    return name, dataset.attrs["unit"], 1 if dataset.ndim == 1 else dataset.shape[1]
