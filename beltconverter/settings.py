"""From parsed options to `Settings`: values that make no sense together are refused here."""

from __future__ import annotations

import re
from dataclasses import fields

from beltsim.console import UsageProblem


def settings_from(options: dict, *, stated: dict[str, str], source: str | None):
    """`Settings` of parsed options; `UsageProblem` for combinations that make no sense."""
    from .convert import Settings
    from .frames import Pose
    from .properties import Sheet
    from .recover import Wishes
    from .zones import parse_zone, read_zones

    o = options
    _check_names(o)
    kind = None if o["is_open"] is None else "open" if o["is_open"] else "endless"
    turned = (o["flip"], o["reverse"], o["flip_belt"], o["reverse_belt"])
    zones = (*(read_zones(o["zone_file"]) if o["zone_file"] else ()), *map(parse_zone, o["zone_texts"]))
    same_name = ("unit", "stress_free", "contact_modulus", "friction", "restitution", "cell")
    return Settings(
        **{name: o[name] for name in same_name},
        wishes=Wishes(kind, o["cells"], o["weld"]),
        pose=Pose(o["up"], o["direction"], o["longitudinal"], *turned),
        making=_making(o),
        sheet=Sheet(**{field.name: o[field.name] for field in fields(Sheet) if o[field.name] is not None}),
        half_edges=o["edge"] == "half",
        zones=zones,
        thickness_stated=o["thickness"] is not None,
        stated=stated,
        source=source,
    )


def _making(o: dict):
    from .belt import Making

    same_name = (
        "shape",
        "edge_radius",
        "overlap",
        "sphere_radius",
        "fibres",
        "fibre_name",
        "name",
        "material",
        "first_id",
    )
    return Making(
        **{name: o[name] for name in same_name},
        elongation=(o["elongation_along"], o["elongation_across"]),
        prefix=o["name_prefix"],
        touching_columns=o["touching_edges"],
        speed=o["belt_speed"],
    )


def _check_names(o: dict) -> None:
    """Names end up in references and patterns of the INP file."""
    for name in ("name", "name_prefix", "fibre_name", "material"):
        if re.search(r'[\s*?,"=]', o[name]) or not (o[name] or name == "name_prefix"):
            flag = "--" + name.replace("_", "-")
            raise UsageProblem(f"{flag} '{o[name]}': expected a word without blanks and * ? , = \"")
