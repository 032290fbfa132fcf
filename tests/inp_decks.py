"""Blocks of every keyword, made from the keyword table, for the tests of the INP format."""

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from beltsim.inp import KEYWORDS
from beltsim.inp.schema import python_name

finite = st.floats(allow_nan=False, allow_infinity=False)
positive = st.floats(min_value=5e-324, allow_nan=False, allow_infinity=False)
texts = st.text(st.characters(blacklist_categories=["C", "Zl", "Zp"]), max_size=20)
names = texts.filter(lambda text: text and not set(text) & set("*?"))
ids = st.integers(0, 2**63 - 1)


def in_range(interval):
    if interval is None:
        return finite
    low, high = (float(bound) for bound in interval.text[1:-1].split(","))
    return st.floats(
        None if low == -np.inf else low,
        None if high == np.inf else high,
        exclude_min=low != -np.inf and interval.text[0] == "(",
        exclude_max=high != np.inf and interval.text[-1] == ")",
        allow_nan=False,
        allow_infinity=False,
    )


def whole_in_range(interval):
    if interval is None:
        return st.integers(-(2**63), 2**63 - 1)
    low, high = (float(bound) for bound in interval.text[1:-1].split(","))
    return st.integers(int(low), 2**62 if high == np.inf else int(high))


def values(parameter):
    """A strategy for the values of one parameter."""
    return {
        "name": lambda: (
            names if parameter.name == "NAME" else names | st.sampled_from(["idler_*", "roll_??"])
        ),
        "text": lambda: texts,
        "number": lambda: in_range(parameter.range),
        "step": lambda: st.just("AUTO") | in_range(parameter.range),
        "whole": lambda: whole_in_range(parameter.range),
        "choice": lambda: st.sampled_from(parameter.choices),
        "choices": lambda: st.lists(st.sampled_from(parameter.choices), min_size=1, unique=True).map(tuple),
        "flag": st.booleans,
        "colour": lambda: st.integers(0, 0xFFFFFF).map(lambda number: f"#{number:06x}"),
        "vector": lambda: st.tuples(finite, finite, positive),
        "ids": lambda: st.lists(
            st.tuples(st.integers(0, 10**17), st.integers(0, 10)).map(
                lambda pair: (pair[0], pair[0] + pair[1])
            ),
            min_size=1,
        ),
    }[parameter.kind]()


def array(column, n):
    """A strategy for n rows of one column."""
    shape = n if column.width == 1 else (n, column.required or column.width)
    if column.is_whole:
        return hnp.arrays(np.int64, shape, elements=ids, unique=True)
    if column.kind == "quaternion":
        component = st.floats(-1, 1).filter(lambda value: abs(value) > 1e-3)
        return hnp.arrays(float, shape, elements=component).map(
            lambda raw: raw / np.linalg.norm(raw, axis=1)[:, None]
        )
    return hnp.arrays(float, shape, elements=in_range(column.range))


@st.composite
def blocks(draw, name):
    """Arguments of `Deck.add` for a block of that keyword which obeys every rule within a block."""
    keyword = KEYWORDS[name]
    given_by_variant = {n for _, v in keyword.variants for n in (*v.required, *v.allowed)}
    exclusive = {n for group in keyword.one_of for n in group}
    must = {p.name for p in keyword.parameters if p.required} | (
        set(draw(st.sampled_from(keyword.one_of))) if keyword.one_of else set()
    )
    may = {p.name for p in keyword.parameters} - given_by_variant - exclusive
    rows_count = keyword.count
    fixed = {}
    if keyword.decides:
        fixed[keyword.decides], variant = draw(st.sampled_from(keyword.variants))
        must |= set(variant.required)
        may |= set(variant.allowed)
        rows_count = variant.rows or rows_count
    given = must | {name for name in sorted(may) if draw(st.booleans())}
    for group in keyword.together:
        given = given | set(group) if set(group) & given else given
    parameters = {n: draw(values(keyword.parameter(n))) for n in sorted(given)} | fixed
    least, most = rows_count
    n = draw(st.integers(least, most if most is not None else least + 4))
    rows = _rows(draw, keyword, n)
    _obey(keyword.name, parameters, rows)
    return keyword.name, {python_name(n): value for n, value in parameters.items()}, rows


def _rows(draw, keyword, n):
    if keyword.layout == "text":
        line = texts.map(str.strip).filter(lambda line: line and not line.startswith("*"))
        return {"text": draw(st.lists(line, min_size=n, max_size=n))}
    if keyword.layout == "source":
        return {"box": draw(array(keyword.columns[0], 1)), "velocity": draw(array(keyword.columns[1], 1))}
    return {column.name: draw(array(column, n)) for column in keyword.columns}


def _obey(name, parameters, rows):
    """The rules that the table cannot say."""
    if "EDGE RADIUS" in parameters:
        parameters["EDGE RADIUS"] = 0.0
    if name == "PARTICLE TYPE":
        parameters["NAME"] += "_"
    if name == "MOTION":
        if parameters["TYPE"] in ("TENSION", "SUSPENSION", "SURFACE VELOCITY"):
            for other in ("PARTICLE TYPE", "PARTICLES"):
                parameters.pop(other, None)
            parameters["PART"] = "roll_??"
        if parameters["TYPE"] in ("FREE ROTATION", "TORQUE"):
            parameters["INERTIA"] = 0.1
        rows["vector"][:, 2] = 1.0
    if name == "AMPLITUDE":
        rows["time"] = np.arange(len(rows["time"])) * 0.1
    if "box" in rows:
        rows["box"][:] = [-1, -1e-300, 0.1, 1, 1e-300, 0.1 + 2e-17 + 1e-16]
    if name == "SOURCE":
        parameters["START"], parameters["END"] = 0.1, 0.30000000000000004
        rows["fractions"] = [("coal, wet", 0.25), ("ore", 0.75)]
        parameters.pop("PARTICLE TYPE", None)
    if name == "MEASURE":
        rows["normal"][:, 1] = -1.0
    if name == "BOND":
        even = np.unique(rows["particles"][:, 0] // 2 * 2)
        for column in rows:
            rows[column] = rows[column][: len(even)]
        rows["particles"] = np.column_stack([even, even + 1])
        rows["position_1"][:, 0], rows["position_2"][:, 0] = 0.1, -0.30000000000000004
        rows["position_1"][:, 1:] = rows["position_2"][:, 1:] = 0.0
        rows["orientation_2"] = rows["orientation_1"].copy()
