"""Loads that are found while the particles drift, those of each stretch while its state is in the cache.

At a million particles a step waits for memory: on one core a bonded strip takes 21 ns a particle this way and 24 ns
one pass after the other, a box of spheres 94 and 114 ns.
"""

from __future__ import annotations

from beltsim.solver.bonds import bond_chunk, bonds_across, in_turn, last_loaded
from beltsim.solver.chunks import CHUNK, chunks_in
from beltsim.solver.integration import drift_chunk, kick_and_drift
from beltsim.solver.jit import callee, inner
from beltsim.solver.sphere_contacts import begin_crossing, sphere_piece, take_crossings


@inner
def drift_and_load(
    particles, shapes, laws, belt, strength, spheres, environment, ledger, team, left, limits, clock
):  # fmt: skip
    """`kick_and_drift` and the loads of bonds or, in scenes without, of contacts between spheres.

    Not with a book, with threads (None but for these: arguments of their own, so that nothing is compiled in vain) or
    with led particles, which turn later. Returns the counts of `drift_chunk` and whether there are loads.
    """
    if ledger is None:
        if team is None:
            if environment.guided.particle.size == 0:
                if belt is not None:
                    return drift_and_bond(particles, belt, strength, environment, left, limits, clock), True
                if spheres is not None:
                    return drift_and_touch(
                        particles, shapes, laws, spheres, environment, left, limits, clock
                    ), True
    return kick_and_drift(particles, environment, team, left, clock.time_step, limits), False


@inner
def drift(c, particles, environment, left, limits, clock):
    """`drift_chunk` of chunk c."""
    return drift_chunk(
        c, particles, environment.notes, environment.gravity, environment.drag, environment.wind, environment.ledger,
        left, clock.time_step, limits,
    )  # fmt: skip


@callee
def drift_and_bond(particles, belt, strength, environment, left, limits, clock):
    """Drift and the loads of bonds."""
    bonds, runs, kinds = belt
    far = fast = lost = done = wound = 0
    chunks, drifting = runs.chunk.size - 1, chunks_in(particles.mass.size)
    for c in range(drifting):
        counts = drift(c, particles, environment, left, limits, clock)
        far, fast, lost = far + counts[0], fast + counts[1], lost + counts[2]
        while done < chunks and (last_loaded(done, chunks) <= c or c + 1 == drifting):
            turn = in_turn(done, chunks)
            wound += bond_chunk(turn, particles, bonds, runs, kinds, strength, clock.step, clock.time_step)
            done += 1
    wound += bonds_across(particles, bonds, runs, kinds, strength, clock.step, clock.time_step)
    bonds.wound[0] = wound
    return far, fast, lost


@callee
def drift_and_touch(particles, shapes, laws, spheres, environment, left, limits, clock):
    """Drift and the loads of contacts between spheres."""
    crossings = spheres.crossings
    far = fast = lost = piece = 0
    begin_crossing(crossings)
    for c in range(chunks_in(particles.mass.size)):
        counts = drift(c, particles, environment, left, limits, clock)
        far, fast, lost = far + counts[0], fast + counts[1], lost + counts[2]
        moved = min((c + 1) * CHUNK, particles.mass.size)
        while piece < crossings.stop.size and crossings.stop[piece] <= moved:
            sphere_piece(piece, particles, shapes, laws, spheres, clock.time_step)
            piece += 1
    take_crossings(particles, crossings)
    return far, fast, lost
