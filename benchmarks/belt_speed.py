"""CPU seconds and memory of `beltconvert` from an ASCII STL to INP, reading and writing included, on one core.

The belt is endless, its diagonals are random and its facets shuffled. The last column shows that the work grows
linearly.

    python benchmarks/belt_speed.py [most facets, default 2000000]
"""

import os
import sys
import tempfile
from pathlib import Path

import numpy as np

COLUMNS = 51


def belt_stl(facets: int) -> bytes:
    """A troughless endless belt round two pulleys as a mesher writes it: nine digits, one text for each node."""
    rows = facets // (2 * (COLUMNS - 1))
    node = np.arange(rows * COLUMNS).reshape(rows, COLUMNS)
    angle = np.arange(rows)[:, None] / rows * 2 * np.pi
    y = 0.05 * np.arange(COLUMNS)
    radius = rows * 0.05 / (2 * np.pi)
    points = np.stack(
        np.broadcast_arrays(radius * np.cos(angle), y, radius * np.sin(angle)), axis=-1
    ).reshape(-1, 3)
    a, d = node[:, :-1].ravel(), node[:, 1:].ravel()
    b, c = np.roll(node, -1, axis=0)[:, :-1].ravel(), np.roll(node, -1, axis=0)[:, 1:].ravel()
    rng = np.random.default_rng(1)
    one_way = (rng.random(len(a)) < 0.5)[:, None]
    first = np.where(one_way, np.stack([a, b, c], 1), np.stack([a, b, d], 1))
    second = np.where(one_way, np.stack([a, c, d], 1), np.stack([b, c, d], 1))
    triangles = rng.permutation(np.concatenate([first, second]))
    vertices = [b"      vertex %.9e %.9e %.9e\n" % tuple(point) for point in points.tolist()]
    head = b"  facet normal 1.234567e-01 2.345678e-01 9.876543e-01\n    outer loop\n"
    body = b"".join(
        head + vertices[p] + vertices[q] + vertices[r] + b"    endloop\n  endfacet\n"
        for p, q, r in triangles.tolist()
    )
    return b"solid belt\n" + body + b"endsolid belt\n"


def measured(folder: Path, name: str) -> tuple[float, float]:
    """CPU seconds and peak memory, GB, of one command in a process of its own, pinned to one core."""
    child = os.fork()
    if child == 0:
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
        quiet = [name, "-o", "belt.inp", "--unit", "m", "--overwrite", "-q"]
        os.chdir(folder)
        os.execv(sys.executable, [sys.executable, "-c", "from beltconverter.cli import main; main()", *quiet])
    _, status, usage = os.wait4(child, 0)
    assert status == 0
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e6


def main() -> None:
    most = int(sys.argv[1]) if len(sys.argv) > 1 else 2_000_000
    print(f"{'facets':>9} {'STL MB':>7} {'INP MB':>7} {'CPU s':>7} {'GB':>5} {'us a facet':>10}")
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        for facets in [most // 8, most // 4, most // 2, most]:
            data = belt_stl(facets)
            (folder / "belt.stl").write_bytes(data)
            size = len(data) / 1e6
            del data
            seconds, memory = measured(folder, "belt.stl")
            inp = (folder / "belt.inp").stat().st_size / 1e6
            print(
                f"{facets:9d} {size:7.0f} {inp:7.0f} {seconds:7.1f} {memory:5.2f} {1e6 * seconds / facets:10.1f}"
            )


if __name__ == "__main__":
    main()
