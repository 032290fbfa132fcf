"""The reference page of the INP format, made from the keyword table.

python -m beltsim.inp.reference_page > docs/inp-reference.md
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

from .errors import listed
from .keywords import KEYWORDS
from .schema import Column, Keyword, Parameter
from .units import UNITS, si_unit
from .values import text_of

_HEAD = """\
# INP keywords, format version 1

Made from the keyword table by `python -m beltsim.inp.reference_page > docs/inp-reference.md`.

## Grammar
- UTF-8 text. Lines that begin with `**` are comments, blank lines are ignored.
- A keyword line has `*` in column 1: `*KEYWORD, PARAMETER=VALUE, PARAMETER=VALUE`. Keywords, parameter names and
  fixed choices are case-insensitive; names of things are case-sensitive.
- A keyword line that ends in a comma goes on in the next line.
- Values with commas or outer blanks stand in double quotes, a double quote in them is doubled. Lists are separated
  by blanks or by commas in quotes.
- Data lines follow their keyword: fields separated by commas, a trailing comma allowed.
- Order is free; only `*STEP`s run in file order. An equal redefinition of a thing is allowed, a differing one is an
  error, so files can be joined.
- Paths are relative to the file that names them (text from stdin: to the working directory).
- Numbers are SI. A scalar parameter may carry a unit (`RADIUS=66.5 mm`), data lines never do.
- Quaternions rotate the local frame to the world and are of unit length: within 1e-6 they are made so, else they
  are an error.
- `*` and `?` in a pattern stand for any characters and for one.
"""


def page() -> str:
    """The whole page, Markdown."""
    parts = [_HEAD, _units(), *("\n".join(_keyword(keyword)) + "\n" for keyword in KEYWORDS.values())]
    return "\n".join(parts)


def _units() -> str:
    rows = [f"| {name} | {', '.join(units)} |" for name, units in UNITS.items()]
    return "\n".join(["## Units", "| of a | units, SI first |", "|---|---|", *rows]) + "\n"


def _keyword(keyword: Keyword) -> Iterator[str]:
    yield f"## *{keyword.name}"
    yield keyword.doc
    if keyword.parameters:
        yield ""
        yield "| parameter | value | default | |"
        yield "|---|---|---|---|"
        yield from (_parameter(parameter) for parameter in keyword.parameters)
    if rules := list(_rules(keyword)):
        yield ""
        yield from rules
    if rows := _rows(keyword):
        yield ""
        yield rows


def _parameter(parameter: Parameter) -> str:
    doc = parameter.doc.replace("|", r"\|")
    return f"| {parameter.name} | {_value_words(parameter)} | {_default(parameter)} | {doc} |"


def _default(parameter: Parameter) -> str:
    if parameter.required:
        return "required"
    return "" if parameter.default is None else text_of(parameter, parameter.default)


def _value_words(parameter: Parameter) -> str:
    unit = si_unit(parameter.dimension)
    bounds = f", {parameter.range.words}" if parameter.range and parameter.range.words else ""
    known = f"`*{parameter.refers}`" if parameter.refers else ""
    words = {
        "name": f"name of a {known}{' or pattern' if parameter.wildcards else ''}" if known else "name",
        "text": "text",
        "number": f"number{f' [{unit}]' if unit else ''}{bounds}",
        "step": f"AUTO or number [{unit}]{bounds}",
        "whole": f"whole number{bounds}",
        "choice": listed(parameter.choices),
        "choices": f"list of {listed(parameter.choices)}",
        "flag": "YES or NO",
        "colour": "#rrggbb",
        "vector": "three numbers",
        "ids": "ids and ranges",
    }[parameter.kind]
    return words + (f", or {listed([f'`{word}`' for word in parameter.words])}" if parameter.words else "")


def _rules(keyword: Keyword) -> Iterator[str]:
    for value, variant in keyword.variants:
        needs = f" needs {listed(variant.required, 'and')}" if variant.required else ""
        takes = f"{' and' if needs else ''} takes {listed(variant.allowed, 'and')}" if variant.allowed else ""
        rows = f"{';' if needs or takes else ''} data lines: {_count(variant.rows)}" if variant.rows else ""
        yield f"- {keyword.decides}={value}{needs}{takes}{rows}"
    if keyword.one_of:
        groups = [" and ".join(group) for group in keyword.one_of]
        yield f"- Exactly one of: {listed(groups)}"
    for group in keyword.together:
        yield f"- All or none of: {listed(group, 'and')}"
    if keyword.key == ():
        yield "- One in a deck."
    elif keyword.key:
        either = ", in either order" if keyword.symmetric else ""
        yield f"- One for each {listed(keyword.key, 'and')}{either}."


def _count(rows: tuple[int, int | None]) -> str:
    least, most = rows
    if least == most:
        return str(least) if least else "none"
    return f"{least} or more" if most is None else f"{least} to {most}"


def _rows(keyword: Keyword) -> str:
    if keyword.layout == "text":
        return "Data lines: any text."
    if keyword.layout == "source":
        lines = [f"{i}: {_fields(column)}" for i, column in enumerate(keyword.columns, start=1)]
        return f"Data lines: {'; '.join(lines)}; further ones: `particle type, mass fraction`."
    if not keyword.columns:
        return ""
    columns = ", ".join(_fields(column) for column in keyword.columns)
    return f"Data lines ({_count(keyword.count)}): {columns}."


def _fields(column: Column) -> str:
    given, optional = column.fields[: column.required], column.fields[column.required :]
    fields = ", ".join(given) + (f"[, {', '.join(optional)}]" if given and optional else ", ".join(optional))
    unit = f" [{column.unit}]" if column.unit else ""
    bounds = f" {column.range.words}" if column.range else ""
    return f"`{fields}`{unit}{bounds}{' (may be left out)' if not given else ''}"


if __name__ == "__main__":
    sys.stdout.write(page())
