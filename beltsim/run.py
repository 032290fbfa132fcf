"""A run from deck to trajectory: stages, frames, bulk that comes and goes. It holds the order of things, no physics."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from beltsim.ahead import helped, jobs_of, without_collection
from beltsim.breakage import Breaks, gather_breaks
from beltsim.energy import OBSERVABLES as TERMS
from beltsim.energy import account_of, departing, drift, note_arrivals, note_departures
from beltsim.engine import (
    BlowUp,
    Stage,
    State,
    advance_by,
    begin_stage,
    find_forces,
    renew_lists,
    state_of,
)
from beltsim.fill import fill_belts
from beltsim.inp import Block, Deck
from beltsim.lists import overlaps_of
from beltsim.measures import LOOK_PAUSE, Measures, look, measures_of, remember
from beltsim.record import OBSERVABLES, contents_of, frame_of, keeps_energy
from beltsim.scene import Scene
from beltsim.scene.guiding import guides_of
from beltsim.scene.machinery import acts_in, drives_of, table_of, unit_warnings
from beltsim.signals import Stop, Stopped
from beltsim.solver.steps import GivenLoads
from beltsim.source import Source, arrivals, pause_of, planned_count, source_of
from beltsim.stepsize import choose, present_limit, refuse_reference
from beltsim.threads import permitted, start_team, team_of, too_many
from beltsim.trajectory import Frame, TrajectoryWriter
from beltsim.turnover import insert, outside, remove

LONGEST_BATCH = 0.25  # s of wall time between two looks at signals
DEEP_OVERLAP = 0.1  # of the smaller radius: ten times what a well chosen stiffness gives
DOMAIN_PAUSE = 0.01  # s of simulated time between two looks at the domain's bounds


@dataclass
class Progress:
    """What a run tells while it goes on."""

    time: float  # s, simulated
    end: float  # s
    steps: int
    particles: int
    wall: float  # s, compilation apart
    fastest: float  # m/s
    particle_steps: float
    energy_drift: float | None = None  # residual over the largest term, at the last frame


@dataclass
class Tally:
    """What a run counts."""

    inserted: dict[str, float] = field(default_factory=dict)  # kg by source
    removed_mass: float = 0.0  # kg
    removed: int = 0
    next_id: int = 1
    particle_steps: float = 0.0
    wall: float = 0.0  # s, compilation apart
    compile_time: float = 0.0  # s
    warned: bool = False
    messages: list[str] = field(default_factory=list)
    open_time: dict[str, float] = field(default_factory=dict)  # s that each source was open
    measures: Measures | None = None
    breaks: Breaks = field(default_factory=Breaks)
    energy_drift: float | None = None

    def masses(self) -> dict[str, float]:
        """Inserted and removed mass, for the trajectory."""
        return {"inserted_mass": sum(self.inserted.values()), "removed_mass": self.removed_mass}

    def achieved(self, name: str) -> float:
        """Mass rate [kg/s] that a source achieved while it was open."""
        return self.inserted[name] / self.open_time[name] if self.open_time.get(name) else 0.0


@dataclass
class Events:
    """Steps of a stage at which something happens beside stepping."""

    end: int
    frames: list[int]
    visits: list[tuple[Source, int]]  # source, every so many steps
    domain: int  # every so many steps, 0: never
    looks: int  # every so many steps, 0: never

    def next_after(self, step: int) -> int:
        """The next step at which something happens."""
        frame = next((frame for frame in self.frames if frame > step), self.end)
        periods = [period for _, period in self.visits] + [self.domain, self.looks]
        periods = [period for period in periods if period]
        return min([frame, *((step // period + 1) * period for period in periods)])


def run(
    deck: Deck,
    scene: Scene,
    path: str,
    *,
    until: float = math.inf,
    allow_unstable: bool = False,
    case_text: bytes = b"",
    provenance: dict | None = None,
    threads: int | None = None,
    report: Callable[[Progress], None] = lambda _: None,
    say: Callable[[str], None] = lambda _: None,
    stop: Stop | None = None,
) -> Tally:
    """Run a scene and write its trajectory to `path`.

    Parameters
    ----------
    until : total time [s] at which to end, if that is before the last step's end
    allow_unstable : run with a given time step above the stability limit
    threads : how many to use at most; None chooses
    report, say : take progress and messages
    stop : asked between batches; an exit code ends the run in good order. None: never

    Raises
    ------
    TimeStepError, BlowUp, Stopped
    """
    stop = stop or Stop(at_once=False)
    for filled in fill_belts(scene):
        say(
            f"fill {filled.belt}: {filled.count} particles of {filled.particle_type}, {filled.mass:.4g} kg, "
            "with the belt's velocity"
        )
    state, tally = state_of(scene), Tally()
    tally.next_id = int(scene.population.id.max(initial=0)) + 1
    end = min(until, sum(block["DURATION"] for block in scene.steps))
    sources = [source_of(block, scene.population) for block in scene.sources]
    tally.inserted = {source.name: 0.0 for source in sources}
    arriving = sum(planned_count(block, scene.population, end) for block in scene.sources)
    outputs = deck.blocks("OUTPUT")
    tally.measures = measures_of(scene, {name for name, _, _ in OBSERVABLES + TERMS})
    if outputs and keeps_energy(outputs[0]):
        state.account = account_of(scene)
    contents = contents_of(scene, arriving, outputs[0] if outputs else None, tally.measures)
    state.team = team_of(threads, scene.population.count + arriving)
    with without_collection(), helped(jobs_of(state), permitted()):
        provenance = {**(provenance or {}), **start_team(state.team)}
        first = prepare(state, scene.steps[0], 0.0, say, allow_unstable)
        planned = planned_frames(scene, outputs, end)
        say("preparing kernels; a scene of a new kind compiles them first, once, in half a minute at most")
        compile_kernels(state, first, tally)
    tally.messages += [
        *overlap_warnings(state),
        *until_warnings(scene, until),
        *unit_warnings(deck, scene.machinery),
        *too_many(threads),
    ]
    for message in tally.messages:
        say(message)
    with (
        stop.mode(at_once=False),
        TrajectoryWriter(
            path, contents, planned_frames=planned, case_text=case_text, provenance=provenance
        ) as writer,
    ):
        writer.append(frame_now(state, contents, tally))
        start = 0.0
        for number, block in enumerate(scene.steps):
            if start >= end:
                break
            stage = first if number == 0 else prepare(state, block, start, say, allow_unstable)
            if number > 0:
                with stop.mode(at_once=True):
                    compile_kernels(state, stage, tally)
            stage_end, flows = min(end, start + block["DURATION"]), bool(tally.measures.flows)
            events = events_of(scene, block, stage, sources, outputs, stage_end, flows)
            try:
                run_stage(state, events, writer, contents, tally, end, report, say, stop)
            except BlowUp:
                save_last(state, contents, tally, writer)
                raise
            finally:
                gather_breaks(state, tally.breaks)
                writer.write_breaks(tally.breaks.table())
            start = state.time
    return tally


def prepare(state: State, block: Block, start: float, say, allow_unstable: bool) -> Stage:
    """The stage of a *STEP: what moves, what loads, and its time step."""
    scene = state.scene
    name = block.get("NAME")
    before = None if state.stage is None else state.stage.slides
    spins, slides = drives_of(scene.deck, scene.machinery, scene.tables, name, before)
    guided, pivots = guides_of(scene.deck, scene.population, scene.tables, name)
    time_step, sentence = choose(scene, block, spins, slides, guided, allow_unstable=allow_unstable)
    say((f"step {name}: " if name else "") + sentence)
    drag, wind = damping_of(scene, name, say)
    given = given_loads(scene, name)
    stage = Stage(time_step, start, spins, slides, given, drag, wind, guided, pivots, block["INTEGRATOR"])
    if stage.integrator == "PEFRL":
        refuse_reference(scene, block, stage, booked=state.account is not None)
    return stage


def damping_of(scene: Scene, step_name: str | None, say) -> tuple[float, tuple]:
    """Global damping of a step, said aloud."""
    for block in scene.deck.blocks("DAMPING"):
        if acts_in(block, step_name) and block["MASS PROPORTIONAL"] > 0.0:
            rows = block.rows["velocity"]
            wind = tuple(float(v) for v in rows[0]) if len(rows) else (0.0, 0.0, 0.0)
            say(
                f"global damping of {block['MASS PROPORTIONAL']:g} 1/s towards {wind} m/s acts on all particles"
            )
            return float(block["MASS PROPORTIONAL"]), wind
    return 0.0, (0.0, 0.0, 0.0)


def given_loads(scene: Scene, step_name: str | None) -> GivenLoads | None:
    """Loads of the *FORCE blocks that act in a step."""
    blocks = [block for block in scene.deck.blocks("FORCE") if acts_in(block, step_name) and len(block)]
    if not blocks:
        return None
    ids = np.concatenate([block.rows["id"] for block in blocks])
    load = np.concatenate([np.hstack([block.rows["force"], block.rows["torque"]]) for block in blocks])
    table = np.concatenate([np.full(len(block), table_of(block, scene.tables)) for block in blocks])
    there = scene.population.present(ids)
    return GivenLoads(
        scene.population.slots_of(ids[there]).astype(np.int32),
        np.ascontiguousarray(load[there].T, dtype=np.float64),
        table[there].astype(np.int32),
    )


def compile_kernels(state: State, stage: Stage, tally: Tally) -> None:
    """Begin a stage; the first time this compiles, which never counts in speed figures."""
    clock = time.perf_counter()
    begin_stage(state, stage)
    if state.total_steps == 0:  # the first new lists take over the history of the old ones: another kernel
        renew_lists(state)
        find_forces(state)
    tally.compile_time += time.perf_counter() - clock


def until_warnings(scene: Scene, until: float) -> list[str]:
    """A word about an end that lies behind the last step."""
    total = sum(block["DURATION"] for block in scene.steps)
    if not total < until < math.inf:
        return []
    return [f"warning: the steps end at {total:g} s, before --until {until:g}"]


def overlap_warnings(state: State) -> list[str]:
    """A word about spheres that overlap deeply before the first step: they will burst apart."""
    scene = state.scene
    radius, ids = scene.shapes.radius, scene.population.id
    names = [part.name for part in scene.machinery.info]
    found = []
    for family, of_parts in ((state.lists.spheres, False), (state.lists.sphere_parts, True)):
        if family is None:
            continue
        contacts, overlap = family[0], overlaps_of(family, scene.population.particles, scene.shapes)
        share = overlap / radius[contacts.first]
        if not of_parts:
            share = np.maximum(share, overlap / radius[contacts.second])
        for k in np.flatnonzero(share > DEEP_OVERLAP):
            other = f"part {names[contacts.second[k]]}" if of_parts else f"particle {ids[contacts.second[k]]}"
            found.append(
                f"particle {ids[contacts.first[k]]} and {other} overlap by {overlap[k]:.3g} m "
                f"({100.0 * share[k]:.0f} % of the radius)"
            )
    if not found:
        return []
    more = f" and {len(found) - 5} pairs more" if len(found) > 5 else ""
    return [f"warning: before the first step {'; '.join(found[:5])}{more}: they will burst apart"]


def planned_frames(scene: Scene, outputs: list[Block], end: float) -> int:
    """Frames that the run will write, the first included."""
    total, start = 1, 0.0
    for block in scene.steps:
        stop = min(end, start + block["DURATION"])
        interval = interval_of(outputs, block.get("NAME"), block["DURATION"])
        total += max(0, math.ceil((stop - start) / interval - 1e-9)) + 1
        start += block["DURATION"]
    return total


def interval_of(outputs: list[Block], step_name: str | None, duration: float) -> float:
    """Time between frames in a step: that of its own *OUTPUT, else of the general one, else its whole duration."""
    acting = [block for block in outputs if acts_in(block, step_name)]
    acting.sort(key=lambda block: block.get("STEP") is None)
    return acting[0]["INTERVAL"] if acting else duration


def events_of(
    scene: Scene,
    block: Block,
    stage: Stage,
    sources: list[Source],
    outputs: list[Block],
    stop: float,
    flows: bool,
) -> Events:
    """Everything that will happen in a stage that ends at total time `stop`."""
    dt, name = stage.time_step, block.get("NAME")
    end = max(1, math.ceil((stop - stage.start) / dt - 1e-6))
    interval = interval_of(outputs, name, block["DURATION"])
    every = max(interval / dt, 1.0)  # steps; frames may be due more often than steps are made
    count = math.ceil(end / every - 1e-9)
    frames = sorted({min(end, max(1, round(k * every))) for k in range(1, count + 1)} | {end})
    visits = [
        (source, max(1, round(pause_of(source, scene.population.bodies) / dt)))
        for source in sources
        if source.step_name in (None, name)
    ]
    domain = max(1, round(DOMAIN_PAUSE / dt)) if scene.domain is not None else 0
    looks = max(1, round(LOOK_PAUSE / dt)) if flows else 0
    return Events(end, frames, visits, domain, looks)


def run_stage(state, events, writer, contents, tally, end, report, say, stop) -> None:
    """Step through a stage from event to event, in batches short enough to be interrupted."""
    frames, pace = set(events.frames), 1
    while state.step < events.end:
        code = stop()
        if code is not None:
            raise Stopped(f"stopped at t = {state.time:.6g} s; {writer.frames} frames are written", code)
        clock = time.perf_counter()
        steps = min(events.next_after(state.step) - state.step, pace)
        due = state.step + steps == events.next_after(state.step)
        advance_by(state, steps)
        if due and events.looks:
            look(tally.measures, state.scene)
        turn_over(state, events, tally)
        wall = time.perf_counter() - clock
        tally.wall += wall
        tally.particle_steps += steps * state.scene.population.count
        pace = max(1, min(4 * pace, int(LONGEST_BATCH * steps / max(wall, 1e-6))))
        if state.step in frames:
            writer.append(frame_now(state, contents, tally))
            gather_breaks(state, tally.breaks)
            warn_if_unstable(state, tally, say)
        report(progress_of(state, tally, end))


def turn_over(state: State, events: Events, tally: Tally) -> None:
    """Let bulk in and out, where this step is one for it."""
    scene = state.scene
    for source, period in events.visits:
        if state.step % period == 0:
            new = arrivals(source, scene, state.time, tally.next_id)
            if new is not None:
                renew_lists(state, insert(scene, new))
                if state.account is not None:
                    note_arrivals(state, new.id)
                remember(tally.measures, scene)
                tally.next_id += new.id.size
                tally.inserted[source.name] = source.inserted
            tally.open_time[source.name] = max(0.0, min(state.time, source.end) - source.start)
    if events.domain and state.step % events.domain == 0:
        leaves = outside(scene)
        if np.any(leaves):
            tally.removed += int(np.count_nonzero(leaves))
            tally.removed_mass += float(scene.population.particles.mass[leaves].sum())
            before = 0.0 if state.account is None else departing(state, leaves)
            renew_lists(state, remove(scene, leaves))
            if state.account is not None:
                note_departures(state, before)


def warn_if_unstable(state: State, tally: Tally, say) -> None:
    """Say once if contacts have grown so stiff that the time step is beyond the bound."""
    limit = present_limit(state)
    if state.stage.time_step > limit.time_step and not tally.warned:
        tally.warned = True
        message = (
            f"warning: at t = {state.time:.4g} s the time step of {state.stage.time_step:.3g} s is above the bound of "
            f"{limit.time_step:.3g} s set by {limit.cause}; a smaller SAFETY or TIME STEP is advised"
        )
        tally.messages.append(message)
        say(message)


def save_last(state: State, contents, tally: Tally, writer: TrajectoryWriter) -> None:
    """After a blow-up: the state that diverged, if it can still be written."""
    if np.all(np.isfinite(state.scene.population.particles.position)):
        writer.append(frame_now(state, contents, tally))


def frame_now(state: State, contents, tally: Tally) -> Frame:
    """The present state as a frame; notes the drift of the energy."""
    frame = frame_of(state, contents, tally.masses(), tally.measures)
    if state.account is not None:
        tally.energy_drift = drift(state.account, frame.observables)
    return frame


def progress_of(state: State, tally: Tally, end: float) -> Progress:
    """How far the run is."""
    particles = state.scene.population.particles
    fastest = float(np.sqrt(np.max(np.sum(particles.velocity**2, axis=0), initial=0.0)))
    return Progress(
        state.time,
        end,
        state.total_steps,
        particles.mass.size,
        tally.wall,
        fastest,
        tally.particle_steps,
        tally.energy_drift,
    )
