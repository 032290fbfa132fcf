"""What meshes cost: lists near a wall and far from it for more and more triangles, and a step on a mesh and on a plane.

Usage: python benchmarks/mesh_walls.py [spheres]

Lists: the tree that is walked, beside the least that hashing all triangles anew would cost (one point of each).
Steps: spheres that rest on a plane, and on flat meshes whose triangles are 10, 1 and 0.1 of a radius wide.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from scenes import add_mesh, add_plane, add_spheres, advance, case, particles, start

from beltsim.engine import renew_lists
from beltsim.solver.columns import columns_of

RADIUS = 0.01
REPEATS = 5


def square(cells, size):
    """A flat square with 2 cells^2 triangles."""
    edge = np.linspace(-size, size, cells + 1)
    x, y = np.meshgrid(edge, edge, indexing="ij")
    k = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    quads = np.stack([k, k + cells + 1, k + cells + 2, k + 1], axis=1)
    return np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]), quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)


def resting(count, height, floor):
    """Spheres in a square layer at a height over a floor that `floor` adds to the deck."""
    side = int(np.ceil(np.sqrt(count)))
    place = 2.2 * RADIUS * (np.stack(np.divmod(np.arange(count), side), axis=1) - side / 2)
    deck = case(time_step=2e-5, gravity=(0, 0, -9.81), friction=0.3, restitution=0.3)
    add_spheres(deck, np.column_stack([place, np.full(count, height)]), radius=RADIUS)
    floor(deck, 1.3 * RADIUS * side)
    return start(deck)


def best(work):
    """Least of some times [s]."""
    times = []
    for _ in range(REPEATS):
        clock = time.perf_counter()
        work()
        times.append(time.perf_counter() - clock)
    return min(times)


def lists(count, path):
    """Table of list-building."""
    print("| triangles | lists far from the mesh | on it | hashing all triangles |")
    print("|---|---|---|---|")
    for cells in (7, 22, 70, 224, 708):
        times = []
        for height in (1.0, RADIUS):
            state = resting(
                count, height, lambda deck, size, cells=cells: add_mesh(deck, path, *square(cells, size))
            )
            renew_lists(state)
            times.append(best(lambda state=state: renew_lists(state)))
        walls = state.scene.machinery.walls
        points, chosen = walls.vertex[:, walls.triangle[0]].copy(), np.arange(walls.part.size, dtype=np.int32)
        size = np.full(walls.part.size, RADIUS)
        columns_of(points, size, chosen, RADIUS)
        hashing = best(
            lambda points=points, size=size, chosen=chosen: columns_of(points, size, chosen, RADIUS)
        )
        print(
            f"| {walls.part.size} | {1e3 * times[0]:.2f} ms | {1e3 * times[1]:.2f} ms | {1e3 * hashing:.2f} ms |"
        )


def steps(count, path):
    """Table of stepping."""

    def on_mesh(width):
        return lambda deck, size: add_mesh(
            deck, path, *square(max(1, round(2 * size / (width * RADIUS))), size)
        )

    floors = {"plane": lambda deck, _: add_plane(deck)}
    floors |= {f"triangles of {width:g} radii": on_mesh(width) for width in (10.0, 1.0, 0.1)}
    print("\n| floor | a sphere and step | times the plane |\n|---|---|---|")
    base = None
    for name, floor in floors.items():
        state = resting(count, RADIUS - 1e-6, floor)
        advance(state, 5)
        each = best(lambda state=state: advance(state, 20)) / 20 / particles(state).mass.size
        base = base or each
        print(f"| {name} | {1e9 * each:.0f} ns | {each / base:.2f} |")


def main():
    """Both tables."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "floor.stl"
        print(f"{count} spheres")
        lists(count, path)
        steps(min(count, 400), path)


if __name__ == "__main__":
    main()
