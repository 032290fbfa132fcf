"""The bonded boxes of a belt under a sphere as one surface.

Boxes of a belt overlap, so a sphere near a seam lies on two or four of them, and where light boxes took turns in
carrying it, each turn made energy: 4 W in the sample conveyor, 3.5 % of all damping. So the energy of the contact is
that of one box at the overlap

    d = (sum d_k^p)^(1/p),   p = 256,

over all boxes within two bonds of the deepest one, which leads: a smooth maximum. Each box carries the share dd/dd_k =
(d_k / d)^(p - 1) of the force along its own normal, and the contact's motion is the mean of theirs by these shares, so
that no energy is made. Where the next box is 5 % less deep the contact is the leader's alone; four equally deep boxes
press 1.4 % harder than one. The leader holds the history, and hands it on when another one gets deeper.
"""

from __future__ import annotations

import math

import numpy as np

from beltsim.solver.contacts import NONE, inertia_about, law_of, noted_loads, put_loads, surface
from beltsim.solver.jit import callee, inner
from beltsim.solver.ledger import hand_on
from beltsim.solver.scratch import scratch_row, scratch_rows
from beltsim.solver.shapes import sphere_box
from beltsim.solver.vectors import add, at, at4, cross, dot, norm, plus, put, scaled, sub

SQUARINGS = 8
SHARPNESS = 2**SQUARINGS
LEAST = 0.95  # of the leader's overlap: less deep boxes have a share below 2e-6
MOST = 21  # boxes within two bonds

LOADED = -1.0
"""Stiffness of a pair that has loads but no history, since another one leads."""

SHARE, NORMAL, ARM_1, ARM_2 = 0, 1, 4, 7  # rows of the scratch space of a surface
ROWS = 10


@inner
def beats(overlaps, other, k):
    """Whether pair `other` overlaps more than pair k; of equals the lower one does."""
    return overlaps[other] > overlaps[k] or (overlaps[other] == overlaps[k] and other < k)


@inner
def leads(contacts, k):
    """Whether pair k touches and no box within two bonds of its own overlaps more."""
    overlaps, beside = contacts.overlap, contacts.beside
    if overlaps[k] <= 0.0:
        return False
    for n in range(4):
        near = beside[n, k]
        if near >= 0:
            if beats(overlaps, near, k):
                return False
            for m in range(4):
                far = beside[m, near]
                if far >= 0 and beats(overlaps, far, k):
                    return False
    return True


@inner
def inherit(contacts, k):
    """Hand the history of a pair within two bonds that leads no more on to pair k, which begins to lead."""
    for n in range(4):
        near = contacts.beside[n, k]
        if near >= 0:
            if take_over(contacts, k, near):
                return
            for m in range(4):
                far = contacts.beside[m, near]
                if far >= 0 and take_over(contacts, k, far):
                    return


@inner
def take_over(contacts, k, other):
    """Hand the history of pair `other` on to pair k, if it has one and leads no more."""
    if contacts.stiffness[other] <= 0.0 or leads(contacts, other):
        return False
    contacts.stiffness[k], contacts.stiffness[other] = contacts.stiffness[other], LOADED
    put(contacts.spring, k, at(contacts.spring, other))
    put(contacts.rolling, k, at(contacts.rolling, other))
    hand_on(contacts.book, k, other)
    return True


@callee
def load_surfaces(particles, shapes, laws, contacts, leaders, count, time_step):
    """Loads of the spheres that lie on several boxes; leaders of the others go to the front. Returns how many they are.

    `leaders` (count,) are pairs; all others have no loads yet.
    """
    members, tile = scratch_row(MOST, np.int64), scratch_rows(ROWS, MOST)
    for n in range(count):
        put_loads(contacts.loads, leaders[n], NONE, NONE, NONE)
    alone = 0
    for n in range(count):
        k = leaders[n]
        size = find_members(contacts, k, members)
        if size == 1:
            leaders[alone] = k
            alone += 1
        else:
            overlap = share_out(contacts.overlap, members, size, tile)
            place(particles, shapes, contacts, members, size, tile)
            sphere_on_surface(particles, shapes, laws, contacts, k, overlap, members[:size], tile, time_step)
    return alone


@inner
def find_members(contacts, k, members):
    """Pairs that share the load that pair k leads, itself the first; returns how many."""
    members[0], count = k, 1
    for n in range(4):
        near = contacts.beside[n, k]
        if near >= 0:
            count = with_member(contacts.overlap, near, members, count)
            for m in range(4):
                far = contacts.beside[m, near]
                if far >= 0:
                    count = with_member(contacts.overlap, far, members, count)
    return count


@inner
def with_member(overlaps, k, members, count):
    """Put pair k to the members, if it is nearly as deep as the first and not there yet; returns their count."""
    if overlaps[k] < LEAST * overlaps[members[0]]:
        return count
    for n in range(count):
        if members[n] == k:
            return count
    members[count] = k
    return count + 1


@inner
def sharpened(ratio):
    """ratio^SHARPNESS."""
    for _ in range(SQUARINGS):
        ratio *= ratio
    return ratio


@inner
def share_out(overlaps, members, count, tile):
    """Shares of the members into the tile; returns the overlap of the surface [m]."""
    leader, whole = overlaps[members[0]], 0.0
    for n in range(count):
        whole += sharpened(overlaps[members[n]] / leader)
    grown = math.exp(math.log(whole) / SHARPNESS)
    for n in range(count):
        ratio = overlaps[members[n]] / leader
        tile[SHARE, n] = sharpened(ratio) / ratio * grown / whole
    return leader * grown


@inner
def place(particles, shapes, contacts, members, count, tile):
    """Normals and arms of the members into the tile."""
    for n in range(count):
        k = members[n]
        i, j = contacts.first[k], contacts.second[k]
        centre, box_centre = at(particles.position, i), at(particles.position, j)
        overlap, normal = sphere_box(
            centre,
            shapes.radius[i],
            box_centre,
            at4(particles.orientation, j),
            at(shapes.core, j),
            shapes.radius[j],
        )
        arm = scaled(normal, 0.5 * overlap - shapes.radius[i])
        put(tile[NORMAL:], n, normal)
        put(tile[ARM_1:], n, arm)
        put(tile[ARM_2:], n, sub(add(centre, arm), box_centre))


@inner
def mean_motion(particles, contacts, members, tile):
    """Normal, relative velocity and spins of the surface, by the shares, and its reduced mass and inertia.

    Along the normal the velocity is the rate at which the overlap of the surface falls.
    """
    i, mass, moves = contacts.first[members[0]], particles.mass, particles.mobility[0]
    spin_i = at(particles.angular_velocity, i)
    normal, relative, spin, rate, total = NONE, NONE, NONE, 0.0, 0.0
    inverse = moves[i] / mass[i]
    turning = moves[i] / inertia_about(particles, i, at(tile[ARM_1:], 0))
    for n in range(members.size):
        j, share = contacts.second[members[n]], tile[SHARE, n]
        own, arm, arm_j = at(tile[NORMAL:], n), at(tile[ARM_1:], n), at(tile[ARM_2:], n)
        spin_j = at(particles.angular_velocity, j)
        moving = sub(
            surface(at(particles.velocity, i), spin_i, arm), surface(at(particles.velocity, j), spin_j, arm_j)
        )
        normal, relative, spin = (
            plus(normal, share, own),
            plus(relative, share, moving),
            plus(spin, share, spin_j),
        )
        rate += share * dot(moving, own)
        total += share
        inverse += share * share * moves[j] / mass[j]
        turning += share * share * moves[j] / inertia_about(particles, j, arm_j)
    normal, relative = scaled(normal, 1.0 / norm(normal)), scaled(relative, 1.0 / total)
    relative = plus(relative, rate - dot(relative, normal), normal)
    # What is held moves like an infinite mass; of held ones alone any mass does.
    masses = (1.0 / inverse, 1.0 / turning) if inverse > 0.0 else (mass[i], mass[i])
    return normal, relative, (spin_i, scaled(spin, 1.0 / total)), total, masses


@inner
def add_loads(loads, k, force, torque_1, torque_2):
    """Add loads to those of pair k: a box between two surfaces belongs to both."""
    for row in range(3):
        loads[row, k] += force[row]
        loads[3 + row, k] += torque_1[row]
        loads[6 + row, k] += torque_2[row]


@inner
def sphere_on_surface(particles, shapes, laws, contacts, k, overlap, members, tile, time_step):
    """Loads of a sphere on the boxes of a surface that pair k leads, and its history."""
    i, j = contacts.first[k], contacts.second[k]
    radius, law = shapes.radius[i], law_of(laws, shapes.material[i], shapes.material[j])
    normal, relative, spins, total, masses = mean_motion(particles, contacts, members, tile)
    arms = (at(tile[ARM_1:], 0), at(tile[ARM_2:], 0))
    history = (at(contacts.spring, k), contacts.stiffness[k], at(contacts.rolling, k))
    force, moment, _, _, new = noted_loads(
        contacts.book, k, law, overlap, radius, *masses,
        normal, relative, relative, spins, arms, history, time_step,
    )  # fmt: skip
    pressure = dot(force, normal)
    tangential = plus(force, -pressure, normal)
    for n in range(members.size):
        share, arm, arm_j = tile[SHARE, n], at(tile[ARM_1:], n), at(tile[ARM_2:], n)
        part = plus(scaled(at(tile[NORMAL:], n), share * pressure), share / total, tangential)
        torque, torque_j = cross(arm, part), cross(part, arm_j)
        torque, torque_j = plus(torque, share / total, moment), plus(torque_j, -share / total, moment)
        contacts.stiffness[members[n]] = LOADED
        add_loads(contacts.loads, members[n], part, torque, torque_j)
    put(contacts.spring, k, new[0])
    contacts.stiffness[k] = new[1]
    put(contacts.rolling, k, new[2])


__all__ = ["inherit", "leads", "load_surfaces"]
