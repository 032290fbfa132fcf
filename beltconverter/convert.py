"""Mesh file to a Deck with bonded-particle belts: the whole way in one function."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import NamedTuple

import numpy as np

from beltsim.console import UsageProblem
from beltsim.inp import Deck

from .belt import Belt, Making
from .bonds import add_bonds
from .cells import cells_of
from .flat import flattened
from .frames import Pose, frames, oriented, quaternions
from .mesh import Mesh
from .particles import add_particles
from .piece import Grid
from .properties import Sheet, mass_per_area
from .quads import read_quads, reads_quads
from .recover import Wishes, recover
from .refusals import NotABelt
from .report import info_lines, report
from .solid import Solid, mid_surfaces, solids_of
from .stl import read_stl
from .units import scale_of, scale_of_solid
from .zones import Zone, zones_of


@dataclass(frozen=True)
class Settings:
    """All that a user can state; each part belongs to the step of its name.

    stress_free : "auto", "belt", "row" or "bond"; half_edges : outer nodes lie on the belt's edge; cell : side of
    the cells that a solid is cut into, m, None for a mid-surface; thickness_stated : else a solid's own is taken;
    stated : the options as lines for the file; source : path of the mesh as seen from the INP file.
    """

    unit: str = "auto"
    wishes: Wishes = field(default_factory=Wishes)
    pose: Pose = field(default_factory=Pose)
    making: Making = field(default_factory=Making)
    sheet: Sheet = field(default_factory=Sheet)
    stress_free: str = "auto"
    half_edges: bool = False
    contact_modulus: float = 5e6
    friction: float = 0.5
    restitution: float = 0.3
    zones: tuple[Zone, ...] = ()
    cell: float | None = None
    thickness_stated: bool = False
    stated: dict[str, str] = field(default_factory=dict)
    source: str | None = None


class Conversion(NamedTuple):
    """A Deck, the belts in it, what was measured of each, warnings and seconds by stage."""

    deck: Deck
    belts: list[Belt]
    reports: list[dict]
    warnings: list[str]
    timings: dict[str, float]


class Found(NamedTuple):
    """Proven grids in metres, the unit of the file they came from, and a solid's thickness, m."""

    grids: list[Grid]
    unit: str
    thickness: float | None = None


def convert(data: bytes, name: str, settings: Settings) -> Conversion:
    """Belts of a mesh file's bytes; `UnreadableMesh` or `NotABelt` if there is no proven grid."""
    clock = [perf_counter()]
    mesh = read_quads(data, name) if reads_quads(name) else read_stl(data, name)
    digest = hashlib.sha256(data).hexdigest()
    del data
    clock.append(perf_counter())
    warnings: list[str] = []
    try:
        found = _found(mesh, settings, warnings)
    except NotABelt as refusal:
        refusal.name = name
        raise
    clock.append(perf_counter())
    if found.thickness and not settings.thickness_stated:
        settings = replace(settings, sheet=replace(settings.sheet, thickness=found.thickness))
    belts = _belts(found.grids, settings, warnings)
    makings = makings_of(belts, settings.making)
    reports = [report(belt, making, settings.pose) for belt, making in zip(belts, makings)]
    deck = _deck(name, digest, found.unit, settings, reports)
    for belt, making in zip(belts, makings):
        add_particles(deck, belt, making)
        add_bonds(deck, belt, making)
    clock.append(perf_counter())
    return Conversion(
        deck, belts, reports, warnings, dict(zip(("read", "grid", "belt"), np.diff(clock).tolist()))
    )


def _found(mesh: Mesh, settings: Settings, warnings: list[str]) -> Found:
    if settings.cell is not None:
        return _from_solids(mesh, settings, warnings)
    grids = recover(mesh, settings.wishes, warnings)
    steps = [
        np.linalg.norm(np.diff(grid.points, axis=axis), axis=2).ravel() for grid in grids for axis in (0, 1)
    ]
    unit, scale = scale_of(settings.unit, float(np.median(np.concatenate(steps))), warnings)
    return Found([Grid(grid.points * scale, grid.kind) for grid in grids], unit)


def _from_solids(mesh: Mesh, settings: Settings, warnings: list[str]) -> Found:
    solids: list[Solid] = solids_of(mesh, warnings)
    unit, scale = scale_of_solid(settings.unit, solids[0].thickness, warnings)
    surfaces = mid_surfaces(solids, settings.cell / scale, half_edges=settings.half_edges)
    thickness = float(np.mean([solid.thickness for solid in solids])) * scale
    return Found([Grid(grid.points * scale, grid.kind) for grid in surfaces], unit, float(f"{thickness:.4g}"))


def _deck(name: str, digest: str, unit: str, settings: Settings, reports: list[dict]) -> Deck:
    """The blocks that are not about one belt: format, information, source, material, contact of belt on belt."""
    making, lines = settings.making, [f"{key} = {value}" for key, value in settings.stated.items()]
    deck = Deck()
    deck.add("FORMAT", name="BELTSIM", version=1)
    deck.add(
        "INFO",
        title="CONVERSION SETTINGS",
        rows={"text": [f"input = {name}", f"unit of the mesh = {unit}", *lines]},
    )
    deck.add("INFO", title="RESULT", rows={"text": info_lines(reports)})
    if settings.source:
        deck.add("MESH SOURCE", input=settings.source, unit=unit.upper(), sha256=digest, rows={"text": lines})
    density = mass_per_area(settings.sheet) / settings.sheet.thickness
    deck.add(
        "MATERIAL",
        name=making.material,
        density=density,
        youngs_modulus=settings.contact_modulus,
        poisson_ratio=0.45,
    )
    if len(reports) > 1 or making.touching_columns:
        both = {"material_a": making.material, "material_b": making.material}
        deck.add("CONTACT PROPERTY", **both, friction=settings.friction, restitution=settings.restitution)
    return deck


def makings_of(belts: list[Belt], making: Making) -> list[Making]:
    """Names and ids of each belt: several are numbered, and their ids follow each other."""
    if len(belts) == 1:
        return [making]
    result, first_id = [], making.first_id
    for number, belt in enumerate(belts, start=1):
        name = f"{making.name}_{number}"
        more = {
            "name": name,
            "fibre_name": f"{name}_{making.fibre_name}",
            "bond_name": f"{name}_",
            "first_id": first_id,
        }
        result.append(replace(making, **more))
        first_id += belt.zone.size
    return result


def _belts(grids: list[Grid], settings: Settings, warnings: list[str]) -> list[Belt]:
    pose = settings.pose
    for number in (*pose.flip_belts, *pose.reverse_belts):
        if number > len(grids):
            raise UsageProblem(f"belt {number} to be turned: the file has {len(grids)}")
    return [belt_of(grid, settings, pose.of_belt(k), warnings) for k, grid in enumerate(grids, start=1)]


def belt_of(grid: Grid, settings: Settings, pose: Pose, warnings: list[str]) -> Belt:
    """One belt of a grid in metres: which way it lies, its stress-free state and its cells."""
    grid = oriented(grid, pose, warnings)
    axes = frames(grid)
    flat = flattened(grid, axes, settings.stress_free, *settings.making.elongation)
    _warn_of_strain(flat.strains, warnings)
    cells = cells_of(grid, flat, half_edges=settings.half_edges)
    zone, sheets, names = zones_of(grid.points.shape[:2], settings.sheet, settings.zones)
    return Belt(grid, axes, quaternions(axes), flat, cells, zone, sheets, names)


def _warn_of_strain(strains: np.ndarray, warnings: list[str]) -> None:
    """Belts are used below 2 %; beyond 5 % the shape is no bent flat belt, or the cells are not what they seem."""
    if np.abs(strains).max() > 0.05:
        warnings.append(
            f"initial strain from {100 * strains.min():+.1f} % to {100 * strains.max():+.1f} %: the mesh is no flat "
            "belt that was bent, or --stress-free row suits its cells better"
        )
