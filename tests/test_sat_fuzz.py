"""Damaged SAT text gives an error or is left out by name: never a traceback, never a roller that is not true."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sat_solids import Body, box, cylinder, revolve, roller, write_sat

from beltsim.console import CommandError
from partconverter.finding import find_rollers

FILLETS = [(0, -200), (95, -200, (95, -195)), (100, -195), (100, 195, (95, 195)), (95, 200), (0, 200)]
SOLIDS = [
    Body([cylinder(133, 380, (0, 100, 0), (0, 1, 0), bore=120)], "tube"),
    roller(159, 465, 30, 520, (500, 0, 0), (1, 0, 0), seam=True),
    revolve(FILLETS, (0, 0, 900), pieces=2),
    box((100, 900, 80)),
]
TEXTS = {version: write_sat(SOLIDS, version) for version in (106, 400, 700, 2800, 22700)}
# Diameter, length, overall, bore, centre: what may be found, in mm.
TRUTH = [
    (133, 380, 380, 120, (0, 100, 0)),
    (159, 465, 520, 0, (500, 0, 0)),
    (200, 400, 400, 0, (0, 0, 900)),
]
# A number may be off by what tolerant models are allowed to be off: 1e-3 of the largest radius.
SLACK = 0.2


def first_record(text: str) -> int:
    """Where the records begin: what the header says (unit, version) cannot be told from the truth."""
    return text.index("\nbody ") if "\nasmheader" not in text else text.index("\nasmheader ")


def is_true(one) -> bool:
    """Whether a roller is in the truth; one that carries a warning may have lost its bore."""
    middle = [o + sum(one.drum) / 2 * a for o, a in zip(one.origin, one.axis)]
    for diameter, length, overall, bore, centre in TRUTH:
        pairs = [(one.diameter, diameter), (one.drum.length, length), (one.overall.length, overall)]
        pairs += [*zip(middle, centre)] + ([] if one.notes else [(one.bore, bore)])
        if all(abs(1000 * size - true) <= SLACK for size, true in pairs):
            return True
    return False


def check(text: str | bytes) -> None:
    """Only known errors, and only true rollers."""
    message, rollers = outcome(text.encode("latin-1", errors="replace") if isinstance(text, str) else text)
    assert message is None or message.startswith("x.sat:")
    assert all(map(is_true, rollers)), rollers


def outcome(data: bytes):
    """The message of a refusal, and the rollers found."""
    try:
        return None, find_rollers(data, "x.sat").rollers
    except CommandError as error:
        return str(error), []


fuzz = settings(
    max_examples=100, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)


@pytest.mark.parametrize("version", TEXTS)
def test_the_undamaged_text_gives_the_whole_truth(version):
    found = find_rollers(TEXTS[version].encode(), "x.sat")
    assert len(found.rollers) == 3
    assert all(map(is_true, found.rollers))


@fuzz
@given(version=st.sampled_from(list(TEXTS)), data=st.data())
def test_changed_characters(version, data):
    text = TEXTS[version]
    start = first_record(text)
    for _ in range(data.draw(st.integers(1, 3))):
        i = data.draw(st.integers(start, len(text) - 1))
        text = (
            text[:i] + data.draw(st.sampled_from(list("0123456789.-+eE$#@{} \nabFIT\x00~"))) + text[i + 1 :]
        )
    check(text)


@fuzz
@given(version=st.sampled_from(list(TEXTS)), data=st.data())
def test_lost_stretches(version, data):
    text = TEXTS[version]
    start = data.draw(st.integers(first_record(text), len(text) - 1))
    end = data.draw(st.integers(start + 1, min(len(text), start + 400)))
    check(text[:start] + text[end:])


@fuzz
@given(version=st.sampled_from(list(TEXTS)), data=st.data())
def test_exchanged_words(version, data):
    text = TEXTS[version]
    start = first_record(text)
    words = text[start:].split(" ")
    i, j = data.draw(st.integers(0, len(words) - 1)), data.draw(st.integers(0, len(words) - 1))
    words[i], words[j] = words[j], words[i]
    check(text[:start] + " ".join(words))


@fuzz
@given(version=st.sampled_from(list(TEXTS)), data=st.data())
def test_numbers_out_of_any_range(version, data):
    text = TEXTS[version]
    start = first_record(text)
    words = text[start:].split(" ")
    numbers = [i for i, word in enumerate(words) if word.lstrip("-").replace(".", "").isdigit()]
    i = data.draw(st.sampled_from(numbers))
    words[i] = data.draw(
        st.sampled_from(
            ["nan", "inf", "-inf", "1e999", "-1e308", "1e-320", "1.#INF", "0", "--1", "1_0", "1,5"]
        )
    )
    check(text[:start] + " ".join(words))


@fuzz
@given(version=st.sampled_from(list(TEXTS)), data=st.data())
def test_lost_and_doubled_lines(version, data):
    lines = TEXTS[version].splitlines(keepends=True)
    first = next(i for i, line in enumerate(lines) if line.startswith(("body ", "asmheader ")))
    i = data.draw(st.integers(first, len(lines) - 1))
    lines[i : i + 1] = data.draw(st.sampled_from([[], [lines[i], lines[i]], ["\n"]]))
    check("".join(lines))


@fuzz
@given(data=st.binary(max_size=300))
def test_any_bytes(data):
    check(data)


@fuzz
@given(version=st.sampled_from(list(TEXTS)), tail=st.text(max_size=200))
def test_a_header_with_anything_behind(version, tail):
    text = TEXTS[version]
    start = first_record(text)
    check(text[:start] + "\n" + tail)
