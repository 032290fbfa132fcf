"""Cost of writing trajectory frames: milliseconds and bytes a frame, and gzip against plain.

Usage: python benchmarks/trajectory.py [particles ...]
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from beltsim.trajectory import Contents, Frame, TrajectoryWriter


def contents_of(particles: int, compress: bool) -> Contents:
    """A belt strip of that many particles, with velocities, orientations and bond forces."""
    bonds = np.stack([np.arange(particles - 1), np.arange(1, particles)], axis=1)
    fields = frozenset({"VELOCITY", "ORIENTATION", "BOND FORCE"})
    return Contents(slots=particles, species=("fibre",), bonds=bonds, fields=fields, compress=compress)


def frame_of(contents: Contents, t: int) -> Frame:
    """A belt that waves: smooth fields, as a run has them, not noise that no filter can shrink."""
    x = np.linspace(0.0, 10.0, contents.slots)
    wave = np.sin(x - 0.1 * t)
    return Frame(
        step=t,
        time=0.02 * t,
        position=np.stack([x, np.zeros_like(x), wave], axis=1),
        velocity=np.stack([np.full_like(x, 2.0), np.zeros_like(x), -0.1 * wave], axis=1),
        orientation=np.stack([np.cos(wave), np.zeros_like(x), np.sin(wave), np.zeros_like(x)], axis=1),
        bonds={
            "axial_force": wave[1:],
            "shear_force": np.abs(wave[1:]),
            "broken": np.zeros(contents.n_bonds, bool),
        },
    )


def seconds_and_bytes(particles: int, compress: bool, frames: int) -> tuple[float, float]:
    """Wall time and file size per frame."""
    contents = contents_of(particles, compress)
    moments = [frame_of(contents, t) for t in range(4)]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.h5"
        with TrajectoryWriter(path, contents, planned_frames=frames) as writer:
            start = time.perf_counter()
            for t in range(frames):
                writer.append(moments[t % 4])
            elapsed = time.perf_counter() - start
        return elapsed / frames, path.stat().st_size / frames


def main() -> None:
    """Print one line per scene."""
    for particles in [int(text) for text in sys.argv[1:]] or [300, 30_000, 300_000]:
        frames = max(5, min(200, 3_000_000 // particles))
        plain, plain_size = seconds_and_bytes(particles, False, frames)
        packed, packed_size = seconds_and_bytes(particles, True, frames)
        print(
            f"{particles:7d} particles: {1e3 * plain:6.1f} ms and {plain_size / 1e6:6.2f} MB a frame; "
            f"gzip: {packed / plain:4.1f} x the time, {packed_size / plain_size:4.2f} x the size"
        )


if __name__ == "__main__":
    main()
