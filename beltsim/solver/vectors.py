"""3-vectors and unit quaternions as tuples of floats: the arithmetic of every kernel.

Tuples through these helpers cost what hand-written scalars cost (measured 1.00), rows of numpy arrays 21 times that.
Arrays of vectors are stored by component: `a[0]`, `a[1]`, `a[2]` are contiguous.
Quaternions are (w, x, y, z) and rotate a particle's local frame to the world.
"""

from __future__ import annotations

import math

from beltsim.solver.jit import inner


@inner
def at(a, k):
    """Vector k of an array (3, n)."""
    return a[0, k], a[1, k], a[2, k]


@inner
def put(a, k, v):
    """Store vector v as vector k of an array (3, n)."""
    a[0, k] = v[0]
    a[1, k] = v[1]
    a[2, k] = v[2]


@inner
def at4(a, k):
    """Quaternion k of an array (4, n)."""
    return a[0, k], a[1, k], a[2, k], a[3, k]


@inner
def put4(a, k, q):
    """Store quaternion q as quaternion k of an array (4, n)."""
    a[0, k] = q[0]
    a[1, k] = q[1]
    a[2, k] = q[2]
    a[3, k] = q[3]


@inner
def rows3(a):
    """The three rows of an array (3, n)."""
    return a[0], a[1], a[2]


@inner
def rows4(a):
    """The four rows of an array (4, n)."""
    return a[0], a[1], a[2], a[3]


@inner
def of(rows, k):
    """Vector k of three rows."""
    return rows[0][k], rows[1][k], rows[2][k]


@inner
def of4(rows, k):
    """Quaternion k of four rows."""
    return rows[0][k], rows[1][k], rows[2][k], rows[3][k]


@inner
def add(a, b):
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inner
def sub(a, b):
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inner
def scaled(a, s):
    """s times a."""
    return a[0] * s, a[1] * s, a[2] * s


@inner
def plus(a, s, b):
    """a + s b."""
    return a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]


@inner
def times(a, b):
    """Product component by component."""
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


@inner
def dot(a, b):
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inner
def cross(a, b):
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inner
def norm(a):
    """Length."""
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@inner
def across(a, n):
    """Part of a that is normal to the unit vector n."""
    return plus(a, -dot(a, n), n)


@inner
def conjugate(q):
    """Inverse of a unit quaternion."""
    return q[0], -q[1], -q[2], -q[3]


@inner
def product(p, q):
    """Quaternion product p q: first q, then p."""
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


@inner
def unit(q):
    """A quaternion of length one."""
    scale = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return scale * q[0], scale * q[1], scale * q[2], scale * q[3]


@inner
def rotate(q, v):
    """Vector v of the local frame of q, in world axes."""
    u = (q[1], q[2], q[3])
    t = scaled(cross(u, v), 2.0)
    return add(plus(v, q[0], t), cross(u, t))


@inner
def rotate_back(q, v):
    """World vector v in the local frame of q."""
    return rotate(conjugate(q), v)


@inner
def axis_x(q):
    """Local x axis of q in world axes."""
    w, x, y, z = q
    return 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)


@inner
def axis_y(q):
    """Local y axis of q in world axes."""
    w, x, y, z = q
    return 2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)


@inner
def axis_z(q):
    """Local z axis of q in world axes."""
    w, x, y, z = q
    return 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)


@inner
def axes_of(q):
    """The three local axes of q in world axes."""
    return axis_x(q), axis_y(q), axis_z(q)


@inner
def in_axes(axes, v):
    """World vector v in a frame given by its axes."""
    return dot(axes[0], v), dot(axes[1], v), dot(axes[2], v)


@inner
def from_axes(axes, v):
    """Vector v of a frame given by its axes, in world axes."""
    return plus(plus(scaled(axes[0], v[0]), v[1], axes[1]), v[2], axes[2])


@inner
def exponential(a):
    """Quaternion of the rotation vector a [rad]."""
    angle = norm(a)
    if angle < 1e-4:  # the next term of the series is below 1e-18
        s = 0.5 - angle * angle / 48.0
    else:
        s = math.sin(0.5 * angle) / angle
    return math.cos(0.5 * angle), s * a[0], s * a[1], s * a[2]
