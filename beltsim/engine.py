"""The state of a running scene, and stepping it: lists made anew when stale, forces, blow-ups found and named."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from beltsim.console import CommandError, ExitCode
from beltsim.diagnosis import diagnosis, wound_diagnosis
from beltsim.energy import Account, close_lists, energy_in_motion, held_back, open_stage, with_books
from beltsim.exclusions import Excluded, excluded_at_start, renewed
from beltsim.lists import (
    Bonded,
    Families,
    Lists,
    bonded_neighbours,
    carry,
    make_lists,
    with_surfaces,
)
from beltsim.scene import Scene
from beltsim.scene.bodies import BOX, SPHERE
from beltsim.scene.guiding import engage, led_slots
from beltsim.scene.touching import of_shape
from beltsim.skin import first_skin, tuned
from beltsim.solver.chunks import alike_chunks, notes_of
from beltsim.solver.guides import Guided, Pivots, guide
from beltsim.solver.integration import spin_of_momentum
from beltsim.solver.motion import Slides, Spins, prescribe_parts
from beltsim.solver.reference_integrator import advance_reference
from beltsim.solver.state import ChunkNotes, aligned
from beltsim.solver.steps import (
    DONE,
    LISTS_STALE,
    LOST,
    WOUND_UP,
    Clock,
    Environment,
    GivenLoads,
    advance,
)
from beltsim.turnover import sort_free

SORTING = 16
"""Lists are made so many times before spheres are sorted again: they have moved a few of their radii meanwhile."""

ENOUGH_TO_SORT = 1000
"""Free spheres from which sorting pays: the state of fewer fits into the second-level cache in any order."""

STEPPERS = {"VERLET": advance, "PEFRL": advance_reference}


class BlowUp(CommandError):
    """The run cannot go on: which particle, when and why."""

    exit_code = ExitCode.BLOW_UP


@dataclass
class Stage:
    """What holds during one *STEP of the deck."""

    time_step: float  # s
    start: float  # s, total time of step 0
    spins: Spins
    slides: Slides
    given: GivenLoads | None
    drag: float  # 1/s
    wind: tuple[float, float, float]  # m/s
    guided: Guided
    pivots: Pivots | None = None
    integrator: str = "VERLET"


@dataclass
class State:
    """A scene in motion. `step` counts within the stage, `total_steps` over the run."""

    scene: Scene
    families: Families
    bonded: Bonded
    skin: float
    excluded: Excluded | None = None
    lists: Lists | None = None
    notes: ChunkNotes | None = None
    part_travel: np.ndarray | None = None
    part_work: np.ndarray | None = None  # (p,) J, since the start
    account: Account | None = None  # if an energy book is kept
    cap: float = 0.0
    stage: Stage | None = None
    step: int = 0
    total_steps: int = 0
    list_builds: int = 0
    listed_at: int = 0  # total steps when the lists were made
    first_skin: float = 0.0  # m
    team: int | None = None  # threads, None: one

    @property
    def time(self) -> float:
        """Total time [s], from an integer count of steps."""
        return self.stage.start + self.step * self.stage.time_step


def state_of(scene: Scene) -> State:
    """The state of a scene before its first step."""
    bounding = scene.shapes.bounding
    families = families_of(scene)
    bonds = scene.bonds
    count = scene.population.count
    skin = first_skin(bounding if bounding.size else source_sizes(scene))
    work = np.zeros(len(scene.machinery.info))
    boxes = of_shape(scene.population, BOX)
    excluded = excluded_at_start(boxes if families.box_boxes else boxes[:0], bonds, scene.shapes)
    bonded = bonded_neighbours(count, bonds)
    return State(scene, families, bonded, skin, excluded, part_work=work, first_skin=skin)


def families_of(scene: Scene) -> Families:
    """Which pairs of shapes can ever be near one another."""
    shapes = {part.shape for part in scene.machinery.info}
    spheres, boxes, meshes = scene.has_spheres, scene.has_boxes, "MESH" in shapes
    return Families(
        spheres=spheres,
        sphere_material=common_material(scene),
        rolling=bool(np.any(scene.laws.rolling_friction)),
        boxes=boxes,
        parts=bool(shapes - {"MESH"}),
        walls=(meshes and (spheres or boxes)) or (boxes and "PLANE" in shapes),
        points=meshes and boxes,
        box_boxes=scene.boxes_may_touch,
        rods=scene.machinery.rods is not None,
    )


def common_material(scene: Scene) -> int | None:
    """Row of the material of all spheres that are there or may come, None for several."""
    found = {scene.materials.row[body.material] for body in scene.population.bodies if body.shape == SPHERE}
    return found.pop() if len(found) == 1 else None


def source_sizes(scene: Scene) -> np.ndarray:
    """Radii of the spheres that may come, for scenes that begin empty."""
    return np.array([body.edge_radius for body in scene.population.bodies if body.shape == SPHERE])


def begin_stage(state: State, stage: Stage) -> None:
    """Start a stage: its drives, its step, and the forces at its first moment."""
    scene, account, before, held = state.scene, state.account, 0.0, 0.0
    if account is not None and state.stage is not None:
        before, held = energy_in_motion(state), held_back(state)
    released = np.zeros(0, np.int32)
    if state.stage is not None:
        released = led_slots(state.stage.guided, state.stage.pivots)
    state.stage, state.step = stage, 0
    engage(scene.population, stage.guided, stage.pivots, released)
    prescribe_parts(scene.machinery.parts, stage.spins, stage.slides, scene.amplitudes, stage.start)
    guide(scene.population.particles, stage.guided, scene.amplitudes, stage.start)
    state.notes = None  # others may be held now
    renew_lists(state)
    find_forces(state)
    if account is not None:
        open_stage(state, before, held)


def find_forces(state: State) -> None:
    """All loads at the present moment; no step, so nothing slides or creeps."""
    STEPPERS[state.stage.integrator](*solver_arguments(state, time_step=0.0), 0)


def renew_lists(state: State, origin: np.ndarray | None = None) -> None:
    """Make all lists anew at the present positions and carry the contact history over.

    `origin` is the old slot of each particle after insertion or removal.

    Raises
    ------
    BlowUp
        If a particle moves more than half the skin in one step: it could pass another one unseen.
    """
    if fastest_step(state) > 0.5 * state.skin:
        raise BlowUp(diagnosis(state))
    if origin is not None:
        renumber(state.stage, origin, state.notes.listed.shape[1])
    if state.list_builds % SORTING == 0:
        origin = sorted_anew(state, origin)
    scene, population = state.scene, state.scene.population
    same = state.notes is not None and origin is None
    if not same:
        population.particles = aligned(population.particles)
    alike = state.notes.alike if same else alike_chunks(population.particles)
    count = population.count
    chosen = of_shape(population, SPHERE), of_shape(population, BOX)
    boxes = chosen[1] if state.families.box_boxes else chosen[1][:0]
    intact = state.excluded.intact
    state.excluded = renewed(state.excluded, boxes, scene.bonds, population.particles, scene.shapes)
    if state.bonded.start.size != count + 1 or origin is not None or state.excluded.intact != intact:
        state.bonded = bonded_neighbours(count, scene.bonds)
    machinery = scene.machinery
    new = make_lists(
        population.particles,
        scene.shapes,
        machinery.parts,
        machinery.group,
        state.families,
        state.bonded,
        state.skin,
        chosen,
        (machinery.walls, machinery.tree),
        state.excluded,
        machinery.rods,
        population.permanent,
        state.team,
    )
    if state.account is not None:
        new = with_books(new)
        close_lists(state.account, state.lists)
    if state.lists is not None:
        origin = np.arange(count, dtype=np.int64) if origin is None else origin
        carry(new, state.lists, origin, len(machinery.info))
    state.lists = new
    state.notes = notes_of(population.particles.position.copy(), alike)
    state.part_travel = np.zeros(1)
    # Particles may get half as fast again before lists are made anew for that alone; the least keeps a scene at rest
    # from being called too fast.
    state.cap = max(1.5 * fastest_step(state), 0.02 * state.skin)
    state.list_builds += 1
    state.listed_at = state.total_steps


def sorted_anew(state: State, origin: np.ndarray | None) -> np.ndarray | None:
    """Sort the free spheres by place, if they are many; `origin` and result as in `renew_lists`."""
    scene, population = state.scene, state.scene.population
    if population.count - population.permanent < ENOUGH_TO_SORT:
        return origin
    widest = 2.0 * float(scene.shapes.bounding[population.permanent :].max())
    order = sort_free(scene, widest + state.skin)
    renumber(state.stage, order, order.size)
    return order if origin is None else origin[order]


def renumber(stage: Stage, origin: np.ndarray, before: int) -> None:
    """Let loads and prescribed velocities follow their particles to new slots; those of particles that left end.

    Particles that spin about a held axis never leave, and stand before all that do.
    """
    slot = np.full(before + 1, -1, np.int32)
    slot[origin] = np.arange(
        origin.size
    )  # new particles, -1, fall into the last place, which nobody asks for
    there = slot[stage.guided.particle] >= 0
    stage.guided = Guided(
        slot[stage.guided.particle][there],
        np.ascontiguousarray(stage.guided.velocity[:, there]),
        np.ascontiguousarray(stage.guided.spin[:, there]),
        stage.guided.amplitude[there],
    )
    if stage.given is not None:
        there = slot[stage.given.particle] >= 0
        stage.given = GivenLoads(
            slot[stage.given.particle][there],
            np.ascontiguousarray(stage.given.load[:, there]),
            stage.given.amplitude[there],
        )


def solver_arguments(state: State, time_step: float | None = None) -> tuple:
    """Arguments of `advance` but for the number of steps."""
    scene, stage = state.scene, state.stage
    dt = stage.time_step if time_step is None else time_step
    belt = None if scene.bonds is None else (scene.bonds, scene.runs, scene.kinds)
    environment = Environment(
        tuple(scene.gravity),
        stage.drag,
        stage.wind,
        state.notes,
        state.part_travel,
        state.part_work,
        stage.guided,
        stage.pivots,
        None if state.account is None else state.account.ledger,
        state.team,
    )
    clock = Clock(dt, stage.start, state.step, state.skin, state.cap)
    return (
        scene.population.particles,
        scene.shapes,
        scene.laws,
        belt,
        scene.strength,
        with_surfaces(state.lists, scene.machinery.walls),
        scene.machinery.parts,
        (stage.spins, stage.slides, scene.amplitudes),
        stage.given,
        environment,
        clock,
    )


def advance_by(state: State, steps: int) -> None:
    """Make `steps` steps.

    Raises
    ------
    BlowUp
        If a particle moves more than half the skin in one step, or is not finite any more.
    """
    while steps > 0:
        done, reason = STEPPERS[state.stage.integrator](*solver_arguments(state), steps)
        state.step += done
        state.total_steps += done
        steps -= done
        if reason == WOUND_UP:
            raise BlowUp(wound_diagnosis(state))
        if reason == LOST:
            raise BlowUp(diagnosis(state))
        if reason == LISTS_STALE:
            tune_skin(state)
        if reason != DONE:
            renew_lists(state)
    spin_of_momentum(state.scene.population.particles)


def tune_skin(state: State) -> None:
    """Let the skin of the next lists be what the last ones have taught, and wide enough for the fastest particle."""
    steps, count = state.total_steps - state.listed_at, state.scene.population.count
    better = tuned(state.skin, state.first_skin, state.lists, count, steps)
    state.skin = max(better, 8.0 * fastest_step(state)) if better < state.skin else better


def fastest_step(state: State) -> float:
    """The farthest [m] that a particle moves in one step now."""
    velocity = state.scene.population.particles.velocity
    return state.stage.time_step * float(np.sqrt(np.max(np.sum(velocity**2, axis=0), initial=0.0)))
