"""A run that is interrupted and taken up again goes on bit for bit."""

import numpy as np
import pytest
from scenes import ALONG_Y, SOFT

from beltsim import inp
from beltsim.checkpoint import CheckpointError, load, put_back, save, take
from beltsim.engine import advance_by, begin_stage, state_of
from beltsim.measures import measures_of
from beltsim.run import Tally, events_of, prepare, turn_over
from beltsim.scene import build
from beltsim.solver.state import CACHE_LINE
from beltsim.source import source_of

UPRIGHT = [1.0, 0.0, 0.0, 0.0]
PITCH, ROWS, COLUMNS = 0.05, 9, 3
STEPS = 1600


def case() -> inp.Deck:
    """A breakable strip over two free rollers, under a source of spheres with rolling friction."""
    deck = inp.Deck()
    deck.add("FORMAT", name="BELTSIM", version=1)
    deck.add("MATERIAL", name="stuff", **SOFT)
    deck.add(
        "CONTACT PROPERTY",
        material_a="*",
        material_b="*",
        friction=0.4,
        restitution=0.5,
        rolling_friction=0.1,
    )
    deck.add("CONTACT GROUP", name="belt", belt="belt")
    size = {f"size_{axis}": length for axis, length in zip("xyz", (0.058, 0.058, 0.01))}
    deck.add("PARTICLE TYPE", name="b", shape="ROUNDED BOX", edge_radius=0.004, material="stuff",
             contact_group="belt", **size)  # fmt: skip
    deck.add("PARTICLE TYPE", name="s", shape="SPHERE", radius=0.01, material="stuff")
    deck.add("PARTICLE TYPE", name="big", shape="SPHERE", radius=0.015, material="stuff")
    ids = np.arange(1, ROWS * COLUMNS + 1).reshape(ROWS, COLUMNS)
    place = np.array([[i * PITCH, j * PITCH, 0.0] for i in range(ROWS) for j in range(COLUMNS)])
    deck.add(
        "PARTICLE", type="b", rows={"id": ids.ravel(), "position": place, "orientation": [UPRIGHT] * ids.size}
    )
    deck.add("BOND TYPE", name="t", section_width=0.05, section_thickness=0.01, youngs_modulus=2e7, poisson_ratio=0.3,
             damping_factor=0.05, tensile_strength=3e6)  # fmt: skip
    for pairs, step in ((np.c_[ids[:-1].ravel(), ids[1:].ravel()], [PITCH, 0, 0]),
                        (np.c_[ids[:, :-1].ravel(), ids[:, 1:].ravel()], [0, PITCH, 0])):  # fmt: skip
        n = len(pairs)
        deck.add("BOND", type="t", rows={
            "particles": pairs, "position_1": np.zeros((n, 3)), "orientation_1": [UPRIGHT] * n,
            "position_2": [step] * n, "orientation_2": [UPRIGHT] * n,
        })  # fmt: skip
    for n, x in enumerate((0.05, 0.35)):
        rows = {"position": [[x, 0.05, -0.0548]], "orientation": [ALONG_Y]}
        deck.add(
            "PART", name=f"roll_{n}", shape="CYLINDER", diameter=0.1, length=0.2, material="stuff", rows=rows
        )
    deck.add("MOTION", part="roll_*", type="FREE ROTATION", inertia=0.001, friction_torque=0.001)
    deck.add("GRAVITY", rows={"acceleration": [[0.0, 0.0, -9.81]]})
    source = {
        "box": [[0.1, 0.0, 0.03, 0.3, 0.1, 0.1]],
        "velocity": [[0.5, 0.0, -1.0]],
        "fractions": [("s", 0.6), ("big", 0.4)],
    }
    deck.add("SOURCE", name="feed", mass_rate=3.0, seed=7, rows=source)
    deck.add("STEP", duration=1.0, time_step=5e-5)
    return inp.read_text(inp.dumps(deck))


class Going:
    """A case under way, with its source."""

    def __init__(self):
        deck = case()
        self.scene = build(deck)
        self.state = state_of(self.scene)
        stage = prepare(self.state, self.scene.steps[0], 0.0, lambda _: None, False)
        begin_stage(self.state, stage)
        self.sources = [source_of(block, self.scene.population) for block in self.scene.sources]
        self.events = events_of(self.scene, self.scene.steps[0], stage, self.sources, [], 1.0, False)
        self.tally = Tally(inserted={"feed": 0.0}, next_id=1000, measures=measures_of(self.scene, set()))

    def go(self, steps: int) -> None:
        """Advance, letting bulk in."""
        end = self.state.step + steps
        while self.state.step < end:
            advance_by(self.state, min(self.events.next_after(self.state.step), end) - self.state.step)
            turn_over(self.state, self.events, self.tally)


def flat(tree, name="") -> dict:
    """All leaves of a checkpoint by path."""
    if not isinstance(tree, dict) or "bit_generator" in tree:
        return {name: tree}
    return {path: leaf for key, value in tree.items() for path, leaf in flat(value, f"{name}/{key}").items()}


@pytest.fixture(scope="module")
def halfway():
    """A run at half its steps, its checkpoint there, and the tally's next id."""
    run = Going()
    run.go(STEPS)
    return run, take(run.state, run.sources), run.tally.next_id


def test_resumed_run_is_the_same_to_the_last_bit(halfway, tmp_path):
    """Contact springs, broken bonds, list order, random state and counts included; through a file."""
    run, checkpoint, next_id = halfway
    assert checkpoint["id"].size > ROWS * COLUMNS + 5  # bulk is there
    assert np.any(checkpoint["lists"]["boxes"]["0"]["spring"])  # and rubs on the belt
    save(checkpoint, tmp_path / "half.chk.h5")
    resumed = Going()
    put_back(load(tmp_path / "half.chk.h5"), resumed.state, resumed.sources)
    resumed.tally.next_id = next_id
    run.go(STEPS)
    resumed.go(STEPS)
    whole, again = flat(take(run.state, run.sources)), flat(take(resumed.state, resumed.sources))
    assert whole.keys() == again.keys()
    different = [path for path in whole if not np.array_equal(whole[path], again[path])]
    assert not different


def test_taking_a_checkpoint_changes_nothing(halfway):
    """A checkpoint shares no array with the run that goes on."""
    run = Going()
    run.go(20)
    checkpoint = take(run.state, run.sources)
    before = {path: np.copy(leaf) for path, leaf in flat(checkpoint).items() if isinstance(leaf, np.ndarray)}
    run.go(20)
    after = flat(checkpoint)
    assert all(np.array_equal(before[path], after[path]) for path in before)


def test_other_files_are_refused(tmp_path):
    path = tmp_path / "x.h5"
    path.write_text("no")
    with pytest.raises(CheckpointError):
        load(path)


def test_the_state_of_particles_begins_at_cache_lines(halfway):
    """Also once spheres have come, and in a state that was put back: vectors across two lines cost 3 to 8 %."""
    run, checkpoint, _ = halfway
    again = Going()
    put_back(checkpoint, again.state, again.sources)
    for each in (run, again):
        starts = [array.ctypes.data % CACHE_LINE for array in each.state.scene.population.particles]
        assert not any(starts)
