"""The arrays that kernels take, as flat NamedTuples. The one page about their layout.

Vectors are stored by component: (3, n) and (4, n), C order, so that each component is contiguous.
A NamedTuple never changes; the arrays in it do. Kernels unpack what they use on their first lines and name only locals
in their loops: unpacked is fastest.
Tuples stay at ten fields or below, numba's quick path.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

Array = np.ndarray

CACHE_LINE = 64


class Particles(NamedTuple):
    """State of all particles; row k is particle k."""

    position: Array  # (3, n) m
    velocity: Array  # (3, n) m/s
    orientation: Array  # (4, n) w, x, y, z
    angular_momentum: Array  # (3, n) kg m2/s, world axes
    angular_velocity: Array  # (3, n) rad/s, world axes
    force: Array  # (3, n) N
    torque: Array  # (3, n) N m
    mass: Array  # (n,) kg
    inertia: Array  # (3, n) kg m2, principal, local axes
    mobility: Array  # (2, n) 1 or 0: moves under force, turns under torque


def aligned(particles: Particles) -> Particles:
    """The same state, each array from the beginning of a cache line on.

    numpy begins arrays anywhere, and vectors that lie across two lines cost 8 % of S1 and 3 % of S2 and S3.
    """
    return Particles(*map(at_line, particles))


def at_line(array: Array) -> Array:
    """An array itself if it begins with a cache line, else a copy that does."""
    if array.ctypes.data % CACHE_LINE == 0:
        return array
    room = np.empty(array.nbytes + CACHE_LINE, np.uint8)
    begin = -room.ctypes.data % CACHE_LINE
    copy = room[begin : begin + array.nbytes].view(array.dtype).reshape(array.shape)
    copy[...] = array
    return copy


class ChunkNotes(NamedTuple):
    """What steps know about the chunks of particles (`chunks`) besides their state."""

    listed: Array  # (3, n) m, positions when the lists were made
    calm: Array  # (c,) int64 steps for which no particle can be too far from there
    alike: Array  # (c,) int64 the first chunk whose particles have the same masses, moments of inertia and mobilities


class Shapes(NamedTuple):
    """What particles look like to contacts."""

    core: Array  # (3, n) half extents without the edge radius, m; 0 for spheres
    radius: Array  # (n,) radius of a sphere, edge radius of a rounded box, m
    bounding: Array  # (n,) radius of the bounding sphere, m
    material: Array  # (n,) int32, row of the contact laws
    group: Array  # (n,) int32, row of `may_touch`
    may_touch: Array  # (groups, groups) bool


class Bonds(NamedTuple):
    """Bonds between particles, in the order of their slots; row b is bond b."""

    first: Array  # (m,) int32
    second: Array  # (m,) int32
    kind: Array  # (m,) int32, row of BondKinds
    intact: Array  # (m,) int8, 1 until it breaks
    wound: Array  # (1,) int64, how many bonds are turned almost all the way round
    whole: Array | None = (
        None  # (slots,) int8, 0: a gap or broken; None: no run has a gap and no bond can break
    )
    book: Array | None = None  # (rows, slots) of `ledger`, if an energy book is kept


class Runs(NamedTuple):
    """Pieces of runs, up to a tile of slots each: bonds of one kind between consecutive particles; row r is piece r."""

    first: Array  # (r,) int64 particle of the first bond, -1: the bonds are scattered, take `Bonds.first`
    second: Array  # (r,) int64
    base: Array  # (r,) int64 first slot
    count: Array  # (r,) int64 slots
    kind: Array  # (r,) int32
    bond: Array  # (slots,) int32, -1: a gap
    chunk: Array  # (c + 1,) int64: chunk c loads chunks c and c + 1 by pieces chunk[c]:chunk[c + 1], the rest load any


class BondKinds(NamedTuple):
    """Bonds that share their stress-free state and properties share one row: grids have a handful."""

    rest_length: Array  # (k,) m
    triad_first: Array  # (4, k) bond triad in the first particle's local frame
    triad_second: Array  # (4, k)
    stiffness: Array  # (3, k) axial, shear along the width, along the thickness, N/m
    angular_stiffness: Array  # (3, k) twist, bending about the width, about the thickness, N m
    damping: Array  # (3, k) N s/m
    angular_damping: Array  # (3, k) N m s
    # (12, k) shear stiffness, 0 along the bond, and the last three about the particles' own axes, where all triads lie
    # along those and no bond can break
    upright: Array | None = None


class BondStrength(NamedTuple):
    """Only for scenes with breakable bonds."""

    section: Array  # (4, k) area, section moduli about width, about thickness, torsion
    strength: Array  # (2, k) tensile, shear, Pa; inf where not given
    broken_step: Array  # (m,) int64, -1 while intact
    mode: Array  # (m,) int8, 1 tension, 2 shear


class Contacts(NamedTuple):
    """A list of pairs that may touch before the list is rebuilt, with their history."""

    start: Array  # (rows + 1,) int64: pairs of row r are start[r]:start[r + 1]
    first: Array  # (p,) int32 particle
    second: Array  # (p,) int32 particle or part
    spring: Array  # (3, p) tangential spring force, N
    stiffness: Array  # (p,) tangential stiffness of the step before, N/m; 0: not touching
    rolling: Array | None  # (3, p) moment of the rolling spring, N m; None: no material has rolling friction
    loads: Array | None  # (9, p) as Bonds.loads; None: nobody sums them afterwards
    overlap: Array | None  # (p,) m, of the last step; None: nobody asks the pass for it
    beside: (
        Array | None
    )  # (4, p) int32 pair of the sphere with a neighbour of the box, -1: none; see `wall_pass`
    carriers: Array | None  # (p,) uint32, where the pass over spheres on boxes puts down which pairs carry
    book: Array | None = None  # (rows, p) of `ledger`, if an energy book is kept


class Crossings(NamedTuple):
    """Particles in chunks, one thread's work each, and the loads of pairs whose partners belong to different chunks.

    Chunks depend on the particles only, and every sum has its order, so results do not depend on threads.
    """

    start: Array  # (2, c + 1) int64: of permanent and of free particles chunk c owns start[kind, c]:start[kind, c + 1]
    piece: Array  # (c + 1,) int64: the pairs of chunk c are pieces piece[c]:piece[c + 1]
    owner: Array  # (pieces,) int64 the chunk of each piece
    pair: Array  # (2, pieces) int64 first pair of each piece, and the one after its last
    stop: Array  # (pieces,) int64 the slot after the last particle of each piece, which is a second one
    place: Array  # (c + 1,) int64: loads that come from chunk c are written to rows place[c]... of `loads`
    count: Array  # (c,) int64, how many there are in this step
    loads: Array  # (q, 6) force [N] and torque [N m] on a second particle that belongs to another chunk
    loaded: Array  # (q,) int32 those particles


class Laws(NamedTuple):
    """Hertz-Mindlin parameters of material pairs, (materials, materials) each."""

    normal_modulus: Array  # E*, Pa
    shear_modulus: Array  # G*, Pa
    damping: Array  # ratio b of the linear spring
    friction: Array
    rolling_friction: Array
    rolling_damping: Array  # ratio of the rocking


class LinearLaws(NamedTuple):
    """The same for the linear spring-dashpot model."""

    normal_stiffness: Array  # N/m
    tangential_stiffness: Array  # N/m
    damping: Array  # ratio b of the linear spring
    friction: Array
    rolling_friction: Array
    rolling_damping: Array  # ratio of the rocking


class Parts(NamedTuple):
    """Cylinders, planes and meshes that carry or drive; row p is part p."""

    position: Array  # (3, p) m
    orientation: Array  # (4, p), local z: axis of a cylinder, outward normal of a plane
    velocity: Array  # (3, p) m/s
    angular_velocity: Array  # (3, p) rad/s
    force: Array  # (3, p) N, from contacts
    torque: Array  # (3, p) N m, about the centre
    radius: Array  # (p,) m, outer; of a mesh from its centre to its farthest vertex
    half_length: Array  # (p,) m, outer; 0 for a mesh
    edge_radius: Array  # (p,) m
    material: Array  # (p,) int32


class Walls(NamedTuple):
    """Triangles of all meshes, in the local frames of their parts: a mesh that moves costs nothing by itself."""

    vertex: Array  # (3, v) m
    triangle: Array  # (3, t) int32 vertices; those of a mesh stand together, near ones near one another
    part: Array  # (t,) int32
    beside_start: (
        Array  # (t + 1,) int64: neighbours of triangle r are beside[beside_start[r]:beside_start[r + 1]]
    )
    beside: Array  # int32 triangles that share a point, ascending
    alike: Array  # bool, of each neighbour: both lie so nearly in one plane that they count as one face
    point_start: Array  # (t + 1,) int64, as beside_start
    point: Array  # (3, q) m, points of folds and rims that may poke into a box, each at one triangle
    point_part: Array  # (q,) int32
    ball: Array  # (4, t) m, centre and radius of a ball around each triangle


class WallTree(NamedTuple):
    """Boxes around the triangles of each mesh, a complete binary tree; row w is mesh w.

    The root is node base + 1, the children of base + k are base + 2 k and the next; the leaves are the last half.
    """

    low: Array  # (3, nodes) m, in the part's frame
    high: Array  # (3, nodes) m
    base: Array  # (w,) int64
    leaves: Array  # (w,) int64, a power of two
    first: Array  # (w,) int64 first triangle of the mesh
    count: Array  # (w,) int64 triangles
    part: Array  # (w,) int32


class Feelers(NamedTuple):
    """Balls with which particles touch walls: a sphere itself, the eight corners of a rounded box."""

    particle: Array  # (f,) int32 ascending
    offset: Array  # (3, f) from the centre, in the particle's local frame, m


class Loads(NamedTuple):
    """Which pairs with parts load each particle."""

    start: Array  # (n + 1,) int64
    entry: Array  # (p,) int64
