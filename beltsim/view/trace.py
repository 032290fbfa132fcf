"""Rays against a scenery: the nearest surface with its exact normal, and whether anything stands in the way.

Intel Embree finds triangles; spheres and rounded edges are then made exact. Embree works in float32, so everything
is moved to the scenery's middle and rays leave surfaces by 1e-5 of its size.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .camera import FAR, HalfSpace
from .errors import needs_extra
from .scenery import Cylinders, Mesh, Scenery, Spheres, bounds, rotation_matrices
from .shapes import ball_hull, triangles


@dataclass
class Hits:
    """What rays met, one entry a ray; `item` is -1 where nothing was met."""

    distance: np.ndarray
    item: np.ndarray
    solid: np.ndarray  # number of the solid or triangle within its item
    normal: np.ndarray  # of the triangle, to its outside, any length
    cut: np.ndarray  # the ray began inside the solid, where the section plane cuts it
    position: np.ndarray

    def only(self, rows: np.ndarray) -> Hits:
        """These rays' hits alone."""
        return Hits(*(values[rows] for values in vars(self).values()))


class Caster:
    """A scenery made ready for rays."""

    def __init__(self, scenery: Scenery, left: HalfSpace | None = None):
        try:
            from embreex.mesh_construction import TriangleMesh
            from embreex.rtcore_scene import EmbreeScene
        except ImportError as error:
            raise needs_extra(error) from None
        self.items, self.left = scenery.visible(), left
        self.box = bounds(scenery)
        self.middle = self.box.mean(axis=0)
        self.size = float(np.linalg.norm(np.ptp(self.box, axis=0)))
        self.skin = 1e-5 * self.size
        self._embree = EmbreeScene()
        self._faces = []
        for item in self.items:
            soup, faces = triangles(item)
            TriangleMesh(self._embree, np.ascontiguousarray(soup - self.middle, dtype=np.float32))
            self._faces.append(faces)
        self._faces = np.array(self._faces)
        self._is_ball = np.array([isinstance(item, Spheres) for item in self.items])
        self._is_mesh = np.array([isinstance(item, Mesh) for item in self.items])

    def _run(self, origin, direction, far, **options):
        start = np.ascontiguousarray(origin - self.middle, dtype=np.float32)
        return self._embree.run(
            start,
            np.ascontiguousarray(direction, dtype=np.float32),
            dists=np.ascontiguousarray(far, dtype=np.float32),
            **options,
        )

    def _interval(self, origin, direction):
        if self.left is None:
            return np.zeros(len(origin)), np.full(len(origin), FAR)
        return self.left.interval(origin, direction)

    def blocked(self, origin: np.ndarray, direction: np.ndarray, far: float) -> np.ndarray:
        """Whether anything lies within `far` m along each ray; spheres count with their hulls."""
        enter, leave = self._interval(origin, direction)
        result = np.zeros(len(origin), bool)
        rows = np.flatnonzero(np.minimum(leave, far) > enter)
        start = origin[rows] + enter[rows, None] * direction[rows]
        span = np.minimum(leave, far)[rows] - enter[rows]
        result[rows] = self._run(start, direction[rows], span, query="OCCLUDED") >= 0
        return result

    def nearest(self, origin: np.ndarray, direction: np.ndarray) -> Hits:
        """The nearest surface that each ray (n, 3), unit direction, meets."""
        n = len(origin)
        enter, leave = self._interval(origin, direction)
        hits = Hits(leave, np.full(n, -1), np.zeros(n, int), np.zeros((n, 3)), np.zeros(n, bool), origin)
        start, active = enter.copy(), np.flatnonzero(leave > enter)
        while active.size:
            shifted = origin[active] + start[active, None] * direction[active]
            found = self._run(shifted, direction[active], hits.distance[active] - start[active], output=True)
            met = found["primID"] >= 0
            active, found = active[met], {name: values[met] for name, values in found.items()}
            # A sphere's hull may be met before something that stands between the hull and the sphere itself:
            # the sphere is noted, and the ray goes on behind the hull up to what has been found.
            ball = self._is_ball[found["geomID"]]
            self._note(hits, found, origin, direction, start, enter, active, ball)
            active = active[ball]
        self._find_cut(hits, origin, direction, enter)
        hits.distance[hits.cut] = enter[hits.cut]
        hits.distance[hits.item < 0] = FAR
        hits.position = origin + hits.distance[:, None] * direction
        return hits

    def _note(self, hits, found, origin, direction, start, enter, rows, ball) -> None:
        """Put what `rows` have met into `hits` where it is nearer, and move their start behind it."""
        item, normal = found["geomID"], found["Ng"]
        solid = found["primID"] // self._faces[item]
        distance = start[rows] + found["tfar"]
        start[rows] = distance + self.skin
        inside = np.einsum("ni,ni->n", normal, direction[rows]) > 0
        distance[ball], inside[ball] = self._to_balls(
            origin, direction, enter, rows[ball], item[ball], solid[ball]
        )
        nearer = distance < hits.distance[rows]
        kept = rows[nearer]
        hits.distance[kept], hits.item[kept], hits.solid[kept] = distance[nearer], item[nearer], solid[nearer]
        hits.normal[kept] = normal[nearer]
        hits.cut[kept] = inside[nearer] & ~self._is_mesh[item[nearer]] & (enter[kept] > 0)

    def _find_cut(self, hits, origin, direction, enter) -> None:
        """Find solids that the section cuts where they overlap: a ray leaves one that it has never entered."""
        rows = np.flatnonzero((enter > 0) & (hits.item >= 0) & ~hits.cut)
        rows = rows[~self._is_ball[hits.item[rows]]]
        entered, start = [self._key(hits.item[rows], hits.solid[rows])], hits.distance[rows] + self.skin
        for _ in range(4):  # as many belt particles share a corner
            found = self._run(
                origin[rows] + start[:, None] * direction[rows], direction[rows], start * 0 + FAR, output=True
            )
            item, solid = found["geomID"], found["primID"] // self._faces[found["geomID"]]
            closed = (found["primID"] >= 0) & ~self._is_ball[item] & ~self._is_mesh[item]
            key = self._key(item, solid)
            known = np.any([key == other for other in entered], axis=0)
            leaves = np.einsum("ni,ni->n", found["Ng"], direction[rows]) > 0
            cut = closed & leaves & ~known
            hits.cut[rows[cut]], hits.item[rows[cut]], hits.solid[rows[cut]] = True, item[cut], solid[cut]
            on = closed & ~leaves
            start = (start + found["tfar"] + self.skin)[on]
            rows, entered = rows[on], [other[on] for other in (*entered, key)]

    def _key(self, item: np.ndarray, solid: np.ndarray) -> np.ndarray:
        return item.astype(np.int64) << 32 | solid

    def _to_balls(self, origin, direction, enter, rows, item, solid) -> tuple[np.ndarray, np.ndarray]:
        """Distance at which rays enter the spheres themselves (`FAR`: pass by), or leave if they began inside."""
        centre, radius = self._balls(item, solid)
        offset = centre - origin[rows]
        along = np.einsum("ni,ni->n", offset, direction[rows])
        miss = offset - along[:, None] * direction[rows]
        square = radius**2 - np.einsum("ni,ni->n", miss, miss)
        half = np.sqrt(np.clip(square, 0, None))
        inside = along - half < enter[rows]
        distance = np.where(inside, along + half, along - half)
        return np.where((square > 0) & (distance > enter[rows]), distance, FAR), inside

    def _balls(self, item, solid):
        centre, radius = np.empty((len(item), 3)), np.empty(len(item))
        for k in np.unique(item):
            rows = item == k
            centre[rows], radius[rows] = (
                self.items[k].position[solid[rows]],
                self.items[k].radius[solid[rows]],
            )
        return centre, radius

    def smooth_normals(self, hits: Hits, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unit normals (n, 3) of the true surfaces towards the viewer, and points (n, 3) from which rays can leave.

        The points lie outside the triangles that stand for the solid, lest it shades itself.
        """
        normal, leave = np.zeros_like(hits.normal), hits.position.copy()
        for k, item in enumerate(self.items):
            rows = np.flatnonzero(hits.item == k)
            if rows.size:
                normal[rows], lift = _surface(item, hits.solid[rows], hits.position[rows], hits.normal[rows])
                leave[rows] += normal[rows] * lift[:, None]
        away = (np.einsum("ni,ni->n", normal, direction) > 0) & self._is_mesh[hits.item]
        normal[away] *= -1
        if self.left is not None:
            normal[hits.cut], leave[hits.cut] = self.left.normal(), hits.position[hits.cut]
        return normal, leave + normal * self.skin * 4

    def colours(self, hits: Hits) -> np.ndarray:
        """The sRGB colours (n, 3) of the solids that rays met."""
        colour = np.zeros_like(hits.normal)
        for k, item in enumerate(self.items):
            rows = hits.item == k
            colour[rows] = item.colour[hits.solid[rows]]
        return colour


def _surface(item, solid, position, facet) -> tuple[np.ndarray, np.ndarray]:
    """Outward unit normals (n, 3), and how far (n,) in m outside the surface its triangles end."""
    if isinstance(item, Spheres):
        away = position - item.position[solid]
        return _unit(away), item.radius[solid] * (ball_hull()[2] - 1)
    if isinstance(item, Mesh):
        return _unit(facet), np.zeros(len(solid))
    turn = rotation_matrices(item.orientation[solid])
    local = np.einsum("nji,nj->ni", turn, position - item.position[solid])
    if isinstance(item, Cylinders):
        normal, lift = _cylinder_surface(local, item.diameter[solid] / 2, item.length[solid] / 2)
    else:
        normal, lift = _box_surface(local, item.size[solid] / 2, item.edge_radius[solid], turn, facet)
    return np.einsum("nij,nj->ni", turn, normal), lift


def _cylinder_surface(local, radius, half):
    across = np.hypot(local[:, 0], local[:, 1])
    barrel = (half - np.abs(local[:, 2])) * radius > 1e-4 * half * radius
    normal = np.column_stack([local[:, :2] / across[:, None], np.zeros(len(local))])
    normal[~barrel] = np.sign(local[~barrel, 2:]) * [0, 0, 1]
    return normal, np.where(barrel, np.clip(radius - across, 0, None), 0)


def _box_surface(local, half, edge, turn, facet):
    """A rounded box's normal points away from the sharp box inside it."""
    core = half - edge[:, None]
    away = local - np.clip(local, -core, core)
    sharp = np.einsum("nji,nj->ni", turn, _unit(facet))
    rounded = np.linalg.norm(away, axis=1) > 0.5 * edge
    normal = np.where((rounded & (edge > 0))[:, None], away, sharp)
    # A bevel lies inside its rounding by 0.29 of the edge radius at most.
    return _unit(normal), np.zeros(len(local))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-30)
