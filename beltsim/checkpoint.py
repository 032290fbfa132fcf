"""The whole state of a run as plain data, to take and to put back bit for bit.

A checkpoint holds everything that changes: particles, shapes, broken bonds, contact history and the order of the lists,
parts and their drives, the random state of sources, and all counts. What the deck says is not in it: a scene built from
the same deck takes a checkpoint back and goes on as if it had never been interrupted.
"""

from __future__ import annotations

import json
import os
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import numpy as np

from beltsim.console import CommandError
from beltsim.engine import State
from beltsim.lists import bonded_neighbours
from beltsim.solver.chunks import alike_chunks, notes_of
from beltsim.solver.state import aligned
from beltsim.source import Source

VERSION = 1


class CheckpointError(CommandError):
    """The file is no checkpoint, or not one of this scene."""


def take(state: State, sources: list[Source] = ()) -> dict:
    """A copy of everything that changes, as nested dicts of arrays, numbers and texts."""
    scene = state.scene
    population = scene.population
    return {
        "version": VERSION,
        "particles": tree_of(population.particles),
        "id": population.id.copy(),
        "species": population.species.copy(),
        "half_extent": population.half_extent.copy(),
        "edge_radius": population.edge_radius.copy(),
        "shapes": tree_of(scene.shapes),
        "intact": None if scene.bonds is None else scene.bonds.intact.copy(),
        "strength": tree_of(scene.strength),
        "parts": tree_of(scene.machinery.parts),
        "lists": tree_of(state.lists),
        "excluded": tree_of(state.excluded),
        "listed": state.notes.listed.copy(),
        "part_travel": state.part_travel.copy(),
        "part_work": state.part_work.copy(),
        "account": tree_of(state.account),
        "bond_book": None if scene.bonds is None else tree_of(scene.bonds.book),
        "stage": tree_of(state.stage),
        "counts": {name: getattr(state, name) for name in COUNTS},
        "sources": {source.name: tree_of(source) for source in sources},
    }


COUNTS = ("skin", "cap", "step", "total_steps", "list_builds", "listed_at")


def put_back(checkpoint: dict, state: State, sources: list[Source] = ()) -> None:
    """Bring a started state of the same deck to where the checkpoint was taken.

    Raises
    ------
    CheckpointError
        If it was taken of another scene.
    """
    scene = state.scene
    population = scene.population
    if checkpoint.get("version") != VERSION or (checkpoint["intact"] is None) != (scene.bonds is None):
        raise CheckpointError("the checkpoint is of another version or of another scene")
    population.particles = aligned(rebuilt(population.particles, checkpoint["particles"]))
    for name in ("id", "species", "half_extent", "edge_radius"):
        setattr(population, name, checkpoint[name].copy())
    scene.shapes = rebuilt(scene.shapes, checkpoint["shapes"])
    scene.machinery.parts = rebuilt(scene.machinery.parts, checkpoint["parts"])
    if scene.bonds is not None:
        if checkpoint["intact"].size != scene.bonds.intact.size:
            raise CheckpointError("the checkpoint is of another scene: it has other bonds")
        scene.bonds.intact[:] = checkpoint["intact"]
        if scene.bonds.whole is not None:
            bond = scene.runs.bond
            scene.bonds.whole[:] = (bond >= 0) & (scene.bonds.intact[bond] != 0)
        scene.bonding.strength = rebuilt(scene.strength, checkpoint["strength"])
        scene.bonding.bonds = scene.bonds._replace(book=rebuilt(scene.bonds.book, checkpoint["bond_book"]))
    state.lists = rebuilt(state.lists, checkpoint["lists"])
    state.excluded = rebuilt(state.excluded, checkpoint["excluded"])
    state.notes = notes_of(checkpoint["listed"].copy(), alike_chunks(population.particles))
    state.part_travel = checkpoint["part_travel"].copy()
    state.part_work = checkpoint["part_work"].copy()
    state.account = rebuilt(state.account, checkpoint["account"])
    state.stage = rebuilt(state.stage, checkpoint["stage"])
    for name, value in checkpoint["counts"].items():
        setattr(state, name, value)
    for source in sources:
        after = rebuilt(source, checkpoint["sources"][source.name])
        for field in fields(source):
            setattr(source, field.name, getattr(after, field.name))
    state.bonded = bonded_neighbours(population.count, scene.bonds)


def tree_of(value):
    """A value as nested dicts; arrays are copied, generators become their state."""
    if isinstance(value, np.ndarray):
        return value.copy()
    if isinstance(value, np.random.Generator):
        return value.bit_generator.state
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return {name: tree_of(item) for name, item in zip(value._fields, value)}
    if isinstance(value, tuple):
        return {str(n): tree_of(item) for n, item in enumerate(value)}
    if isinstance(value, dict):
        return {name: tree_of(item) for name, item in value.items()}
    if is_dataclass(value):
        return {field.name: tree_of(getattr(value, field.name)) for field in fields(value)}
    return value


def rebuilt(template, tree):
    """A value of the template's kind with the tree's content; the template is left as it is."""
    if tree is None or template is None:
        return None
    if isinstance(template, np.ndarray):
        return tree.copy()
    if isinstance(template, np.random.Generator):
        generator = np.random.default_rng()
        generator.bit_generator.state = tree
        return generator
    if isinstance(template, dict):
        return dict(tree)
    if isinstance(template, tuple) and hasattr(template, "_fields"):
        return type(template)(*(rebuilt(item, tree[name]) for name, item in zip(template._fields, template)))
    if isinstance(template, tuple):
        return tuple(rebuilt(item, tree[str(n)]) for n, item in enumerate(template))
    if is_dataclass(template):
        names = [field.name for field in fields(template)]
        return replace(template, **{name: rebuilt(getattr(template, name), tree[name]) for name in names})
    return tree


def save(checkpoint: dict, path: str | Path) -> None:
    """Write a checkpoint to an HDF5 file that appears whole or not at all."""
    import h5py

    path = Path(path)
    temporary = path.with_name(f".{path.name}.part")
    with h5py.File(temporary, "w") as file:
        write_tree(file, checkpoint)
    with temporary.open("rb+") as stream:
        os.fsync(stream.fileno())
    temporary.replace(path)


def write_tree(group, tree: dict) -> None:
    """Nested dicts as HDF5 groups: arrays as datasets, all else as JSON attributes.

    JSON of the standard library: it holds the 128-bit integers of a random state, and floats come back bit for bit.
    """
    for name, value in tree.items():
        if isinstance(value, np.ndarray):
            group.create_dataset(name, data=value)
        elif isinstance(value, dict) and "bit_generator" not in value:
            write_tree(group.create_group(name), value)
        else:
            group.attrs[name] = json.dumps(value)


def load(path: str | Path) -> dict:
    """Read a checkpoint that `save` wrote."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return read_tree(file)
    except OSError as error:
        raise CheckpointError(f"{path}: found no checkpoint ({error}), expected an HDF5 file") from None


def read_tree(group) -> dict:
    """The inverse of `write_tree`."""
    import h5py

    tree = {
        name: read_tree(item) if isinstance(item, h5py.Group) else item[()] for name, item in group.items()
    }
    return tree | {name: json.loads(value) for name, value in group.attrs.items()}
