"""A belt as the rollers see it: where its particles are, which way they run, and how far along the belt they lie."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from beltsim.console import CommandError
from beltsim.inp import Deck


class BeltError(CommandError):
    """The deck that should hold a belt holds none (exit code 3)."""


class Belt(NamedTuple):
    """Bonded particles of belts, (n, 3) and (n,), in m.

    along, normal : local x (running direction) and z (carrying side) in world axes
    half_thickness, half_width : half the outer sizes along z and y; pitch : spacing along the belt
    speed : of the belt along its running direction [m/s]
    station : distance along the belt from its first row, nan where rows hang together in no order
    """

    position: np.ndarray
    along: np.ndarray
    normal: np.ndarray
    half_thickness: np.ndarray
    half_width: np.ndarray
    pitch: np.ndarray
    speed: np.ndarray
    station: np.ndarray


def belt_of(deck: Deck, name: str, speed: float | None = None) -> Belt:
    """All bonded particles of a deck, moving at `speed` [m/s], without it as their *INITIAL VELOCITY says.

    Raises `BeltError` if there are none, or no speed.
    """
    from beltsim.view.deck import bonds_of, particles_of
    from beltsim.view.scenery import rotation_matrices

    particles = particles_of(deck)
    if particles is None or not particles.bonded.any():
        raise BeltError(f"{name}: found no bonded particles, expected a belt as beltconvert writes it")
    bonds, _ = bonds_of(deck, particles.id)
    axes = rotation_matrices(particles.orientation)
    along, normal = axes[:, :, 0], axes[:, :, 2]
    forward, across = _sorted_bonds(bonds, particles.position, along)
    pitch = np.linalg.norm(particles.position[forward[:, 1]] - particles.position[forward[:, 0]], axis=1)
    whole = np.full(len(along), np.median(pitch) if len(pitch) else 0.0)
    station = _stations(particles.position, forward, across)
    half = particles.size / 2
    speeds = _speeds(deck, particles.id, along) if speed is None else np.full(len(along), float(speed))
    if not np.isfinite(speeds[particles.bonded]).all():
        raise BeltError(f"{name}: found no *INITIAL VELOCITY of the belt, expected one, or --belt-speed")
    columns = (particles.position, along, normal, half[:, 2], half[:, 1], whole, speeds, station)
    return Belt(*(column[particles.bonded] for column in columns))


def joined(belts: list[Belt]) -> Belt:
    """Several belts as one; stations go on from belt to belt."""
    shifted, start = [], 0.0
    for belt in belts:
        shifted.append(belt._replace(station=belt.station + start))
        start += np.nanmax(belt.station, initial=0.0) + 1.0
    return Belt(*map(np.concatenate, zip(*shifted)))


def _speeds(deck: Deck, ids: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Initial velocity of each particle along its running direction, nan where none is given."""
    speeds, order = np.full(len(ids), np.nan), np.argsort(ids, kind="stable")
    for block in deck.blocks("INITIAL VELOCITY"):
        rows = order[np.minimum(np.searchsorted(ids, block.rows["id"], sorter=order), len(ids) - 1)]
        known = ids[rows] == block.rows["id"]
        rows, velocity = rows[known], block.rows["velocity"][known]
        speeds[rows] = np.einsum("ij,ij->i", velocity, along[rows])
    return speeds


def _sorted_bonds(bonds, position, along) -> tuple[np.ndarray, np.ndarray]:
    """Bonds along the belt, each from the particle behind to the one before, and bonds across it."""
    way = position[bonds[:, 1]] - position[bonds[:, 0]]
    ahead = np.einsum("ij,ij->i", way, along[bonds[:, 0]] + along[bonds[:, 1]]) / 2
    longitudinal = np.abs(ahead) > 0.7 * np.linalg.norm(way, axis=1)
    forward = bonds[longitudinal]
    forward[ahead[longitudinal] < 0] = forward[ahead[longitudinal] < 0][:, ::-1]
    return forward, bonds[~longitudinal]


def _stations(position, forward, across) -> np.ndarray:
    """Distance along the belt: bonds across join particles to rows, bonds along lead from row to row."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    n = len(position)
    ones = np.ones(len(across), np.int8)
    count, row = connected_components(
        coo_array((ones, (across[:, 0], across[:, 1])), shape=(n, n)), directed=False
    )
    members = np.bincount(row, minlength=count)
    centre = np.stack([np.bincount(row, position[:, i], count) / members for i in range(3)], axis=1)
    following = np.full(count, -1)
    following[row[forward[:, 0]]] = row[forward[:, 1]]
    led, followed = dict.fromkeys(row[forward[:, 0]].tolist()), set(following.tolist())
    station, at = np.full(count, np.nan), 0.0
    # Open belts from their first row; what is left are rings, begun at their first bond.
    for first in [*(r for r in led if r not in followed), *led]:
        while first >= 0 and np.isnan(station[first]):
            station[first] = at
            after = following[first]
            at += float(np.linalg.norm(centre[after] - centre[first])) if after >= 0 else 0.0
            first = after
    return station[row]
