"""Bonds of a deck as arrays: stress-free frames, stiffness, damping and strength, in kinds that bonds share.

Stiffness of a bond of length l, section b x t (width along e2, thickness along e3) or radius R:
    axial E A / l; twist G J / l; bending f E I / l; shear 12 E f I / (l^3 (1 + P)), P = 12 E f I / (k G A l^2)
with the reduction factor f in bending and in the shear that goes with it, so that the effective EI of a chain is
exactly f EI for any number of bonds (2-node Timoshenko element). Out-of-plane: f = REDUCTION FACTOR; in plane: IN PLANE
REDUCTION FACTOR. SHEAR=SPRING takes k G A / l instead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from beltsim import inp
from beltsim.inp import Block, Deck
from beltsim.scene.bodies import Population, stack
from beltsim.scene.bond_runs import in_runs
from beltsim.solver.state import BondKinds, Bonds, BondStrength, Runs

EQUAL = 2.0**36  # steps of a mantissa: equal scenes in other units group alike
ROUNDING = 1.5e-11  # of triads: 1 / EQUAL
TRIADS = slice(1, 9)  # columns of the two triads


@dataclass
class Section:
    """Section constants of a bond type, unreduced."""

    area: float  # m2
    bending_2: float  # second moment about the width direction (out of plane), m4
    bending_3: float  # about the thickness direction (in plane), m4
    torsion: float  # Saint-Venant constant, m4
    shear_factor: float
    modulus_2: float  # section moduli for the stresses, m3
    modulus_3: float
    modulus_torsion: float


def section_of(block: Block) -> Section:
    """Section of a *BOND TYPE.

    Torsion of a rectangle after Saint-Venant: J = b t^3/3 (1 - 0.63 t/b + 0.052 (t/b)^5) for b >= t. TORSION=GRID: a
    belt shares its twist between both bond directions, so each gets the plate's b t^3/6 (a circle: half its constant).
    """
    nu, radius = block["POISSON RATIO"], block.get("RADIUS")
    grid = block["TORSION"] == "GRID"
    if radius is not None:
        inertia = math.pi * radius**4 / 4.0
        return Section(
            math.pi * radius**2,
            inertia,
            inertia,
            inertia if grid else 2.0 * inertia,
            6.0 * (1.0 + nu) / (7.0 + 6.0 * nu),
            inertia / radius,
            inertia / radius,
            2.0 * inertia / radius,
        )
    b, t = block["SECTION WIDTH"], block["SECTION THICKNESS"]
    long, short = max(b, t), min(b, t)
    ratio = short / long
    saint_venant = long * short**3 / 3.0 * (1.0 - 0.63 * ratio + 0.052 * ratio**5)
    return Section(
        b * t,
        b * t**3 / 12.0,
        t * b**3 / 12.0,
        b * t**3 / 6.0 if grid else saint_venant,
        5.0 / 6.0,
        b * t * t / 6.0,
        t * b * b / 6.0,
        long * short * short / (3.0 + 1.8 * ratio),
    )


def stiffness_of(block: Block, section: Section, length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness (3, n) [N/m] and angular stiffness (3, n) [N m] of bonds of a type with the given lengths (n,)."""
    young = block["YOUNGS MODULUS"]
    shear = young / (2.0 * (1.0 + block["POISSON RATIO"]))
    out_of_plane = young * section.bending_2 * block["REDUCTION FACTOR"]
    in_plane = young * section.bending_3 * block["IN PLANE REDUCTION FACTOR"]
    shear_area = section.shear_factor * shear * section.area

    def shear_stiffness(bending):
        if block["SHEAR"] == "SPRING":
            return shear_area / length
        return 12.0 * bending / (length**3 + 12.0 * bending / shear_area * length)

    return (
        np.array([young * section.area / length, shear_stiffness(in_plane), shear_stiffness(out_of_plane)]),
        np.array([shear * section.torsion / length, out_of_plane / length, in_plane / length]),
    )


def triads_of(rows: dict) -> np.ndarray:
    """Quaternions (n, 4) of the stress-free bond triads in the axes of the rows.

    e1 from particle 1 to 2; e3 = mean of both local z made normal to e1, mean local y if that is shorter than 0.1,
    local z of particle 1 if that cancels too (the seam of a Moebius belt: its neighbours lie upside down).
    """
    from scipy.spatial.transform import Rotation

    first = Rotation.from_quat(rows["orientation_1"], scalar_first=True).as_matrix()
    second = Rotation.from_quat(rows["orientation_2"], scalar_first=True).as_matrix()
    d = rows["position_2"] - rows["position_1"]
    e1 = d / np.linalg.norm(d, axis=1)[:, None]

    def made_normal(axis):
        return axis - np.sum(axis * e1, axis=1)[:, None] * e1

    e3, other = (made_normal(0.5 * (first[:, :, k] + second[:, :, k])) for k in (2, 1))
    short = np.linalg.norm(e3, axis=1) < 0.1
    e3[short] = other[short]
    cancelled = np.linalg.norm(e3, axis=1) < 1e-6
    e3[cancelled] = made_normal(first[:, :, 2])[cancelled]
    e3 /= np.linalg.norm(e3, axis=1)[:, None]
    return Rotation.from_matrix(np.stack([e1, np.cross(e3, e1), e3], axis=2)).as_quat(scalar_first=True)


def seen_from(orientation: np.ndarray, triad: np.ndarray) -> np.ndarray:
    """Triads (n, 4) in the local frames of particles, of one sign so that equal ones are equal bit for bit."""
    w, x, y, z = (orientation * np.array([1.0, -1.0, -1.0, -1.0])).T
    a, b, c, d = triad.T
    local = np.stack(
        [
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        ],
        axis=1,
    )
    local /= np.linalg.norm(local, axis=1)[:, None]
    return np.where(local[:, :1] < 0.0, -local, local) + 0.0


def moments_along(triad: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """Moments of inertia (n, 3) about the axes of local triads (n, 4), from principal moments (n, 3)."""
    from scipy.spatial.transform import Rotation

    axes = Rotation.from_quat(triad, scalar_first=True).as_matrix()
    return np.einsum("nij,ni->nj", axes**2, inertia)


def written_types(deck: Deck, population: Population) -> tuple[list[Block], np.ndarray, np.ndarray]:
    """Bond types in use, the type's row of each bond after *BOND RULE, and the slots (n, 2) of each bond."""
    types: dict[str, int] = {}
    blocks: list[Block] = []
    rows, slots = [], []
    for block in deck.blocks("BOND"):
        if not len(block):
            continue
        pairs = population.slots_of(block.rows["particles"].ravel()).reshape(-1, 2)
        species = population.species[pairs]
        combinations, which = np.unique(species, axis=0, return_inverse=True)
        chosen = []
        for a, b in combinations:
            names = population.bodies[a].name, population.bodies[b].name
            found = inp.bond_type_of(deck, *names, block["TYPE"])
            if found not in types:
                types[found] = len(blocks)
                blocks.append(inp.named(deck, "BOND TYPE", found))
            chosen.append(types[found])
        rows.append(np.array(chosen)[which.ravel()])
        slots.append(pairs)
    return blocks, stack(rows, (0,), np.int64), stack(slots, (0, 2), np.int64)


@dataclass
class Bonding:
    """All bonds of a deck, in the solver's order."""

    bonds: Bonds
    runs: Runs
    kinds: BondKinds
    strength: BondStrength | None
    place: np.ndarray  # (m,) int64, where each bond of the deck stands


def bonds_of(deck: Deck, population: Population) -> Bonding | None:
    """All bonds of a deck, or None."""
    types, type_of, slots = written_types(deck, population)
    if not types:
        return None
    rows = {
        name: stack([block.rows[name] for block in deck.blocks("BOND")], (0, 3))
        for name in ("position_1", "orientation_1", "position_2", "orientation_2")
    }
    triad = triads_of(rows)
    triad_1, triad_2 = seen_from(rows["orientation_1"], triad), seen_from(rows["orientation_2"], triad)
    length = np.linalg.norm(rows["position_2"] - rows["position_1"], axis=1)
    mass = population.particles.mass[slots]
    moments_1 = moments_along(triad_1, population.particles.inertia.T[slots[:, 0]])
    moments_2 = moments_along(triad_2, population.particles.inertia.T[slots[:, 1]])
    reduced_mass = mass[:, 0] * mass[:, 1] / (mass[:, 0] + mass[:, 1])
    reduced_inertia = moments_1 * moments_2 / (moments_1 + moments_2)

    values = np.empty((length.size, 27))
    for row, block in enumerate(types):
        of_type = type_of == row
        section = section_of(block)
        stiffness, angular = stiffness_of(block, section, length[of_type])
        factor = 2.0 * block["DAMPING FACTOR"]
        values[of_type, 9:12], values[of_type, 12:15] = stiffness.T, angular.T
        values[of_type, 15:18] = factor * np.sqrt(stiffness.T * reduced_mass[of_type, None])
        values[of_type, 18:21] = factor * np.sqrt(angular.T * reduced_inertia[of_type])
        values[of_type, 21:27] = strength_row(block, section)
    values[:, 0], values[:, 1:5], values[:, 5:9] = length, triad_1, triad_2
    kinds, kind = shared_rows(values)
    order, runs = in_runs(slots[:, 0], slots[:, 1], kind)
    place = np.empty(order.size, np.int64)
    place[order] = np.arange(order.size)
    strength = strength_of(kinds, length.size)
    gaps = runs.bond.size > length.size
    bonds = Bonds(
        first=slots[order, 0].astype(np.int32),
        second=slots[order, 1].astype(np.int32),
        kind=kind[order].astype(np.int32),
        intact=np.ones(length.size, np.int8),
        whole=(runs.bond >= 0).astype(np.int8) if gaps or strength is not None else None,
        wound=np.zeros(1, np.int64),
    )
    kinds = kinds_of(kinds)
    if strength is None:  # section and strength are along the triads
        kinds = kinds._replace(upright=upright_of(kinds))
    return Bonding(bonds, runs, kinds, strength, place)


def strength_row(block: Block, section: Section) -> tuple:
    """Section for stresses and the two strengths; inf where the bond cannot break so."""
    return (
        section.area,
        section.modulus_2,
        section.modulus_3,
        section.modulus_torsion,
        block.get("TENSILE STRENGTH") or math.inf,
        block.get("SHEAR STRENGTH") or math.inf,
    )


def shared_rows(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distinct rows, and which of them each row is.

    Rows that differ by the rounding of their coordinates only, 1.5e-11 at most, count as equal and take the values of
    the first: a pitch of 50 mm written as i * 0.05 has 16 different lengths in its last digits, and as many kinds would
    scatter half of the bonds (69 ns a particle-step instead of 40 on a strip of 400 x 40).
    """
    rounded = np.array(values)
    directions = rounded[:, TRIADS]  # of unit length, with components near zero
    rounded[:, TRIADS] = np.round(directions * EQUAL) / EQUAL
    mantissa, exponent = np.frexp(rounded)
    rounded = np.ldexp(np.round(mantissa * EQUAL) / EQUAL, exponent) + 0.0
    keys = np.ascontiguousarray(rounded).view(np.dtype((np.void, 8 * rounded.shape[1]))).ravel()
    _, place, kind = np.unique(keys, return_index=True, return_inverse=True)
    return np.ascontiguousarray(values[place]), kind


def kinds_of(rows: np.ndarray) -> BondKinds:
    """Columns of `bonds_of` as BondKinds."""
    column = np.ascontiguousarray(rows.T)
    return BondKinds(
        rest_length=column[0].copy(),
        triad_first=column[1:5].copy(),
        triad_second=column[5:9].copy(),
        stiffness=column[9:12].copy(),
        angular_stiffness=column[12:15].copy(),
        damping=column[15:18].copy(),
        angular_damping=column[18:21].copy(),
    )


def upright_of(kinds: BondKinds) -> np.ndarray | None:
    """`BondKinds.upright` (12, k), or None if any triad lies otherwise, by more than rounding."""
    from scipy.spatial.transform import Rotation

    first, second = (
        Rotation.from_quat(triad.T, scalar_first=True).as_matrix()
        for triad in (kinds.triad_first, kinds.triad_second)
    )
    along = np.abs(np.round(first))  # [k, axis of the particle, axis of the bond]
    if np.max(np.abs(first - second)) > ROUNDING or np.max(np.abs(np.abs(first) - along)) > ROUNDING:
        return None

    across = kinds.stiffness * np.array([[0.0], [1.0], [1.0]])
    values = (across, kinds.angular_stiffness, kinds.damping, kinds.angular_damping)
    # Else its layout, and with it the compiled kernels, would depend on how many kinds there are.
    return np.ascontiguousarray(np.concatenate([np.einsum("kab,bk->ak", along, value) for value in values]))


def strength_of(rows: np.ndarray, bonds: int) -> BondStrength | None:
    """Strengths, or None if no bond can break."""
    column = np.ascontiguousarray(rows.T)
    if np.all(np.isinf(column[25:27])):
        return None
    return BondStrength(
        section=column[21:25].copy(),
        strength=column[25:27].copy(),
        broken_step=np.full(bonds, -1, np.int64),
        mode=np.zeros(bonds, np.int8),
    )
