"""The INP text format: keyword table, Deck, reader, checks and writer. No solver in it: imports are light."""

from .deck import Block, Deck
from .errors import InpErrors, Where
from .keywords import KEYWORDS
from .values import expand_ids
from .writer import dumps, write

__all__ = [
    "KEYWORDS",
    "Block",
    "Deck",
    "InpErrors",
    "Where",
    "dumps",
    "expand_ids",
    "write",
]
