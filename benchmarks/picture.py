"""Time and memory of a PNG at 1600x900, and size of the web page: a troughed belt with bulk and idlers.

Usage: python benchmarks/picture.py [belt particles] [spheres]
"""

import resource
import sys
import time

import numpy as np

from beltsim.view import Boxes, Camera, Cylinders, Scenery, Spheres
from beltsim.view.html import html_of
from beltsim.view.png import render
from beltsim.view.trace import Caster

LENGTH, WIDTH, TROUGH = 12.0, 1.0, np.radians(30)


def trough(across):
    """Offset to the side, height and slope of the belt at an arc length from its middle: three equal rolls."""
    flat = WIDTH / 6
    wing = np.clip(np.abs(across) - flat, 0, None)
    inner = np.clip(across, -flat, flat)
    slope = np.sign(across) * TROUGH * (wing > 0)
    return inner + np.sign(across) * wing * np.cos(TROUGH), wing * np.sin(TROUGH), slope


def about_x(angle):
    """Quaternions (n, 4) of turns about x."""
    return np.column_stack([np.cos(angle / 2), np.sin(angle / 2), 0 * angle, 0 * angle])


def made_belt(count):
    """About `count` belt particles."""
    rows = max(3, round(np.sqrt(count * WIDTH / LENGTH)))
    columns = round(count / rows)
    pitch = np.array([LENGTH / columns, WIDTH / rows])
    x, across = np.meshgrid(
        (np.arange(columns) + 0.5) * pitch[0], (np.arange(rows) + 0.5) * pitch[1] - WIDTH / 2
    )
    side, height, slope = trough(across.ravel())
    sag = 0.02 * np.sin(np.pi * x.ravel()) ** 2
    edge = 0.004
    size = [pitch[0] + 2 * edge, pitch[1] + 2 * edge, 0.012]
    return Boxes(
        np.column_stack([x.ravel(), side, height - sag]), about_x(slope), size, edge, (0.27, 0.28, 0.30)
    )


def made_bulk(count):
    """Loose spheres over the middle of the belt."""
    rng = np.random.default_rng(1)
    position = rng.uniform([0.5, -0.25, 0.03], [LENGTH - 0.5, 0.25, 0.15], (count, 3))
    return Spheres(position, rng.uniform(0.01, 0.02, count), (0.52, 0.42, 0.32))


def made_idlers():
    """Three rolls each metre."""
    x = np.repeat(np.arange(1, LENGTH), 3)
    across = np.tile([-WIDTH / 3, 0, WIDTH / 3], int(LENGTH) - 1)
    side, height, slope = trough(across)
    below = 0.06 * np.column_stack([0 * x, -np.sin(slope), np.cos(slope)])
    axis = about_x(slope - np.pi / 2)
    return Cylinders(np.column_stack([x, side, height]) - below, axis, 0.108, 0.3, (0.62, 0.64, 0.67))


def main(boxes=4000, balls=5000):
    scenery = Scenery([made_belt(boxes), made_bulk(balls), made_idlers()])
    start = time.perf_counter()
    caster = Caster(scenery)
    built = time.perf_counter() - start
    triangles = sum(faces * len(item.position) for faces, item in zip(caster._faces, caster.items))
    del caster
    wall, cpu = time.perf_counter(), time.process_time()
    render(scenery, width=1600, height=900)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(
        f"{triangles} triangles: built in {built:.2f} s; picture {wall:.1f} s, {cpu:.1f} s CPU; peak {peak:.2f} GiB"
    )
    print(f"web page of the same: {len(html_of(scenery, Camera())) / 1e6:.2f} MB")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
