"""The INP text format: keyword table, Deck, reader, checks and writer. No solver in it: imports are light."""

from .bonds import bond_type_of
from .deck import Block, Deck
from .errors import InpErrors, Where
from .keywords import KEYWORDS
from .lookup import by_name, matching, named
from .reader import check_case, read, read_case, read_text
from .touching import contact_groups, contact_property
from .values import expand_ids
from .writer import dumps, write

__all__ = [
    "KEYWORDS",
    "Block",
    "Deck",
    "InpErrors",
    "Where",
    "bond_type_of",
    "by_name",
    "check_case",
    "contact_groups",
    "contact_property",
    "dumps",
    "expand_ids",
    "matching",
    "named",
    "read",
    "read_case",
    "read_text",
    "write",
]
