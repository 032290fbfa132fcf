"""The options of `beltconvert`, each with its unit and default."""

from __future__ import annotations

import click

from .units import Quantity


def _vector(_context, parameter, text: str | None):
    if text is None:
        return None
    try:
        numbers = tuple(float(word) for word in text.replace(",", " ").split())
    except ValueError:
        numbers = ()
    if len(numbers) != 3 or not any(numbers) or not all(abs(number) < 1e300 for number in numbers):
        raise click.BadParameter(f"'{text}' is not a direction such as 0,0,1", param=parameter)
    return numbers


def _elongation(_context, parameter, value: float) -> float:
    if not 0.5 < value < 2:
        raise click.BadParameter(
            f"{value:.4g} is no length relative to the stress-free one: 101% means meshed 1 % longer",
            param=parameter,
        )
    return value


def _choice(flag: str, values: str, default: str | None, text: str):
    return click.option(
        flag, type=click.Choice(values.split("|")), default=default, show_default=bool(default), help=text
    )


def _quantity(
    flag: str, dimension: str, text: str, *, zero: bool = False, default=None, name: str | None = None, **more
):
    names = (flag, name) if name else (flag,)
    return click.option(
        *names,
        type=Quantity(dimension, zero=zero),
        default=default,
        show_default=default is not None,
        help=text,
        **more,
    )


OPTIONS = [
    # the mesh
    _choice("--unit", "m|mm|cm|in|ft|auto", "auto", "Unit of the mesh; auto infers m or mm and warns."),
    click.option(
        "--open/--endless",
        "is_open",
        default=None,
        help="State which the belt is; refused if the mesh disagrees. Default: as the mesh is.",
    ),
    _choice(
        "--cells",
        "auto|square|skew",
        "auto",
        "Where uniform diagonals allow two grids: auto = by facet order, else the squarer.",
    ),
    _quantity(
        "--weld",
        "ratio",
        "Largest gap of border nodes to close, in units of the mesh; 0 = exact nodes only. "
        "Default: stepwise up to a quarter cell, only where exact nodes give no belt.",
        zero=True,
    ),
    _quantity(
        "--cell",
        "length",
        "MESH is a solid endless belt: make its mid-surface with cells of about this side, m. Default: a mid-surface.",
    ),
    # how it lies
    click.option(
        "--up",
        metavar="X,Y,Z",
        default="0,0,1",
        show_default=True,
        callback=_vector,
        help="Direction of up; an open belt carries on that side, an endless one outside.",
    ),
    click.option(
        "--direction",
        metavar="X,Y,Z",
        callback=_vector,
        help="Running direction where the belt is highest. Default: along the longest horizontal axis, positive.",
    ),
    _choice(
        "--longitudinal",
        "long|short",
        None,
        "Which sides of an open belt run along it. Default: by --direction, else the long ones.",
    ),
    click.option("--flip", is_flag=True, help="The other side carries."),
    click.option("--reverse", is_flag=True, help="Run the other way."),
    click.option(
        "--flip-belt",
        type=click.IntRange(min=1),
        multiple=True,
        metavar="N",
        help="The other side of belt N of several in the file carries; may be repeated. Default: none.",
    ),
    click.option(
        "--reverse-belt",
        type=click.IntRange(min=1),
        multiple=True,
        metavar="N",
        help="Belt N of several runs the other way, as the cover belt of a sandwich; may be repeated. Default: none.",
    ),
    # stress-free state and motion
    click.option(
        "--elongation",
        "elongation_along",
        type=Quantity("ratio"),
        default="100%",
        show_default=True,
        callback=_elongation,
        help="Meshed length over stress-free length; 101% = pre-stretched by 1 %.",
    ),
    click.option(
        "--elongation-transverse",
        "elongation_across",
        type=Quantity("ratio"),
        default="100%",
        show_default=True,
        callback=_elongation,
        help="The same across the belt.",
    ),
    _choice(
        "--stress-free",
        "auto|belt|row|bond",
        "auto",
        "One stress-free length (arc of the middle fibre) for the belt, one per row of cells, or each bond's own. "
        "auto: belt if the rows differ by less than 5 %, else row.",
    ),
    _quantity(
        "--belt-speed",
        "velocity",
        "Initial speed, m/s, with the angular velocity of the belt's curvature. Default: none.",
        zero=True,
    ),
    # names
    _choice(
        "--fibres",
        "none|alternating|rows",
        "none",
        "Particle names: one for all, two in turn, or one for each longitudinal row, with bond rules.",
    ),
    click.option(
        "--fibre-name", default="fibre", show_default=True, help="Prefix of the fibres' particle names."
    ),
    click.option("--name", default="belt", show_default=True, help="Name of the belt."),
    click.option(
        "--name-prefix",
        default="",
        help="Put before the names of particles, bonds and groups. Default: none.",
    ),
    click.option(
        "--first-id",
        type=click.IntRange(min=0),
        default=1,
        show_default=True,
        help="Id of the first particle.",
    ),
    click.option(
        "--touching-edges",
        metavar="COLUMNS",
        type=click.IntRange(min=0),
        default=0,
        show_default=True,
        help="Columns at each edge whose particles touch those of the other edge (pipe belts).",
    ),
    # particles
    _choice("--shape", "box|sphere", "box", "Rounded boxes or spheres."),
    _quantity(
        "--edge-radius", "length", "Radius of the boxes' edges, m. Default: 0.4 of the thickness.", zero=True
    ),
    _quantity(
        "--overlap",
        "length",
        "Particle size over pitch, m. Default: twice the edge radius, so that flats meet (spheres: 0).",
        zero=True,
    ),
    _quantity("--sphere-radius", "length", "Radius of spheres, m. Default: half the larger pitch."),
    _choice(
        "--edge",
        "full|half",
        "full",
        "Outer nodes lie half a cell inside the belt's edge (full) or on it (half: half mass and section).",
    ),
    click.option("--material", default="rubber", show_default=True, help="Name of the belt's material."),
    _quantity(
        "--contact-modulus", "pressure", "Young's modulus of the cover in contacts, Pa.", default="5 MPa"
    ),
    click.option(
        "--friction",
        type=click.FloatRange(0, 10),
        default=0.5,
        show_default=True,
        help="Friction coefficient of belt on belt; written where belts can touch (pipes, several belts).",
    ),
    click.option(
        "--restitution",
        type=click.FloatRange(0, 1, min_open=True),
        default=0.3,
        show_default=True,
        help="Coefficient of restitution of belt on belt, likewise.",
    ),
    # data sheet
    _quantity(
        "--thickness", "length", "Thickness of the belt, m. Default: 10 mm, or that of the solid with --cell."
    ),
    _quantity("--mass-per-area", "mass per area", "Mass of the belt, kg/m2. Default: 11."),
    _quantity(
        "--density", "density", "Instead of the mass per area, kg/m3. Default: 11 kg/m2 over the thickness."
    ),
    _quantity(
        "--tensile-stiffness",
        "tensile stiffness",
        "Tensile stiffness along per width, N/mm. Default: 400 MPa x thickness.",
    ),
    _quantity("--youngs-modulus", "pressure", "Instead of the tensile stiffness, Pa. Default: 400 MPa."),
    _quantity(
        "--bending-stiffness",
        "bending stiffness",
        "Bending stiffness along per width, N m. Default: by the reduction factor.",
    ),
    _quantity(
        "--reduction-factor",
        "ratio",
        "Instead: share of the bending stiffness of a homogeneous belt. Default: 0.1.",
        zero=True,
    ),
    _quantity(
        "--tensile-stiffness-transverse", "tensile stiffness", "Across, N/mm. Default: 0.3 of that along."
    ),
    _quantity("--youngs-modulus-transverse", "pressure", "Instead, Pa. Default: 0.3 of that along."),
    _quantity(
        "--bending-stiffness-transverse",
        "bending stiffness",
        "Across, N m. Default: by the reduction factor across.",
    ),
    _quantity(
        "--reduction-factor-transverse",
        "ratio",
        "Instead, across. Default: 0.1 or --reduction-factor.",
        zero=True,
    ),
    _quantity(
        "--in-plane-reduction-factor",
        "ratio",
        "Share of the in-plane bending stiffness of the bonds. Default: 1.",
        zero=True,
    ),
    click.option(
        "--zone",
        "zone_texts",
        multiple=True,
        metavar="TEXT",
        help="Part of the belt with other properties, as 'cord: columns=1-3,8 tensile-stiffness=8000N/mm'; rows=... "
        "chooses rows, negative numbers count from the end; may be repeated, later ones win. Default: none.",
    ),
    click.option(
        "--zones",
        "zone_file",
        metavar="CSV",
        help="The same from a table with the columns name, columns, rows and properties. Default: none.",
    ),
    click.option(
        "--poisson-ratio",
        type=click.FloatRange(-1, 0.5, min_open=True),
        default=0.3,
        show_default=True,
        help="Poisson's ratio of the bonds.",
    ),
    _quantity(
        "--damping-factor", "ratio", "Share of critical damping of the bonds.", zero=True, default="0.05"
    ),
    _quantity(
        "--tensile-strength",
        "tensile stiffness",
        "Breaking load along per width, N/mm. Default: unbreakable.",
    ),
    _quantity("--tensile-strength-transverse", "tensile stiffness", "Across, N/mm. Default: that along."),
    _quantity("--shear-strength", "pressure", "Shear stress at which bonds break, Pa. Default: unbreakable."),
    _quantity("--bond-radius", "length", "Round bonds of this radius, m. Default: the belt's section."),
]


def add_options(command):
    """Decorate a click command with all options, in the order in which they are listed."""
    for one in reversed(OPTIONS):
        command = one(command)
    return command
