"""The command `beltsim`. Everything heavy is imported inside the commands that use it."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import click

from beltsim import __version__
from beltsim.console import Quantity, UsageProblem, guarded, refuse_existing, say, summary


class LazyGroup(click.Group):
    """Commands whose modules are imported when they are asked for, so that `--help` stays quick."""

    elsewhere = {  # noqa: RUF012 - never changed
        "verify": ("beltsim.verify.cli", "verify_command"),
        "view": ("beltsim.view.cli", "view_command"),
        "warmup": ("beltsim.warmup", "warmup_command"),
    }

    def list_commands(self, context: click.Context) -> list[str]:
        """Names of all commands."""
        return sorted([*super().list_commands(context), *self.elsewhere])

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        """The command of a name, imported if need be."""
        if name in self.elsewhere:
            import importlib

            module, attribute = self.elsewhere[name]
            return getattr(importlib.import_module(module), attribute)
        return super().get_command(context, name)


class ThreadCount(click.ParamType):
    """A count of threads; None for "auto"."""

    name = "count of threads"

    def convert(self, value, param, context) -> int | None:
        """The count, from 1 up."""
        if value is None or value == "auto":
            return None
        try:
            return click.IntRange(min=1).convert(value, param, context)
        except click.BadParameter:
            self.fail(f"found {value}, expected auto or a count from 1 up", param, context)


@click.group(cls=LazyGroup)
@click.version_option(__version__, prog_name="beltsim")
def main() -> None:
    """Dynamic conveyor-belt simulation with bonded-particle belts."""


@main.command()
@click.argument("case", type=click.Path(allow_dash=True))
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False),
    help="Trajectory file; default: CASE with the suffix .h5.",
)
@click.option("--until", type=Quantity("time"), help="Total time at which to end [s, or with a unit: 2min].")
@click.option("--overwrite", is_flag=True, help="Replace an existing trajectory.")
@click.option(
    "--allow-unstable", is_flag=True, help="Run a given time step above the stability limit, for studies."
)
@click.option(
    "--threads",
    type=ThreadCount(),
    metavar="N|auto",
    default="auto",
    show_default=True,
    help="Threads to use; auto: all CPUs that it may use, one for a small scene. Results are the same for any.",
)
@click.option("--json", "as_json", is_flag=True, help="Print a summary as one JSON object on stdout.")
@click.option("-q", "--quiet", is_flag=True, help="No messages but errors.")
@guarded
def run(
    case: str,
    output: str | None,
    until,
    overwrite: bool,
    allow_unstable: bool,
    threads: int | None,
    as_json: bool,
    quiet: bool,
) -> None:
    """Run the INP deck CASE ("-": stdin) and write an HDF5 trajectory.

    \b
    Example:
        beltsim run case.inp -o case.h5
    """  # noqa: D301 - click wants the character itself
    path = trajectory_path(case, output)
    refuse_existing(path, overwrite=overwrite, inputs=[case])
    from beltsim import inp

    clock = time.perf_counter()
    deck = inp.read_case(case)
    read_time = time.perf_counter() - clock
    refuse_existing(path, overwrite=overwrite, inputs={block.where.file for block in deck.blocks()})

    from beltsim.progress import reporter
    from beltsim.provenance import case_text, provenance
    from beltsim.run import run as run_scene
    from beltsim.scene import build
    from beltsim.signals import signals

    def tell(message: str) -> None:
        say(message, quiet=quiet)

    scene = build(deck)
    tell(description(scene))
    report = reporter(quiet=quiet)
    with signals() as stop:
        try:
            tally = run_scene(
                deck,
                scene,
                path,
                until=until or float("inf"),
                allow_unstable=allow_unstable,
                case_text=case_text(deck),
                provenance=provenance(deck, sys.argv),
                threads=threads,
                report=report,
                say=tell,
                stop=stop,
            )
        finally:
            report.close()
    speed = tally.particle_steps / tally.wall if tally.wall else 0.0
    tell(ending(tally, scene, speed, path))
    if as_json:
        counts = {
            "particles": scene.population.count,
            "removed": tally.removed,
            "broken": len(tally.breaks.time),
        }
        counts["bonds"] = 0 if scene.bonds is None else scene.bonds.first.size
        timings = {"read": read_time, "compile": tally.compile_time, "run": tally.wall}
        masses = {"inserted_mass": tally.inserted, "removed_mass": tally.removed_mass}
        click.echo(
            summary("ok", counts=counts, warnings=tally.messages, timings=timings, outputs=[path], **masses)
        )


def trajectory_path(case: str, output: str | None) -> str:
    """Where the trajectory goes: beside the case unless told otherwise."""
    if output is not None:
        return output
    if case == "-":
        raise UsageProblem("a case from stdin needs -o FILE for its trajectory")
    return str(Path(case).with_suffix(".h5"))


def description(scene) -> str:
    """One line about a scene."""
    bonds = 0 if scene.bonds is None else scene.bonds.first.size
    return f"{scene.population.count} particles, {bonds} bonds, {len(scene.machinery.info)} parts"


def ending(tally, scene, speed: float, path: str) -> str:
    """What to say at the end of a run."""
    from beltsim.breakage import sentence

    lines = [
        f"kernels ready in {tally.compile_time:.1f} s, run in {tally.wall:.1f} s "
        f"({speed:.3g} particle-steps/s), written to {path}"
    ]
    for name, mass in tally.inserted.items():
        lines.append(
            f"source {name}: {mass:.4g} kg inserted, {tally.achieved(name):.3g} kg/s while it was open"
        )
    if tally.breaks.time:
        lines.append(sentence(tally.breaks, scene))
    if tally.removed:
        lines.append(f"{tally.removed} particles ({tally.removed_mass:.4g} kg) left the domain")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
