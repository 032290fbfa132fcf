"""Particles that are held by their centre and axis, and particles whose motion ends."""

import numpy as np
import pytest
import scenes
from scipy.spatial.transform import Rotation

from beltsim.scene import build
from beltsim.scene.unbuilt import SceneError

TILT = tuple(Rotation.from_rotvec([0.4, -0.3, 0.2]).as_quat(scalar_first=True))
AXIS = Rotation.from_quat(TILT, scalar_first=True).apply([0.0, 0.0, 1.0])


def wheel(*, time_step=1e-3, shape="box", spin=(0.0, 0.0, 0.0), fixed="POSITION", **case):
    """A box or sphere held by its position, its local z along AXIS."""
    deck = scenes.case(time_step=time_step, gravity=(0.0, 0.0, -9.81), **case)
    given = {"fixed": fixed, "orientation": TILT, "spin": spin, "name": "wheel"}
    if shape == "box":
        scenes.add_boxes(deck, [(1.0, 2.0, 3.0)], size=(0.2, 0.3, 0.05), edge_radius=0.01, **given)
    else:
        scenes.add_spheres(deck, [(1.0, 2.0, 3.0)], radius=0.1, **given)
    return deck


def turned(state, slot=0):
    """Angle about AXIS, and how far the axis is from where it was."""
    now = Rotation.from_quat(scenes.particles(state).orientation[:, slot], scalar_first=True)
    turn = (now * Rotation.from_quat(TILT, scalar_first=True).inv()).as_rotvec()
    return turn @ AXIS, np.linalg.norm(now.apply([0.0, 0.0, 1.0]) - AXIS)


def push(deck, torque, force=(3.0, 1.0, 2.0)):
    deck.add("FORCE", rows={"id": [1], "force": [force], "torque": [torque]})


@pytest.mark.parametrize("shape", ["box", "sphere"])
def test_a_particle_held_by_its_position_turns_about_its_axis_alone(shape):
    deck = wheel(shape=shape)
    push(deck, (0.3, 0.2, 0.1))
    state = scenes.start(deck)
    scenes.advance(state, 500)
    p = scenes.particles(state)
    rate = np.dot((0.3, 0.2, 0.1), AXIS) / p.inertia[2, 0]
    angle, swung = turned(state)
    assert p.position[:, 0].tolist() == [1.0, 2.0, 3.0]
    assert not p.velocity[:, 0].any()
    assert p.angular_velocity[:, 0] == pytest.approx(rate * 0.5 * AXIS, rel=1e-11)
    # the rational angle of a step of p rad is p^3 / 12 short, and p grows evenly
    step = abs(rate) * 0.5 * 1e-3
    whole = 0.5 * rate * 0.5**2
    assert abs((angle - whole + np.pi) % (2 * np.pi) - np.pi) < 1.05 * 500 * step**3 / 48 + 1e-11
    assert swung < 1e-12


def test_its_bearing_stops_it_and_never_turns_it_back():
    deck = wheel(spin=tuple(2.0 * AXIS + 3.0 * np.cross(AXIS, (1.0, 0.0, 0.0))))
    deck.add("MOTION", particle_type="wheel", type="FREE ROTATION", friction_torque=0.15)
    state = scenes.start(deck)
    inertia = scenes.particles(state).inertia[2, 0]
    rates = scenes.advance(state, 900, probe=lambda s: scenes.particles(s).angular_velocity[:, 0] @ AXIS)
    stop = 2.0 * inertia / 0.15
    assert 0.2 < stop < 0.8
    times = 1e-3 * np.arange(1, 901)
    # It stops somewhere within a step.
    assert rates == pytest.approx(np.maximum(0.0, 2.0 - 0.15 / inertia * times), abs=0.15 / inertia * 1e-3)
    assert rates.min() > -1e-15
    assert rates[times > stop + 2e-3].max() < 1e-15


def test_its_drive_follows_its_amplitude_against_the_bearing():
    deck = wheel()
    deck.add("AMPLITUDE", name="ramp", rows={"time": [0.0, 0.4], "factor": [0.5, 1.5]})
    deck.add(
        "MOTION",
        particles="1",
        type="TORQUE",
        torque=0.2,
        friction_torque=0.05,
        inertia=0.04,
        amplitude="ramp",
    )
    state = scenes.start(deck)
    scenes.advance(state, 500)
    # 0.2 N m x (0.4 s x 1 + 0.1 s x 1.5) - 0.05 N m x 0.5 s
    rate = (0.2 * 0.55 - 0.025) / 0.04
    assert scenes.particles(state).angular_velocity[:, 0] == pytest.approx(rate * AXIS, rel=1e-11)


@pytest.mark.parametrize("fixed", ["POSITION", "YES"])
def test_a_prescribed_rotation_turns_what_is_held(fixed):
    deck = wheel(fixed=fixed)
    deck.add("AMPLITUDE", name="ramp", rows={"time": [0.1, 0.3], "factor": [0.0, 1.0]})
    deck.add("MOTION", particle_type="wheel", type="ROTATION", angular_velocity=5.0, amplitude="ramp")
    push(deck, (0.3, 0.2, 0.1))  # moves nothing that is prescribed
    state = scenes.start(deck)
    scenes.advance(state, 500)
    angle, swung = turned(state)
    assert angle == pytest.approx(5.0 * 0.3, rel=1e-11)
    assert swung < 1e-12
    assert scenes.particles(state).angular_velocity[:, 0] == pytest.approx(5.0 * AXIS, rel=1e-12)


def test_a_held_wheel_is_turned_by_what_rolls_on_it():
    """Two wheels at surface speeds that friction makes equal: angular momenta change by equal and opposite shares."""
    deck = scenes.case(time_step=2e-5, friction=0.5, restitution=0.5)
    along_y = {"fixed": "POSITION", "orientation": scenes.ALONG_Y}
    scenes.add_spheres(deck, [(0.0, 0.0, 0.0)], radius=0.02, name="large", spin=(0.0, 10.0, 0.0), **along_y)
    scenes.add_spheres(deck, [(0.0, 0.0, 0.0299)], radius=0.01, name="small", **along_y)
    state = scenes.start(deck)
    scenes.advance(state, 5000)
    p = scenes.particles(state)
    first, second = p.angular_velocity[1]
    heavy, light = p.inertia[2]
    # Contact radii: each sphere's own less half the overlap.
    r_1, r_2 = 0.02 - 0.5e-4, 0.01 - 0.5e-4
    both = heavy * r_2**2 + light * r_1**2
    assert first == pytest.approx(10.0 * heavy * r_2**2 / both, rel=1e-3)
    assert second == pytest.approx(-10.0 * heavy * r_1 * r_2 / both, rel=1e-3)


def test_the_energy_book_knows_held_wheels():
    from test_energy import book

    deck = wheel(time_step=1e-3)
    deck.add("MOTION", particle_type="wheel", type="TORQUE", torque=0.3, friction_torque=0.1, inertia=0.02)
    terms = book(deck, 0.5)
    rate = 0.2 / 0.02 * 0.5
    angle = 0.5 * rate * 0.5
    assert terms["energy_rotational"] == pytest.approx(0.5 * 0.02 * rate**2, rel=1e-11)
    assert terms["work_drives"] == pytest.approx(0.3 * angle, rel=1e-11)
    assert terms["loss_bearings"] == pytest.approx(0.1 * angle, rel=1e-9)
    assert abs(terms["energy_residual"]) < 1e-9 * terms["work_drives"]


def test_what_was_led_flies_on_when_its_motion_ends():
    deck = scenes.case(time_step=1e-4, duration=0.1, gravity=(0.0, 0.0, -9.81))
    deck.blocks("STEP")[0].parameters["NAME"] = "one"
    deck.add("STEP", name="two", duration=0.1, time_step=1e-4)
    scenes.add_spheres(deck, [(0.0, 0.0, 0.0)], radius=0.01)
    scenes.add_spheres(deck, [(1.0, 0.0, 0.0)], radius=0.01, name="held", fixed="YES")
    vector = (2.0, 0.0, 1.0, 0.0, 0.0, 4.0)
    deck.add("MOTION", particles="1, 2", type="VELOCITY", step="one", rows={"vector": [vector]})
    state = scenes.start(deck)
    scenes.advance(state, 1000)
    scenes.next_step(state, 1)
    scenes.advance(state, 1000)
    p, ball, held = scenes.particles(state), scenes.slot(state, 1), scenes.slot(state, 2)
    assert p.velocity[:, ball] == pytest.approx([2.0, 0.0, 1.0 - 0.981], abs=1e-12)
    assert p.angular_velocity[:, ball] == pytest.approx([0.0, 0.0, 4.0], abs=1e-12)
    assert p.position[:, ball] == pytest.approx([0.4, 0.0, 0.2 - 0.5 * 9.81 * 0.01], abs=1e-12)
    assert p.position[:, held] == pytest.approx([1.2, 0.0, 0.1], abs=1e-12)
    assert not p.velocity[:, held].any()


@pytest.mark.parametrize(
    ("kind", "given", "expected"),
    [
        ("ROTATION", {"angular_velocity": 1.0}, "FIXED=POSITION or FIXED=YES"),
        ("TORQUE", {"torque": 1.0}, "FIXED=POSITION or FIXED=YES"),
    ],
)
def test_what_flies_freely_has_no_axis_to_be_turned_about(kind, given, expected):
    deck = wheel(fixed="NO")
    deck.add("MOTION", particle_type="wheel", type=kind, **given)
    with pytest.raises(
        SceneError, match=f"TYPE={kind} of wheel, a ROUNDED BOX with FIXED=NO, expected .*{expected}"
    ):
        build(deck)
