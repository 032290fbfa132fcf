"""Meshes that move: prescribed, driven, free, on springs; rigid belts by surface velocity; their trajectories."""

import numpy as np
import pytest
import trimesh
from scenes import add_boxes, add_mesh, add_plane, add_spheres, advance, case, particles, slot, start
from scipy.spatial.transform import Rotation

from beltsim import inp, trajectory
from beltsim.run import run
from beltsim.scene import build
from beltsim.solver.vectors import rotate

RADIUS = 0.05
MASS = 4.0 / 3.0 * np.pi * RADIUS**3 * 1200.0
MODULUS = 5.0e6 / (1.0 - 0.3**2) / 2.0
SINK = (3.0 * MASS * 9.81 / (4.0 * MODULUS * np.sqrt(RADIUS))) ** (2.0 / 3.0)
PLATE = trimesh.creation.box((2.0, 2.0, 0.02)).subdivide()


def on_plate(tmp_path, position, *, point=(0.0, 0.0, -0.01), **given):
    """A deck with a sphere at a place on a plate whose top is z = 0 unless `point` says else."""
    ball = {name: given.pop(name) for name in ("velocity", "spin") if name in given}
    deck = case(**{"time_step": 4e-5, "gravity": (0, 0, -9.81), "friction": 0.5, "restitution": 0.3} | given)
    add_spheres(deck, [position], radius=RADIUS, **ball)
    add_mesh(deck, tmp_path / "plate.stl", PLATE.vertices, PLATE.faces, name="plate", point=point)
    return deck


def move(deck, kind, vector=None, **given):
    """A *MOTION of the plate."""
    rows = {"vector": [vector]} if vector is not None else {}
    deck.add("MOTION", part="plate", type=kind, rows=rows, **given)


def part(state):
    """The part arrays."""
    return state.scene.machinery.parts


def test_a_sphere_dropped_on_a_rigid_belt_rolls_off_at_two_sevenths_of_its_speed(tmp_path):
    """Surface velocity V: t_r = 2 V / (7 mu g), final speed 2 V / 7; the belt itself stays where it is."""
    deck = on_plate(tmp_path, (-0.5, 0.0, RADIUS - SINK))
    move(deck, "SURFACE VELOCITY", (1.4, 0.0, 0.3))  # what points out of the surface does not count
    state = start(deck)
    advance(state, 5000)
    assert particles(state).velocity[0, 0] == pytest.approx(0.4, rel=1e-3)
    assert particles(state).angular_velocity[1, 0] * RADIUS == pytest.approx(-1.0, rel=1e-3)
    assert particles(state).position[2, 0] == pytest.approx(RADIUS - SINK, abs=1e-7)
    assert part(state).position[:, 0] == pytest.approx((0.0, 0.0, -0.01), abs=0.0)


def test_a_running_surface_does_no_work_across_itself(tmp_path):
    """A resting load, held on the spot by a velocity that points out of the surface: no power, no work in the book."""
    from beltsim import energy

    deck = on_plate(tmp_path, (-0.5, 0.0, RADIUS - SINK))
    add_boxes(deck, [(0.5, 0.5, 0.0099)], size=(0.06, 0.04, 0.02), edge_radius=0.004)
    move(deck, "SURFACE VELOCITY", (0.0, 0.0, 1.0))
    state = start(deck)
    state.account = energy.account_of(state.scene)
    state.lists = energy.with_books(state.lists)
    advance(state, 2000)
    carried = -part(state).force[2, 0]
    assert carried == pytest.approx(9.81 * particles(state).mass.sum(), rel=0.02)
    # Of the work that the load times this velocity would be, nothing but rounding is there.
    assert abs(state.part_work[0]) < 1e-9 * carried * 1.0 * 0.08
    assert abs(state.account.ledger.total).max() < 1e-9 * carried * 1.0 * 0.08


def test_a_rigid_belt_is_the_same_as_a_mesh_and_as_a_plane(tmp_path):
    ends = []
    for mesh in (True, False):
        deck = case(time_step=4e-5, gravity=(0, 0, -9.81), friction=0.3, restitution=0.3)
        add_spheres(deck, [(-0.5, 0.0, RADIUS)], radius=RADIUS)
        if mesh:
            add_mesh(deck, tmp_path / "plate.stl", *trimesh_square(), name="plate")
        else:
            add_plane(deck, name="plate")
        move(deck, "SURFACE VELOCITY", (1.0, 0.5, 0.0))
        state = start(deck)
        advance(state, 3000)
        ends.append(np.concatenate([particles(state).velocity[:, 0], part(state).force[:, 0]]))
    assert ends[0] == pytest.approx(ends[1], rel=1e-9, abs=1e-9)


def trimesh_square():
    """Two triangles at z = 0."""
    return [(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], [(0, 1, 2), (0, 2, 3)]


def test_a_lifted_plate_takes_its_sphere_along(tmp_path):
    deck = on_plate(tmp_path, (0.1, 0.2, RADIUS - SINK), velocity=(0.2, 0.0, 0.5))
    move(deck, "VELOCITY", (0.2, 0.0, 0.5))
    state = start(deck)
    advance(state, 5000)
    assert part(state).position[:, 0] == pytest.approx((0.04, 0.0, 0.09), abs=1e-9)
    assert particles(state).position[:, 0] == pytest.approx((0.14, 0.2, 0.1 + RADIUS - SINK), abs=1e-6)


def test_a_plate_turns_about_the_axis_that_is_given_through_its_centre(tmp_path):
    axis = np.array([1.0, 2.0, -0.5])
    deck = on_plate(tmp_path, (0.0, 0.0, 5.0), point=(1.0, 2.0, 3.0), gravity=(0.0, 0.0, 0.0))
    move(deck, "ROTATION", angular_velocity=3.0, axis=tuple(axis))
    state = start(deck)
    advance(state, 10000)
    expected = Rotation.from_rotvec(1.2 * axis / np.linalg.norm(axis)).as_matrix()
    turned = [rotate(tuple(part(state).orientation[:, 0]), tuple(e)) for e in np.eye(3)]
    assert np.abs(np.array(turned).T - expected).max() < 1e-9
    assert part(state).position[:, 0] == pytest.approx((1.0, 2.0, 3.0), abs=0.0)


def test_a_turning_paddle_hits_the_sphere_as_a_moving_wall_would(tmp_path):
    """A plate that swings about its end hits with its full speed: elastic rebound at twice the wall's speed."""
    deck = on_plate(
        tmp_path,
        (0.9, 0.0, RADIUS + 0.002),
        gravity=(0, 0, 0),
        friction=0.0,
        restitution=1.0,
        time_step=1e-5,
    )
    move(deck, "ROTATION", angular_velocity=1.0, axis=(0.0, -1.0, 0.0))
    state = start(deck)
    advance(state, 6000)
    # Touch at once: the wall moves at 0.9 m/s there and turns by a hundredth of a radian meanwhile.
    assert particles(state).velocity[2, 0] == pytest.approx(1.8, rel=0.03)
    assert state.list_builds > 2  # the swinging plate renews the lists


def test_a_free_plate_takes_the_moment_of_what_hits_it(tmp_path):
    """Angular momentum about the hinge: m v x before, m v' x + I w after; energy kept with e = 1."""
    inertia, arm = 0.8, 0.9
    deck = on_plate(
        tmp_path,
        (arm, 0.0, RADIUS + 0.001),
        gravity=(0, 0, 0),
        friction=0.0,
        restitution=1.0,
        velocity=(0.0, 0.0, -1.0),
        time_step=1e-5,
    )
    move(deck, "FREE ROTATION", inertia=inertia, axis=(0.0, 1.0, 0.0))
    state = start(deck)
    advance(state, 5000)
    spin, speed = part(state).angular_velocity[1, 0], particles(state).velocity[2, 0]
    assert spin > 0.5
    before = MASS * 1.0**2 / 2
    assert 0.5 * MASS * np.sum(particles(state).velocity[:, 0] ** 2) + inertia * spin**2 / 2 == pytest.approx(
        before, rel=2e-3
    )
    # The plate turns by a degree in the impact: the sphere is pushed off to the side by as much.
    assert MASS * speed * arm - inertia * spin == pytest.approx(-MASS * arm, rel=1e-2)


def test_a_driven_plate_speeds_up_by_its_torque_over_its_inertia(tmp_path):
    deck = on_plate(tmp_path, (0.0, 0.0, 5.0), gravity=(0, 0, 0))
    move(deck, "TORQUE", torque=2.0, inertia=0.5, friction_torque=0.5, axis=(1.0, 0.0, 0.0))
    state = start(deck)
    advance(state, 1000)
    assert part(state).angular_velocity[:, 0] == pytest.approx((3.0 * 0.04, 0.0, 0.0), rel=1e-9)


def test_a_sprung_plate_sinks_by_the_weight_it_carries(tmp_path):
    """The springs carry what touches the plate: m g / k."""
    deck = on_plate(tmp_path, (0.0, 0.0, RADIUS - SINK))
    move(deck, "SUSPENSION", (0.0, 0.0, 1.0), stiffness=1000.0, mass=0.5, damping=60.0)
    state = start(deck)
    advance(state, 20000)
    assert part(state).position[2, 0] + 0.01 == pytest.approx(-MASS * 9.81 / 1000.0, rel=1e-3)
    assert part(state).force[:, 0] == pytest.approx((0.0, 0.0, -MASS * 9.81), rel=1e-3, abs=1e-6)


def test_a_plate_pulled_by_a_tension_force_falls_with_it(tmp_path):
    deck = on_plate(tmp_path, (0.0, 0.0, 5.0), gravity=(0, 0, 0))
    move(deck, "TENSION", (0.0, 3.0, 4.0), force=10.0, mass=2.0)
    state = start(deck)
    advance(state, 2500)
    assert part(state).velocity[:, 0] == pytest.approx((0.0, 0.3, 0.4), rel=1e-9)


def test_contact_history_outlives_new_lists_and_new_slots(tmp_path):
    """A sphere held by friction on a slope of 20 degrees does not slip when lists are made anew at every step."""
    from beltsim.engine import renew_lists

    slope = np.radians(20.0)
    ends = []
    for renew in (False, True):
        deck = case(
            time_step=2e-5,
            gravity=(9.81 * np.sin(slope), 0, -9.81 * np.cos(slope)),
            friction=0.5,
            restitution=0.3,
        )
        add_boxes(deck, [(0.0, 0.0, 0.0099), (0.3, 0.3, 0.0099)], size=(0.06, 0.04, 0.02), edge_radius=0.004)
        add_spheres(deck, [(-0.3, 0.0, RADIUS)], radius=RADIUS)
        add_mesh(deck, tmp_path / "plate.stl", *trimesh_square(), name="plate")
        state = start(deck)
        for _ in range(40):
            advance(state, 50)
            if renew:
                renew_lists(state)
        ends.append(particles(state).position.copy())
    assert np.array_equal(ends[0], ends[1])


def test_the_trajectory_holds_the_mesh_and_where_it_is(tmp_path):
    """Vertices, faces, and with them the picture; force and torque of every frame."""
    from beltsim.view.frame import scenery_of_frame
    from beltsim.view.scenery import Mesh

    deck = on_plate(tmp_path, (0.1, 0.2, RADIUS - SINK), duration=0.02)
    move(deck, "VELOCITY", (0.5, 0.0, 0.0))
    inp.check_case(deck)
    run(deck, build(deck), tmp_path / "case.h5")
    with trajectory.read(tmp_path / "case.h5") as opened:
        (plate,) = opened.contents.parts
        assert plate.shape == "MESH"
        assert plate.vertices[plate.faces].reshape(-1, 3).min(axis=0) == pytest.approx((-1, -1, -0.01))
        assert len(plate.faces) == len(PLATE.faces)
        state = opened[-1].parts["plate"]
        assert state["position"] == pytest.approx((0.01, 0.0, -0.01), abs=1e-9)
        assert state["force"][2] == pytest.approx(-MASS * 9.81, rel=1e-3)
        (mesh,) = [item for item in scenery_of_frame(opened).items if isinstance(item, Mesh)]
        assert mesh.vertices.max(axis=0) == pytest.approx((1.01, 1.0, 0.0), abs=1e-8)


def test_automatic_time_steps_know_meshes(tmp_path):
    """A box on a mesh and a fall onto a mesh far below: the step is bounded, and runs without a blow-up."""
    deck = case(time_step="AUTO", gravity=(0, 0, -9.81), friction=0.5, restitution=0.1, duration=0.2)
    add_boxes(deck, [(0.0, 0.0, 0.02)], size=(0.06, 0.04, 0.02), edge_radius=0.004)
    add_mesh(deck, tmp_path / "plate.stl", *trimesh_square(), name="plate")
    state = start(deck)
    punch = 2.0 / np.sqrt(np.pi) * MODULUS * np.sqrt(0.052 * 0.032)
    flat = 2.0 * np.sqrt(particles(state).mass[0] / punch)
    assert state.stage.time_step < 0.8 * flat
    advance(state, int(0.2 / state.stage.time_step))
    assert particles(state).position[2, slot(state, 1)] == pytest.approx(0.01, abs=1e-4)
    deep = case(time_step="AUTO", gravity=(0, 0, -9.81), restitution=0.5)
    add_spheres(deep, [(0.0, 0.0, 0.0)], radius=RADIUS)
    vertices, triangles = trimesh_square()
    add_mesh(deep, tmp_path / "deep.stl", np.array(vertices) - (0, 0, 20.0), triangles, name="plate")
    fall = start(deep).stage.time_step
    assert fall * np.sqrt(2 * 9.81 * 20.0) <= 0.1 * RADIUS


def test_a_sharp_box_on_a_mesh_is_refused(tmp_path):
    from beltsim.console import CommandError

    deck = case(time_step=1e-5)
    add_boxes(deck, [(0.0, 0.0, 1.0)], size=(0.06, 0.04, 0.02), edge_radius=0.0)
    add_mesh(deck, tmp_path / "plate.stl", *trimesh_square(), name="plate")
    with pytest.raises(CommandError, match=r"EDGE RADIUS=0 of rounded box box, .*the mesh plate, expected"):
        build(deck)
