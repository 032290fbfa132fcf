"""Writes the sample conveyor's CAD files: belt.stl, its belt's mid-surface, and frame.sat, its steel.

    python make_conveyor.py [folder] [--rows 260] [--columns 16]

The files look as a mesher and a CAD system write them: an ASCII STL of triangles in mm; an ACIS text
of solids in mm, rolls among beams and plates, most of them moved by body transforms. Equal options
give equal bytes.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # for sat_writer, solids

from belt_shape import Conveyor, belt_nodes
from roll_layout import Box, Roll, frame, rolls
from sat_writer import write_sat
from solids import Body, box, frame_of, roller


def triangles(grid: np.ndarray) -> np.ndarray:
    """Facets (n, 3, 3) of an endless grid (rows, columns, 3): each cell is cut along its shorter diagonal.

    Facets turn right-handed about the belt's carrying side. Equal diagonals are cut from the first node.
    """
    following = np.roll(grid, -1, axis=0)
    a, b, c, d = grid[:, :-1], following[:, :-1], following[:, 1:], grid[:, 1:]
    first, second = np.linalg.norm(c - a, axis=-1), np.linalg.norm(d - b, axis=-1)
    # A nanometre decides, so that rounding does not: most of the belt's cells are true rectangles.
    cut_first = (first <= second + 1e-6)[..., None, None, None]
    pairs_first = np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)], axis=2)
    pairs_second = np.stack([np.stack([a, b, d], axis=2), np.stack([b, c, d], axis=2)], axis=2)
    return np.where(cut_first, pairs_first, pairs_second).reshape(-1, 3, 3)


def stl_text(facets: np.ndarray, name: str) -> str:
    """ASCII STL of facets (n, 3, 3), seven digits as single precision has them."""
    normals = np.cross(facets[:, 1] - facets[:, 0], facets[:, 2] - facets[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    template = (
        "  facet normal {:.6e} {:.6e} {:.6e}\n    outer loop\n"
        + "      vertex {:.6e} {:.6e} {:.6e}\n" * 3
        + "    endloop\n  endfacet\n"
    )
    # Below a nanometre is rounding: it would print as a different number on every machine, or as -0.
    numbers = np.round(np.concatenate([normals, facets.reshape(-1, 9)], axis=1), 6) + 0.0
    body = "".join(template.format(*row) for row in numbers.tolist())
    return f"solid {name}\n{body}endsolid {name}\n"


def sat_text(conveyor: Conveyor) -> str:
    """ACIS text of all rolls and of the frame, one body each.

    As assemblies are exported: pulleys are drawn where they stand; rolls and beams about their own origin,
    and moved to their places by the bodies' transforms.
    """
    return write_sat([*map(_drum, rolls(conveyor)), *map(_beam, frame(conveyor))])


def _drum(roll: Roll) -> Body:
    """A pulley with its shaft and a seam along the drum, or a roll with journals in two halves."""
    if "pulley" in roll.name:
        overall = roll.length + 200.0
        solid = roller(roll.diameter, roll.length, 100.0, overall, roll.centre, roll.axis, seam=True)
        return Body([solid], roll.name)
    solid = roller(roll.diameter, roll.length, 20.0, roll.length + 8.0, pieces=2)
    # The transform acts on row vectors: its third row is where the drawn axis, z, goes.
    return Body([solid], roll.name, matrix=frame_of(roll.axis), shift=roll.centre)


def _beam(part: Box) -> Body:
    return Body([box(part.size)], part.name, shift=part.centre)


def main() -> None:
    """Write both files into the folder given, by default the one this script lies in."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", nargs="?", type=Path, default=Path(__file__).parent)
    parser.add_argument("--rows", type=int, default=Conveyor.rows, help="cells along the belt (%(default)s)")
    parser.add_argument("--columns", type=int, default=Conveyor.columns, help="cells across it (%(default)s)")
    given = parser.parse_args()
    if given.rows < 20 or given.columns < 3:
        parser.error("found too few cells for the belt's shape, expected at least 20 rows and 3 columns")
    conveyor = Conveyor(rows=given.rows, columns=given.columns)
    given.folder.mkdir(parents=True, exist_ok=True)
    belt = stl_text(triangles(belt_nodes(conveyor)), "belt")
    (given.folder / "belt.stl").write_text(belt, encoding="ascii")
    (given.folder / "frame.sat").write_text(sat_text(conveyor), encoding="ascii")


if __name__ == "__main__":
    main()
