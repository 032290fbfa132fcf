"""The pressure of a box's face on a cylinder: the overlap integrated along the cylinder's axis.

At each height above the mantle the face has a nearest point to the axis. These points run along the line in which the
face lies over the axis, and on to both ends of the face along its edges: that way is the line and the parts of the four
edges that are nearest.

Force and moment are the slopes of an energy, the integral of half the squared overlap over the height. Its change is
that of the overlap all along, and of the height of the two ends of the way. So what is pressed has a share along the
axis too, which adds up to nothing over a way within the cylinder, but to a couple about it. Without that couple tilted
boxes gained 4e-3 of their energy in an impact.
"""

from __future__ import annotations

import math

from beltsim.solver.jit import inner
from beltsim.solver.vectors import plus, scaled

TINY = 1e-100
GAUSS, OUTER, INNER = math.sqrt(0.6), 5.0 / 9.0, 8.0 / 9.0
"""Place of the outer two of three points of Gauss, and weights."""
ACROSS = 1e-6
"""Height of half an edge, over the reach, up to which the couple at a flat box's end grows with it to its full size."""


@inner
def slab(start, step, limit):
    """Range of t in which |start + t step| <= limit."""
    step = max(abs(step), TINY) if step >= 0.0 else min(step, -TINY)
    share = 1.0 / step
    half, middle = limit * abs(share), -start * share
    return middle - half, middle + half


@inner
def inside_circle(start, step, radius):
    """Range of t in which the first two components of start + t step are nearer to the origin than a radius.

    With it come the coefficients of the power a t^2 + 2 b t + c of the point, its squared distance less radius^2.
    """
    a = step[0] * step[0] + step[1] * step[1]
    b = start[0] * step[0] + start[1] * step[1]
    c = start[0] * start[0] + start[1] * start[1] - radius * radius
    square = b * b - a * c
    root = math.sqrt(max(square, 0.0))
    share = 1.0 / max(a, TINY)
    middle = -b * share
    half = root * share
    # A point that does not move is inside for all t or for none.
    still = a <= TINY
    half = (1.0 / TINY if c < 0.0 else -1.0) if still else (half if square > 0.0 else -1.0)
    middle = 0.0 if still else middle
    return (middle - half, middle + half), (a, b, c)


@inner
def beyond(start, step, side):
    """Range of t in which side (start + t step) >= 0; `side` is 1 or -1."""
    step = max(step, TINY) if step >= 0.0 else min(step, -TINY)
    root = -start * (1.0 / step)
    rises = side * step > 0.0
    return (root if rises else -1.0 / TINY), (1.0 / TINY if rises else root)


@inner
def overlap_rate(u):
    """Overlap o over the distance d from the axis, where u = 1 - (d / reach)^2 >= 0.

    That is 1 / sqrt(1 - u) - 1, as a polynomial that is low by u^5 / 4: 4e-8 of it for an overlap of 1 % of the reach.
    """
    return u * (0.5 + u * (0.375 + u * (0.3125 + u * 0.2734375)))


@inner
def pressed(start, step, low, high, reach, half_length):
    """Integrals over the height along start + t step, low <= t <= high, where it is in a cylinder about the third axis.

    With three points of Gauss: exact in the lowest power of the overlap.

    Returns
    -------
    height that is inside [m], integral of the squared overlap o^2 [m3], force [m2] and moment [m3] across the axis
    """
    above = slab(start[2], step[2], half_length)
    within, (a, b, c) = inside_circle(start, step, reach)
    low, high = max(low, above[0], within[0]), min(high, above[1], within[1])
    half = max(0.0, 0.5 * (high - low))
    mean = 0.5 * (low + high) if half > 0.0 else 0.0
    x, y, height = plus(start, mean, step)
    dx, dy, rise = scaled(step, half)
    # u = 1 - (d / reach)^2 in the middle and at the points beside it.
    share = -(1.0 / (reach * reach))
    centre = share * (c + mean * (a * mean + 2.0 * b))
    level = centre + GAUSS * GAUSS * share * a * half * half
    tilt = 2.0 * GAUSS * share * half * (a * mean + b)
    one, two, three = overlap_rate(level - tilt), overlap_rate(centre), overlap_rate(level + tilt)
    outer = OUTER * (one + three)
    whole, first, second = outer + INNER * two, OUTER * GAUSS * (three - one), GAUSS * GAUSS * outer
    square = OUTER * (one * one * (1.0 - level + tilt) + three * three * (1.0 - level - tilt))
    square += INNER * two * two * (1.0 - centre)
    square *= reach * reach
    run = abs(rise)
    # The share along the axis is the slope of o^2 / 2 along the way: by parts, o^2 / 2 times the way's direction, which
    # is uncertain for an edge across the axis.
    aside = 0.5 * square * min(max(step[2] * (1.0 / (ACROSS * reach)), -1.0), 1.0)
    push, turn = whole * height + first * rise, first * height + second * rise
    return (
        2.0 * run,
        run * square,
        run * (whole * x + first * dx),
        run * (whole * y + first * dy),
        -run * (push * y + turn * dy) - aside * dy,
        run * (push * x + turn * dx) + aside * dx,
    )


@inner
def with_edge(total, middle, step, side, reach, half_length):
    """A sum of `pressed` and the share of an edge, which is nearest where it lies on one side of the axis."""
    low, high = beyond(middle[0], step[0], side)
    edge = pressed(middle, step, max(low, -1.0), min(high, 1.0), reach, half_length)
    return (
        total[0] + edge[0],
        total[1] + edge[1],
        total[2] + edge[2],
        total[3] + edge[3],
        total[4] + edge[4],
        total[5] + edge[5],
    )


@inner
def let_go(middle, along, cut, height, reach):
    """Half the squared overlap [m2] of the nearest point at the height of a cylinder's end, times 1, -x and y.

    `cut` is skew and width of `pressed_face`, and one over the width and the rise along the face.
    """
    skew, width, thin, steep = cut
    s = (height - middle[2]) * steep
    left = middle[0] + s * along[0]
    ends = slab(s, -skew, 1.0)
    low, high = max(-1.0, ends[0]), min(1.0, ends[1])
    x, y = left + width * min(max(-left * thin, low), high), middle[1] + s * along[1]
    u = max(0.0, 1.0 - (x * x + y * y) * (1.0 / (reach * reach)))
    rate = overlap_rate(u)
    energy = 0.5 * rate * rate * (1.0 - u) * reach * reach if low < high else 0.0
    return energy, -energy * x, energy * y


@inner
def pressed_face(middle, along, beside, reach, half_length):
    """Overlap of the nearest points of a face; all vectors in a frame whose third axis is the cylinder's.

    The first axis is the direction in which the face is cut at one height, so that its second coordinate is the same
    all along a cut, and the nearest point of a cut is that with the least first coordinate.

    Returns
    -------
    height [m], integral of o^2 [m3], force (3,) [m2] and its moment (3,) about the cylinder's middle [m3]
    """
    steep = 1.0 / along[2]
    skew = beside[2] * steep
    width = beside[0] - skew * along[0]
    # Cuts are numbered by s: s along + t (beside - skew along), on the face for |t| <= 1 and |s - skew t| <= 1.
    one, other = slab(middle[0], along[0], width), slab(skew * middle[0], beside[0], width)
    start, step = (0.0, middle[1], middle[2]), (0.0, along[1], along[2])
    total = pressed(start, step, max(one[0], other[0]), min(one[1], other[1]), reach, half_length)
    turn = 1.0 if skew >= 0.0 else -1.0
    total = with_edge(total, plus(middle, 1.0, along), beside, turn, reach, half_length)
    total = with_edge(total, plus(middle, -1.0, along), beside, -turn, reach, half_length)
    total = with_edge(total, plus(middle, 1.0, beside), along, -1.0, reach, half_length)
    total = with_edge(total, plus(middle, -1.0, beside), along, 1.0, reach, half_length)
    cut = skew, width, 1.0 / width, steep
    upper = let_go(middle, along, cut, half_length, reach)
    lower = let_go(middle, along, cut, -half_length, reach)
    force = total[2], total[3], upper[0] - lower[0]
    moment = total[4] + upper[2] - lower[2], total[5] + upper[1] - lower[1], 0.0
    return total[0], total[1], force, moment
