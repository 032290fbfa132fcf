"""Things that are defined more than once: equal ones are one, differing ones are a problem."""

from __future__ import annotations

from .deck import Block, Deck
from .errors import Gaps, Problems
from .keywords import KEYWORDS
from .values import text_of


def drop_repeated(deck: Deck, problems: Problems, gaps: Gaps) -> Deck:
    """The deck with each thing once; a differing second definition is a problem.

    Keywords that had problems of their own are not compared.
    """
    first: dict[tuple, Block] = {}
    kept = []
    for block in deck.blocks():
        key = _key(block)
        other = block if key is None else first.setdefault(key, block)
        if other is block:
            kept.append(block)
        elif block.keyword not in gaps.content and not _same(block, other):
            found = f"a second {_title(block)} that differs from {other.where}"
            problems.add(block.where, found, "one definition, or an equal one")
    return Deck(kept)


def _key(block: Block) -> tuple | None:
    """What makes the block one thing with another, None if nothing does."""
    keyword = KEYWORDS[block.keyword]
    if keyword.key is None:
        return None
    values = [block.get(name, None) for name in keyword.key]
    if keyword.key and keyword.parameter(keyword.key[0]).required and None in values:
        return None
    if keyword.key == ("NAME",) and values == [None]:
        return None
    return (block.keyword, *(sorted(values) if keyword.symmetric else values))


def _same(first: Block, second: Block) -> bool:
    keyword = KEYWORDS[first.keyword]

    def plain(block: Block) -> Block:
        swapped = keyword.key if keyword.symmetric else ()
        values = {
            known.name: block.get(known.name) for known in keyword.parameters if known.name not in swapped
        }
        return Block(block.keyword, values, block.rows, block.where)

    return plain(first) == plain(second)


def _title(block: Block) -> str:
    keyword = KEYWORDS[block.keyword]
    words = [
        f"{name}={text_of(keyword.parameter(name), block[name])}"
        for name in keyword.key or ()
        if name in block
    ]
    return ", ".join([f"*{block.keyword}", *words])
