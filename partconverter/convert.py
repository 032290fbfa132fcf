"""The conversion from end to end: SAT text -> rollers, chosen, classed, driven and named -> Deck."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, fields
from hashlib import sha256
from pathlib import Path

from beltsim import inp
from beltsim.console import CommandError, ExitCode

from . import rollers as roll
from .belts import Belt, belt_of, joined
from .coaxial import coaxial_pairs, merge_coaxial
from .driving import driven
from .finding import Found, find_rollers
from .parts import COLOURS, Material, deck_of, is_part
from .rollers import Roller
from .solids import REASONS


class NothingToConvert(CommandError):
    """The text is sound, but no roller is in it or left of it (exit code 4); `found` says what is."""

    exit_code = ExitCode.NOT_CONVERTIBLE

    def __init__(self, text: str, found: Found):
        super().__init__(text)
        self.found = found


@dataclass(frozen=True)
class Settings:
    """What a person can choose; lengths in m, the rest SI."""

    unit_mm: float | None = None
    section: str = "largest"
    cones: bool = False
    merge_coaxial: bool = False
    length: str = "drum"
    edge_radius: float | None = None
    tolerance: float | None = None
    diameter_limit: float | None = None
    quantity_limit: int | None = None
    min_diameter: float | None = None
    max_diameter: float | None = None
    only: str | None = None
    output: str = "parts"
    sort: str = "auto"
    name_by: str = "class"
    name_prefix: str = ""
    first_id: int = 1
    material: str = "steel"
    density: float = Material.density
    youngs_modulus: float = Material.youngs_modulus
    poisson_ratio: float = Material.poisson_ratio
    colour_by: str = "class"
    pulley_colour: str = COLOURS["PULLEY"]
    idler_colour: str = COLOURS["IDLER"]
    belt_speed: float | None = None
    touch_gap: float | None = None
    ramp: float = 0.0


@dataclass
class Conversion:
    """The deck, the rollers in it, and what was left out on the way."""

    deck: inp.Deck
    rollers: list[Roller]
    found: Found
    warnings: list[str]
    filtered: int


def convert(data: bytes, name: str, settings: Settings, belts: tuple[str, ...] = ()) -> Conversion:
    """Convert a SAT text; `name` stands in messages and in the result, `belts` are INP files that drive rollers.

    Raises `sat.SatError` for text that is no SAT or damaged, `NothingToConvert` if no roller is left.
    """
    found = find_rollers(data, name, unit_mm=settings.unit_mm, section=settings.section, cones=settings.cones)
    warnings = list(found.warnings)
    rollers = _chosen(found.rollers, settings, warnings)
    if not rollers:
        raise NothingToConvert("\n".join(_nothing(name, found)), found)
    if belts:
        rollers, more = driven(rollers, _belts(belts, settings.belt_speed), touch_gap=settings.touch_gap)
        warnings += more
    rollers = roll.ordered(rollers, settings.sort)
    rollers = roll.named(rollers, by=settings.name_by, prefix=settings.name_prefix)
    deck = deck_of(
        rollers,
        output=settings.output,
        material=Material(
            settings.material, settings.density, settings.youngs_modulus, settings.poisson_ratio
        ),
        colour_by=settings.colour_by,
        colours={"PULLEY": settings.pulley_colour, "IDLER": settings.idler_colour},
        prefix=settings.name_prefix,
        first_id=settings.first_id,
        ramp=settings.ramp,
        settings=_settings_lines(data, name, found, settings, belts),
        result=_result_lines(found, rollers, settings),
    )
    return Conversion(deck, rollers, found, warnings, len(found.rollers) - len(rollers))


def _belts(paths: tuple[str, ...], speed: float | None) -> Belt:
    """All belts of INP files, at one speed [m/s] or each at its own."""
    return joined([belt_of(inp.read(path), path, speed) for path in paths])


def _chosen(rollers: list[Roller], settings: Settings, warnings: list[str]) -> list[Roller]:
    """Merged, sized, compared, classed and filtered."""
    if settings.merge_coaxial:
        rollers = merge_coaxial(rollers)
    elif pairs := coaxial_pairs(rollers):
        inner = len({i for pair in pairs for i in pair})
        warnings.append(
            f"{inner} cylinders share an axis with another one and overlap it, as a shaft and its tube: "
            "--merge-coaxial counts each such set once"
        )
    rollers = roll.sized(rollers, length=settings.length, edge_radius=settings.edge_radius)
    rollers = roll.identified(rollers, settings.tolerance)
    limits = {"diameter_limit": settings.diameter_limit, "quantity_limit": settings.quantity_limit}
    rollers = roll.classified(rollers, **limits)
    low, high = settings.min_diameter or 0.0, settings.max_diameter or float("inf")
    # A diameter of just the limit must not fall beyond it by a rounding error of the file.
    low, high = low * (1 - 1e-9), high * (1 + 1e-9)
    return [r for r in rollers if low <= r.diameter <= high and settings.only in (None, r.kind)]


def _nothing(name: str, found: Found) -> list[str]:
    if found.rollers:
        return [
            f"{name}: none of the {count_of(len(found.rollers), 'cylinder')} passes the filters (diameter, class)"
        ]
    lines = [f"{name}: found no cylinder that could be a roller"]
    return lines + [f"  {line}" for line in left_out_lines(found)] + found.warnings


def count_of(count: int, thing: str) -> str:
    """Words for a count of regular nouns."""
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"


def left_out_lines(found: Found) -> list[str]:
    """One line for each reason for which solids were left out."""
    counts = Counter(reason for _, _, reason, _ in found.left_out)
    return [f"{count_of(count, 'solid')} {REASONS[reason]}" for reason, count in counts.most_common()]


def _settings_lines(data: bytes, name: str, found: Found, settings: Settings, belts) -> list[str]:
    lines = [
        f"source = {_printable(Path(name).name)}",
        f"sha256 = {sha256(data).hexdigest()}",
        f"save version = {found.header.version}",
        f"product = {_printable(found.header.product) or 'unknown'}",
        f"millimetres per unit = {found.unit_mm:g}",
    ]
    lines += [f"belt = {_printable(Path(belt).name)}" for belt in belts]
    for field in fields(Settings):
        value = getattr(settings, field.name)
        if value not in (None, "") and field.name != "unit_mm":
            lines.append(f"{field.name.replace('_', ' ')} = {_text(value)}")
    return lines


def _printable(text: str) -> str:
    return " ".join("".join(sign if sign.isprintable() else " " for sign in text).split())


def _text(value) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.12g}" if isinstance(value, float) else f"{value}"


def _result_lines(found: Found, rollers: list[Roller], settings: Settings) -> list[str]:
    kinds = Counter(roller.kind for roller in rollers)
    parts = sum(is_part(roller, settings.output) for roller in rollers)
    lines = [
        f"solids = {found.solids}",
        f"cylinders = {len(rollers)}",
        f"pulleys = {kinds['PULLEY']}",
        f"idlers = {kinds['IDLER']}",
        f"parts = {parts}",
        f"particles = {len(rollers) - parts}",
        f"left out = {len(found.left_out)}",
    ]
    return lines + [f"left out: {line}" for line in left_out_lines(found)]
