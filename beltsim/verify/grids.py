"""Lattices of bonds in their plane: shear of a square lattice, fibres stiffer than what joins them."""

from __future__ import annotations

import numpy as np

from beltsim.scene.bonding import Bonding
from beltsim.solver.bonds import bond_measures
from beltsim.verify.case import Case, Findings, Row
from beltsim.verify.stepping import position_of, put_load, run_for, settle, start
from beltsim.verify.strips import Strip, add_belt_types, add_bond_type, add_bonds, case_deck, straight

PITCH = 0.025
CELL = Strip(bonds=1, length=PITCH, width=PITCH, thickness=0.01, torsion="GRID", damping=0.5)


def nodes(columns: int, rows: int) -> np.ndarray:
    """Places (columns * rows, 3) of a grid, row after row along x."""
    y, x = np.divmod(np.arange(columns * rows), columns)
    return PITCH * np.column_stack([x, y, 0 * x])


def links(columns: int, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of ids of the bonds along x and along y."""
    ids = 1 + np.arange(columns * rows).reshape(rows, columns)
    along = np.column_stack([ids[:, :-1].ravel(), ids[:, 1:].ravel()])
    return along, np.column_stack([ids[:-1].ravel(), ids[1:].ravel()])


def lattice_shear() -> Findings:
    """A lattice of 12 x 12 whose rim follows a shear of 1e-4: the shear modulus inside, twice by theory."""
    n, angle = 12, 1e-4
    rows = []
    for shear in ("TIMOSHENKO", "SPRING"):
        strip = Strip(**{**vars(CELL), "shear": shear})
        deck = case_deck()
        add_belt_types(deck, strip)
        flat = nodes(n, n)
        place = flat + angle * flat[:, [1]] * np.array([1.0, 0.0, 0.0])
        deck.add(
            "PARTICLE",
            type="belt",
            rows={"id": 1 + np.arange(n * n), "position": place, "orientation": straight(n * n)},
        )
        along, across = links(n, n)
        add_bonds(deck, along, (PITCH, 0.0, 0.0))
        add_bonds(deck, across, (0.0, PITCH, 0.0))
        inside = np.zeros((n, n), bool)
        inside[1:-1, 1:-1] = True
        state = start(deck, pinned=np.flatnonzero(~inside.ravel()))
        run_for(state, 0.05)
        middle = len(along) + n * (n // 2 - 1) + n // 2  # a bond along y in the middle
        stiffness = shear_force(state, middle) / (PITCH * angle)
        in_plane = state.scene.kinds.stiffness[1]
        rows.append(
            Row(f"G t of the lattice, SHEAR={shear}", "N/m", 0.5 * float(in_plane[0]), stiffness, 0.03)
        )
    return Findings(rows)


def shear_force(state, bond: int) -> float:
    """Shear force [N] of a bond of the deck."""
    scene = state.scene
    bonding: Bonding = scene.bonding
    return float(
        bond_measures(scene.population.particles, scene.bonds, scene.kinds)[0][1, bonding.place[bond]]
    )


def fibres() -> Findings:
    """A belt of fibres five times as stiff as what joins them, by bond rules, pulled along and across."""
    n, force = 6, 20.0
    extension = {}
    for direction in (0, 1):
        deck = case_deck()
        add_belt_types(deck, CELL)
        stiff = Strip(**{**vars(CELL), "young": 5.0 * CELL.young})
        add_bond_type(deck, stiff, "fibre")
        deck.add("BOND RULE", particle_type_a="fibre_*", particle_type_b="SAME", bond_type="fibre")
        place = nodes(n, n)
        add_fibres(deck, place, n)
        along, across = links(n, n)
        add_bonds(deck, along, (PITCH, 0.0, 0.0))
        add_bonds(deck, across, (0.0, PITCH, 0.0))
        held = np.flatnonzero(place[:, direction] == 0.0)
        pulled = np.flatnonzero(place[:, direction] == place[:, direction].max())
        state = start(deck, clamped=held)
        put_load(state, pulled, force=np.eye(3)[direction] * force)
        settle(state, 300.0, 12)
        moved = (position_of(state) - place)[pulled, direction]
        extension[direction] = moved.mean()
    target = force * (n - 1) * PITCH / CELL.axial
    return Findings(
        [
            Row("elongation across over along", "-", 5.0, extension[1] / extension[0], 1e-6),
            Row("elongation across", "m", target, extension[1], 1e-6),
        ]
    )


def add_fibres(deck, place: np.ndarray, columns: int) -> None:
    """Particles row by row, a type of its own for each row, as a belt's fibres."""
    pattern = deck.blocks("PARTICLE TYPE")[0].parameters
    for row in range(len(place) // columns):
        given = {name.lower().replace(" ", "_"): value for name, value in pattern.items()}
        deck.add("PARTICLE TYPE", **{**given, "name": f"fibre_{row:03d}"})
        part = slice(row * columns, (row + 1) * columns)
        rows = {
            "id": 1 + np.arange(len(place))[part],
            "position": place[part],
            "orientation": straight(columns),
        }
        deck.add("PARTICLE", type=f"fibre_{row:03d}", rows=rows)


CASES = {
    "J1": Case("Fibred belt", "u_y/u_x = E_x/E_y at equal stress", fibres),
    "J2": Case("In-plane shear of a square lattice", "G t = k_sx k_sy/(k_sx + k_sy)", lattice_shear),
}
