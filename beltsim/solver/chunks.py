"""Chunks of particles: what passes work on at a time, and what threads share out.

A chunk's state fits into the second-level cache. Chunks depend on the number of particles alone, never on the number of
threads: the same loops run over the same stretches whoever runs them, and every sum has one order.
"""

from __future__ import annotations

import numpy as np

from beltsim.solver.jit import inner
from beltsim.solver.state import Array, ChunkNotes, Particles

CHUNK = 512
"""Particles in a chunk: 125 kB of state; a multiple of the bonds that are worked on at a time. With 1024 two threads
shared out 9,000 particles as 4 to 5."""


@inner
def chunks_in(particles):
    """Number of chunks of so many particles."""
    return (particles + CHUNK - 1) // CHUNK


@inner
def chunk_of(c, particles):
    """First particle, unsigned as vectorised loops want it, and number of particles of chunk c."""
    return np.uint64(c * CHUNK), min(CHUNK, particles - c * CHUNK)


def notes_of(listed: Array, alike: Array) -> ChunkNotes:
    """Notes of the chunks when lists have been made at positions listed (3, n); `alike` = `alike_chunks`."""
    return ChunkNotes(listed, np.zeros(alike.size, np.int64), alike)


def alike_chunks(particles: Particles) -> Array:
    """The first chunk (c,) int64 whose bodies are those of each chunk; anew when particles come, go or are held."""
    bodies = np.concatenate([particles.mass[None], particles.inertia, particles.mobility])
    chunks, first = -(-particles.mass.size // CHUNK), {}
    alike = [first.setdefault(bodies[:, c * CHUNK : (c + 1) * CHUNK].tobytes(), c) for c in range(chunks)]
    return np.array(alike, np.int64)
