"""The rows of one block: read by the keyword's layout, then checked for finite numbers, ranges and unit length."""

from __future__ import annotations

import numpy as np

from .deck import Block
from .errors import Mismatch, Problems, Where
from .lexer import RawBlock, split_fields, unquoted
from .rows import as_matrix, empty_rows, unit_quaternions
from .schema import Column, Keyword
from .table import Lines, read_table
from .values import parse_number


def read_rows(keyword: Keyword, raw: RawBlock, data: bytes, problems: Problems):
    """The `rows` of a block, and the line number of each."""
    if keyword.layout == "columns" and keyword.columns:
        text = memoryview(data)[raw.start : raw.stop]
        rows, lines = read_table(keyword, text, Where(raw.where.file, raw.first_line), problems)
        return _checked(keyword, rows, lines, raw.where, problems)
    lines = Lines(data[raw.start : raw.stop], raw.first_line)
    if keyword.layout == "text":
        return {"text": list(lines)}, lines.numbers
    if keyword.layout == "source":
        return _source_rows(keyword, lines, raw.where, problems), lines.numbers
    if lines:
        where = Where(raw.where.file, lines.numbers[0])
        problems.add(where, repr(lines[0][:60]), f"no data lines after *{keyword.name}")
    return {}, None


def _checked(keyword: Keyword, rows: dict, lines, where: Where, problems: Problems):
    block = Block(keyword.name, {}, rows, where, lines=lines)
    for column in keyword.columns:
        values = as_matrix(rows[column.name])
        for name, field in zip(column.fields, values.T):
            _check_field(block, column, name, field, problems)
        if column.kind == "quaternion":
            rows[column.name] = _unit(block, column, values, problems)
    return rows, lines


def _check_field(block: Block, column: Column, name: str, field: np.ndarray, problems: Problems) -> None:
    if column.least == 0 and np.isnan(field).all():
        return  # left out
    finite = np.isfinite(field)
    problems.add_rows(block, np.flatnonzero(~finite), lambda i: f"{field[i]} as {name}", "a finite number")
    if column.kind == "id":
        problems.add_rows(block, np.flatnonzero(field < 0), lambda i: f"{field[i]} as {name}", "an id from 0")
    if column.range is not None:
        outside = np.flatnonzero(finite & ~column.range.holds(field))
        expected = f"a number {column.range.words} {column.unit}".rstrip()
        problems.add_rows(block, outside, lambda i: f"{float(field[i]):.9g} as {name}", expected)


def _unit(block: Block, column: Column, values: np.ndarray, problems: Problems) -> np.ndarray:
    units, bad = unit_quaternions(values)
    problems.add_rows(
        block,
        bad[np.isfinite(values[bad]).all(axis=1)],
        lambda i: f"a quaternion of length {float(np.linalg.norm(values[i])):.9g}",
        f"{', '.join(column.fields)} of length 1 within 1e-6",
    )
    return units


def _source_rows(keyword: Keyword, lines: Lines, where: Where, problems: Problems) -> dict:
    rows = empty_rows(keyword)
    for i, (line, number) in enumerate(zip(lines, lines.numbers)):
        try:
            fields = split_fields(line.removesuffix(","))
            if i < len(keyword.columns):
                column = keyword.columns[i]
                rows[column.name] = np.array([_numbers(column.fields, fields)])
            else:
                rows["fractions"].append(_fraction(fields))
        except Mismatch as error:
            problems.add_mismatch(Where(where.file, number), error)
    return rows


def _numbers(names: tuple[str, ...], fields: list[str]) -> list[float]:
    if len(fields) != len(names):
        raise Mismatch(f"{len(fields)} fields", f"{len(names)}: {', '.join(names)}")
    numbers = []
    for name, field in zip(names, fields):
        try:
            numbers.append(parse_number(field))
        except Mismatch as error:
            raise Mismatch(f"{error.found} as {name}", error.expected) from None
    return numbers


def _fraction(fields: list[str]) -> tuple[str, float]:
    if len(fields) != 2:
        raise Mismatch(f"{len(fields)} fields", "2: particle type, mass fraction")
    return unquoted(fields[0]), parse_number(fields[1])
