"""Particles of a deck or a frame as solids: which of them are belt, bulk or machine parts, and their colours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .colours import BULK, PULLEY, RUBBER, STEEL, distinct, from_hex
from .errors import ViewProblem
from .scenery import Boxes, Cylinders, Spheres

LAYERS = ("belt", "bulk", "parts")


@dataclass(frozen=True)
class Particles:
    """Particles with the names, shapes, classes and colours ("" for none) of their types, sizes outer, in m."""

    id: np.ndarray
    species: np.ndarray  # (n,) index into the four below
    names: tuple[str, ...]
    shapes: tuple[str, ...]
    classes: tuple[str, ...]
    colours: tuple[str, ...]
    position: np.ndarray
    orientation: np.ndarray | None  # None: not known
    size: np.ndarray  # (n, 3)
    edge_radius: np.ndarray
    bonded: np.ndarray  # (n,) bool

    def shape(self, name: str) -> np.ndarray:
        """Which particles (n,) have a shape."""
        return np.array([shape == name for shape in self.shapes], bool)[self.species]


def layers(particles: Particles) -> np.ndarray:
    """The layer (n,) of each particle, as index into `LAYERS`.

    Cylinders are machine parts. A type with a bond anywhere is belt; where nothing has bonds, boxes are.
    """
    has_bond = np.zeros(len(particles.names), bool)
    has_bond[particles.species[particles.bonded]] = True
    belt = has_bond[particles.species] if has_bond.any() else particles.shape("ROUNDED BOX")
    return np.where(particles.shape("CYLINDER"), 2, np.where(belt, 0, 1))


def own_colours(particles: Particles) -> np.ndarray:
    """Colours (n, 3): the type's own, else rubber, bulk or steel; bulk varies by 15 % in brightness."""
    layer = layers(particles)
    colour = np.array([RUBBER, BULK, STEEL])[layer]
    for k, (text, kind) in enumerate(zip(particles.colours, particles.classes)):
        if text:
            colour[particles.species == k] = from_hex(text)
        elif kind:
            colour[(particles.species == k) & (layer == 2)] = class_colour(kind)
    bulk = layer == 1
    # Multiples of the golden ratio fill 0..1 evenly, so neighbours in number differ.
    colour[bulk] *= 0.85 + 0.3 * ((particles.id[bulk, None] * 0.618033988749895) % 1)
    return np.clip(colour, 0, 1)


def type_colours(particles: Particles, chosen: np.ndarray) -> np.ndarray:
    """One colour for each particle type among the chosen particles (n,) bool; the others keep their own."""
    colour = own_colours(particles)
    kinds = np.unique(particles.species[chosen])
    palette = np.zeros((len(particles.names), 3))
    palette[kinds] = distinct(len(kinds))
    colour[chosen] = palette[particles.species[chosen]]
    return colour


def class_colour(kind: str) -> tuple[float, float, float]:
    """The colour of a machine part without one of its own: pulleys blue, all else steel."""
    return PULLEY if kind.upper() == "PULLEY" else STEEL


def solids(particles: Particles, colour: np.ndarray, hide: frozenset[str] = frozenset()) -> list:
    """The particles as boxes, spheres and cylinders, without the layers named in `hide`."""
    shown = np.array([name not in hide for name in LAYERS])[layers(particles)]
    boxes, balls, rolls = (
        np.flatnonzero(shown & particles.shape(name)) for name in ("ROUNDED BOX", "SPHERE", "CYLINDER")
    )
    turn = particles.orientation
    if turn is None:
        if len(boxes) or len(rolls):
            raise ViewProblem("found no orientations, expected them: add ORIENTATION to *OUTPUT, FIELDS=")
        turn = np.zeros((len(shown), 4))
    at, size = particles.position, particles.size
    return [
        Boxes(at[boxes], turn[boxes], size[boxes], particles.edge_radius[boxes], colour[boxes]),
        Cylinders(at[rolls], turn[rolls], size[rolls, 0], size[rolls, 2], colour[rolls]),
        Spheres(at[balls], size[balls, 0] / 2, colour[balls]),
    ]
