"""How the energy book of the sample conveyor closes: the residual in every frame over the largest change of a term.

    python benchmarks/energy_book.py

runs the sample with the book, a frame each 5 ms, and prints the worst shares; 1e-3 is wanted in every frame.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import conveyor
import numpy as np

from beltsim import trajectory
from beltsim.energy import OBSERVABLES
from beltsim.run import run
from beltsim.scene import build

INTERVAL = 0.005  # s
WANTED = 1e-3
SPANS = ((0.0, 0.2), (0.2, 1.0), (1.0, np.inf))  # s


def shares(frames) -> np.ndarray:
    """Residual of each frame over the largest change that any term of the book has shown so far."""
    residual = np.abs(frames.observable("energy_residual").ravel())
    terms = [frames.observable(name).ravel() for name, _, _ in OBSERVABLES if name != "energy_residual"]
    changes = np.max([np.abs(term - term[0]) for term in terms], axis=0)
    largest = np.maximum.accumulate(changes)
    return np.divide(residual, largest, out=np.zeros_like(residual), where=largest > 0.0)


def main() -> None:
    """Run and print."""
    deck = conveyor.case()
    deck.blocks("OUTPUT")[0].parameters |= {"INTERVAL": INTERVAL, "FIELDS": ("ENERGY",)}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "book.h5"
        run(deck, build(deck), str(path))
        with trajectory.read(path) as frames:
            time, share = np.array(frames.times), shares(frames)
            residual = frames.observable("energy_residual").ravel()[-1]
    for low, high in SPANS:
        inside = (time >= low) & (time < high)
        print(
            f"from {low:g} s to {min(high, time[-1]):g} s: worst share {share[inside].max():.1e}, wanted {WANTED:g}"
        )
    print(f"at the end: residual {residual:.3g} J, {share[-1]:.1e} of the largest term")


if __name__ == "__main__":
    main()
