"""Mesh bytes to a Deck with bonded-particle belts: the whole way in one function."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import NamedTuple

import numpy as np

from beltsim.inp import Deck

from .belt import Belt, Making, add_belt
from .cells import cells_of
from .flat import flattened
from .frames import Pose, frames, oriented, quaternions
from .mesh import Mesh
from .piece import Grid
from .properties import Sheet, mass_per_area
from .recover import Wishes, recover
from .refusals import NotABelt
from .report import info_lines, report
from .stl import read_stl
from .units import scale_of
from .zones import Zone, zones_of


@dataclass(frozen=True)
class Settings:
    """All that a user can state; each part belongs to the step of its name.

    stress_free : "auto", "belt", "row" or "bond"; half_edges : outer nodes lie on the belt's edge.
    """

    unit: str = "auto"
    wishes: Wishes = field(default_factory=Wishes)
    pose: Pose = field(default_factory=Pose)
    making: Making = field(default_factory=Making)
    sheet: Sheet = field(default_factory=Sheet)
    stress_free: str = "auto"
    half_edges: bool = False
    zones: tuple[Zone, ...] = ()
    contact_modulus: float = 5e6
    stated: dict[str, str] = field(default_factory=dict)


class Conversion(NamedTuple):
    """A Deck, the belts in it, what was measured of each, warnings and seconds by stage."""

    deck: Deck
    belts: list[Belt]
    reports: list[dict]
    warnings: list[str]
    timings: dict[str, float]


def convert(data: bytes, name: str, settings: Settings) -> Conversion:
    """Belts of an STL file's bytes; `UnreadableMesh` or `NotABelt` if there is no proven grid."""
    start = perf_counter()
    mesh = read_stl(data, name)
    read = perf_counter()
    warnings: list[str] = []
    try:
        grids = grids_in_metres(mesh, settings, warnings)
    except NotABelt as refusal:
        refusal.name = name
        raise
    found = perf_counter()
    deck, belts, reports = assemble(grids, name, settings, warnings)
    timings = {"read": read - start, "grid": found - read, "belt": perf_counter() - found}
    return Conversion(deck, belts, reports, warnings, timings)


def grids_in_metres(mesh: Mesh, settings: Settings, warnings: list[str]) -> list[Grid]:
    """Proven grids of a mesh in its own unit, scaled to metres."""
    grids = recover(mesh, settings.wishes, warnings)
    steps = [
        np.linalg.norm(np.diff(grid.points, axis=axis), axis=2).ravel() for grid in grids for axis in (0, 1)
    ]
    _, scale = scale_of(settings.unit, float(np.median(np.concatenate(steps))), warnings)
    return [Grid(grid.points * scale, grid.kind) for grid in grids]


def assemble(grids: list[Grid], name: str, settings: Settings, warnings: list[str]) -> tuple:
    """Deck, belts and reports of grids in metres."""
    belts = [belt_of(grid, settings, warnings) for grid in grids]
    makings = _makings(belts, settings.making)
    reports = [report(belt, making) for belt, making in zip(belts, makings)]
    deck = Deck()
    deck.add("FORMAT", name="BELTSIM", version=1)
    deck.add("INFO", title="CONVERSION SETTINGS", rows={"text": [f"input = {name}", *_stated(settings)]})
    deck.add("INFO", title="RESULT", rows={"text": info_lines(reports)})
    density = mass_per_area(settings.sheet) / settings.sheet.thickness
    deck.add(
        "MATERIAL",
        name=settings.making.material,
        density=density,
        youngs_modulus=settings.contact_modulus,
        poisson_ratio=0.45,
    )
    for belt, making in zip(belts, makings):
        add_belt(deck, belt, making)
    return deck, belts, reports


def _stated(settings: Settings) -> list[str]:
    return [f"{key} = {value}" for key, value in settings.stated.items()]


def _makings(belts: list[Belt], making: Making) -> list[Making]:
    """Names and ids of each belt: several are numbered, and their ids follow each other."""
    if len(belts) == 1:
        return [making]
    result, first_id = [], making.first_id
    for number, belt in enumerate(belts, start=1):
        name = f"{making.name}_{number}"
        result.append(replace(making, name=name, fibre_name=f"{name}_{making.fibre_name}", first_id=first_id))
        first_id += belt.zone.size
    return result


def belt_of(grid: Grid, settings: Settings, warnings: list[str]) -> Belt:
    """One belt of a grid in metres: which way it lies, its stress-free state and its cells."""
    grid = oriented(grid, settings.pose, warnings)
    axes = frames(grid)
    flat = flattened(grid, axes, settings.stress_free, *settings.making.elongation)
    cells = cells_of(grid, flat, half_edges=settings.half_edges)
    zone, sheets, names = zones_of(grid.points.shape[:2], settings.sheet, settings.zones)
    return Belt(grid, axes, quaternions(axes), flat, cells, zone, sheets, names)
