"""STL files as different programs write them hold the same belt."""

import belts
import numpy as np
import pytest

from beltconverter.mesh import merge_equal
from beltconverter.refusals import UnreadableMesh
from beltconverter.stl import read_stl

MADE = belts.flat(6, 4)
CORNERS = belts.corners_of(MADE, belts.facets_of(MADE, "uniform"))
TEXT = belts.ascii_stl(CORNERS, digits=9)


def one_solid_a_facet(corners):
    return b"".join(belts.ascii_stl(corners[k : k + 1], name=f"facet {k}") for k in range(len(corners)))


def with_exponents(corners):
    lines = TEXT.decode().splitlines()
    vertices = iter(corners.reshape(-1, 3).tolist())
    return "\n".join(
        "vertex {:.8E} {:.8E} {:.8E}".format(*next(vertices)) if "vertex" in line else line for line in lines
    ).encode()


VARIANTS = {
    "plain": TEXT,
    "Windows line ends": TEXT.replace(b"\n", b"\r\n"),
    "old Mac line ends": TEXT.replace(b"\n", b"\r"),
    "tabs": TEXT.replace(b"  ", b"\t"),
    "trailing blanks": TEXT.replace(b"\n", b"  \n"),
    "blank lines": TEXT.replace(b"endfacet\n", b"endfacet\n\n"),
    "upper case": TEXT.upper(),
    "capitals": TEXT.replace(b"facet normal", b"Facet Normal").replace(b"vertex", b"Vertex"),
    "a byte order mark": b"\xef\xbb\xbf" + TEXT,
    "leading blank lines": b"\n\n" + TEXT,
    "no final line end": TEXT.rstrip(b"\n"),
    "no name": TEXT.replace(b"solid belt", b"solid"),
    "a name that looks like a facet": TEXT.replace(b"solid belt", b"solid facet normal vertex 1 2 3"),
    "a name in Latin-1": TEXT.replace(b"solid belt", b"solid F\xf6rdergurt"),
    "normals that are no numbers": TEXT.replace(b"normal 0 0 1", b"normal nan nan -1.#IND"),
    "one solid a facet": one_solid_a_facet(CORNERS),
    "exponents": with_exponents(CORNERS),
    "minus zero": TEXT.replace(b"vertex 0 ", b"vertex -0.0 ", 5),
    "binary": belts.binary_stl(CORNERS),
    "binary without a header": belts.binary_stl(CORNERS, header=b""),
}


@pytest.mark.parametrize("name", VARIANTS)
def test_all_of_them_have_the_same_nodes_and_facets(name):
    mesh = read_stl(VARIANTS[name], name)
    assert len(mesh.points) == 24
    tolerance = 1e-8 if name.startswith("binary") else 0.0  # single precision of numbers below 0.3
    assert np.allclose(mesh.points[mesh.facets], CORNERS, rtol=0, atol=max(tolerance, 1e-9))
    assert np.array_equal(mesh.order, np.arange(len(CORNERS)))


def test_points_that_differ_in_the_last_bit_stay_two():
    a = np.array([0.1, 0.2, 0.3])
    points, index = merge_equal(np.array([a, np.nextafter(a, 1.0), a, -0.0 * a, 0.0 * a]))
    assert index.tolist() == [0, 1, 0, 2, 2]
    assert np.array_equal(points[:2], [a, np.nextafter(a, 1.0)])


def test_a_hash_that_collides_does_not_weld(monkeypatch):
    monkeypatch.setattr("beltconverter.mesh._hashes", lambda points: np.zeros(len(points), np.uint64))
    points = np.random.default_rng(0).integers(0, 3, (200, 3)).astype(float)
    found, index = merge_equal(points)
    assert np.array_equal(found[index], points)
    assert len(found) == len(np.unique(points, axis=0))


@pytest.mark.parametrize("seed", range(30))
def test_a_file_that_is_cut_anywhere_is_refused_or_whole(seed):
    from beltconverter.refusals import UnreadableMesh

    rng = np.random.default_rng(seed)
    for data in (TEXT, belts.binary_stl(CORNERS)):
        cut = int(rng.integers(0, len(data) - len(b"endsolid belt\n")))
        with pytest.raises(UnreadableMesh):
            read_stl(data[:cut])


def test_all_that_is_wrong_with_a_text_file_is_told_at_once_in_the_order_of_its_lines():
    def facet(*vertices, end="endloop endfacet"):
        corners = "\n".join(f"vertex {vertex}" for vertex in vertices)
        return f"facet normal 0 0 1\nouter loop\n{corners}\n{end}\n"

    text = (
        "solid belt\n"
        + facet("0 0 0", "1 0 0", "1 1 0")
        + facet("0 0 0", "1,5 0 0", "1 1 0")
        + facet("0 0 0", "1 0 0", "1 1 0", end="endfacet")
        + facet("0 0 0", "1 nan 0", "1 1 0")
        + facet("0 0 0", "1 1 0")
        + facet("0 0 0", "1 0 0", "1 1 0")
    )
    with pytest.raises(UnreadableMesh) as refusal:
        read_stl(text.encode(), "belt.stl")
    lines = str(refusal.value).splitlines()
    assert [line.split(":")[1] for line in lines] == ["11", "14", "23", "26", "37"]
    assert [word in line for word, line in zip(("comma", "broken", "NaN", "broken", "endsolid"), lines)] == [
        True
    ] * 5


def test_of_many_problems_the_first_are_told_and_the_others_counted():
    facets = "".join(
        f"facet normal 0 0 1\nouter loop\nvertex {n} 0 x\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\n"
        for n in range(50)
    )
    with pytest.raises(UnreadableMesh) as refusal:
        read_stl(f"solid a\n{facets}endsolid a\n".encode())
    lines = str(refusal.value).splitlines()
    assert len(lines) == 21
    assert lines[0].startswith("mesh:4: 'vertex 0 0 x' (not three numbers)")
    assert lines[-1] == "and 30 problems more"
