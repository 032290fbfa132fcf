"""Small decks made in Python, started and stepped without files: the scenes of the physics tests."""

from __future__ import annotations

import numpy as np

from beltsim import inp
from beltsim.engine import State, advance_by, begin_stage, state_of
from beltsim.run import prepare
from beltsim.scene import build

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
ALONG_Y = (np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0)  # turns local z to world y
ALONG_X = (np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0)  # turns local z to world x
GLASS = {"density": 2800.0, "youngs_modulus": 4.8e10, "poisson_ratio": 0.2}
SOFT = {"density": 1200.0, "youngs_modulus": 5.0e6, "poisson_ratio": 0.3}


def case(
    *,
    time_step,
    gravity=(0.0, 0.0, 0.0),
    materials=None,
    duration=1.0,
    friction=0.0,
    restitution=1.0,
    rolling=0.0,
    **contact,
) -> inp.Deck:
    """A deck with one step, materials by name (one called "stuff" if None), and one contact property for all."""
    deck = inp.Deck()
    deck.add("FORMAT", name="BELTSIM", version=1)
    for name, properties in (materials or {"stuff": SOFT}).items():
        deck.add("MATERIAL", name=name, **properties)
    deck.add(
        "CONTACT PROPERTY",
        material_a="*",
        material_b="*",
        friction=friction,
        restitution=restitution,
        rolling_friction=rolling,
        **contact,
    )
    deck.add("GRAVITY", rows={"acceleration": [gravity]})
    deck.add("STEP", duration=duration, time_step=time_step)
    return deck


def add_particles(deck, type_name, positions, *, orientation=UPRIGHT, velocity=None, spin=None) -> np.ndarray:
    """Particles of a type at (n, 3) positions, with velocities and spins for each or for all; returns their ids."""
    positions = np.atleast_2d(np.asarray(positions, dtype=np.float64))
    n = len(positions)
    ids = 1 + sum(len(block) for block in deck.blocks("PARTICLE")) + np.arange(n)
    rows = {"id": ids, "position": positions, "orientation": np.broadcast_to(orientation, (n, 4))}
    deck.add("PARTICLE", type=type_name, rows=rows)
    if velocity is not None or spin is not None:
        both = [np.broadcast_to((0.0,) * 3 if v is None else v, (n, 3)) for v in (velocity, spin)]
        deck.add("INITIAL VELOCITY", rows={"id": ids, "velocity": both[0], "angular_velocity": both[1]})
    return ids


def add_spheres(deck, positions, *, radius, name="ball", material="stuff", fixed="NO", group=None, **state):
    """Spheres of a new type; returns their ids."""
    deck.add(
        "PARTICLE TYPE",
        name=name,
        shape="SPHERE",
        radius=radius,
        material=material,
        fixed=fixed,
        contact_group=group,
    )
    return add_particles(deck, name, positions, **state)


def add_boxes(
    deck, positions, *, size, edge_radius, name="box", material="stuff", fixed="NO", group=None, **state
):
    """Rounded boxes of a new type; `group` is made if it is new. Returns their ids."""
    if group is not None and group not in [block["NAME"] for block in deck.blocks("CONTACT GROUP")]:
        deck.add("CONTACT GROUP", name=group)
    deck.add(
        "PARTICLE TYPE",
        name=name,
        shape="ROUNDED BOX",
        size_x=size[0],
        size_y=size[1],
        size_z=size[2],
        edge_radius=edge_radius,
        material=material,
        fixed=fixed,
        contact_group=group,
    )
    return add_particles(deck, name, positions, **state)


def add_plane(
    deck, *, name="floor", point=(0.0, 0.0, 0.0), orientation=UPRIGHT, material="stuff", group=None
):
    """A plane, solid below its local z."""
    rows = {"position": [point], "orientation": [orientation]}
    deck.add("PART", name=name, shape="PLANE", material=material, contact_group=group, rows=rows)


def add_cylinder(
    deck,
    *,
    name="roller",
    diameter,
    length,
    edge_radius=0.0,
    point=(0.0, 0.0, 0.0),
    orientation=ALONG_Y,
    material="stuff",
    group=None,
):
    """A cylinder, its axis along y unless told."""
    deck.add(
        "PART",
        name=name,
        shape="CYLINDER",
        diameter=diameter,
        length=length,
        edge_radius=edge_radius,
        material=material,
        contact_group=group,
        rows={"position": [point], "orientation": [orientation]},
    )


def add_grid(deck, rows, columns, *, pitch=0.02, fixed="YES", material="stuff", young=1e6):
    """A flat belt of bonded boxes, held unless told, in the plane z = 0; their flats meet at the seams.

    Rows run along x from the origin. Returns the ids (rows, columns).
    """
    places = np.array([(pitch * i, pitch * j, 0.0) for i in range(rows) for j in range(columns)])
    edge = 0.004
    ids = add_boxes(
        deck,
        places,
        size=(pitch + 2 * edge, pitch + 2 * edge, 0.01),
        edge_radius=edge,
        group="belt",
        material=material,
        fixed=fixed,
    )
    deck.add(
        "BOND TYPE",
        name="rubber",
        section_width=pitch,
        section_thickness=0.01,
        youngs_modulus=young,
        poisson_ratio=0.3,
    )
    at = ids.reshape(rows, columns)
    pairs = np.vstack(
        [
            np.stack([at[:-1].ravel(), at[1:].ravel()], axis=1),
            np.stack([at[:, :-1].ravel(), at[:, 1:].ravel()], axis=1),
        ]
    )
    rest = dict(zip(ids.tolist(), places))
    upright = np.tile(UPRIGHT, (len(pairs), 1))
    deck.add(
        "BOND",
        type="rubber",
        rows={
            "particles": pairs,
            "position_1": [rest[a] for a, _ in pairs.tolist()],
            "orientation_1": upright,
            "position_2": [rest[b] for _, b in pairs.tolist()],
            "orientation_2": upright,
        },
    )
    return at


def add_mesh(
    deck, path, vertices, triangles, *, name="chute", material="stuff", group=None, point=None, **given
):
    """A mesh part, its triangles written to `path`; with a `point` (and `orientation`) its row says where it is."""
    import trimesh

    trimesh.Trimesh(np.asarray(vertices, float), triangles, process=False).export(path)
    rows = None
    if point is not None:
        rows = {"position": [point], "orientation": [given.pop("orientation", UPRIGHT)]}
    deck.add(
        "PART",
        name=name,
        shape="MESH",
        input=str(path),
        material=material,
        contact_group=group,
        rows=rows or {},
        **given,
    )


def tilted(angle: float) -> tuple:
    """Orientation of a plane that falls towards +x by `angle` [rad]."""
    return (np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0)


def start(deck, *, allow_unstable=True) -> State:
    """The state of a deck at the beginning of its first step, with forces."""
    inp.check_case(deck)
    state = state_of(build(deck))
    begin_stage(state, prepare(state, state.scene.steps[0], 0.0, lambda _: None, allow_unstable))
    return state


def next_step(state, number: int) -> None:
    """Begin step `number` of the deck (from 0) where the state is now."""
    begin_stage(state, prepare(state, state.scene.steps[number], state.time, lambda _: None, True))


def advance(state, steps: int, *, every: int = 1, probe=None) -> np.ndarray | None:
    """Make `steps` steps; with a `probe`, an array of what it returns for the state every so many steps."""
    if probe is None:
        advance_by(state, steps)
        return None
    seen = []
    for _ in range(steps // every):
        advance_by(state, every)
        seen.append(probe(state))
    return np.array(seen)


def particles(state):
    """The particle arrays of a state, as they are now."""
    return state.scene.population.particles


def slot(state, particle_id: int) -> int:
    """Slot of a particle id."""
    return int(np.flatnonzero(state.scene.population.id == particle_id)[0])


def momenta(state) -> tuple[np.ndarray, np.ndarray]:
    """Momentum [kg m/s] and angular momentum about the origin [kg m2/s] of all particles."""
    p = particles(state)
    linear = p.mass * p.velocity
    return linear.sum(axis=1), (np.cross(p.position.T, linear.T).T + p.angular_momentum).sum(axis=1)


def kinetic_energy(state) -> float:
    """Energy of motion and rotation [J]."""
    p = particles(state)
    return 0.5 * float(np.sum(p.mass * p.velocity**2) + np.sum(p.angular_velocity * p.angular_momentum))
