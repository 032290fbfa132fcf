"""Quad meshes of meshers are read as they are, and past the traps of the library that reads them."""

import belts
import meshio
import numpy as np
import pytest

from beltconverter.convert import Settings, convert
from beltconverter.quads import read_quads
from beltconverter.recover import Wishes, recover
from beltconverter.refusals import UnreadableMesh

MADE = belts.racetrack(40, 6, trough=0.6)
DIGITS = 1e-6  # the coarsest of the writers keeps seven digits of numbers below 4


def quads(made=MADE):
    facets = belts.facets_of(made, "uniform")  # a, b, c and a, c, d
    return np.column_stack([facets[::2], facets[1::2, 2]])


def abaqus(element="S4R", before="", instance=None, made=MADE, first=1):
    """An Abaqus deck with sparse node numbers; with `instance` its data lines within an assembly."""
    points = made.points.reshape(-1, 3)
    lines = ["*Heading", before, "*Part, name=belt", "*Node"]
    lines += [f"{first + 3 * n}, {x!r}, {y!r}, {z!r}" for n, (x, y, z) in enumerate(points.tolist())]
    lines += [f"*Element, type={element}"]
    lines += [
        f"{k}, " + ", ".join(str(first + 3 * n) for n in quad)
        for k, quad in enumerate(quads(made).tolist(), 1)
    ]
    lines += ["*End Part"]
    if instance is not None:
        lines += [
            "*Assembly, name=Assembly",
            "*Instance, name=belt-1, part=belt",
            *instance,
            "*End Instance",
            "*End Assembly",
        ]
    return "\n".join(line for line in lines if line).encode()


def grid_of(data, name, wishes=None):
    (grid,) = recover(read_quads(data, name), wishes or Wishes(), [])
    return grid


@pytest.mark.parametrize("suffix", [".vtk", ".vtu", ".msh", ".obj", ".ply", ".inp"])
def test_what_meshio_writes_comes_back_as_the_same_grid(suffix, tmp_path):
    path = tmp_path / f"belt{suffix}"
    options = {".msh": {"file_format": "gmsh22"}}.get(suffix, {})
    meshio.Mesh(MADE.points.reshape(-1, 3), [("quad", quads())]).write(path, **options)
    grid = grid_of(path.read_bytes(), path.name)
    assert belts.is_same_grid(grid.points, grid.kind, MADE, DIGITS)


@pytest.mark.parametrize("element", ["S4R", "S4", "s4r", "S4R5", "CPS4R", "M3D4R", "SFM3D4R", "R3D4", "m3d4"])
def test_every_shell_and_membrane_of_abaqus_is_read(element):
    grid = grid_of(abaqus(element), "belt.inp")
    assert belts.is_same_grid(grid.points, grid.kind, MADE, 1e-12)


def test_the_translation_of_an_instance_is_not_lost():
    grid = grid_of(abaqus(instance=["1.5, -2.0, 0.25"]), "belt.inp")
    moved = belts.Made(MADE.points + np.array([1.5, -2.0, 0.25]), "endless")
    assert belts.is_same_grid(grid.points, grid.kind, moved, 1e-12)


def test_the_rotation_of_an_instance_is_not_lost():
    # 90 degrees about the line through (1, 0, 0) along z, after a translation by 2 along x.
    grid = grid_of(abaqus(instance=["2., 0., 0.", "1., 0., 0., 1., 0., 1., 90."]), "belt.inp")
    x, y, z = np.moveaxis(MADE.points, -1, 0)
    moved = belts.Made(np.stack([1 - y, x + 2 - 1, z], axis=-1), "endless")
    assert belts.is_same_grid(grid.points, grid.kind, moved, 1e-12)


def test_quads_of_a_skewed_belt_need_no_guess():
    skewed = belts.racetrack(60, 8, straight=(3 - 0.8 * np.pi) / 2, width=0.35, skew=0.7)
    warnings = []
    (grid,) = recover(read_quads(abaqus(made=skewed), "belt.inp"), Wishes(), warnings)
    assert belts.is_same_grid(grid.points, grid.kind, skewed, 1e-12)
    assert warnings == []


def test_corners_of_quadratic_shells_are_taken():
    eights = [[*quad, *(range(900 + 4 * k, 904 + 4 * k))] for k, quad in enumerate(quads().tolist())]
    points = np.concatenate(
        [MADE.points.reshape(-1, 3), np.random.default_rng(0).random((1000 + 4 * len(eights), 3))]
    )
    lines = ["*NODE"] + [f"{n}, {x!r}, {y!r}, {z!r}" for n, (x, y, z) in enumerate(points.tolist())]
    lines += ["*ELEMENT, TYPE=S8R"] + [", ".join(map(str, [k, *eight])) for k, eight in enumerate(eights, 1)]
    grid = grid_of("\n".join(lines).encode(), "belt.inp")
    assert belts.is_same_grid(grid.points, grid.kind, MADE, 1e-12)


def test_two_instances_are_refused_by_line():
    data = abaqus(instance=["0, 0, 1", "*End Instance", "*Instance, name=b, part=belt", "0, 0, 2"])
    with pytest.raises(UnreadableMesh, match=r"belt\.inp:\d+: 2 instances"):
        read_quads(data, "belt.inp")


@pytest.mark.parametrize(
    ("data", "name", "found"),
    [
        (abaqus("C3D8R"), "belt.inp", r"belt\.inp:\d+: elements of TYPE=C3D8R"),
        (abaqus("B31"), "belt.inp", "elements of TYPE=B31"),
        (b"*NODE\n1, 0., 0., 0.\n", "belt.inp", "no quads and no triangles"),
        (b"not a mesh", "belt.vtk", r"belt\.vtk: "),
        (b"", "belt.msh", r"belt\.msh: "),
        (b"ply\nformat", "belt.ply", r"belt\.ply: "),
        (b"*NODE\n1, a, b, c\n*ELEMENT, TYPE=S4R\n1, 1, 1, 1, 1\n", "belt.inp", r"belt\.inp: "),
    ],
)
def test_what_is_no_shell_mesh_is_refused_by_name(data, name, found, capsys):
    with pytest.raises(UnreadableMesh, match=found):
        read_quads(data, name)
    assert capsys.readouterr().out == ""


def test_a_quad_mesh_and_its_triangles_give_the_same_belt():
    from beltsim import inp

    settings = Settings(unit="m")
    one = convert(abaqus(), "belt.inp", settings)
    two = convert(
        belts.ascii_stl(belts.corners_of(MADE, belts.facets_of(MADE, "uniform")), 17), "belt.stl", settings
    )
    text = [inp.dumps(conversion.deck).split(b"*MATERIAL")[1] for conversion in (one, two)]
    assert text[0] == text[1]
