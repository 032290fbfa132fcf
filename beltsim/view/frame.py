"""The scenery of one frame of a trajectory."""

from __future__ import annotations

import numpy as np

from beltsim.trajectory.layout import Contents, Frame

from .errors import NothingToDraw, ViewProblem
from .particles import Particles, layers, own_colours, solids, type_colours
from .parts import add_rolls_and_planes, part_colour, placed_mesh
from .scenery import Scenery
from .values import largest_of_bonds, legend_of, paint

COLOUR_BY = ("none", "type", "height", "speed", "elongation", "force")


def scenery_of_frame(
    trajectory,
    k: int = -1,
    colour_by: str = "none",
    *,
    hide: frozenset[str] = frozenset(),
    limits: tuple[float, float] | None = None,
) -> Scenery:
    """The picture of frame `k` (negative: from the end) of an open `beltsim.trajectory.Trajectory`.

    colour_by: "none" (own colours), "type" (each particle type), "height" (z in m), "speed" (m/s), "elongation"
    or "force" (that of a particle's bond with the largest, in % or N). hide: layers of `LAYERS`. limits: ends of
    the colour bar.
    """
    if not -len(trajectory) <= k < len(trajectory):
        raise ViewProblem(f"frame {k}: found {len(trajectory)} frames, expected 0 to {len(trajectory) - 1}")
    frame, contents = trajectory[k], trajectory.contents
    scenery = Scenery(caption=f"t = {frame.time:.3f} s")
    if frame.active:
        particles = particles_of(contents, frame)
        colour = _colours(contents, frame, particles, colour_by, limits, scenery)
        scenery.items = solids(particles, colour, hide)
    if "parts" not in hide:
        _add_parts(contents, frame, scenery)
    if not scenery.visible():
        raise NothingToDraw("nothing to draw: the frame holds no particle or part that is not hidden")
    return scenery


def particles_of(contents: Contents, frame: Frame) -> Particles:
    """The particles of a frame."""
    size = 2.0 * frame.half_extent
    bonded = np.zeros(frame.active, bool)
    if contents.bonds is not None:
        bonded[contents.bonds[contents.bonds < frame.active]] = True
    return Particles(
        id=frame.id,
        species=frame.species_of,
        names=contents.species,
        shapes=contents.shapes,
        classes=("",) * len(contents.species),
        colours=contents.colors,
        position=np.asarray(frame.position, float),
        orientation=None if frame.orientation is None else np.asarray(frame.orientation, float),
        size=size,
        edge_radius=frame.edge_radius,
        bonded=bonded,
    )


def _colours(contents, frame, particles, colour_by, limits, scenery) -> np.ndarray:
    if colour_by == "type":
        return type_colours(particles, np.ones(frame.active, bool))
    if colour_by == "none":
        return own_colours(particles)
    label, values, signed = VALUES[colour_by](contents, frame)
    values = np.where(layers(particles) == 2, np.nan, values)
    scenery.legend = legend_of(label, values, limits, signed=signed)
    return paint(own_colours(particles), values, scenery.legend)


def _height(_: Contents, frame: Frame):
    return "height, m", frame.position[:, 2].astype(float), False


def _speed(_: Contents, frame: Frame):
    if frame.velocity is None:
        raise ViewProblem("found no velocities, expected them: add VELOCITY to *OUTPUT, FIELDS=")
    return "speed, m/s", np.linalg.norm(frame.velocity, axis=1).astype(float), False


def _elongation(contents: Contents, frame: Frame):
    return "elongation, %", 100 * _of_bonds(contents, frame, "elongation", "BOND STRAIN"), True


def _force(contents: Contents, frame: Frame):
    return "bond force, N", _of_bonds(contents, frame, "axial_force", "BOND FORCE"), True


def _of_bonds(contents: Contents, frame: Frame, name: str, key: str) -> np.ndarray:
    if contents.bonds is None:
        raise ViewProblem(f"{name}: found no bonds, expected some")
    if frame.bonds.get(name) is None:
        raise ViewProblem(f"found no {name} of bonds, expected it: add {key} to *OUTPUT, FIELDS=")
    whole = np.asarray(frame.bonds["broken"]) == 0 if "broken" in frame.bonds else slice(None)
    return largest_of_bonds(frame.active, contents.bonds[whole], np.asarray(frame.bonds[name], float)[whole])


VALUES = {"height": _height, "speed": _speed, "elongation": _elongation, "force": _force}


def _add_parts(contents: Contents, frame: Frame, scenery: Scenery) -> None:
    rolls, planes = [], []
    for part in contents.parts:
        position, orientation = frame.parts[part.name]["position"], frame.parts[part.name]["orientation"]
        if part.shape == "CYLINDER":
            colour = part_colour(part.color, part.part_class)
            rolls.append((position, orientation, part.sizes["diameter"], part.sizes["length"], colour))
        elif part.faces is not None:
            colour = part_colour(part.color, part.part_class)
            scenery.items.append(placed_mesh(part.vertices, part.faces, position, orientation, colour))
        elif part.shape == "PLANE":
            planes.append((position, orientation))
    add_rolls_and_planes(scenery, rolls, planes)
