"""The command `beltconvert`."""

from __future__ import annotations

import os
from pathlib import Path

import click

from beltsim import __version__, console

from .options import add_options
from .settings import settings_from


@click.command(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(__version__, prog_name="beltconvert")
@click.argument("mesh", metavar="MESH")
@click.option("-o", "--output", metavar="FILE", help="INP file to write; without it, or '-', to stdout.")
@add_options
@click.option("--preview", metavar="FILE", help="Draw the belt: .png picture or .html page to turn.")
@click.option("--overwrite", is_flag=True, help="Replace existing output files.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object to stdout (INP only with -o).")
@click.option("-q", "--quiet", is_flag=True, help="No summary and no warnings on stderr.")
@click.pass_context
@console.guarded
def main(context, mesh, output, preview, overwrite, as_json, quiet, **options) -> None:
    """Convert the meshed mid-surface of a conveyor belt into a bonded-particle belt.

    MESH is an STL file (ASCII or binary) with a structured grid of quads cut into triangles along any diagonals,
    or a quad mesh (Abaqus .inp, gmsh .msh, .vtk, .vtu, .obj, .ply); '-' reads STL from stdin. With --cell it is
    the STL of a solid endless belt. Rows and columns are recovered from the topology and proven; anything that is
    no such grid is refused with its cause and place (exit code 4), and no output is left behind.
    """
    if as_json and output == "-":
        raise console.UsageProblem("-o - and --json both print to stdout: give one of them")
    for path in (output, preview):
        console.refuse_existing(path, overwrite=overwrite, inputs=[mesh])
    if preview and Path(preview).suffix.lower() not in (".png", ".html"):
        raise console.UsageProblem(f"--preview {preview}: expected a name that ends in .png or .html")
    _convert(
        mesh,
        output,
        preview,
        overwrite,
        as_json,
        quiet,
        settings_from(options, **_known(context, mesh, output)),
    )


def _known(context: click.Context, mesh: str, output: str | None) -> dict:
    """The options that were given, by name, and the mesh as seen from the output's folder."""
    from click.core import ParameterSource

    aside = {"mesh", "output", "preview", "overwrite", "as_json", "quiet"}
    given = [
        name for name in context.params if context.get_parameter_source(name) is ParameterSource.COMMANDLINE
    ]
    stated = {name: context.params[name] for name in sorted(set(given) - aside)}
    folder = Path.cwd() if output in (None, "-") else Path(output).absolute().parent
    source = None if mesh == "-" else Path(os.path.relpath(mesh, folder)).as_posix()
    return {"stated": {name: str(value) for name, value in stated.items()}, "source": source}


def _convert(mesh, output, preview, overwrite, as_json, quiet, settings) -> None:
    from time import perf_counter

    from beltsim import inp

    from .convert import convert
    from .report import summary_lines

    conversion = convert(console.read_input(mesh), "<stdin>" if mesh == "-" else mesh, settings)
    start = perf_counter()
    outputs = []
    if output is not None or not as_json:
        with console.output_file(output, overwrite=overwrite) as stream:
            inp.write(conversion.deck, stream)
        outputs += [] if output in (None, "-") else [output]
    timings = {**conversion.timings, "write": perf_counter() - start}
    for line in [f"warning: {warning}" for warning in conversion.warnings] + summary_lines(
        conversion.reports
    ):
        console.say(line, quiet=quiet)
    if preview:
        _draw(conversion.deck, settings.making.fibres, preview, overwrite)
        outputs.append(preview)
    if as_json:
        counts = {key: sum(one[key] for one in conversion.reports) for key in ("particles", "bonds")}
        counts = {"belts": len(conversion.reports), **counts}
        found = {"counts": counts, "warnings": conversion.warnings, "timings": timings, "outputs": outputs}
        click.echo(console.summary("ok", **found, belts=conversion.reports))


def _draw(deck, fibres: str, path: str, overwrite: bool) -> None:
    """Picture or page of the belt: its fibres in colours, else the initial strain of its bonds."""
    from beltsim.view.cli import draw
    from beltsim.view.deck import scenery_of_deck

    draw(scenery_of_deck(deck, "strain" if fibres == "none" else "fibre"), path, overwrite=overwrite)
