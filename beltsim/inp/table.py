"""Data lines to arrays: numpy's C parser first, line by line only where that stumbles."""

from __future__ import annotations

import io
import warnings
from collections.abc import Sequence

import numpy as np

from .errors import MOST_PER_BLOCK, Mismatch, Problems, Where
from .rows import empty_rows
from .schema import Column, Keyword
from .values import parse_number, parse_whole

# Text of so many bytes is parsed at a time, so that lines never stand all in memory as Python objects.
_CHUNK = 1 << 23


class Lines(list):
    """Data lines as text, without comments, blank lines and outer blanks; `numbers` are their line numbers."""

    def __init__(self, data: bytes, first_line: int):
        kept = [
            (number, line)
            for number, line in enumerate(map(bytes.strip, data.split(b"\n")), start=first_line)
            if line and not line.startswith(b"**")
        ]
        super().__init__(line.decode(errors="replace") for _, line in kept)
        self.numbers = [number for number, _ in kept]


def read_table(keyword: Keyword, data: memoryview, where: Where, problems: Problems):
    """The arrays of a block and the line number of each row; bad lines are noted and left out.

    `where` is the first data line.
    """
    parts, numbers, line, start = [], [], where.line, 0
    limit = len(problems) + MOST_PER_BLOCK
    while start < len(data) and len(problems) < limit:
        chunk = bytes(data[start : start + _CHUNK])
        if start + len(chunk) < len(data):
            chunk += _rest_of_line(data, start + len(chunk))
        part = _fast(keyword, chunk, line) or _careful(keyword, chunk, Where(where.file, line), problems)
        if part is not None:
            parts.append(part[0])
            numbers.append(part[1] if isinstance(part[1], range) else np.asarray(part[1], np.int64))
        line += chunk.count(b"\n")
        start += len(chunk)
    return _columns(keyword, parts), _joined(numbers)


def _rest_of_line(data: memoryview, position: int) -> bytes:
    rest = b""
    while position < len(data) and b"\n" not in rest:
        rest += bytes(data[position : position + 4096])
        position += 4096
    newline = rest.find(b"\n")
    return rest if newline < 0 else rest[: newline + 1]


def _dtype(keyword: Keyword) -> np.dtype:
    return np.dtype(
        [
            (
                column.name,
                np.int64 if column.is_whole else np.float64,
                (column.width,) if column.width > 1 else (),
            )
            for column in keyword.columns
        ]
    )


def _parsed(keyword: Keyword, source) -> np.ndarray | None:
    with warnings.catch_warnings():
        # numpy still takes 1.5 for a whole number, with a warning
        warnings.simplefilter("error")
        try:
            return np.loadtxt(source, _dtype(keyword), delimiter=",", comments=None, ndmin=1)
        except (ValueError, Warning):
            return None


def _fast(keyword: Keyword, chunk: bytes, first_line: int):
    """Rows and their line numbers if every line of the chunk is a row as the table says, else None."""
    if any(column.least is not None for column in keyword.columns) or not chunk.strip():
        return None
    rows = _parsed(keyword, io.BytesIO(chunk))
    lines = chunk.count(b"\n") + (not chunk.endswith(b"\n"))
    return (rows, range(first_line, first_line + lines)) if rows is not None and len(rows) == lines else None


def _careful(keyword: Keyword, chunk: bytes, where: Where, problems: Problems):
    lines = Lines(chunk, where.line)
    if not lines:
        return None
    texts = [line.removesuffix(",") for line in lines]
    if all(column.least is None for column in keyword.columns):
        rows = _parsed(keyword, texts)
        if rows is not None and len(rows) == len(texts):
            return rows, lines.numbers
    return _line_by_line(keyword, texts, lines.numbers, where.file, problems)


def _line_by_line(keyword: Keyword, texts: list[str], numbers: list[int], file: str, problems: Problems):
    """The good rows and their line numbers, after noting what is wrong with each other line."""
    rows, good, bad = [], [], 0
    for text, number in zip(texts, numbers):
        try:
            rows.append(_row(keyword, [field.strip() for field in text.split(",")]))
            good.append(number)
        except Mismatch as error:
            bad += 1
            if bad <= MOST_PER_BLOCK:
                problems.add_mismatch(Where(file, number), error)
    if bad > MOST_PER_BLOCK:
        found = f"{bad - MOST_PER_BLOCK} more bad lines"
        problems.add(Where(file, numbers[-1]), found, f"lines as *{keyword.name} has them")
    return (_as_records(keyword, rows), good) if rows else None


def _row(keyword: Keyword, fields: list[str]) -> list:
    names = [(column, name) for column in keyword.columns for name in column.fields]
    counts = _allowed_counts(keyword)
    if len(fields) not in counts:
        raise Mismatch(f"{_counted(fields)}", f"{_count_words(counts)}: {_names(keyword)}{_hint(fields)}")
    return [_field(column, name, field) for (column, name), field in zip(names, fields)]


def _field(column: Column, name: str, text: str):
    try:
        return parse_whole(text) if column.is_whole else parse_number(text)
    except Mismatch as error:
        raise Mismatch(f"{error.found} as {name}", error.expected + _hint([text])) from None


def _hint(fields: list[str]) -> str:
    return "; a keyword begins in column 1" if fields[0].startswith("*") else ""


def _counted(fields: list[str]) -> str:
    return f"{len(fields)} field{'s' if len(fields) > 1 else ''}"


def _allowed_counts(keyword: Keyword) -> list[int]:
    full = sum(column.width for column in keyword.columns)
    return sorted({full, sum(column.required for column in keyword.columns)})


def _count_words(counts: Sequence[int]) -> str:
    return " or ".join(map(str, counts))


def _names(keyword: Keyword) -> str:
    return ", ".join(name for column in keyword.columns for name in column.fields)


def _as_records(keyword: Keyword, rows: list[list]):
    """Rows of full length as a structured array; shorter ones (optional fields) as they are."""
    full = sum(column.width for column in keyword.columns)
    if any(len(row) < full for row in rows):
        return rows
    records = np.empty(len(rows), _dtype(keyword))
    position = 0
    for column in keyword.columns:
        values = [row[position : position + column.width] for row in rows]
        records[column.name] = np.array(values).reshape(records[column.name].shape)
        position += column.width
    return records


def _columns(keyword: Keyword, parts: list) -> dict:
    if not parts:
        return empty_rows(keyword)
    if isinstance(parts[0], list):
        return _short_columns(keyword, parts[0])
    return {
        column.name: np.ascontiguousarray(np.concatenate([part[column.name] for part in parts]))
        for column in keyword.columns
    }


def _short_columns(keyword: Keyword, rows: list[list]) -> dict:
    """Columns of rows that leave out the optional fields; a left-out column of one field is NaN."""
    arrays, position = {}, 0
    for column in keyword.columns:
        width = column.required
        values = np.array([row[position : position + width] for row in rows], np.float64)
        arrays[column.name] = values if width else np.full(len(rows), np.nan)
        position += width
    return arrays


def _joined(numbers: list) -> range | np.ndarray:
    if len(numbers) == 1 and isinstance(numbers[0], range):
        return numbers[0]
    if all(isinstance(part, range) for part in numbers) and numbers:
        joined = range(numbers[0].start, numbers[-1].stop)
        if len(joined) == sum(map(len, numbers)):
            return joined
    return (
        np.concatenate([np.asarray(part, np.int64) for part in numbers]) if numbers else np.empty(0, np.int64)
    )
