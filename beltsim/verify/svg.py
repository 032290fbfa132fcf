"""Plots as small SVG files, written without a plotting library: lines for theory, points for the solver."""

from __future__ import annotations

import math
from html import escape

import numpy as np

from beltsim.verify.case import Plot, Series

WIDTH, HEIGHT = 640, 400
LEFT, RIGHT, TOP, BOTTOM = 80, 20, 40, 60
COLOURS = ("#1f5fa8", "#c0392b", "#2e8b57", "#8e5ea2", "#b8860b", "#555555")


def ticks(low: float, high: float) -> list[float]:
    """About six round numbers from low to high."""
    raw = (high - low) / 6.0
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= raw)
    first = math.ceil(low / step - 1e-9)
    return [k * step for k in range(first, math.floor(high / step + 1e-9) + 1)]


def limits(values: list[np.ndarray]) -> tuple[float, float]:
    """Range of some arrays with a margin of 4 %."""
    everything = np.concatenate(values)
    low, high = float(everything.min()), float(everything.max())
    if high <= low:
        low, high = low - 0.5 * (abs(low) or 1.0), high + 0.5 * (abs(high) or 1.0)
    margin = 0.04 * (high - low)
    return low - margin, high + margin


def svg(plot: Plot) -> str:
    """The SVG text of a plot."""
    x_range, y_range = limits([s.x for s in plot.series]), limits([s.y for s in plot.series])

    def at_x(x):
        return LEFT + (np.asarray(x) - x_range[0]) / (x_range[1] - x_range[0]) * (WIDTH - LEFT - RIGHT)

    def at_y(y):
        return (
            HEIGHT
            - BOTTOM
            - (np.asarray(y) - y_range[0]) / (y_range[1] - y_range[0]) * (HEIGHT - TOP - BOTTOM)
        )

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
        text(WIDTH / 2, 22, plot.title, size=15),
        text(0.5 * (LEFT + WIDTH - RIGHT), HEIGHT - 18, plot.x_label),
        f'<g transform="translate(18 {(TOP + HEIGHT - BOTTOM) / 2:g}) rotate(-90)">{text(0, 0, plot.y_label)}</g>',
    ]
    for x in ticks(*x_range):
        parts.append(rule(at_x(x), TOP, at_x(x), HEIGHT - BOTTOM))
        parts.append(text(at_x(x), HEIGHT - BOTTOM + 18, f"{x:g}" if abs(x) > 1e-12 else "0"))
    for y in ticks(*y_range):
        parts.append(rule(LEFT, at_y(y), WIDTH - RIGHT, at_y(y)))
        parts.append(text(LEFT - 8, at_y(y) + 4, f"{y:g}" if abs(y) > 1e-12 else "0", anchor="end"))
    parts.append(
        f'<rect x="{LEFT}" y="{TOP}" width="{WIDTH - LEFT - RIGHT}" height="{HEIGHT - TOP - BOTTOM}" '
        'fill="none" stroke="#333"/>'
    )
    for k, series in enumerate(plot.series):
        parts.append(drawn(series, at_x(series.x), at_y(series.y), COLOURS[k % len(COLOURS)]))
    parts += legend(plot, at_x, at_y)
    return "\n".join([*parts, "</svg>", ""])


def drawn(series: Series, x: np.ndarray, y: np.ndarray, colour: str) -> str:
    """One curve, in picture units."""
    if series.points:
        return "".join(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="4" fill="{colour}"/>' for a, b in zip(x, y))
    path = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y))
    return f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="2"/>'


def legend(plot: Plot, at_x, at_y) -> list[str]:
    """Names of the curves, in the corner that has the fewest points."""
    height = 18 * len(plot.series) + 8
    width = 44 + max(sum(10 if c.isupper() else 7 for c in s.label) for s in plot.series)
    corners = [
        (x, y) for x in (LEFT + 8, WIDTH - RIGHT - width - 8) for y in (TOP + 8, HEIGHT - BOTTOM - height - 8)
    ]
    places = np.concatenate([dense(at_x(s.x), at_y(s.y)) for s in plot.series])

    def covered(corner):
        left, top = corner
        inside = (places > (left, top)) & (places < (left + width, top + height))
        return int(np.count_nonzero(inside.all(axis=1)))

    left, top = min(corners, key=covered)
    parts = [
        f'<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="white" fill-opacity="0.85"/>'
    ]
    for k, series in enumerate(plot.series):
        y = top + 18 * k + 16
        x = np.array([left + 18.0] if series.points else [left + 6.0, left + 30.0])
        parts.append(drawn(series, x, np.full(x.size, y - 4.0), COLOURS[k % len(COLOURS)]))
        parts.append(text(left + 36, y, series.label, anchor="start"))
    return parts


def dense(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Points (m, 2) along a curve, so that long straight stretches count."""
    place = np.linspace(0.0, x.size - 1.0, max(200, x.size))
    return np.column_stack([np.interp(place, np.arange(x.size), x), np.interp(place, np.arange(x.size), y)])


def rule(x1, y1, x2, y2) -> str:
    """A grid line."""
    return f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="#ddd"/>'


def text(x, y, words: str, *, anchor: str = "middle", size: int = 13) -> str:
    """A label."""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}">{escape(words)}</text>'
