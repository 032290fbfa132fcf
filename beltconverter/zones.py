"""Parts of a belt with other properties (cords, splices, covers), chosen by columns and rows."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from beltsim.console import UsageProblem

from .properties import Sheet

Spans = tuple[tuple[int, int], ...]


class Zone(NamedTuple):
    """A named selection and the properties that differ in it.

    columns, rows : spans (first, last), counted from 1; negative numbers count from the end; empty means all.
    """

    name: str
    columns: Spans
    rows: Spans
    changes: dict[str, float]


def zones_of(
    shape: tuple[int, int], sheet: Sheet, zones: tuple[Zone, ...]
) -> tuple[np.ndarray, list[Sheet], list[str]]:
    """Zone index (R, C) of each particle, the sheets and the names; index 0 is the belt itself, later zones win."""
    index = np.zeros(shape, np.int64)
    sheets, names = [sheet], [""]
    for zone in zones:
        rows = _chosen(zone.rows, shape[0], f"rows of zone {zone.name}")
        columns = _chosen(zone.columns, shape[1], f"columns of zone {zone.name}")
        index[np.ix_(rows, columns)] = len(sheets)
        sheets.append(replace(sheet, **zone.changes))
        names.append(zone.name)
    return index, sheets, names


def _chosen(spans: Spans, count: int, what: str) -> np.ndarray:
    chosen = np.full(count, not spans)
    for first, last in spans:
        begin, end = (number + count if number < 0 else number - 1 for number in (first, last))
        if not 0 <= begin <= end < count:
            raise UsageProblem(f"{what}: {first}-{last} is not within 1-{count}")
        chosen[begin : end + 1] = True
    return chosen
