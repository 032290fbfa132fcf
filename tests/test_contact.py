"""The contact laws by themselves: energies, bounds, histories."""

import numpy as np
import pytest

from beltsim.solver import contact

UP = (0.0, 0.0, 1.0)
NONE = (0.0, 0.0, 0.0)


def slide(velocity, *, normal=UP, spring=NONE, before=0.0, stiffness=1e4, bound=1e9, damping=0.0, step=1e-5):
    """Friction force and spring as arrays."""
    force, spring = contact.friction_force(
        tuple(velocity), normal, step, tuple(spring), before, stiffness, damping, 1.0, bound
    )
    return np.array(force), np.array(spring)


def test_hertz_force_and_stiffness_are_the_slopes_of_the_energy():
    radius, modulus, overlap = 0.01, 3e7, 2e-5

    def energy(d):
        return 8.0 / 15.0 * modulus * np.sqrt(radius) * d**2.5

    force, stiffness = contact.hertz(overlap, radius, modulus)
    h = 1e-9
    assert force == pytest.approx((energy(overlap + h) - energy(overlap - h)) / (2 * h), rel=1e-7)
    above, below = (
        contact.hertz(overlap + h, radius, modulus)[0],
        contact.hertz(overlap - h, radius, modulus)[0],
    )
    assert stiffness == pytest.approx((above - below) / (2 * h), rel=1e-7)


def test_hertz_force_of_equal_spheres_is_the_textbook_one():
    # F = 4/3 E* sqrt(R*) d^1.5
    assert contact.hertz(1e-4, 0.25, 1.0)[0] == pytest.approx(4.0 / 3.0 * 0.5 * 1e-6, rel=1e-12)


@pytest.mark.parametrize("restitution", [0.05, 0.2, 0.5, 0.9, 0.999])
def test_the_damping_ratio_gives_the_rebound_of_a_linear_oscillator(restitution):
    b = contact.damping_of_restitution(restitution)
    assert np.exp(-np.pi * b / np.sqrt(1.0 - b * b)) == pytest.approx(restitution, rel=1e-12)


def test_full_restitution_needs_no_damping():
    assert contact.damping_of_restitution(1.0) == 0.0


def test_friction_opposes_sliding_and_lies_in_the_tangent_plane():
    normal = tuple(np.array([1.0, 2.0, 2.0]) / 3.0)
    velocity = np.array([0.3, -0.7, 0.2])
    force, _ = slide(velocity, normal=normal, bound=0.5, stiffness=1e9)
    tangential = velocity - np.dot(velocity, normal) * np.array(normal)
    assert force == pytest.approx(-0.5 * tangential / np.linalg.norm(tangential), abs=1e-14)


def test_a_sticking_contact_is_a_spring_of_its_displacement():
    spring, stiffness = np.zeros(3), 0.0
    for _ in range(100):
        force, spring = slide([0.2, -0.1, 5.0], spring=spring, before=stiffness)
        stiffness = 1e4
    assert force == pytest.approx([-1e4 * 0.2 * 1e-3, 1e4 * 0.1 * 1e-3, 0.0], rel=1e-12)


def test_the_viscous_part_of_friction_is_never_remembered():
    force, spring = slide([1.0, 0.0, 0.0], damping=0.1, stiffness=1e4)
    assert spring == pytest.approx([-1e4 * 1e-5, 0.0, 0.0])
    assert force == pytest.approx([-1e4 * 1e-5 - 2 * 0.1 * np.sqrt(1e4), 0.0, 0.0])


@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_friction_never_exceeds_its_bound_and_the_spring_forgets_what_slipped(damping, rng):
    spring, before = np.zeros(3), 0.0
    for _ in range(500):
        bound, velocity = rng.uniform(0.0, 2.0), rng.standard_normal(3) * (1, 1, 0)
        force, spring = slide(velocity, spring=spring, before=before, bound=bound, damping=damping)
        before = 1e4
        assert np.linalg.norm(force) <= bound * (1 + 1e-15)
        # What is remembered is the force without its viscous part, but for what would push with the sliding.
        expected = force + 2 * damping * np.sqrt(1e4) * velocity
        direction = force / np.linalg.norm(force)
        if np.linalg.norm(force) > bound * (1 - 1e-12):
            expected -= min(expected @ direction, 0.0) * direction
        assert spring == pytest.approx(expected, abs=1e-12)


def test_friction_is_zero_where_the_normal_force_pulls():
    force, spring = slide([1.0, 0.0, 0.0], spring=(-3.0, 0.0, 0.0), before=1e4, bound=0.0)
    assert not force.any()
    assert not spring.any()


def test_the_spring_turns_with_the_contact_and_keeps_its_length():
    """A pair that turns as one body through a quarter turn in small steps turns its friction with it."""
    spring = np.array([3.0, 0.0, 0.0])
    for angle in np.linspace(0.0, np.pi / 2, 1001)[1:]:
        _, spring = slide(NONE, normal=(np.sin(angle), 0.0, np.cos(angle)), spring=spring, before=1e4)
        assert np.linalg.norm(spring) == pytest.approx(3.0, rel=1e-12)
    assert spring == pytest.approx([0.0, 0.0, -3.0], abs=1e-12)


def test_the_spring_shrinks_with_its_stiffness_but_does_not_grow_with_it():
    _, smaller = slide(NONE, spring=(4.0, 0.0, 0.0), before=1e4, stiffness=2.5e3)
    _, same = slide(NONE, spring=(4.0, 0.0, 0.0), before=2.5e3, stiffness=1e4)
    assert smaller == pytest.approx([1.0, 0.0, 0.0])
    assert same == pytest.approx([4.0, 0.0, 0.0])


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.5])
def test_no_cycle_of_loading_and_sliding_gains_energy(damping, rng):
    """Work done on the contact over any path that ends unloaded is never negative (the law is passive)."""
    for _ in range(50):
        phase = rng.uniform(0.0, 2 * np.pi, 4)
        spring, before, work = np.zeros(3), 0.0, 0.0
        last = None
        for t in np.linspace(0.0, 1.0, 2001)[1:]:
            stiffness = 1e4 * np.sin(np.pi * t) * (1.0 + 0.5 * np.sin(9 * t + phase[0])) + 1e-12
            velocity = np.array([np.sin(7 * t + phase[1]), np.cos(11 * t + phase[2]), 0.0])
            force, new = slide(
                velocity,
                spring=spring,
                before=before,
                stiffness=stiffness,
                bound=1e-2 * stiffness,
                step=5e-4,
                damping=damping,
            )
            mean = force if last is None else 0.5 * (force + last)
            work -= np.dot(mean, velocity) * 5e-4
            spring, before, last = new, stiffness, force
        assert work > 0.0


def test_rolling_resistance_is_a_spring_up_to_its_bound():
    k_n, arm, step = 1e5, 1e-3, 1e-4
    stiffness = 2.25 * k_n * arm**2
    _, first = contact.rolling_moment(NONE, (0.5, 0.0, 3.0), UP, step, k_n, arm, 0.0, 1.0, 1.0)
    assert first == pytest.approx((-stiffness * 0.5 * step, 0.0, 0.0))
    moment, second = contact.rolling_moment(first, (0.5, 0.0, 3.0), UP, step, k_n, arm, 0.0, 1.0, 1.0)
    assert moment == second == pytest.approx((-stiffness * 1.0 * step, 0.0, 0.0))
    moment, spring = contact.rolling_moment(second, (0.0, 1e9, 0.0), UP, step, k_n, arm, 0.0, 1.0, 2e-3)
    assert moment == spring
    assert np.linalg.norm(moment) == pytest.approx(2e-3, rel=1e-12)


def test_the_rolling_damper_is_a_share_of_critical_and_holds_the_bound_with_its_spring():
    k_n, arm, step, inertia = 1e5, 1e-3, 1e-4, 3e-6
    stiffness = 2.25 * k_n * arm**2
    critical = 2.0 * np.sqrt(inertia * stiffness)
    moment, spring = contact.rolling_moment(NONE, (0.5, 0.0, 3.0), UP, step, k_n, arm, 0.3, inertia, 1.0)
    assert moment == pytest.approx((spring[0] - 0.3 * critical * 0.5, 0.0, 0.0), rel=1e-12)
    bound = 0.5 * (abs(spring[0]) + abs(moment[0]))  # above the spring alone, below both
    moment, held = contact.rolling_moment(NONE, (0.5, 0.0, 3.0), UP, step, k_n, arm, 0.3, inertia, bound)
    assert moment == pytest.approx((-bound, 0.0, 0.0), rel=1e-12)
    assert held == spring


@pytest.fixture
def rng():
    return np.random.default_rng(11)
