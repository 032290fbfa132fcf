"""S4: the sample conveyor after its run, loaded and moving, as a state of beltsim.

Made once for each version of the solver's sources, since a checkpoint holds its arrays, and kept beside the settled
states of `settled.py`: converting and running takes some minutes.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

from settled import folder

from beltsim import checkpoint, inp
from beltsim.engine import State, advance_by, begin_stage, state_of
from beltsim.measures import measures_of
from beltsim.run import Tally, events_of, prepare, turn_over
from beltsim.scene import build
from beltsim.solver.cache import cache_folder
from beltsim.source import source_of

SAMPLE = Path(__file__).parent.parent / "samples" / "conveyor"
CONVERSIONS = (
    ("beltconverter.cli", "belt.stl", "belt.inp", "--unit mm --elongation 100.12% --fibres rows"),
    ("partconverter.cli", "frame.sat", "parts.inp", "--diameter-limit 300mm --name-by cad"),
)


def case() -> inp.Deck:
    """The sample's deck, converted from its CAD files as its demo does."""
    place = folder() / "conveyor"
    place.mkdir(exist_ok=True)
    for module, source, target, options in CONVERSIONS:
        if not (place / target).exists():
            words = [str(SAMPLE / source), "-o", str(place / target), *options.split(), "-q"]
            code = f"from {module} import main; main()"
            subprocess.run([sys.executable, "-c", code, *words], check=True)
    shutil.copy(SAMPLE / "case.inp", place / "case.inp")
    return inp.read_case(str(place / "case.inp"))


def begun(deck: inp.Deck) -> State:
    """The conveyor at its first moment."""
    state = state_of(build(deck))
    begin_stage(state, prepare(state, state.scene.steps[0], 0.0, lambda _: None, False))
    return state


def run_through(state: State) -> list:
    """Run the sample to its end, bulk coming and going; returns its sources."""
    scene = state.scene
    sources = [source_of(block, scene.population) for block in scene.sources]
    tally = Tally(next_id=int(scene.population.id.max()) + 1)
    tally.measures = measures_of(scene, set())
    tally.inserted = {source.name: 0.0 for source in sources}
    events = events_of(scene, scene.steps[0], state.stage, sources, [], scene.steps[0]["DURATION"], False)
    while state.step < events.end:
        advance_by(state, events.next_after(state.step) - state.step)
        turn_over(state, events, tally)
    return sources


def loaded() -> State:
    """The loaded conveyor at the end of its run; no more bulk comes from here on."""
    path = folder() / f"conveyor_{cache_folder().name}.h5"
    state = begun(case())
    if path.exists():
        checkpoint.put_back(checkpoint.load(path), state)
    else:
        run_through(state)
        checkpoint.save(checkpoint.take(state), path)
    return state


if __name__ == "__main__":
    print(loaded().scene.population.count, "particles in", folder())
