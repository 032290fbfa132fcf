"""What is wrong with a text is said with file, line, what was found and what was expected; all of it at once."""

import io
import sys
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beltsim import inp
from beltsim.console import ExitCode

BAD_TEXTS = Path(__file__).with_name("inp_bad_texts.txt").read_text()


def bad_texts():
    """Name -> text, and line and wording of each of its problems."""
    cases = {}
    for section in BAD_TEXTS.split("=== ")[1:]:
        name, _, body = section.partition("\n")
        lines = body.rstrip().split("\n")
        text = "".join(f"{line}\n" for line in lines if not line.startswith("--- "))
        problems = [line[4:].split(": ", 1) for line in lines if line.startswith("--- ")]
        cases[name] = text, sorted((int(line), words) for line, words in problems)
    return cases


BAD = bad_texts() | {
    "latin-1": (b"*INFO, TITLE=a\n\xe9\n", [(2, "found the byte 0xe9, expected UTF-8 text")]),
    "UTF-16": ("*STEP".encode("utf-16"), [(1, "found UTF-16 text, expected UTF-8")]),
    "binary": (b"\x89HDF\0\0\n1\n", [(1, "found a binary file, expected INP text")]),
    "control character": (
        "*INFO, TITLE=a\x00b\n",
        [(1, "found TITLE=the control character '\\x00', expected printable text")],
    ),
}


def problems_of(text, read=inp.read_text):
    with pytest.raises(inp.InpErrors) as caught:
        read(text)
    assert caught.value.exit_code == ExitCode.INVALID_INPUT
    assert str(caught.value).splitlines() == caught.value.problems
    return caught.value.problems


@pytest.mark.parametrize("case", BAD)
def test_a_bad_text_is_refused_by_line_and_wording(case):
    text, expected = BAD[case]
    problems = problems_of(text)
    assert len(problems) == len(expected), problems
    for line, words in expected:
        assert any(problem.startswith(f"text:{line}: found ") and words in problem for problem in problems), (
            problems
        )


def test_all_problems_of_all_kinds_come_at_once_in_order():
    text = "".join(
        BAD[case][0]
        for case in ("keyword", "choice", "not a number", "duplicate id", "quaternion", "self bond")
    )
    lines = [int(problem.split(":")[1]) for problem in problems_of(text)]
    assert lines == sorted(lines)
    assert len(lines) >= 7  # the last two particles also repeat the id 1


def test_many_bad_rows_are_counted_not_listed():
    text = "*FORCE\n" + "x,0,0,0,0,0,0\n" * 1000
    problems = problems_of(text)
    assert len(problems) == 51
    assert "950 more bad lines" in problems[-1]


def test_a_bad_row_far_down_a_large_block_is_named_by_its_line():
    text = "*FORCE\n" + "1,0.123456789,0.123456789,0,0,0,0\n" * 300_000
    lines = text.splitlines()
    lines[290_000] = "1,0,oops,0,0,0,0"
    assert problems_of("\n".join(lines)) == ["text:290001: found 'oops' as fy, expected a number"]


def test_a_problem_does_not_hide_others_nor_make_false_ones():
    text = (
        "*FORMAT, NAME=BELTSIM, VERSION=1\n"
        "*MATERIAL, NAME=m, DENSITY=x, YOUNGS MODULUS=1, POISSON RATIO=0\n"
        "*PARTICEL TYPE, NAME=a, SHAPE=SPHERE, RADIUS=1, MATERIAL=m\n"
        "*PARTICLE, TYPE=a\n1,0,0,0,1,0,0,0\n2,0,0,0,1,0,0\n"
        "*INITIAL VELOCITY\n2,0,0,0,0,0,0\n"
        "*PART, NAME=p, SHAPE=PLANE, MATERIAL=n\n0,0,0,1,0,0,0\n"
    )
    problems = problems_of(text, read=read_case_text)
    assert [int(problem.split(":")[1]) for problem in problems] == [1, 2, 3, 6, 9]
    assert "no *STEP" in problems[0]
    assert "MATERIAL=n" in problems[4]


def read_case_text(text):
    stdin = sys.stdin
    sys.stdin = io.TextIOWrapper(io.BytesIO(text.encode()))
    try:
        return inp.read_case("-")
    finally:
        sys.stdin = stdin


def test_a_cycle_of_includes_is_named(tmp_path, monkeypatch):
    (tmp_path / "a.inp").write_text("** c\n*INCLUDE, INPUT=b.inp\n")
    (tmp_path / "b.inp").write_text("*INCLUDE, INPUT=./a.inp\n")
    monkeypatch.chdir(tmp_path)
    assert problems_of("a.inp", read=inp.read) == [
        "b.inp:1: found the cycle a.inp -> b.inp -> a.inp, expected included files that do not include one another"
    ]


def test_problems_of_included_text_keep_its_file_and_line(tmp_path, monkeypatch):
    (tmp_path / "sub").mkdir()
    (tmp_path / "a.inp").write_text("*INCLUDE, INPUT=sub/b.inp\n*INCLUDE, INPUT=gone.inp\n*STEP\n")
    (tmp_path / "sub/b.inp").write_text("\n*STEP\n")
    monkeypatch.chdir(tmp_path)
    problems = problems_of("a.inp", read=inp.read)
    assert [problem.split(" found")[0] for problem in problems] == ["sub/b.inp:2:", "a.inp:2:", "a.inp:3:"]
    assert "INPUT=gone.inp (No such file or directory)" in problems[1]


def test_an_include_of_a_folder_is_a_problem(tmp_path, monkeypatch):
    (tmp_path / "a.inp").write_text("*INCLUDE, INPUT=.\n")
    monkeypatch.chdir(tmp_path)
    assert "a.inp:1: found INPUT=. (Is a directory)" in problems_of("a.inp", read=inp.read)[0]


def test_including_a_file_twice_is_no_cycle(tmp_path, monkeypatch):
    (tmp_path / "a.inp").write_text("*INCLUDE, INPUT=b.inp\n*INCLUDE, INPUT=b.inp\n")
    (tmp_path / "b.inp").write_text("*AMPLITUDE, NAME=a\n0,1\n")
    monkeypatch.chdir(tmp_path)
    assert len(inp.read("a.inp")) == 1


# every keyword of the format in one small case
WHOLE = Path(__file__).with_name("inp_whole_case.inp").read_text()


def test_the_whole_case_has_every_keyword_and_is_accepted():
    deck = read_case_text(WHOLE)
    assert {block.keyword for block in deck.blocks()} == set(inp.KEYWORDS) - {"INCLUDE"}
    assert inp.read_text(inp.dumps(deck)) == deck


@settings(max_examples=120, deadline=None, derandomize=True, database=None)
@given(st.data())
def test_a_damaged_case_is_refused_or_read_but_never_breaks_the_reader(data):
    text = WHOLE
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(text)))
        stop = start + data.draw(st.integers(0, 30))
        text = text[:start] + data.draw(st.text('*?,="\n\r-1e9.x \x00é', max_size=4)) + text[stop:]
    deck = None
    with suppress(inp.InpErrors):
        deck = inp.read_text(text)
    if deck is not None:
        assert inp.read_text(inp.dumps(deck)) == deck
        with suppress(inp.InpErrors):
            inp.check_case(deck)
    with suppress(inp.InpErrors):
        read_case_text(text)
