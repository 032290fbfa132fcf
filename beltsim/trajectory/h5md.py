"""Lays out the H5MD tree: particles, connectivity, observables, and our own groups beside them.

Elements that change share one step and one time dataset, the position's, by hard links.
"""

from __future__ import annotations

from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np

import beltsim
from beltsim.trajectory.layout import (
    BONDS,
    LAYOUT_VERSION,
    PARTICLES,
    PARTS,
    PROPERTIES,
    Contents,
    Frame,
    PartDescription,
    escaped,
    property_field,
)
from beltsim.trajectory.series import Series, check_shape, grow

if TYPE_CHECKING:
    import h5py


def create(file: h5py.File, contents: Contents) -> tuple[list[Series], list[Series]]:
    """Write everything that stays the same; returns the empty datasets that the frames fill.

    The first list is the clock, step and time, which all elements share; the second is everything else.
    """
    _create_header(file)
    clock = _create_clock(file)
    return clock, [
        *_create_particles(file, contents),
        *_create_identity(file, contents),
        *_create_properties(file, contents),
        *_create_bonds(file, contents),
        *_create_parts(file, contents),
        *_create_observables(file, contents),
    ]


def _create_header(file: h5py.File) -> None:
    h5md = file.create_group("h5md")
    h5md.attrs["version"] = np.array([1, 1], "i4")
    h5md.create_group("author").attrs["name"] = "unknown"
    creator = h5md.create_group("creator")
    creator.attrs["name"] = "beltsim"
    creator.attrs["version"] = beltsim.__version__
    file.create_group("beltsim").attrs["layout"] = LAYOUT_VERSION


def _create_clock(file: h5py.File) -> list[Series]:
    position = file.create_group("particles/all/position")
    step = grow(position, "step", (), "i8", attrgetter("step"))
    time = grow(position, "time", (), "f8", attrgetter("time"))
    time.dataset.attrs["unit"] = "s"
    return [step, time]


def _create_particles(file: h5py.File, contents: Contents) -> list[Series]:
    box = file.create_group("particles/all/box")
    box.attrs["dimension"] = 3
    box.attrs["boundary"] = np.array(["none"] * 3, "S4")
    written = [name for name in PARTICLES if name == "position" or name in contents.arrays]
    return [_particle_series(file, contents, name) for name in written]


def _particle_series(file: h5py.File, contents: Contents, name: str) -> Series:
    columns, unit = PARTICLES[name]
    shape = (contents.slots, *columns)
    group = file["particles/all/position"] if name == "position" else _element(file, "particles/all", name)
    series = grow(
        group,
        "value",
        shape,
        _float(contents),
        attrgetter(name),
        per_particle=True,
        compress=contents.compress,
    )
    # MDAnalysis refuses the unit "m" of a position, and needs none.
    series.dataset.attrs["si_unit" if name == "position" else "unit"] = unit
    return series


def _create_identity(file: h5py.File, contents: Contents) -> list[Series]:
    active = grow(file["beltsim"], "active", (), "i8", attrgetter("active"))
    if not contents.dynamic:
        ids = np.arange(contents.slots) if contents.id is None else contents.id
        file["particles/all/id"] = np.asarray(ids, "i8")
        return [active]
    group = _element(file, "particles/all", "id")
    shape, compress = (contents.slots,), contents.compress
    ids = grow(group, "value", shape, "i8", attrgetter("id"), per_particle=True, compress=compress)
    return [active, ids]


def _create_properties(file: h5py.File, contents: Contents) -> list[Series]:
    """Species, mass and sizes: one array for the run where the contents have it, else one each frame."""
    _create_species(file, contents)
    series = []
    for name, (columns, unit, dtype) in PROPERTIES.items():
        field, shape = property_field(name), (contents.slots, *columns)
        values = getattr(contents, field)
        if values is not None:
            values = np.broadcast_to(np.asarray(values, dtype), shape)
            dataset = file["particles/all"].create_dataset(name, data=values)
        elif contents.dynamic:
            group = _element(file, "particles/all", name)
            take, compress = attrgetter(field), contents.compress
            series.append(grow(group, "value", shape, dtype, take, per_particle=True, compress=compress))
            dataset = series[-1].dataset
        else:
            continue
        dataset.attrs["unit"] = unit
    return series


def _create_species(file: h5py.File, contents: Contents) -> None:
    import h5py

    group = file.create_group("beltsim/species")
    blank = [""] * len(contents.species)
    for key, texts in (("name", contents.species), ("shape", contents.shapes), ("color", contents.colors)):
        group.create_dataset(key, data=list(texts or blank), dtype=h5py.string_dtype())


def _create_bonds(file: h5py.File, contents: Contents) -> list[Series]:
    if not contents.n_bonds:
        return []
    slots = np.asarray(contents.bonds, "i8")
    rows = slots if contents.dynamic else file["particles/all/id"][()][slots]
    connectivity = file.create_dataset("connectivity/bonds", data=rows)
    connectivity.attrs["particles_group"] = file["particles/all"].ref
    group = file.create_group("beltsim/bonds")
    written = [name for name in BONDS if name == "broken" or name in contents.arrays]
    return [_bond_series(group, contents, name) for name in written]


def _bond_series(group: h5py.Group, contents: Contents, name: str) -> Series:
    dtype = "u1" if name == "broken" else _float(contents)

    def take(frame: Frame):
        return frame.bonds.get(name)

    series = grow(group, name, (contents.n_bonds,), dtype, take, compress=contents.compress)
    series.dataset.attrs["unit"] = BONDS[name]
    return series


def _create_parts(file: h5py.File, contents: Contents) -> list[Series]:
    """All parts in one array per quantity, and a view of it for each part.

    An array for each part and quantity cost 76 ms a frame with 60 parts; this costs as much as with none.
    """
    file.create_group("parts")
    if not contents.parts:
        return []
    group = file.create_group("beltsim/parts")
    series = [_part_series(group, contents, quantity) for quantity in PARTS]
    for p, part in enumerate(contents.parts):
        _describe(file.create_group(f"parts/{escaped(part.name)}"), part, p)
        for quantity, one in zip(PARTS, series):
            _create_part_view(file, part.name, quantity, one.dataset, p)
    return series


def _part_series(group: h5py.Group, contents: Contents, quantity: str) -> Series:
    columns, unit = PARTS[quantity]
    names = [part.name for part in contents.parts]

    def take(frame: Frame):
        rows = [frame.parts.get(name, {}).get(quantity) for name in names]
        for name, row in zip(names, rows):
            check_shape(f"part {name}: {quantity}", row, columns)
        return np.array(rows)

    series = grow(group, quantity, (len(names), *columns), "f8", take)
    series.dataset.attrs["unit"] = unit
    return series


def _create_part_view(file: h5py.File, part: str, quantity: str, source: h5py.Dataset, p: int) -> None:
    """View of (T, P, columns) as (T, columns) that grows with it."""
    import h5py

    (columns,), unit = PARTS[quantity]
    layout = h5py.VirtualLayout((1, columns), dtype=source.dtype, maxshape=(None, columns))
    every = slice(0, h5py.h5s.UNLIMITED)
    view = h5py.VirtualSource(".", source.name, (1, *source.shape[1:]), maxshape=source.maxshape)
    layout[every, :] = view[every, p, :]
    element = _element(file, f"parts/{escaped(part)}", quantity)
    element.create_virtual_dataset("value", layout).attrs["unit"] = unit


def _describe(group: h5py.Group, part: PartDescription, p: int) -> None:
    group.attrs["row"] = p
    group.attrs["shape"] = part.shape
    group.attrs["class"] = part.part_class
    group.attrs["color"] = part.color
    sizes = group.create_group("sizes")
    for name, size in part.sizes.items():
        sizes.attrs[name] = float(size)
    if part.faces is not None:
        group.create_dataset("vertices", data=part.vertices, dtype="f8").attrs["unit"] = "m"
        group.create_dataset("faces", data=part.faces, dtype="i8")


def _create_observables(file: h5py.File, contents: Contents) -> list[Series]:
    file.create_group("observables")
    return [_observable_series(file, *observable) for observable in contents.observables]


def _observable_series(file: h5py.File, name: str, unit: str, columns: int) -> Series:
    def take(frame: Frame):
        return frame.observables.get(name)

    shape = () if columns == 1 else (columns,)
    series = grow(_element(file, "observables", escaped(name)), "value", shape, "f8", take)
    series.dataset.attrs["unit"] = unit
    return series


def _element(file: h5py.File, parent: str, name: str) -> h5py.Group:
    """A new H5MD element whose step and time are the position's own."""
    group = file.create_group(f"{parent}/{name}")
    for key in ("step", "time"):
        group[key] = file["particles/all/position"][key]
    return group


def _float(contents: Contents) -> str:
    return "f8" if contents.double else "f4"
