"""Spheres on planes and on one another: decks, and impacts from touch to rebound."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from beltsim.engine import advance_by
from beltsim.inp import Deck
from beltsim.solver.timestep import impact_duration
from beltsim.verify.stepping import start
from beltsim.verify.strips import case_deck, straight


@dataclass(frozen=True)
class Stuff:
    """A material."""

    young: float  # Pa
    poisson: float
    density: float  # kg/m3

    @property
    def plane_modulus(self) -> float:
        """E / (1 - nu^2) [Pa]: the contact modulus against something rigid."""
        return self.young / (1.0 - self.poisson**2)


RIGID = Stuff(1e30, 0.3, 1000.0)


def contact_deck(
    *, time_step="AUTO", friction=0.0, restitution=1.0, gravity=None, rolling=0.0, **materials: Stuff
) -> Deck:
    """A deck with materials by name and one contact property for all of them."""
    deck = case_deck(time_step=time_step, gravity=gravity)
    for name, stuff in materials.items():
        deck.add(
            "MATERIAL",
            name=name,
            density=stuff.density,
            youngs_modulus=stuff.young,
            poisson_ratio=stuff.poisson,
        )
    deck.add(
        "CONTACT PROPERTY",
        material_a="*",
        material_b="*",
        friction=friction,
        restitution=restitution,
        rolling_friction=rolling,
    )
    return deck


def add_spheres(deck: Deck, name: str, material: str, radius: float, position, **more) -> None:
    """Spheres of a type at places (n, 3)."""
    deck.add("PARTICLE TYPE", name=name, shape="SPHERE", radius=radius, material=material, **more)
    position = np.atleast_2d(np.asarray(position, float))
    first = 1 + sum(len(block) for block in deck.blocks("PARTICLE"))
    rows = {
        "id": first + np.arange(len(position)),
        "position": position,
        "orientation": straight(len(position)),
    }
    deck.add("PARTICLE", type=name, rows=rows)


def add_floor(deck: Deck, material: str) -> None:
    """The plane z = 0, solid below."""
    rows = {"position": [[0.0, 0.0, 0.0]], "orientation": [[1.0, 0.0, 0.0, 0.0]]}
    deck.add("PART", name="floor", shape="PLANE", material=material, rows=rows)


def add_mesh(deck: Deck, path: Path, vertices, triangles, name: str, material: str) -> None:
    """A part of triangles (t, 3) between vertices (v, 3) [m], written to `path` (.obj)."""
    lines = ["v {:.17g} {:.17g} {:.17g}".format(*vertex) for vertex in vertices]
    lines += ["f {} {} {}".format(*(1 + np.asarray(triangle))) for triangle in triangles]
    path.write_text("\n".join(lines) + "\n")
    deck.add("PART", name=name, shape="MESH", input=str(path), material=material, rows={})


@dataclass(frozen=True)
class Rebound:
    """What came out of impacts; row k is impact k."""

    velocity: np.ndarray  # (n, 3) m/s
    spin: np.ndarray  # (n, 3) rad/s
    overlap: np.ndarray  # (n,) m, the largest
    force: np.ndarray  # (n,) N, the largest normal force
    duration: np.ndarray  # (n,) s


def impacts(
    stuff: Stuff, radius: float, velocity, *, spin=None, friction=0.0, restitution=1.0, steps=1000
) -> Rebound:
    """Spheres that begin to touch a rigid plane, each for itself, until all have left it.

    `velocity` (n, 3) points down; `steps` are those of the shortest impact.
    """
    velocity = np.atleast_2d(np.asarray(velocity, float))
    count = len(velocity)
    mass = 4.0 / 3.0 * np.pi * radius**3 * stuff.density
    fastest, slowest = np.max(-velocity[:, 2]), np.min(-velocity[:, 2])
    time_step = impact_duration(radius, stuff.plane_modulus, mass, fastest) / steps
    deck = contact_deck(
        time_step=time_step, friction=friction, restitution=restitution, ball=stuff, wall=RIGID
    )
    place = np.column_stack([5.0 * radius * np.arange(count), np.zeros(count), np.full(count, radius)])
    add_spheres(deck, "ball", "ball", radius, place)
    add_floor(deck, "wall")
    state = start(
        deck, velocity=velocity, spin=np.zeros((count, 3)) if spin is None else spin, allow_unstable=True
    )
    particles = state.scene.population.particles
    overlap, force = np.zeros(count), np.zeros(count)
    longest = 2.0 * impact_duration(radius, stuff.plane_modulus, mass, slowest)
    while state.time < longest:
        advance_by(state, max(1, steps // 500))
        overlap = np.maximum(overlap, radius - particles.position[2])
        force = np.maximum(force, particles.force[2])
    out = particles.velocity.T.copy()
    # After the touch it flies straight on: its present height says when it left.
    left = state.time - (particles.position[2] - radius) / out[:, 2]
    return Rebound(out, particles.angular_velocity.T.copy(), overlap, force, left)
