"""What finding near pairs costs: spheres of about one size and of 1:100, in the order of the solver and in none.

Usage: python benchmarks/near_pairs.py [particles ...]

Nanoseconds of CPU a particle and search, least of three; the search is linear if a column of the table is flat.
"""

import sys
import time

import numpy as np

from beltsim.solver.particle_pairs import particle_pairs
from beltsim.solver.state import Shapes

RADIUS = 0.01  # m, of spheres of one size
REPEATS = 3


def lattice(count, rng):
    """A face-centred lattice, 62 % full, shaken a little; radii spread by 10 %."""
    side = int(np.ceil((count / 4) ** (1 / 3)))
    cells = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    corners = np.array([(0, 0, 0), (0.5, 0.5, 0), (0.5, 0, 0.5), (0, 0.5, 0.5)])
    place = (2.0 * np.sqrt(2.0) * 1.06 * RADIUS * (cells + corners)).reshape(-1, 3)[:count]
    return place + 0.08 * RADIUS * rng.uniform(-1, 1, place.shape), RADIUS * rng.uniform(0.9, 1.1, count)


def gravel(count, rng):
    """Spheres of 1 to 100 mm at random, 40 % full; as many are larger than r as r^-2.5."""
    radius = 0.001 * (1.0 - rng.uniform(size=count) * (1.0 - 100.0**-2.5)) ** (-1.0 / 2.5)
    side = np.cbrt(4.0 / 3.0 * np.pi * np.sum(radius**3) / 0.4)
    return rng.uniform(0.0, side, (count, 3)), radius


def by_cell(place, radius):
    """The order that the solver gives to spheres: by cells as wide as the largest pair, the longest side first."""
    column = np.floor(place / (2.0 * radius.max() + 0.25 * np.median(radius))).astype(np.int64)
    return np.lexsort(column.T[np.argsort(-np.ptp(place, axis=0), kind="stable")][::-1])


def search(place, radius):
    """Nanoseconds a particle, and pairs a particle."""
    count = radius.size
    position, everybody = np.ascontiguousarray(place.T), np.arange(count, dtype=np.int32)
    none = np.zeros(count, np.int32)
    shapes = Shapes(np.zeros((3, count)), radius, radius, none, none, np.ones((1, 1), bool))
    apart = np.zeros(count + 1, np.int64), none[:0]
    times = []
    for _ in range(REPEATS + 1):  # the first one compiles
        clock = time.process_time()
        start, _ = particle_pairs(position, shapes, everybody, None, 0.25 * np.median(radius), apart)
        times.append(time.process_time() - clock)
    return 1e9 * min(times) / count, start[-1] / count


def main():
    """The table."""
    counts = [int(given) for given in sys.argv[1:]] or [20_000, 80_000, 320_000, 1_000_000]
    print("| spheres | one size, sorted | no order | 1:100, sorted | no order | pairs of each |")
    print("|---|---|---|---|---|---|")
    for count in counts:
        cells, pairs = [], []
        for scene in (lattice, gravel):
            rng = np.random.default_rng(1)
            place, radius = scene(count, rng)
            for order in (by_cell(place, radius), rng.permutation(count)):
                each, listed = search(place[order], radius[order])
                cells.append(f"{each:.0f} ns")
            pairs.append(f"{listed:.2f}")
        print(f"| {count} | {' | '.join(cells)} | {', '.join(pairs)} |", flush=True)


if __name__ == "__main__":
    main()
