"""The command `partconvert`."""

from __future__ import annotations

import click

from beltsim import __version__, console

from .options import add_options, settings_from


@click.command(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(__version__, prog_name="partconvert")
@click.argument("sat", metavar="SAT")
@click.option("-o", "--output", metavar="FILE", help="INP file to write; without it, or '-', to stdout.")
@add_options
@click.option(
    "--list", "as_list", is_flag=True, help="Print a table of the cylinders to stdout (INP only with -o)."
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object to stdout (INP only with -o).")
@click.option("--preview", metavar="FILE", help="Draw the cylinders: .png picture or .html page to turn.")
@click.option("--overwrite", is_flag=True, help="Replace existing output files.")
@click.option("-q", "--quiet", is_flag=True, help="No summary and no warnings on stderr.")
@console.guarded
def main(sat, output, belts, as_list, as_json, preview, overwrite, quiet, **options) -> None:
    """Convert the cylinders of a CAD assembly into numerically smooth rollers.

    SAT is an ACIS text file of any version, Autodesk's included; '-' reads stdin. Every turned body (drum, tube,
    shaft) becomes a cylinder with its diameter, length, position and axis; boxes, plates, half cylinders and
    everything else is left out and counted.
    """
    settings = settings_from(options, belts)
    shown = as_list or as_json
    if as_list and as_json:
        raise console.UsageProblem("--list and --json both print to stdout: give one of them")
    if shown and output == "-":
        raise console.UsageProblem("-o - and --list or --json both print to stdout: give one of them")
    if preview and not preview.lower().endswith((".png", ".html")):
        raise console.UsageProblem(
            f"--preview: found {preview}, expected a file name ending in .png or .html"
        )
    for path in (output, preview):
        console.refuse_existing(path, overwrite=overwrite, inputs=[sat])
    _run(sat, output, belts, preview, (as_list, as_json), overwrite, quiet, settings)


def _run(sat, output, belts, preview, shown, overwrite, quiet, settings) -> None:
    from time import perf_counter

    from beltsim import inp

    from . import listing
    from .convert import NothingToConvert, convert

    name = "<stdin>" if sat == "-" else sat
    start = perf_counter()
    try:
        conversion = convert(console.read_input(sat), name, settings, belts)
    except NothingToConvert as nothing:
        if shown[1]:
            click.echo(console.summary("nothing to convert", **listing.json_of_nothing(nothing.found)))
        raise
    converted = perf_counter()
    outputs = []
    if output is not None or not any(shown):
        with console.output_file(output, overwrite=overwrite) as stream:
            inp.write(conversion.deck, stream)
        outputs += [] if output in (None, "-") else [output]
    timings = {"convert": converted - start, "write": perf_counter() - converted}
    if preview:
        _draw(conversion.deck, belts, preview)
        outputs.append(preview)
    for line in [f"warning: {text}" for text in conversion.warnings] + listing.summary_lines(
        conversion, name
    ):
        console.say(line, quiet=quiet)
    as_list, as_json = shown
    if as_list:
        click.echo(listing.table(conversion, settings.output, settings.first_id))
    if as_json:
        more = listing.json_body(conversion, settings.output, settings.first_id)
        counts = listing.counts_of(conversion)
        found = {"counts": counts, "warnings": conversion.warnings, "timings": timings, "outputs": outputs}
        click.echo(console.summary("ok", **found, **more))


def _draw(deck, belts, path: str) -> None:
    """Draw the deck and the belts that drive it, as a picture or a page by the suffix."""
    from beltsim import inp
    from beltsim.view.deck import scenery_of_deck

    if path.lower().endswith(".html"):
        from beltsim.view.html import render_html as render
    else:
        from beltsim.view.png import render_png as render
    scenery = scenery_of_deck(deck)
    for belt in belts:
        scenery.items += scenery_of_deck(inp.read(belt)).items
    render(scenery, path)
