"""Where a body stands: turned and perhaps mirrored, scaled, then shifted."""

from __future__ import annotations

from typing import NamedTuple

from .surfaces import BadGeometry, Vector, cross, dot, numbers_of


class Transform(NamedTuple):
    """p' = (p . rows) x scale + shift, p a row vector."""

    rows: tuple[Vector, Vector, Vector]
    scale: float
    shift: Vector

    def direction(self, v) -> Vector:
        """A direction of the body in the assembly."""
        return tuple(
            v[0] * self.rows[0][i] + v[1] * self.rows[1][i] + v[2] * self.rows[2][i] for i in range(3)
        )

    def point(self, p) -> Vector:
        """A point of the body in the assembly."""
        return tuple(self.scale * d + s for d, s in zip(self.direction(p), self.shift))


IDENTITY = Transform(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), 1.0, (0.0, 0.0, 0.0))


def transform_of(words: list[str]) -> Transform:
    """The last 16 fields of a transform record: nine of the matrix, the shift, the scale and three flags."""
    head = max(i for i, word in enumerate(words) if word[0] == "$")
    values = numbers_of(words[: len(words) - 3])[-13:] if len(words) - head > 16 else []
    if len(values) != 13:
        raise BadGeometry("found a transform without its thirteen numbers")
    if words[-1] not in ("no_shear", "0"):
        raise BadGeometry(
            "found a sheared body: its cylinders are no cylinders any more; remove the shear in the CAD"
        )
    rows = (tuple(values[:3]), tuple(values[3:6]), tuple(values[6:9]))
    off = [dot(rows[i], rows[j]) - (i == j) for i in range(3) for j in range(3)]
    if max(map(abs, off)) > 1e-6 or abs(abs(dot(cross(rows[0], rows[1]), rows[2])) - 1) > 1e-6:
        raise BadGeometry(
            "found a transform that is no rotation, expected rows of unit length at right angles"
        )
    if values[12] == 0:
        raise BadGeometry("found a transform of scale 0")
    return Transform(rows, values[12], tuple(values[9:12]))
