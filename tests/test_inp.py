"""INP text to Deck and back: nothing changes, however the text is spelt."""

import io
import subprocess
import sys

import inp_decks
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beltsim import inp
from beltsim.inp import KEYWORDS
from beltsim.inp.reference_page import page
from beltsim.inp.values import number_text

CONTENT = sorted(set(KEYWORDS) - {"INCLUDE"})


def round_trip(deck):
    return inp.read_text(inp.dumps(deck))


@pytest.mark.parametrize("keyword", CONTENT)
def test_every_keyword_of_the_table_comes_back_bit_for_bit(keyword):
    @settings(max_examples=20, deadline=None, derandomize=True, database=None)
    @given(inp_decks.blocks(keyword))
    def check(block):
        name, parameters, rows = block
        deck = inp.Deck()
        added = deck.add(name, rows=rows, **parameters)
        again = round_trip(deck)
        assert again.blocks() == [added]
        assert inp.dumps(again) == inp.dumps(deck)

    check()


@settings(max_examples=200, deadline=None, derandomize=True, database=None)
@given(inp_decks.finite, inp_decks.finite, inp_decks.names, inp_decks.texts)
def test_any_number_name_and_text_comes_back(number, other, name, title):
    deck = inp.Deck()
    deck.add("GRAVITY", rows={"acceleration": [number, other, -0.0]})
    deck.add("AMPLITUDE", name=name, rows={"time": [0.0], "factor": [number]})
    deck.add("MOTION", part="a", type="ROTATION", angular_velocity=number, axis=(1.0, other, -0.0))
    deck.add("INFO", title=title)
    assert round_trip(deck) == deck


@settings(max_examples=500, deadline=None, derandomize=True, database=None)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_s_text_is_no_longer_than_python_s(number):
    assert float(number_text(number)).hex() == number.hex()
    assert len(number_text(number)) <= len(repr(number))


@settings(max_examples=100, deadline=None, derandomize=True, database=None)
@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_a_quaternion_that_is_unit_to_rounding_keeps_every_bit(raw):
    unit = np.array([raw]) / np.linalg.norm(raw)
    deck = inp.Deck()
    deck.add("PARTICLE", type="a", rows={"id": [1], "position": [[0, 0, 0]], "orientation": unit})
    assert round_trip(deck).blocks()[0].rows["orientation"].tobytes() == unit.tobytes()


def test_a_quaternion_within_1e_6_of_unit_length_is_made_unit_and_stays_so():
    text = "*PARTICLE, TYPE=a\n1, 0,0,0, 1.0000009,0,0,0\n"
    deck = inp.read_text(text)
    assert deck.blocks()[0].rows["orientation"].tolist() == [[1.0, 0.0, 0.0, 0.0]]
    assert round_trip(deck) == deck


def test_numbers_are_written_as_the_shortest_text():
    deck = inp.Deck()
    deck.add("GRAVITY", rows={"acceleration": [1e22, 1e-7, -9.81]})
    deck.add(
        "BOND TYPE", name="b", radius=0.005, youngs_modulus=2.1e11, poisson_ratio=1 / 3, damping_factor=2e-5
    )
    assert inp.dumps(deck) == (
        b"*GRAVITY\n1e22, 1e-7, -9.81\n"
        b"*BOND TYPE, NAME=b, RADIUS=0.005, YOUNGS MODULUS=2.1e11, POISSON RATIO=0.3333333333333333, "
        b"DAMPING FACTOR=2e-5\n"
    )


def test_rows_beyond_one_chunk_of_the_writer_and_the_reader_come_back():
    n = 150_000  # the writer makes 65,536 rows at a time, the reader 8 MB
    random = np.random.default_rng(0)
    rows = {
        "id": random.permutation(n),
        "force": random.normal(size=(n, 3)),
        "torque": random.normal(size=(n, 3)),
    }
    deck = inp.Deck()
    deck.add("FORCE", rows=rows)
    again = round_trip(deck)
    assert again == deck
    assert again.blocks()[0].row_where(n - 1).line == n + 1


def test_writing_leaves_the_deck_as_it_was():
    deck = inp.read_text(SPELT_PLAINLY)
    before = inp.dumps(deck)
    inp.write(deck, io.BytesIO())
    assert inp.dumps(deck) == before


SPELT_PLAINLY = """\
*MATERIAL, NAME=rubber, DENSITY=1200, YOUNGS MODULUS=5e6, POISSON RATIO=0.45
*PARTICLE TYPE, NAME=a, SHAPE=SPHERE, RADIUS=0.0665, MATERIAL=rubber
*PARTICLE, TYPE=a
1, 0, 0, 0.5, 1, 0, 0, 0
2, 0.1, 0, 0.5, 1, 0, 0, 0
*MOTION, PARTICLES="1, 2", TYPE=ROTATION, ANGULAR VELOCITY=6.283185307179586
*OUTPUT, INTERVAL=0.02, FIELDS="VELOCITY, ORIENTATION, BOND FORCE"
"""

AWKWARD = {
    "byte order mark": lambda text: "\ufeff" + text,
    "CRLF": lambda text: text.replace("\n", "\r\n"),
    "no line feed at the end": lambda text: text.rstrip("\n"),
    "blank lines": lambda text: text.replace("\n", "\n\n  \n"),
    "comments": lambda text: "** one\n" + text.replace("\n", "\n** two, three\n***\n"),
    "lower-case keywords": lambda text: text.replace("*PARTICLE TYPE", "*particle type").replace(
        "*MAT", "*Mat"
    ),
    "lower-case parameters": lambda text: text.replace("SHAPE=", "shape=").replace("NAME=", "Name="),
    "lower-case choices": lambda text: text.replace("SPHERE", "sphere").replace(
        "VELOCITY, OR", "Velocity, or"
    ),
    "blanks around everything": lambda text: text.replace(",", " ,  ").replace("=", " = "),
    "trailing commas in rows": lambda text: text.replace("1, 0, 0, 0\n", "1, 0, 0, 0,\n"),
    "continuation": lambda text: text.replace("YOUNGS", "\n    YOUNGS").replace("RADIUS", "\n** c\n\nRADIUS"),
    "quotes": lambda text: text.replace("=rubber", '="rubber"').replace("0.02", '"0.02"'),
    "units": lambda text: (
        text.replace("0.0665", "66.5 mm").replace("5e6", "5MPa").replace("6.283185307179586", "60 rpm")
    ),
    "signs and exponents": lambda text: (
        text.replace("0.5", "+.5").replace("0.1", "1.E-1").replace("1200", "12e2")
    ),
    "list of ids by blanks": lambda text: text.replace('"1, 2"', '"  1 2 "'),
    "lists by blanks": lambda text: text.replace("VELOCITY, ORIENTATION, BOND", "VELOCITY  ORIENTATION BOND"),
    "order": lambda text: "".join(text.splitlines(keepends=True)[i] for i in (2, 3, 4, 5, 6, 1, 0)),
    "a thing defined twice": lambda text: text + text.splitlines()[0] + "\n",
    "joined files with marks of their own": lambda text: text.replace("*PARTICLE,", "\ufeff*PARTICLE,"),
}


@pytest.mark.parametrize("spelling", AWKWARD)
def test_the_same_deck_however_it_is_spelt(spelling):
    def content(deck):
        return sorted((block.keyword, inp.dumps(inp.Deck([block]))) for block in deck.blocks())

    spelt = AWKWARD[spelling](SPELT_PLAINLY)
    assert spelt != SPELT_PLAINLY
    plain = content(inp.read_text(SPELT_PLAINLY))
    assert content(inp.read_text(spelt)) == plain


def test_a_block_may_occur_many_times_and_be_split():
    deck = inp.read_text("*FORCE\n1,0,0,1,0,0,0\n*FORCE\n1,0,0,2,0,0,0\n")
    assert [block.rows["force"][0, 2] for block in deck.blocks("FORCE")] == [1.0, 2.0]


def test_rows_know_their_lines_through_comments_and_blank_lines():
    deck = inp.read_text("** c\n*FORCE\n1,0,0,1,0,0,0\n** c\n\n2,0,0,1,0,0,0\n")
    assert [str(deck.blocks()[0].row_where(i)) for i in range(2)] == ["text:3", "text:6"]


def test_a_default_stands_for_what_is_not_given():
    block = inp.read_text("*STEP, DURATION=2\n").blocks()[0]
    assert (block["TIME STEP"], block["SAFETY"], block.get("NAME"), block.get("SAFETY", None)) == (
        "AUTO",
        0.8,
        None,
        None,
    )
    assert "SAFETY" not in block
    with pytest.raises(KeyError, match="without NAME"):
        block["NAME"]
    with pytest.raises(KeyError, match="no parameter"):
        block.get("SAVETY")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("66.5 mm", 0.0665),
        # 4.1 * 0.001 in floats is one ulp off
        ("4.1 mm", 0.0041),
        ("133mm", 0.133), ("1 in", 0.0254), ("2.5 ft", 0.762), ("7 cm", 0.07), ("3e-3 m", 0.003),
    ],
)  # fmt: skip
def test_a_length_with_a_unit_is_the_float_nearest_to_it(text, value):
    (block,) = inp.read_text(f"*FILL, PARTICLE TYPE=a, BELT=b, HEIGHT={text}\n").blocks()
    assert block["HEIGHT"] == value


@pytest.mark.parametrize(
    ("line", "name", "value"),
    [
        ("*MOTION, PART=a, TYPE=ROTATION, ANGULAR VELOCITY=60 rpm", "ANGULAR VELOCITY", 2 * np.pi),
        ("*MATERIAL, NAME=a, DENSITY=1, YOUNGS MODULUS=0.21 GPa, POISSON RATIO=0", "YOUNGS MODULUS", 2.1e8),
        ("*STEP, DURATION=1.5 min", "DURATION", 90.0),
        ("*STEP, DURATION=1, TIME STEP=2e-6 s", "TIME STEP", 2e-6),
        ("*MOTION, PART=a, TYPE=FREE ROTATION, INERTIA=0.05 kg m2", "INERTIA", 0.05),
        ("*DAMPING, MASS PROPORTIONAL=2 1/s", "MASS PROPORTIONAL", 2.0),
    ],
)
def test_units_of_other_dimensions(line, name, value):
    assert inp.read_text(line + "\n").blocks()[0][name] == value


def test_units_that_make_rates_and_forces():
    deck = inp.read_text(
        "*SOURCE, NAME=a, PARTICLE TYPE=b, MASS RATE=3600 t/h\n0,0,0,1,1,1\n0,0,0\n"
        "*MOTION, PART=a, TYPE=TENSION, FORCE=4 kN, MASS=1\n1,0,0\n"
        "*MOTION, PART=b, TYPE=SUSPENSION, STIFFNESS=2 N/mm, MASS=1\n1,0,0\n"
    )
    source, tension, spring = deck.blocks()
    assert (source["MASS RATE"], tension["FORCE"], spring["STIFFNESS"]) == (1000.0, 4000.0, 2000.0)


def test_columns_have_the_types_and_shapes_of_the_map():
    deck = inp.read_text(
        "*BOND, TYPE=b\n1,2, 0,0,0,1,0,0,0, 1,0,0,1,0,0,0\n"
        "*MOTION, PARTICLE TYPE=a, TYPE=VELOCITY\n1,2,3\n"
        "*MOTION, PARTICLE TYPE=b, TYPE=VELOCITY\n1,2,3,4,5,6\n"
        "*MEASURE, NAME=m, TYPE=MASS FLOW\n0,0,0,1,0,0\n"
        "*MEASURE, NAME=n, TYPE=MASS FLOW\n0,0,0,1,0,0,0.5\n"
        "*PARTICLE, TYPE=a\n"
    )
    bond, short, long, plane, disc, empty = (block.rows for block in deck.blocks())
    assert bond["particles"].dtype == np.int64
    assert {name: column.shape for name, column in bond.items()} == {
        "particles": (1, 2), "position_1": (1, 3), "orientation_1": (1, 4),
        "position_2": (1, 3), "orientation_2": (1, 4),
    }  # fmt: skip
    assert (short["vector"].shape, long["vector"].shape) == ((1, 3), (1, 6))
    assert np.isnan(plane["radius"]).tolist() == [True]
    assert disc["radius"].tolist() == [0.5]
    assert {name: column.shape for name, column in empty.items()} == {
        "id": (0,), "position": (0, 3), "orientation": (0, 4),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("keyword", "arguments", "words"),
    [
        ("PARTICEL", {}, "no keyword .*did you mean PARTICLE"),
        ("STEP", {"duraton": 1}, "no parameter DURATON; did you mean DURATION"),
        ("STEP", {}, "needs DURATION"),
        ("STEP", {"duration": -1}, "above 0"),
        ("STEP", {"duration": float("nan")}, "finite"),
        ("STEP", {"duration": None}, "needs DURATION"),
        ("CONTACT MODEL", {"type": "HERZ"}, "HERTZ MINDLIN or LINEAR"),
        ("PART", {"name": "a*", "shape": "PLANE", "material": "b"}, "wildcards"),
        ("PART", {"name": "a\nb", "shape": "PLANE", "material": "b"}, "control character"),
        ("GRAVITY", {"rows": {"g": [0, 0, 1]}}, "no column g"),
        ("GRAVITY", {"rows": {"acceleration": [0, 0, np.inf]}}, "NaN or infinity"),
        ("GRAVITY", {"rows": {"acceleration": [0, 0]}}, "shape"),
        ("FORCE", {"rows": {"id": [1.5], "force": [[0, 0, 0]], "torque": [[0, 0, 0]]}}, "whole numbers"),
        ("FORCE", {"rows": {"id": [1, 2], "force": [[0, 0, 0]], "torque": [[0, 0, 0]]}}, "differ in length"),
        (
            "PARTICLE",
            {"type": "a", "rows": {"id": [1], "position": [[0, 0, 0]], "orientation": [[1, 1, 0, 0]]}},
            "unit",
        ),
        ("INFO", {"title": "a", "rows": {"text": ["*b"]}}, "begin with"),
    ],
)
def test_a_slip_in_python_is_refused_where_it_is_made(keyword, arguments, words):
    with pytest.raises(ValueError, match=words):
        inp.Deck().add(keyword, **arguments)


def test_included_text_stands_in_place_with_its_own_file_and_lines(tmp_path, monkeypatch):
    (tmp_path / "belt").mkdir()
    (tmp_path / "case.inp").write_text(
        "*FORMAT, NAME=BELTSIM, VERSION=1\n*INCLUDE, INPUT=belt/belt.inp\n*STEP, DURATION=1\n"
    )
    (tmp_path / "belt/belt.inp").write_text("*FORMAT, NAME=BELTSIM, VERSION=1\n\n*INCLUDE, INPUT=types.inp\n")
    (tmp_path / "belt/types.inp").write_text("** c\n*AMPLITUDE, NAME=a\n0,1\n")
    monkeypatch.chdir(tmp_path)
    deck = inp.read_case("case.inp")
    assert [block.keyword for block in deck.blocks()] == ["FORMAT", "AMPLITUDE", "STEP"]
    assert str(deck.blocks("AMPLITUDE")[0].row_where(0)) == "belt/types.inp:3"
    assert deck.blocks("AMPLITUDE")[0].folder == (tmp_path / "belt").relative_to(tmp_path)


def test_stdin_is_read_and_includes_from_the_working_directory(tmp_path, monkeypatch):
    (tmp_path / "a.inp").write_text("*AMPLITUDE, NAME=a\n0,1\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"*INCLUDE, INPUT=a.inp\n")))
    assert [block["NAME"] for block in inp.read("-").blocks()] == ["a"]


def test_the_reference_page_is_current(request):
    written = (request.config.rootpath / "docs/inp-reference.md").read_text()
    assert written == page(), "run: python -m beltsim.inp.reference_page > docs/inp-reference.md"


def test_the_format_is_read_without_the_solver_s_libraries():
    code = (
        "import sys; import beltsim.inp as i; i.read_text('*STEP, DURATION=1\\n'); "
        "print([m for m in ('numba', 'h5py', 'trimesh', 'scipy') if m in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"
