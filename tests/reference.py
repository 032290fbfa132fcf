"""Slow, obvious versions of the bond and contact laws in numpy, independent of the solver.

The bond is nothing but its energy: forces and torques are finite differences of it. The impacts integrate the
equations of motion of the contact with small steps. tests/test_reference.py proves them.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

# --- bonds --------------------------------------------------------------------------------------------------------


def rotation(quaternion):
    """Rotation of a quaternion (w, x, y, z)."""
    return Rotation.from_quat(np.roll(quaternion, -1))


def quaternion(turn):
    """(w, x, y, z) of a rotation."""
    return np.roll(turn.as_quat(), 1)


@dataclass(frozen=True)
class Body:
    """Centre (3,) [m] and orientation of one particle."""

    position: np.ndarray
    turn: Rotation

    def moved(self, step):
        """Shifted by step[:3] [m] and turned by the rotation vector step[3:] [rad], in world axes."""
        return Body(self.position + step[:3], Rotation.from_rotvec(step[3:]) * self.turn)


@dataclass(frozen=True)
class Bond:
    """A bond: stress-free length, stiffnesses along and about the axes 1, 2, 3, the triad in each body's frame."""

    length: float
    stiffness: np.ndarray
    angular_stiffness: np.ndarray
    first: Rotation
    second: Rotation


def bond_between(a, b, stiffness, angular_stiffness):
    """The bond that is free of stress while its bodies are as they are now.

    e1 points from the first to the second, e3 is the mean local z made normal to e1, e2 = e3 x e1.
    """
    d = b.position - a.position
    e1 = d / np.linalg.norm(d)
    normal = a.turn.apply([0, 0, 1]) + b.turn.apply([0, 0, 1])
    normal = normal - e1 * (e1 @ normal)
    e3 = normal / np.linalg.norm(normal)
    triad = Rotation.from_matrix(np.column_stack([e1, np.cross(e3, e1), e3]))
    return Bond(
        np.linalg.norm(d),
        np.asarray(stiffness, float),
        np.asarray(angular_stiffness, float),
        a.turn.inv() * triad,
        b.turn.inv() * triad,
    )


def section_stiffness(strip, length, *, reduction=1.0, in_plane=1.0, shear="TIMOSHENKO", torsion="SECTION"):
    """Stiffnesses along and about the axes 1, 2, 3 of a rectangular section; `strip` has modulus, width, thickness.

    The reduction factors scale the bending rigidity, in the moment and in the shear stiffness of the same plane.
    """
    e, g = strip.youngs_modulus, strip.youngs_modulus / (2 * (1 + strip.poisson_ratio))
    b, t = strip.width, strip.thickness
    bending_2, bending_3 = reduction * e * b * t**3 / 12, in_plane * e * t * b**3 / 12
    thin, wide = min(b, t), max(b, t)
    lone = wide * thin**3 / 3 * (1 - 0.63 * thin / wide + 0.052 * (thin / wide) ** 5)
    twisting = g * (lone if torsion == "SECTION" else b * t**3 / 6)
    shearing = 5 / 6 * g * b * t

    def sideways(bending):
        if shear == "SPRING":
            return shearing / length
        return 12 * bending / (length**3 * (1 + 12 * bending / (shearing * length**2)))

    stiffness = np.array([e * b * t / length, sideways(bending_3), sideways(bending_2)])
    return stiffness, np.array([twisting, bending_2, bending_3]) / length


def strains(bond, a, b):
    """Stretch and displacement across [m] and rotation vector [rad], in the frame halfway between its two triads."""
    first, second = a.turn * bond.first, b.turn * bond.second
    angles = (first.inv() * second).as_rotvec()
    halfway = first * Rotation.from_rotvec(angles / 2)
    chord = halfway.inv().apply(b.position - a.position)
    return np.array([np.linalg.norm(chord) - bond.length, chord[1], chord[2]]), angles


def energy(bond, a, b):
    """Elastic energy [J]."""
    e, angles = strains(bond, a, b)
    return 0.5 * (bond.stiffness @ e**2 + bond.angular_stiffness @ angles**2)


def loads(bond, a, b):
    """Force and torque on both bodies, (2, 6): minus the gradient of the energy, by differences of fourth order.

    Error about 1e-12 from the step and 1e-16 U / step from rounding: 1e-9 relative in states of moderate strain.
    """
    result = np.empty((2, 6))
    for k, axis in enumerate(np.eye(6)):
        step = 3e-4 * (bond.length if k < 3 else 1.0)
        for body in (0, 1):

            def at(n, axis=axis, step=step, body=body):
                return energy(
                    bond,
                    a.moved(n * step * axis) if body == 0 else a,
                    b.moved(n * step * axis) if body else b,
                )

            result[body, k] = (at(2) - 8 * at(1) + 8 * at(-1) - at(-2)) / (12 * step)
    return result


def tangent(bond, a, b):
    """Stiffness matrix (12, 12) of a bond at this state: second differences of the energy; first body first.

    Error 1e-11 from the step and 1e-10 from rounding, both of the largest stiffness: 1e-6 of one 1e4 times smaller.
    """
    steps = 3e-6 * np.tile([bond.length] * 3 + [1.0] * 3, 2)
    shifts = np.diag(steps)

    def at(shift):
        return energy(bond, a.moved(shift[:6]), b.moved(shift[6:]))

    result = np.empty((12, 12))
    for i in range(12):
        for j in range(i + 1):
            u, v = shifts[i], shifts[j]
            mixed = at(u + v) - at(u - v) - at(v - u) + at(-u - v)
            result[i, j] = result[j, i] = mixed / (4 * steps[i] * steps[j])
    return result


# --- chains -------------------------------------------------------------------------------------------------------


def straight_chain(strip, bonds, **options):
    """Bodies along x and the bonds between them; `options` go to `section_stiffness`."""
    pitch = strip.length / bonds
    bodies = [Body(np.array([k * pitch, 0.0, 0.0]), Rotation.identity()) for k in range(bonds + 1)]
    law = section_stiffness(strip, pitch, **options)
    return bodies, [bond_between(a, b, *law) for a, b in pairwise(bodies)]


def chain_loads(bodies, bonds):
    """Sum of the bonds' loads on each body, (n, 6)."""
    total = np.zeros((len(bodies), 6))
    for k, bond in enumerate(bonds):
        total[k : k + 2] += loads(bond, bodies[k], bodies[k + 1])
    return total


def chain_tangent(bodies, bonds):
    """Stiffness matrix (6 n, 6 n) of the chain."""
    total = np.zeros((6 * len(bodies), 6 * len(bodies)))
    for k, bond in enumerate(bonds):
        total[6 * k : 6 * k + 12, 6 * k : 6 * k + 12] += tangent(bond, bodies[k], bodies[k + 1])
    return total


def equilibrium(bodies, bonds, tip_load, *, rounds=20):
    """The chain at rest, its first body held, under a dead load (6,) on its last: Newton's method.

    Ends when nothing is out of balance by more than 1e-6 of the load. Differences cannot do much better: the
    rounding of positions alone makes k_n L 1e-16, 1e-10 N in a strip of 0.5 MN/m.
    """
    applied = np.zeros((len(bodies), 6))
    applied[-1] = tip_load
    for _ in range(rounds):
        rest = (chain_loads(bodies, bonds) + applied)[1:]
        if np.abs(rest).max() <= 1e-6 * np.abs(tip_load).max():
            return bodies
        step = np.linalg.solve(chain_tangent(bodies, bonds)[6:, 6:], rest.ravel()).reshape(-1, 6)
        bodies = [bodies[0], *(body.moved(move) for body, move in zip(bodies[1:], step))]
    raise AssertionError(f"no equilibrium after {rounds} rounds: {np.abs(rest).max()} N")


def frequencies(bodies, bonds, strip):
    """Natural frequencies [Hz] of the chain with its first body held, rising.

    Lumped masses, half at the end; inertias of the cell of the strip around each body.
    """
    pitch = strip.length / len(bonds)
    mass = np.full(len(bodies), strip.density * strip.width * strip.thickness * pitch)
    mass[-1] /= 2
    b, t = strip.width, strip.thickness
    about = np.array([b**2 + t**2, pitch**2 + t**2, pitch**2 + b**2]) / 12
    scales = (
        1 / np.sqrt(np.concatenate([np.repeat(mass[:, None], 3, axis=1), mass[:, None] * about], axis=1))[1:]
    )
    stiffness = chain_tangent(bodies, bonds)[6:, 6:]
    squares = np.linalg.eigvalsh(stiffness * np.outer(scales.ravel(), scales.ravel()))
    return np.sqrt(np.maximum(squares, 0)) / (2 * math.pi)


# --- impacts ------------------------------------------------------------------------------------------------------


def head_on(impact, restitution=1.0):
    """Hertz impact with damping 2 sqrt(5/6) b sqrt(m S): largest force and overlap, duration, rebound speed.

    The contact ends where the overlap does; the attractive tail before it is kept. b = -ln e / sqrt(pi^2 + ln^2 e).
    Source: Tsuji et al. 1992; Antypov and Elliott 2011.
    """
    log = math.log(restitution)
    damping = 2 * math.sqrt(5 / 6) * -log / math.sqrt(math.pi**2 + log**2)

    def force(overlap, rate):
        overlap = max(overlap, 0.0)
        tangent = 2 * impact.modulus * math.sqrt(impact.radius * overlap)
        return impact.stiffness * overlap**1.5 + damping * math.sqrt(impact.mass * tangent) * rate

    def parted(_, state):
        return state[0]

    parted.terminal, parted.direction = True, -1
    answer = solve_ivp(
        lambda _, state: (state[1], -force(*state) / impact.mass),
        (0, 10 * impact.duration),
        (0, impact.speed),
        events=parted,
        method="DOP853",
        max_step=impact.duration / 200,
        rtol=1e-10,
        atol=1e-16,
    )
    overlaps, rates = answer.y
    largest = max(force(*state) for state in zip(overlaps, rates))
    return largest, overlaps.max(), answer.t[-1], -rates[-1]


def oblique(impact, shear_ratio, speed, friction, radius, restitution=1.0, steps=20_000):
    """A sphere that meets a rigid plane at normal speed `impact.speed` and tangential speed `speed`, without spin.

    Mindlin's no-slip spring S_t = shear_ratio S_n, dF_t = S_t du; when the contact unloads the spring shrinks with
    S_t; Coulomb's bound is friction max(F_n, 0).

    Returns
    -------
    normal and tangential velocity of the centre [m/s] and spin [rad/s] after the impact
    """
    log = math.log(restitution)
    damping = 2 * math.sqrt(5 / 6) * -log / math.sqrt(math.pi**2 + log**2)
    dt = impact.duration / steps
    overlap, rate, spin, spring, old = 0.0, impact.speed, 0.0, 0.0, 0.0
    while True:
        overlap += 0.5 * dt * rate
        if overlap <= 0:
            return -rate, speed, spin
        tangent = 2 * impact.modulus * math.sqrt(impact.radius * overlap)
        normal = 2 / 3 * tangent * overlap + damping * math.sqrt(impact.mass * tangent) * rate
        stiffness = shear_ratio * tangent
        if stiffness < old:
            spring *= stiffness / old
        spring += stiffness * (speed - radius * spin) * dt
        bound = friction * max(normal, 0.0)
        spring, old = max(-bound, min(bound, spring)), stiffness
        rate -= normal / impact.mass * dt
        speed -= spring / impact.mass * dt
        spin += 2.5 * spring / (impact.mass * radius) * dt
        overlap += 0.5 * dt * rate
