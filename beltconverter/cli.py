"""The command `beltconvert`."""

from __future__ import annotations

import click

from beltsim import __version__, console

from .options import add_options, settings_from


@click.command(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(__version__, prog_name="beltconvert")
@click.argument("mesh", metavar="MESH")
@click.option("-o", "--output", metavar="FILE", help="INP file to write; without it, or '-', to stdout.")
@add_options
@click.option("--overwrite", is_flag=True, help="Replace an existing output file.")
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Print one JSON object with counts, figures and warnings to stdout (needs -o).",
)
@click.option("-q", "--quiet", is_flag=True, help="No summary and no warnings on stderr.")
@console.guarded
def main(mesh: str, output: str | None, overwrite: bool, as_json: bool, quiet: bool, **options) -> None:
    """Convert the meshed mid-surface of a conveyor belt into a bonded-particle belt.

    MESH is an STL file (ASCII or binary) with a structured grid of quads cut into triangles along any diagonals;
    '-' reads stdin. Rows and columns are recovered from the topology and proven; anything that is no such grid is
    refused with its cause and place (exit code 4), and no output is left behind.
    """
    settings = settings_from(options)
    if as_json and output in (None, "-"):
        raise console.UsageProblem("--json prints to stdout, as the INP text would: add -o FILE")
    console.refuse_existing(output, overwrite=overwrite)
    _convert(mesh, output, overwrite, as_json, quiet, settings)


def _convert(mesh, output, overwrite, as_json, quiet, settings) -> None:
    from time import perf_counter

    from beltsim import inp

    from .convert import convert
    from .report import summary_lines

    conversion = convert(console.read_input(mesh), "<stdin>" if mesh == "-" else mesh, settings)
    start = perf_counter()
    with console.output_file(output, overwrite=overwrite) as stream:
        inp.write(conversion.deck, stream)
    timings = {**conversion.timings, "write": perf_counter() - start}
    for line in [f"warning: {warning}" for warning in conversion.warnings] + summary_lines(
        conversion.reports
    ):
        console.say(line, quiet=quiet)
    if as_json:
        counts = {key: sum(one[key] for one in conversion.reports) for key in ("particles", "bonds")}
        counts = {"belts": len(conversion.reports), **counts}
        more = {"belts": conversion.reports}
        click.echo(
            console.summary(
                "ok", counts=counts, warnings=conversion.warnings, timings=timings, outputs=[output], **more
            )
        )
