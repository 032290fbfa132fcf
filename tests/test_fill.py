"""Bulk that starts on a belt: it lies on the carrying side, touches nothing, and moves with the belt."""

import numpy as np
import pytest
import scenes
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from beltsim import inp
from beltsim.diagnosis import contact_forces
from beltsim.engine import begin_stage, state_of
from beltsim.fill import fill_belts
from beltsim.run import prepare
from beltsim.scene import build
from beltsim.scene.unbuilt import SceneError

PITCH, EDGE, THICKNESS, RADIUS = 0.04, 0.004, 0.01, 0.012


def trough(angle, *, length=12, wing=4, slope=0.0, speed=2.0, **fill):
    """A held belt whose two wings stand at an angle beside a flat middle, running up a slope; filled as told."""
    deck = scenes.case(time_step=2e-5, gravity=(0.0, 0.0, -9.81), friction=0.5, restitution=0.3)
    deck.add("CONTACT GROUP", name="cover", belt="belt")
    across = [np.array([0.0, y, 0.0]) for y in (-PITCH, 0.0, PITCH)]
    lean = [0.0, 0.0, 0.0]
    for side in (-1.0, 1.0):
        corner = np.array([0.0, side * 1.5 * PITCH, 0.0])
        for n in range(wing):
            out = (n + 0.5) * PITCH * np.array([0.0, side * np.cos(angle), np.sin(angle)])
            across.append(corner + out)
            lean.append(side * angle)
    tilt = Rotation.from_rotvec([0.0, -slope, 0.0])
    places, turns = [], []
    for n in range(length):
        places += [tilt.apply(np.add(place, (n * PITCH, 0.0, 0.0))) for place in across]
        turns += [(tilt * Rotation.from_rotvec([a, 0.0, 0.0])).as_quat(scalar_first=True) for a in lean]
    size = (PITCH + 2 * EDGE, PITCH + 2 * EDGE, THICKNESS)
    held = "NO" if speed else "YES"  # what is held has no velocity
    ids = scenes.add_boxes(
        deck, places, size=size, edge_radius=EDGE, group="cover", fixed=held, orientation=np.array(turns)
    )
    velocity = tilt.apply([speed, 0.0, 0.0])
    rows = {
        "id": ids,
        "velocity": np.tile(velocity, (len(ids), 1)),
        "angular_velocity": np.zeros((len(ids), 3)),
    }
    deck.add("INITIAL VELOCITY", rows=rows)
    deck.add(
        "BOND TYPE",
        name="rubber",
        section_width=PITCH,
        section_thickness=THICKNESS,
        youngs_modulus=1e6,
        poisson_ratio=0.3,
    )
    pairs = np.stack([ids[: -len(across)], ids[len(across) :]], axis=1)
    rows = {"particles": pairs}
    for n in (1, 2):
        rows[f"position_{n}"] = np.array(places)[pairs[:, n - 1] - 1]
        rows[f"orientation_{n}"] = np.array(turns)[pairs[:, n - 1] - 1]
    deck.add("BOND", type="rubber", rows=rows)
    deck.add("PARTICLE TYPE", name="grain", shape="SPHERE", radius=RADIUS, material="stuff")
    deck.add("FILL", **({"particle_type": "grain", "belt": "belt", "height": 0.1} | fill))
    return deck


def filled(deck):
    """The scene of a deck with its bulk, and the slots of the bulk."""
    inp.check_case(deck)
    scene = build(deck)
    fill_belts(scene)
    return scene, np.arange(scene.population.permanent, scene.population.count)


def forces_at_start(scene):
    """Largest force of any contact when the scene begins [N]."""
    state = state_of(scene)
    begin_stage(state, prepare(state, scene.steps[0], 0.0, lambda _: None, True))
    return max(
        float(contact_forces(scene, family[0]).max(initial=0.0))
        for family in state.lists
        if family is not None
    )


@pytest.mark.parametrize("angle", [0.0, np.radians(35.0)])
def test_nothing_touches_at_the_start(angle):
    scene, bulk = filled(trough(angle))
    centres = scene.population.particles.position[:, bulk].T
    assert cKDTree(centres).query(centres, k=2)[0][:, 1].min() > 2 * RADIUS
    assert forces_at_start(scene) == 0.0


def test_the_layer_lies_on_the_belt_and_ends_at_its_height():
    scene, bulk = filled(trough(0.0))
    z = scene.population.particles.position[2, bulk]
    face = THICKNESS / 2
    assert face < z.min() - RADIUS < face + 0.12 * RADIUS  # twice the shake above the face at most
    # The top layer ends within one layer's distance below the height.
    assert face + 0.1 - np.sqrt(2 / 3) * 2.2 * RADIUS < z.max() + RADIUS <= face + 0.1 + 1e-12


def test_a_trough_is_filled_to_a_level_top():
    scene, bulk = filled(trough(np.radians(35.0)))
    _, y, z = scene.population.particles.position[:, bulk]
    assert z.max() + RADIUS <= THICKNESS / 2 + 0.1 + 1e-12
    wings = np.abs(y) > 2.5 * PITCH
    assert np.any(wings)
    # Spheres over a wing lie above its face: the centre is a radius and half the thickness above its middle line.
    above = z - np.tan(np.radians(35.0)) * (np.abs(y) - 1.5 * PITCH)
    assert np.all(above[wings] * np.cos(np.radians(35.0)) > RADIUS + THICKNESS / 2)


def test_the_bulk_fills_its_room_as_densely_as_poured_bulk():
    _, bulk = filled(trough(0.0, length=30, wing=8, height=0.2))
    volume = 4 / 3 * np.pi * RADIUS**3 * bulk.size
    room = 30 * PITCH * 19 * PITCH * 0.2
    # The packing has 0.637 inside; at each rim of the layer up to a diameter is lost.
    assert 0.5 < volume / room < 0.7


def test_the_bulk_moves_as_the_belt_below_it_does():
    scene, bulk = filled(trough(np.radians(20.0), slope=0.2, speed=3.0))
    expected = 3.0 * np.array([np.cos(0.2), 0.0, np.sin(0.2)])
    velocity = scene.population.particles.velocity[:, bulk]
    np.testing.assert_allclose(velocity, np.tile(expected[:, None], bulk.size), atol=1e-12)


def test_layers_follow_an_inclined_belt():
    scene, bulk = filled(trough(0.0, slope=0.3))
    normal = np.array([-np.sin(0.3), 0.0, np.cos(0.3)])
    height = normal @ scene.population.particles.position[:, bulk]
    assert height.min() - RADIUS == pytest.approx(THICKNESS / 2, abs=0.12 * RADIUS)


def test_the_same_seed_gives_the_same_bulk_and_another_seed_another():
    first, bulk = filled(trough(0.0, seed=3))
    again, _ = filled(trough(0.0, seed=3))
    other, _ = filled(trough(0.0, seed=4))
    places = [scene.population.particles.position[:, bulk] for scene in (first, again, other)]
    np.testing.assert_array_equal(places[0], places[1])
    assert not np.array_equal(places[0], places[2])


def test_bulk_leaves_room_for_parts_and_particles_in_its_way():
    deck = trough(0.0)
    scenes.add_cylinder(deck, diameter=0.06, length=0.5, point=(0.2, 0.0, 0.06))
    scenes.add_spheres(deck, [(0.35, 0.0, 0.05)], radius=0.03)
    scene, _ = filled(deck)
    without, _ = filled(trough(0.0))
    assert scene.population.count < without.population.count
    assert forces_at_start(scene) == 0.0


def test_a_second_fill_takes_what_room_is_left():
    deck = trough(0.0)
    deck.add("PARTICLE TYPE", name="dust", shape="SPHERE", radius=0.002, material="stuff")
    deck.add("FILL", particle_type="dust", belt="belt", height=0.1)
    inp.check_case(deck)
    scene = build(deck)
    first, second = fill_belts(scene)
    assert second.count > first.count > 0
    assert second.mass < first.mass
    assert np.unique(scene.population.id).size == scene.population.count
    assert forces_at_start(scene) == 0.0


def test_the_reported_mass_is_that_of_the_bulk():
    deck = trough(0.0)
    inp.check_case(deck)
    scene = build(deck)
    (report,) = fill_belts(scene)
    mass = scene.population.particles.mass[scene.population.permanent :]
    assert report.mass == pytest.approx(mass.sum(), rel=1e-12)
    assert report.count == mass.size


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"height": 0.01}, "takes no sphere"),
        ({"particle_type": "box"}, "a free SPHERE"),
    ],
)
def test_a_fill_that_cannot_be_is_refused(change, words):
    deck = trough(0.0, **change)
    with pytest.raises(SceneError, match=words):
        fill_belts(build(deck))


def test_a_belt_that_looks_down_carries_nothing():
    deck = trough(0.0)
    deck.blocks("GRAVITY")[0].rows["acceleration"][0] *= -1.0
    with pytest.raises(SceneError, match="a carrying side"):
        fill_belts(build(deck))


def test_filled_bulk_settles_without_a_jump():
    scene, _ = filled(trough(np.radians(30.0), length=5, wing=2, speed=0.0, height=0.06))
    state = state_of(scene)
    begin_stage(state, prepare(state, scene.steps[0], 0.0, lambda _: None, True))
    speeds = scenes.advance(
        state, 2000, every=100, probe=lambda s: np.linalg.norm(scenes.particles(s).velocity, axis=0).max()
    )
    # Nothing gets faster than by its fall through the gaps of the packing, at most the height of the layer.
    assert speeds.max() < np.sqrt(2 * 9.81 * 0.06)
