"""The scenery of a Deck: its particles where they start, and its parts."""

from __future__ import annotations

import numpy as np

from beltsim.inp import Deck
from beltsim.inp.units import UNITS

from .errors import NothingToDraw
from .particles import Particles, layers, own_colours, solids, type_colours
from .parts import add_rolls_and_planes, mesh_file, part_colour
from .scenery import Scenery
from .values import largest_of_bonds, legend_of, paint

COLOUR_BY = ("none", "fibre", "type", "height", "strain")


def scenery_of_deck(
    deck: Deck,
    colour_by: str = "none",
    *,
    hide: frozenset[str] = frozenset(),
    limits: tuple[float, float] | None = None,
) -> Scenery:
    """The picture of a deck.

    colour_by: "none" (own colours), "fibre" (each type of the belt), "type" (each particle type), "height" (z in
    m), "strain" (largest initial elongation of a particle's bonds, in %). hide: layers of `LAYERS`. limits: ends
    of the colour bar.
    """
    scenery = Scenery()
    particles = particles_of(deck)
    if particles is not None:
        colour = _colours(deck, particles, colour_by, limits, scenery)
        scenery.items = solids(particles, colour, hide)
    if "parts" not in hide:
        _add_parts(deck, scenery)
    if not scenery.visible():
        raise NothingToDraw("nothing to draw: the deck holds no particle or part that is not hidden")
    return scenery


def particles_of(deck: Deck) -> Particles | None:
    """All particles of a deck, None if it has none."""
    blocks = [block for block in deck.blocks("PARTICLE") if len(block)]
    if not blocks:
        return None
    types = {block["NAME"]: block for block in deck.blocks("PARTICLE TYPE")}
    names = tuple(dict.fromkeys(block["TYPE"] for block in blocks))
    missing = [name for name in names if name not in types]
    if missing:
        raise NothingToDraw(f"*PARTICLE TYPE: found none named {', '.join(missing)}, expected one")
    species = np.repeat([names.index(block["TYPE"]) for block in blocks], [len(block) for block in blocks])
    column = {name: np.concatenate([block.rows[name] for block in blocks]) for name in blocks[0].rows}
    outer = np.array([_outer_size(types[name]) for name in names])
    size, edges = outer[species], np.array([types[name].get("EDGE RADIUS") or 0.0 for name in names])
    order = np.argsort(column["id"], kind="stable")
    for block in deck.blocks("PARTICLE SIZE"):
        size[_rows(column["id"], order, block.rows["id"])] = block.rows["size"]
    bonded = np.zeros(len(species), bool)
    bonded[bonds_of(deck, column["id"])[0].ravel()] = True
    return Particles(
        id=column["id"],
        species=species,
        names=names,
        shapes=tuple(types[name]["SHAPE"] for name in names),
        classes=tuple(types[name].get("CLASS") or "" for name in names),
        colours=tuple(types[name].get("COLOR") or "" for name in names),
        position=column["position"],
        orientation=column["orientation"],
        size=size,
        edge_radius=edges[species],
        bonded=bonded,
    )


def _outer_size(kind) -> tuple[float, float, float]:
    if kind["SHAPE"] == "SPHERE":
        return (2 * kind["RADIUS"],) * 3
    if kind["SHAPE"] == "CYLINDER":
        return kind["DIAMETER"], kind["DIAMETER"], kind["LENGTH"]
    return kind["SIZE X"], kind["SIZE Y"], kind["SIZE Z"]


def _rows(ids: np.ndarray, order: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """The rows of wanted ids; `order` sorts `ids`."""
    place = np.clip(np.searchsorted(ids, wanted, sorter=order), 0, len(ids) - 1)
    rows = order[place]
    if np.any(ids[rows] != wanted):
        raise NothingToDraw(
            f"particle {wanted[ids[rows] != wanted][0]}: found no row, expected one in *PARTICLE"
        )
    return rows


def bonds_of(deck: Deck, ids: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The bonds of a deck: particle rows (b, 2) and stress-free lengths (b,) in m."""
    blocks = [block for block in deck.blocks("BOND") if len(block)]
    if not blocks:
        return np.zeros((0, 2), int), np.zeros(0)
    pairs = np.concatenate([block.rows["particles"] for block in blocks])
    span = np.concatenate([block.rows["position_2"] - block.rows["position_1"] for block in blocks])
    return _rows(ids, np.argsort(ids, kind="stable"), pairs), np.linalg.norm(span, axis=1)


def _colours(deck, particles, colour_by, limits, scenery) -> np.ndarray:
    if colour_by in ("fibre", "type"):
        return type_colours(particles, (layers(particles) == 0) | (colour_by == "type"))
    if colour_by == "none":
        return own_colours(particles)
    if colour_by == "height":
        label, signed = "height, m", False
        values = np.where(layers(particles) == 2, np.nan, particles.position[:, 2])
    else:
        label, signed = "strain, %", True
        values = _strain(deck, particles)
    scenery.legend = legend_of(label, values, limits, signed=signed)
    return paint(own_colours(particles), values, scenery.legend)


def _strain(deck: Deck, particles: Particles) -> np.ndarray:
    pairs, free = bonds_of(deck, particles.id)
    length = np.linalg.norm(np.diff(particles.position[pairs], axis=1)[:, 0], axis=1)
    return largest_of_bonds(len(particles.id), pairs, 100 * (length / free - 1))


def _add_parts(deck: Deck, scenery: Scenery) -> None:
    rolls, planes = [], []
    for block in deck.blocks("PART"):
        position, orientation = np.zeros(3), np.array([1.0, 0, 0, 0])
        if len(block):
            position, orientation = block.rows["position"][0], block.rows["orientation"][0]
        colour = part_colour(block.get("COLOR"), block.get("CLASS"))
        if block["SHAPE"] == "CYLINDER":
            rolls.append((position, orientation, block["DIAMETER"], block["LENGTH"], colour))
        elif block["SHAPE"] == "MESH":
            scale = float(UNITS["length"][(block.get("UNIT") or "m").lower()])
            scenery.items.append(mesh_file(block.path(), scale, position, orientation, colour))
        else:
            planes.append((position, orientation))
    add_rolls_and_planes(scenery, rolls, planes)
