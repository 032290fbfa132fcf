"""Measures: what goes through a plane, what a belt carries, how deep it hangs, what a part gives."""

import numpy as np
import pytest
import scenes

from beltsim import inp, trajectory
from beltsim.measures import Plane
from beltsim.run import run
from beltsim.scene import build
from beltsim.scene.unbuilt import SceneError
from beltsim.verify.strips import Strip, add_strip, case_deck

PLANE = {"point": [(0.0, 0.0, 0.0)], "normal": [(2.0, 0.0, 0.0)]}


def frames(deck, path):
    """All frames of a run."""
    inp.check_case(deck)
    run(deck, build(deck), str(path / "out.h5"))
    with trajectory.read(path / "out.h5") as found:
        return list(found)


def column(found, name):
    """An observable over all frames."""
    return np.array([frame.observables[name] for frame in found])


def disc(radius=np.inf):
    """A disc about the origin that looks along x."""
    return Plane(np.zeros(3), np.array([1.0, 0.0, 0.0]), radius)


def test_a_path_through_a_disc_counts_once_with_its_direction():
    path = np.array([[-1.0, 0.0, 0.0], [-0.5, 0.0, 0.0], [0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [-0.5, 0.0, 0.0]])
    steps = [int(disc(0.1).crossings(path[n : n + 1], path[n + 1 : n + 2])[0]) for n in range(4)]
    assert steps == [0, 1, 0, -1]


def test_a_path_beside_the_disc_does_not_count():
    before, after = np.array([[-1.0, 0.0, 0.0]]), np.array([[1.0, 1.0, 0.0]])
    assert disc(0.51).crossings(before, after)[0] == 1  # passes 0.5 m from the centre
    assert disc(0.49).crossings(before, after)[0] == 0


def flying(**more):
    """Ten equal spheres in a row that fly through the plane x = 0, and one that flies back beside them."""
    deck = scenes.case(time_step=5e-5, duration=1.0)
    x = -0.05 - 0.1 * np.arange(10)
    scenes.add_spheres(
        deck, np.stack([x, 0 * x, 0 * x], axis=1), radius=0.01, velocity=(1.0, 0.0, 0.0), name="there"
    )
    scenes.add_spheres(deck, [(0.31, 0.5, 0.0)], radius=0.02, velocity=(-1.0, 0.0, 0.0), name="back")
    deck.add("MEASURE", name="flow", type="MASS FLOW", rows=PLANE, **more)
    deck.add("OUTPUT", interval=0.1)
    return deck


def test_the_mass_flow_is_the_mass_that_went_through_less_what_came_back(tmp_path):
    found = frames(flying(), tmp_path)
    there, back = (scenes.SOFT["density"] * 4 / 3 * np.pi * r**3 for r in (0.01, 0.02))
    # One sphere in each interval of 0.1 s, and the other way one at 0.31 s.
    through = np.array([0.0] + [there] * 10)
    through[4] -= back
    np.testing.assert_allclose(column(found, "flow"), through / 0.1, rtol=1e-9)
    np.testing.assert_allclose(column(found, "flow_mass"), np.cumsum(through), rtol=1e-9, atol=1e-15)


def test_the_mass_flow_of_one_particle_type(tmp_path):
    found = frames(flying(particle_type="ba*"), tmp_path)
    assert column(found, "flow_mass")[-1] == pytest.approx(-scenes.SOFT["density"] * 4 / 3 * np.pi * 0.02**3)


def test_bulk_that_leaves_the_domain_behind_the_plane_is_counted_first(tmp_path):
    deck = flying(particle_type="there")
    deck.add("DOMAIN", rows={"box": [(-2.0, -1.0, -1.0, 1e-4, 1.0, 1.0)]})
    found = frames(deck, tmp_path)
    there = scenes.SOFT["density"] * 4 / 3 * np.pi * 0.01**3
    assert column(found, "flow_mass")[-1] == pytest.approx(10 * there, rel=1e-12)
    assert column(found, "particle_mass")[-1] == 0.0


def test_all_that_a_source_brings_goes_through_the_plane_below_it(tmp_path):
    deck = scenes.case(time_step=5e-5, duration=1.0)
    deck.add("PARTICLE TYPE", name="grain", shape="SPHERE", radius=0.01, material="stuff")
    rows = {"box": [(-0.1, -0.1, 0.3, 0.1, 0.1, 0.4)], "velocity": [(0.0, 0.0, -1.0)]}
    deck.add("SOURCE", name="feed", particle_type="grain", mass_rate=0.5, end=0.5, rows=rows)
    deck.add("MEASURE", name="fall", type="MASS FLOW", rows={"point": [(0, 0, 0)], "normal": [(0, 0, -1)]})
    found = frames(deck, tmp_path)
    assert column(found, "inserted_mass")[-1] == pytest.approx(0.25, rel=0.03)  # a grain is 2 % of it
    assert column(found, "fall_mass")[-1] == pytest.approx(column(found, "inserted_mass")[-1], rel=1e-12)


def stretched(strain, **measure):
    """The reference strip along x, stretched evenly, with one measure; it starts where its left end is at x = 0."""
    strip = Strip(bonds=10)
    deck = case_deck(time_step=1e-5)
    x = np.linspace(0.0, 1.0 + strain, 11)
    add_strip(deck, strip, np.stack([x, 0 * x, 0 * x], axis=1))
    deck.blocks("STEP")[0].parameters["DURATION"] = 1e-5
    deck.add("MEASURE", name="pull", **measure)
    return strip, deck


def test_the_tension_of_a_stretched_strip_is_its_stiffness_times_its_strain(tmp_path):
    strip, deck = stretched(0.01, type="TENSION", rows={"point": [(0.53, 0, 0)], "normal": [(1.0, 0.0, 0.0)]})
    assert column(frames(deck, tmp_path), "pull")[0] == pytest.approx(0.01 * strip.axial, rel=1e-9)


def test_the_tension_does_not_ask_which_way_the_normal_points(tmp_path):
    strip, deck = stretched(
        0.01, type="TENSION", rows={"point": [(0.53, 0, 0)], "normal": [(-1.0, 0.0, 0.0)]}
    )
    assert column(frames(deck, tmp_path), "pull")[0] == pytest.approx(0.01 * strip.axial, rel=1e-9)


def test_the_tension_through_a_disc_beside_the_strip_is_zero(tmp_path):
    rows = {"point": [(0.53, 0.3, 0)], "normal": [(1.0, 0.0, 0.0)], "radius": [0.2]}
    _, deck = stretched(0.01, type="TENSION", rows=rows)
    assert column(frames(deck, tmp_path), "pull")[0] == 0.0


def test_the_tension_along_a_slanted_normal_is_its_component(tmp_path):
    rows = {"point": [(0.53, 0, 0)], "normal": [(1.0, 0.0, 1.0)]}
    strip, deck = stretched(0.01, type="TENSION", rows=rows)
    assert column(frames(deck, tmp_path), "pull")[0] == pytest.approx(0.01 * strip.axial / 2**0.5, rel=1e-9)


def test_the_sag_is_the_depth_of_the_lowest_particle_near_the_point(tmp_path):
    x = np.linspace(0.0, 1.0, 11)
    z = 0.3 - 0.4 * x * (1.0 - x)
    for radius, expected in ((None, 0.1), (0.15, 0.1)):
        deck = case_deck(time_step=1e-5)
        add_strip(deck, Strip(bonds=10), np.stack([x, 0 * x, z], axis=1))
        deck.blocks("STEP")[0].parameters["DURATION"] = 1e-5
        rows = {"point": [(0.5, 0.0, 0.3)], "normal": [(0.0, 0.0, 3.0)]}
        deck.add("MEASURE", name="sag", type="SAG", rows=rows | ({"radius": [radius]} if radius else {}))
        assert column(frames(deck, tmp_path), "sag")[0] == pytest.approx(expected, rel=1e-12)
        (tmp_path / "out.h5").unlink()


def test_a_point_far_from_the_belt_is_refused():
    rows = {"point": [(0.5, 5.0, 0.3)], "normal": [(0.0, 0.0, 3.0)], "radius": [0.1]}
    _, deck = stretched(0.0, type="SAG", rows=rows)
    with pytest.raises(SceneError, match="no belt particle within the radius"):
        run(deck, build(deck), "nowhere.h5")


def test_a_measure_without_a_belt_or_with_a_name_that_is_taken_is_refused():
    deck = flying()
    deck.add("MEASURE", name="pull", type="TENSION", rows=PLANE)
    deck.add("MEASURE", name="momentum", type="MASS FLOW", rows=PLANE)
    with pytest.raises(SceneError) as error:
        run(deck, build(deck), "nowhere.h5")
    assert "TYPE=TENSION of a scene without such a belt" in str(error.value)
    assert "another observable momentum" in str(error.value)


def test_the_power_of_a_moving_surface_is_friction_times_its_speed(tmp_path):
    deck = scenes.case(time_step=2e-5, gravity=(0, 0, -9.81), duration=0.02, friction=0.3, restitution=0.5)
    radius, mass = 0.01, scenes.SOFT["density"] * 4 / 3 * np.pi * 0.01**3
    modulus = scenes.SOFT["youngs_modulus"] / (2 * (1 - scenes.SOFT["poisson_ratio"] ** 2))
    overlap = (3 * mass * 9.81 / (4 * modulus * radius**0.5)) ** (2 / 3)
    scenes.add_spheres(deck, [(0, 0, radius - overlap)], radius=radius)
    scenes.add_plane(deck)
    deck.add("MOTION", part="floor", type="SURFACE VELOCITY", rows={"vector": [(2.0, 0.0, 0.0)]})
    deck.add("MEASURE", name="drive", type="POWER", part="flo*")
    deck.add("OUTPUT", interval=0.005)
    power = column(frames(deck, tmp_path), "drive")
    # The sphere slides for 2 V / (7 mu g) = 0.19 s; the friction is at its bound after 0.1 ms of the first interval.
    np.testing.assert_allclose(power[2:], 0.3 * mass * 9.81 * 2.0, rtol=1e-9)
