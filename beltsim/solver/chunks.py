"""Chunks of particles: what passes work on at a time, and what threads share out.

A chunk's state fits into the second-level cache. Chunks depend on the number of particles alone, never on the number of
threads: the same loops run over the same stretches whoever runs them, and every sum has one order.
"""

from __future__ import annotations

import numpy as np

from beltsim.solver.jit import inner

CHUNK = 1024
"""Particles in a chunk: 250 kB of state; a multiple of the bonds that are worked on at a time."""


@inner
def chunks_in(particles):
    """Number of chunks of so many particles."""
    return (particles + CHUNK - 1) // CHUNK


@inner
def chunk_of(c, particles):
    """First particle, unsigned as vectorised loops want it, and number of particles of chunk c."""
    return np.uint64(c * CHUNK), min(CHUNK, particles - c * CHUNK)
