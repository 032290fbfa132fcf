"""The sample conveyor: its belt touches every roll, cuts into none, and its CAD files are whole."""

import re
import shutil
import sys
from collections import Counter
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from beltconverter.cli import main as beltconvert
from beltsim import inp
from partconverter.cli import main as partconvert

SAMPLES = Path(__file__).parent.parent / "samples"
sys.path[:0] = [str(SAMPLES / "conveyor"), str(SAMPLES)]

from belt_shape import Conveyor, belt_nodes, carrying_side, return_slope, section  # noqa: E402
from make_conveyor import sat_text, stl_text, triangles  # noqa: E402
from roll_layout import clearance, frame, rolls  # noqa: E402

CONVEYOR = Conveyor()
NODES = belt_nodes(CONVEYOR)
ROLLS = rolls(CONVEYOR)
NAMES = [roll.name for roll in ROLLS]


def fine_mid_surface(x_step=2.0):
    """Points on the whole belt, many times denser than the mesh: rows of one fine conveyor."""
    length = np.linalg.norm(np.roll(NODES, -1, axis=0) - NODES, axis=-1)[:, 8].sum()
    return belt_nodes(Conveyor(rows=round(length / x_step), columns=130))


FINE = fine_mid_surface()


@pytest.mark.parametrize("roll", ROLLS, ids=NAMES)
def test_no_node_starts_inside_a_roll(roll):
    # Rolls are placed in micrometres, so the belt may reach half of one into them.
    assert clearance(roll, NODES.reshape(-1, 3)) >= CONVEYOR.half - 1e-3


@pytest.mark.parametrize("roll", ROLLS, ids=NAMES)
def test_the_belt_touches_every_roll(roll):
    # Points 2 mm apart miss the touching line by 1 mm: 1/(2 r) = 0.009 mm on the smallest roll.
    assert clearance(roll, FINE.reshape(-1, 3)) == pytest.approx(CONVEYOR.half, abs=0.01)


@pytest.mark.parametrize("roll", ROLLS[:2], ids=NAMES[:2])
def test_the_belt_lies_on_pulleys_over_the_whole_wrap(roll):
    x, z = NODES[..., 0] - roll.centre[0], NODES[..., 2] - roll.centre[2]
    radius = roll.diameter / 2 + CONVEYOR.half
    touching = np.abs(np.hypot(x, z) - radius) < 1e-3
    wrap = np.pi + (return_slope(CONVEYOR) if "head" in roll.name else -return_slope(CONVEYOR))
    pitch = np.linalg.norm(NODES[-2, 0] - NODES[-1, 0])
    for column in touching.T:
        assert column.sum() == pytest.approx(wrap * radius / pitch, abs=1)


def test_the_troughed_section_keeps_the_belts_width():
    across = np.linspace(-1, 1, 20_001) * CONVEYOR.belt_width / 2
    for angle in (0.0, 1e-9, 0.2, CONVEYOR.trough_angle):
        y, z = section(CONVEYOR, across, np.array(angle))
        assert np.hypot(np.diff(y), np.diff(z)).sum() == pytest.approx(CONVEYOR.belt_width, rel=1e-6)


def test_the_belt_troughs_on_full_sets_and_is_flat_on_pulleys():
    edge = CONVEYOR.belt_width / 2
    for x in CONVEYOR.full_sets:
        middle, rim = carrying_side(CONVEYOR, np.array(x), np.array([0.0, edge]))
        assert rim[2] - middle[2] == pytest.approx(CONVEYOR.trough_depth)
    for x in (0.0, CONVEYOR.centre_distance):
        middle, rim = carrying_side(CONVEYOR, np.array(x), np.array([0.0, edge]))
        assert rim[2] == middle[2]


def test_the_mesh_is_even():
    """Uneven cells would give the converter stress-free lengths that no real belt has."""
    along = np.linalg.norm(np.roll(NODES, -1, axis=0) - NODES, axis=-1)
    across = np.linalg.norm(np.diff(NODES, axis=1), axis=-1)
    # The edges rise by 0.07 over the transitions' length, so their cells are 0.07^2 / 2 = 0.25 % longer, and
    # chords of the smaller pulley (p / r)^2 / 24 = 0.3 % shorter; two cells meet at every kink.
    assert np.ptp(along) < 0.006 * along.mean()
    # A bend's chords: (pi / 6 / 3)^2 / 24 = 0.13 %.
    assert np.ptp(across) < 0.0014 * across.mean()
    # Edges rise by 0.070 and close in by 0.032, the middle falls by 0.047, over two transitions of 0.85 m:
    # 2 x 0.85 m (0.070^2 + 0.032^2 - 0.047^2) / 2 = 3.2 mm of 11.76 m at most.
    assert np.ptp(along.sum(axis=0)) < 3.2 / 11_760 * along.sum(axis=0).mean()


def test_the_facets_are_one_closed_strip():
    facets = triangles(NODES)
    rows, columns = NODES.shape[:2]
    assert len(facets) == 2 * rows * (columns - 1)
    points, corners = np.unique(facets.reshape(-1, 3), axis=0, return_inverse=True)
    assert len(points) == rows * columns
    corners = corners.reshape(-1, 3)
    directed = Counter(map(tuple, corners[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist()))
    assert set(directed.values()) == {1}, "every edge is run through once in each direction"
    border = [edge for edge in directed if edge[::-1] not in directed]
    assert len(border) == 2 * rows
    edges = (len(directed) + len(border)) // 2
    assert len(points) - edges + len(facets) == 0, "Euler's number of an endless strip"


def test_the_facets_cover_the_belt():
    a, b, c = triangles(NODES).transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=-1).sum() / 2
    length = np.linalg.norm(np.roll(FINE, -1, axis=0) - FINE, axis=-1)[:, 65].sum()
    # Chords over pulleys and bends are short by up to 0.3 %, and only there.
    assert area == pytest.approx(length * CONVEYOR.belt_width * (1 - 1 / CONVEYOR.columns), rel=2e-3)


def test_carrying_side_faces_out_of_the_loop():
    a, b, c = triangles(NODES).transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    upper = (a[:, 2] + b[:, 2] + c[:, 2]) / 3 > 950
    middle = np.abs(a[:, 0] - CONVEYOR.centre_distance / 2) < 2000
    assert (normal[upper & middle, 2] > 0).all()
    assert (normal[~upper & middle, 2] < 0).all()


def test_rolls_of_a_set_have_their_gap_and_pulleys_their_place():
    for number in range(1, 7):
        centre, left, _ = (roll for roll in ROLLS if roll.name.startswith(f"idler set {number} "))
        inner = np.array(left.centre) - np.array(left.axis) * left.length / 2
        normal = np.array([0.0, -left.axis[2], left.axis[1]])
        gap = (inner + normal * left.diameter / 2)[1] - centre.length / 2
        # Wide enough to turn freely, and not wider than the 10 mm that keep a belt from being nipped.
        assert 5 < gap <= 10


KINDS = ("body", "lump", "shell", "face", "loop", "coedge", "edge", "vertex")


def records(text, kind):
    return re.findall(rf"^{kind} .*#\s*$", text, flags=re.MULTILINE)


def test_solids_are_closed():
    text = sat_text(CONVEYOR)
    bodies = len(ROLLS) + len(frame(CONVEYOR))
    counted = {kind: len(records(text, kind)) for kind in KINDS}
    assert counted["body"] == counted["lump"] == counted["shell"] == bodies
    assert counted["coedge"] == 2 * counted["edge"]
    # Euler and Poincaré: V - E + F - (loops - F) = 2 for each solid without a through hole.
    euler = counted["vertex"] - counted["edge"] + 2 * counted["face"] - counted["loop"]
    assert euler == 2 * bodies


def test_drums_and_beams_are_told_apart_by_their_surfaces():
    text = sat_text(CONVEYOR)
    # A seamed drum has one cylinder and two of its journals; a halved roll has its three in six faces, whose
    # surfaces are shared.
    assert len(records(text, "cone-surface")) == 3 * len(ROLLS)
    assert len(records(text, "transform")) == len(ROLLS) - 2 + len(frame(CONVEYOR))


def numbers(text):
    return np.array(re.findall(r"[-+]?\d+\.?\d*(?:e[-+]\d+)?", text), dtype=float)


@pytest.mark.parametrize("name", ["belt.stl", "frame.sat"])
def test_the_files_are_what_the_script_writes(name):
    now = stl_text(triangles(NODES), "belt") if name.endswith("stl") else sat_text(CONVEYOR)
    kept = (SAMPLES / "conveyor" / name).read_text(encoding="ascii")
    # Mathematical libraries differ in the last bit, which may turn the seventh digit of a length in mm.
    np.testing.assert_allclose(numbers(now), numbers(kept), rtol=1e-6, atol=2e-6)


@pytest.fixture(scope="module")
def converted(tmp_path_factory):
    """Folder with the converted CAD files beside the case, and the deck read from it."""
    folder = tmp_path_factory.mktemp("conveyor")
    belt = ["--unit", "mm", "--elongation", "100.12%", "--fibres", "rows"]
    rolls_by_name = ["--diameter-limit", "300mm", "--name-by", "cad"]
    for command, source, target, options in (
        (beltconvert, "belt.stl", "belt.inp", belt),
        (partconvert, "frame.sat", "parts.inp", rolls_by_name),
    ):
        arguments = [str(SAMPLES / "conveyor" / source), "-o", str(folder / target), *options]
        done = CliRunner().invoke(command, arguments)
        assert done.exit_code == 0, done.output
    shutil.copy(SAMPLES / "conveyor" / "case.inp", folder)
    return inp.read_case(folder / "case.inp")


def test_the_case_reads_with_the_converted_files(converted):
    particles = sum(len(block.rows["id"]) for block in converted.blocks("PARTICLE"))
    bonds = sum(len(block.rows["particles"]) for block in converted.blocks("BOND"))
    rows, columns = NODES.shape[:2]
    assert particles == rows * columns
    assert bonds == rows * columns + rows * (columns - 1)


def test_parts_stand_where_the_rolls_were_drawn_and_beams_are_left_out(converted):
    parts = {block["NAME"].replace("_", " "): block for block in converted.blocks("PART")}
    assert set(parts) == set(NAMES)
    for roll in ROLLS:
        part = parts[roll.name]
        assert part["CLASS"] == ("PULLEY" if "pulley" in roll.name else "IDLER")
        assert part["DIAMETER"] * 1000 == pytest.approx(roll.diameter, abs=1e-6)
        assert part["LENGTH"] * 1000 == pytest.approx(roll.length, abs=1e-6)
        assert np.ravel(part.rows["position"]) * 1000 == pytest.approx(roll.centre, abs=1e-6)
        w, x, y, z = np.ravel(part.rows["orientation"])
        axis = 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)
        assert axis == pytest.approx(roll.axis, abs=1e-9)


def test_every_roll_is_driven_or_free_to_turn(converted):
    patterns = [block["PART"] for block in converted.blocks("MOTION")]
    for part in converted.blocks("PART"):
        assert sum(fnmatchcase(part["NAME"], pattern) for pattern in patterns) == 1


def test_particles_are_as_far_from_the_rolls_as_half_the_belt_is_thick(converted):
    centres = np.concatenate([block.rows["position"] for block in converted.blocks("PARTICLE")]) * 1000
    for roll in ROLLS:
        # The mesh keeps seven digits: half a micrometre on x, and as much for the roll's centre.
        assert clearance(roll, centres) >= CONVEYOR.half - 2e-3
