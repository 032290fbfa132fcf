"""Parameter values: text to value, value to text, and Python objects to values, for each kind of the table."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import orjson

from .errors import Mismatch, listed, nearest
from .schema import Parameter
from .units import UNITS, si_unit, to_si

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_WHOLE = re.compile(r"[+-]?\d{1,19}", re.ASCII)
_NOT_FINITE = re.compile(r"[+-]?(?:nan|inf|infinity)", re.IGNORECASE)
_IDS = re.compile(r"(\d{1,18})(?:\s*-\s*(\d{1,18}))?", re.ASCII)
_COLOUR = re.compile(r"#[0-9a-fA-F]{6}", re.ASCII)
_BREAKING = re.compile(r"[\x00-\x1f\x7f\x85\u2028\u2029\ufeff]")


def parse_number(text: str) -> float:
    """A finite float64 from decimal text; `Mismatch` for anything else."""
    if _NOT_FINITE.fullmatch(text):
        raise Mismatch(repr(text), "a finite number")
    if not _NUMBER.fullmatch(text):
        hint = (
            "; is the comma a decimal point?" if _NUMBER.match(text.replace(",", ".")) and "," in text else ""
        )
        raise Mismatch(repr(text) if text else "an empty field", f"a number{hint}")
    value = float(text)
    if math.isinf(value):
        raise Mismatch(repr(text), "a number up to 1.797e308")
    return value


def parse_whole(text: str) -> int:
    """A whole number that fits 64 bits; `Mismatch` for anything else."""
    if not _WHOLE.fullmatch(text) or not -(2**63) <= int(text) < 2**63:
        raise Mismatch(repr(text) if text else "an empty field", "a whole number")
    return int(text)


def _parse_quantity(parameter: Parameter, text: str) -> float:
    number = _NUMBER.match(text)
    unit = text[number.end() :].strip() if number else ""
    if not unit or unit.startswith(",") or _NOT_FINITE.fullmatch(text):
        return parse_number(text)
    if not parameter.dimension:
        raise Mismatch(repr(text), "a number without a unit")
    known = UNITS[parameter.dimension]
    if unit not in known:
        raise Mismatch(repr(text), f"a {parameter.dimension} in {listed(known)}{nearest(unit, known)}")
    parse_number(number[0])
    value = to_si(number[0], known[unit])
    if math.isinf(value):
        raise Mismatch(repr(text), "a number up to 1.797e308")
    return value


def _parse_step(parameter: Parameter, text: str) -> str | float:
    if text.upper() == "AUTO":
        return "AUTO"
    try:
        return _parse_quantity(parameter, text)
    except Mismatch:
        raise Mismatch(repr(text), f"AUTO or a {parameter.dimension}{nearest(text, ('AUTO',))}") from None


def _parse_choice(parameter: Parameter, text: str) -> str:
    choice = " ".join(text.upper().split())
    if choice not in parameter.choices:
        raise Mismatch(repr(text), listed(parameter.choices) + nearest(choice, parameter.choices))
    return choice


def _parse_choices(parameter: Parameter, text: str) -> tuple[str, ...]:
    """Choices separated by commas or blanks; of several that fit, the one with the most words."""
    found: list[str] = []
    for part in text.upper().split(","):
        words = part.split()
        while words:
            ends = [n for n in range(len(words), 0, -1) if " ".join(words[:n]) in parameter.choices]
            if not ends:
                hint = nearest(" ".join(words), parameter.choices) or nearest(words[0], parameter.choices)
                raise Mismatch(repr(" ".join(words)), f"a list of {listed(parameter.choices, 'and')}{hint}")
            found.append(" ".join(words[: ends[0]]))
            words = words[ends[0] :]
    return tuple(dict.fromkeys(found))


def _parse_flag(text: str) -> bool:
    if text.upper() not in ("YES", "NO"):
        raise Mismatch(repr(text), "YES or NO")
    return text.upper() == "YES"


def _parse_colour(text: str) -> str:
    if not _COLOUR.fullmatch(text):
        raise Mismatch(repr(text), "a colour #rrggbb")
    return text.lower()


def _parse_vector(text: str) -> tuple[float, ...]:
    numbers = tuple(parse_number(field) for field in text.replace(",", " ").split())
    if len(numbers) != 3:
        raise Mismatch(repr(text), 'three numbers, as "0, 0, 1"')
    return numbers


def id_ranges(text: str) -> list[tuple[int, int]]:
    """First and last id of each range of a PARTICLES text such as "1-8, 12"; `Mismatch` if it is none."""
    ranges = []
    for field in re.sub(r"\s*-\s*", "-", text.replace(",", " ")).split():
        match = _IDS.fullmatch(field)
        if not match or int(match[2] or match[1]) < int(match[1]):
            raise Mismatch(repr(field), 'ids and ranges from low to high, as "1-8, 12"')
        ranges.append((int(match[1]), int(match[2] or match[1])))
    if not ranges:
        raise Mismatch(repr(text), 'ids and ranges, as "1-8, 12"')
    return ranges


def _parse_ids(text: str) -> str:
    return _ids_text(id_ranges(text))


def _ids_text(ids: Iterable) -> str:
    pairs = [(i, i) if isinstance(i, (int, np.integer)) else i for i in ids]
    return ", ".join(str(first) if first == last else f"{first}-{last}" for first, last in pairs)


def _parse_name(parameter: Parameter, text: str) -> str:
    if not text:
        raise Mismatch("an empty value", "a name")
    if parameter.name == "NAME" and ("*" in text or "?" in text):
        raise Mismatch(repr(text), "a name without the wildcards * and ?")
    return text


_BY_PARAMETER: dict[str, Callable[[Parameter, str], Any]] = {
    "name": _parse_name,
    "number": _parse_quantity,
    "step": _parse_step,
    "choice": _parse_choice,
    "choices": _parse_choices,
}
_BY_TEXT: dict[str, Callable[[str], Any]] = {
    "text": str,
    "whole": parse_whole,
    "flag": _parse_flag,
    "colour": _parse_colour,
    "vector": _parse_vector,
    "ids": _parse_ids,
}


def parse(parameter: Parameter, text: str) -> Any:
    """The value that a parameter's text stands for, in SI and within its range; else `Mismatch`."""
    if broken := _BREAKING.search(text):
        raise Mismatch(f"the control character {broken[0]!r}", "printable text")
    plain = _BY_TEXT.get(parameter.kind)
    value = plain(text) if plain else _BY_PARAMETER[parameter.kind](parameter, text)
    if parameter.range and not isinstance(value, str) and value not in parameter.range:
        unit = si_unit(parameter.dimension)
        raise Mismatch(repr(text), f"a number {parameter.range.words} {unit}".rstrip())
    return value


def coerce(parameter: Parameter, value: Any) -> Any:
    """The value that a Python object stands for; what its text would be read as, so that files give it back."""
    if isinstance(value, str):
        return parse(parameter, value)
    return parse(parameter, text_of(parameter, value))


def number_text(value: float) -> str:
    """The shortest text that reads back to the same float64; up to five signs without an exponent."""
    value = float(value)
    if not math.isfinite(value):
        return repr(value)
    plain = orjson.dumps(value).decode().removesuffix(".0").replace("e+", "e")
    scientific = np.format_float_scientific(value, trim="-", exp_digits=1).replace("e+", "e")
    return scientific if len(plain) > 5 and len(scientific) < len(plain) else plain


def text_of(parameter: Parameter, value: Any) -> str:
    """The text of a value, without the quotes that commas in it need; `parse` gives the value back."""
    if isinstance(value, (bool, np.bool_)):
        return "YES" if value else "NO"
    if isinstance(value, str):
        return value
    if parameter.kind == "whole" and isinstance(value, (int, np.integer)):
        return str(int(value))
    if parameter.kind in ("number", "step", "whole"):
        return number_text(value)
    if parameter.kind == "vector":
        return ", ".join(number_text(number) for number in value)
    if parameter.kind == "ids":
        return _ids_text(value)
    if parameter.kind == "choices":
        return ", ".join(value)
    return str(value)


def expand_ids(text: str) -> np.ndarray:
    """All ids of a PARTICLES text such as "1-8, 12", ascending and each once, (n,) int64."""
    return np.unique(
        np.concatenate([np.arange(first, last + 1, dtype=np.int64) for first, last in id_ranges(text)])
    )
