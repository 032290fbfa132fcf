"""Speed of reading SAT: seconds from bytes to rollers over the size of the file, and the growth from size to size.

Usage: python benchmarks/sat_speed.py [LARGEST_MB]   (default 20; 100 takes about a minute)
The files are conveyors: rollers with journals, tubes, pulleys and beams, in ACIS 7.0 and 22.0 text.
"""

from __future__ import annotations

import resource
import sys
from pathlib import Path
from time import perf_counter

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from sat_solids import conveyor, write_sat

from partconverter import sat
from partconverter.finding import find_rollers
from partconverter.topology import read_model

SETS_PER_MB = 48


def measure(megabytes: float, version: int) -> tuple[float, float, float, float, int]:
    """Size in MB, seconds to split, to link and in all, and the number of rollers."""
    bodies, truth = conveyor(max(1, round(SETS_PER_MB * megabytes)))
    data = write_sat(bodies, version).encode()
    start = perf_counter()
    text = sat.read(data)
    split = perf_counter()
    read_model(text)
    linked = perf_counter()
    del text
    begun = perf_counter()
    found = find_rollers(data, "conveyor.sat")
    seconds = perf_counter() - begun
    assert len(found.rollers) == len(truth)
    return len(data) / 1e6, split - start, linked - split, seconds, len(truth)


def main() -> None:
    """Print one line for each size and version."""
    largest = float(sys.argv[1]) if len(sys.argv) > 1 else 20.0
    sizes = [size for size in (1.0, 2.5, 5.0, 10.0, 20.0, 50.0, 100.0) if size <= largest]
    print(
        f"{'version':>7} {'MB':>6} {'rollers':>8} {'split s':>8} {'link s':>7} {'all s':>7} {'s/MB':>6} {'peak GB':>8}"
    )
    for version in (700, 2200):
        rates = []
        for size in sizes:
            megabytes, split, link, seconds, rollers = measure(size, version)
            rates.append(seconds / megabytes)
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
            print(
                f"{version:7} {megabytes:6.1f} {rollers:8} {split:8.2f} {link:7.2f} {seconds:7.2f} "
                f"{rates[-1]:6.3f} {peak:8.2f}"
            )
        print(
            f"{version:7} growth of s/MB from the smallest to the largest: {rates[-1] / rates[0]:.2f} (1 = linear)"
        )


if __name__ == "__main__":
    main()
