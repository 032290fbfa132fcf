"""`beltsim view`: a picture or a web page of a trajectory's frame or of a deck."""

from __future__ import annotations

import functools
from pathlib import Path

import click

from beltsim.console import UsageProblem, guarded, output_file, refuse_existing, say

COLOUR_BY = ("none", "type", "fibre", "height", "speed", "elongation", "force", "strain")
LAYERS = ("belt", "bulk", "parts")


class Numbers(click.ParamType):
    """Numbers in one text, as 0,0,0,1,1,1."""

    def __init__(self, count: int, separator: str, kind: type, example: str):
        self.count, self.separator, self.kind, self.name = count, separator, kind, example

    def convert(self, value, param, ctx):
        """The numbers of a text."""
        if isinstance(value, tuple):
            return value
        try:
            numbers = tuple(self.kind(text) for text in value.split(self.separator))
        except ValueError:
            numbers = ()
        if len(numbers) != self.count or any(number != number or abs(number) > 1e12 for number in numbers):
            self.fail(f"found {value!r}, expected {self.count} numbers as {self.name}", param, ctx)
        return numbers


def look_options(command):
    """The options of how a picture looks, shared with other commands that draw."""
    options = [
        click.option(
            "--azimuth",
            type=float,
            metavar="DEG",
            help="Direction from which one looks, deg from +x to +y. [default: three-quarter, or facing the section]",
        ),
        click.option(
            "--elevation",
            type=click.FloatRange(-90, 90),
            metavar="DEG",
            default=24,
            show_default=True,
            help="Angle above the horizon, deg.",
        ),
        click.option(
            "--orthographic", is_flag=True, help="Parallel rays: no perspective. [default: perspective]"
        ),
        click.option(
            "--zoom",
            type=Numbers(6, ",", float, "x0,y0,z0,x1,y1,z1"),
            metavar="X0,Y0,Z0,X1,Y1,Z1",
            help="Box that fills the picture, m. [default: everything]",
        ),
        click.option(
            "--section",
            metavar="AXIS=VALUE",
            help='Hide what lies before a plane, as "x=1.2" (m); PNG only. [default: none]',
        ),
        click.option(
            "--size",
            type=Numbers(2, "x", int, "1600x900"),
            default="1600x900",
            show_default=True,
            metavar="WxH",
            help="Size of a PNG, pixels.",
        ),
        click.option(
            "--ground/--no-ground", default=True, show_default=True, help="Draw the shadow on a floor."
        ),
    ]
    return functools.reduce(lambda inner, option: option(inner), reversed(options), command)


@click.command("view", short_help="Draw a frame of a trajectory, or a deck, as PNG or web page.")
@click.argument("case", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", required=True, metavar="FILE", help="picture.png, page.html, or - for a PNG on stdout."
)
@click.option(
    "--frame",
    type=int,
    default=-1,
    show_default=True,
    metavar="K",
    help="Frame of a trajectory, from 0; negative: from the end.",
)
@click.option(
    "--color-by",
    type=click.Choice(COLOUR_BY),
    default="none",
    show_default=True,
    help="Own colours (none), particle type, fibre of the belt (deck), height (m), speed (m/s), elongation "
    "(%) or force (N) of bonds (trajectory), initial strain (%) of bonds (deck).",
)
@click.option(
    "--range",
    "limits",
    type=Numbers(2, ",", float, "0,2.5"),
    metavar="LOW,HIGH",
    help="Ends of the colour bar, in its unit. [default: those of what is drawn]",
)
@click.option(
    "--hide",
    type=click.Choice(LAYERS),
    multiple=True,
    help="Leave this out; may be given several times. [default: nothing]",
)
@look_options
@click.option("--overwrite", is_flag=True, help="Replace an existing picture. [default: refuse]")
@guarded
def view_command(case, output, frame, color_by, limits, hide, overwrite, **look):
    """Draw a frame of the trajectory CASE (.h5), or the deck CASE (.inp), into FILE: PNG or HTML by its ending.

    A PNG is made by ray casting, without a display; an HTML page can be turned, zoomed and cut in any browser,
    and fetches nothing from a network.
    """
    _refuse_mismatch(output, limits, look)
    refuse_existing(output, overwrite=overwrite)
    scenery = _scenery(case, frame, color_by, frozenset(hide), limits)
    draw(scenery, output, overwrite=overwrite, **look)


def _refuse_mismatch(output: str, limits: tuple | None, look: dict) -> None:
    ending = Path(output).suffix.lower()
    if output != "-" and ending not in (".png", ".html"):
        raise UsageProblem(f"{output}: found ending {ending!r}, expected .png or .html")
    if ending == ".html" and look["section"]:
        raise UsageProblem(
            "--section: found with a web page, expected with a PNG; the page has its own section"
        )
    if limits and limits[0] >= limits[1]:
        raise UsageProblem(f"--range: found {limits[0]:g},{limits[1]:g}, expected the lower value first")


def _scenery(case: Path, frame: int, colour_by: str, hide: frozenset[str], limits: tuple | None):
    if case.suffix.lower() == ".inp" or str(case) == "-":
        from beltsim import inp

        from . import deck

        _refuse_colouring(colour_by, deck.COLOUR_BY, f"{case} is a deck")
        return deck.scenery_of_deck(inp.read(str(case)), colour_by, hide=hide, limits=limits)
    from beltsim import trajectory

    from . import frame as frames

    _refuse_colouring(colour_by, frames.COLOUR_BY, f"{case} is read as a trajectory")
    with trajectory.read(case) as opened:
        parts = opened.contents.parts
        meshes = [part.name for part in parts if part.shape == "MESH" and part.faces is None]
        if meshes and "parts" not in hide:
            say(f"warning: not drawn, since the trajectory lacks their triangles: {', '.join(meshes)}")
        return frames.scenery_of_frame(opened, frame, colour_by, hide=hide, limits=limits)


def _refuse_colouring(colour_by: str, known: tuple[str, ...], what: str) -> None:
    if colour_by not in known:
        raise UsageProblem(f"--color-by {colour_by}: {what}, expected one of {', '.join(known)}")


def draw(
    scenery,
    output: str,
    *,
    overwrite=False,
    azimuth=None,
    elevation=24.0,
    orthographic=False,
    zoom=None,
    section=None,
    size=(1600, 900),
    ground=True,
) -> None:
    """Draw a scenery into a PNG or HTML file by its ending; "-" is a PNG on stdout."""
    from .camera import Camera, Section

    camera = Camera(azimuth=azimuth, elevation=elevation, zoom=zoom, orthographic=orthographic)
    plane = Section.parse(section) if section else None
    if Path(output).suffix.lower() == ".html":
        from .html import html_of

        page = html_of(scenery, camera).encode()
        with output_file(output, overwrite=overwrite) as stream:
            stream.write(page)
        return
    from .png import render_png

    with output_file(output, overwrite=overwrite) as stream:
        render_png(
            scenery, stream, width=size[0], height=size[1], camera=camera, section=plane, ground=ground
        )
