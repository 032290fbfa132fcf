"""The Deck: plain data between INP text and everything else."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .errors import Mismatch, Where, nearest
from .keywords import KEYWORDS
from .rows import as_rows
from .schema import Keyword, inp_name
from .values import coerce

_ABSENT = object()


class Block:
    """One keyword with its parameters and rows.

    keyword : canonical name, as "PARTICLE TYPE"
    parameters : dict from canonical name to value (SI floats, ints, str, bool, tuples), only those given
    rows : dict from column name to array, n rows first; int64 for ids, else float64
    where : file and line of the keyword
    folder : what relative paths in it are relative to
    lines : line number of each row (a range, or an int array when comments or blank lines lie between)
    """

    __slots__ = ("folder", "keyword", "lines", "parameters", "rows", "where")

    def __init__(self, keyword: str, parameters: dict, rows: dict, where: Where, folder=Path(), lines=None):
        self.keyword = keyword
        self.parameters = parameters
        self.rows = rows
        self.where = where
        self.folder = folder
        self.lines = lines

    def __getitem__(self, name: str) -> Any:
        """The value of a parameter; its default, if it has one, when it is not given."""
        value = self.get(name)
        if value is None:
            raise KeyError(f"{self.where}: *{self.keyword} without {name}")
        return value

    def __contains__(self, name: str) -> bool:
        """Whether the parameter is given in the text."""
        return name in self.parameters

    def get(self, name: str, default: Any = _ABSENT) -> Any:
        """The value of a parameter, else `default`, else the default of the format, else None."""
        if name in self.parameters:
            return self.parameters[name]
        known = KEYWORDS[self.keyword].parameter(name)
        if known is None:
            raise KeyError(f"*{self.keyword} has no parameter {name}")
        return known.default if default is _ABSENT else default

    def __len__(self) -> int:
        """Number of rows."""
        return next((len(column) for column in self.rows.values()), 0)

    def __bool__(self) -> bool:
        return True

    def row_where(self, i: int) -> Where:
        """File and line of row `i` (from 0)."""
        return self.where if self.lines is None else Where(self.where.file, int(self.lines[i]))

    def path(self, name: str = "INPUT") -> Path:
        """The file that a parameter names, found from where the text stands."""
        return self.folder / self[name]

    def __eq__(self, other: object) -> bool:
        """Equal in keyword, parameters and every bit of the rows; where they stand does not count."""
        if not isinstance(other, Block):
            return NotImplemented
        return (
            self.keyword == other.keyword
            and _same_parameters(self.parameters, other.parameters)
            and self.rows.keys() == other.rows.keys()
            and all(_same_column(column, other.rows[name]) for name, column in self.rows.items())
        )

    __hash__ = None

    def __repr__(self) -> str:
        return f"<*{self.keyword} {self.parameters} with {len(self)} rows at {self.where}>"


def _same_parameters(first: dict, second: dict) -> bool:
    # repr tells -0.0 from 0.0, which == does not.
    return first.keys() == second.keys() and all(repr(first[name]) == repr(second[name]) for name in first)


def _same_column(first, second) -> bool:
    if not isinstance(first, np.ndarray):
        return first == second
    return first.shape == second.shape and first.dtype == second.dtype and first.tobytes() == second.tobytes()


class Deck:
    """Blocks in file order; two decks are equal if all their blocks are."""

    __slots__ = ("_blocks",)

    def __init__(self, blocks: list[Block] | None = None):
        self._blocks = blocks if blocks is not None else []

    def add(self, keyword: str, /, *, rows: Mapping[str, Any] | None = None, **parameters: Any) -> Block:
        """Append a block made in Python; ValueError for anything that the keyword table does not know.

        Parameters have Python names (`size_x`), numbers are SI, text is read as in a file ("66.5 mm"), None means
        not given.
        """
        known = KEYWORDS.get(inp_name(keyword))
        if known is None:
            raise ValueError(f"no keyword *{keyword}{nearest(keyword, KEYWORDS)}")
        values = _as_parameters(known, parameters)
        block = Block(known.name, values, as_rows(known, rows), Where("deck", len(self._blocks) + 1))
        self._blocks.append(block)
        return block

    def blocks(self, keyword: str | None = None) -> list[Block]:
        """The blocks of one keyword, or all, in file order."""
        if keyword is None:
            return list(self._blocks)
        if keyword not in KEYWORDS:
            raise ValueError(f"no keyword *{keyword}{nearest(keyword, KEYWORDS)}")
        return [block for block in self._blocks if block.keyword == keyword]

    def __eq__(self, other: object) -> bool:
        return self._blocks == other._blocks if isinstance(other, Deck) else NotImplemented

    __hash__ = None

    def __len__(self) -> int:
        return len(self._blocks)

    def __repr__(self) -> str:
        return f"<Deck of {len(self._blocks)} blocks>"


def _as_parameters(keyword: Keyword, given: Mapping[str, Any]) -> dict[str, Any]:
    values = {}
    for name, value in given.items():
        parameter = keyword.parameter(inp_name(name))
        if parameter is None:
            known = [known.name for known in keyword.parameters]
            raise ValueError(
                f"*{keyword.name} has no parameter {inp_name(name)}{nearest(inp_name(name), known)}"
            )
        if value is None:
            continue
        try:
            values[parameter.name] = coerce(parameter, value)
        except (Mismatch, TypeError) as error:
            raise ValueError(f"{parameter.name} of *{keyword.name}: {error}") from None
    for parameter in keyword.parameters:
        if parameter.required and parameter.name not in values:
            raise ValueError(f"*{keyword.name} needs {parameter.name}")
    return values
