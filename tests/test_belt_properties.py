"""A data sheet's figures become section, moduli and factors; units are exact; contradictions are refused."""

import pytest

from beltconverter.properties import Sheet, changed, longitudinal, mass_per_area, transverse
from beltconverter.units import parsed, scale_of
from beltconverter.zones import parse_zone
from beltsim.console import UsageProblem


def test_a_plain_sheet_is_an_ep_500_belt():
    sheet = Sheet()
    assert longitudinal(sheet).youngs_modulus * sheet.thickness == pytest.approx(4e6)  # 4000 N/mm
    assert transverse(sheet).youngs_modulus == pytest.approx(0.3 * longitudinal(sheet).youngs_modulus)
    assert longitudinal(sheet).reduction_factor == transverse(sheet).reduction_factor == 0.1
    assert mass_per_area(sheet) == 11.0
    assert longitudinal(sheet).tensile_strength is None


def test_tensile_stiffness_thickness_and_bending_stiffness_give_modulus_and_factor():
    sheet = Sheet(thickness=0.008, tensile_stiffness=5e6, bending_stiffness=3.0)
    along = longitudinal(sheet)
    assert along.youngs_modulus * 0.008 == pytest.approx(5e6)
    assert along.reduction_factor * along.youngs_modulus * 0.008**3 / 12 == pytest.approx(3.0)


def test_what_is_not_said_across_follows_from_what_is_said_along():
    sheet = Sheet(youngs_modulus=1e9, reduction_factor=0.02, tensile_strength=5e5)
    across = transverse(sheet)
    assert across.youngs_modulus == pytest.approx(3e8)
    assert across.reduction_factor == 0.02
    assert across.tensile_strength == pytest.approx(5e5 / sheet.thickness)
    assert transverse(
        Sheet(tensile_strength=5e5, tensile_strength_transverse=1e5)
    ).tensile_strength == pytest.approx(1e7)


def test_density_and_thickness_give_the_mass():
    assert mass_per_area(Sheet(thickness=0.012, density=1200.0)) == pytest.approx(14.4)


def test_a_zone_replaces_what_says_the_same_in_another_way():
    sheet = changed(Sheet(youngs_modulus=1e9, reduction_factor=0.2), {"tensile_stiffness": 8e6})
    assert longitudinal(sheet).youngs_modulus == pytest.approx(8e8)
    assert longitudinal(sheet).reduction_factor == 0.2


def test_contradictions_are_refused():
    with pytest.raises(UsageProblem, match="twice"):
        Sheet(density=1000.0, mass_per_area=10.0)
    with pytest.raises(UsageProblem, match="homogeneous"):
        longitudinal(Sheet(bending_stiffness=100.0))


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("66.5mm", "length", 0.0665),
        ("66.5 mm", "length", 0.0665),
        ("2.5", "length", 2.5),
        ("1e-2m", "length", 0.01),
        ("4000", "tensile stiffness", 4e6),
        ("4000 N/mm", "tensile stiffness", 4e6),
        ("4000kN/m", "tensile stiffness", 4e6),
        ("101%", "ratio", 1.01),
        ("1.01", "ratio", 1.01),
        ("3.8Nm", "bending stiffness", 3.8),
        ("400MPa", "pressure", 4e8),
        ("2.5 m/s", "velocity", 2.5),
    ],
)
def test_quantities_are_read_to_the_nearest_number(text, dimension, value):
    assert parsed(text, dimension) == value


@pytest.mark.parametrize(
    "text", ["", "mm", "1,5mm", "1.5 mile", "0", "-1", "nan", "inf", "1e999", "1_0", "0x10"]
)
def test_what_is_no_quantity_is_refused(text):
    with pytest.raises(ValueError, match="'"):
        parsed(text, "length")


@pytest.mark.parametrize(("edge", "unit"), [(50.0, "mm"), (1.5, "mm"), (0.05, "m"), (0.4, "m")])
def test_the_unit_is_inferred_from_the_size_of_the_cells_with_a_warning(edge, unit):
    warnings = []
    assert scale_of("auto", edge, warnings)[0] == unit
    assert f"took {unit}" in warnings[0]


def test_zones_name_columns_and_rows_from_either_end():
    zone = parse_zone("splice: rows=1-3,-2--1 columns=4 mass-per-area=14kg/m2 reduction-factor=30%")
    assert zone.rows == ((1, 3), (-2, -1))
    assert zone.columns == ((4, 4),)
    assert zone.changes == {"mass_per_area": 14.0, "reduction_factor": 0.3}
