"""Odd solids for the tests of partconvert, as complete B-reps, and a whole conveyor of known truth."""

from __future__ import annotations

import sys
from math import atan2, cos, pi, radians, sin, sqrt
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "samples"))

from sat_writer import Body, Solid, box, cylinder, revolve, roller, write_sat
from solids import Curve, Face, Surface, add, times

__all__ = ["Body", "Solid", "box", "cylinder", "revolve", "roller", "write_sat"]

VERSIONS = (106, 200, 400, 500, 600, 700, 1600, 1900, 2100, 2400, 2600, 2800, 3000, 3100, 20800, 22700)


def extrude(outer, holes=(), low=0.0, high=1.0) -> Solid:
    """A prism along z over loops of (x, y) points; (x, y, (cx, cy), ccw) starts an arc.

    The outer loop runs counter-clockwise, holes clockwise (material on the left). A loop of one arc point is a circle.
    """
    solid, shell, bottom, top = Solid(), [], [], []
    for loop in (outer, *holes):
        rings = [_level(solid, loop, z) for z in (low, high)]
        shell += _walls(solid, loop, rings, low, high)
        bottom.append([(edge, False) for edge in reversed(rings[0][1])])
        top.append([(edge, True) for edge in rings[1][1]])
    for z, sign, loops in ((low, -1, bottom), (high, 1, top)):
        shell.append(Face(Surface("plane", (0, 0, z, 0, 0, sign, 1, 0, 0)), False, loops))
    solid.shells.append(shell)
    return solid


def _level(solid, loop, z):
    vertices = [solid.vertex((p[0], p[1], z)) for p in loop]
    edges = []
    for i, point in enumerate(loop):
        end = loop[(i + 1) % len(loop)]
        if len(point) == 2:
            way = (end[0] - point[0], end[1] - point[1])
            length = sqrt(way[0] ** 2 + way[1] ** 2)
            curve = Curve("straight", (*point, z, way[0] / length, way[1] / length, 0))
            span = length
        else:
            (cx, cy), ccw = point[2:]
            arm = (point[0] - cx, point[1] - cy)
            curve = Curve("ellipse", (cx, cy, z, 0, 0, 1 if ccw else -1, *arm, 0, 1))
            turn = atan2(end[1] - cy, end[0] - cx) - atan2(arm[1], arm[0])
            span = (turn if ccw else -turn) % (2 * pi) or 2 * pi
        edges.append(solid.edge(vertices[i], vertices[(i + 1) % len(loop)], curve, 0.0, span))
    return vertices, edges


def _walls(solid, loop, rings, low, high):
    (below, lower), (above, upper) = rings
    posts = []
    if len(loop) > 1:
        for v, w in zip(below, above):
            curve = Curve("straight", (*solid.vertices[v], 0, 0, 1))
            posts.append(solid.edge(v, w, curve, 0.0, high - low))
    for i, point in enumerate(loop):
        end = loop[(i + 1) % len(loop)]
        if len(point) == 2:
            way = (end[0] - point[0], end[1] - point[1])
            length = sqrt(way[0] ** 2 + way[1] ** 2)
            normal = (way[1] / length, -way[0] / length, 0)
            surface, inner = Surface("plane", (*point, low, *normal, 0, 0, 1)), False
        else:
            (cx, cy), ccw = point[2:]
            arm = (point[0] - cx, point[1] - cy)
            radius = sqrt(arm[0] ** 2 + arm[1] ** 2)
            surface, inner = Surface("cone", (cx, cy, low, 0, 0, 1, *arm, 0, 1, 0, 1, radius)), not ccw
        if posts:
            after = posts[(i + 1) % len(loop)]
            loops = [[(lower[i], True), (after, True), (upper[i], False), (posts[i], False)]]
        else:
            loops = [[(lower[i], True)], [(upper[i], False)]]
        yield Face(surface, inner, loops)


def circle(radius, centre=(0.0, 0.0), *, ccw=True):
    """A loop that is a full circle."""
    return [(centre[0] + radius, centre[1], centre, ccw)]


def notched_circle(radius, width, depth):
    """A circle with a keyway of that width and depth at angle 0."""
    half, reach = width / 2, sqrt(radius**2 - width**2 / 4)
    return [
        (reach, half, (0.0, 0.0), True),
        (reach, -half),
        (radius - depth, -half),
        (radius - depth, half),
    ]


def half_disc(radius):
    """Half a circle closed by its diameter."""
    return [(radius, 0.0, (0.0, 0.0), True), (-radius, 0.0)]


def rounded_rectangle(width, height, radius):
    """A rectangle with rounded corners."""
    w, h, r = width / 2, height / 2, radius
    return [
        (w, h - r, (w - r, h - r), True), (w - r, h),
        (-w + r, h, (-w + r, h - r), True), (-w, h - r),
        (-w, -h + r, (-w + r, -h + r), True), (-w + r, -h),
        (w - r, -h, (w - r, -h + r), True), (w, -h + r),
    ]  # fmt: skip


def rectangle(width, height):
    """A rectangle."""
    w, h = width / 2, height / 2
    return [(-w, -h), (w, -h), (w, h), (-w, h)]


def drilled(solid, point, normal, radius, depth) -> Solid:
    """A blind hole at `point`, along minus `normal`, into the plane face there."""
    shell = solid.shells[0]
    flat = next(
        i
        for i, face in enumerate(shell)
        if face.surface.kind == "plane"
        and abs(sum((p - o) * n for p, o, n in zip(point, face.surface.values[:3], normal))) < 1e-9
        and sum(a * b for a, b in zip(face.surface.values[3:6], normal)) > 0.5
    )
    across = (1.0, 0.0, 0.0) if abs(normal[0]) < 0.5 else (0.0, 1.0, 0.0)
    rings = []
    for deep in (0.0, depth):
        centre = add(point, times(-deep, normal))
        vertex = solid.vertex(add(centre, times(radius, across)))
        curve = Curve("ellipse", (*centre, *normal, *times(radius, across), 1))
        rings.append(solid.edge(vertex, vertex, curve, 0.0, 2 * pi))
    face = shell[flat]
    shell[flat] = face._replace(loops=[*face.loops, [(rings[0], False)]])
    wall = Surface("cone", (*point, *normal, *times(radius, across), 1, 0, 1, radius))
    floor = Surface("plane", (*add(point, times(-depth, normal)), *normal, *across))
    shell.append(Face(wall, True, [[(rings[0], True)], [(rings[1], False)]]))
    shell.append(Face(floor, False, [[(rings[1], True)]]))
    return solid


def radially_drilled(radius, length, hole, depth) -> Solid:
    """A cylinder along z with a blind hole along x; they meet in a free curve, as CAD systems write it."""
    solid = cylinder(2 * radius, length)
    reach, floor = sqrt(radius**2 - hole**2), radius - depth
    mouth, bottom = solid.vertex((reach, hole, 0.0)), solid.vertex((floor, hole, 0.0))
    inner = "surfintcur nubs 3 periodic 2 0 3 6.28 3 0.001 cone 0 0 0 0 0 1 1 0 0 1 I I 0 1 forward I I I I"
    rim = solid.edge(mouth, mouth, Curve("intcurve", f"forward {{ {inner} }}"), 0.0, 2 * pi)
    circle_below = Curve("ellipse", (floor, 0, 0, 1, 0, 0, 0, hole, 0, 1))
    ring = solid.edge(bottom, bottom, circle_below, 0.0, 2 * pi)
    shell = solid.shells[0]
    drum = next(i for i, face in enumerate(shell) if face.surface.kind == "cone")
    shell[drum] = shell[drum]._replace(loops=[*shell[drum].loops, [(rim, False)]])
    wall = Surface("cone", (0, 0, 0, 1, 0, 0, 0, hole, 0, 1, 0, 1, hole))
    shell.append(Face(wall, True, [[(rim, True)], [(ring, False)]]))
    shell.append(Face(Surface("plane", (floor, 0, 0, 1, 0, 0, 0, 1, 0)), False, [[(ring, True)]]))
    return solid


def with_void(outer: Solid, void: Solid) -> Solid:
    """`outer` with a closed void inside, whose profile must run the other way round."""
    vertices, edges = len(outer.vertices), len(outer.edges)
    outer.vertices += void.vertices
    outer.edges += [e._replace(start=e.start + vertices, end=e.end + vertices) for e in void.edges]
    for shell in void.shells:
        moved = [
            face._replace(loops=[[(edge + edges, forward) for edge, forward in loop] for loop in face.loops])
            for face in shell
        ]
        outer.shells.append(moved)
    return outer


def as_nurbs(solid: Solid) -> Solid:
    """The same solid with its curved faces as NURBS, as IGES and STEP translators leave them."""
    text = "forward { exactsur nurbs 3 1 open closed none none 2 4 0 1 0 1 0 0 0 1 0 } I I I I"
    for shell in solid.shells:
        for i, face in enumerate(shell):
            if face.surface.kind != "plane":
                shell[i] = face._replace(surface=Surface("spline", text))
    return solid


def double_cone(radius, middle, length) -> Solid:
    """A pulley that is crowned by two cones: no straight part."""
    return revolve(
        [(0, -length / 2), (radius, -length / 2), (middle, 0), (radius, length / 2), (0, length / 2)]
    )


def conveyor(sets=60):
    """Bodies of a conveyor with three-roll sets, return rolls, pulleys and beams; and (diameter, length, centre, axis).

    With 60 sets: 180 carrying and 20 return idlers, 4 pulleys, and as many beams as sets. Half of the rollers carry
    their place in their coordinates, half in the body's transform.
    """
    truth, bodies = [], []
    tilt = radians(35)

    def put(solid, name, diameter, length, centre, axis):
        bodies.append(Body([solid], name))
        truth.append((diameter, length, centre, axis))

    for i in range(sets):
        x = 1200.0 * i
        for side in (-1, 0, 1):
            axis = (0.0, cos(tilt), side * sin(tilt)) if side else (0.0, 1.0, 0.0)
            centre = (x, 400.0 * side, 1000.0 + 100.0 * abs(side))
            if side:
                put(roller(133, 380, 25, 430, centre, axis), f"wing {i} #{side}", 133, 380, centre, axis)
            else:
                bodies.append(_placed(roller(133, 380, 25, 430), f"centre {i}", centre))
                truth.append((133, 380, centre, axis))
        if i % 3 == 0:
            centre = (x, 0.0, 700.0)
            solid = cylinder(108, 1150, centre, (0, 1, 0), bore=90, pieces=2)
            put(solid, f"return {i}", 108, 1150, centre, (0.0, 1.0, 0.0))
        bodies.append(Body([box((80, 1400, 100), (x, 0, 500))], f"beam {i}"))
    for x, diameter in ((-1500, 400), (1200 * sets, 500), (1200 * sets - 800, 315), (-700, 315)):
        centre = (float(x), 0.0, 850.0)
        solid = roller(diameter, 1150, 90, 1600, centre, (0, 1, 0), seam=True)
        put(solid, f"pulley {diameter}", diameter, 1150, centre, (0.0, 1.0, 0.0))
    return bodies, truth


def _placed(solid, name, centre) -> Body:
    """A body along z that its transform turns to y and moves to `centre`."""
    return Body([solid], name, matrix=((1, 0, 0), (0, 0, -1), (0, 1, 0)), shift=centre)
