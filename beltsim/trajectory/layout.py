"""What a trajectory holds, as plain data: what stays the same, one frame, tables of names and units.

The HDF5 paths stand beside every field; docs/trajectory.md shows the whole tree.
T frames, N particle slots, n active particles of one frame, B bonds. Units are SI, vectors are in world axes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from beltsim.console import CommandError

LAYOUT_VERSION = 1
"""Attribute `layout` of /beltsim; a reader refuses any other."""

PARTICLES = {
    "position": ((3,), "m"),
    "velocity": ((3,), "m s-1"),
    "orientation": ((4,), "1"),
    "angular_velocity": ((3,), "rad s-1"),
    "force": ((3,), "N"),
    "torque": ((3,), "N m"),
}
"""Columns and unit of /particles/all/<name>/value, (T, N, columns) float32 or float64."""

PROPERTIES = {
    "species": ((), "1", "i4"),
    "mass": ((), "kg", "f8"),
    "radius": ((), "m", "f8"),
    "half_extent": ((3,), "m", "f8"),
    "edge_radius": ((), "m", "f8"),
}
"""Per particle: columns, unit and type of /particles/all/<name>, (N, ...), or of its value, (T, N, ...)."""

BONDS = {
    "axial_force": "N",
    "shear_force": "N",
    "bending_moment": "N m",
    "twist_moment": "N m",
    "elongation": "1",
    "bending": "rad",
    "broken": "1",
}
"""Unit of /beltsim/bonds/<name>, (T, B): `broken` is uint8, the rest float32 or float64.

`shear_force` and `bending_moment` are magnitudes, `elongation` is relative to the stress-free length,
`bending` an angle. A broken bond keeps its row.
"""

PARTS = {
    "position": ((3,), "m"),
    "orientation": ((4,), "1"),
    "angular_velocity": ((3,), "rad s-1"),
    "force": ((3,), "N"),
    "torque": ((3,), "N m"),
}
"""Columns and unit of /parts/<name>/<quantity>/value, (T, columns) float64.

They are views of /beltsim/parts/<quantity>, (T, P, columns), with the parts in the order of the contents.
"""

FIELDS = {
    "VELOCITY": ("velocity",),
    "ORIENTATION": ("orientation",),
    "ANGULAR VELOCITY": ("angular_velocity",),
    "FORCE": ("force",),
    "TORQUE": ("torque",),
    "BOND FORCE": ("axial_force", "shear_force"),
    "BOND MOMENT": ("bending_moment", "twist_moment"),
    "BOND STRAIN": ("elongation", "bending"),
}
"""`*OUTPUT, FIELDS` to the arrays that it writes; position, and `broken` of bonds, are always written."""


class TrajectoryError(CommandError):
    """The file is no trajectory that this version reads, or a frame does not fit its contents."""


@dataclass(frozen=True)
class PartDescription:
    """What stays the same about a part: /parts/<name>, "/" written %2F."""

    name: str
    shape: str
    part_class: str = ""
    sizes: dict[str, float] = field(default_factory=dict)
    color: str = ""
    vertices: np.ndarray | None = field(default=None, compare=False)
    """(v, 3) float64 [m] of a mesh, in the part's frame; /parts/<name>/vertices."""
    faces: np.ndarray | None = field(default=None, compare=False)
    """(f, 3) int64 rows of the vertices; /parts/<name>/faces."""


@dataclass(frozen=True)
class Contents:
    """What stays the same over a run.

    In a dynamic scene `id` is None, each frame brings its own. The five properties are arrays where a slot
    keeps its particle type for the whole run, None where each frame brings them (several types can appear).
    """

    slots: int
    """Particle slots N: belt and fixed particles first, then slots for all that can appear."""
    species: tuple[str, ...]
    """Names of the particle types, index = species number; /beltsim/species/name."""
    dynamic: bool = False
    """Particles come and go: the first n slots of a frame are active; /beltsim/active holds n, (T,) int64."""
    id: np.ndarray | None = None
    """(N,) int64, /particles/all/id; in a dynamic scene id/value, (T, N), -1 in empty slots."""
    species_of: np.ndarray | None = None
    """(N,) int32, /particles/all/species."""
    mass: np.ndarray | None = None
    """(N,) float64 [kg]."""
    radius: np.ndarray | None = None
    """(N,) float64 [m]."""
    half_extent: np.ndarray | None = None
    """(N, 3) float64 [m], along the local axes."""
    edge_radius: np.ndarray | None = None
    """(N,) float64 [m]."""
    bonds: np.ndarray | None = None
    """(B, 2) int64, 0-based slots; /connectivity/bonds holds ids, in a dynamic scene slots."""
    parts: tuple[PartDescription, ...] = ()
    fields: frozenset[str] = frozenset()
    """Keys of `FIELDS` that every frame brings."""
    observables: tuple[tuple[str, str, int], ...] = ()
    """(name, unit, columns) of /observables/<name>/value, float64 (T,) for 1 column, else (T, columns).

    Read back in the order of their names.
    """
    shapes: tuple[str, ...] = ()
    """Shape of each species (SPHERE, ROUNDED BOX, CYLINDER), for who draws them; /beltsim/species/shape."""
    colors: tuple[str, ...] = ()
    """Colour of each species, "" for none; /beltsim/species/color."""
    double: bool = False
    """Positions and the other per-particle and per-bond fields in float64, not float32."""
    compress: bool = False
    """gzip 1 with shuffle: measured 17 % smaller and four times slower to write."""

    @property
    def n_bonds(self) -> int:
        """Number of bonds B."""
        return 0 if self.bonds is None else len(self.bonds)

    @property
    def arrays(self) -> frozenset[str]:
        """Names of the particle and bond arrays that the chosen fields write."""
        return frozenset(name for key in self.fields for name in FIELDS[key])


@dataclass
class Frame:
    """One moment: the n active particles, the bonds, the parts, the observables; None is not written."""

    step: int
    time: float
    position: np.ndarray
    """(n, 3) [m]."""
    velocity: np.ndarray | None = None
    """(n, 3) [m/s]."""
    orientation: np.ndarray | None = None
    """(n, 4) quaternion w, x, y, z, local to world."""
    angular_velocity: np.ndarray | None = None
    """(n, 3) [rad/s]."""
    force: np.ndarray | None = None
    """(n, 3) [N]."""
    torque: np.ndarray | None = None
    """(n, 3) [N m]."""
    id: np.ndarray | None = None
    """(n,) int64; written in dynamic scenes."""
    species_of: np.ndarray | None = None
    """(n,) int32; this and the four below are written where they are None in the contents."""
    mass: np.ndarray | None = None
    radius: np.ndarray | None = None
    half_extent: np.ndarray | None = None
    edge_radius: np.ndarray | None = None
    bonds: dict[str, np.ndarray] = field(default_factory=dict)
    """Name of `BONDS` to (B,)."""
    parts: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    """Part name to the quantities of `PARTS`, each (3,) or (4,)."""
    observables: dict[str, float | np.ndarray] = field(default_factory=dict)

    @property
    def active(self) -> int:
        """Number of particles n in this frame."""
        return len(self.position)


def property_field(name: str) -> str:
    """The field of `Contents` and `Frame` that holds a property: `species_of` for "species"."""
    return "species_of" if name == "species" else name


def empty_value(dtype: str) -> float | int:
    """What an empty slot holds, and cell data of a vertex: NaN, -1, or 0 if unsigned."""
    return {"f": np.nan, "i": -1, "u": 0}[np.dtype(dtype).kind]


def escaped(name: str) -> str:
    """A name as one HDF5 path component: "%", "/" and a lone "." become %25, %2F and %2E."""
    return "%2E" if name == "." else name.replace("%", "%25").replace("/", "%2F")
