"""Small scenes with every kind of content, for the tests of the trajectory."""

import numpy as np

from beltsim.trajectory import Contents, Frame, PartDescription, TrajectoryWriter

SLOTS, BELT = 12, 6

SCENES = {
    "static": {},
    "double": {"double": True},
    "compressed": {"compress": True},
    "dynamic": {"dynamic": True},
    "dynamic, several types": {"dynamic": True, "several_types": True, "compress": True},
}


def make_contents(
    *, dynamic=False, several_types=False, double=False, compress=False, slots=SLOTS, belt=BELT
):
    """A belt strip of `belt` bonded particles, two parts, two observables, and slots for bulk."""
    properties = {
        "species_of": (np.arange(slots) >= belt).astype("i4"),
        "mass": np.linspace(1.0, 2.0, slots),
        "radius": np.linspace(0.1, 0.2, slots),
        "half_extent": np.linspace(0.1, 0.4, 3 * slots).reshape(slots, 3),
        "edge_radius": np.linspace(0.0, 0.01, slots),
    }
    return Contents(
        slots=slots,
        species=("fibre_001", "coal"),
        shapes=("ROUNDED BOX", "SPHERE"),
        colors=("#202020", ""),
        dynamic=dynamic,
        id=None if dynamic else 100 + np.arange(slots),
        **({} if several_types else properties),
        bonds=np.stack([np.arange(belt - 1), np.arange(1, belt)], axis=1),
        parts=(
            PartDescription("head/1", "CYLINDER", "PULLEY", {"diameter": 0.4, "length": 0.8}, "#cc3333"),
            PartDescription("floor", "PLANE"),
        ),
        fields=frozenset({"VELOCITY", "ORIENTATION", "FORCE", "BOND FORCE", "BOND MOMENT", "BOND STRAIN"}),
        observables=(("energy", "J", 1), ("momentum", "kg m s-1", 3)),
        double=double,
        compress=compress,
    )


def make_frame(contents, t, active=None):
    """Frame t: random numbers of seed t."""
    random = np.random.default_rng(t)
    n, bonds = active or contents.slots, contents.n_bonds
    frame = Frame(
        step=100 * t,
        time=0.02 * t,
        position=random.normal(size=(n, 3)),
        velocity=random.normal(size=(n, 3)),
        orientation=random.normal(size=(n, 4)),
        force=random.normal(size=(n, 3)),
        bonds={
            "axial_force": random.normal(size=bonds),
            "shear_force": random.random(bonds),
            "bending_moment": random.random(bonds),
            "twist_moment": random.normal(size=bonds),
            "elongation": random.normal(size=bonds),
            "bending": random.random(bonds),
            "broken": np.arange(bonds) < t,
        },
        parts={
            part.name: {
                "position": random.normal(size=3),
                "orientation": random.normal(size=4),
                "angular_velocity": random.normal(size=3),
                "force": random.normal(size=3),
                "torque": random.normal(size=3),
            }
            for part in contents.parts
        },
        observables={"energy": random.random(), "momentum": random.normal(size=3)},
    )
    if contents.dynamic:
        frame.id = (
            np.concatenate([np.arange(BELT), 50 + t + np.arange(n - BELT)]) if n > BELT else np.arange(n)
        )
    if contents.mass is None:
        frame.species_of = random.integers(0, 2, n)
        frame.mass, frame.radius, frame.edge_radius = random.random((3, n))
        frame.half_extent = random.random((n, 3))
    return frame


def make_frames(contents):
    """Five frames; in a dynamic scene the number of particles rises to all slots and falls to the belt's."""
    counts = [BELT, BELT + 3, SLOTS, BELT + 1, BELT] if contents.dynamic else [None] * 5
    return [make_frame(contents, t, active) for t, active in enumerate(counts)]


def write(folder, contents, frames, name="run.h5"):
    """Write a trajectory and return its path."""
    path = folder / name
    with TrajectoryWriter(path, contents, planned_frames=max(1, len(frames))) as writer:
        for frame in frames:
            writer.append(frame)
    return path
