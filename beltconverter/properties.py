"""A belt's data sheet, and the bond section and moduli that reproduce it on any grid.

Defaults are those of a textile belt EP 500/3 with 4 + 2 mm covers: 10 mm thick, 11 kg/m2, 4000 N/mm along.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from beltsim.console import UsageProblem


@dataclass(frozen=True)
class Sheet:
    """What the maker states of a belt, per metre of width where it is a stiffness, SI.

    thickness m; mass_per_area kg/m2; tensile_stiffness N/m; bending_stiffness N m (None: from the reduction
    factor); reduction_factor 1, of the bending stiffness that a homogeneous section would have; strength N/m;
    shear_strength Pa; the same with `_transverse` across (None: default share of the longitudinal value).
    """

    thickness: float = 0.010
    mass_per_area: float | None = None
    density: float | None = None
    tensile_stiffness: float | None = None
    tensile_stiffness_transverse: float | None = None
    youngs_modulus: float | None = None
    youngs_modulus_transverse: float | None = None
    bending_stiffness: float | None = None
    bending_stiffness_transverse: float | None = None
    reduction_factor: float | None = None
    reduction_factor_transverse: float | None = None
    in_plane_reduction_factor: float | None = None
    poisson_ratio: float = 0.3
    damping_factor: float = 0.05
    tensile_strength: float | None = None
    tensile_strength_transverse: float | None = None
    shear_strength: float | None = None
    bond_radius: float | None = None

    def __post_init__(self):
        for one, other in EXCLUSIVE:
            if getattr(self, one) is not None and getattr(self, other) is not None:
                raise UsageProblem(
                    f"{option(one)} and {option(other)} say the same thing twice: give one of them"
                )


DIMENSIONS = {
    "thickness": "length",
    "mass_per_area": "mass per area",
    "density": "density",
    "tensile_stiffness": "tensile stiffness",
    "tensile_stiffness_transverse": "tensile stiffness",
    "youngs_modulus": "pressure",
    "youngs_modulus_transverse": "pressure",
    "bending_stiffness": "bending stiffness",
    "bending_stiffness_transverse": "bending stiffness",
    "reduction_factor": "ratio",
    "reduction_factor_transverse": "ratio",
    "in_plane_reduction_factor": "ratio",
    "poisson_ratio": "ratio",
    "damping_factor": "ratio",
    "tensile_strength": "tensile stiffness",
    "tensile_strength_transverse": "tensile stiffness",
    "shear_strength": "pressure",
    "bond_radius": "length",
}
EXCLUSIVE = (
    ("mass_per_area", "density"),
    ("tensile_stiffness", "youngs_modulus"),
    ("tensile_stiffness_transverse", "youngs_modulus_transverse"),
    ("bending_stiffness", "reduction_factor"),
    ("bending_stiffness_transverse", "reduction_factor_transverse"),
)
MASS_PER_AREA = 11.0  # kg/m2
YOUNGS_MODULUS = 4e8  # Pa: 4000 N/mm at 10 mm
TRANSVERSE_SHARE = 0.3  # of the longitudinal modulus; wefts of EP belts have 0.2 to 0.5
REDUCTION_FACTOR = 0.1  # three bonded plies give 0.12, steel cords less


class Direction(NamedTuple):
    """Bonds of one direction: Young's modulus Pa, reduction factor 1, tensile strength Pa or None."""

    youngs_modulus: float
    reduction_factor: float
    tensile_strength: float | None


def option(field: str) -> str:
    """The command-line spelling of a field."""
    return "--" + field.replace("_", "-")


def changed(sheet: Sheet, changes: dict[str, float]) -> Sheet:
    """The sheet with other values; what one of them says in another way no longer counts."""
    replaced = {}
    for one, other in EXCLUSIVE:
        replaced |= ({other: None} if one in changes else {}) | ({one: None} if other in changes else {})
    return replace(
        sheet, **{name: value for name, value in replaced.items() if name not in changes}, **changes
    )


def mass_per_area(sheet: Sheet) -> float:
    """Mass of the belt per area, kg/m2."""
    if sheet.density is not None:
        return sheet.density * sheet.thickness
    return MASS_PER_AREA if sheet.mass_per_area is None else sheet.mass_per_area


def longitudinal(sheet: Sheet) -> Direction:
    """Bonds along the belt: E t is the tensile stiffness per width, f E t^3 / 12 the bending stiffness."""
    return _direction(sheet, "", YOUNGS_MODULUS, REDUCTION_FACTOR, sheet.tensile_strength)


def transverse(sheet: Sheet) -> Direction:
    """Bonds across the belt; what is not stated is 0.3 of the modulus and the same factor as along."""
    along = longitudinal(sheet)
    modulus = TRANSVERSE_SHARE * along.youngs_modulus
    factor = REDUCTION_FACTOR if sheet.reduction_factor is None else sheet.reduction_factor
    strength = sheet.tensile_strength_transverse or sheet.tensile_strength
    return _direction(sheet, "_transverse", modulus, factor, strength)


def _direction(sheet: Sheet, suffix: str, modulus: float, factor: float, strength: float | None) -> Direction:
    stiffness = getattr(sheet, f"tensile_stiffness{suffix}")
    stated_modulus = getattr(sheet, f"youngs_modulus{suffix}")
    if stiffness is not None:
        modulus = stiffness / sheet.thickness
    elif stated_modulus is not None:
        modulus = stated_modulus
    bending = getattr(sheet, f"bending_stiffness{suffix}")
    stated_factor = getattr(sheet, f"reduction_factor{suffix}")
    if bending is not None:
        factor = _factor_of(bending, modulus, sheet.thickness, suffix)
    elif stated_factor is not None:
        factor = stated_factor
    return Direction(modulus, factor, None if strength is None else strength / sheet.thickness)


def _factor_of(bending: float, modulus: float, thickness: float, suffix: str) -> float:
    homogeneous = modulus * thickness**3 / 12
    if bending > homogeneous:
        raise UsageProblem(
            f"{option('bending_stiffness' + suffix)} {bending:.4g} N m is more than the {homogeneous:.4g} N m of a "
            f"homogeneous belt of this thickness and tensile stiffness: check the units"
        )
    return bending / homogeneous
