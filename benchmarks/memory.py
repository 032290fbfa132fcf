"""What memory gives to one core: how long a line takes from sets of some sizes, and how fast rows are changed.

    python benchmarks/memory.py

A chain of lines in random order shows which caches a process really has: those that a virtual machine reports may be
shared with others. Rows that are changed side by side show what an array for each component costs, and blocks of
8 particles what a layout packed by particle would give.
"""

from __future__ import annotations

from functools import partial

import numba
import numpy as np
from machine import best_of

ROWS = 48
PARTICLES = 1 << 20
LINE = 8  # doubles


@numba.njit
def follow(following, steps):
    """The place after some steps along a chain."""
    place = 0
    for _ in range(steps):
        place = following[place]
    return place


@numba.njit
def change_rows(rows):
    """Change all rows, one line of each at a time."""
    for begin in range(0, rows.shape[1], LINE):
        for row in range(rows.shape[0]):
            for n in range(begin, begin + LINE):
                rows[row, n] *= 1.0000001


@numba.njit
def change_blocks(blocks):
    """The same where the lines of a few particles stand together."""
    for block in range(blocks.shape[0]):
        for row in range(blocks.shape[1]):
            for n in range(blocks.shape[2]):
                blocks[block, row, n] *= 1.0000001


def latency(size: int, rng) -> float:
    """Nanoseconds for one line out of `size` bytes of them."""
    lines = size // (8 * LINE)
    order = rng.permutation(lines)
    following = np.zeros(lines * LINE, np.int64)
    following[order * LINE] = np.roll(order, -1) * LINE
    steps = min(4 * lines, 2_000_000)
    return 1e9 * best_of(partial(follow, following, steps), 4) / steps


def main() -> None:
    rng = np.random.default_rng(1)
    for mebibytes in (0.25, 0.5, 1, 2, 4, 8, 16, 32, 64, 256):
        print(f"a line out of {mebibytes:6g} MiB  {latency(int(mebibytes * 2**20), rng):6.1f} ns")
    for count in (8, 16, 32, ROWS):
        rows = np.ones((count, PARTICLES))
        print(
            f"{count:2} rows side by side   {2e-9 * rows.nbytes / best_of(partial(change_rows, rows), 4):5.0f} GB/s"
        )
    blocks = np.ones((PARTICLES // LINE, ROWS, LINE))
    print(
        f"{ROWS} rows packed by 8   {2e-9 * blocks.nbytes / best_of(partial(change_blocks, blocks), 4):5.0f} GB/s"
    )


if __name__ == "__main__":
    main()
