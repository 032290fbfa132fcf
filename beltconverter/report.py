"""What a person wants to know of a converted belt: counts, sizes, strain, mass and the area check."""

from __future__ import annotations

import numpy as np

from .belt import Belt, Making, masses
from .frames import Pose, before_and_after, highest_row


def report(belt: Belt, making: Making, pose: Pose) -> dict:
    """Measured figures of one belt, SI, in a stable order; runs and carries are directions where it is highest."""
    rows, columns = belt.zone.shape
    flat, cells = belt.flat, belt.cells
    strains = flat.strains
    axes = belt.axes[highest_row(belt.grid.points, pose), columns // 2]
    middle = flat.chords[:, (columns - 1) // 2 : columns // 2 + 1].mean(axis=1)
    worst_low, worst_high = (int(np.argmax(values)) for values in (-strains.min(axis=1), strains.max(axis=1)))
    stretch = making.elongation[0] * making.elongation[1]
    return {
        "belt": making.prefix + making.name,
        "kind": belt.grid.kind,
        "rows": rows,
        "columns": columns,
        "particles": rows * columns,
        "bonds": int(flat.lengths.size + flat.widths.size),
        "first_id": making.first_id,
        "runs": _rounded(axes[:, 0]),
        "carries": _rounded(axes[:, 2]),
        "length": float(middle.sum()),
        "node_width": float(np.mean(flat.widths.sum(axis=1)) * making.elongation[1]),
        "width": float(np.mean(cells.across.sum(axis=1)) * making.elongation[1]),
        "pitch_along": cells.nominal[0] * making.elongation[0],
        "pitch_across": cells.nominal[1] * making.elongation[1],
        "stress_free_length": float(np.mean(flat.lengths.sum(axis=0))),
        "stress_free_mode": flat.mode,
        "strain_min": float(strains.min()),
        "strain_min_row": worst_low + 1,
        "strain_max": float(strains.max()),
        "strain_max_row": worst_high + 1,
        "strain_row_min": strains.min(axis=1),
        "strain_row_max": strains.max(axis=1),
        "mass": float(masses(belt).sum()),
        "area": float(np.sum(cells.along * cells.across)) * stretch,
        "mesh_area": surface_area(belt),
        "area_check": flat_area(belt) * stretch / surface_area(belt) - 1,
    }


def _rounded(direction: np.ndarray) -> list[float]:
    return (np.round(direction, 3) + 0.0).tolist()


def surface_area(belt: Belt) -> float:
    """Area of the mesh between the outer nodes, m2: mean of both ways to cut each cell."""
    _, after = before_and_after(belt.grid.points, belt.grid.kind)
    used = slice(None) if belt.grid.is_ring else slice(-1)
    a, b = belt.grid.points[used], after[used]
    p, q, r, s = a[:, :-1], b[:, :-1], b[:, 1:], a[:, 1:]
    triangles = [(p, q, r), (p, r, s), (p, q, s), (q, r, s)]
    return float(sum(np.linalg.norm(np.cross(y - x, z - x), axis=2).sum() for x, y, z in triangles) / 4)


def flat_area(belt: Belt) -> float:
    """Stress-free area between the outer nodes, m2."""
    lengths, widths = belt.flat.lengths, belt.flat.widths[: len(belt.flat.lengths)]
    return float(np.sum((lengths[:, 1:] + lengths[:, :-1]) / 2 * widths))


def info_lines(reports: list[dict]) -> list[str]:
    """Lines `key = value` of the RESULT block; several belts are told apart by their names."""
    lines = [f"belts = {len(reports)}"] if len(reports) > 1 else []
    for one in reports:
        prefix = f"{one['belt']}: " if len(reports) > 1 else ""
        lines += [
            f"{prefix}{key} = {_text(value)}"
            for key, value in one.items()
            if not isinstance(value, np.ndarray)
        ]
    return lines


def _text(value) -> str:
    if isinstance(value, list):
        return ", ".join(map(_text, value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _percent(share: float) -> str:
    return f"{round(100 * share, 3) + 0.0:+.3f} %"


def summary_lines(reports: list[dict]) -> list[str]:
    """A few lines for people."""
    lines = []
    for one in reports:
        lines += [
            f"{one['belt']}: {one['kind']}, {one['rows']} rows x {one['columns']} columns, "
            f"{one['particles']:,} particles, {one['bonds']:,} bonds",
            f"  runs towards ({_text(one['runs'])}), carries towards ({_text(one['carries'])}) where it is highest",
            f"  length {one['length']:.4g} m, width {one['width']:.4g} m, pitch {1000 * one['pitch_along']:.4g} x "
            f"{1000 * one['pitch_across']:.4g} mm, mass {one['mass']:.4g} kg",
            f"  initial strain {_percent(one['strain_min'])} (row {one['strain_min_row']}) to "
            f"{_percent(one['strain_max'])} (row {one['strain_max_row']}), one stress-free length per "
            f"{one['stress_free_mode']}",
            f"  area {one['area']:.4g} m2; between the outer nodes {one['mesh_area']:.4g} m2 as meshed, "
            f"{100 * one['area_check']:+.2f} % when flat",
        ]
    return lines
