"""The time step of a stage: what limits it, named, and the refusal of a step beyond it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from beltsim.console import CommandError, ExitCode
from beltsim.face_limits import face_contact_rows, face_impacts
from beltsim.lists import BETWEEN_PARTICLES
from beltsim.scene import Scene
from beltsim.scene.bodies import BOX, CYLINDER, SPHERE, Body
from beltsim.scene.walls import Mesh
from beltsim.solver.contact import LINE_STIFFNESS, PUNCH_STIFFNESS
from beltsim.solver.guides import Guided
from beltsim.solver.motion import FREE, Amplitudes, Slides, Spins
from beltsim.solver.state import Laws, LinearLaws, Parts
from beltsim.solver.timestep import (
    IMPACT_STEPS,
    bond_row_sums,
    contact_row_sums,
    damped_limit,
    impact_duration,
)

TRAVEL = 0.1  # share of the smallest radius or thickness that a particle may move in one step
REFERENCE_REACH = 1.25  # PEFRL runs at 1.2 of Verlet's limit and blows up at 1.6 (measured on a bonded strip)


class TimeStepError(CommandError):
    """A time step beyond the stability limit."""

    exit_code = ExitCode.INVALID_INPUT


@dataclass(frozen=True)
class Limit:
    """A time step [s] that must not be exceeded, and what sets it."""

    time_step: float
    cause: str


def reference_speed(scene: Scene, spins: Spins, slides: Slides, guided: Guided) -> float:
    """Speed [m/s] of the hardest impact to expect: the fastest thing at the start, and a fall through the scene.

    What is prescribed counts with the peak of its amplitude.
    """
    population, parts, peaks = scene.population, scene.machinery.parts, peak_factors(scene.amplitudes)
    speeds = [0.0, *np.linalg.norm(population.particles.velocity, axis=0)]
    speeds += [np.linalg.norm(block.rows["velocity"]) for block in scene.sources]
    finite = np.isfinite(parts.radius)
    rates = np.abs(spins.rate) * peaks[spins.amplitude]
    turning = np.maximum(rates, np.linalg.norm(parts.angular_velocity, axis=0))
    speeds += list(np.where(finite, parts.radius, 0.0) * turning)
    speeds += list(np.linalg.norm(parts.velocity, axis=0))
    for led in (slides, guided):
        speeds += list(np.linalg.norm(led.velocity, axis=0) * peaks[led.amplitude])
    return float(max(speeds)) + math.sqrt(2.0 * drop_of(scene, parts))


def peak_factors(amplitudes: Amplitudes) -> np.ndarray:
    """Largest absolute factor of each table, and at the end (-1: no table) 1."""
    factors = np.abs(amplitudes.factor)
    return np.array([*(factors[a:b].max() for a, b in pairwise(amplitudes.start)), 1.0])


def drop_of(scene: Scene, parts: Parts) -> float:
    """Gravity times the height of the scene along it [m2/s2]."""
    g = float(np.linalg.norm(scene.gravity))
    if g == 0.0:
        return 0.0
    places = [scene.population.particles.position.T, parts.position.T]
    places += [np.reshape(block.rows["box"], (-1, 3)) for block in scene.sources]
    places += [placed(mesh, parts) for mesh in scene.machinery.meshes]
    if scene.domain is not None:  # bulk that leaves falls to the bottom of the domain
        places.append(np.reshape(scene.domain, (2, 3)))
    heights = np.concatenate(places) @ scene.gravity
    return float(np.ptp(heights)) if heights.size else 0.0


def placed(mesh: Mesh, parts: Parts) -> np.ndarray:
    """Vertices (v, 3) of a mesh where it is now."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_quat(parts.orientation[:, mesh.part], scalar_first=True)
    return turn.apply(mesh.vertices) + parts.position[:, mesh.part]


def impact_limits(scene: Scene, speed: float) -> list[Limit]:
    """A twentieth of the impact of each kind of sphere with the hardest material that it may touch."""
    limits, boxes = [], lightest_boxes(scene)
    for body in scene.population.bodies:
        if body.shape == SPHERE and speed > 0.0:
            row, radius, mass = scene.materials.row[body.material], body.edge_radius, body.mass
            # The least reduced mass and radius that a partner of its own kind gives; then all kinds of boxes.
            pairs = [(float(scene.laws[0][row].max()), 0.5 * radius, 0.5 * mass, body.name)]
            pairs += [
                (
                    float(scene.laws[0][row, scene.materials.row[box.material]]),
                    radius,
                    mass * least / (mass + least),
                    f"{body.name} on {box.name}",
                )
                for box, least in boxes
            ]
            for hardness, reduced, m, name in pairs:
                if hardness > 0.0:
                    duration = duration_of(scene.laws, hardness, reduced, m, speed)
                    limits.append(Limit(duration / IMPACT_STEPS, f"impact of {name} at {speed:.3g} m/s"))
    return limits


def lightest_boxes(scene: Scene) -> list[tuple[Body, float]]:
    """Each kind of box in use and the least mass [kg] of its particles."""
    population = scene.population
    found = []
    for n, body in enumerate(population.bodies):
        masses = population.particles.mass[population.species == n]
        if body.shape == BOX and masses.size:
            found.append((body, float(masses.min())))
    return found


def duration_of(laws: Laws | LinearLaws, hardest: float, radius: float, mass: float, speed: float) -> float:
    """Duration [s] of an impact: Hertz for the modulus `hardest` [Pa], or half a period of that spring [N/m]."""
    if isinstance(laws, LinearLaws):
        return math.pi * math.sqrt(mass / hardest)
    return impact_duration(radius, hardest, mass, speed)


def line_contact_rows(scene: Scene) -> np.ndarray:
    """Share (n,) [1/s2] of a line contact with the hardest part in the bound of each box."""
    population, parts = scene.population, scene.machinery.parts
    share = np.zeros(population.count)
    if not parts.radius.size:
        return share
    of_parts = scene.laws[0][:, parts.material].max(axis=1)
    for n, body in enumerate(population.bodies):
        if body.shape == BOX:
            slots = population.species == n
            longest = population.half_extent[slots].max(axis=1)
            stiffness = of_parts[scene.materials.row[body.material]] * np.ones_like(longest)
            if isinstance(scene.laws, Laws):
                stiffness *= np.maximum(LINE_STIFFNESS * 2.0 * longest, corner_lengths(scene, slots))
            mass = population.particles.mass[slots]
            lever = mass * longest**2 / population.particles.inertia[:, slots].min(axis=0)
            share[slots] = stiffness * (2.0 + lever) / mass
        elif body.shape == CYLINDER and body.fixed == "NO":
            slots = population.species == n
            share[slots] = of_parts[scene.materials.row[body.material]] * rod_factor(scene, body)
    return share


def rod_factor(scene: Scene, body: Body) -> float:
    """Bound of a cylinder that flies per contact stiffness: lying along its whole length and standing on its end.

    Twice that of one contact, since what it touches may fly too.
    """
    radius, _, half_length = body.half_extent
    ends = 2.0 * radius
    if isinstance(scene.laws, Laws):
        size = LINE_STIFFNESS * 2.0 * half_length + ends
    else:
        size = 1.0 + ends / (LINE_STIFFNESS * 2.0 * half_length)
    lever = body.mass * (radius**2 + half_length**2) / min(body.inertia)
    return 2.0 * size * (2.0 + lever) / body.mass


def corner_lengths(scene: Scene, slots: np.ndarray) -> np.ndarray:
    """Stiffness over E* [m] of boxes that lie flat on a plane or a mesh, 0 if the scene has none.

    The punch, and the Hertz stiffness of four corners at an overlap of 2 % of their edge radius.
    """
    if not {"PLANE", "MESH"} & {part.shape for part in scene.machinery.info}:
        return np.zeros(np.count_nonzero(slots))
    edge = scene.population.edge_radius[slots]
    sides = np.sort(2.0 * (scene.population.half_extent[slots] - edge[:, None]), axis=1)
    face = np.maximum(np.sqrt(sides[:, 1] * sides[:, 2]), edge)
    return PUNCH_STIFFNESS * face + 4.0 * 2.0 * math.sqrt(0.02) * edge


def bond_limit(scene: Scene) -> Limit | None:
    """Limit of the bonds, with damping, and of the contacts of boxes with parts, which loose boxes have too."""
    particles = scene.population.particles
    elastic = line_contact_rows(scene) + face_contact_rows(scene, stiffness_ratio(scene))
    rate, cause = 0.0, "line contact"
    if scene.bonds is not None:
        bonds, kinds, cause = scene.bonds, scene.kinds, "bonds"
        elastic += bond_row_sums(particles, bonds, kinds, kinds.stiffness, kinds.angular_stiffness, True).max(
            axis=0
        )
        rate = float(
            bond_row_sums(particles, bonds, kinds, kinds.damping, kinds.angular_damping, False).max()
        )
    if not elastic.size or elastic.max() <= 0.0:
        return None
    worst = int(np.argmax(elastic))
    limit = damped_limit(float(elastic.max()), rate)
    return Limit(limit, f"{cause} of particle {scene.population.id[worst]}")


def travel_limit(scene: Scene, speed: float) -> Limit | None:
    """A tenth of the smallest radius or thickness in one step."""
    if speed <= 0.0 or not scene.population.bodies:
        return None
    smallest = min(min(body.half_extent) for body in scene.population.bodies)
    if scene.machinery.meshes:  # walls without thickness: what touches them must not get to their other side
        rounded = [body.edge_radius for body in scene.population.bodies if body.edge_radius > 0.0]
        smallest = min([smallest, *rounded])
    return Limit(TRAVEL * smallest / speed, f"travel at {speed:.3g} m/s")


def stable_limit(scene: Scene, spins: Spins, slides: Slides, guided: Guided) -> Limit:
    """The smallest of all limits of a stage."""
    speed = reference_speed(scene, spins, slides, guided)
    found = [bond_limit(scene), travel_limit(scene, speed), *impact_limits(scene, speed)]
    found += [Limit(*impact) for impact in face_impacts(scene)]
    found = [limit for limit in found if limit is not None]
    return min(found, key=lambda limit: limit.time_step, default=Limit(math.inf, "nothing"))


def choose(
    scene: Scene, block, spins: Spins, slides: Slides, guided: Guided, *, allow_unstable: bool = False
) -> tuple[float, str]:
    """Time step [s] of a *STEP, and a sentence that says what sets it.

    Raises
    ------
    TimeStepError
        For a given step above the limit, unless `allow_unstable`.
    """
    limit = stable_limit(scene, spins, slides, guided)
    sliding = slides.mass > 0.0
    if np.any(sliding & (slides.stiffness > 0.0)):
        frequency = np.max(slides.stiffness[sliding] / slides.mass[sliding])
        limit = min(limit, Limit(2.0 / math.sqrt(frequency), "a suspension"), key=lambda one: one.time_step)
    if block["INTEGRATOR"] == "PEFRL":
        limit = Limit(REFERENCE_REACH * limit.time_step, limit.cause)
    given = block["TIME STEP"]
    duration = block["DURATION"]
    if given == "AUTO":
        wanted = block["SAFETY"] * limit.time_step
        if not math.isfinite(wanted):
            wanted = duration / 1000.0
        steps = max(1, math.ceil(duration / wanted))
        return duration / steps, (
            f"time step {duration / steps:.4g} s (AUTO: {block['SAFETY']:g} x {limit.time_step:.4g} s, "
            f"set by {limit.cause})"
        )
    if given > limit.time_step and not allow_unstable:
        raise TimeStepError(
            f"{block.where}: found a time step of {given:.6g} s, expected at most {limit.time_step:.6g} s: "
            f"it exceeds the stability limit set by {limit.cause}"
        )
    return given, f"time step {given:.4g} s ({given / limit.time_step:.2f} of the limit set by {limit.cause})"


def present_limit(state) -> Limit:
    """Bound on the time step from the bonds and the contacts that there are now, damping of bonds included."""
    scene, lists = state.scene, state.lists
    particles = scene.population.particles
    count = particles.mass.size
    sums = np.zeros(count)
    rate = 0.0
    if scene.bonds is not None:
        kinds = scene.kinds
        sums += bond_row_sums(
            particles, scene.bonds, kinds, kinds.stiffness, kinds.angular_stiffness, True
        ).max(axis=0)
        rate = float(
            bond_row_sums(particles, scene.bonds, kinds, kinds.damping, kinds.angular_damping, False).max()
        )
    of_bonds = sums.copy()
    ratio = stiffness_ratio(scene)
    for name, family in zip(lists._fields, lists):
        if family is not None:
            with_parts, faces = name not in BETWEEN_PARTICLES, name == "box_boxes"
            pairs = family[0].first, family[0].second, family[0].stiffness
            contact_row_sums(particles, scene.shapes, *pairs, ratio, with_parts, faces, sums)
    if not count or sums.max() <= 0.0:
        return Limit(math.inf, "nothing")
    worst = int(np.argmax(sums))
    cause = "contacts" if sums[worst] > 2.0 * of_bonds[worst] else "bonds"
    return Limit(damped_limit(float(sums[worst]), rate), f"{cause} of particle {scene.population.id[worst]}")


def stiffness_ratio(scene: Scene) -> float:
    """Smallest ratio of tangential to normal contact stiffness: 4 G* / E*, or k_t / k_n."""
    normal, tangential = scene.laws[0], scene.laws[1]
    touching = normal > 0.0
    if not np.any(touching):
        return 1.0
    factor = 4.0 if isinstance(scene.laws, Laws) else 1.0
    return float(np.min(factor * tangential[touching] / normal[touching]))


def refuse_reference(scene: Scene, block, stage, *, booked: bool = False) -> None:
    """Raise `TimeStepError` if a scene has forces that depend on velocities, parts that move or an energy book.

    The book follows the kicks of velocity Verlet.
    """
    laws, kinds = scene.laws, scene.kinds
    spins, slides = stage.spins, stage.slides
    found = {
        "a *BOND TYPE with DAMPING FACTOR": kinds is not None and bool(np.any(kinds.damping)),
        "breakable bonds": scene.strength is not None,
        "a *CONTACT PROPERTY with RESTITUTION below 1": bool(np.any(laws.damping)),
        "a *CONTACT PROPERTY with FRICTION": bool(np.any(laws.friction) or np.any(laws.rolling_friction)),
        "*DAMPING": stage.drag > 0.0,
        "a *SOURCE": bool(scene.sources),
        "the energy book (FIELDS=ENERGY)": booked,
        "moving parts": bool(
            np.any(spins.mode == FREE) or np.any(spins.rate) or np.any(slides.mass) or np.any(slides.velocity)
        ),
        "particles led by an AMPLITUDE or a spin": bool(
            np.any(stage.guided.amplitude >= 0) or np.any(stage.guided.spin)
        ),
        "particles that spin against a bearing": stage.pivots is not None,
    }
    reasons = [name for name, is_there in found.items() if is_there]
    if reasons:
        raise TimeStepError(
            f"{block.where}: found INTEGRATOR=PEFRL with {', '.join(reasons)}, expected a scene whose forces depend on "
            "positions only, without a book; VERLET runs it"
        )
