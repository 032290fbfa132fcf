"""The options of `partconvert` and how they become `Settings`."""

from __future__ import annotations

import re

import click

from beltsim.console import Quantity, UsageProblem

from .convert import Settings
from .finding import UNITS


class Unit(click.ParamType):
    """A unit of length by name, or its millimetres."""

    name = "unit"

    def convert(self, value, param, ctx):
        """Millimetres per unit."""
        if isinstance(value, float):
            return value
        if value in UNITS:
            return UNITS[value]
        try:
            number = float(value)
        except ValueError:
            number = 0.0
        if not 1e-9 < number < 1e9:
            self.fail(f"'{value}': expected {', '.join(UNITS)} or millimetres per unit", param, ctx)
        return number


class Colour(click.ParamType):
    """A colour as #rrggbb."""

    name = "#rrggbb"

    def convert(self, value, param, ctx):
        """The colour in lower case."""
        if not re.fullmatch("#[0-9a-fA-F]{6}", value):
            self.fail(f"'{value}' is not a colour such as #3366cc", param, ctx)
        return value.lower()


def _option(flag: str, kind, text: str, *, default=None, name: str | None = None):
    names = (flag, name) if name else (flag,)
    return click.option(*names, type=kind, default=default, show_default=default is not None, help=text)


def _choice(flag: str, values: str, text: str, *, default=None, name=None):
    return _option(
        flag, click.Choice(values.split("|"), case_sensitive=False), text, default=default, name=name
    )


LENGTH = Quantity("length")
WIDEST = 20.0  # m, wider than any pulley

OPTIONS = [
    # what counts as a roller
    _option("--unit", Unit(), "Unit of the drawing: mm, cm, m, in, ft or millimetres. Default: as the file says.",
            name="unit_mm"),
    _choice("--section", "largest|longest", "Which outer cylinder of a body is its drum, e.g. between flanges.",
            default="largest"),
    click.option("--cones", is_flag=True, help="Write conical and barrel-shaped bodies at their largest diameter."),
    click.option("--merge-coaxial", is_flag=True,
                 help="Bodies on one axis that overlap (shaft in tube) become one roller, the widest."),
    _option("--min-diameter", LENGTH, "Leave thinner cylinders out [m, or with a unit: 50mm]."),
    _option("--max-diameter", LENGTH, "Leave thicker cylinders out [m, or with a unit]."),
    _choice("--only", "pulley|idler", "Write this class only."),
    # sizes
    _choice("--length", "drum|face|overall",
            "Written length: drum = straight part with its fillets, chamfers and crowns; face = straight part; "
            "overall = with journals.", default="drum"),
    _option("--edge-radius", Quantity("length", zero=True),
            "Edge radius [m, or with a unit]. Default: that of fillets at both ends, else 0."),
    _option("--tolerance", LENGTH,
            "Sizes that differ by less are identical [m, or with a unit]. Default: 0.01 mm or 1e-5 of the size."),
    # classes
    _option("--diameter-limit", LENGTH, "At or above this diameter: pulley [m, or with a unit: 300mm]."),
    _option("--quantity-limit", click.IntRange(min=0),
            "At or below this count of identical cylinders: pulley; all others are idlers."),
    # output
    _choice("--as", "parts|particles|auto",
            "Write parts (with motion features), particles held in place (with edge radii), or pulleys as parts and "
            "idlers as particles (auto).", default="parts", name="output_as"),
    _choice("--name-by", "class|geometry|cad", "Names: pulley_001, idler_d133x380_001, or the CAD system's.",
            default="class"),
    click.option("--name-prefix", default="", help="Put before every name, so that several files fit one case."),
    _option("--first-id", click.IntRange(min=0), "Id of the first particle.", default=1),
    _choice("--sort", "auto|x|y|z|file",
            "Order: auto = along the belt, without one along the longest side of all; file = as in the file.",
            default="auto"),
    _choice("--colour-by", "class|geometry|none", "One colour for each class or each geometry.", default="class"),
    _option("--pulley-colour", Colour(), "Colour of pulleys.", default=Settings.pulley_colour),
    _option("--idler-colour", Colour(), "Colour of idlers.", default=Settings.idler_colour),
    click.option("--material", default="steel", show_default=True, help="Name of the material."),
    _option("--density", Quantity("density"), "Density of the material [kg/m3].", default="7850 kg/m3"),
    _option("--youngs-modulus", Quantity("pressure"), "Young's modulus of the material [Pa, MPa, GPa].",
            default="210 GPa"),
    click.option("--poisson-ratio", type=click.FloatRange(-1, 0.5, min_open=True, max_open=True), default=0.3,
                 show_default=True, help="Poisson's ratio of the material."),
    # driving
    click.option("--belt", "belts", metavar="FILE", multiple=True,
                 help="INP file of a belt that turns the cylinders it touches (more than once for several belts)."),
    _option("--belt-speed", Quantity("velocity", signed=True),
            "Speed of the belts [m/s, or with unit: 2.5m/s]; negative = against their running direction. "
            "Default: their *INITIAL VELOCITY."),
    _option("--touch-gap", Quantity("length", zero=True),
            "Largest gap at which belt and cylinder touch [m, or with a unit]. Default: half the belt's thickness."),
    _option("--ramp", Quantity("time", zero=True), "Time in which driven cylinders reach their speed [s].",
            default="0 s"),
]  # fmt: skip


def add_options(command):
    """Decorate a click command with all options of the conversion."""
    for option in reversed(OPTIONS):
        command = option(command)
    return command


def refuse_giants(settings: Settings) -> None:
    """Raise `UsageProblem` for limits that no cylinder of a conveyor can reach: millimetres without their unit."""
    for flag in ("diameter_limit", "min_diameter", "max_diameter"):
        value = getattr(settings, flag)
        if value is not None and value > WIDEST:
            option = f"--{flag.replace('_', '-')}"
            raise UsageProblem(
                f"{option}: found {value:g} m, expected at most {WIDEST:g} m: a number without a unit is in metres; "
                f"for millimetres write {option} {value:g}mm"
            )


def settings_from(options: dict, belts: tuple[str, ...]) -> Settings:
    """The settings that the options ask for; `UsageProblem` where they contradict."""
    output, only = options.pop("output_as"), options.pop("only")
    needs_belt = (options["belt_speed"], options["touch_gap"], options["ramp"] or None)
    if not belts and any(value is not None for value in needs_belt):
        raise UsageProblem("--belt-speed, --touch-gap and --ramp need --belt: nothing is driven without one")
    settings = Settings(output=output, only=only.upper() if only else None, **options)
    refuse_giants(settings)
    low, high = settings.min_diameter, settings.max_diameter
    if low is not None and high is not None and low > high:
        raise UsageProblem(f"--min-diameter {low:g} m is above --max-diameter {high:g} m")
    for flag, text in (("--name-prefix", settings.name_prefix), ("--material", settings.material)):
        if re.search(r"""[\s,"*?=]""", text) or (flag == "--material" and not text):
            raise UsageProblem(f"{flag}: '{text}' holds blanks or signs that a name may not have")
    return settings
