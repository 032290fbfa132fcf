"""Bulk that comes and goes: rate, room, repeatability, and what leaves the domain."""

import numpy as np
import pytest
import scenes

from beltsim import run as runs
from beltsim.engine import advance_by, renew_lists
from beltsim.scene import build
from beltsim.source import arrivals, pause_of, planned_count, source_of
from beltsim.turnover import insert, outside, remove

MASS = 1200.0 * 4.0 / 3.0 * np.pi * 0.01**3


def feeding_case(
    *, rate=2.0, velocity=(0.0, 0.0, -1.0), seed=1, types=None, time_step=5e-5, duration=1.0, **times
):
    """A source over nothing, in free fall."""
    deck = scenes.case(
        time_step=time_step, gravity=(0.0, 0.0, -9.81), duration=duration, friction=0.4, restitution=0.4
    )
    deck.add("PARTICLE TYPE", name="stone", shape="SPHERE", radius=0.01, material="stuff")
    deck.add("PARTICLE TYPE", name="grain", shape="SPHERE", radius=0.005, material="stuff")
    deck.add(
        "SOURCE",
        name="feed",
        particle_type=None if types else "stone",
        mass_rate=rate,
        seed=seed,
        rows={
            "box": [(-0.1, -0.1, 1.0, 0.1, 0.1, 1.1)],
            "velocity": [velocity],
            "fractions": types or [],
        },
        **times,
    )
    return deck


def feed(deck, steps):
    """Step a deck and visit its source as a run does; what came at each visit, and the state."""
    state = scenes.start(deck)
    scene, dt = state.scene, state.stage.time_step
    source = source_of(scene.sources[0], scene.population)
    period = max(1, round(pause_of(source, scene.population.bodies) / dt))
    came, next_id = [], 1 + int(scene.population.id.max(initial=0))
    for _ in range(steps // period):
        advance_by(state, period)
        new = arrivals(source, scene, state.time, next_id)
        if new is not None:
            renew_lists(state, insert(scene, new))
            next_id += new.id.size
            came.append((state.time, new, overlap_of_newest(state, new.id.size)))
    return state, source, came


def overlap_of_newest(state, count):
    """Largest overlap of the last `count` particles with any other."""
    p, radius = scenes.particles(state), state.scene.shapes.bounding
    deepest = -np.inf
    for n in range(p.mass.size - count, p.mass.size):
        distance = np.linalg.norm(p.position - p.position[:, [n]], axis=0)
        distance[n] = np.inf
        deepest = max(deepest, float((radius + radius[n] - distance).max()))
    return deepest


def test_the_mass_that_has_come_follows_the_rate_to_one_particle():
    _, source, came = feed(feeding_case(), 20_000)
    total = 0.0
    for time, new, _ in came:
        total += MASS * new.id.size
        assert 2.0 * time - MASS < total <= 2.0 * time
    assert source.inserted == pytest.approx(total, rel=1e-12)
    assert total > 2.0 - 2 * MASS


def test_start_and_end_bound_the_feed():
    _, source, came = feed(feeding_case(start=0.2, end=0.7), 20_000)
    assert came[0][0] > 0.2
    assert source.inserted == pytest.approx(2.0 * 0.5, abs=MASS)


def test_no_particle_comes_into_another():
    state, _, came = feed(feeding_case(rate=4.0, types=[("stone", 0.6), ("grain", 0.4)]), 10_000)
    assert len(came) > 50
    assert max(overlap for _, _, overlap in came) <= 0.0
    assert scenes.particles(state).mass.size > 400


def test_particles_come_inside_the_box_with_the_given_velocity():
    _, _, came = feed(feeding_case(velocity=(0.3, 0.1, -1.0)), 6000)
    for _, new, _ in came:
        assert np.all(np.abs(new.position[:, :2]) <= 0.09)
        assert np.all(np.abs(new.position[:, 2] - 1.05) <= 0.04)
        assert np.array_equal(new.velocity, np.tile((0.3, 0.1, -1.0), (new.id.size, 1)))


def test_ids_are_new_and_ascend():
    deck = feeding_case()
    scenes.add_particles(deck, "grain", [(5.0, 0.0, 0.0)])
    state, _, _ = feed(deck, 4000)
    assert np.array_equal(state.scene.population.id, 1 + np.arange(state.scene.population.count))


def test_mass_fractions_are_fractions_of_the_mass():
    _, source, came = feed(feeding_case(rate=4.0, types=[("stone", 0.6), ("grain", 0.4)]), 10_000)
    kinds = np.concatenate([new.species for _, new, _ in came])
    stones = MASS * np.count_nonzero(kinds == 0)
    # 240 stones among 1500 particles drawn at random: standard deviation about 6 % of their number
    assert stones / source.inserted == pytest.approx(0.6, abs=0.08)


def test_the_seed_decides_everything():
    first, again, other = (feed(feeding_case(seed=seed), 4000)[0] for seed in (3, 3, 4))
    places = [scenes.particles(state).position for state in (first, again, other)]
    assert np.array_equal(places[0], places[1])
    assert not np.array_equal(places[0][:, : places[2].shape[1]], places[2][:, : places[0].shape[1]])


def test_a_full_box_makes_the_feed_wait_and_never_overlap():
    """Nothing falls away: the box fills, and the achieved rate stays behind."""
    deck = feeding_case(rate=50.0, velocity=(0.0, 0.0, 0.0))
    deck.blocks("GRAVITY")[0].rows["acceleration"][:] = 0.0
    _, source, came = feed(deck, 10_000)
    assert max(overlap for _, _, overlap in came) <= 0.0
    assert MASS < source.inserted < 0.5 * source.due(0.5)


@pytest.mark.parametrize("types", [None, [("stone", 0.5), ("grain", 0.5)]])
def test_the_planned_count_is_never_exceeded(types):
    deck = feeding_case(types=types)
    state, _, _ = feed(deck, 20_000)
    planned = planned_count(state.scene.sources[0], state.scene.population, 1.0)
    assert planned - 1 <= state.scene.population.count <= planned


def test_what_leaves_the_domain_is_removed_and_the_rest_stays():
    deck = scenes.case(time_step=1e-4)
    deck.add("DOMAIN", rows={"box": [(-1.0, -1.0, -1.0, 1.0, 1.0, 1.0)]})
    places = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.9, 0.9, -0.9), (0.0, -1.1, 0.0), (0.0, 0.0, 1e9)]
    scenes.add_spheres(deck, places, radius=0.1)
    scenes.add_spheres(deck, [(3.0, 0.0, 0.0)], radius=0.1, name="held", fixed="YES")
    scenes.add_boxes(deck, [(0.0, 4.0, 0.0)], size=(0.1, 0.1, 0.1), edge_radius=0.01, group="belt")
    state = scenes.start(deck)
    renew_lists(state, remove(state.scene, outside(state.scene)))
    advance_by(state, 10)
    assert set(state.scene.population.id.tolist()) == {1, 3, 6, 7}


def test_loads_follow_their_particles_when_others_leave():
    deck = scenes.case(time_step=1e-4)
    deck.add("DOMAIN", rows={"box": [(-1.0, -1.0, -1.0, 1.0, 1.0, 1.0)]})
    scenes.add_spheres(deck, [(2.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.5, 0.0, 0.0)], radius=0.1)
    zero = [(0.0, 0.0, 0.0)] * 2
    deck.add("FORCE", rows={"id": [1, 2], "force": [(0, 9.0, 0), (0, 0, 1.0)], "torque": zero})
    deck.add("MOTION", particles="3", type="VELOCITY", rows={"vector": [(0.1, 0.0, 0.0, 0.0, 2.0, 0.0)]})
    state = scenes.start(deck)
    renew_lists(state, remove(state.scene, outside(state.scene)))
    advance_by(state, 100)
    p = scenes.particles(state)
    two, three = scenes.slot(state, 2), scenes.slot(state, 3)
    assert p.velocity[:, two] * p.mass[two] == pytest.approx([0.0, 0.0, 0.01], rel=1e-2)
    assert p.velocity[:, three].tolist() == [0.1, 0.0, 0.0]
    assert p.angular_velocity[:, three].tolist() == [0.0, 2.0, 0.0]
    assert not p.angular_velocity[:, two].any()


def test_a_load_whose_particle_has_left_is_no_load_of_the_next_step():
    deck = scenes.case(time_step=1e-4)
    deck.blocks("STEP")[0].parameters["NAME"] = "one"
    deck.add("STEP", name="two", duration=1.0, time_step=1e-4)
    deck.add("DOMAIN", rows={"box": [(-1.0, -1.0, -1.0, 1.0, 1.0, 1.0)]})
    scenes.add_spheres(deck, [(2.0, 0.0, 0.0), (0.0, 0.0, 0.0), (9.0, 0.0, 0.0)], radius=0.1)
    zero = [(0.0, 0.0, 0.0)] * 2
    deck.add("FORCE", rows={"id": [1, 3], "force": [(0, 9.0, 0)] * 2, "torque": zero})
    deck.add("MOTION", particles="3", type="VELOCITY", rows={"vector": [(0.1, 0.0, 0.0)]})
    state = scenes.start(deck)
    renew_lists(state, remove(state.scene, outside(state.scene)))
    scenes.next_step(state, 1)
    advance_by(state, 100)
    assert state.scene.population.id.tolist() == [2]
    assert not scenes.particles(state).velocity.any()


def test_a_run_reports_what_came_and_what_left(tmp_path):
    deck = feeding_case(duration=0.5)
    deck.add("DOMAIN", rows={"box": [(-1.0, -1.0, 0.5, 1.0, 1.0, 2.0)]})
    scene = build(deck)
    tally = runs.run(deck, scene, str(tmp_path / "run.h5"), allow_unstable=True)
    assert tally.inserted["feed"] == pytest.approx(1.0, abs=MASS)
    assert tally.achieved("feed") == pytest.approx(2.0, abs=2.1 * MASS)
    inside = scene.population.particles.mass.sum()
    assert tally.removed > 50
    assert tally.removed_mass == pytest.approx(tally.removed * MASS, rel=1e-12)
    assert inside + tally.removed_mass == pytest.approx(tally.inserted["feed"], rel=1e-12)
    assert scene.population.particles.position[2].min() > 0.5 - 0.06  # a look every 10 ms at up to 4 m/s


def placed(deck, time=0.5):
    """Places (k, 3) of all stones that a source brings at once."""
    scene = build(deck)
    return arrivals(source_of(scene.sources[0], scene.population), scene, time, 1).position


def test_a_source_places_nothing_in_parts(tmp_path):
    """A plane and a plate that cut the box, a roller and an idler particle in it: all stones keep their distance."""
    deck = feeding_case(rate=20.0)
    scenes.add_plane(deck, point=(0.0, 0.0, 1.02))
    plate = np.array([(-0.1, -0.1, 1.06), (0.0, -0.1, 1.06), (0.0, 0.1, 1.06), (-0.1, 0.1, 1.06)])
    scenes.add_mesh(deck, tmp_path / "plate.stl", plate, [(0, 1, 2), (0, 2, 3)])
    scenes.add_cylinder(deck, diameter=0.05, length=0.3, point=(0.05, 0.0, 1.06))
    deck.add(
        "PARTICLE TYPE",
        name="idler",
        shape="CYLINDER",
        diameter=0.04,
        length=1.0,
        edge_radius=0.0,
        material="stuff",
        fixed="POSITION",
    )
    scenes.add_particles(deck, "idler", [(-0.05, 0.08, 1.09)], orientation=scenes.ALONG_X)
    x, y, z = placed(deck).T
    least = 0.01 * (1 - 1e-5)  # the file of the plate is in single precision
    assert z.size > 20
    assert (z - 1.02 >= least).all()
    assert (np.hypot(x - 0.05, z - 1.06) >= 0.025 + least).all()
    assert (np.hypot(y - 0.08, z - 1.09) >= 0.02 + least).all()
    assert (np.hypot(np.maximum(x, 0.0), z - 1.06) >= least).all()


def test_parts_of_a_group_that_stones_do_not_touch_are_no_obstacle():
    deck = feeding_case(rate=20.0)
    deck.add("CONTACT GROUP", name="ghosts")
    deck.blocks("PARTICLE TYPE")[0].parameters["CONTACT GROUP"] = "ghosts"
    scenes.add_plane(deck, point=(0.0, 0.0, 2.0), group="ghosts")
    assert len(placed(deck)) > 20
