"""What is no belt is refused by name, with its place, and leaves no file behind."""

import belts
import numpy as np
import pytest
from click.testing import CliRunner

from beltconverter.cli import main

FLAT = belts.flat(12, 6)
RING = belts.racetrack(60, 8)


def mesh_without(made, cells, diagonals="uniform"):
    """Corners of a belt without the cells at (i, j)."""
    facets = belts.facets_of(made, diagonals)
    columns = made.points.shape[1] - 1
    gone = [2 * (i * columns + j) + k for i, j in cells for k in (0, 1)]
    return belts.corners_of(made, np.delete(facets, gone, axis=0))


def solid():
    """A closed box of the thickness of a belt."""
    import trimesh

    return np.asarray(trimesh.creation.box((2.0, 0.5, 0.01)).triangles)


def with_fin():
    a, b = FLAT.points[5, 2], FLAT.points[5, 3]
    return np.concatenate([belts.corners_of(FLAT), [[a, b, a + np.array([0, 0, 0.05])]]])


def with_triangle_row():
    """Six cells in a row turn into three: every second node of the last line is missing."""
    points = FLAT.points
    corners = [belts.corners_of(belts.Made(points[:, :5], "open"))]
    for i in range(0, 10, 2):
        a, b, c = points[i : i + 3, 4]
        d, e = points[i, 5], points[i + 2, 5]
        corners.append(np.array([[a, b, d], [b, e, d], [b, c, e]]))
    corners.append(
        np.array(
            [[points[10, 4], points[11, 4], points[10, 5]], [points[11, 4], points[11, 5], points[10, 5]]]
        )
    )
    return np.concatenate(corners)


def hanging_nodes():
    """Two patches whose common line has twice as many nodes on one side."""
    coarse, fine = belts.flat(6, 4), belts.flat(11, 4, pitch=0.025)
    return np.concatenate(
        [belts.corners_of(coarse), belts.corners_of(belts.Made(fine.points + np.array([0, 0.15, 0]), "open"))]
    )


def unstructured():
    from scipy.spatial import Delaunay

    plane = np.random.default_rng(4).random((80, 2))
    return np.pad(plane, ((0, 0), (0, 1)))[Delaunay(plane).simplices]


def quads_in_four():
    points = FLAT.points
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    centre = (a + b + c + d) / 4
    return np.concatenate(
        [np.stack([p, q, centre], axis=2).reshape(-1, 3, 3) for p, q in ((a, b), (b, c), (c, d), (d, a))]
    )


NOT_BELTS = {
    "a solid": (solid(), "solid", None),
    "a hole in an open belt": (mesh_without(FLAT, [(5, 2)]), "hole", (0.275, 0.125, 0.0)),
    "a hole in an endless belt": (
        mesh_without(RING, [(9, 3)]),
        "hole",
        RING.points[9:11, 3:5].mean(axis=(0, 1)),
    ),
    "a notch in an open belt": (mesh_without(FLAT, [(5, 0)]), "notch", None),
    "a notch in an endless belt": (mesh_without(RING, [(9, 0), (10, 0)]), "notch", None),
    "a fin": (with_fin(), "fin", (0.25, 0.125, 0.0)),
    "a triangular transition": (with_triangle_row(), "transition", None),
    "patches that do not meet": (hanging_nodes(), "crack", None),
    "random triangles": (unstructured(), "unstructured", None),
    "quads cut in four": (quads_in_four(), "unstructured", None),
}


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Runs the command in an empty folder on `belt.stl`; gives its result and the names of the files left."""
    monkeypatch.chdir(tmp_path)

    def on(data: bytes, *options: str):
        (tmp_path / "belt.stl").write_bytes(data)
        result = CliRunner().invoke(main, ["belt.stl", "-o", "belt.inp", *options])
        return result, sorted(path.name for path in tmp_path.iterdir())

    return on


@pytest.mark.parametrize("name", NOT_BELTS)
def test_a_shape_that_is_no_belt_is_refused_with_cause_and_place(run, name):
    corners, cause, place = NOT_BELTS[name]
    result, left = run(belts.ascii_stl(corners))
    assert result.exit_code == 4, result.stderr
    assert f"belt.stl: no belt was written: {cause}:" in result.stderr
    assert left == ["belt.stl"]
    assert result.stdout == ""
    if place is not None:
        assert "({:.6g}, {:.6g}, {:.6g})".format(*np.round(place, 12) + 0.0) in result.stderr


WHOLE = belts.ascii_stl(belts.corners_of(FLAT))
BINARY = belts.binary_stl(belts.corners_of(FLAT), header=b"\0" * 80)

UNREADABLE = {
    "an empty file": (b"", "an empty file"),
    "blank text": (b" \n\n", "an empty file"),
    "no facets": (b"solid belt\nendsolid belt\n", "no facets"),
    "no facets in a binary file": (BINARY[:80] + bytes(4), "no facets"),
    "cut within a number": (WHOLE[:5000], "belt.stl:"),
    "cut after a facet": (WHOLE[: WHOLE.rfind(b"facet normal")], "truncated"),
    "a decimal comma": (WHOLE.replace(b"0.05", b"0,05"), "decimal comma"),
    "NaN": (WHOLE.replace(b"vertex 0.05", b"vertex nan"), "NaN"),
    "infinity": (WHOLE.replace(b"vertex 0.05", b"vertex -inf"), "infinity"),
    "overflow": (WHOLE.replace(b"vertex 0.05", b"vertex 1e999"), "overflow"),
    "a word": (WHOLE.replace(b"vertex 0.05", b"vertex ****"), "not three numbers"),
    "two numbers": (WHOLE.replace(b"vertex 0.05 ", b"vertex "), "2 numbers"),
    "a facet of four": (
        WHOLE.replace(b"    endloop", b"      vertex 0 0 0\n    endloop", 1),
        "belt.stl:2: a broken facet",
    ),
    "facets after the end": (WHOLE + WHOLE[WHOLE.find(b"  facet") :], "a facet after 'endsolid'"),
    "a binary file that is cut": (BINARY[:-10], "truncated, or a wrong count"),
    "a binary file that counts wrong": (
        BINARY[:80] + (9).to_bytes(4, "little") + BINARY[84:],
        "count of 9 facets",
    ),
    "NaN in a binary file": (
        BINARY[:96] + np.float32("nan").tobytes() + BINARY[100:],
        "NaN or infinity in facet 1",
    ),
    "an HTML page": (b"<!DOCTYPE html><html>not found</html>", "HTML"),
    "a Git LFS pointer": (b"version https://git-lfs.github.com/spec/v1\noid sha256:1\n", "Git LFS pointer"),
    "a gzip archive": (b"\x1f\x8b\x08" + bytes(100), "gzip"),
    "another text": (b"ISO-10303-21;\nHEADER;\n", "'ISO-10303-21;'"),
}


@pytest.mark.parametrize("name", UNREADABLE)
def test_an_unreadable_file_is_refused_with_what_is_wrong(run, name):
    data, found = UNREADABLE[name]
    result, left = run(data)
    assert result.exit_code == 3, result.stderr
    assert found in result.stderr
    assert result.stderr.startswith("belt.stl:")
    assert left == ["belt.stl"]


def test_the_line_of_a_wrong_vertex_is_named(run):
    lines = WHOLE.decode().splitlines()
    lines[10] = "      vertex 0.0 1.0 nan"
    result, _ = run("\n".join(lines).encode())
    assert "belt.stl:11: 'vertex 0.0 1.0 nan' (NaN)" in result.stderr


def test_a_missing_file_is_named():
    result = CliRunner().invoke(main, ["nowhere.stl"])
    assert result.exit_code == 3
    assert "nowhere.stl" in result.stderr


def test_an_existing_output_is_kept_unless_told_otherwise(run, tmp_path):
    output = tmp_path / "belt.inp"
    output.write_text("precious")
    assert run(WHOLE)[0].exit_code == 2
    assert output.read_text() == "precious"
    assert run(WHOLE, "--overwrite")[0].exit_code == 0
    assert output.read_bytes().startswith(b"*FORMAT")


@pytest.mark.parametrize("stated", ["--open", "--endless"])
def test_a_belt_that_is_not_what_was_stated_is_refused(run, stated):
    made = RING if stated == "--open" else FLAT
    result, left = run(belts.ascii_stl(belts.corners_of(made)), stated)
    assert result.exit_code == 4
    assert f"{stated} was stated" in result.stderr
    assert left == ["belt.stl"]


def test_a_solid_with_an_opening_is_named_a_solid(run):
    import trimesh

    ring = trimesh.creation.annulus(r_min=0.2, r_max=0.3, height=0.1)
    result, _ = run(belts.ascii_stl(np.asarray(ring.triangles)[1:]))
    assert result.exit_code == 4
    assert "no belt was written: solid:" in result.stderr


def test_a_solid_that_lacks_a_facet_is_named_a_solid(run):
    import trimesh

    ball = np.asarray(trimesh.creation.icosphere(subdivisions=4).triangles)
    result, _ = run(belts.ascii_stl(ball[1:]))
    assert result.exit_code == 4
    assert "no belt was written: solid:" in result.stderr
