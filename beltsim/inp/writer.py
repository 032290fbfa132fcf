"""Deck to INP text: deterministic bytes, every number as the shortest text that reads back to the same float64."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import BinaryIO

import numpy as np
import orjson

from .deck import Block, Deck
from .keywords import KEYWORDS
from .rows import as_matrix
from .values import number_text, text_of

# Texts of so many rows are made at a time: 0.1 s of work, 10 MB of memory.
_CHUNK = 1 << 16


def write(deck: Deck, stream: BinaryIO) -> None:
    """Write the INP text of `deck` to a binary stream, UTF-8 with plain line feeds."""
    for block in deck.blocks():
        stream.write(_keyword_line(block).encode())
        for piece in _row_pieces(block):
            stream.write(piece)


def dumps(deck: Deck) -> bytes:
    """The INP text of `deck`, UTF-8."""
    stream = io.BytesIO()
    write(deck, stream)
    return stream.getvalue()


def _keyword_line(block: Block) -> str:
    words = [f"*{block.keyword}"]
    for parameter in KEYWORDS[block.keyword].parameters:
        if parameter.name in block.parameters:
            words.append(f"{parameter.name}={_quoted(text_of(parameter, block.parameters[parameter.name]))}")
    return ", ".join(words) + "\n"


def _quoted(text: str) -> str:
    if text and text == text.strip() and not any(sign in text for sign in ',"'):
        return text
    return '"' + text.replace('"', '""') + '"'


def _row_pieces(block: Block) -> Iterator[bytes]:
    layout = KEYWORDS[block.keyword].layout
    if layout == "text":
        yield "".join(f"{line}\n" for line in block.rows["text"]).encode()
    elif layout == "source":
        yield _source_rows(block).encode()
    elif len(block):
        yield from _number_rows(list(block.rows.values()))


def _source_rows(block: Block) -> str:
    rows = [", ".join(map(number_text, block.rows[name].ravel())) for name in ("box", "velocity")]
    rows += [f"{_quoted(name)}, {number_text(share)}" for name, share in block.rows["fractions"]]
    return "".join(f"{row}\n" for row in rows if row)


def _number_rows(columns: list[np.ndarray]) -> Iterator[bytes]:
    """Pieces of text; a last column of NaN (a field left out) is not written."""
    columns = [as_matrix(column) for column in columns]
    if np.isnan(columns[-1]).all():
        columns = columns[:-1]
    whole = [column for column in columns if column.dtype == np.int64]
    floats = [column for column in columns if column.dtype != np.int64]
    for start in range(0, len(columns[0]), _CHUNK):
        rows = slice(start, start + _CHUNK)
        yield _lines([np.hstack([column[rows] for column in group]) for group in (whole, floats) if group])


def _lines(groups: list[np.ndarray]) -> bytes:
    """Lines of the groups side by side; whole numbers stand first in every row of the format."""
    texts = [orjson.dumps(np.ascontiguousarray(group), option=orjson.OPT_SERIALIZE_NUMPY) for group in groups]
    if len(texts) == 1:
        text = texts[0][2:-2].replace(b"],[", b"\n")
    else:
        first, second = (text[2:-2].split(b"],[") for text in texts)
        text = b"\n".join([b"%b,%b" % pair for pair in zip(first, second)])
    text = (text + b"\n").replace(b".0\n", b"\n").replace(b".0,", b",").replace(b"e+", b"e")
    return text.replace(b",", b", ")
