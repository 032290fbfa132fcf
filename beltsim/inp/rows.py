"""The arrays of a block: Python objects to checked arrays, and quaternions to unit length."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .schema import Column, Keyword

# Rounding of four components and of the sum itself leaves a unit quaternion within 2 eps of length 1. Such ones
# are kept as they are, so that files give back every bit; 8 eps leaves room for those made by products.
_ROUNDING = 8 * np.finfo(float).eps
QUATERNION_TOLERANCE = 1e-6


def unit_quaternions(quaternions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Quaternions (n, 4) made unit where they are within 1e-6 of it, and the indices of those that are not."""
    length = np.sqrt(np.einsum("ij,ij->i", quaternions, quaternions))
    deviation = np.abs(length - 1.0)
    off = deviation > _ROUNDING
    if off.any():
        near = off & (deviation <= QUATERNION_TOLERANCE)
        quaternions = quaternions.copy()
        quaternions[near] /= length[near, None]
    return quaternions, np.flatnonzero(~(deviation <= QUATERNION_TOLERANCE))


def as_rows(keyword: Keyword, rows: Mapping[str, Any] | None) -> dict[str, Any]:
    """The checked arrays of a block made in Python; ValueError names what is off."""
    rows = dict(rows or {})
    if unknown := sorted(set(rows) - set(keyword.column_names)):
        raise ValueError(
            f"*{keyword.name} has no column {unknown[0]}; it has {', '.join(keyword.column_names) or 'none'}"
        )
    if keyword.layout == "text":
        return {"text": _text_lines(keyword, rows.get("text", ()))}
    if not rows:
        return empty_rows(keyword)
    arrays = {column.name: _as_array(keyword, column, rows) for column in keyword.columns}
    if len({len(array) for array in arrays.values()}) > 1:
        lengths = ", ".join(f"{name} {len(array)}" for name, array in arrays.items())
        raise ValueError(f"the columns of *{keyword.name} differ in length: {lengths}")
    if keyword.layout == "source":
        arrays["fractions"] = [(str(name), float(share)) for name, share in rows.get("fractions", ())]
    return arrays


def empty_rows(keyword: Keyword) -> dict[str, Any]:
    """The columns of a block without rows."""
    if keyword.layout == "text":
        return {"text": []}
    arrays: dict[str, Any] = {column.name: empty_array(column) for column in keyword.columns}
    return arrays | ({"fractions": []} if keyword.layout == "source" else {})


def empty_array(column: Column) -> np.ndarray:
    """A column's array of no rows."""
    shape = (0,) if column.width == 1 else (0, column.required or column.width)
    return np.empty(shape, np.int64 if column.is_whole else np.float64)


def _text_lines(keyword: Keyword, lines) -> list[str]:
    if isinstance(lines, str):
        lines = lines.splitlines()
    lines = [str(line).strip() for line in lines]
    for line in lines:
        if not line or line.startswith("*") or not line.isprintable():
            raise ValueError(
                f"a line of *{keyword.name} is not empty, printable and does not begin with *: {line!r}"
            )
    return lines


def _as_array(keyword: Keyword, column: Column, rows: Mapping[str, Any]) -> np.ndarray:
    if column.name not in rows:
        if column.required:
            raise ValueError(f"*{keyword.name} needs the column {column.name}")
        length = len(np.atleast_2d(rows[keyword.columns[0].name]))
        return np.full(length, np.nan)
    array = np.asarray(rows[column.name])
    if column.is_whole and array.size and not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"{column.name} of *{keyword.name} holds whole numbers, not {array.dtype}")
    array = np.ascontiguousarray(array, np.int64 if column.is_whole else np.float64)
    if column.width > 1 and array.ndim == 1 and keyword.count[1] == 1:
        array = array[None, :]
    array = array.reshape(-1) if column.width == 1 and array.ndim == 0 else array
    widths = {column.width, column.required or column.width}
    if array.ndim != (1 if column.width == 1 else 2) or (array.ndim == 2 and array.shape[1] not in widths):
        raise ValueError(f"{column.name} of *{keyword.name} has shape {array.shape}, not (n, {column.width})")
    if column.required and not np.isfinite(array).all():
        raise ValueError(f"{column.name} of *{keyword.name} holds NaN or infinity")
    return _unit(keyword, column, array) if column.kind == "quaternion" else array


def _unit(keyword: Keyword, column: Column, array: np.ndarray) -> np.ndarray:
    array, bad = unit_quaternions(array)
    if len(bad):
        raise ValueError(
            f"{column.name} of *{keyword.name}: row {bad[0]} is no unit quaternion: {array[bad[0]]}"
        )
    return array


def as_matrix(array: np.ndarray) -> np.ndarray:
    """The column as (n, fields), whatever its width."""
    return array if array.ndim == 2 else array[:, None]
