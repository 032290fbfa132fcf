"""Rays find the true surfaces, the camera frames everything, and pictures show what is there."""

import io

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("embreex")
Image = pytest.importorskip("PIL.Image")
trimesh = pytest.importorskip("trimesh")

from beltsim.view import Boxes, Camera, Cylinders, Legend, Mesh, Scenery, Section, Spheres, light  # noqa: E402
from beltsim.view import png as png_module  # noqa: E402
from beltsim.view.camera import HalfSpace, place, view_axes  # noqa: E402
from beltsim.view.colours import colour_map, from_hex  # noqa: E402
from beltsim.view.errors import NothingToDraw, ViewProblem  # noqa: E402
from beltsim.view.png import SAMPLES, render, render_png  # noqa: E402
from beltsim.view.scenery import bounds, extremes  # noqa: E402
from beltsim.view.seams import DEPTH, seams  # noqa: E402
from beltsim.view.shapes import ball_hull, box_corners, prism_corners, triangles  # noqa: E402
from beltsim.view.trace import FAR, Caster  # noqa: E402

UPRIGHT = np.array([1.0, 0, 0, 0])
RED, BLUE = (0.8, 0.1, 0.1), (0.1, 0.1, 0.8)
FRONT = Camera(azimuth=-90, elevation=0, orthographic=True)  # looks along +y: right is +x, up is +z


def ball(position, radius=1.0, colour=RED):
    return Spheres(np.reshape(position, (-1, 3)), radius, colour)


def box(position, size, colour=RED, edge_radius=0.0, orientation=UPRIGHT):
    return Boxes(np.reshape(position, (1, 3)), orientation, size, edge_radius, colour)


def scattered(count, seed=1):
    rng = np.random.default_rng(seed)
    turn = rng.normal(size=(count, 4))
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    return rng.uniform(-1, 1, (count, 3)), turn, rng


def rays_inward(count, seed=2):
    rng = np.random.default_rng(seed)
    origin = rng.normal(size=(count, 3))
    origin *= 5 / np.linalg.norm(origin, axis=1, keepdims=True)
    direction = rng.uniform(-1, 1, (count, 3)) - origin
    return origin, direction / np.linalg.norm(direction, axis=1, keepdims=True)


# ---- rays against analytic surfaces


def distances_to_balls(origin, direction, centre, radius):
    """Ray by ray, ball by ball: the smaller root of |o + t d - c| = r."""
    b = np.einsum("rsi,ri->rs", centre[None] - origin[:, None], direction)
    c = np.sum((centre[None] - origin[:, None]) ** 2, axis=2) - radius**2
    root = b**2 - c
    return np.where(root > 0, b - np.sqrt(np.maximum(root, 0)), np.inf)


def test_rays_meet_spheres_where_the_quadratic_says():
    centre, _, rng = scattered(60)
    radius = rng.uniform(0.05, 0.4, 60)  # many overlap and touch, so hulls hide one another
    caster = Caster(Scenery([ball(centre[:30], radius[:30]), ball(centre[30:], radius[30:])]))
    origin, direction = rays_inward(4000)
    hits = caster.nearest(origin, direction)
    expected = distances_to_balls(origin, direction, centre, radius)
    first = expected.argmin(axis=1)
    met = np.isfinite(expected.min(axis=1))
    # Embree's float32 hulls have edges of finite width: one ray in a thousand may slip by.
    agree = (hits.item >= 0) == met
    assert agree.mean() > 0.999
    both = agree & met
    assert both.sum() > 1000
    same = hits.item[both] * 30 + hits.solid[both] == first[both]
    assert same.mean() > 0.999
    assert np.allclose(hits.distance[both][same], expected.min(axis=1)[both][same], atol=1e-9)


def test_rays_meet_sharp_boxes_where_the_slabs_say():
    centre, turn, _ = scattered(1)
    size = np.array([0.8, 0.5, 0.3])
    solid = Boxes(centre, turn, size, 0.0, RED)
    origin, direction = rays_inward(2000)
    hits = Caster(Scenery([solid])).nearest(origin, direction)
    rotation = trimesh.transformations.quaternion_matrix(turn[0])[:3, :3]
    o, d = (origin - centre) @ rotation, direction @ rotation
    slabs = np.sort([(-size / 2 - o) / d, (size / 2 - o) / d], axis=0)
    enter, leave = slabs[0].max(axis=1), slabs[1].min(axis=1)
    met = hits.item >= 0
    assert np.array_equal(met, enter < leave)
    assert np.allclose(hits.distance[met], enter[met], atol=3e-6)  # float32 at 5 m


def test_rays_meet_cylinders_within_the_sagitta_of_the_prism():
    roll = Cylinders(np.zeros((1, 3)), UPRIGHT, 1.0, 2.0, RED)
    angle = np.linspace(0, 2 * np.pi, 999)
    outward = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    caster = Caster(Scenery([roll]))
    hits = caster.nearest(3 * outward, -outward)
    normal, leave = caster.smooth_normals(hits, -outward)
    assert np.all(np.abs(3 - hits.distance - 0.5) <= 0.5 * (1 - np.cos(np.pi / 64)) + 1e-6)
    assert np.allclose(normal, outward, atol=1e-6)
    assert np.all(
        np.linalg.norm(leave[:, :2], axis=1) > 0.5
    )  # rays that leave cannot meet their own cylinder


def test_normals_on_a_rounded_edge_point_away_from_the_core():
    solid = box([0, 0, 0], [2, 2, 2], edge_radius=0.5)
    caster = Caster(Scenery([solid]))
    direction = -np.array([[1.0, 0, 1.0], [1, 1, 1], [0, 0, 1]])
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    hits = caster.nearest(-5 * direction, direction)
    assert np.allclose(caster.smooth_normals(hits, direction)[0], -direction, atol=1e-6)


def test_an_obstacle_blocks_only_within_its_distance():
    caster = Caster(Scenery([ball([0, 0, 5])]))
    origin, direction = np.zeros((1, 3)), np.array([[0.0, 0, 1]])
    reach = ball_hull()[2]
    assert not caster.blocked(origin, direction, 5 - reach - 0.01)
    assert caster.blocked(origin, direction, 4.01)
    assert not caster.blocked(origin, -direction, 100)


# ---- solids as triangles


@settings(deadline=None, max_examples=25)
@given(st.tuples(*[st.floats(0.5, 3)] * 3), st.floats(0.01, 0.24))
def test_a_bevelled_box_has_the_volume_of_its_core_grown_by_an_octahedron(size, edge):
    corners, faces = box_corners(box([1, 2, 3], size, edge_radius=edge, orientation=[0.5, 0.5, 0.5, 0.5]))
    mesh = trimesh.Trimesh(corners[0], faces, process=False)
    a, b, c = np.array(size) - 2 * edge
    steiner = a * b * c + 2 * edge * (a * b + b * c + c * a) + 2 * edge**2 * (a + b + c) + 4 / 3 * edge**3
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(steiner, rel=1e-9)  # positive: the faces look outward


def test_the_prism_of_a_cylinder_is_closed_and_has_the_inscribed_volume():
    corners, faces = prism_corners(Cylinders(np.zeros((1, 3)), [0.6, 0.8, 0, 0], 2.0, 3.0, RED))
    mesh = trimesh.Trimesh(corners[0], faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(3 * 32 * np.sin(2 * np.pi / 64), rel=1e-9)


def test_the_hull_of_a_sphere_holds_it():
    soup, count = triangles(ball([0, 0, 0], 2.0))
    normal = np.cross(soup[:, 1] - soup[:, 0], soup[:, 2] - soup[:, 0])
    away = np.einsum("ni,ni->n", normal, soup[:, 0]) / np.linalg.norm(normal, axis=1)
    assert count == len(soup) == 80
    assert away.min() == pytest.approx(2.0)


# ---- camera

frames = st.builds(
    Camera,
    azimuth=st.one_of(st.none(), st.floats(-180, 180)),
    elevation=st.floats(-90, 90),
    orthographic=st.booleans(),
)


@settings(deadline=None, max_examples=40)
@given(frames, st.integers(0, 99), st.floats(0.3, 3))
def test_the_frame_holds_every_point_and_touches_its_margin(camera, seed, aspect):
    centre = np.random.default_rng(seed).normal(size=(10, 3)) * [10, 1, 0.5]
    points = extremes(ball(centre, 0.3)).reshape(-1, 3)
    everything = np.array([points.min(axis=0), points.max(axis=0)])
    axes = view_axes(camera, np.ptp(everything, axis=0))
    margin = np.array([0.03, 0.2, 0.1, 0.05])
    view = place(camera, axes, points, everything, aspect, margin)
    local = (points - view.eye) @ axes.T
    assert np.all(local[:, 2] < 0)  # in front of the eye
    scale = view.half * (1 if camera.orthographic else -local[:, 2:])
    seen = local[:, :2] / scale
    low, high = seen.min(axis=0), seen.max(axis=0)
    free_low, free_high = np.array([-1 + 0.06, -1 + 0.2]), np.array([1 - 0.4, 1 - 0.1])
    assert np.all(low >= free_low - 1e-9)
    assert np.all(high <= free_high + 1e-9)
    slack = np.minimum(low - free_low, free_high - high)
    assert slack.min() < 1e-6


def test_rays_go_through_the_points_that_the_view_projects_there():
    for camera in (FRONT, Camera(azimuth=20, elevation=30)):
        scenery = Scenery([box([1, 2, 3], [4, 1, 1])])
        axes = view_axes(camera, np.ptp(bounds(scenery), axis=0))
        corners = extremes(scenery.items[0]).reshape(-1, 3)
        view = place(camera, axes, corners, bounds(scenery), 1.5, np.zeros(4))
        local = (corners - view.eye) @ axes.T
        seen = local[:, :2] / (view.half * (1 if camera.orthographic else -local[:, 2:]))
        origin, direction = view.rays(*seen.T)
        miss = np.linalg.norm(np.cross(corners - origin, direction), axis=1)
        assert np.all(miss < 1e-9)


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 2), st.floats(-1, 1), st.sampled_from([-1.0, 1.0]), st.integers(0, 999))
def test_a_ray_is_left_to_see_exactly_within_its_interval(axis, value, side, seed):
    rng = np.random.default_rng(seed)
    origin, direction = rng.normal(size=(1, 3)), rng.normal(size=(1, 3))
    enter, leave = HalfSpace(axis, value, side).interval(origin, direction)
    distance = np.linspace(0.005, 20, 400)
    beyond = side * (origin[0, axis] + distance * direction[0, axis] - value)
    clear = np.abs(beyond) > 1e-9
    inside = (distance > enter) & (distance < leave)
    assert np.array_equal(inside[clear], (beyond < 0)[clear])


# ---- pictures


def covered(pixels):
    """Pixels that differ from the left edge of their row: the background changes only from top to bottom."""
    return np.any(pixels != pixels[:, :1], axis=2)


def test_a_sphere_covers_its_circle_of_pixels():
    pixels = render(Scenery([ball([3, 1, 2], 0.7)]), width=300, height=200, camera=FRONT, ground=False)
    radius = 0.9 * 200 / 2  # the margins above and below are 5 %
    row, column = np.mgrid[:200, :300] + 0.5
    away = np.hypot(row - 100, column - 150)
    reach = np.hypot(*SAMPLES[0])  # a pixel is seen by its samples, which lie this far off its middle
    mask = covered(pixels)
    assert mask[away < radius - reach].all()
    assert not mask[away > radius + reach].any()
    assert mask.sum() == pytest.approx(np.pi * radius**2, abs=2 * np.pi * radius * reach)


@pytest.mark.parametrize("camera", [FRONT, Camera(azimuth=-90, elevation=0)])
def test_the_nearer_box_hides_the_farther(camera):
    near, far = [0, -1, 0], [0, 1, 0]
    for first, hidden in ((RED, 2), (BLUE, 0)):
        second = BLUE if first is RED else RED
        scenery = Scenery([box(far, [1, 1, 1], second), box(near, [1.2, 1, 1.2], first)])
        pixels = render(scenery, width=160, height=120, camera=camera, ground=False).astype(int)
        shown = covered(pixels)
        assert shown.sum() > 1000
        assert np.all(pixels[shown][:, 2 - hidden] >= pixels[shown][:, hidden])


@pytest.mark.parametrize("section", [None, Section(0, 0.1)])
def test_everything_stays_off_the_picture_edge(section):
    centre, turn, _ = scattered(20)
    items = [
        ball(centre, 0.2),
        Boxes(centre * 2, turn, [0.5, 0.3, 0.1], 0.02, BLUE),
        Cylinders(centre * 3, turn, 0.3, 1.0, RED),
        Mesh(centre * 4, [[0, 1, 2], [3, 4, 5]], BLUE),
    ]
    pixels = render(Scenery(items), width=160, height=120, ground=False, section=section)
    mask = covered(pixels)
    assert mask.any()
    assert not np.concatenate([mask[0], mask[-1], mask[:, -1]]).any()


def test_colours_keep_their_hue():
    for colour in (RED, BLUE, (0.1, 0.7, 0.2)):
        pixels = render(Scenery([ball([0, 0, 0], 1, colour)]), width=80, height=80, camera=FRONT)
        assert pixels[40, 40].argmax() == np.argmax(colour)


def test_the_key_light_comes_from_the_upper_left():
    pixels = render(Scenery([ball([0, 0, 0])]), width=80, height=80, camera=FRONT).sum(axis=2)
    assert pixels[25, 25] > pixels[40, 40] > pixels[60, 58]


def test_a_roof_takes_sky_and_sun_from_what_lies_below():
    floor, roof = box([0, 0, 0], [10, 10, 0.1]), box([0, 0, 1], [4, 4, 0.1])
    caster = Caster(Scenery([floor, roof]))
    points = np.array([[0, 0, 0.06], [4.5, 4.5, 0.06]])
    up, turn = np.tile([0.0, 0, 1], (2, 1)), np.zeros(2)
    below, beside = light.skylight(caster, points, up, turn, 0, 4, 100.0)
    assert 0 <= below < beside <= light.SKY
    assert light.sunlit(caster, points, np.array([0.0, 0, 1]), turn, 0, 4).tolist() == [False, True]


def test_open_sky_and_open_ground_give_their_light_exactly():
    caster = Caster(Scenery([ball([0, 0, -100])]))
    up, down = np.array([[0.0, 0, 1]]), np.array([[0.0, 0, -1]])
    # Cosine-weighted directions lie 2/3 up on average; the spiral of 48 hits that within 1 %.
    share = 0.5 + 0.5 * 2 / 3
    for normal, part in ((up, share), (down, 1 - share)):
        sky = np.mean([light.skylight(caster, up, normal, np.zeros(1), k, 4, 1.0) for k in range(4)])
        assert sky == pytest.approx(light.BOUNCE + (light.SKY - light.BOUNCE) * part, rel=0.01)
    assert pytest.approx(light.BOUNCE + (light.SKY - light.BOUNCE) * share) == light.OPEN


def test_the_floor_darkens_only_near_the_scenery():
    scenery = Scenery([ball([0, 0, 0])])
    wide = Camera(zoom=(-5, -5, -1, 5, 5, 1))
    lit = render(scenery, width=120, height=80, camera=wide, ground=False).astype(int)
    shaded = render(scenery, width=120, height=80, camera=wide).astype(int)
    assert np.all(shaded <= lit + 1)
    assert np.any(shaded < lit - 20)
    assert np.array_equal(shaded[:5], lit[:5])


def test_a_section_opens_a_shell_of_boxes_and_cuts_solids_flat():
    core, shell = ball([0, 0, 0], 0.5, BLUE), box([0, 0, 0], [2, 2, 2], RED)
    caster = Caster(Scenery([core, shell]), Section(1, 0.0).left(np.array([0.0, -1, 0])))
    origin, direction = np.array([[0.0, -5, 0], [0.9, -5, 0], [1.5, -5, 0]]), np.tile([0.0, 1, 0], (3, 1))
    hits = caster.nearest(origin, direction)
    assert hits.item.tolist() == [0, 1, -1]
    assert hits.distance[:2] == pytest.approx([5, 5])  # both at the plane, where they are cut
    assert np.allclose(caster.smooth_normals(hits.only([0, 1]), direction[:2])[0], [0, -1, 0])


def test_a_section_finds_the_solid_around_an_overlapping_one():
    first, second = box([0, 0, 0], [2, 2, 2]), box([0, 1.5, 0], [1, 2, 1], BLUE)
    caster = Caster(Scenery([first, second]), Section(1, 0.0).left(np.array([0.0, -1, 0])))
    hits = caster.nearest(np.array([[0.0, -5, 0]]), np.array([[0.0, 1, 0]]))
    assert (hits.item[0], hits.distance[0]) == (0, pytest.approx(5))


def test_the_camera_faces_a_section_unless_told_where_to_stand():
    assert Section(0, 0.0).facing(Camera()).azimuth == -25
    assert Section(1, 0.0).facing(Camera(elevation=5)) == Camera(azimuth=-65, elevation=5)
    assert Section(2, 0.0).facing(Camera()) == Camera()
    assert Section(0, 0.0).facing(Camera(azimuth=80)).azimuth == 80


def test_the_floor_goes_on_where_a_section_hides_what_stood_on_it():
    scenery, camera = Scenery([box([0, 0, 0], [2, 2, 2])]), Camera(elevation=60, azimuth=-30)
    whole = render(scenery, width=120, height=80, camera=camera)
    open_ = render(scenery, width=120, height=80, camera=camera, section=Section(0, 0.0))
    bare = render(scenery, width=120, height=80, camera=camera, section=Section(0, 0.0), ground=False)
    # Far from the box there is no shadow; twelve sky rays miss the mean by less than one step of 255.
    assert np.allclose(whole[:, 0].astype(int), bare[:, 0], atol=1)
    right = np.argwhere(covered(bare))[:, 1].max() + 2
    assert np.any(open_[40, right:] < bare[40, right:])


def test_what_a_section_hides_casts_no_shadow():
    floor, roof = box([0, 0, 0], [10, 10, 0.1]), box([0, 0, 3], [10, 10, 0.1])
    caster = Caster(Scenery([floor, roof]), HalfSpace(2, 1.0, 1.0))
    assert not caster.blocked(np.array([[0.0, 0, 0.06]]), np.array([[0.0, 0, 1]]), 100.0)


def png_of(scenery, width=160, height=90, **options):
    stream = io.BytesIO()
    render_png(scenery, stream, width=width, height=height, **options)
    return stream.getvalue()


def made_scenery():
    centre, turn, _ = scattered(30)
    items = [
        ball(centre, 0.1),
        Boxes(centre + 1, turn, 0.2, 0.05, BLUE),
        Cylinders(centre - 1, turn, 0.1, 0.5, RED),
    ]
    return Scenery(items, Legend("speed, m/s", 0, 2.5), "t = 1 s")


def test_the_same_scenery_gives_the_same_bytes_whatever_the_chunks(monkeypatch):
    first = png_of(made_scenery())
    assert png_of(made_scenery()) == first
    monkeypatch.setattr(png_module, "CHUNK", 160)
    assert png_of(made_scenery()) == first


def test_the_colour_bar_shows_its_map_from_bottom_to_top():
    pixels = np.asarray(Image.open(io.BytesIO(png_of(made_scenery(), 480, 270)))).astype(int)
    low, high = (255 * colour_map("viridis", [0.02, 0.98], 0, 1)).astype(int)
    places = [np.argwhere(np.abs(pixels - end).sum(axis=2) < 25) for end in (low, high)]
    below, above = (rows[rows[:, 1] > 400] for rows in places)
    assert below[:, 0].min() > above[:, 0].max()


def test_caption_and_colour_bar_leave_the_scenery_free():
    scenery = made_scenery()
    bare = Scenery(scenery.items)
    with_text = np.asarray(Image.open(io.BytesIO(png_of(scenery, ground=False))))
    traced = render(scenery, width=160, height=90, ground=False)
    written = np.any(with_text != traced, axis=2)
    assert written.any()
    assert not (written & covered(traced)).any()
    assert covered(render(bare, width=160, height=90, ground=False)).sum() > covered(traced).sum()


def test_lines_show_where_flat_faces_meet_unless_boxes_are_tiny():
    caster = Caster(Scenery([box([0, 0, 0], [1.2, 1.2, 0.2], edge_radius=0.1)]))
    x = np.array([0.0, 0.49, 0.499, 0.53])  # the flat face ends at 0.5
    origin, down = np.column_stack([x, 0 * x, 0 * x + 5]), np.tile([0.0, 0, -1], (4, 1))
    hits = caster.nearest(origin, down)
    kept = seams(caster, hits, np.full(4, 0.01))
    assert kept == pytest.approx([1, 1, 1 - DEPTH, 1])
    assert seams(caster, hits, np.full(4, 0.5)) == pytest.approx([1, 1, 1, 1])
    side = caster.nearest(np.array([[5.0, 0, 0]]), np.array([[-1.0, 0, 0]]))
    assert seams(caster, side, np.array([0.01])) == 1


# ---- wrong input


@pytest.mark.parametrize("text", ["q=1", "x", "x=", "x=nan", "1.2", "xy=1"])
def test_a_section_that_names_no_plane_is_refused(text):
    with pytest.raises(ViewProblem, match="expected"):
        Section.parse(text)


def test_wrong_wishes_are_refused():
    scenery = Scenery([ball([0, 0, 0])])
    with pytest.raises(ViewProblem, match="64 to 20000"):
        render(scenery, width=5, height=90)
    with pytest.raises(ViewProblem, match="elevation"):
        Camera(elevation=91)
    with pytest.raises(ViewProblem, match="azimuth"):
        Camera(azimuth=float("nan"))
    with pytest.raises(ViewProblem, match="zoom"):
        Camera(zoom=(0, 0, 0, 1, 1, 0))
    with pytest.raises(ViewProblem, match="edge-on"):
        render(scenery, section=Section(0, 0.0), camera=FRONT)
    with pytest.raises(NothingToDraw, match="section hides"):
        render(scenery, section=Section(1, 9.0), camera=FRONT)
    with pytest.raises(NothingToDraw, match="empty"):
        render(Scenery([Spheres(np.zeros((0, 3)), 1.0, RED)]))


def test_wrong_data_are_refused():
    with pytest.raises(ViewProblem, match="Spheres position: found NaN"):
        ball([0, 0, np.nan])
    with pytest.raises(ViewProblem, match=r"Boxes size: found shape \(2,\), expected \(1, 3\)"):
        box([0, 0, 0], [1, 2])
    with pytest.raises(ViewProblem, match="Mesh faces: found vertex 3"):
        Mesh(np.eye(3), [[0, 1, 3]], RED)
    with pytest.raises(ViewProblem, match="#cc3333"):
        from_hex("red")
    with pytest.raises(ViewProblem, match="viridis"):
        colour_map("rainbow", [1], 0, 1)


def test_rays_that_meet_nothing_say_so():
    hits = Caster(Scenery([ball([0, 0, 0])])).nearest(np.array([[5.0, 0, 0]]), np.array([[1.0, 0, 0]]))
    assert hits.item.tolist() == [-1]
    assert hits.distance[0] == FAR
