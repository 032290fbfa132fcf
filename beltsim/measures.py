"""What *MEASURE blocks record: mass flow, tension, sag and power, one number each at every frame."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from beltsim import inp
from beltsim.inp import Block
from beltsim.scene import Scene
from beltsim.scene.unbuilt import SceneError, problem

LOOK_PAUSE = (
    0.005  # s between two looks at the bulk: its path between them is straight within g t^2/8 = 0.03 mm
)

UNITS = {"MASS FLOW": "kg s-1", "TENSION": "N", "SAG": "m", "POWER": "W"}


@dataclass
class Plane:
    """A plane with a direction, or the disc of a radius in it."""

    point: np.ndarray  # (3,) m
    normal: np.ndarray  # (3,) unit
    radius: float  # m, inf for the whole plane

    def height(self, position: np.ndarray) -> np.ndarray:
        """Distances (n,) [m] of points (n, 3) from the plane, along its normal."""
        return (position - self.point) @ self.normal

    def crossings(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """+1, -1 or 0 for each straight path (n, 3) to (n, 3): through the disc along its normal, back, or not.

        A point on the plane counts as beyond it, so that a path that ends there and the one that goes on count once.
        """
        low, high = self.height(before), self.height(after)
        sign = (high >= 0.0).astype(int) - (low >= 0.0).astype(int)
        through = np.flatnonzero(sign)
        share = (low[through] / (low[through] - high[through]))[:, None]
        place = before[through] + share * (after[through] - before[through])
        sign[through[np.linalg.norm(place - self.point, axis=1) > self.radius]] = 0
        return sign


@dataclass
class Measure:
    """A *MEASURE at work."""

    name: str
    kind: str
    plane: Plane | None
    chosen: np.ndarray  # MASS FLOW: (species,) bool; TENSION, SAG: (permanent,) bool; POWER: (parts,) bool
    total: float = 0.0  # kg through the plane, or J given by the parts, since the start
    last: tuple[float, float] | None = None  # time and total of the frame before


@dataclass
class Measures:
    """All measures of a scene, and where the bulk was at the last look."""

    all: list[Measure]
    id: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    position: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))

    @property
    def flows(self) -> list[Measure]:
        """Those that need looks between the frames."""
        return [measure for measure in self.all if measure.kind == "MASS FLOW"]


def measures_of(scene: Scene, taken: set[str]) -> Measures:
    """Measures of a scene; names in `taken` are those of other observables.

    Raises
    ------
    SceneError
        For a name that is taken, and for a measure that finds nothing to measure.
    """
    measures, problems = [], []
    for block in scene.deck.blocks("MEASURE"):
        measure = measure_of(block, scene)
        wrong = objection(measure, scene) or clash(measure, taken)
        if wrong:
            problems.append(problem(block, *wrong))
        taken = taken | {name for name, _ in columns_of(measure)}
        measures.append(measure)
    if problems:
        raise SceneError("\n".join(problems))
    found = Measures(measures)
    remember(found, scene)
    return found


def measure_of(block: Block, scene: Scene) -> Measure:
    """The measure of a block."""
    kind, plane = block["TYPE"], None
    if len(block):
        normal, radius = block.rows["normal"][0], float(block.rows["radius"][0])
        reach = np.inf if np.isnan(radius) else radius
        plane = Plane(block.rows["point"][0], normal / np.linalg.norm(normal), reach)
    if kind == "MASS FLOW":
        chosen = named([body.name for body in scene.population.bodies], block.get("PARTICLE TYPE"))
    elif kind == "POWER":
        info = scene.machinery.info
        chosen = named([part.name for part in info], block["PART"])
        chosen &= np.array([part.particle < 0 for part in info], bool)
    else:
        chosen = belt_slots(scene, block.get("BELT"))
    return Measure(block["NAME"], kind, plane, chosen)


def named(names: list[str], pattern: str | None) -> np.ndarray:
    """Which names (n,) bool a pattern means; all for None."""
    wanted = set(names if pattern is None else inp.matching(names, pattern))
    return np.array([name in wanted for name in names], bool)


def belt_slots(scene: Scene, belt: str | None) -> np.ndarray:
    """Which of the permanent particles (n,) bool are bonded and belong to a belt; to any for None."""
    population = scene.population
    bonded = np.zeros(population.permanent, bool)
    if scene.bonds is not None:
        bonded[scene.bonds.first] = bonded[scene.bonds.second] = True
    if belt is None:
        return bonded
    groups = {block["NAME"] for block in scene.deck.blocks("CONTACT GROUP") if block.get("BELT") == belt}
    of_belt = np.array([body.group in groups for body in population.bodies], bool)
    return bonded & of_belt[population.species[: population.permanent]]


def objection(measure: Measure, scene: Scene) -> tuple[str, str] | None:
    """What is found and expected instead, if there is nothing to measure."""
    if measure.kind in ("TENSION", "SAG") and not np.any(measure.chosen):
        return f"TYPE={measure.kind} of a scene without such a belt", "a belt of bonded particles"
    if measure.kind == "SAG" and np.isnan(sag(measure, scene)):
        return "no belt particle within the radius of the point", "a point on the belt, or a larger radius"
    return None


def clash(measure: Measure, taken: set[str]) -> tuple[str, str] | None:
    """What is found and expected instead, if another observable has the name."""
    for name, _ in columns_of(measure):
        if name in taken:
            return f"NAME={measure.name}: the trajectory has another observable {name}", "another name"
    return None


def columns_of(measure: Measure) -> list[tuple[str, str]]:
    """Names and units of what a measure records."""
    columns = [(measure.name, UNITS[measure.kind])]
    if measure.kind == "MASS FLOW":
        columns.append((f"{measure.name}_mass", "kg"))
    return columns


def observables_of(measures: Measures) -> tuple[tuple[str, str, int], ...]:
    """Name, unit and number of columns of all that the measures record."""
    return tuple((name, unit, 1) for measure in measures.all for name, unit in columns_of(measure))


# --- looking between the frames ----------------------------------------------------------------------------------


def remember(measures: Measures, scene: Scene) -> None:
    """Note where the bulk is, for the next look."""
    population = scene.population
    measures.id = population.id[population.permanent :].copy()
    measures.position = population.particles.position[:, population.permanent :].T.copy()


def look(measures: Measures, scene: Scene) -> None:
    """Count the bulk that went through planes since the last look. Call it before bulk is removed."""
    population, first = scene.population, scene.population.permanent
    _, before, now = np.intersect1d(
        measures.id, population.id[first:], assume_unique=True, return_indices=True
    )
    old, new = measures.position[before], population.particles.position[:, first + now].T
    mass = population.particles.mass[first + now]
    for flow in measures.flows:
        counted = flow.chosen[population.species[first + now]]
        flow.total += float(np.sum(flow.plane.crossings(old, new) * mass * counted))
    remember(measures, scene)


# --- reading at the frames -----------------------------------------------------------------------------------------


def readings(
    measures: Measures, scene: Scene, time: float, axial: np.ndarray, work: np.ndarray
) -> dict[str, float]:
    """What all measures record at a frame.

    Parameters
    ----------
    time : total time [s]
    axial : (m,) axial forces of the bonds [N], in the solver's order
    work : (p,) work [J] that the parts have done on what touches them since the start
    """
    found = {}
    for measure in measures.all:
        if measure.kind == "MASS FLOW":
            found[measure.name] = mean_rate(measure, time, 0.0)
            found[f"{measure.name}_mass"] = measure.total
        elif measure.kind == "POWER":
            measure.total = float(np.sum(work[measure.chosen]))
            found[measure.name] = mean_rate(measure, time, power(measure, scene))
        elif measure.kind == "TENSION":
            found[measure.name] = tension(measure, scene, axial)
        else:
            found[measure.name] = sag(measure, scene)
    return found


def mean_rate(measure: Measure, time: float, at_first: float) -> float:
    """Growth of a total per time since the frame before; `at_first` at the first frame."""
    before, measure.last = measure.last, (time, measure.total)
    if before is None or time <= before[0]:
        return at_first
    return (measure.total - before[1]) / (time - before[0])


def power(measure: Measure, scene: Scene) -> float:
    """Power [W] that the parts give at this moment to what touches them."""
    parts = scene.machinery.parts
    given = np.sum(parts.force * parts.velocity + parts.torque * parts.angular_velocity, axis=0)
    return -float(np.sum(given[measure.chosen]))


def tension(measure: Measure, scene: Scene, axial: np.ndarray) -> float:
    """Axial forces [N] of the belt's bonds through the plane, along its normal."""
    position, bonds = scene.population.particles.position.T, scene.bonds
    ours = np.flatnonzero(measure.chosen[bonds.first])
    start, stop = position[bonds.first[ours]], position[bonds.second[ours]]
    crossing = measure.plane.crossings(start, stop)
    d = stop - start
    along = (d @ measure.plane.normal) / np.maximum(np.linalg.norm(d, axis=1), 1e-300)
    return float(np.sum(axial[ours] * along * crossing))


def sag(measure: Measure, scene: Scene) -> float:
    """Distance [m] of the lowest belt particle below the plane; nan if none is near the point."""
    position = scene.population.particles.position[:, : measure.chosen.size].T[measure.chosen]
    near = np.linalg.norm(position - measure.plane.point, axis=1) <= measure.plane.radius
    return -float(np.min(measure.plane.height(position[near]))) if np.any(near) else float("nan")
