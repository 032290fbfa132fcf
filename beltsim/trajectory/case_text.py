"""The case's INP text as a trajectory keeps it: whole up to 10 MB, beyond that without long data blocks."""

from __future__ import annotations

LIMIT = 10_000_000
"""Bytes kept whole."""
LONG_BLOCK = 100
"""Data lines of one block; longer ones are left out of a text beyond the limit."""


def shortened(text: bytes, limit: int = LIMIT) -> bytes:
    """The text itself, or if it is longer than `limit` bytes, each long data block as one comment line."""
    if len(text) <= limit:
        return text
    out: list[bytes] = []
    block: list[bytes] = []
    for line in [*text.splitlines(), b"*"]:
        if line.startswith(b"*"):
            left_out = f"** {len(block)} data lines left out here".encode()
            out += block if len(block) <= LONG_BLOCK else [left_out]
            block = []
            out.append(line)
        else:
            block.append(line)
    return b"\n".join(out[:-1]) + b"\n"
