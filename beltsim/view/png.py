"""PNG pictures by ray casting: rows of pixels in chunks, four samples a pixel."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import BinaryIO

import numpy as np

from beltsim.console import output_file

from . import light
from .camera import Camera, Section, View, place, view_axes
from .colours import to_linear, to_srgb
from .errors import NothingToDraw, ViewProblem, needs_extra
from .scenery import Scenery, bounds, extremes
from .seams import seams
from .trace import Caster

SAMPLES = ((-0.125, -0.375), (0.375, -0.125), (-0.375, 0.125), (0.125, 0.375))  # rotated grid, in pixels
CHUNK = 120_000  # pixels traced together: about 0.3 GB a thread
BACKGROUND = ((0.86, 0.88, 0.91), (0.97, 0.975, 0.98))  # sRGB at the top and at the bottom


def render_png(
    scenery: Scenery,
    path_or_stream: str | Path | BinaryIO,
    *,
    width: int = 1600,
    height: int = 900,
    camera: Camera | None = None,
    section: Section | None = None,
    ground: bool = True,
) -> None:
    """Draw a scenery into a PNG file, which appears whole or not at all; the same scenery gives the same bytes.

    width, height: pixels. section: hides what lies between a plane and the camera. ground: shadow on a floor.
    Raises `ViewProblem` if the packages of the extra `view` are missing or there is nothing to draw.
    """
    try:
        from PIL import Image
    except ImportError as error:
        raise needs_extra(error) from None
    from .labels import annotate

    pixels = render(scenery, width=width, height=height, camera=camera, section=section, ground=ground)
    image = annotate(Image.fromarray(pixels), scenery)
    if isinstance(path_or_stream, str | Path):
        with output_file(path_or_stream, overwrite=True) as stream:
            image.save(stream, format="PNG")
    else:
        image.save(path_or_stream, format="PNG")


def render(
    scenery: Scenery,
    *,
    width: int = 1600,
    height: int = 900,
    camera: Camera | None = None,
    section: Section | None = None,
    ground: bool = True,
) -> np.ndarray:
    """The picture without its text: sRGB (height, width, 3) uint8."""
    if not (64 <= width <= 20_000 and 64 <= height <= 20_000):
        raise ViewProblem(f"size: found {width}x{height}, expected 64 to 20000 pixels each way")
    if not scenery.visible():
        raise NothingToDraw("nothing to draw: the scenery is empty")
    camera = section.facing(camera or Camera()) if section else camera or Camera()
    axes = view_axes(camera, np.ptp(bounds(scenery), axis=0))
    caster = Caster(scenery, section and section.left(axes[2]))
    view = place(
        camera, axes, _to_see(caster, camera), caster.box, width / height, _margin(scenery, width, height)
    )
    painter = Painter(caster, view, ground, width, height)
    starts = range(0, height, max(1, CHUNK // width))
    with ThreadPoolExecutor(min(4, os.cpu_count() or 1)) as pool:
        strips = list(pool.map(painter.strip, starts, [*starts[1:], height]))
    return np.concatenate(strips)


def _to_see(caster: Caster, camera: Camera) -> np.ndarray:
    """The points (n, 3) that must lie in the picture: those of the zoom box, or of all that a section leaves."""
    if camera.zoom is not None:
        return np.array(np.meshgrid(*np.reshape(camera.zoom, (2, 3)).T)).reshape(3, 8).T
    points = [extremes(item) for item in caster.items]
    if caster.left is not None:
        points = [caster.left.cut(solids) for solids in points]
    points = np.concatenate([solids.reshape(-1, 3) for solids in points])
    if not len(points):
        raise NothingToDraw("nothing to draw: the section hides everything")
    return points


def _margin(scenery: Scenery, width: int, height: int) -> np.ndarray:
    """Shares of the picture kept free at the left, right, bottom and top; text takes a line, a colour bar 8 em."""
    line = max(9, height / 42)
    right = min(0.4, 8 * line / width) if scenery.legend else 0.0
    return np.array([0.03, 0.03 + right, 0.05 + (1.2 * line / height if scenery.caption else 0.0), 0.05])


class Painter:
    """Everything that the pixels of one picture share."""

    def __init__(self, caster: Caster, view: View, ground: bool, width: int, height: int):
        self.caster, self.view = caster, view
        self.width, self.height = width, height
        self.key = light.key_direction(view.axes[2])
        self.floor = caster.box[0, 2] - 0.002 * caster.size if ground and view.axes[2, 2] > 0 else None

    def strip(self, first: int, last: int) -> np.ndarray:
        """Rows `first` to `last` of the picture: sRGB (rows, width, 3) uint8."""
        row, column = np.divmod(np.arange(first * self.width, last * self.width), self.width)
        total = sum(self.sample(column, row, k) for k in range(len(SAMPLES)))
        pixels = to_srgb(total / len(SAMPLES)) * 255
        return np.rint(pixels).astype(np.uint8).reshape(last - first, self.width, 3)

    def sample(self, column: np.ndarray, row: np.ndarray, k: int) -> np.ndarray:
        """Light (n, 3) of one sample of each pixel."""
        x = (column + 0.5 + SAMPLES[k][0]) * 2 / self.width - 1
        y = 1 - (row + 0.5 + SAMPLES[k][1]) * 2 / self.height
        origin, direction = self.view.rays(x, y)
        turn = light.turns(column, row)
        hits = self.caster.nearest(origin, direction)
        result = self.backdrop(y)
        seen = hits.item >= 0
        self._paint_floor(result, origin, direction, hits.distance, turn, k)
        hits = hits.only(seen)
        normal, point = self.caster.smooth_normals(hits, direction[seen])
        pixel = self.view.scale(hits.distance) * 2 / self.width
        colour = to_linear(self.caster.colours(hits)) * seams(self.caster, hits, pixel)[:, None]
        result[seen] = light.shade(
            self.caster, hits, colour, normal, point, direction[seen], self.key, turn[seen], k, len(SAMPLES)
        )
        return result

    def backdrop(self, y: np.ndarray) -> np.ndarray:
        """The light (n, 3) of the background at heights -1..1 in the picture."""
        top, bottom = to_linear(np.array(BACKGROUND))
        return bottom + (top - bottom) * (0.5 + 0.5 * y[:, None])

    def _paint_floor(self, result, origin, direction, distance, turn, k) -> None:
        """Darken the background where the scenery shades a floor beneath it."""
        if self.floor is None:
            return
        with np.errstate(divide="ignore"):
            fall = (self.floor - origin[:, 2]) / direction[:, 2]
        spot = origin + fall[:, None] * direction
        around = np.abs(spot - self.caster.middle)[:, :2].max(axis=1) < self.caster.size
        rows = np.flatnonzero((direction[:, 2] < 0) & (fall > 0) & (fall < distance) & around)
        if rows.size:
            up = np.tile([0.0, 0.0, 1.0], (len(rows), 1))
            sun = light.sunlit(self.caster, spot[rows], self.key, turn[rows], k, len(SAMPLES))
            sky = light.skylight(
                self.caster, spot[rows], up, turn[rows], k, len(SAMPLES), 0.35 * self.caster.size
            )
            result[rows] *= (0.68 + 0.17 * sun + 0.15 * sky / light.OPEN)[:, None]
