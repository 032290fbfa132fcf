"""Strips, loops and grids of belt as decks, from their section and division."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from beltsim import inp
from beltsim.inp import Deck


@dataclass(frozen=True)
class Strip:
    """Section, material and division of a belt strip; the defaults are the book's reference strip.

    E A = 50 kN, E I = 0.41667 N m2 and 1.2 kg/m.
    """

    bonds: int = 20
    length: float = 1.0  # m, stress-free
    width: float = 0.1  # m
    thickness: float = 0.01  # m
    young: float = 50e6  # Pa
    poisson: float = 0.3
    density: float = 1200.0  # kg/m3
    reduction: float = 1.0
    damping: float = 0.0  # share of critical damping of each bonded pair
    shear: str = "TIMOSHENKO"
    torsion: str = "SECTION"
    radius: float | None = None  # m, of a round section
    tensile_strength: float | None = None  # Pa
    shear_strength: float | None = None

    @property
    def pitch(self) -> float:
        """Stress-free distance of neighbours [m]."""
        return self.length / self.bonds

    @property
    def area(self) -> float:
        """Cross-section [m2]."""
        return self.width * self.thickness if self.radius is None else np.pi * self.radius**2

    @property
    def axial(self) -> float:
        """E A [N]."""
        return self.young * self.area

    @property
    def bending(self) -> float:
        """E I of the unreduced section out of the plane [N m2]."""
        if self.radius is not None:
            return self.young * np.pi * self.radius**4 / 4.0
        return self.young * self.width * self.thickness**3 / 12.0

    @property
    def shear_modulus(self) -> float:
        """G [Pa]."""
        return self.young / (2.0 * (1.0 + self.poisson))

    @property
    def line_mass(self) -> float:
        """Mass per length [kg/m]."""
        return self.density * self.area


def case_deck(
    *, time_step: float | str = "AUTO", safety: float = 0.8, gravity=None, integrator: str = "VERLET"
) -> Deck:
    """A deck with its format, one step and gravity."""
    deck = Deck()
    deck.add("FORMAT", name="BELTSIM", version=1)
    deck.add("STEP", duration=1.0, time_step=time_step, safety=safety, integrator=integrator)
    if gravity is not None:
        deck.add("GRAVITY", rows={"acceleration": [gravity]})
    return deck


def add_strip(
    deck: Deck, strip: Strip, position, *, orientation=None, closed: bool = False, rest: float | None = None
) -> None:
    """Add a chain of particles at the given places.

    Parameters
    ----------
    position, orientation : (n, 3) m and (n, 4); the bonds' stress-free state is straight whatever they are
    closed : bond the last particle to the first; else the end particles have half the mass
    rest : stress-free length of the bonds [m], the strip's pitch without it
    """
    position = np.asarray(position, dtype=float)
    count = len(position)
    orientation = straight(count) if orientation is None else np.asarray(orientation, dtype=float)
    ids = np.arange(1, count + 1)
    add_belt_types(deck, strip)
    # In the order along the strip, so that slots are indices along it.
    stretches = [("belt", slice(None))]
    if not closed:
        stretches = [("end", slice(0, 1)), ("belt", slice(1, -1)), ("end", slice(count - 1, count))]
    for name, part in stretches:
        rows = {"id": ids[part], "position": position[part], "orientation": orientation[part]}
        deck.add("PARTICLE", type=name, rows=rows)
    pairs = np.stack([ids, np.roll(ids, -1)], axis=1)
    add_bonds(deck, pairs if closed else pairs[:-1], (strip.pitch if rest is None else rest, 0.0, 0.0))


def add_belt_types(deck: Deck, strip: Strip) -> None:
    """Material, contact group, particle types (whole and half cells) and the bond type of a strip."""
    size = strip.pitch, strip.width, strip.thickness
    deck.add(
        "MATERIAL",
        name="rubber",
        density=strip.density,
        youngs_modulus=strip.young,
        poisson_ratio=strip.poisson,
    )
    deck.add("CONTACT GROUP", name="belt", belt="belt")
    if strip.radius is None:
        shares = size[1] ** 2 + size[2] ** 2, size[0] ** 2 + size[2] ** 2, size[0] ** 2 + size[1] ** 2
        shares = tuple(share / 12.0 for share in shares)
    else:
        across = strip.radius**2 / 4.0 + strip.pitch**2 / 12.0
        shares = strip.radius**2 / 2.0, across, across
    for name, part in (("belt", 1.0), ("end", 0.5)):
        mass = part * strip.line_mass * strip.pitch
        inertia = {f"inertia_{axis}": mass * share for axis, share in zip("xyz", shares)}
        sizes = {f"size_{axis}": side for axis, side in zip("xyz", size)}
        deck.add(
            "PARTICLE TYPE",
            name=name,
            shape="ROUNDED BOX",
            material="rubber",
            contact_group="belt",
            mass=mass,
            **sizes,
            **inertia,
        )
    add_bond_type(deck, strip, "bond")


def add_bond_type(deck: Deck, strip: Strip, name: str) -> None:
    """The bond type of a strip."""
    section = {"radius": strip.radius}
    if strip.radius is None:
        section = {"section_width": strip.width, "section_thickness": strip.thickness}
    deck.add(
        "BOND TYPE",
        name=name,
        **section,
        youngs_modulus=strip.young,
        poisson_ratio=strip.poisson,
        reduction_factor=strip.reduction,
        damping_factor=strip.damping,
        torsion=strip.torsion,
        shear=strip.shear,
        tensile_strength=strip.tensile_strength,
        shear_strength=strip.shear_strength,
    )


def add_bonds(deck: Deck, pairs: np.ndarray, rest, bond_type: str = "bond") -> None:
    """Bonds between pairs (m, 2) of ids, stress-free with parallel frames at the distance `rest` (3,)."""
    count = len(pairs)
    rows = {
        "particles": pairs,
        "position_1": np.zeros((count, 3)),
        "orientation_1": straight(count),
        "position_2": np.tile(rest, (count, 1)),
        "orientation_2": straight(count),
    }
    deck.add("BOND", type=bond_type, rows=rows)


def straight(count: int) -> np.ndarray:
    """Unturned orientations (n, 4)."""
    return np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))


def line(count: int, pitch: float) -> np.ndarray:
    """Places (count, 3) [m] along x."""
    return np.arange(count)[:, None] * np.array([pitch, 0.0, 0.0])


def strip_deck(strip: Strip, *, stretch: float = 1.0, **case) -> Deck:
    """A straight strip along x from the origin, stretched by a factor against its stress-free state.

    `case` goes to `case_deck`.
    """
    deck = case_deck(**case)
    add_strip(deck, strip, line(strip.bonds + 1, strip.pitch * stretch))
    return deck


def checked(deck: Deck) -> Deck:
    """The deck, if the format accepts it as a case."""
    inp.check_case(deck)
    return deck
