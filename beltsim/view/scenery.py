"""What a picture shows, as plain data: solids and triangles with colours, a colour bar and a caption.

Lengths in metres, orientations as unit quaternions (w, x, y, z) from the local frame to the world, colours as sRGB
in 0..1. Every array has one row for each solid; a single row or number stands for all of them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .errors import ViewProblem


def rotation_matrices(orientation: np.ndarray) -> np.ndarray:
    """Rotation matrices (n, 3, 3) of quaternions (n, 4) w, x, y, z, which need not be of unit length."""
    w, x, y, z = (orientation / np.linalg.norm(orientation, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _fill(solids: object, rows: int, **widths: int) -> None:
    """Bring every named field of a frozen dataclass to `rows` rows of float64, `widths` wide (0: one number)."""
    for name, width in widths.items():
        shape = (rows, width) if width else (rows,)
        try:
            values = np.broadcast_to(np.asarray(getattr(solids, name), dtype=float), shape)
        except ValueError:
            found = np.shape(getattr(solids, name))
            raise ViewProblem(
                f"{type(solids).__name__} {name}: found shape {found}, expected {shape}"
            ) from None
        if not np.isfinite(values).all():
            raise ViewProblem(
                f"{type(solids).__name__} {name}: found NaN or infinity, expected finite numbers"
            )
        object.__setattr__(solids, name, values)


@dataclass(frozen=True)
class Boxes:
    """Rounded boxes: centre (n, 3), orientation (n, 4), outer size (n, 3), edge radius (n,), colour (n, 3)."""

    position: np.ndarray
    orientation: np.ndarray
    size: np.ndarray
    edge_radius: np.ndarray
    colour: np.ndarray

    def __post_init__(self):
        _fill(self, len(self.position), position=3, orientation=4, size=3, edge_radius=0, colour=3)

    def reach(self) -> np.ndarray:
        """Half the extent of each solid along the world's axes (n, 3), in m."""
        return np.einsum("nij,nj->ni", np.abs(rotation_matrices(self.orientation)), self.size / 2)


@dataclass(frozen=True)
class Spheres:
    """Spheres: centre (n, 3), radius (n,), colour (n, 3)."""

    position: np.ndarray
    radius: np.ndarray
    colour: np.ndarray

    def __post_init__(self):
        _fill(self, len(self.position), position=3, radius=0, colour=3)

    def reach(self) -> np.ndarray:
        """Half the extent of each solid along the world's axes (n, 3), in m."""
        return np.repeat(self.radius[:, None], 3, axis=1)


@dataclass(frozen=True)
class Cylinders:
    """Cylinders about their local z: centre (n, 3), orientation (n, 4), diameter, length (n,), colour (n, 3)."""

    position: np.ndarray
    orientation: np.ndarray
    diameter: np.ndarray
    length: np.ndarray
    colour: np.ndarray

    def __post_init__(self):
        _fill(self, len(self.position), position=3, orientation=4, diameter=0, length=0, colour=3)

    def reach(self) -> np.ndarray:
        """Half the extent of each solid along the world's axes (n, 3), in m."""
        axis = rotation_matrices(self.orientation)[:, :, 2]
        across = np.sqrt(np.clip(1 - axis**2, 0, None))
        return np.abs(axis) * self.length[:, None] / 2 + across * self.diameter[:, None] / 2


@dataclass(frozen=True)
class Mesh:
    """Triangles: vertices (v, 3), faces (n, 3) of vertex numbers, colour (n, 3)."""

    vertices: np.ndarray
    faces: np.ndarray
    colour: np.ndarray

    def __post_init__(self):
        _fill(self, len(self.vertices), vertices=3)
        _fill(self, len(self.faces), colour=3)
        faces = np.asarray(self.faces, dtype=np.int64).reshape(-1, 3)
        if faces.size and (faces.min() < 0 or faces.max() >= len(self.vertices)):
            raise ViewProblem(
                f"Mesh faces: found vertex {faces.max()}, expected 0 to {len(self.vertices) - 1}"
            )
        object.__setattr__(self, "faces", faces)


@dataclass(frozen=True)
class Legend:
    """A colour bar: what the colours mean, the values at its ends and the colour map's name."""

    label: str
    low: float
    high: float
    colour_map: str = "viridis"


@dataclass
class Scenery:
    """All that a picture shows: solids and meshes, an optional colour bar, an optional caption."""

    items: list = field(default_factory=list)
    legend: Legend | None = None
    caption: str = ""

    def visible(self) -> list:
        """The items that hold at least one solid or triangle."""
        return [item for item in self.items if len(item.faces if isinstance(item, Mesh) else item.position)]


def extremes(item: Boxes | Spheres | Cylinders | Mesh) -> np.ndarray:
    """Points (n, k, 3) in m whose hull holds each solid or triangle: the corners of its box along the world's axes."""
    if isinstance(item, Mesh):
        return item.vertices[item.faces]
    signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, 8).T
    return item.position[:, None] + signs * item.reach()[:, None]


def bounds(scenery: Scenery) -> np.ndarray:
    """Lowest and highest corner (2, 3) in m of the box along the world's axes that holds everything."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for item in scenery.visible():
        points = extremes(item)
        low, high = np.minimum(low, points.min(axis=(0, 1))), np.maximum(high, points.max(axis=(0, 1)))
    return np.array([low, high])
