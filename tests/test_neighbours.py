"""Near pairs against all pairs, and contact history that survives new lists, arrivals and departures."""

import itertools

import numpy as np
import pytest
import scenes
from scipy.spatial.transform import Rotation
from test_shapes import cylinder_distance

from beltsim import engine, trajectory
from beltsim.engine import advance_by, renew_lists
from beltsim.run import run
from beltsim.scene import build
from beltsim.turnover import Arrivals, insert, remove, sort_free


def of_ids(state, family):
    """Pairs of a list as a list of (id, id), or (id, part) for lists with parts, in list order."""
    contacts = getattr(state.lists, family)[0]
    ids = state.scene.population.id
    second = contacts.second if family.endswith("parts") else ids[contacts.second]
    return list(zip(ids[contacts.first].tolist(), second.tolist()))


def near_ids(state, *, margin, among, against=None):
    """Pairs of ids whose bounding spheres are closer than a margin, by trying all pairs."""
    p, bounding, ids = scenes.particles(state), state.scene.shapes.bounding, state.scene.population.id
    order = {int(i): n for n, i in enumerate(ids)}
    pairs = itertools.combinations(among, 2) if against is None else itertools.product(among, against)
    found = set()
    for a, b in pairs:
        i, j = order[int(a)], order[int(b)]
        gap = np.linalg.norm(p.position[:, i] - p.position[:, j]) - bounding[i] - bounding[j]
        if gap < margin:
            found.add((int(a), int(b)))
    return found


def unordered(pairs):
    return {frozenset(pair) for pair in pairs}


def crowd(rng, *, offset=(0.0, 0.0, 0.0)):
    """Spheres whose sizes differ up to 1:100, boxes and parts, at random; returns the state and the ids by kind."""
    deck = scenes.case(time_step=1e-6, rolling=0.1)
    offset = np.array(offset)
    ids = {}
    for name, radius, count, extent in [
        ("dust", 0.0005, 200, 0.1),
        ("pebble", 0.01, 120, 0.12),
        ("rock", 0.05, 12, 0.15),
    ]:
        places = offset + rng.uniform(-extent, extent, (count, 3))
        ids[name] = scenes.add_spheres(deck, places, radius=radius, name=name)
    places = offset + rng.uniform(-0.15, 0.15, (30, 3))
    turned = Rotation.random(30, random_state=rng).as_quat(scalar_first=True)
    ids["box"] = scenes.add_boxes(
        deck, places, size=(0.04, 0.06, 0.01), edge_radius=0.004, group="belt", orientation=turned
    )
    tilt = tuple(Rotation.random(random_state=rng).as_quat(scalar_first=True))
    scenes.add_cylinder(deck, diameter=0.1, length=0.3, point=tuple(offset), orientation=tilt, name="tilted")
    scenes.add_cylinder(deck, diameter=0.02, length=0.6, point=tuple(offset + 0.1), name="thin")
    scenes.add_plane(deck, point=tuple(offset - np.array((0, 0, 0.1))), group="floor_group")
    deck.add("CONTACT GROUP", name="floor_group")
    deck.add("CONTACT GROUP PAIR", group_a="belt", group_b="floor_group", contact=False)
    return scenes.start(deck), ids


@pytest.mark.parametrize("offset", [(0.0, 0.0, 0.0), (1e5, -1e5, 2.0**17)])
def test_the_lists_hold_exactly_the_near_pairs(offset, rng):
    state, ids = crowd(rng, offset=offset)
    spheres = np.concatenate([ids["dust"], ids["pebble"], ids["rock"]])
    wanted = near_ids(state, margin=state.skin, among=spheres)
    listed = of_ids(state, "spheres")
    assert len(listed) == len(set(listed)) > 30
    assert unordered(listed) == unordered(wanted)
    wanted = near_ids(state, margin=state.skin, among=spheres, against=ids["box"])
    listed = of_ids(state, "boxes")
    assert len(listed) == len(set(listed)) > 50
    assert set(listed) == wanted


def test_lists_are_sorted_so_that_sums_have_one_order(rng):
    state, _ = crowd(rng)
    for family in ("spheres", "boxes", "sphere_parts", "box_parts"):
        contacts = getattr(state.lists, family)[0]
        rows = contacts.second if family.endswith("parts") else contacts.first
        keys = contacts.first if family.endswith("parts") else contacts.second
        assert np.array_equal(np.lexsort((keys, rows)), np.arange(rows.size))


@pytest.mark.parametrize("family", ["sphere_parts", "box_parts"])
def test_no_particle_near_a_part_is_missed(family, rng):
    state, ids = crowd(rng)
    listed = set(of_ids(state, family))
    kinds = ("dust", "pebble", "rock") if family == "sphere_parts" else ("box",)
    p, parts = scenes.particles(state), state.scene.machinery.parts
    for particle in np.concatenate([ids[kind] for kind in kinds]):
        n = scenes.slot(state, particle)
        for part in range(3):
            frame = Rotation.from_quat(parts.orientation[:, part], scalar_first=True)
            local = frame.inv().apply(p.position[:, n] - parts.position[:, part])
            distance = (
                local[2]
                if np.isinf(parts.radius[part])
                else cylinder_distance(local[None], parts.radius[part], parts.half_length[part], 0.0)[0]
            )
            near = distance - state.scene.shapes.bounding[n] < state.skin
            forbidden = part == 2 and family == "box_parts"
            if near:
                assert ((particle, part) in listed) == (not forbidden)
    assert len(listed) > 5


def test_bonded_pairs_and_pairs_of_one_group_are_never_listed():
    deck = scenes.case(time_step=1e-6)
    for group in ("left", "right", "other"):
        deck.add("CONTACT GROUP", name=group, belt=None if group == "other" else "belt")
    for n, group in enumerate(("left", "right", "other", None)):
        scenes.add_spheres(
            deck, [(0.01 * n, 0.02 * k, 0.0) for k in range(3)], radius=0.05, name=f"s{n}", group=group
        )
    deck.add("BOND TYPE", name="rope", radius=0.01, youngs_modulus=1e6, poisson_ratio=0.3, damping_factor=0.0)
    rows = {
        "particles": [(10, 11), (12, 7)],
        "position_1": [(0, 0, 0)] * 2,
        "orientation_1": [scenes.UPRIGHT] * 2,
        "position_2": [(0.02, 0, 0)] * 2,
        "orientation_2": [scenes.UPRIGHT] * 2,
    }
    deck.add("BOND", type="rope", rows=rows)
    state = scenes.start(deck)
    belts = [{1, 2, 3, 4, 5, 6}, {7, 8, 9}]
    wanted = {
        frozenset(pair)
        for pair in itertools.combinations(range(1, 13), 2)
        if not any(set(pair) <= belt for belt in belts)
    } - {frozenset((10, 11)), frozenset((12, 7))}
    assert unordered(of_ids(state, "spheres")) == wanted


def test_a_particle_a_million_kilometres_away_costs_nothing_and_is_found_when_touched(rng):
    deck = scenes.case(time_step=1e-6)
    far = np.array([1e9, -1e9, 1e9])
    places = np.vstack([rng.uniform(-0.1, 0.1, (50, 3)), [far, far + np.array((0.0, 0.0, 0.015))]])
    ids = scenes.add_spheres(deck, places, radius=0.01)
    state = scenes.start(deck)
    wanted = near_ids(state, margin=state.skin, among=ids)
    assert frozenset((51, 52)) in unordered(wanted)
    assert unordered(of_ids(state, "spheres")) == unordered(wanted)


def test_pairs_across_cell_borders_on_both_sides_of_the_origin_are_found():
    deck = scenes.case(time_step=1e-6)
    spacing = np.arange(-6, 7) * 0.0199
    places = np.stack(np.meshgrid(spacing, spacing, [0.0, 0.0199], indexing="ij"), axis=-1).reshape(-1, 3)
    ids = scenes.add_spheres(deck, places, radius=0.01)
    state = scenes.start(deck)
    wanted = near_ids(state, margin=state.skin, among=ids)
    assert unordered(of_ids(state, "spheres")) == unordered(wanted)


def test_the_neighbours_of_a_box_under_one_sphere_are_linked():
    deck = scenes.case(time_step=1e-6)
    scenes.add_grid(deck, 4, 3)
    scenes.add_spheres(deck, [(0.03, 0.02, 0.012)], radius=0.015)
    state = scenes.start(deck)
    contacts = state.lists.boxes[0]
    bonds = state.scene.bonds
    bonded = unordered(zip(bonds.first.tolist(), bonds.second.tolist()))
    for k, own in enumerate(contacts.second):
        linked = {int(other) for other in contacts.beside[:, k] if other >= 0}
        wanted = {
            other for other, box in enumerate(contacts.second) if frozenset((int(own), int(box))) in bonded
        }
        assert linked == wanted
    assert contacts.second.size > 4


def mark(state, rng):
    """Give every listed pair a history of its own; returns it by (family, ids)."""
    history = {}
    for family in ("spheres", "boxes", "sphere_parts", "box_parts"):
        contacts = getattr(state.lists, family)[0]
        contacts.stiffness[:] = rng.uniform(1.0, 2.0, contacts.first.size)
        contacts.spring[:] = rng.standard_normal(contacts.spring.shape)
        contacts.rolling[:] = rng.standard_normal(contacts.rolling.shape)
        history |= {
            (family, *pair): values for pair, values in zip(of_ids(state, family), values_of(contacts))
        }
    return history


def values_of(contacts):
    return np.vstack([contacts.stiffness, contacts.spring, contacts.rolling]).T.tolist()


def remaining(state):
    history = {}
    for family in ("spheres", "boxes", "sphere_parts", "box_parts"):
        contacts = getattr(state.lists, family)[0]
        history |= {
            (family, *pair): values for pair, values in zip(of_ids(state, family), values_of(contacts))
        }
    return history


def test_history_is_carried_into_a_new_list(rng):
    state, _ = crowd(rng)
    before = mark(state, rng)
    renew_lists(state)
    assert remaining(state) == before


def test_history_keeps_its_sense_when_spheres_are_sorted_anew(rng):
    """Where the two have changed their roles in the list, what acted on the first acts on it with the other sign."""
    state, _ = crowd(rng)
    before = mark(state, rng)
    renew_lists(state, sort_free(state.scene, 0.02))
    after, exchanged = remaining(state), 0
    assert len(after) == len(before)
    for (family, first, second), values in after.items():
        if (family, first, second) not in before:
            exchanged += 1
            stiffness, *vectors = before[family, second, first]
            assert values == [stiffness, *(-value for value in vectors)]
        else:
            assert values == before[family, first, second]
    assert exchanged > 10


def test_spheres_are_sorted_by_place_and_frames_keep_the_order_of_the_deck(tmp_path, rng):
    """Free spheres that fly apart, each at a speed of 1/s times its place: no two of them ever meet."""
    places = rng.uniform(-1.0, 1.0, (1200, 3))
    deck = scenes.case(time_step=5e-5, duration=0.02)
    ids = scenes.add_spheres(deck, places, radius=1e-3, velocity=places)
    state = scenes.start(deck)
    assert not np.array_equal(state.scene.population.id, ids)
    path = tmp_path / "flight.h5"
    run(deck, build(deck), path, allow_unstable=True)  # nobody touches anybody
    with trajectory.read(path) as frames:
        last = frames[len(frames) - 1]
        np.testing.assert_array_equal(last.id, ids)
        # Single precision of places up to 1.02 m.
        np.testing.assert_allclose(last.position, 1.02 * places, atol=1e-7)


def test_pairs_that_part_lose_their_history_and_new_ones_have_none(rng):
    state, ids = crowd(rng)
    before = mark(state, rng)
    moved = [scenes.slot(state, particle) for particle in ids["pebble"][:30]]
    scenes.particles(state).position[:, moved] += rng.uniform(-0.05, 0.05, (3, 30))
    renew_lists(state)
    after = remaining(state)
    assert set(after) - set(before)
    assert set(before) - set(after)
    for pair, values in after.items():
        assert values == before.get(pair, [0.0] * 7)


def test_history_follows_particles_that_are_renumbered_by_arrivals_and_departures(rng):
    state, ids = crowd(rng)
    before = mark(state, rng)
    leaves = np.isin(state.scene.population.id, np.concatenate([ids["dust"][::3], ids["rock"][2:4]]))
    gone = set(state.scene.population.id[leaves].tolist())
    renew_lists(state, remove(state.scene, leaves))
    assert remaining(state) == {
        pair: values
        for pair, values in before.items()
        if not (pair[1] in gone or (not pair[0].endswith("parts") and pair[2] in gone))
    }

    kept = remaining(state)
    place = rng.uniform(-0.1, 0.1, (10, 3))
    new = Arrivals(np.arange(1000, 1010), np.full(10, 1, np.int32), place, np.zeros((10, 3)))
    renew_lists(state, insert(state.scene, new))
    after = remaining(state)
    assert {pair: after[pair] for pair in kept} == kept
    assert all(values == [0.0] * 7 for pair, values in after.items() if pair not in kept)
    assert len(after) > len(kept)


def rubbing_crowd(skin=None):
    """A cloud of spheres that collide with friction; a skin of its own only changes how often lists are made."""
    rng = np.random.default_rng(2)
    deck = scenes.case(time_step=2e-5, friction=0.5, restitution=0.7, rolling=0.05)
    places = 0.022 * np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    scenes.add_spheres(deck, places, radius=0.01, velocity=rng.uniform(-1.0, 1.0, (64, 3)))
    for n, axis in enumerate(np.vstack([np.eye(3), -np.eye(3)])):
        turn = Rotation.align_vectors([axis], [[0, 0, 1.0]])[0]
        point = -0.012 * axis if n < 3 else (0.066 + 0.012) * np.abs(axis)
        scenes.add_plane(deck, name=f"wall{n}", point=point, orientation=turn.as_quat(scalar_first=True))
    state = scenes.start(deck)
    if skin is not None:
        state.skin = skin
        renew_lists(state)
    return state


def test_how_often_lists_are_made_does_not_change_the_motion(monkeypatch):
    monkeypatch.setattr(engine, "tune_skin", lambda _: None)  # both skins would come to the same
    usual, wide = rubbing_crowd(), rubbing_crowd(skin=0.008)
    for state in (usual, wide):
        advance_by(state, 3000)
    assert usual.list_builds > 2 * wide.list_builds > 10
    # Sums over a particle's pairs may be regrouped when the list is longer: rounding, which collisions amplify. A pair
    # missed for one step would show as 1e-6 m or more.
    difference = scenes.particles(usual).position - scenes.particles(wide).position
    assert np.abs(difference).max() < 1e-11


def test_how_steps_are_batched_does_not_change_a_bit_of_the_motion():
    whole, pieces = rubbing_crowd(), rubbing_crowd()
    advance_by(whole, 2000)
    for steps in (1, 2, 7, 190, 800, 1000):
        advance_by(pieces, steps)
    for name in ("position", "velocity", "orientation", "angular_velocity", "force"):
        assert np.array_equal(getattr(scenes.particles(whole), name), getattr(scenes.particles(pieces), name))
    assert whole.time == pieces.time == 2000 * 2e-5


def test_the_same_deck_runs_to_the_same_bits_twice():
    first, second = rubbing_crowd(), rubbing_crowd()
    for state in (first, second):
        advance_by(state, 1000)
    assert np.array_equal(scenes.particles(first).position, scenes.particles(second).position)


@pytest.fixture
def rng():
    return np.random.default_rng(7)
