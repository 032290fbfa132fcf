"""Parts of a belt with other properties (cords, splices, covers), chosen by columns and rows."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from beltsim.console import UsageProblem

from .properties import DIMENSIONS, Sheet, changed
from .units import parsed

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
        sheets.append(changed(sheet, zone.changes))
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


def parse_zone(text: str) -> Zone:
    """Zone of a text such as `cord: columns=1-3,8 tensile-stiffness=8000N/mm`."""
    name, colon, rest = text.partition(":")
    if not colon:
        raise UsageProblem(f"--zone '{text}': expected 'name: columns=1-3 property=value ...'")
    pairs = dict(word.partition("=")[::2] for word in rest.split())
    return _zone(name, pairs, f"--zone '{text}'")


def read_zones(path: str) -> list[Zone]:
    """Zones of a CSV file: a header with name, columns, rows and properties, then one zone a line."""
    lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    table = list(csv.DictReader(io.StringIO("\n".join(lines)), skipinitialspace=True))
    if not table or "name" not in table[0]:
        raise UsageProblem(
            f"{path}:1: no column 'name', expected a header 'name, columns, rows, property, ...'"
        )
    zones = []
    for number, row in enumerate(table, start=2):
        if None in row or None in row.values():
            raise UsageProblem(
                f"{path}:{number}: {len(lines[number - 1].split(','))} fields, expected {len(table[0])}"
            )
        pairs = {key.strip(): value.strip() for key, value in row.items() if value.strip()}
        zones.append(_zone(pairs.pop("name", ""), pairs, f"{path}:{number}"))
    return zones


def _zone(name: str, pairs: dict[str, str], where: str) -> Zone:
    name = name.strip()
    if not re.fullmatch(r"[^\s*?,\"=]+", name):
        raise UsageProblem(f"{where}: '{name}' is no name for a zone")
    pairs = dict(pairs)
    spans = {key: _spans(pairs.pop(key, ""), key, where) for key in ("columns", "rows")}
    changes = {}
    for key, value in pairs.items():
        field = key.replace("-", "_").replace(" ", "_")
        if field not in DIMENSIONS:
            known = ", ".join(known.replace("_", "-") for known in DIMENSIONS)
            raise UsageProblem(f"{where}: '{key}', expected columns, rows or one of {known}")
        try:
            changes[field] = parsed(value, DIMENSIONS[field], zero=DIMENSIONS[field] == "ratio")
        except ValueError as error:
            raise UsageProblem(f"{where}: {error}") from None
    return Zone(name, spans["columns"], spans["rows"], changes)


def _spans(text: str, what: str, where: str) -> Spans:
    spans = []
    for word in re.split(r"[;,\s]+", text.strip()) if text.strip() else ():
        match = re.fullmatch(r"(-?[1-9]\d*)(?:-(-?[1-9]\d*))?", word)
        if not match:
            raise UsageProblem(f"{where}: {what} '{word}', expected numbers from 1 and spans such as 1-3")
        spans.append((int(match[1]), int(match[2] or match[1])))
    return tuple(spans)
