"""Triangles and the points nearest to them: pure geometry, in whatever frame all arguments are given."""

from __future__ import annotations

import math

from beltsim.solver.jit import inner
from beltsim.solver.vectors import cross, dot, norm, plus, scaled, sub

TINY = 1e-300


@inner
def nearest_on_triangle(p, a, b, c):
    """Point of the triangle a, b, c that is nearest to p, and whether it lies inside the face.

    By Voronoi regions (Ericson 2005, Real-Time Collision Detection, 5.1.5). A point on an edge or a vertex is not
    inside. The triangle must have an area.
    """
    ab, ac, ap = sub(b, a), sub(c, a), sub(p, a)
    d1, d2 = dot(ab, ap), dot(ac, ap)
    if d1 <= 0.0 and d2 <= 0.0:
        return a, False
    bp = sub(p, b)
    d3, d4 = dot(ab, bp), dot(ac, bp)
    if d3 >= 0.0 and d4 <= d3:
        return b, False
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return plus(a, d1 / (d1 - d3), ab), False
    cp = sub(p, c)
    d5, d6 = dot(ab, cp), dot(ac, cp)
    if d6 >= 0.0 and d5 <= d6:
        return c, False
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return plus(a, d2 / (d2 - d6), ac), False
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        return plus(b, (d4 - d3) / ((d4 - d3) + (d5 - d6)), sub(c, b)), False
    share = 1.0 / (va + vb + vc)
    return plus(plus(a, vb * share, ab), vc * share, ac), True


@inner
def unit_normal(a, b, c):
    """Unit normal of a triangle, right-handed about a, b, c."""
    n = cross(sub(b, a), sub(c, a))
    return scaled(n, 1.0 / norm(n))


@inner
def sphere_triangle(centre, radius, a, b, c):
    """Overlap and normal of a sphere and a triangle without thickness.

    A triangle pushes to the side where the centre is. A centre in the triangle itself is pushed along its normal.
    """
    nearest, _ = nearest_on_triangle(centre, a, b, c)
    out = sub(centre, nearest)
    distance = norm(out)
    if distance > TINY:
        return radius - distance, scaled(out, 1.0 / distance)
    return radius, unit_normal(a, b, c)


@inner
def distance_to_box(p, low, high):
    """Distance of a point from a box along the axes; 0 inside, infinite for the empty box low = inf, high = -inf."""
    total = 0.0
    for k in range(3):
        out = max(0.0, max(low[k] - p[k], p[k] - high[k]))
        total += out * out
    return math.sqrt(total)
