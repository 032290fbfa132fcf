"""Impact benchmarks 1, 2, 3 and 7 of Chung and Ooi 2011: normal impacts, and spheres that turn like gears.

Granular Matter 13, 643, doi 10.1007/s10035-011-0277-0.
"""

from __future__ import annotations

import math

import numpy as np

from beltsim.engine import advance_by
from beltsim.solver.timestep import impact_duration
from beltsim.verify.case import Case, Findings, Row
from beltsim.verify.spheres import Stuff, add_spheres, contact_deck, impacts
from beltsim.verify.stepping import start

GLASS, LIMESTONE = Stuff(4.8e10, 0.2, 2800.0), Stuff(2.0e10, 0.25, 2500.0)
ALUMINIUM, MAGNESIUM = Stuff(7.0e10, 0.3, 2699.0), Stuff(4.0e10, 0.35, 1800.0)
OXIDE, CAST_IRON = Stuff(3.8e11, 0.23, 4000.0), Stuff(1.0e11, 0.25, 7000.0)
ALLOY, COPPER = Stuff(7.0e10, 0.33, 2700.0), Stuff(1.2e11, 0.35, 8900.0)
SOURCE = "Chung & Ooi 2011"


def equal_spheres() -> Findings:
    """Test 1: two equal spheres meet head-on at 10 m/s each."""
    rows = []
    for name, stuff, force, overlap, duration in (
        ("glass", GLASS, 10696.9, 2.74113e-4, 40.338e-6),
        ("limestone", LIMESTONE, 7108.2, 3.68304e-4, 54.200e-6),
    ):
        time_step = duration / 1000.0
        deck = contact_deck(time_step=time_step, friction=0.35, ball=stuff)
        add_spheres(deck, "ball", "ball", 0.01, [[-0.01, 0.0, 0.0], [0.01, 0.0, 0.0]])
        state = start(deck, velocity=[[10.0, 0.0, 0.0], [-10.0, 0.0, 0.0]], allow_unstable=True)
        particles = state.scene.population.particles
        deepest, largest = 0.0, 0.0
        for _ in range(1100):
            advance_by(state, 1)
            deepest = max(deepest, 0.02 - float(np.ptp(particles.position[0])))
            largest = max(largest, abs(float(particles.force[0, 0])))
        gap, speed = np.ptp(particles.position[0]) - 0.02, np.ptp(particles.velocity[0])
        rows += [
            Row(f"largest force, {name}", "N", force, largest, 1e-3),
            Row(f"largest overlap, {name}", "m", overlap, deepest, 1e-3),
            Row(f"duration, {name}", "s", duration, state.time - gap / speed, 1e-3),
            Row(f"rebound speed, {name}", "m/s", 10.0, 0.5 * speed, 1e-3),
        ]
    return Findings(rows)


def rigid_plane() -> Findings:
    """Test 2: a sphere falls on a rigid plane at 0.2 m/s."""
    rows = []
    for name, stuff, force, overlap, duration in (
        ("aluminium alloy", ALUMINIUM, 11369.9, 4.97172e-5, 731.64e-6),
        ("magnesium alloy", MAGNESIUM, 7232.7, 5.21233e-5, 767.05e-6),
    ):
        out = impacts(stuff, 0.1, [[0.0, 0.0, -0.2]], steps=1000)
        rows += [
            Row(f"largest force, {name}", "N", force, out.force[0], 1e-3),
            Row(f"largest overlap, {name}", "m", overlap, out.overlap[0], 1e-3),
            Row(f"duration, {name}", "s", duration, out.duration[0], 1e-3),
        ]
    return Findings(rows)


def damped() -> Findings:
    """Test 3: restitution of a sphere on a rigid plane at 3.9 m/s."""
    rows = []
    for name, stuff in (("aluminium oxide", OXIDE), ("cast iron", CAST_IRON)):
        for e in (0.2, 0.4, 0.6, 0.8, 1.0):
            out = impacts(stuff, 0.0025, [[0.0, 0.0, -3.9]], restitution=e, steps=4000)
            rows.append(Row(f"restitution {e:g}, {name}", "-", e, out.velocity[0, 2] / 3.9, 2e-3))
    return Findings(rows)


def gears() -> Findings:
    """Test 7: two spheres that turn like gears meet: their surfaces do not slide, nothing turns them."""
    rows = []
    for name, stuff in (("aluminium alloy", ALLOY), ("copper", COPPER)):
        mass = 4.0 / 3.0 * math.pi * 0.1**3 * stuff.density
        time_step = impact_duration(0.05, 0.5 * stuff.plane_modulus, 0.5 * mass, 0.4) / 500
        deck = contact_deck(time_step=time_step, friction=0.4, restitution=0.5, ball=stuff)
        add_spheres(deck, "ball", "ball", 0.1, [[-0.1, 0.0, 0.0], [0.1, 0.0, 0.0]])
        velocity = [[0.2, 0.0, 0.0], [-0.2, 0.0, 0.0]]
        state = start(deck, velocity=velocity, spin=[[0.0, 3.0, 0.0], [0.0, -3.0, 0.0]], allow_unstable=True)
        advance_by(state, 1500)
        particles = state.scene.population.particles
        sideways = np.abs(particles.velocity[1:]).max()
        rows += [
            Row(f"sideways velocity, {name}", "m/s", 0.0, sideways, 1e-12, True),
            Row(f"spin, {name}", "rad/s", 3.0, particles.angular_velocity[1, 0], 1e-12),
            Row(f"restitution, {name}", "-", 0.5, np.ptp(particles.velocity[0]) / 0.4, 2e-3),
        ]
    return Findings(rows)


CASES = {
    "Q1": Case("Test 1: equal spheres", SOURCE, equal_spheres),
    "Q2": Case("Test 2: rigid plane", SOURCE, rigid_plane),
    "Q3": Case("Test 3: damped impact", SOURCE, damped),
    "Q7": Case("Test 7: gears", SOURCE, gears),
}
