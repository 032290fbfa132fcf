"""Bonds in runs with gaps: every bond once, in whatever network, and gaps that nobody notices."""

import math

import numpy as np
import pytest
import scenes
from scipy.spatial.transform import Rotation

from beltsim.scene import build
from beltsim.scene.bodies import make_particles
from beltsim.scene.bond_runs import LONGEST_GAP, SHORTEST_RUN, in_runs
from beltsim.solver.bond_tiles import TILE
from beltsim.solver.bonds import bond_measures, bond_pass
from beltsim.solver.chunks import CHUNK
from beltsim.solver.state import BondKinds, Bonds, BondStrength


def grid(rows, columns):
    """First and second particles of the bonds of a grid, along and across."""
    number = np.arange(rows * columns).reshape(rows, columns)
    pairs = np.vstack(
        [
            np.stack([number[:-1].ravel(), number[1:].ravel()], 1),
            np.stack([number[:, :-1].ravel(), number[:, 1:].ravel()], 1),
        ]
    )
    return pairs[:, 0], pairs[:, 1]


def networks():
    """First and second particles and kinds of networks of some kinds, by name."""
    random = np.random.default_rng(3)
    first, second = grid(90, 40)
    along = np.arange(first.size) < 89 * 40
    torn = random.random(first.size) < 0.8
    a, b = random.integers(2500, size=(2, 4000))
    return {
        "grid": (first, second, along.astype(int)),
        "grid of one kind": (first, second, 0 * first),
        "torn grid": (first[torn], second[torn], along[torn].astype(int)),
        "grid backwards": (second, first, along.astype(int)),
        "loop": (np.arange(3000), (np.arange(3000) + 1) % 3000, np.zeros(3000, int)),
        "net": (a[a != b], b[a != b], random.integers(3, size=np.count_nonzero(a != b))),
        "one bond": (np.array([5]), np.array([2]), np.array([0])),
    }


NETWORKS = networks()


@pytest.fixture(params=NETWORKS)
def network(request):
    return NETWORKS[request.param]


def test_every_bond_stands_in_one_slot_of_its_own_particles_and_kind(network):
    first, second, kind = network
    order, runs = in_runs(*network)
    np.testing.assert_array_equal(np.sort(order), np.arange(first.size))
    np.testing.assert_array_equal(np.sort(runs.bond[runs.bond >= 0]), np.arange(first.size))
    for r in range(runs.base.size):
        slots = np.arange(runs.count[r])
        bond = runs.bond[runs.base[r] + slots]
        slots, bond = slots[bond >= 0], order[bond[bond >= 0]]
        assert np.all(kind[bond] == runs.kind[r])
        if runs.first[r] >= 0:
            np.testing.assert_array_equal(first[bond], runs.first[r] + slots)
            np.testing.assert_array_equal(second[bond], runs.second[r] + slots)


def test_pieces_fit_into_a_tile_and_chunks_load_themselves_and_the_next_only(network):
    first, second, _ = network
    order, runs = in_runs(*network)
    assert runs.count.max() <= TILE
    assert runs.bond.size == runs.count.sum()
    for c in range(runs.chunk.size - 1):
        for r in range(runs.chunk[c], runs.chunk[c + 1]):
            bond = runs.bond[runs.base[r] : runs.base[r] + runs.count[r]]
            bond = order[bond[bond >= 0]]
            ends = np.concatenate([first[bond], second[bond]]) // CHUNK
            assert set(ends) <= {c, c + 1}


def test_a_grid_is_two_runs_with_a_gap_at_the_end_of_each_row():
    _, runs = in_runs(*NETWORKS["grid"])
    # A run is cut where the particles of a tile end, and nowhere else.
    assert runs.base.size == -(-89 * 40 // TILE) - (-90 * 40 // TILE)
    assert np.count_nonzero(runs.bond < 0) == 89 - np.count_nonzero(np.arange(1, 90) * 40 % TILE == 0)


def test_gaps_are_bridged_if_that_costs_less_than_a_new_run():
    def pieces(*stretches):
        first = np.concatenate([np.arange(*stretch) for stretch in stretches])
        return in_runs(first, first + 1, 0 * first)[1].base.size

    assert pieces((0, 60), (60 + LONGEST_GAP, 120)) == 1
    assert pieces((0, 60), (61 + LONGEST_GAP, 120)) == 2
    # A ladder of single bonds with wide gaps is no run: it would be gaps for the greater part.
    ladder = np.arange(0, 200, 5)
    _, runs = in_runs(ladder, ladder + 1, 0 * ladder)
    assert runs.bond.size == ladder.size
    assert runs.first[0] == -1
    short = np.arange(SHORTEST_RUN - 1)
    assert in_runs(short, short + 1, 0 * short)[1].first[0] == -1


def belt(network, breakable=False):
    """Particles in a random state, bonds with damping, kinds, strength or None, and runs."""
    first, second, kind = network
    random = np.random.default_rng(8)
    n = int(max(first.max(), second.max())) + 1
    orientation = random.normal(size=(n, 4)) + np.array([8.0, 0.0, 0.0, 0.0])
    orientation /= np.linalg.norm(orientation, axis=1)[:, None]
    particles = make_particles(random.normal(size=(n, 3)), orientation, np.ones(n), np.ones((n, 3)))
    particles.velocity[:], particles.angular_velocity[:] = random.normal(size=(2, 3, n))
    count = int(kind.max()) + 1
    upright = np.tile([[1.0], [0.0], [0.0], [0.0]], count)
    kinds = BondKinds(np.ones(count), upright, upright, *(0.5 + random.random((4, 3, count))))
    order, runs = in_runs(*network)
    strength = None
    if breakable:
        # Half of the bonds hold: the median of the tension of centres 2 m apart with a length of 1 m.
        limits = np.stack([np.full(count, 1.5), np.full(count, np.inf)])
        section = np.full((4, count), 1.0)
        strength = BondStrength(
            section, limits, np.full(first.size, -1, np.int64), np.zeros(first.size, np.int8)
        )
    gaps = np.any(runs.bond < 0)
    bonds = Bonds(
        first[order].astype(np.int32),
        second[order].astype(np.int32),
        kind[order].astype(np.int32),
        np.ones(first.size, np.int8),
        np.zeros(1, np.int64),
        (runs.bond >= 0).astype(np.int8) if gaps or breakable else None,
    )
    return particles, bonds, runs, kinds, strength


def summed_one_by_one(particles, bonds, kinds):
    """Force and torque on all particles, each bond in a pass of its own."""
    sums = np.zeros((6, particles.mass.size))
    for b in range(bonds.first.size):
        pair = slice(b, b + 1)
        _, alone = in_runs(bonds.first[pair], bonds.second[pair], bonds.kind[pair])
        one = Bonds(bonds.first[pair], bonds.second[pair], bonds.kind[pair], bonds.intact[pair], bonds.wound)
        particles.force[:] = particles.torque[:] = 0.0
        bond_pass(particles, one, alone, kinds, None, 0)
        sums += np.concatenate([particles.force, particles.torque])
    return sums


def test_loads_are_those_of_all_bonds_one_by_one_and_gaps_have_none(network):
    particles, bonds, runs, kinds, _ = belt(network)
    expected = summed_one_by_one(particles, bonds, kinds)
    particles.force[:] = particles.torque[:] = 0.0
    bond_pass(particles, bonds, runs, kinds, None, 0)
    found = np.concatenate([particles.force, particles.torque])
    # Loads of up to some 30 N, summed in another order.
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_gaps_neither_break_nor_count_as_wound_nor_load_anything():
    first, second, kind = NETWORKS["grid"]
    particles, bonds, runs, kinds, strength = belt((first, second, kind), breakable=True)
    # The ends of rows have no bonds left, lie far away and upside down.
    edge = np.arange(39, 90 * 40, 40)
    particles.orientation[:] = np.array([[1.0], [0.0], [0.0], [0.0]])
    gone = np.flatnonzero(np.isin(bonds.first, edge) | np.isin(bonds.second, edge))
    bonds.intact[gone] = 0
    bonds.whole[np.isin(runs.bond, gone)] = 0
    particles.orientation[:, edge] = np.array([[0.0], [0.0], [0.0], [1.0]])
    particles.position[:, edge] = 1e100
    particles.force[:] = particles.torque[:] = 0.0
    bond_pass(particles, bonds, runs, kinds, strength, 7)
    assert bonds.wound[0] == 0
    assert np.all(strength.mode[gone] == 0)
    assert np.all(np.isfinite(particles.force))
    assert not np.any(particles.force[:, edge])


def test_bonds_break_once_and_then_load_nothing():
    particles, bonds, runs, kinds, strength = belt(NETWORKS["torn grid"], breakable=True)
    measures, _ = bond_measures(particles, bonds, kinds)
    bond_pass(particles, bonds, runs, kinds, strength, 3)
    broken = bonds.intact == 0
    assert 100 < np.count_nonzero(broken) < bonds.first.size - 100
    np.testing.assert_array_equal(strength.broken_step, np.where(broken, 3, -1))
    # Both moments add to the stress by their sizes, not by the size of their sum.
    assert np.all(broken[measures[0] + measures[2] >= 1.5])
    assert not np.any(broken[measures[0] + math.sqrt(2.0) * measures[2] < 1.5])
    left = particles.force.copy()
    particles.force[:] = 0.0
    bond_pass(particles, bonds, runs, kinds, strength, 4)
    np.testing.assert_array_equal(particles.force, left)
    np.testing.assert_array_equal(strength.broken_step, np.where(broken, 3, -1))


def shaken_grid(tilt=0.0):
    """A damped belt in a random state whose particles are turned in the plane against the grid; [rad]."""
    deck = scenes.case(time_step=1e-5)
    scenes.add_grid(deck, 5, 9, fixed="NO")
    deck.blocks("BOND TYPE")[0].parameters["DAMPING FACTOR"] = 0.3
    rows = deck.blocks("BOND")[0].rows
    turned = Rotation.from_rotvec([0.0, 0.0, tilt]).as_quat(scalar_first=True)
    rows["orientation_1"] = rows["orientation_2"] = np.tile(turned, (len(rows["particles"]), 1))
    scene, random = build(deck), np.random.default_rng(4)
    particles = scene.population.particles
    particles.position[:] += 0.002 * random.normal(size=particles.position.shape)
    turns = Rotation.from_rotvec(0.5 * random.normal(size=(particles.mass.size, 3)))
    particles.orientation[:] = turns.as_quat(scalar_first=True).T
    particles.velocity[:], particles.angular_velocity[:] = random.normal(size=(2, *particles.velocity.shape))
    return scene


@pytest.mark.parametrize("quarters", [0, 1])
def test_bonds_along_the_particles_axes_need_no_triads_for_the_same_loads(quarters):
    scene = shaken_grid(0.5 * math.pi * quarters)
    assert scene.kinds.upright is not None
    particles = scene.population.particles
    found = []
    for kinds in (scene.kinds, scene.kinds._replace(upright=None)):
        particles.force[:] = particles.torque[:] = 0.0
        bond_pass(particles, scene.bonds, scene.runs, kinds, scene.strength, 0)
        found.append(particles.force.copy())
        found.append(particles.torque.copy())
    for load, with_triads in zip(found[:2], found[2:]):
        np.testing.assert_allclose(load, with_triads, atol=1e-13 * np.abs(with_triads).max())


def test_bonds_across_the_particles_axes_keep_their_triads():
    assert shaken_grid(0.3).kinds.upright is None
