"""Triangle meshes as walls: the geometry, the search, and what spheres feel on them."""

import numpy as np
import pytest
import trimesh
from scenes import (
    add_mesh,
    add_plane,
    add_spheres,
    advance,
    case,
    kinetic_energy,
    particles,
    start,
    tilted,
)
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

from beltsim.console import CommandError
from beltsim.scene import build
from beltsim.scene.walls import Mesh, in_search_order, walls_of
from beltsim.solver.state import Feelers, Parts, Shapes
from beltsim.solver.triangles import nearest_on_triangle, sphere_triangle
from beltsim.solver.wall_pairs import wall_pairs

RADIUS = 0.05
WEIGHT = 4.0 / 3.0 * np.pi * RADIUS**3 * 1200.0 * 9.81
MODULUS = 5.0e6 / (1.0 - 0.3**2) / 2.0  # E* of SOFT on SOFT
SINK = (3.0 * WEIGHT / (4.0 * MODULUS * np.sqrt(RADIUS))) ** (2.0 / 3.0)  # Hertz overlap under the own weight


def sheet(size=1.0, cells=12, *, seed=3):
    """A flat square of scattered triangles (Delaunay), both windings: vertices and triangles."""
    rng = np.random.default_rng(seed)
    edge = np.linspace(-size, size, cells + 1)
    rim = np.concatenate([[(x, y), (y, x)] for x in edge for y in (-size, size)])
    points = np.unique(np.concatenate([rim, rng.uniform(-0.97 * size, 0.97 * size, (cells**2, 2))]), axis=0)
    triangles = Delaunay(points).simplices
    triangles[::2] = triangles[::2, ::-1]
    return np.column_stack([points, np.zeros(len(points))]), triangles


def forces_on_first(state):
    """Contact force (3,) on the only particle, gravity not counted."""
    return particles(state).force[:, 0] - particles(state).mass[0] * state.scene.gravity


def carriers(state):
    """How many triangles carry."""
    return int(np.count_nonzero(state.lists.walls.contacts.beside[0] == 1))


# ---- geometry


def test_the_nearest_point_of_a_triangle_is_that_of_an_independent_search(rng):
    corners = rng.standard_normal((400, 3, 3))
    points = 2.0 * rng.standard_normal((400, 3))
    expected = trimesh.triangles.closest_point(corners, points)
    for point, triangle, wanted in zip(points, corners, expected):
        found, in_face = nearest_on_triangle(tuple(point), *map(tuple, triangle))
        assert found == pytest.approx(wanted, abs=1e-12)
        weights = trimesh.triangles.points_to_barycentric(triangle[None], wanted[None])[0]
        assert in_face == (weights.min() > 1e-9)


def test_a_triangle_pushes_to_the_side_where_the_centre_is():
    corners = (-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (0.0, 1.0, 0.0)
    for side in (1.0, -1.0):
        overlap, normal = sphere_triangle((0.0, 0.0, 0.09 * side), 0.1, *corners)
        assert overlap == pytest.approx(0.01, rel=1e-12)
        assert normal == pytest.approx((0.0, 0.0, side))
    overlap, normal = sphere_triangle((0.0, 0.0, 0.0), 0.1, *corners)
    assert overlap == 0.1
    assert np.abs(normal) == pytest.approx((0.0, 0.0, 1.0))


# ---- the search


def parts_at(position, orientation):
    """Parts that are meshes, at (p, 3) and (p, 4)."""
    p = len(position)
    blank = [np.zeros((3, p)) for _ in range(4)]
    at = np.ascontiguousarray(np.transpose(position)), np.ascontiguousarray(np.transpose(orientation))
    return Parts(*at, *blank, np.ones(p), np.zeros(p), np.zeros(p), np.zeros(p, np.int32))


def spheres_at(position, radius):
    """Shapes and feelers of spheres."""
    n = len(radius)
    zeros = np.zeros(n, np.int32)
    shapes = Shapes(np.zeros((3, n)), radius, radius, zeros, zeros, np.ones((1, 1), bool))
    return shapes, Feelers(np.arange(n, dtype=np.int32), np.zeros((3, n)))


def search(position, radius, meshes, parts, skin):
    """Pairs (sphere, triangle) as the solver lists them."""
    walls, tree = walls_of(meshes, 0.0)
    shapes, feelers = spheres_at(position, radius)
    group = np.zeros(len(meshes), np.int32)
    columns = np.ascontiguousarray(position.T)
    _, first, second = wall_pairs(columns, shapes, feelers, walls, tree, parts, group, skin)
    return list(zip(first.tolist(), second.tolist()))


def test_the_search_finds_exactly_the_pairs_of_all_against_all(rng):
    """Two turned meshes with triangles from 1 to 100, spheres from 1 to 100: the same pairs, each once."""
    meshes, world, position, turns = [], [], [], []
    for n, (count, size) in enumerate([(300, 0.02), (20, 2.0)]):
        middle = rng.uniform(-1, 1, (count, 1, 3))
        vertices = (middle + size * rng.standard_normal((count, 3, 3))).reshape(-1, 3)
        triangles = in_search_order(vertices, np.arange(3 * count).reshape(-1, 3))
        meshes.append(Mesh(n, vertices, triangles))
        turn = Rotation.random(random_state=n)
        position.append(rng.uniform(-1, 1, 3))
        turns.append(turn.as_quat(scalar_first=True))
        world.append((turn.apply(vertices) + position[-1])[triangles])
    centres, radius, skin = rng.uniform(-2, 2, (1500, 3)), 10.0 ** rng.uniform(-2.5, -0.5, 1500), 0.01
    corners = np.concatenate(world)
    expected = []
    for i, centre in enumerate(centres):
        near = trimesh.triangles.closest_point(corners, np.broadcast_to(centre, (len(corners), 3)))
        close = np.linalg.norm(near - centre, axis=1) < radius[i] + skin
        expected += [(i, int(t)) for t in np.flatnonzero(close)]
    assert len(expected) > 300
    assert search(centres, radius, meshes, parts_at(position, turns), skin) == expected


@pytest.mark.parametrize("count", [1, 2, 4, 5, 8, 9, 33])
def test_a_tree_of_any_size_loses_no_triangle(count, rng):
    vertices = rng.standard_normal((3 * count, 3))
    mesh = Mesh(0, vertices, in_search_order(vertices, np.arange(3 * count).reshape(-1, 3)))
    pairs = search(np.zeros((1, 3)), np.array([1e3]), [mesh], parts_at([(0, 0, 0)], [(1, 0, 0, 0)]), 0.0)
    assert pairs == [(0, t) for t in range(count)]


# ---- planes made of triangles


def test_the_ball_around_a_triangle_holds_it_and_little_more(rng):
    vertices = rng.standard_normal((60, 3)) + 1e3
    triangles = rng.permuted(np.tile(np.arange(60), (40, 1)), axis=1)[:, :3]
    walls, _ = walls_of([Mesh(0, vertices, triangles)], spacing=0.0)
    distance = np.linalg.norm(vertices[triangles] - walls.ball[:3].T[:, None], axis=2).max(axis=1)
    assert np.all(distance < walls.ball[3])
    assert np.all(walls.ball[3] < distance + 1e-5)


def test_a_bounce_on_a_mesh_is_the_bounce_on_a_plane(tmp_path):
    """Oblique, spinning, with friction and damping: every quantity to round-off."""
    ends = []
    for mesh in (True, False):
        deck = case(time_step=1e-5, gravity=(0, 0, -9.81), friction=0.4, restitution=0.7, rolling=0.01)
        add_spheres(
            deck, [(0.03, 0.01, 0.0501)], radius=RADIUS, velocity=(0.5, 0.2, -1.0), spin=(3.0, -2.0, 1.0)
        )
        if mesh:
            add_mesh(deck, tmp_path / "sheet.stl", *sheet())
        else:
            add_plane(deck)
        state = start(deck)
        advance(state, 1500)
        p = particles(state)
        ends.append(np.concatenate([p.position[:, 0], p.velocity[:, 0], p.angular_velocity[:, 0]]))
    assert ends[0][5] > 0.5  # it has left again
    # The file is in single precision: its vertices lie 1e-8 m off, but none off the plane.
    assert ends[0] == pytest.approx(ends[1], rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("cells", [3, 12, 120])
def test_a_sphere_that_rolls_over_a_flat_mesh_feels_no_seams(cells, tmp_path):
    """Triangles from 6 radii to a seventh of one: the force stays the weight, the rolling stays the plane's."""
    deck = case(time_step=4e-5, gravity=(0, 0, -9.81), friction=0.5, restitution=0.3)
    add_spheres(
        deck, [(-0.5, 0.013, RADIUS - SINK)], radius=RADIUS, velocity=(2.0, 0.3, 0.0), spin=(-6.0, 40.0, 0.0)
    )
    add_mesh(deck, tmp_path / "sheet.stl", *sheet(cells=cells))
    state = start(deck)
    seen = advance(state, 10000, every=20, probe=lambda s: [*forces_on_first(s), carriers(s)])
    assert np.ptp(seen[:, 2]) < 1e-6 * WEIGHT  # 2 % are asked
    assert np.abs(seen[:, :2]).max() < 1e-6 * WEIGHT  # rolling freely: no friction at any seam
    assert set(seen[:, 3]) <= {0.0, 1.0}  # 0: lists made anew in this very step
    assert particles(state).position[:2, 0] == pytest.approx((0.3, 0.133), abs=1e-6)


def test_friction_goes_on_across_seams(tmp_path):
    """A sphere pushed at its centre by F rolls under a friction of 2/7 F: no seam takes any of it."""
    deck = case(time_step=4e-5, gravity=(0, 0, -9.81), friction=0.5, restitution=0.3)
    ids = add_spheres(deck, [(-0.5, 0.0, RADIUS - SINK)], radius=RADIUS)
    add_mesh(deck, tmp_path / "sheet.stl", *sheet(cells=120))
    push = 0.4 * WEIGHT * np.array([0.8, 0.6, 0.0])
    deck.add("FORCE", rows={"id": ids, "force": [push], "torque": [(0.0, 0.0, 0.0)]})
    state = start(deck)
    seen = advance(state, 10000, every=10, probe=lambda s: forces_on_first(s) - push)
    assert np.linalg.norm(particles(state).position[:, 0] - (-0.5, 0.0, 0.05)) > 0.2  # a dozen triangles
    # The start lets the friction spring swing; it is damped to 1e-6 within a tenth of a second.
    assert seen[300:, :2] == pytest.approx(np.broadcast_to(-2.0 / 7.0 * push[:2], (700, 2)), rel=1e-4)


def test_t_joints_and_repeated_vertices_are_no_seams_either(tmp_path):
    """Three plates that meet in a T, written as separate facets."""
    a = trimesh.Trimesh([(-1, -1, 0), (1, -1, 0), (1, 0, 0), (-1, 0, 0)], [(0, 1, 2), (0, 2, 3)])
    b = trimesh.Trimesh([(-1, 0, 0), (0, 0, 0), (0, 1, 0), (-1, 1, 0)], [(0, 1, 2), (0, 2, 3)])
    c = trimesh.Trimesh([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)])
    deck = case(time_step=4e-5, gravity=(0, 0, -9.81), friction=0.5, restitution=0.3)
    add_spheres(
        deck, [(-0.3, -0.2, RADIUS - SINK)], radius=RADIUS, velocity=(1.5, 1.0, 0.0), spin=(-20.0, 30.0, 0.0)
    )
    mesh = trimesh.util.concatenate([a, b, c])
    add_mesh(deck, tmp_path / "plates.stl", mesh.vertices, mesh.faces)
    state = start(deck)
    seen = advance(state, 10000, every=10, probe=lambda s: [*forces_on_first(s), carriers(s)])
    assert set(seen[:, 3]) <= {0.0, 1.0}  # 0: lists made anew in this very step
    assert np.ptp(seen[:, 2]) < 1e-6 * WEIGHT


def test_a_sphere_at_rest_touches_a_mesh_of_tiny_triangles_once(tmp_path):
    """Some thousand triangles a hundredth of its size lie under the sphere: Hertz for one contact, no more."""
    vertices, triangles = sheet(size=0.02, cells=60)
    deck = case(time_step=1e-5)
    add_spheres(deck, [(0.0, 0.0, 0.99 * RADIUS)], radius=RADIUS)
    add_mesh(deck, tmp_path / "fine.stl", vertices, triangles)
    state = start(deck)
    assert state.lists.walls.contacts.first.size > 1000
    assert carriers(state) == 1
    hertz = 4.0 / 3.0 * MODULUS * np.sqrt(RADIUS) * (0.01 * RADIUS) ** 1.5
    assert forces_on_first(state) == pytest.approx((0.0, 0.0, hertz), rel=1e-9, abs=1e-9 * hertz)


# ---- folds


def wedge(angle, *, length=2.0):
    """Two square plates that rise from the y axis to both sides at `angle` [rad] (falls if negative)."""
    c, s = np.cos(angle), np.sin(angle)
    vertices = [(0, -length, 0), (0, length, 0)]
    for side in (1.0, -1.0):
        vertices += [(side * c, -length, s), (side * c, length, s)]
    return np.array(vertices), [(0, 2, 3), (0, 3, 1), (0, 5, 4), (0, 1, 5)]


def test_both_walls_of_a_corner_push(tmp_path):
    """A sphere that rests in a V of 45 degrees is held by two forces of mg / (2 cos 45)."""
    deck = case(time_step=1e-5, gravity=(0, 0, -9.81))
    each = WEIGHT / np.sqrt(2.0)
    sink = (3.0 * each / (4.0 * MODULUS * np.sqrt(RADIUS))) ** (2.0 / 3.0)
    add_spheres(deck, [(0.0, 0.1, (RADIUS - sink) * np.sqrt(2.0))], radius=RADIUS)
    add_mesh(deck, tmp_path / "v.stl", *wedge(np.pi / 4))
    state = start(deck)
    assert carriers(state) == 2
    # cos 45 in single precision is off by 3e-8, the overlap is a 50th of the radius: 1e-6 and some of the force.
    assert particles(state).force[:, 0] == pytest.approx((0.0, 0.0, 0.0), abs=1e-5 * WEIGHT)
    loads = state.lists.walls.contacts.loads[:3, state.lists.walls.contacts.beside[0] == 1]
    assert np.linalg.norm(loads, axis=0) == pytest.approx(each, rel=1e-5)


@pytest.mark.parametrize("angle", [-0.05, -0.5, -1.2])
def test_a_ridge_touches_once_wherever_the_sphere_is(angle, tmp_path):
    """On the ridge, beside it and on a slope: one contact, the normal that of the nearest point, no jump."""
    forces, depth = [], 1e-3
    places = np.concatenate([np.linspace(-0.06, 0.06, 25), [-1e-9, 1e-9]])
    for x in np.sort(places):
        # Along the line of constant distance from both plates and the ridge.
        reach, slope = RADIUS - depth, abs(angle)
        if abs(x) < reach * np.sin(slope):
            z = np.sqrt(reach**2 - x**2)
        else:
            z = reach / np.cos(slope) - abs(x) * np.tan(slope)
        deck = case(time_step=1e-5)
        add_spheres(deck, [(x, 0.1, z)], radius=RADIUS)
        add_mesh(deck, tmp_path / "ridge.stl", *wedge(angle))
        state = start(deck)
        assert carriers(state) == 1
        forces.append(forces_on_first(state))
    hertz = 4.0 / 3.0 * MODULUS * np.sqrt(RADIUS) * depth**1.5
    assert np.linalg.norm(forces, axis=1) == pytest.approx(hertz, rel=1e-4)


def test_a_chute_of_facets_counts_once(tmp_path):
    """Facets of 6 degrees of a trough, the sphere nearly as wide as it: the force never doubles at a fold."""
    trough, fine = 0.1, np.radians(6.0)
    angle = np.arange(-8, 9) * fine
    ring = trough * np.column_stack([np.sin(angle), -np.cos(angle)])
    vertices = np.array([(x, y, z) for x, z in ring for y in (-1.0, 1.0)])
    triangles = [t for k in range(16) for t in ((2 * k, 2 * k + 2, 2 * k + 3), (2 * k, 2 * k + 3, 2 * k + 1))]
    hertz = 4.0 / 3.0 * MODULUS * np.sqrt(RADIUS) * 1e-3**1.5
    for phi in np.radians(np.linspace(-20, 20, 41)):
        facet = (np.floor(phi / fine) + 0.5) * fine
        # The deepest facet is overlapped by 1 mm.
        away = (trough * np.cos(fine / 2) - (RADIUS - 1e-3)) / np.cos(phi - facet)
        deck = case(time_step=1e-5)
        add_spheres(deck, [(away * np.sin(phi), 0.013, -away * np.cos(phi))], radius=RADIUS)
        add_mesh(deck, tmp_path / "trough.stl", vertices, triangles)
        state = start(deck)
        assert carriers(state) == 1
        assert np.linalg.norm(forces_on_first(state)) == pytest.approx(hertz, rel=1e-4)


def test_a_sphere_in_a_closed_box_never_escapes_and_keeps_its_energy(tmp_path):
    """Elastic, frictionless, 300 bounces in walls of triangles without thickness, corners and edges included."""
    box = trimesh.creation.box((0.3, 0.25, 0.2)).subdivide()
    deck = case(time_step=1e-5)
    add_spheres(deck, [(0.01, 0.02, 0.0)], radius=0.03, velocity=(3.1, 2.3, 1.7), spin=(1.0, 2.0, 3.0))
    add_mesh(deck, tmp_path / "box.stl", box.vertices, box.faces)
    state = start(deck)
    energy = kinetic_energy(state)
    inside = advance(state, 100000, every=100, probe=lambda s: np.abs(particles(s).position[:, 0]).copy())
    assert (inside < np.array([0.15, 0.125, 0.1]) - 0.02).all()
    advance_free(state)
    # Verlet over some 200 Hertz impacts of 150 steps each: errors of 1e-6 each do not add up.
    assert kinetic_energy(state) == pytest.approx(energy, rel=1e-4)


def advance_free(state):
    """Go on until nothing touches, so that all energy is kinetic."""
    for _ in range(1000):
        if not carriers(state):
            return
        advance(state, 10)
    raise AssertionError("the sphere never comes free")


# ---- chutes


@pytest.mark.parametrize(("friction", "share"), [(0.0, 1.0), (0.5, 5.0 / 7.0)])
def test_a_sphere_goes_down_a_chute_at_the_analytic_acceleration(friction, share, tmp_path):
    """a = g sin without friction, 5/7 g sin rolling; the chute is a turned mesh."""
    slope = np.radians(25.0)
    deck = case(time_step=4e-5, gravity=(0, 0, -9.81), friction=friction, restitution=0.3)
    normal = np.array([np.sin(slope), 0.0, np.cos(slope)])
    sink = SINK * np.cos(slope) ** (2.0 / 3.0)
    add_spheres(deck, [(RADIUS - sink) * normal], radius=RADIUS)
    add_mesh(deck, tmp_path / "chute.stl", *sheet(cells=24), point=(0.0, 0.0, 0.0), orientation=tilted(slope))
    state = start(deck)
    advance(state, 5000)
    v = particles(state).velocity[:, 0]
    along = v @ (np.cos(slope), 0.0, -np.sin(slope))
    # Rolling begins within some hundred steps of tangential oscillation.
    assert along == pytest.approx(share * 9.81 * np.sin(slope) * 0.2, rel=1e-3)
    assert abs(v @ normal) < 1e-6


def test_the_part_feels_the_weight_and_its_moment(tmp_path):
    deck = case(time_step=1e-5, gravity=(0, 0, -9.81))
    add_spheres(deck, [(0.3, -0.2, 1.0 + RADIUS - SINK)], radius=RADIUS)
    add_mesh(deck, tmp_path / "sheet.stl", *sheet(), point=(0.0, 0.0, 1.0))
    parts = start(deck).scene.machinery.parts
    assert parts.force[:, 0] == pytest.approx((0.0, 0.0, -WEIGHT), rel=1e-6, abs=1e-9)
    assert parts.torque[:, 0] == pytest.approx((0.2 * WEIGHT, 0.3 * WEIGHT, 0.0), rel=1e-6, abs=1e-9)


# ---- files that are no walls


def deck_with(path, **given):
    deck = case(time_step=1e-5)
    add_spheres(deck, [(0.0, 0.0, 1.0)], radius=RADIUS)
    deck.add("PART", name="chute", shape="MESH", input=str(path), material="stuff", **given)
    return deck


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("hello", "no triangle"),
        ("solid a\nendsolid a\n", "no triangle"),
        (
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 2 0 0\nendloop\nendfacet\n"
            "endsolid a\n",
            "1 triangles without area (the first is number 1)",
        ),
        (
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex nan 1 0\nendloop\nendfacet\n"
            "endsolid a\n",
            "NaN or infinite",
        ),
    ],
)
def test_a_file_that_is_no_wall_is_refused_with_its_line(text, found, tmp_path):
    (tmp_path / "chute.stl").write_text(text)
    with pytest.raises(CommandError) as refusal:
        build(deck_with(tmp_path / "chute.stl"))
    assert found in str(refusal.value)
    assert "INPUT=" in str(refusal.value)
    assert ", expected " in str(refusal.value)


@pytest.mark.parametrize(
    ("name", "given", "found"),
    [
        ("cut.stl", {}, "INPUT=.*cut.stl with 14 of the 20 triangles of its header, expected a whole file"),
        (
            "cut.stl",
            {"file_type": "stl_ascii"},
            "INPUT=.*cut.stl with no endsolid at its end, expected a whole",
        ),
        (
            "cut.ply",
            {"encoding": "ascii"},
            "INPUT=.*cut.ply with 1[0-9] of the 20 faces of its header, expected",
        ),
    ],
)
def test_a_file_that_was_cut_off_is_refused_with_what_is_missing(name, given, found, tmp_path):
    import trimesh

    path = tmp_path / name
    trimesh.creation.icosahedron().export(path, **given)
    deck = case(time_step=1e-5)
    deck.add("PART", name="chute", shape="MESH", input=str(path), material="stuff")
    whole = path.read_bytes()
    lines = whole.splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:-3]) if given else whole[: 84 + 50 * 14 + 20])
    with pytest.raises(CommandError, match=found):
        build(deck)


def test_a_file_of_an_unknown_kind_is_refused(tmp_path):
    (tmp_path / "chute.dwg").write_bytes(b"AC1032" + bytes(100))
    with pytest.raises(CommandError, match=r"chute\.dwg with no mesh .*expected an STL, OBJ or PLY file"):
        build(deck_with(tmp_path / "chute.dwg"))


def test_a_mesh_without_a_unit_is_said_to_be_in_metres(tmp_path):
    import trimesh

    from beltsim.scene.machinery import unit_warnings

    deck = case(time_step=1e-5)
    trimesh.creation.box((1200.0, 30.0, 2.0)).export(tmp_path / "chute.stl")
    for name, given in (("a", {}), ("b", {"unit": "MM"})):
        path = str(tmp_path / "chute.stl")
        deck.add("PART", name=name, shape="MESH", input=path, material="stuff", **given)
    (warning,) = unit_warnings(deck, build(deck).machinery)
    assert "chute.stl is read in metres, so it measures 1200 x 30 x 2 m; UNIT=M or UNIT=MM" in warning


def test_units_scale_a_mesh(tmp_path):
    trimesh.creation.box((1000, 2000, 3000)).export(tmp_path / "chute.stl")
    walls = build(deck_with(tmp_path / "chute.stl", unit="mm")).machinery.walls
    assert np.ptp(walls.vertex, axis=1) == pytest.approx((1.0, 2.0, 3.0))
    assert walls.vertex.shape[1] == 8  # the corners that an STL repeats are one again


@pytest.fixture
def rng():
    return np.random.default_rng(7)
