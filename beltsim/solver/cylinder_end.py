"""A box against the end of a cylinder: corners on springs, unless it is easier to push the box off the mantle.

The line contact of a box that reaches over the end holds S = 1/2 integral o^2 dh; were that all, a box far below the
mantle that just touches the end would be thrown out sideways. With a spring for the depth b of the box's middle below
the mantle, which a way along the box's sides alone does not tell, and four at the corners that go over the end first,

    A = S + 1/2 width b^2,    E = 1/8 width sum d^2,    U = E m(A / E)

where m(r) is r up to 1/2, r - (r - 1/2)^2 / 2 up to 3/2 and then 1: the smaller of both, rounded off. So the force,
m' grad A + (m - r m') grad E, is continuous but for the 1/2 o^2 that a line begins with where it comes over the end,
and no way over the end makes energy. Within the cylinder E is so large that the line is as if there were no end.
"""

from __future__ import annotations

from beltsim.solver.jit import inner
from beltsim.solver.vectors import add, plus, sub

TINY = 1e-100


@inner
def smaller(r):
    """A rounded min(r, 1) and its slope."""
    over = min(max(r - 0.5, 0.0), 1.0)
    return min(r, 1.5) - 0.5 * over * over, 1.0 - over


@inner
def corners_behind(end, beside, inward, side, half_length):
    """Depths behind the end of the four corners of the box's face that goes first.

    Returns
    -------
    their sum [m], the sum of their squares, the sums of depth times x and y [m2], and how many there are
    """
    one, other = add(beside, inward), sub(beside, inward)
    middle = half_length - side * end[2]
    a, b = max(0.0, middle - side * one[2]), max(0.0, middle + side * one[2])
    c, d = max(0.0, middle - side * other[2]), max(0.0, middle + side * other[2])
    total, across, against = a + b + c + d, a - b, c - d
    return (
        total,
        a * a + b * b + c * c + d * d,
        total * end[0] + across * one[0] + against * other[0],
        total * end[1] + across * one[1] + against * other[1],
        (1.0 if a > 0.0 else 0.0)
        + (1.0 if b > 0.0 else 0.0)
        + (1.0 if c > 0.0 else 0.0)
        + (1.0 if d > 0.0 else 0.0),
    )


@inner
def against_end(pressed, face, along, beside, inward, width, radius, half_length):
    """What is pressed of a box (see `line_pressure.pressed_face`), with the end; all in the cylinder's frame.

    Parameters
    ----------
    face, along, beside, inward : (3,) middle of the box's face that looks at the axis, half edges
    width : the largest of the box's core [m]

    Returns
    -------
    height that touches [m], twice the energy [m3], force (3,) [m2] and moment (3,) about the cylinder's middle [m3]
    """
    length, squares, force, moment = pressed
    centre = sub(face, inward)
    side = 1.0 if centre[2] >= 0.0 else -1.0
    end = plus(centre, -side if along[2] >= 0.0 else side, along)
    depth, depths, x, y, count = corners_behind(end, beside, inward, side, half_length)
    energy = 0.25 * width * depths
    # b = (radius^2 - d^2) / 2 radius, whose slope is the place over the radius.
    share = 1.0 / radius
    inset = max(0.0, 0.5 * (radius - share * (centre[0] * centre[0] + centre[1] * centre[1])))
    aside = squares + width * inset * inset
    rest = aside / max(energy, TINY)
    m, of_line = smaller(rest)
    of_end = 0.25 * width * (m - rest * of_line if of_line < 1.0 else 0.0)
    push, out = side * of_end, share * width * inset
    x_line, y_line = force[0] + out * centre[0], force[1] + out * centre[1]
    turn_x, turn_y = moment[0] - centre[2] * out * centre[1], moment[1] + centre[2] * out * centre[0]
    return (
        of_line * (length + (width if inset > 0.0 else 0.0)) + of_end * count,
        energy * m if of_line < 1.0 else aside,
        (of_line * x_line, of_line * y_line, of_line * force[2] + push * depth),
        (of_line * turn_x + push * y, of_line * turn_y - push * x, 0.0),
    )
