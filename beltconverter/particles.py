"""A belt's contact groups, particle types, particles and velocities as blocks of a Deck."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from beltsim.console import UsageProblem
from beltsim.inp import Deck

from .belt import Belt, Making, ids_of, masses
from .cells import Cells, inertia
from .frames import angular_velocities
from .properties import Sheet, mass_per_area

MOST_SPHERES = (
    50  # types of spheres in one belt: half cells need three, a graded mesh as many as it has cells
)


def add_particles(deck: Deck, belt: Belt, making: Making) -> None:
    """Append contact groups, particle types with their particles, sizes of uneven cells, and velocities."""
    ids = ids_of(belt, making)
    _add_groups(deck, making)
    for name, kind in _kinds(belt, making).items():
        parameters = _type_parameters(belt.sheets[kind.zone], making, *map(np.array, kind.cell))
        deck.add("PARTICLE TYPE", name=name, **parameters, contact_group=_group(making, kind.side))
        position, orientation = belt.grid.points[kind.chosen], belt.orientation[kind.chosen]
        rows = {"id": ids[kind.chosen], "position": position, "orientation": orientation}
        deck.add("PARTICLE", type=name, rows=rows)
    if making.shape == "box":
        _add_sizes(deck, belt, making, ids)
    if making.speed is not None:
        _add_velocities(deck, belt, making.speed, ids)


def _group(making: Making, side: str = "") -> str:
    return f"{making.prefix}{making.name}{side and '_' + side}"


def _add_groups(deck: Deck, making: Making) -> None:
    for side in ("", "left", "right") if making.touching_columns else ("",):
        deck.add("CONTACT GROUP", name=_group(making, side), belt=_group(making))
    if making.touching_columns:
        left, right = _group(making, "left"), _group(making, "right")
        deck.add("CONTACT GROUP PAIR", group_a=left, group_b=right, contact=True)


class Kind(NamedTuple):
    """Particles of one type: contact side, zone, sides of the type's cell (a, b), m, and the particles (R, C)."""

    side: str
    zone: int
    cell: tuple[float, float]
    chosen: np.ndarray


def _kinds(belt: Belt, making: Making) -> dict[str, Kind]:
    """The types by their names: one for each fibre, side, zone and, of spheres, size of cell."""
    columns = belt.zone.shape[1]
    sides, fibres = _sides(columns, making.touching_columns), _fibre_names(columns, making)
    sizes, size = _sizes_of_types(belt.cells, making)
    kinds: dict[str, Kind] = {}
    for j in range(columns):
        for zone, k in np.unique(np.stack([belt.zone[:, j], size[:, j]], axis=1), axis=0).tolist():
            parts = [fibres[j], sides[j], belt.zone_names[zone], f"c{k + 1}" if k else ""]
            name = making.prefix + "_".join(part for part in parts if part)
            fresh = Kind(sides[j], zone, sizes[k], np.zeros(belt.zone.shape, bool))
            chosen = kinds.setdefault(name, fresh).chosen
            chosen[:, j] = (belt.zone[:, j] == zone) & (size[:, j] == k)
    return kinds


def _sizes_of_types(cells: Cells, making: Making) -> tuple[list[tuple[float, float]], np.ndarray]:
    """Cells (a, b) that need a type of their own, commonest first, and which one (R, C) each particle has.

    Boxes have one: *PARTICLE SIZE gives each its own. It knows no spheres, so these need a type for each size.
    """
    if making.shape != "sphere":
        return [cells.nominal], np.zeros(cells.along.shape, np.int64)
    pairs = np.stack([cells.along.ravel(), cells.across.ravel()], axis=1)
    steps = np.round(pairs / pairs.max(axis=0) * 1e9)
    _, first, kind, counts = np.unique(
        steps, axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    if len(first) > MOST_SPHERES:
        raise UsageProblem(f"--shape sphere: the cells have {len(first)} sizes; boxes suit an uneven mesh")
    order = np.argsort(-counts, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return [tuple(pair) for pair in pairs[first[order]].tolist()], rank[kind.ravel()].reshape(
        cells.along.shape
    )


def _sides(columns: int, touching: int) -> list[str]:
    """Contact group of each column: the positive local y is on the left."""
    if 2 * touching > columns:
        raise UsageProblem(f"--touching-edges {touching}: the belt has {columns} columns only")
    return ["right" if j < touching else "left" if j >= columns - touching else "" for j in range(columns)]


def _fibre_names(columns: int, making: Making) -> list[str]:
    if making.fibres == "none":
        return [making.name] * columns
    if making.fibres == "alternating":
        return [f"{making.fibre_name}_{1 + j % 2}" for j in range(columns)]
    digits = max(3, len(str(columns)))
    return [f"{making.fibre_name}_{j:0{digits}d}" for j in range(1, columns + 1)]


def _type_parameters(sheet: Sheet, making: Making, along: np.ndarray, across: np.ndarray) -> dict:
    mass = mass_per_area(sheet) * along * across
    moments = inertia(mass, along, across, np.array(sheet.thickness)).tolist()
    size = outer_size(along, across, sheet, making).tolist()
    body = dict(zip(("inertia_x", "inertia_y", "inertia_z"), moments))
    body |= {"mass": float(mass), "material": making.material}
    if making.shape == "sphere":
        return {"shape": "SPHERE", "radius": size[0] / 2, **body}
    sizes = dict(zip(("size_x", "size_y", "size_z"), size))
    return {"shape": "ROUNDED BOX", **sizes, "edge_radius": edge_radius(sheet, making), **body}


def edge_radius(sheet: Sheet, making: Making) -> float:
    """Radius of the boxes' edges, m: 0.4 of the thickness unless stated."""
    radius = 0.4 * sheet.thickness if making.edge_radius is None else making.edge_radius
    if 2 * radius > sheet.thickness:
        raise UsageProblem(
            f"--edge-radius {radius:.4g} m is more than half the thickness, {sheet.thickness:.4g} m"
        )
    return radius


def outer_size(along: np.ndarray, across: np.ndarray, sheet: Sheet, making: Making) -> np.ndarray:
    """Outer sizes (..., 3), m, of particles in their cells: as meshed, longer by the overlap, so that flats meet."""
    sides = np.stack([along * making.elongation[0], across * making.elongation[1]], axis=-1)
    if making.shape == "sphere":
        widest = sides.max(axis=-1, keepdims=True) + (making.overlap or 0.0)
        diameter = widest if making.sphere_radius is None else np.full_like(widest, 2 * making.sphere_radius)
        return np.repeat(diameter, 3, axis=-1)
    overlap = 2 * edge_radius(sheet, making) if making.overlap is None else making.overlap
    return np.concatenate([sides + overlap, np.full((*sides.shape[:-1], 1), sheet.thickness)], axis=-1)


def _add_sizes(deck: Deck, belt: Belt, making: Making, ids: np.ndarray) -> None:
    """Rows for the cells that differ from their type's: all of a graded belt, the half cells of an even one."""
    cells = belt.cells
    along, across = (np.isclose(*pair, rtol=1e-9) for pair in zip((cells.along, cells.across), cells.nominal))
    differs = ~(along & across)
    if not differs.any():
        return
    mass = masses(belt)
    size, moments = np.empty((*mass.shape, 3)), np.empty((*mass.shape, 3))
    for zone, sheet in enumerate(belt.sheets):
        at = belt.zone == zone
        size[at] = outer_size(cells.along[at], cells.across[at], sheet, making)
        moments[at] = inertia(mass[at], cells.along[at], cells.across[at], np.full(at.sum(), sheet.thickness))
    rows = {"id": ids[differs], "size": size[differs], "mass": mass[differs], "inertia": moments[differs]}
    deck.add("PARTICLE SIZE", rows=rows)


def _add_velocities(deck: Deck, belt: Belt, speed: float, ids: np.ndarray) -> None:
    velocity = speed * belt.axes[..., 0] + 0.0
    spin = angular_velocities(belt.grid, belt.axes, speed) + 0.0
    rows = {"velocity": velocity.reshape(-1, 3), "angular_velocity": spin.reshape(-1, 3)}
    deck.add("INITIAL VELOCITY", rows={"id": ids.ravel(), **rows})
