"""Chunks of particles for threads: they own every particle once, and pairs cross only where two chunks meet."""

from itertools import pairwise

import numpy as np
import pytest

from beltsim.solver.crossings import LEAST, PIECE, crossings_of


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def chain(rng, count, reach, low=0):
    """Pairs (p, 2) of particles low.. with partners up to `reach` slots further on."""
    first = np.repeat(np.arange(count), 3)
    second = first + rng.integers(1, reach + 1, first.size)
    return low + np.stack([first, second], axis=1)[second < count]


def listed(pairs, count):
    """Rows and second particles of a list of pairs."""
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    start = np.concatenate([[0], np.cumsum(np.bincount(pairs[:, 0], minlength=count))])
    return start, pairs[:, 1].astype(np.int32), pairs[:, 0]


def scene(name, rng):
    """Pairs, particles, and how many of them stay: bulk alone, a belt alone, a belt under bulk, bulk out of order."""
    if name == "bulk":
        return chain(rng, 9000, 30), 9000, 0
    if name == "belt":
        return chain(rng, 6000, 30), 6000, 6000
    under = np.arange(4000)
    above = 4000 + 2 * under + rng.integers(0, 3, 4000)
    if name == "shuffled":
        rng.shuffle(above)
    contact = np.stack([under, above], axis=1)[above < 12000]
    return np.concatenate([contact, chain(rng, 8000, 30, 4000)]), 12000, 4000


@pytest.mark.parametrize("name", ["bulk", "belt", "belt under bulk", "shuffled"])
def test_every_particle_has_one_owner_and_crossing_pairs_are_those_of_two_owners(name, rng):
    pairs, count, permanent = scene(name, rng)
    start, second, first = listed(pairs, count)
    found = crossings_of(start, second, permanent)
    owner = np.full(count, -1)
    for kind in found.start:
        for chunk, (low, high) in enumerate(pairwise(kind)):
            assert np.all(owner[low:high] == -1)
            owner[low:high] = chunk
    assert np.all(owner >= 0)
    # Each chunk has a place for the load of each of its pairs with a particle of another one.
    crosses = owner[first] != owner[second]
    chunks = found.count.size
    assert np.array_equal(np.diff(found.place), np.bincount(owner[first[crosses]], minlength=chunks))
    assert found.loads.shape == (crosses.sum(), 6)


@pytest.mark.parametrize("name", ["bulk", "belt", "belt under bulk", "shuffled"])
def test_every_pair_is_in_one_piece_of_the_chunk_that_owns_its_first_particle(name, rng):
    pairs, count, permanent = scene(name, rng)
    start, second, first = listed(pairs, count)
    found = crossings_of(start, second, permanent)
    owner, seen = np.full(count, -1), np.zeros(second.size, int)
    for kind in found.start:
        for chunk, (low, high) in enumerate(pairwise(kind)):
            owner[low:high] = chunk
    for chunk, (low, high) in enumerate(pairwise(found.piece)):
        for piece in range(low, high):
            own = slice(*found.pair[:, piece])
            seen[own] += 1
            assert 0 < own.stop - own.start <= PIECE
            assert found.owner[piece] == chunk
            assert np.all(owner[first[own]] == chunk)
            # Its particles have all drifted when those below `stop` have: partners stand after the owners.
            assert max(first[own].max(), second[own].max()) == found.stop[piece] - 1
    assert np.all(seen == 1)


@pytest.mark.parametrize("name", ["bulk", "belt", "belt under bulk"])
def test_few_pairs_cross_where_particles_are_in_the_order_of_places(name, rng):
    """A stretch of 16 mean reaches, 248 slots, or the least of 512: a pair crosses with 15.5 / 512 or 3 %."""
    pairs, count, permanent = scene(name, rng)
    start, second, _ = listed(pairs, count)
    found = crossings_of(start, second, permanent)
    chunks = found.start.shape[1] - 1
    assert chunks >= 0.5 * (8000 if permanent == 4000 else count) / LEAST
    assert chunks % 2 == 0
    assert found.place[-1] < 0.06 * second.size


def test_a_few_particles_are_one_chunk(rng):
    start, second, _ = listed(chain(rng, 100, 10), 100)
    found = crossings_of(start, second, 0)
    assert found.start.tolist() == [[0, 0], [0, 100]]
    assert found.place.tolist() == [0, 0]
