"""The stable time step against exact limits: eigenvalues of the forces' slopes, closed forms, runs beyond it."""

import numpy as np
import pytest
import scenes
from scipy.spatial.transform import Rotation

from beltsim.engine import BlowUp, find_forces, state_of
from beltsim.run import prepare
from beltsim.scene import build
from beltsim.solver.box_cylinder import box_cylinder
from beltsim.solver.timestep import damped_limit, impact_duration
from beltsim.solver.vectors import exponential, product
from beltsim.stepsize import TimeStepError, bond_limit, line_contact_rows, present_limit, stable_limit


def grid_case(rows=8, columns=4, *, damping=0.0, reduction=1.0, thickness=0.01, torsion="GRID", stretch=0.0):
    """A free belt grid, like those that beltconvert writes: masses and inertia of its cells."""
    pitch = 0.025
    deck = scenes.case(time_step="AUTO", duration=1e-3)
    mass = 1200.0 * pitch**2 * thickness
    across, along = mass * (pitch**2 + thickness**2) / 12.0, mass * pitch**2 / 6.0
    deck.add("CONTACT GROUP", name="belt")
    deck.add(
        "PARTICLE TYPE",
        name="cell",
        shape="ROUNDED BOX",
        size_x=pitch + 0.4 * thickness,
        size_y=pitch + 0.4 * thickness,
        size_z=thickness,
        edge_radius=0.2 * thickness,
        mass=mass,
        inertia_x=across,
        inertia_y=across,
        inertia_z=along,
        material="stuff",
        contact_group="belt",
    )
    places = np.array([(pitch * i, pitch * j, 0.0) for i in range(rows) for j in range(columns)])
    ids = scenes.add_particles(deck, "cell", places * (1.0 + stretch)).reshape(rows, columns)
    deck.add(
        "BOND TYPE",
        name="rubber",
        section_width=pitch,
        section_thickness=thickness,
        youngs_modulus=5e7,
        poisson_ratio=0.3,
        reduction_factor=reduction,
        damping_factor=damping,
        torsion=torsion,
    )
    pairs = np.vstack(
        [
            np.stack([ids[:-1].ravel(), ids[1:].ravel()], axis=1),
            np.stack([ids[:, :-1].ravel(), ids[:, 1:].ravel()], axis=1),
        ]
    )
    upright = np.tile(scenes.UPRIGHT, (len(pairs), 1))
    rest = {
        "particles": pairs,
        "position_1": places[pairs[:, 0] - 1],
        "orientation_1": upright,
        "position_2": places[pairs[:, 1] - 1],
        "orientation_2": upright,
    }
    deck.add("BOND", type="rubber", rows=rest)
    return deck


def loads(state):
    """Forces and torques (6, n) at the present state."""
    find_forces(state)
    p = scenes.particles(state)
    return np.vstack([p.force, p.torque])


def stiffness_matrix(state):
    p = scenes.particles(state)

    def nudge(particle, axis, amount):
        position, orientation = p.position[:, particle].copy(), p.orientation[:, particle].copy()
        if axis < 3:
            p.position[axis, particle] += amount
        else:
            turn = [0.0, 0.0, 0.0]
            turn[axis - 3] = 100.0 * amount  # lengths here are of a hundredth of a metre
            p.orientation[:, particle] = product(exponential(tuple(turn)), tuple(orientation))

        def undo():
            p.position[:, particle], p.orientation[:, particle] = position, orientation

        return undo

    n = p.mass.size
    size = 1e-8
    scale = np.repeat([1.0, 0.01], 3 * n)  # undoes the hundred
    plain = np.sqrt(np.vstack([np.tile(p.mass, (3, 1)), p.inertia])).ravel()
    matrix = slopes(state, nudge, size) * scale[None, :]
    matrix /= plain[:, None] * plain[None, :]
    return 0.5 * (matrix + matrix.T)


def damping_matrix(state):
    p = scenes.particles(state)

    def nudge(particle, axis, amount):
        array = p.velocity if axis < 3 else p.angular_velocity
        array[axis % 3, particle] += amount

        def undo():
            array[axis % 3, particle] = 0.0

        return undo

    plain = np.sqrt(np.vstack([np.tile(p.mass, (3, 1)), p.inertia])).ravel()
    matrix = slopes(state, nudge, 1e-6) / (plain[:, None] * plain[None, :])
    return 0.5 * (matrix + matrix.T)


def slopes(state, nudge, size):
    """Minus the central differences of all loads (6 n) by all motions (6 n), axis by axis."""
    n = scenes.particles(state).mass.size
    matrix = np.empty((6 * n, 6 * n))
    for axis in range(6):
        for particle in range(n):
            values = []
            for amount in (-size, size):
                undo = nudge(particle, axis, amount)
                values.append(loads(state).ravel())
                undo()
            matrix[:, axis * n + particle] = (values[0] - values[1]) / (2.0 * size)
    return matrix


def exact_limit(stiffness, damping=None):
    """Largest step with dt^2 K / 4 + dt C / 2 <= 1: the scheme with lagged damping flips its sign beyond."""
    if damping is None:
        return 2.0 / np.sqrt(np.linalg.eigvalsh(stiffness)[-1])
    low, high = 0.0, 2.0 / np.sqrt(np.linalg.eigvalsh(stiffness)[-1])
    for _ in range(60):
        dt = 0.5 * (low + high)
        stable = np.linalg.eigvalsh(0.25 * dt * dt * stiffness + 0.5 * dt * damping)[-1] < 1.0
        low, high = (dt, high) if stable else (low, dt)
    return low


GRIDS = {
    "thin": {},
    "as thick as its pitch": {"thickness": 0.025},
    "limp": {"reduction": 0.05},
    "strip": {"rows": 12, "columns": 2, "torsion": "SECTION"},
    "stretched": {"stretch": 0.02},
}


@pytest.mark.parametrize("name", GRIDS)
def test_the_bound_of_a_belt_grid_is_safe_and_close(name):
    state = scenes.start(grid_case(**GRIDS[name]))
    exact = exact_limit(stiffness_matrix(state))
    found = bond_limit(state.scene).time_step
    assert found <= exact * (1 + 1e-6)
    assert found >= 0.9 * exact


@pytest.mark.parametrize("damping", [0.05, 0.5, 5.0])
def test_the_bound_of_a_damped_grid_is_safe_and_not_far(damping):
    state = scenes.start(grid_case(damping=damping))
    exact = exact_limit(stiffness_matrix(state), damping_matrix(state))
    found = bond_limit(state.scene).time_step
    assert found <= exact * (1 + 1e-6)
    assert found >= 0.75 * exact


@pytest.mark.parametrize(("damping", "share"), [(0.0, 2.0), (0.05, 1.9025), (1.0, 0.8284), (10.0, 0.0998)])
def test_the_limit_of_one_damped_pair_is_the_known_one(damping, share):
    omega = 3e3
    assert damped_limit(omega**2, 2 * damping * omega) * omega == pytest.approx(share, abs=1e-4)


def test_no_stiffness_sets_no_limit_and_pure_damping_sets_one():
    assert damped_limit(0.0, 0.0) == np.inf
    assert damped_limit(0.0, 100.0) == pytest.approx(2.0 / 100.0)


def stretched_pair(share_of_exact, damping=0.0):
    """Two bonded particles, pulled apart a little, stepped at a share of their exact limit."""
    deck = grid_case(rows=2, columns=1, damping=damping)
    state = scenes.start(deck)
    stiffness = stiffness_matrix(state)
    exact = exact_limit(stiffness, damping_matrix(state) if damping else None)
    deck.blocks("STEP")[0].parameters["TIME STEP"] = share_of_exact * exact
    state = scenes.start(deck)
    rng = np.random.default_rng(1)
    scenes.particles(state).velocity[:] = 1e-3 * rng.standard_normal((3, 2))
    return state


@pytest.mark.parametrize("damping", [0.0, 0.05, 1.0])
def test_steps_below_the_exact_limit_keep_the_energy_and_steps_beyond_it_blow_up(damping):
    state = stretched_pair(0.99, damping)
    before = scenes.kinetic_energy(state)
    scenes.advance(state, 20_000)
    # kinetic energy ripples with 1 / (1 - (dt omega / 2)^2) at 0.99 of the limit, about 50 times
    assert scenes.kinetic_energy(state) < 60 * before
    with pytest.raises(BlowUp, match=r"particle \d"):
        scenes.advance(stretched_pair(1.02, damping), 20_000)


def chosen(deck, *, allow_unstable=False):
    """Time step that a deck gets, and the sentence about it."""
    said = []
    state = state_of(build(deck))
    stage = prepare(state, state.scene.steps[0], 0.0, said.append, allow_unstable)
    return stage.time_step, said[0], stable_limit(state.scene, stage.spins, stage.slides, stage.guided)


def test_auto_takes_its_share_of_the_limit_and_fills_the_duration():
    deck = grid_case()
    step, sentence, limit = chosen(deck)
    count = 1e-3 / step
    assert count == pytest.approx(round(count), abs=1e-9)
    assert 0.7 * limit.time_step < step <= 0.8 * limit.time_step
    assert "set by bonds of particle" in sentence


def test_a_given_step_above_the_limit_is_refused_by_name_and_below_it_taken():
    deck = grid_case()
    limit = chosen(deck)[2].time_step
    step = deck.blocks("STEP")[0].parameters
    step["TIME STEP"] = 0.99 * limit
    assert chosen(deck)[0] == 0.99 * limit
    step["TIME STEP"] = 1.01 * limit
    with pytest.raises(TimeStepError, match="exceeds the stability limit set by bonds of particle"):
        chosen(deck)
    assert chosen(deck, allow_unstable=True)[0] == 1.01 * limit


def test_an_impact_gets_twenty_steps():
    deck = scenes.case(time_step="AUTO")
    scenes.add_spheres(deck, [(0, 0, 0), (1, 0, 0)], radius=0.01, velocity=[(2.0, 0, 0), (0, 0, 0)])
    mass = 1200.0 * 4.0 / 3.0 * np.pi * 1e-6
    duration = impact_duration(0.005, 0.5 * 5e6 / 0.91, mass / 2, 2.0)
    limit = chosen(deck)[2]
    assert limit.time_step == pytest.approx(duration / 20.0, rel=1e-12)
    assert "impact of ball" in limit.cause


def test_a_fall_through_the_scene_sets_the_speed_of_the_impact():
    deck = scenes.case(time_step="AUTO", gravity=(0.0, 0.0, -9.81))
    scenes.add_spheres(deck, [(0, 0, 2.0)], radius=0.01)
    scenes.add_plane(deck)
    assert f"{np.sqrt(2 * 9.81 * 2.0):.3g} m/s" in chosen(deck)[2].cause


def test_bulk_falls_to_the_bottom_of_the_domain_without_a_blow_up():
    deck = scenes.case(time_step="AUTO", gravity=(0.0, 0.0, -9.81), duration=1.6)
    scenes.add_spheres(deck, [(0, 0, 0), (1, 0, 0)], radius=0.01)
    deck.add("DOMAIN", rows={"box": [(-2, -2, -13.0, 2, 2, 1.0)]})
    assert f"{np.sqrt(2 * 9.81 * 14.0):.3g} m/s" in chosen(deck)[2].cause
    state = scenes.start(deck)
    scenes.advance(state, round(1.6 / state.stage.time_step))
    assert scenes.particles(state).position[2] == pytest.approx(-0.5 * 9.81 * 1.6**2, rel=1e-9)


def test_a_fast_particle_sets_the_step_by_its_travel():
    deck = scenes.case(time_step="AUTO")
    scenes.add_spheres(deck, [(0, 0, 0)], radius=0.01, velocity=(1e4, 0, 0))
    limit = chosen(deck)[2]
    assert limit.time_step <= 0.1 * 0.01 / 1e4
    assert "travel" in limit.cause


def test_a_heavy_sphere_on_light_boxes_gets_the_step_of_the_light_ones():
    """The pair swings with the reduced mass, which is the box's: 20 steps in that impact."""
    deck = scenes.case(time_step="AUTO")
    heavy = {"density": 1.2e9, "youngs_modulus": 5e6, "poisson_ratio": 0.3}
    deck.add("MATERIAL", name="heavy", **heavy)
    scenes.add_boxes(deck, [(0, 0, 0)], size=(0.03, 0.03, 0.01), edge_radius=0.004, group="belt")
    scenes.add_spheres(deck, [(0, 0, 0.03)], radius=0.02, material="heavy", velocity=(0, 0, -1.0))
    state = scenes.start(deck)
    duration = impact_duration(0.02, 0.5 * 5e6 / 0.91, scenes.particles(state).mass[0], 1.0)
    assert chosen(deck)[2].time_step <= duration / 20.0


def test_a_box_without_bonds_gets_a_limit_from_its_line_contact():
    deck = scenes.case(time_step="AUTO", gravity=(0.0, 0.0, -9.81))
    scenes.add_boxes(deck, [(0, 0, 0.1)], size=(0.1, 0.108, 0.01), edge_radius=0.004, group="belt")
    scenes.add_cylinder(deck, diameter=0.2, length=0.3, point=(0, 0, -0.0049))
    state = scenes.start(deck)
    stiffness = np.pi / 4 * 0.5 * 5e6 / 0.91 * 0.1
    assert chosen(deck)[2].time_step <= 2.0 / np.sqrt(stiffness / scenes.particles(state).mass[0])


def line_wrench(place, rotation, shape):
    """Force and torque on a box by a roller along y, over the stiffness per length; `shape`: core, edge, radius."""
    core, edge, roller = shape
    quaternion = tuple(rotation.as_quat(scalar_first=True))
    area, _, normal, point, _, lever, _ = box_cylinder(
        tuple(place), quaternion, core, edge, (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), roller, 0.2
    )
    force = area * np.array(normal)
    return np.concatenate([force, np.cross(np.array(point) - place, force) + lever * force])


@pytest.mark.parametrize("skew", [0.0, 0.25 * np.pi, 0.45 * np.pi])
@pytest.mark.parametrize("size", [(0.05, 0.05, 0.01), (0.1, 0.03, 0.01), (0.05, 0.05, 0.05)])
def test_the_bound_of_a_line_contact_covers_its_stiffness_at_any_skew(size, skew):
    """The largest eigenvalue of the inverse mass times the differences of the force, translations and turns."""
    edge, roller, overlap = 0.004, 0.1, 3e-4
    deck = scenes.case(time_step=1e-6)
    scenes.add_boxes(deck, [(0, 0, 1.0)], size=size, edge_radius=edge, group="belt")
    scenes.add_cylinder(deck, diameter=2 * roller, length=0.4)
    scene = build(deck)
    bound = line_contact_rows(scene)[0]
    particles, core = scene.population.particles, tuple(np.array(size) / 2 - edge)
    rng = np.random.default_rng(4)
    for tilt in (0.0, 1e-3, 1e-2):
        rotation = Rotation.from_euler("z", skew) * Rotation.from_rotvec(tilt * rng.standard_normal(3))
        height = roller + edge + np.abs(rotation.as_matrix()[2]) @ core - overlap
        place, shape = np.array([0.0, 0.0, height]), (core, edge, roller)
        columns = []
        for shift in 1e-3 * overlap * np.eye(3):
            less, more = (line_wrench(place + sign * shift, rotation, shape) for sign in (-1, 1))
            columns.append(less - more)
        for turn in 1e-3 * overlap / max(core) * np.eye(3):
            less, more = (Rotation.from_rotvec(sign * turn) * rotation for sign in (-1, 1))
            columns.append((line_wrench(place, less, shape) - line_wrench(place, more, shape)) * max(core))
        stiffness = np.array(columns).T / (2e-3 * overlap) * np.pi / 4 * scene.laws.normal_modulus.max()
        matrix, inverse = rotation.as_matrix(), np.zeros((6, 6))
        inverse[:3, :3] = np.eye(3) / particles.mass[0]
        inverse[3:, 3:] = matrix @ np.diag(1.0 / particles.inertia[:, 0]) @ matrix.T
        assert np.linalg.eigvals(inverse @ stiffness).real.max() < bound


def test_the_present_bound_sees_contacts_that_have_grown_stiff():
    deck = scenes.case(time_step=1e-6)
    scenes.add_spheres(deck, [(0, 0, 0), (0.018, 0, 0)], radius=0.01, fixed="NO", name="pressed")
    state = scenes.start(deck)
    mass = scenes.particles(state).mass[0]
    stiffness = 2.0 * 0.5 * 5e6 / 0.91 * np.sqrt(0.005 * 0.002)
    exact = 2.0 / np.sqrt(2.0 * stiffness / mass)
    # The bound covers friction too, whose pair of motions is the faster one: 2 k_t (1 / m + a^2 / I)
    friction = 2.0 / np.sqrt(
        2.0 * stiffness * (4.0 * 0.5 * 5e6 / 2.6 / 1.7) / (0.5 * 5e6 / 0.91) / mass * 3.5
    )
    found = present_limit(state).time_step
    assert found <= min(exact, friction)
    assert found > 0.4 * min(exact, friction)
