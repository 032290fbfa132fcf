"""Appends frames to a trajectory so that it can be read at any moment, also after a kill.

Order of every append: the payload, flush; VTK's count of frames, flush; step and time, flush. A frame counts when
it has its time, so no reader sees half a frame. The count may never be below the number of times: VTK then writes
beyond its buffer (measured: crashes on 12 files of 240 runs killed at random moments).
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from beltsim.trajectory import h5md, vtkhdf
from beltsim.trajectory.case_text import shortened
from beltsim.trajectory.layout import Contents, Frame, TrajectoryError

if TYPE_CHECKING:
    import h5py


class TrajectoryWriter:
    """Appends frames to a new trajectory file; a context manager.

    Parameters
    ----------
    path : the file's final name: a trajectory is read while it grows. An existing file is replaced.
    contents : what stays the same over the run
    planned_frames : how many frames the run will write. ParaView's view is laid out for these and a quarter
        more (at least 64), the slack of a resumed run or a last frame after a blow-up; beyond that `append`
        raises `TrajectoryError`
    case_text : the expanded INP text; beyond 10 MB its long data blocks are left out
    provenance : version, command line, packages, threads, seed, sha256 of every input: anything JSON can hold
    """

    def __init__(
        self,
        path: str | Path,
        contents: Contents,
        *,
        planned_frames: int,
        case_text: bytes = b"",
        provenance: dict | None = None,
    ) -> None:
        import h5py

        if contents.slots < 1:
            raise TrajectoryError(f"{path}: found no particles to write, expected at least one slot")
        self.contents = contents
        self.frames = 0
        self.capacity = planned_frames + max(64, planned_frames // 4)
        # HDF5 2.0 with libver="latest" writes what VTK cannot read; a lock would shut out readers of a run.
        self._file = h5py.File(path, "w", libver="earliest", locking=False)
        self._clock, self._payload = h5md.create(self._file, contents)
        self._steps = vtkhdf.create(self._file, contents, self.capacity)
        _write_parameters(self._file, case_text, provenance or {})
        self._file.flush()

    def __enter__(self) -> TrajectoryWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def append(self, frame: Frame) -> None:
        """Write one frame and flush it; if it does not fit, raise `TrajectoryError` and write nothing."""
        t = self.frames
        self._check(frame)
        rows = [series.row(frame) for series in self._payload]
        for series, row in zip(self._payload, rows):
            series.write(t, row)
        vtkhdf.append(self._file, self.contents, t, frame.active)
        self._file.flush()
        self._steps.attrs.modify("NSteps", np.int64(t + 1))
        self._file.flush()
        for series in self._clock:
            series.write(t, series.row(frame))
        self._file.flush()
        self.frames = t + 1

    def write_breaks(self, table: dict[str, np.ndarray]) -> None:
        """Write the bonds that broke, /beltsim/breaks/{time, step, bond, mode}, in the place of an earlier table.

        `bond` is the row of /connectivity/bonds, `mode` 1 for tension and 2 for shear.
        """
        self._file.pop("beltsim/breaks", None)
        for name, column in table.items():
            self._file[f"beltsim/breaks/{name}"] = column
        self._file.flush()

    def close(self) -> None:
        """Close the file; a second call does nothing."""
        self._file.close()

    def _check(self, frame: Frame) -> None:
        slots, n = self.contents.slots, frame.active
        if n > slots or (n != slots and not self.contents.dynamic):
            expected = f"at most {slots}" if self.contents.dynamic else str(slots)
            raise TrajectoryError(f"frame {self.frames}: found {n} particles, expected {expected}")
        if self.contents.n_bonds and n <= np.max(self.contents.bonds):
            raise TrajectoryError(f"frame {self.frames}: found {n} particles, expected all that are bonded")
        if self.frames >= self.capacity:
            raise TrajectoryError(
                f"frame {self.frames}: found no room, the file was planned for {self.capacity}"
            )


def _write_parameters(file: h5py.File, case_text: bytes, provenance: dict) -> None:
    import orjson

    group = file.create_group("parameters")
    text = np.frombuffer(shortened(case_text), "u1")
    group.create_dataset("case", data=text, compression="gzip" if text.size else None)
    options = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_INDENT_2
    group["provenance"] = orjson.dumps(provenance, option=options, default=str).decode()
