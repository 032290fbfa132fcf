"""A web page in which one can turn, zoom and cut a scenery: one file that fetches nothing.

Each solid is one instance of a shape, 48 bytes before base64: 9,000 particles make a page of 0.68 MB
(benchmarks/picture.py). A glTF viewer would want the triangles of each.
"""

from __future__ import annotations

import base64
from importlib import resources
from pathlib import Path

import numpy as np

from beltsim.console import output_file

from .camera import Camera, view_axes
from .colours import COLOUR_MAPS
from .errors import NothingToDraw
from .scenery import Boxes, Cylinders, Mesh, Scenery, Spheres, bounds
from .shapes import bevelled_cube, unit_ball, unit_prism

HOLE = "/*SCENERY*/"


def render_html(scenery: Scenery, path: str | Path, *, camera: Camera | None = None) -> None:
    """Write the page, which appears whole or not at all; the same scenery gives the same bytes.

    camera: where one looks from at first (azimuth, elevation, zoom).
    """
    page = html_of(scenery, camera or Camera())
    with output_file(path, overwrite=True) as stream:
        stream.write(page.encode())


def html_of(scenery: Scenery, camera: Camera) -> str:
    """The text of the page."""
    import orjson

    if not scenery.visible():
        raise NothingToDraw("nothing to draw: the scenery is empty")
    box = bounds(scenery)
    middle = box.mean(axis=0)
    batches = [_batch(item, middle) for item in scenery.visible()]
    seen = box if camera.zoom is None else np.reshape(camera.zoom, (2, 3))
    data = {
        "batches": batches,
        "low": box[0] - middle,
        "high": box[1] - middle,
        "middle": middle,
        "seen": seen - middle,
        "back": np.ascontiguousarray(view_axes(camera, np.ptp(box, axis=0))[2]),
        "caption": scenery.caption,
        "legend": _legend(scenery),
    }
    text = orjson.dumps(data, option=orjson.OPT_SERIALIZE_NUMPY).decode().replace("<", "\\u003c")
    template = resources.files(__package__).joinpath("page.html").read_text(encoding="utf-8")
    return template.replace(HOLE, text, 1)


def _legend(scenery: Scenery) -> dict | None:
    if scenery.legend is None:
        return None
    steps = [f"#{step}" for step in COLOUR_MAPS[scenery.legend.colour_map].split()]
    values = np.linspace(scenery.legend.high, scenery.legend.low, 5)
    return {"label": scenery.legend.label, "colours": steps, "values": [f"{value:.3g}" for value in values]}


def _batch(item: Boxes | Spheres | Cylinders | Mesh, middle: np.ndarray) -> dict:
    """One shape and its instances, as base64 of float32: what the page's shaders take."""
    half, edge, normal = _shape(item, middle)
    batch = {"vertices": _base64(np.concatenate([half, edge, normal], axis=1)), "count": len(half)}
    if isinstance(item, Mesh):
        colour = np.repeat(item.colour, 3, axis=0)
        solids = np.array([[0.0, 0, 0, 1, 0, 0, 0, 2, 2, 2, 0]])
    else:
        colour, solids = item.colour, _instances(item, middle)
    rgba = np.full((len(colour), 4), 255, np.uint8)
    rgba[:, :3] = np.rint(colour * 255)
    return batch | {
        "instances": _base64(solids),
        "solids": len(solids),
        "colours": base64.b64encode(rgba.tobytes()).decode(),
        "metal": isinstance(item, Cylinders),
        "mesh": isinstance(item, Mesh),
    }


def _base64(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode()


def _instances(item: Boxes | Spheres | Cylinders, middle: np.ndarray) -> np.ndarray:
    """Position, orientation, size and edge radius (n, 11) of each solid."""
    n = len(item.position)
    edge, turn = np.zeros((n, 1)), np.tile([1.0, 0, 0, 0], (n, 1))
    if isinstance(item, Spheres):
        size = np.repeat(2 * item.radius[:, None], 3, axis=1)
    elif isinstance(item, Cylinders):
        turn, size = item.orientation, np.column_stack([item.diameter, item.diameter, item.length])
    else:
        turn, size, edge = item.orientation, item.size, item.edge_radius[:, None]
    return np.concatenate([item.position - middle, turn, size, edge], axis=1)


def _shape(item, middle) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices of a shape's triangles, three each: in units of half the size, of the edge radius, and normals."""
    edge = None
    if isinstance(item, Spheres):
        points, faces = unit_ball(2 if len(item.position) < 20_000 else 1)
    elif isinstance(item, Cylinders):
        points, faces = unit_prism()
    elif isinstance(item, Mesh):
        points, faces = item.vertices - middle, item.faces
    else:
        points, edge, faces = bevelled_cube()
    corner = points[faces]
    normal = _flat_normals(corner if edge is None else corner + 0.2 * edge[faces])
    if isinstance(item, Spheres):
        normal = corner
    elif isinstance(item, Cylinders):
        barrel = np.abs(normal[:, 0, 2]) < 0.5
        normal[barrel] = corner[barrel] * [1, 1, 0]
    edges = np.zeros_like(corner) if edge is None else edge[faces]
    return corner.reshape(-1, 3), edges.reshape(-1, 3), normal.reshape(-1, 3)


def _flat_normals(corner: np.ndarray) -> np.ndarray:
    a, b, c = np.moveaxis(corner, 1, 0)
    normal = np.cross(b - a, c - a)
    length = np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    return np.repeat((normal / length)[:, None], 3, axis=1)
