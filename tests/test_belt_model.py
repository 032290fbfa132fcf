"""The converted belt as a mechanical model: stiffness, mass, stress-free state, motion and names."""

import belts
import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.linalg import spsolve

from beltconverter.belt import Making
from beltconverter.convert import Settings, convert
from beltconverter.frames import Pose
from beltconverter.properties import Sheet
from beltconverter.zones import parse_zone
from beltsim import inp

# What a data sheet of a belt says, and a belt that is no multiple of nice numbers.
SHEET = Sheet(
    thickness=0.0137,
    mass_per_area=16.3,
    tensile_stiffness=4.2e6,
    tensile_stiffness_transverse=0.9e6,
    bending_stiffness=5.1,
    bending_stiffness_transverse=2.2,
)
LENGTH, WIDTH = 1.7, 0.6


def converted(made, **settings):
    """The deck of a made belt, as read back from its text."""
    data = belts.ascii_stl(belts.corners_of(made), digits=17)
    conversion = convert(data, "belt.stl", Settings(unit="m", **settings))
    deck = inp.read_text(inp.dumps(conversion.deck))
    assert deck == conversion.deck
    return deck, conversion


def strip(rows, columns, half_edges, length=LENGTH, width=WIDTH):
    """Flat open belt of that outer length and width, nodes half a cell inside its edges or on them."""
    if half_edges:
        made = belts.flat(rows, columns, length / (rows - 1), width / (columns - 1))
    else:
        made = belts.flat(rows, columns, length / rows, width / columns)
    return made


def merged(deck, keyword, column):
    return np.concatenate([block.rows[column] for block in deck.blocks(keyword)])


def types_of(deck, keyword):
    return {block["NAME"]: block for block in deck.blocks(keyword)}


def masses(deck):
    """Mass of each particle in order of its id."""
    kinds = types_of(deck, "PARTICLE TYPE")
    found = {}
    for block in deck.blocks("PARTICLE"):
        found |= dict.fromkeys(block.rows["id"].tolist(), kinds[block["TYPE"]]["MASS"])
    for block in deck.blocks("PARTICLE SIZE"):
        found |= dict(zip(block.rows["id"].tolist(), block.rows["mass"].tolist()))
    return np.array([found[number] for number in sorted(found)])


def stiffness_matrix(deck, shape):
    """Linear stiffness of a flat belt in the plane z = 0, six degrees of freedom a particle, slow and obvious.

    Each bond stretches by e1, shears by e2 and e3 (with the mean rotation taken out), twists and bends; its
    energy is half the sum of stiffness times square.
    """
    size = 6 * shape[0] * shape[1]
    rows, columns, values = [], [], []
    kinds = types_of(deck, "BOND TYPE")
    for block in deck.blocks("BOND"):
        kind = kinds[block["TYPE"]]
        for (one, two), end in zip(block.rows["particles"] - 1, block.rows["position_2"]):
            length = np.linalg.norm(end)
            x = end / length
            z = np.array([0.0, 0.0, 1.0])
            y = np.cross(z, x)
            modes = np.zeros((6, 12))
            for k, axis in enumerate((x, y, z)):
                modes[k, 0:3], modes[k, 6:9] = -axis, axis
                modes[3 + k, 3:6], modes[3 + k, 9:12] = -axis, axis
            for first in (3, 9):
                modes[1, first : first + 3] = -length / 2 * z
                modes[2, first : first + 3] = length / 2 * y
            element = modes.T @ np.diag(stiffnesses(kind, length)) @ modes
            place = np.concatenate([6 * one + np.arange(6), 6 * two + np.arange(6)])
            rows.append(np.repeat(place, 12))
            columns.append(np.tile(place, 12))
            values.append(element.ravel())
    return coo_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(size, size)
    ).tocsr()


def stiffnesses(kind, length):
    """Axial, two shear, torsion and two bending stiffnesses of a rectangular bond, Timoshenko, shear factor 5/6."""
    b, t, e = kind["SECTION WIDTH"], kind["SECTION THICKNESS"], kind["YOUNGS MODULUS"]
    g = e / (2 * (1 + kind["POISSON RATIO"]))
    area, out, within = b * t, kind["REDUCTION FACTOR"] * b * t**3 / 12, t * b**3 / 12

    def shear(inertia):
        phi = 12 * e * inertia / (5 / 6 * g * area * length**2)
        return 12 * e * inertia / (length**3 * (1 + phi))

    return [
        e * area / length,
        shear(within),
        shear(out),
        g * b * t**3 / 6 / length,
        e * out / length,
        e * within / length,
    ]


def solved(matrix, fixed):
    """Displacements with `fixed` {degree of freedom: value}, and the reactions at all degrees of freedom."""
    known = np.array(sorted(fixed))
    values = np.array([fixed[k] for k in known.tolist()])
    free = np.setdiff1d(np.arange(matrix.shape[0]), known)
    found = np.zeros(matrix.shape[0])
    found[known] = values
    found[free] = spsolve(matrix[free][:, free].tocsc(), -matrix[free][:, known] @ values)
    return found, matrix @ found


def end_reaction(deck, shape, freedom, value):
    """Sum of the reactions at the last row if one freedom of its nodes is set and the first row is clamped."""
    node = np.arange(shape[0] * shape[1]).reshape(shape)
    fixed = {6 * n + k: 0.0 for n in node[0].tolist() for k in range(6)}
    fixed |= {6 * n + freedom: value for n in node[-1].tolist()}
    _, reactions = solved(stiffness_matrix(deck, shape), fixed)
    return sum(reactions[6 * n + freedom] for n in node[-1].tolist())


# The linear systems are solved to about 1e-10: membrane and bending stiffness differ by 1e6 in their condition.
SOLVED = 1e-7


@pytest.mark.parametrize("half_edges", [False, True])
@pytest.mark.parametrize(("rows", "columns"), [(6, 3), (17, 7), (34, 12)])
def test_tensile_bending_stiffness_and_mass_are_those_of_the_sheet_at_any_cell_size(
    rows, columns, half_edges
):
    made = strip(rows, columns, half_edges)
    deck, _ = converted(made, sheet=SHEET, half_edges=half_edges)
    span = LENGTH if half_edges else LENGTH * (rows - 1) / rows  # between the first and the last row
    pull = end_reaction(deck, (rows, columns), 0, 1e-3)
    assert pull * span / 1e-3 == pytest.approx(SHEET.tensile_stiffness * WIDTH, rel=SOLVED)
    moment = end_reaction(deck, (rows, columns), 4, 1e-3)
    assert moment * span / 1e-3 == pytest.approx(SHEET.bending_stiffness * WIDTH, rel=SOLVED)
    assert masses(deck).sum() == pytest.approx(SHEET.mass_per_area * LENGTH * WIDTH, rel=1e-12)


@pytest.mark.parametrize("half_edges", [False, True])
def test_transverse_stiffnesses_are_those_of_the_sheet(half_edges):
    # The belt's rows are pulled and bent by their columns: a strip that is wider than long, seen from its side.
    rows, columns = 7, 17
    made = strip(rows, columns, half_edges, length=WIDTH, width=LENGTH)
    deck, _ = converted(made, sheet=SHEET, half_edges=half_edges, pose=Pose(longitudinal="short"))
    span = LENGTH if half_edges else LENGTH * (columns - 1) / columns
    matrix = stiffness_matrix(deck, (rows, columns))
    node = np.arange(rows * columns).reshape(rows, columns)
    for freedom, stated in ((1, SHEET.tensile_stiffness_transverse), (3, SHEET.bending_stiffness_transverse)):
        fixed = {6 * n + k: 0.0 for n in node[:, 0].tolist() for k in range(6)}
        fixed |= {6 * n + freedom: 1e-3 for n in node[:, -1].tolist()}
        _, reactions = solved(matrix, fixed)
        total = sum(reactions[6 * n + freedom] for n in node[:, -1].tolist())
        assert total * span / 1e-3 == pytest.approx(stated * WIDTH, rel=SOLVED)


def test_graded_cells_carry_their_own_mass_and_section():
    s = np.concatenate([[0.0], np.cumsum(np.geomspace(0.01, 0.08, 30))])
    y = np.concatenate([[0.0], np.cumsum([0.02, 0.05, 0.08, 0.05])])
    points = np.stack(np.broadcast_arrays(s[:, None], y, 0.0), axis=-1)
    deck, conversion = converted(belts.Made(points, "open"), sheet=SHEET, half_edges=True)
    assert masses(deck).sum() == pytest.approx(SHEET.mass_per_area * s[-1] * y[-1], rel=1e-9)
    assert conversion.reports[0]["stress_free_mode"] == "row"
    pull = end_reaction(deck, points.shape[:2], 0, 1e-3)
    assert pull * s[-1] / 1e-3 == pytest.approx(SHEET.tensile_stiffness * y[-1], rel=SOLVED)


def test_a_flat_belt_meshed_at_101_percent_starts_with_one_percent_of_strain_everywhere():
    deck, conversion = converted(strip(12, 5, False), making=Making(elongation=(1.01, 1.0)))
    assert np.allclose(conversion.belts[0].flat.strains, 0.01, atol=1e-12)
    lengths = deck.blocks("BOND")[0].rows["position_2"][:, 0]
    assert np.allclose(lengths, LENGTH / 12 / 1.01, rtol=1e-12)


def test_the_stress_free_length_is_the_arc_of_the_middle_fibre():
    rows, radius, straight = 120, 0.4, 1.5
    _, conversion = converted(belts.racetrack(rows, 6, radius=radius, straight=straight))
    length = conversion.belts[0].flat.lengths
    # Central differences smear the bend over the cells at the four tangent points: t^2/24 of a cell at most there.
    turn = (2 * straight + 2 * np.pi * radius) / rows / radius
    assert np.ptp(length) == 0
    assert length[0, 0] * rows == pytest.approx(
        2 * straight + 2 * np.pi * radius, rel=4 * turn**2 / 24 / rows
    )


def test_longer_edges_of_a_trough_transition_keep_their_extra_tension():
    made = belts.racetrack(200, 9, straight=4.0, trough=35 * np.pi / 180)
    _, conversion = converted(made)
    strains = conversion.belts[0].flat.strains
    assert strains[:, 0].max() > 1e-3 > strains[:, 4].max()
    _, erased = converted(made, stress_free="bond")
    assert erased.belts[0].flat.strains.max() < 1e-9


def test_spinning_with_the_pulley_and_running_along_the_belt():
    radius, speed = 0.4, 2.5
    made = belts.racetrack(150, 5, radius=radius)
    deck, conversion = converted(made, making=Making(speed=speed))
    belt = conversion.belts[0]
    velocity, spin = (
        merged(deck, "INITIAL VELOCITY", "velocity"),
        merged(deck, "INITIAL VELOCITY", "angular_velocity"),
    )
    assert np.allclose(np.linalg.norm(velocity, axis=1), speed)
    points = merged(deck, "PARTICLE", "position")
    on_pulley = points[:, 0] > 1.5 + 0.2
    turn = (2 * 1.5 + 2 * np.pi * radius) / 150 / radius
    # The way is measured along chords, so the spin is V/R (t/2)/sin(t/2): t^2/24 above it.
    assert np.allclose(spin[on_pulley], [0, speed / radius, 0], rtol=1.1 * turn**2 / 24, atol=1e-9)
    assert np.allclose(spin[(points[:, 0] > 0.3) & (points[:, 0] < 1.2)], 0.0, atol=1e-9)
    top = (points[:, 2] > 0.39) & (points[:, 0] > 0.3) & (points[:, 0] < 1.2)
    assert np.allclose(velocity[top], [speed, 0, 0], atol=1e-9)
    assert belt.grid.kind == "endless"


@pytest.mark.parametrize("shape", [{}, {"trough": 0.6}, {"pipe": 6.0}, {"turnover": True}])
def test_an_endless_belt_carries_outside_whatever_its_shape(shape):
    made = belts.racetrack(160, 12, straight=4.0, **shape)
    _, conversion = converted(made)
    axes, points = conversion.belts[0].axes, conversion.belts[0].grid.points
    at_pulley = points[:, 0, 0] > 4.0 + 0.1
    outward = points[at_pulley] - [4.0, 0, 0]
    outward[..., 1] = 0
    assert np.all(np.sum(axes[at_pulley][..., 2] * outward, axis=-1) > 0)


def test_frames_are_right_handed_rotations_with_x_along_and_z_across_the_surface():
    _, conversion = converted(belts.racetrack(80, 7, trough=0.6, skew=0.3))
    axes = conversion.belts[0].axes
    assert np.allclose(axes @ axes.swapaxes(-1, -2), np.eye(3), atol=1e-12)
    assert np.allclose(np.linalg.det(axes), 1.0)
    along = np.roll(conversion.belts[0].grid.points, -1, axis=0) - np.roll(
        conversion.belts[0].grid.points, 1, axis=0
    )
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    # Plain central differences turn by 1e-4 against tangents that heed the uneven spacing at the transitions.
    assert np.sum(along * axes[..., 0], axis=-1).min() > 1 - 1e-6
    w, x, y, z = np.moveaxis(conversion.belts[0].orientation, -1, 0)
    e1 = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=-1)
    assert np.allclose(e1, axes[..., 0], atol=1e-12)
    q = conversion.belts[0].orientation
    assert np.sum(q[1:] * q[:-1], axis=-1).min() > 0


def test_a_skewed_belt_keeps_its_slant_in_the_transverse_bonds():
    skew = 0.4
    deck, _ = converted(belts.flat(12, 5, 0.05, 0.04, skew))
    ends = deck.blocks("BOND")[1].rows["position_2"]
    assert np.allclose(np.abs(ends), [0.04 * np.tan(skew), 0.04, 0.0], atol=1e-12)


def test_direction_flip_and_reverse_turn_the_belt():
    made = belts.racetrack(60, 5)
    top = {}
    for name, pose in {
        "plain": Pose(),
        "reverse": Pose(reverse=True),
        "west": Pose(direction=(-1, 0, 0)),
        "flip": Pose(flip=True),
    }.items():
        belt = converted(made, pose=pose)[1].belts[0]
        row = np.argmax(belt.grid.points[:, 0, 2])
        top[name] = belt.axes[row, 2]
    assert np.allclose(top["plain"], np.eye(3), atol=0.1)
    assert np.allclose(top["reverse"], np.diag([-1, -1, 1]), atol=0.1)
    assert np.allclose(top["west"], np.diag([-1, -1, 1]), atol=0.1)
    assert np.allclose(top["flip"], np.diag([1, -1, -1]), atol=0.1)


def test_one_belt_of_several_is_turned_by_its_number():
    one, two = belts.racetrack(40, 4), belts.racetrack(30, 3)
    two = belts.Made(two.points + np.array([0, 0, 0.81]), "endless")
    data = belts.ascii_stl(np.concatenate([belts.corners_of(one), belts.corners_of(two)]))
    plain = convert(data, "s.stl", Settings(unit="m")).reports
    assert [report["runs"][0] for report in plain] == pytest.approx([1, 1], abs=0.02)
    turned = convert(data, "s.stl", Settings(unit="m", pose=Pose(reverse_belts=(2,)))).reports
    assert [report["runs"][0] for report in turned] == pytest.approx([1, -1], abs=0.02)
    assert [report["carries"][2] for report in turned] == pytest.approx([1, 1], abs=0.02)


def test_the_seam_of_a_moebius_belt_joins_upside_down_without_stress():
    deck, conversion = converted(belts.moebius(40, 5))
    seam = deck.blocks("BOND")[0]
    turned = seam.rows["orientation_2"][:, 1] == 1.0
    assert seam.rows["particles"][turned].tolist() == [[196, 5], [197, 4], [198, 3], [199, 2], [200, 1]]
    axes = conversion.belts[0].axes
    relative = axes[-1].swapaxes(-1, -2) @ axes[0][::-1]
    # The belt turns by 9 degrees a row; beyond that the two frames differ by half a turn about local x.
    assert np.allclose(relative, np.diag([1.0, -1.0, -1.0]), atol=0.2)


def test_bonds_across_that_seam_take_their_section_from_the_first_particle():
    from beltsim.scene.bonding import triads_of

    deck, _ = converted(belts.moebius(40, 5))
    triads = triads_of(deck.blocks("BOND")[0].rows)
    # Every longitudinal bond lies along x with its thickness along z, the five of the seam too.
    assert np.allclose(np.abs(triads), [1, 0, 0, 0], atol=1e-12)


def test_boxes_meet_with_their_flats():
    deck, _ = converted(
        strip(10, 4, False), sheet=SHEET, making=Making(edge_radius=0.005, elongation=(1.01, 1.0))
    )
    (kind,) = deck.blocks("PARTICLE TYPE")
    assert kind["SIZE X"] - 2 * kind["EDGE RADIUS"] == pytest.approx(LENGTH / 10)
    assert kind["SIZE Y"] - 2 * kind["EDGE RADIUS"] == pytest.approx(WIDTH / 4)
    assert kind["SIZE Z"] == SHEET.thickness


def test_spheres_are_as_wide_as_the_pitch_and_weigh_as_much_as_their_cell():
    deck, _ = converted(strip(10, 4, False), sheet=SHEET, making=Making(shape="sphere"))
    (kind,) = deck.blocks("PARTICLE TYPE")
    assert 2 * kind["RADIUS"] == pytest.approx(max(LENGTH / 10, WIDTH / 4))
    assert kind["MASS"] == pytest.approx(SHEET.mass_per_area * LENGTH * WIDTH / 40)


def test_spheres_on_the_edge_weigh_half_in_types_of_their_own():
    made = strip(10, 4, True)
    deck, _ = converted(made, sheet=SHEET, half_edges=True, making=Making(shape="sphere"))
    assert masses(deck).sum() == pytest.approx(SHEET.mass_per_area * LENGTH * WIDTH)
    found = sorted((block["TYPE"], len(block)) for block in deck.blocks("PARTICLE"))
    assert found == [("belt", 16), ("belt_c2", 16), ("belt_c3", 4), ("belt_c4", 4)]


def test_fibres_get_names_and_rules_that_agree_with_the_bond_blocks():
    made = strip(6, 4, False)
    for fibres, names in {
        "rows": ["fibre_001", "fibre_002", "fibre_003", "fibre_004"],
        "alternating": ["fibre_1", "fibre_2"],
    }.items():
        deck, _ = converted(made, making=Making(fibres=fibres))
        assert list(types_of(deck, "PARTICLE TYPE")) == names
        rules = {rule["PARTICLE TYPE B"]: rule["BOND TYPE"] for rule in deck.blocks("BOND RULE")}
        assert rules == {"SAME": "longitudinal", "OTHER": "transverse"}
        name_of = {n: block["TYPE"] for block in deck.blocks("PARTICLE") for n in block.rows["id"].tolist()}
        for block in deck.blocks("BOND"):
            for one, two in block.rows["particles"].tolist():
                assert rules["SAME" if name_of[one] == name_of[two] else "OTHER"] == block["TYPE"]


def test_only_the_two_edges_of_a_pipe_belt_touch():
    deck, conversion = converted(belts.racetrack(80, 10, pipe=6.0), making=Making(touching_columns=2))
    (pair,) = deck.blocks("CONTACT GROUP PAIR")
    assert {pair["GROUP A"], pair["GROUP B"]} == {"belt_left", "belt_right"}
    assert pair["CONTACT"] is True
    assert {group["BELT"] for group in deck.blocks("CONTACT GROUP")} == {"belt"}
    (left,) = [block for block in deck.blocks("PARTICLE") if block["TYPE"] == "belt_left"]
    e2 = conversion.belts[0].axes[0, 5, :, 1]
    across = (left.rows["position"] - np.repeat(conversion.belts[0].grid.points[:, 4], 2, axis=0)) @ e2
    assert np.median(across) > 0


def test_zones_change_the_bonds_within_them_and_leave_the_rest():
    zones = (
        parse_zone("cord: columns=2 tensile-stiffness=9000N/mm"),
        parse_zone("splice: rows=1-3 thickness=20mm"),
    )
    deck, _ = converted(strip(8, 4, False), sheet=SHEET, zones=zones)
    kinds = types_of(deck, "BOND TYPE")
    assert kinds["longitudinal_cord"]["YOUNGS MODULUS"] * SHEET.thickness == pytest.approx(9e6)
    assert kinds["longitudinal_splice"]["SECTION THICKNESS"] == 0.02
    counts = {block["TYPE"]: len(block) for block in deck.blocks("BOND")}
    # Cord: rows 4-8 of column 2, four bonds along, none across. Splice: two bonds along in each of four columns.
    assert counts["longitudinal_cord"] == 4
    assert counts["longitudinal_splice"] == 8
    assert counts["transverse_splice"] == 9
    assert sum(counts.values()) == 7 * 4 + 8 * 3
    assert {block["TYPE"]: len(block) for block in deck.blocks("PARTICLE")} == {
        "belt": 15,
        "belt_splice": 12,
        "belt_cord": 5,
    }


def test_several_belts_have_names_ids_and_groups_of_their_own():
    one, two = belts.racetrack(40, 4), belts.racetrack(30, 3)
    two = belts.Made(two.points + np.array([0, 0, 0.81]), "endless")
    data = belts.ascii_stl(np.concatenate([belts.corners_of(one), belts.corners_of(two)]))
    settings = Settings(unit="m", making=Making(first_id=100, prefix="s_", fibres="rows"))
    deck = convert(data, "sandwich.stl", settings).deck
    assert {group["BELT"] for group in deck.blocks("CONTACT GROUP")} == {"s_belt_1", "s_belt_2"}
    ids = np.concatenate([block.rows["id"] for block in deck.blocks("PARTICLE")])
    assert sorted(ids.tolist()) == list(range(100, 100 + 160 + 90))
    assert deck.blocks("CONTACT PROPERTY")[0]["MATERIAL B"] == "rubber"
    assert len(types_of(deck, "BOND TYPE")) == 4


def test_the_same_input_gives_the_same_bytes():
    data = belts.ascii_stl(belts.corners_of(belts.racetrack(60, 6, trough=0.6)))
    settings = Settings(unit="m", making=Making(speed=2.0))
    assert inp.dumps(convert(data, "a.stl", settings).deck) == inp.dumps(
        convert(data, "a.stl", settings).deck
    )
