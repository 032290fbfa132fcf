"""From parsed options to `Settings`: values that make no sense together are refused here."""

from __future__ import annotations

import re
from dataclasses import fields

from beltsim.console import UsageProblem


def settings_from(options: dict, *, stated: dict[str, str], source: str | None):
    """`Settings` of parsed options; `UsageProblem` for combinations that make no sense."""
    from .belt import Making
    from .convert import Settings
    from .frames import Pose
    from .properties import Sheet
    from .recover import Wishes
    from .zones import parse_zone, read_zones

    o = options
    for name in ("name", "name_prefix", "fibre_name", "material"):
        if re.search(r'[\s*?,"=]', o[name]) or not (o[name] or name == "name_prefix"):
            raise UsageProblem(
                f"--{name.replace('_', '-')} '{o[name]}': expected a word without blanks and * ? , = \""
            )
    sheet = Sheet(**{field.name: o[field.name] for field in fields(Sheet) if o[field.name] is not None})
    kind = None if o["is_open"] is None else "open" if o["is_open"] else "endless"
    making = Making(
        shape=o["shape"],
        edge_radius=o["edge_radius"],
        overlap=o["overlap"],
        sphere_radius=o["sphere_radius"],
        elongation=(o["elongation_along"], o["elongation_across"]),
        fibres=o["fibres"],
        fibre_name=o["fibre_name"],
        name=o["name"],
        prefix=o["name_prefix"],
        touching_columns=o["touching_edges"],
        speed=o["belt_speed"],
        material=o["material"],
        first_id=o["first_id"],
    )
    return Settings(
        unit=o["unit"],
        wishes=Wishes(kind, o["cells"], o["weld"]),
        pose=Pose(
            o["up"],
            o["direction"],
            o["longitudinal"],
            o["flip"],
            o["reverse"],
            o["flip_belt"],
            o["reverse_belt"],
        ),
        making=making,
        sheet=sheet,
        stress_free=o["stress_free"],
        half_edges=o["edge"] == "half",
        contact_modulus=o["contact_modulus"],
        friction=o["friction"],
        restitution=o["restitution"],
        zones=(*(read_zones(o["zone_file"]) if o["zone_file"] else ()), *map(parse_zone, o["zone_texts"])),
        cell=o["cell"],
        thickness_stated=o["thickness"] is not None,
        stated=stated,
        source=source,
    )
