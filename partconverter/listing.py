"""What a person or a program wants to see of a conversion: table, summary lines, JSON."""

from __future__ import annotations

from collections import Counter

from .convert import Conversion, count_of, left_out_lines
from .finding import Found
from .parts import is_part
from .rollers import Roller, quaternion_of


def table(conversion: Conversion, output: str, first_id: int) -> str:
    """One row a roller: name, class, sizes and place in mm, count of identical ones, what it is written as."""
    ids = _ids(conversion.rollers, output, first_id)
    driven = any(roller.speed is not None for roller in conversion.rollers)
    head = ["name", "class", "diameter", "length", "x", "y", "z", "identical", "written as"]
    rows = [head + ["rad/s"] * driven]
    for roller, number in zip(conversion.rollers, ids):
        numbers = [roller.diameter, roller.length, *roller.centre]
        words = [f"{1000 * value + 0.0:.2f}" for value in numbers]
        as_what = "part" if number is None else f"particle {number}"
        speed = ["" if roller.speed is None else f"{roller.speed:.4g}"] * driven
        rows.append([roller.name, roller.kind, *words, f"{roller.identical}", as_what, *speed])
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    left = {0, 1, 8}
    lines = ["  ".join(_pad(row, widths, left)).rstrip() for row in rows]
    return "\n".join(["lengths and positions in mm", *lines])


def _pad(row, widths, left):
    return [w.ljust(n) if i in left else w.rjust(n) for i, (w, n) in enumerate(zip(row, widths))]


def _ids(rollers: list[Roller], output: str, first_id: int) -> list[int | None]:
    number, ids = first_id, []
    for roller in rollers:
        if is_part(roller, output):
            ids.append(None)
        else:
            ids.append(number)
            number += 1
    return ids


def summary_lines(conversion: Conversion, name: str) -> list[str]:
    """What was found and what was left out."""
    found = conversion.found
    counts = counts_of(conversion)
    lines = [
        f"{name}: {count_of(counts['cylinders'], 'cylinder')} of {counts['geometries']} sizes in "
        f"{count_of(found.solids, 'solid')}: {count_of(counts['pulleys'], 'pulley')}, "
        f"{count_of(counts['idlers'], 'idler')}"
    ]
    rules = Counter((roller.kind, roller.rule) for roller in conversion.rollers)
    lines += [f"  {count} {kind}: {rule}" for (kind, rule), count in rules.most_common()]
    if conversion.filtered:
        lines.append(f"  {conversion.filtered} more were merged or filtered out")
    return lines + [f"  left out: {line}" for line in left_out_lines(found)]


def counts_of(conversion: Conversion) -> dict[str, int]:
    """The figures of a conversion."""
    kinds = Counter(roller.kind for roller in conversion.rollers)
    return {
        "solids": conversion.found.solids,
        "cylinders": len(conversion.rollers),
        "pulleys": kinds["PULLEY"],
        "idlers": kinds["IDLER"],
        "geometries": len({roller.geometry for roller in conversion.rollers}),
        "left_out": len(conversion.found.left_out),
        "filtered": conversion.filtered,
    }


def json_body(conversion: Conversion, output: str, first_id: int) -> dict:
    """Cylinders and left-out solids as plain data, SI."""
    ids = _ids(conversion.rollers, output, first_id)
    cylinders = [_cylinder(roller, number) for roller, number in zip(conversion.rollers, ids)]
    return {
        "unit_mm": conversion.found.unit_mm,
        "cylinders": cylinders,
        "left_out": _left_out(conversion.found),
    }


def json_of_nothing(found: Found) -> dict:
    """The same for a file without a roller that could be written."""
    counts = {
        "solids": found.solids,
        "cylinders": 0,
        "left_out": len(found.left_out),
        "filtered": len(found.rollers),
    }
    more = {"unit_mm": found.unit_mm, "cylinders": [], "left_out": _left_out(found)}
    return {"counts": counts, "warnings": found.warnings, **more}


def _left_out(found: Found) -> list[dict]:
    keys = ("line", "cad_name", "reason", "detail")
    return [dict(zip(keys, entry)) for entry in found.left_out]


def _cylinder(roller: Roller, number: int | None) -> dict:
    return {
        "name": roller.name,
        "cad_name": roller.cad_name,
        "class": roller.kind,
        "rule": roller.rule,
        "particle": number,
        "diameter": roller.diameter,
        "length": roller.length,
        "overall_length": round(roller.overall.length, 12),
        "bore": roller.bore,
        "edge_radius": roller.edge_radius,
        "position": roller.centre,
        "axis": roller.axis,
        "orientation": quaternion_of(roller.axis),
        "geometry": roller.geometry + 1,
        "identical": roller.identical,
        "angular_velocity": roller.speed,
        "notes": roller.notes,
        "line": roller.line,
    }
