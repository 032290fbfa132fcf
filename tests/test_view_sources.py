"""Decks and frames become pictures and pages; `beltsim view` draws them and refuses what cannot be drawn."""

import base64
import json
import re
import sys

import numpy as np
import pytest
from click.testing import CliRunner

pytest.importorskip("embreex")
Image = pytest.importorskip("PIL.Image")

from beltsim import inp  # noqa: E402
from beltsim.trajectory import Contents, Frame, PartDescription, TrajectoryWriter, read  # noqa: E402
from beltsim.view import Boxes, Camera, Cylinders, Legend, Mesh, Scenery, Spheres  # noqa: E402
from beltsim.view.cli import view_command  # noqa: E402
from beltsim.view.colours import RUBBER, STEEL, colour_map, from_hex  # noqa: E402
from beltsim.view.deck import scenery_of_deck  # noqa: E402
from beltsim.view.errors import NothingToDraw, ViewProblem  # noqa: E402
from beltsim.view.frame import scenery_of_frame  # noqa: E402
from beltsim.view.html import html_of, render_html  # noqa: E402
from beltsim.view.values import largest_of_bonds  # noqa: E402

UPRIGHT = np.array([1.0, 0, 0, 0])


def kinds(scenery):
    """Count of solids of each kind in a scenery."""
    count = {Boxes: 0, Spheres: 0, Cylinders: 0, Mesh: 0}
    for item in scenery.visible():
        count[type(item)] += len(item.faces if isinstance(item, Mesh) else item.position)
    return {kind.__name__: number for kind, number in count.items() if number}


def of_kind(scenery, kind):
    return next(item for item in scenery.visible() if isinstance(item, kind))


# ---- decks


def row_of(n, first=1, height=0.0):
    position = np.column_stack([0.1 * np.arange(n), np.zeros(n), np.full(n, height)])
    return {"id": first + np.arange(n), "position": position, "orientation": np.tile(UPRIGHT, (n, 1))}


@pytest.fixture
def deck():
    """Six belt boxes in two fibres, bonded by 2 % of strain, three spheres, an idler, two parts."""
    deck = inp.Deck()
    deck.add("FORMAT", name="BELTSIM", version=1)
    deck.add("MATERIAL", name="rubber", density=1200, youngs_modulus=5e6, poisson_ratio=0.45)
    for name in ("fibre_001", "fibre_002"):
        sizes = {"size_x": 0.11, "size_y": 0.2, "size_z": 0.02, "edge_radius": 0.005}
        deck.add("PARTICLE TYPE", name=name, shape="ROUNDED BOX", material="rubber", **sizes)
    deck.add("PARTICLE TYPE", name="coal", shape="SPHERE", radius=0.03, material="rubber", color="#cc3333")
    deck.add("PARTICLE TYPE", name="idler", shape="CYLINDER", diameter=0.1, length=0.3, material="rubber")
    for k, name in enumerate(("fibre_001", "fibre_002")):
        rows = {column: values[k::2] for column, values in row_of(6).items()}
        deck.add("PARTICLE", type=name, rows=rows)
    deck.add("PARTICLE", type="coal", rows=row_of(3, 11, 0.1))
    deck.add("PARTICLE", type="idler", rows=row_of(1, 21, -0.1))
    sizes = {"id": [2], "size": [[0.3, 0.2, 0.1]], "mass": [1.0], "inertia": [[1, 1, 1.0]]}
    deck.add("PARTICLE SIZE", rows=sizes)
    deck.add(
        "BOND TYPE",
        name="cord",
        section_width=0.2,
        section_thickness=0.01,
        youngs_modulus=1e8,
        poisson_ratio=0.3,
    )
    state = np.tile(UPRIGHT, (5, 1))
    bonds = {
        "particles": np.column_stack([np.arange(1, 6), np.arange(2, 7)]),
        "position_1": np.zeros((5, 3)),
        "orientation_1": state,
        "position_2": np.tile([0.1 / 1.02, 0, 0], (5, 1)),
        "orientation_2": state,
    }
    deck.add("BOND", type="cord", rows=bonds)
    pulley = {"position": [[1.0, 0, 0]], "orientation": [[np.sqrt(0.5), np.sqrt(0.5), 0, 0]]}
    deck.add(
        "PART",
        name="head",
        shape="CYLINDER",
        diameter=0.4,
        length=0.5,
        material="rubber",
        color="#336699",
        rows=pulley,
    )
    floor = {"position": [[0, 0, -0.5]], "orientation": [UPRIGHT]}
    deck.add("PART", name="floor", shape="PLANE", material="rubber", rows=floor)
    return deck


def test_every_particle_and_part_of_a_deck_is_drawn_with_its_own_sizes(deck):
    scenery = scenery_of_deck(deck)
    assert kinds(scenery) == {"Boxes": 6, "Spheres": 3, "Cylinders": 2, "Mesh": 2}
    belt = of_kind(scenery, Boxes)
    at_second = np.flatnonzero(np.isclose(belt.position[:, 0], 0.1))
    assert belt.size[at_second].tolist() == [[0.3, 0.2, 0.1]]  # *PARTICLE SIZE beats the type
    assert np.all(np.delete(belt.size, at_second, axis=0) == [0.11, 0.2, 0.02])
    assert np.all(belt.edge_radius == 0.005)
    assert np.all(of_kind(scenery, Spheres).radius == 0.03)
    rolls = np.concatenate([item.diameter for item in scenery.visible() if isinstance(item, Cylinders)])
    assert sorted(rolls) == [0.1, 0.4]
    assert scenery.legend is None


def test_a_deck_shows_the_colours_that_it_names(deck):
    scenery = scenery_of_deck(deck)
    assert np.allclose(of_kind(scenery, Boxes).colour, RUBBER)
    coal = of_kind(scenery, Spheres).colour / from_hex("#cc3333")
    assert np.all((coal >= 0.85) & (coal <= 1.15))
    rolls = [item.colour[0] for item in scenery.visible() if isinstance(item, Cylinders)]
    assert np.allclose(rolls, [STEEL, from_hex("#336699")])


def test_fibres_differ_and_leave_bulk_alone(deck):
    fibre, kind = scenery_of_deck(deck, "fibre"), scenery_of_deck(deck, "type")
    own = scenery_of_deck(deck)
    assert len(np.unique(of_kind(fibre, Boxes).colour, axis=0)) == 2
    assert np.array_equal(of_kind(fibre, Spheres).colour, of_kind(own, Spheres).colour)
    assert len(np.unique(of_kind(kind, Spheres).colour, axis=0)) == 1


def test_strain_is_the_length_over_the_stress_free_length(deck):
    scenery = scenery_of_deck(deck, "strain")
    assert scenery.legend.label == "strain, %"
    assert (scenery.legend.low, scenery.legend.high) == (pytest.approx(-2), pytest.approx(2))
    top = colour_map("coolwarm", [1.0], 0, 1)[0]
    assert np.allclose(of_kind(scenery, Boxes).colour, top)
    assert np.array_equal(of_kind(scenery, Spheres).colour, of_kind(scenery_of_deck(deck), Spheres).colour)


@pytest.mark.parametrize(
    ("layer", "gone"), [("belt", {"Boxes"}), ("bulk", {"Spheres"}), ("parts", {"Cylinders", "Mesh"})]
)
def test_hidden_layers_are_gone_and_the_others_stay(deck, layer, gone):
    everything = kinds(scenery_of_deck(deck))
    left = kinds(scenery_of_deck(deck, hide=frozenset([layer])))
    assert left == {kind: number for kind, number in everything.items() if kind not in gone}


def test_a_mesh_part_is_read_scaled_and_moved(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box([1000, 2000, 3000]).export(tmp_path / "chute.stl")
    text = (
        "*FORMAT, NAME=BELTSIM, VERSION=1\n*MATERIAL, NAME=s, DENSITY=1, YOUNGS MODULUS=1, POISSON RATIO=0.3\n"
        "*PART, NAME=chute, SHAPE=MESH, INPUT=chute.stl, UNIT=mm, MATERIAL=s\n5, 0, 0, 1, 0, 0, 0\n"
    )
    (tmp_path / "case.inp").write_text(text)
    mesh = of_kind(scenery_of_deck(inp.read(tmp_path / "case.inp")), Mesh)
    assert np.allclose(
        [mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)], [[4.5, -1, -1.5], [5.5, 1, 1.5]]
    )
    (tmp_path / "chute.stl").write_text("not a mesh at all")
    with pytest.raises(ViewProblem, match=r"chute\.stl: found no triangle"):
        scenery_of_deck(inp.read(tmp_path / "case.inp"))


def test_the_largest_bond_decides_a_particle_and_none_is_nan():
    bonds, values = np.array([[0, 1], [1, 2], [2, 0]]), np.array([0.5, -2.0, 1.0])
    assert largest_of_bonds(4, bonds, values)[:3].tolist() == [1.0, -2.0, -2.0]
    assert np.isnan(largest_of_bonds(4, bonds, values)[3])
    rng = np.random.default_rng(0)
    bonds, values = rng.integers(0, 40, (200, 2)), rng.normal(size=200)
    expected = [max(values[(bonds == k).any(axis=1)], key=abs) for k in range(40)]
    assert largest_of_bonds(40, bonds, values).tolist() == expected


# ---- frames


@pytest.fixture
def case(tmp_path):
    """Two frames: a bonded belt of four boxes that speeds up, two spheres, one idler, a pulley that moves."""
    half = np.array([[0.055, 0.1, 0.01]] * 4 + [[0.03] * 3] * 2 + [[0.05, 0.05, 0.15]])
    contents = Contents(
        slots=7,
        species=("belt", "coal", "idler"),
        shapes=("ROUNDED BOX", "SPHERE", "CYLINDER"),
        colors=("", "", "#112233"),
        id=np.arange(7) + 1,
        species_of=np.array([0, 0, 0, 0, 1, 1, 2]),
        mass=np.ones(7),
        radius=half[:, 0],
        half_extent=half,
        edge_radius=np.array([0.005] * 4 + [0] * 3),
        bonds=np.array([[0, 1], [1, 2], [2, 3]]),
        parts=(PartDescription("head", "CYLINDER", "PULLEY", {"diameter": 0.4, "length": 0.5}),),
        fields=frozenset(["VELOCITY", "ORIENTATION", "BOND STRAIN"]),
    )
    with TrajectoryWriter(tmp_path / "case.h5", contents, planned_frames=2) as writer:
        for k in range(2):
            writer.append(made_frame(k))
    return tmp_path / "case.h5"


def made_frame(k):
    position = np.column_stack([0.1 * np.arange(7), np.zeros(7), np.arange(7) / 8])
    velocity = np.zeros((7, 3))
    velocity[:, 0] = k * np.arange(7)
    moved = {name: np.zeros(3) for name in ("angular_velocity", "force", "torque")}
    return Frame(
        step=10 * k,
        time=0.5 * k,
        position=position,
        velocity=velocity,
        orientation=np.tile(UPRIGHT, (7, 1)),
        bonds={"elongation": [0.01, -0.02, 0.5], "bending": np.zeros(3), "broken": [0, 0, 1]},
        parts={"head": {"position": [k, 0, 0], "orientation": UPRIGHT, **moved}},
    )


def test_a_frame_shows_its_moment(case):
    with read(case) as trajectory:
        first, last = scenery_of_frame(trajectory, 0), scenery_of_frame(trajectory, -1)
    assert kinds(last) == {"Boxes": 4, "Spheres": 2, "Cylinders": 2}
    assert (first.caption, last.caption) == ("t = 0.000 s", "t = 0.500 s")
    pulley = [scenery.visible()[-1] for scenery in (first, last)]
    assert [item.position[0, 0] for item in pulley] == [0, 1]
    assert (pulley[0].diameter[0], pulley[0].length[0]) == (0.4, 0.5)
    idler = of_kind(last, Cylinders)
    assert (idler.diameter[0], idler.length[0]) == (pytest.approx(0.1), pytest.approx(0.3))
    assert np.allclose(idler.colour, from_hex("#112233"))
    assert np.allclose(of_kind(last, Boxes).size, [0.11, 0.2, 0.02])


def test_speed_and_height_span_belt_and_bulk_but_not_idlers(case):
    with read(case) as trajectory:
        speed = scenery_of_frame(trajectory, 1, "speed")
        height = scenery_of_frame(trajectory, 1, "height")
        fixed = scenery_of_frame(trajectory, 1, "speed", limits=(0, 10))
    assert (speed.legend.label, speed.legend.low, speed.legend.high) == ("speed, m/s", 0, 5)
    assert (height.legend.low, height.legend.high) == (0, 0.625)
    assert np.allclose(of_kind(speed, Spheres).colour, colour_map("viridis", [4, 5], 0, 5))
    assert np.allclose(of_kind(fixed, Spheres).colour, colour_map("viridis", [4, 5], 0, 10))
    assert np.allclose(of_kind(speed, Cylinders).colour, from_hex("#112233"))


def test_elongation_is_signed_and_leaves_out_broken_bonds(case):
    with read(case) as trajectory:
        scenery = scenery_of_frame(trajectory, 1, "elongation")
    assert (scenery.legend.low, scenery.legend.high) == (pytest.approx(-2), pytest.approx(2))
    shown = of_kind(scenery, Boxes).colour
    assert np.allclose(shown[:3], colour_map("coolwarm", [1, -2, -2], -2, 2), atol=1e-6)
    assert np.allclose(shown[3], RUBBER)  # its one bond is broken


def test_what_a_trajectory_does_not_hold_is_named(case):
    with read(case) as trajectory:
        with pytest.raises(ViewProblem, match="add BOND FORCE"):
            scenery_of_frame(trajectory, 0, "force")
        with pytest.raises(ViewProblem, match="frame 2: found 2 frames, expected 0 to 1"):
            scenery_of_frame(trajectory, 2)
        with pytest.raises(NothingToDraw, match="not hidden"):
            scenery_of_frame(trajectory, 0, hide=frozenset(["belt", "bulk", "parts"]))


# ---- web page


def page_scenery():
    turn = np.array([[0.6, 0.8, 0, 0]])
    items = [
        Boxes([[1, 2, 3]], turn, [[0.3, 0.2, 0.1]], 0.02, [[0.2, 0.4, 0.6]]),
        Spheres([[0, 0, 0], [1, 1, 1]], [0.5, 0.25], (1, 0, 0)),
        Cylinders([[2, 2, 2]], turn, 0.5, 2.0, (0, 1, 0)),
        Mesh(np.eye(3), [[0, 1, 2]], (0, 0, 1)),
    ]
    return Scenery(items, Legend("speed, m/s", 0, 2), "</script><b>t = 1 s")


def data_of(page):
    return json.loads(re.search(r'type="application/json">(.*?)</script>', page, re.DOTALL)[1])


def test_the_page_fetches_nothing_and_is_deterministic():
    page = html_of(page_scenery(), Camera())
    assert html_of(page_scenery(), Camera()) == page
    assert not re.search(r"https?:|src=|href=|@import|url\(|fetch\(|XMLHttpRequest|WebSocket|import\(", page)


def test_the_page_holds_every_solid_where_it_is():
    data = data_of(html_of(page_scenery(), Camera()))
    assert [batch["solids"] for batch in data["batches"]] == [1, 2, 1, 1]
    floats = [np.frombuffer(base64.b64decode(batch["instances"]), "<f4") for batch in data["batches"]]
    first = floats[0]
    assert np.allclose(first[:3] + data["middle"], [1, 2, 3], atol=1e-6)
    assert np.allclose(first[3:], [0.6, 0.8, 0, 0, 0.3, 0.2, 0.1, 0.02])
    assert np.allclose(floats[1].reshape(2, 11)[:, 7:10], [[1] * 3, [0.5] * 3])
    assert [batch["count"] for batch in data["batches"]] == [132, 960, 756, 3]
    assert base64.b64decode(data["batches"][0]["colours"]) == bytes([51, 102, 153, 255])
    assert data["legend"]["values"] == ["2", "1.5", "1", "0.5", "0"]
    assert data["caption"] == "</script><b>t = 1 s"


def test_the_normals_of_the_page_point_outward():
    data = data_of(html_of(page_scenery(), Camera()))
    for batch in data["batches"][:3]:
        half, edge, normal = (
            np.frombuffer(base64.b64decode(batch["vertices"]), "<f4").reshape(-1, 3, 3).swapaxes(0, 1)
        )
        point = half + 0.2 * edge
        assert np.all(np.sum(point * normal, axis=1) > 0.7)
        a, b, c = point[0::3], point[1::3], point[2::3]
        assert np.all(np.sum(np.cross(b - a, c - a) * normal[::3], axis=1) > 0)
        assert np.allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-6)


def test_the_page_is_written_whole(tmp_path):
    render_html(page_scenery(), tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text() == html_of(page_scenery(), Camera())
    with pytest.raises(NothingToDraw):
        render_html(Scenery(), tmp_path / "none.html")
    assert [path.name for path in tmp_path.iterdir()] == ["page.html"]


# ---- command


def view(*arguments):
    return CliRunner().invoke(view_command, [str(argument) for argument in arguments])


def test_the_command_draws_frames_and_decks(case, deck, tmp_path):
    with (tmp_path / "case.inp").open("wb") as stream:
        inp.write(deck, stream)
    for source, colour_by in ((case, "speed"), (tmp_path / "case.inp", "fibre")):
        for ending in ("png", "html"):
            target = tmp_path / f"{source.suffix[1:]}.{ending}"
            result = view(source, "-o", target, "--color-by", colour_by, "--size", "96x64", "--hide", "bulk")
            assert (result.exit_code, result.output, result.exception) == (0, "", None)
        with Image.open(tmp_path / f"{source.suffix[1:]}.png") as picture:
            assert picture.size == (96, 64)


def test_a_dash_writes_the_png_to_stdout(case):
    result = view(case, "-o", "-", "--size", "64x64", "--section", "x=0.2", "--orthographic")
    assert result.stdout_bytes.startswith(b"\x89PNG")


def test_sections_and_frames_change_the_picture(case):
    options = ["-o", "-", "--size", "96x64", "--color-by", "speed"]
    whole = view(case, *options).stdout_bytes
    assert view(case, *options, "--section", "x=0.2").stdout_bytes != whole
    assert view(case, *options, "--frame", "0").stdout_bytes != whole
    assert view(case, *options, "--zoom", "0,0,0,1,1,1").stdout_bytes != whole
    assert view(case, *options, "--frame", "1").stdout_bytes == whole


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["-o", "x.jpg"], 2, "found ending '.jpg', expected .png or .html"),
        (["-o", "x.png", "--frame", "9"], 2, "frame 9: found 2 frames"),
        (["-o", "x.png", "--color-by", "strain"], 2, "expected one of none, type, height"),
        (["-o", "x.png", "--color-by", "force"], 2, "add BOND FORCE"),
        (["-o", "x.png", "--section", "q=1"], 2, "expected one as x=1.2"),
        (["-o", "x.html", "--section", "x=1"], 2, "--section"),
        (["-o", "x.png", "--section", "y=0", "--azimuth", "0"], 2, "edge-on"),
        (["-o", "x.png", "--zoom", "1,2"], 2, "expected 6 numbers"),
        (["-o", "x.png", "--zoom", "1,0,0,0,1,1"], 2, "x0<x1"),
        (["-o", "x.png", "--size", "9x9"], 2, "64 to 20000"),
        (["-o", "x.png", "--size", "900"], 2, "1600x900"),
        (["-o", "x.png", "--range", "2,1"], 2, "lower value first"),
        (["-o", "x.png", "--range", "nan,1"], 2, "expected 2 numbers"),
        (["-o", "x.png", "--elevation", "100"], 2, "-90<=x<=90"),
        (["-o", "x.png", "--hide", "belt", "--hide", "bulk", "--hide", "parts"], 3, "nothing to draw"),
        (["-o", "case.h5"], 2, "expected .png or .html"),
    ],
)
def test_wrong_options_are_refused_and_leave_no_file(case, monkeypatch, arguments, code, message):
    monkeypatch.chdir(case.parent)
    result = view("case.h5", *arguments)
    assert (result.exit_code, result.stdout) == (code, "")
    assert message in result.stderr
    assert [path.name for path in case.parent.iterdir()] == ["case.h5"]


def test_an_existing_picture_is_kept_unless_told(case, tmp_path):
    target = tmp_path / "x.png"
    target.write_bytes(b"mine")
    result = view(case, "-o", target, "--size", "64x64")
    assert result.exit_code == 2
    assert "--overwrite" in result.stderr
    assert target.read_bytes() == b"mine"
    assert view(case, "-o", target, "--size", "64x64", "--overwrite").exit_code == 0
    assert target.read_bytes() != b"mine"


def test_files_that_are_no_case_are_refused(tmp_path):
    (tmp_path / "text.h5").write_text("no HDF5")
    (tmp_path / "bad.inp").write_text("*FORMAT, NAME=BELTSIM, VERSION=1\n*PARTICEL\n")
    (tmp_path / "empty.inp").write_text("*FORMAT, NAME=BELTSIM, VERSION=1\n")
    for name, message in (
        ("missing.h5", "missing.h5"),
        ("text.h5", "no HDF5 file"),
        ("bad.inp", "bad.inp:2"),
        ("empty.inp", "nothing to draw"),
    ):
        result = view(tmp_path / name, "-o", tmp_path / "x.png")
        assert result.exit_code == 3
        assert message in result.stderr
    assert not (tmp_path / "x.png").exists()


@pytest.mark.parametrize("missing", ["embreex", "PIL"])
def test_a_missing_extra_says_how_to_install_it(case, tmp_path, monkeypatch, missing):
    for name in [name for name in sys.modules if name.split(".")[0] == missing]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setitem(sys.modules, missing, None)
    result = view(case, "-o", tmp_path / "x.png")
    assert result.exit_code == 2
    assert "pip install 'beltsim[view]'" in result.stderr
    assert not (tmp_path / "x.png").exists()
