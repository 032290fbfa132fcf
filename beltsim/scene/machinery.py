"""Parts, cylinder particles among them, and what moves them in each step."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from beltsim import inp
from beltsim.inp import Block, Deck
from beltsim.scene.bodies import BOX, CYLINDER, Body, Population
from beltsim.scene.mesh_file import MeshProblem, read_mesh
from beltsim.scene.touching import Groups, Materials, of_shape
from beltsim.scene.unbuilt import SceneError, problem
from beltsim.scene.walls import Mesh, in_search_order, walls_of
from beltsim.solver.motion import CARRIED, FREE, PRESCRIBED, Amplitudes, Slides, Spins
from beltsim.solver.rods import Rods
from beltsim.solver.state import Particles, Parts, Walls, WallTree
from beltsim.solver.vectors import axis_z, rotate_back

MESH = "MESH"


@dataclass
class PartInfo:
    """What is known of a part beside its arrays."""

    name: str
    shape: str
    part_class: str
    color: str
    particle: int  # slot of the cylinder particle that it stands for, -1 for a *PART
    type_name: str  # particle type, "" for a *PART
    id: int  # of the particle
    inertia: float  # about its axis, of a cylinder particle; 0 for a *PART
    spins: bool = False  # held by its position only, so that it turns freely unless a motion says else
    flies: bool = False  # with its particle, wherever that goes


@dataclass
class Machinery:
    """All parts in order: *PART blocks, then cylinder particles."""

    info: list[PartInfo]
    parts: Parts
    group: np.ndarray  # (p,) int32, row of `may_touch`
    meshes: list[Mesh]
    walls: Walls
    tree: WallTree
    rods: Rods | None = None


def rods_of(info: list[PartInfo], particles: Particles) -> Rods | None:
    """Cylinder particles that fly; None if there are none."""
    parts = np.array([p for p, part in enumerate(info) if part.flies], np.int32)
    slots = np.array([info[p].particle for p in parts], np.int32)
    inverse_mass = np.zeros(len(info))
    inverse_mass[parts] = 1.0 / particles.mass[slots]
    return Rods(slots, parts, inverse_mass) if parts.size else None


def machinery_of(deck: Deck, population: Population, materials: Materials, groups: Groups) -> Machinery:
    """Parts of a deck as arrays.

    Raises
    ------
    SceneError
        If a mesh file cannot be used.
    """
    meshes = meshes_of(deck)
    rows = [row_of_part(block, materials, groups) for block in inp.by_name(deck, "PART").values()]
    rows += [row_of_cylinder(population, slot, materials, groups) for slot in of_shape(population, CYLINDER)]
    info = [row[0] for row in rows]
    count = len(rows)

    def column(k, width=0, dtype=np.float64):
        values = np.array([row[1][k] for row in rows], dtype=dtype).reshape(
            (count, width) if width else (count,)
        )
        return np.ascontiguousarray(values.T)

    parts = Parts(
        position=column(0, 3),
        orientation=column(1, 4),
        velocity=np.zeros((3, count)),
        angular_velocity=np.zeros((3, count)),
        force=np.zeros((3, count)),
        torque=np.zeros((3, count)),
        radius=column(2),
        half_length=column(3),
        edge_radius=column(4),
        material=column(5, dtype=np.int32),
    )
    for mesh in meshes:
        parts.radius[mesh.part] = np.linalg.norm(mesh.vertices, axis=1).max()
    walls, tree = walls_of(meshes, point_spacing(population))
    rods = rods_of(info, population.particles)
    return Machinery(info, parts, column(6, dtype=np.int32), meshes, walls, tree, rods)


def meshes_of(deck: Deck) -> list[Mesh]:
    """All mesh parts, with their number among the parts."""
    meshes, problems = [], []
    for n, block in enumerate(inp.by_name(deck, "PART").values()):
        if block["SHAPE"] == MESH:
            try:
                vertices, triangles = read_mesh(block)
            except MeshProblem as error:
                problems.append(problem(block, f"INPUT={block['INPUT']} with {error.found}", error.expected))
            else:
                meshes.append(Mesh(n, vertices, in_search_order(vertices, triangles)))
    if problems:
        raise SceneError("\n".join(problems))
    return meshes


def unit_warnings(deck: Deck, machinery: Machinery) -> list[str]:
    """A word about each mesh file whose unit nobody gave: its numbers count as metres."""
    blocks, found = list(inp.by_name(deck, "PART").values()), []
    for mesh in machinery.meshes:
        block = blocks[mesh.part]
        if "UNIT" not in block:
            size = " x ".join(f"{side:.4g}" for side in np.ptp(mesh.vertices, axis=0))
            found.append(
                f"warning: {block.where}: {block['INPUT']} is read in metres, so it measures {size} m; UNIT=M or "
                "UNIT=MM says what it is"
            )
    return found


def point_spacing(population: Population) -> float:
    """Distance of the points of folds and rims [m]: half the least box, so that none slips between two; 0: no box."""
    boxes = of_shape(population, BOX)
    return float(population.half_extent[boxes].min()) if boxes.size else 0.0


def row_of_part(block: Block, materials: Materials, groups: Groups) -> tuple[PartInfo, tuple]:
    """A *PART; the radius of a mesh is not known here."""
    plane, mesh = block["SHAPE"] == "PLANE", block["SHAPE"] == MESH
    info = PartInfo(
        block["NAME"], block["SHAPE"], block.get("CLASS") or "", block.get("COLOR") or "", -1, "", -1, 0.0
    )
    return info, (
        block.rows["position"][0] if len(block) else np.zeros(3),
        block.rows["orientation"][0] if len(block) else np.array([1.0, 0.0, 0.0, 0.0]),
        math.inf if plane else 0.0 if mesh else 0.5 * block["DIAMETER"],
        math.inf if plane else 0.0 if mesh else 0.5 * block["LENGTH"],
        0.0 if plane or mesh else block["EDGE RADIUS"],
        materials.row[block["MATERIAL"]],
        groups.of(block.get("CONTACT GROUP")),
    )


def row_of_cylinder(population: Population, slot: int, materials: Materials, groups: Groups) -> tuple:
    """A particle of shape CYLINDER, as a part of its own."""
    body: Body = population.bodies[population.species[slot]]
    particle_id = int(population.id[slot])
    info = PartInfo(
        f"{body.name}_{particle_id}",
        CYLINDER,
        body.block.get("CLASS") or "",
        body.block.get("COLOR") or "",
        int(slot),
        body.name,
        particle_id,
        float(population.particles.inertia[2, slot]),
        body.fixed == "POSITION",
        body.fixed == "NO",
    )
    radius, _, half_length = population.half_extent[slot]
    return info, (
        population.particles.position[:, slot],
        population.particles.orientation[:, slot],
        radius,
        half_length,
        population.edge_radius[slot],
        materials.row[body.material],
        groups.of(body.group),
    )


def amplitudes_of(deck: Deck) -> tuple[Amplitudes, dict[str, int]]:
    """All *AMPLITUDE tables, and the number of each by name."""
    blocks = list(inp.by_name(deck, "AMPLITUDE").values())
    start = np.cumsum([0, *(len(block) for block in blocks)]).astype(np.int64)
    if not blocks:
        return Amplitudes(start, np.zeros(0), np.zeros(0)), {}
    time = np.concatenate([block.rows["time"] for block in blocks]).astype(np.float64)
    factor = np.concatenate([block.rows["factor"] for block in blocks]).astype(np.float64)
    return Amplitudes(start, time, factor), {block["NAME"]: n for n, block in enumerate(blocks)}


def table_of(block: Block, tables: dict[str, int]) -> int:
    """Number of the amplitude that a block names, -1 for none."""
    name = block.get("AMPLITUDE")
    return -1 if name is None else tables[name]


def acts_in(block: Block, step_name: str | None) -> bool:
    """Whether a block acts in a step: those without STEP= act always."""
    return block.get("STEP") is None or block.get("STEP") == step_name


def parts_of_motion(block: Block, machinery: Machinery) -> list[int]:
    """Parts that a *MOTION moves."""
    names = [part.name for part in machinery.info]
    if block.get("PART") is not None:
        wanted = set(
            inp.matching([n for n, part in zip(names, machinery.info) if part.particle < 0], block["PART"])
        )
        return [n for n, part in enumerate(machinery.info) if part.particle < 0 and part.name in wanted]
    if block.get("PARTICLE TYPE") is not None:
        types = {part.type_name for part in machinery.info if part.type_name}
        wanted = set(inp.matching(sorted(types), block["PARTICLE TYPE"]))
        return [n for n, part in enumerate(machinery.info) if part.type_name in wanted and not part.flies]
    ids = (
        set(inp.expand_ids(block["PARTICLES"]))
        if isinstance(block["PARTICLES"], str)
        else set(block["PARTICLES"])
    )
    return [n for n, part in enumerate(machinery.info) if part.id in ids and not part.flies]


def drives_of(
    deck: Deck, machinery: Machinery, tables: dict[str, int], step_name: str | None, before: Slides | None
) -> tuple[Spins, Slides]:
    """What moves the parts in a step. Cylinder particles spin freely unless a motion says else.

    Parts that follow their loads keep their velocities from step to step; all others stand unless a motion moves them.
    """
    spins, slides = at_rest(machinery)
    if before is not None:
        slides.offset[:] = before.offset
    for block in deck.blocks("MOTION"):
        if acts_in(block, step_name):
            for part in parts_of_motion(block, machinery):
                MOTIONS[block["TYPE"]](block, part, machinery, spins, slides, table_of(block, tables))
    return spins, slides


def mode_of(part: PartInfo) -> int:
    """What turns a part that no motion turns."""
    return CARRIED if part.flies else FREE if part.spins else PRESCRIBED


def at_rest(machinery: Machinery) -> tuple[Spins, Slides]:
    """Parts that stay; cylinder particles held by their position spin freely."""
    count = len(machinery.info)
    inertia = np.array([part.inertia for part in machinery.info])
    spins = Spins(
        mode=np.array([mode_of(part) for part in machinery.info], np.int8),
        rate=np.zeros(count),
        amplitude=np.full(count, -1, np.int32),
        inertia=np.where(inertia > 0.0, inertia, 1.0) if count else np.ones(0),
        friction_torque=np.zeros(count),
        torque=np.zeros(count),
        axis=np.tile([[0.0], [0.0], [1.0]], count),
    )
    slides = Slides(
        velocity=np.zeros((3, count)),
        moves=np.ones(count),
        direction=np.zeros((3, count)),
        mass=np.where([part.flies for part in machinery.info], -1.0, 0.0),
        force=np.zeros(count),
        amplitude=np.full(count, -1, np.int32),
        stiffness=np.zeros(count),
        damping=np.zeros(count),
        offset=np.zeros(count),
        pressing=np.zeros((3, count)),
    )
    return spins, slides


def _axis(block, part, machinery, spins):
    """A mesh turns about an axis given in world axes, where it is now."""
    if block.get("AXIS") is not None:
        axis = np.asarray(block["AXIS"], dtype=np.float64)
        _turning_axis(machinery.parts, part, spins, axis / np.linalg.norm(axis))


def _turning_axis(parts, part, spins, axis):
    """Let a part turn about a unit vector of the world."""
    spins.axis[:, part] = rotate_back(tuple(parts.orientation[:, part]), tuple(axis))


def _rotation(block, part, machinery, spins, slides, table):  # noqa: ARG001 - one signature for all motions
    _axis(block, part, machinery, spins)
    spins.mode[part] = PRESCRIBED
    spins.rate[part] = block["ANGULAR VELOCITY"]
    spins.amplitude[part] = table


def _free_rotation(block, part, machinery, spins, slides, table):  # noqa: ARG001
    _axis(block, part, machinery, spins)
    spins.mode[part] = FREE
    spins.inertia[part] = block.get("INERTIA") or spins.inertia[part]
    spins.friction_torque[part] = block["FRICTION TORQUE"]


def _torque(block, part, machinery, spins, slides, table):
    _free_rotation(block, part, machinery, spins, slides, table)
    spins.torque[part] = block["TORQUE"]
    spins.amplitude[part] = table


def _slide(block, part, slides):
    direction = block.rows["vector"][0, :3]
    slides.direction[:, part] = direction / np.linalg.norm(direction)
    slides.mass[part] = block["MASS"]
    slides.damping[part] = block["DAMPING"]


def _tension(block, part, machinery, spins, slides, table):  # noqa: ARG001
    _slide(block, part, slides)
    slides.force[part] = block["FORCE"]
    slides.amplitude[part] = table


def _suspension(block, part, machinery, spins, slides, table):  # noqa: ARG001
    _slide(block, part, slides)
    slides.stiffness[part] = block["STIFFNESS"]


def _surface_velocity(block, part, machinery, spins, slides, table):  # noqa: ARG001
    slides.amplitude[part] = table
    velocity = block.rows["vector"][0, :3]
    if machinery.info[part].shape == "PLANE":
        normal = np.array(axis_z(tuple(machinery.parts.orientation[:, part])))
        velocity = velocity - np.dot(velocity, normal) * normal
    slides.velocity[:, part] = velocity
    slides.moves[part] = 0.0


def _velocity(block, part, machinery, spins, slides, table):
    vector = block.rows["vector"][0]
    slides.velocity[:, part] = vector[:3]
    slides.amplitude[part] = table
    if vector.size == 6 and np.any(np.isfinite(vector[3:])):
        # A body that turns about an axis of the world turns about the same axis of its own.
        rate = float(np.linalg.norm(vector[3:]))
        _turning_axis(machinery.parts, part, spins, vector[3:] / rate if rate > 0.0 else (0.0, 0.0, 1.0))
        spins.mode[part], spins.rate[part], spins.amplitude[part] = PRESCRIBED, rate, table


MOTIONS = {
    "ROTATION": _rotation,
    "FREE ROTATION": _free_rotation,
    "TORQUE": _torque,
    "TENSION": _tension,
    "SUSPENSION": _suspension,
    "SURFACE VELOCITY": _surface_velocity,
    "VELOCITY": _velocity,
}
