"""Finding things in a deck: by name, by pattern, by id."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np

from .deck import Block, Deck
from .errors import Where
from .keywords import KEYWORDS
from .rows import empty_array


def by_name(deck: Deck, keyword: str) -> dict[str, Block]:
    """The blocks of one keyword under their NAME; the first of equal ones."""
    found: dict[str, Block] = {}
    for block in deck.blocks(keyword):
        if "NAME" in block:
            found.setdefault(block["NAME"], block)
    return found


def named(deck: Deck, keyword: str, name: str) -> Block:
    """The block of that keyword and NAME; KeyError if there is none. For many names use `by_name`."""
    return by_name(deck, keyword)[name]


def is_pattern(text: str) -> bool:
    """Whether a name holds wildcards."""
    return "*" in text or "?" in text


def matches(name: str, pattern: str) -> bool:
    """Whether a name fits a pattern: `*` stands for any characters, `?` for one, all else for itself."""
    if not is_pattern(pattern):
        return name == pattern
    wild = re.escape(pattern).replace(r"\*", ".*").replace(r"\?", ".")
    return re.fullmatch(wild, name, re.DOTALL) is not None


def matching(names: Iterable[str], pattern: str) -> list[str]:
    """The names that fit a pattern, in their order."""
    return [name for name in names if matches(name, pattern)]


class AllRows:
    """The rows of all blocks of one keyword as if they were one block."""

    def __init__(self, deck: Deck, keyword: str):
        self.blocks = deck.blocks(keyword)
        self._keyword = KEYWORDS[keyword]
        self._ends = np.cumsum([len(block) for block in self.blocks], dtype=np.int64)

    def __len__(self) -> int:
        return int(self._ends[-1]) if len(self._ends) else 0

    def column(self, name: str) -> np.ndarray:
        """One column of all rows."""
        parts = [block.rows[name] for block in self.blocks if len(block)]
        if parts:
            return np.concatenate(parts)
        return empty_array(next(column for column in self._keyword.columns if column.name == name))

    def spread(self, values: Iterable) -> np.ndarray:
        """One value for each block, repeated for each of its rows."""
        return np.repeat(np.asarray(list(values)), [len(block) for block in self.blocks])

    def where(self, i: int) -> Where:
        """File and line of row `i`."""
        block = int(np.searchsorted(self._ends, i, side="right"))
        return self.blocks[block].row_where(i - (int(self._ends[block - 1]) if block else 0))


class Particles:
    """The ids and types of all particles, ready for look-ups.

    names : particle type names in file order;  types : index into `names` of each particle, in file order
    """

    def __init__(self, deck: Deck):
        self.rows = AllRows(deck, "PARTICLE")
        self.ids = self.rows.column("id")
        written = [block.get("TYPE", "") for block in self.rows.blocks]
        self.names = list(dict.fromkeys([*by_name(deck, "PARTICLE TYPE"), *written]))
        place = {name: i for i, name in enumerate(self.names)}
        self.types = self.rows.spread([place[name] for name in written]).astype(np.int64)
        self._order = np.argsort(self.ids, kind="stable")
        self._sorted = self.ids[self._order]

    def index(self, ids: np.ndarray) -> np.ndarray:
        """Row of the particle with each id, -1 where there is none."""
        if not len(self.ids):
            return np.full(np.shape(ids), -1, np.int64)
        place = np.minimum(np.searchsorted(self._sorted, ids), len(self._sorted) - 1)
        return np.where(self._sorted[place] == ids, self._order[place], -1)
