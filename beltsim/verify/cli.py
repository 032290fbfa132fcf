"""The command `beltsim verify`."""

from __future__ import annotations

import time
from pathlib import Path

import click

from beltsim.console import (
    CommandError,
    ExitCode,
    UsageProblem,
    guarded,
    output_file,
    refuse_existing,
    say,
    summary,
)


class Unverified(CommandError):
    """A row of the book is out of tolerance."""

    exit_code = ExitCode.LIMIT_FAILED


@click.command("verify")
@click.option("--quick", is_flag=True, help="Only the cases that take a second or two each.")
@click.option("--only", metavar="NAMES", help="Names of cases, with commas between them, as A1,E2.")
@click.option(
    "--list", "as_list", is_flag=True, help="Print the names and titles of all cases, and run nothing."
)
@click.option(
    "-o",
    "--output",
    type=click.Path(dir_okay=False),
    help="Markdown page to write, its plots in a folder of its name beside it; default: page to stdout, no plots.",
)
@click.option("--overwrite", is_flag=True, help="Replace an existing page and its plots.")
@click.option(
    "--jobs",
    type=click.IntRange(1),
    default=1,
    show_default=True,
    help="How many cases run at a time, each in a process.",
)
@click.option("--json", "as_json", is_flag=True, help="Print all rows as one JSON object on stdout.")
@click.option("-q", "--quiet", is_flag=True, help="No line for each case.")
@guarded
def verify_command(
    quick: bool,
    only: str | None,
    as_list: bool,
    output: str | None,
    overwrite: bool,
    jobs: int,
    as_json: bool,
    quiet: bool,
) -> None:
    """Run the verification book: analytic and published targets against the solver.

    Exit code 6 if a row is out of tolerance.

    \b
    Example:
        beltsim verify --quick -o verification.md
    """  # noqa: D301 - click wants the character itself
    if as_json and output == "-":
        raise UsageProblem("--json and -o -: both would go to stdout")
    refuse_unwritable(output, overwrite)
    cases = chosen_cases(only, quick)
    if as_list:
        for chapter, name, case in cases:
            click.echo(f"{name:6} {case.title} ({chapter})")
        return
    from beltsim.verify import book

    clock = time.perf_counter()
    outcomes = []
    for outcome in book.run_cases(cases, jobs):
        outcomes.append(outcome)
        say(line_of(outcome), quiet=quiet)
    wall = time.perf_counter() - clock
    written = write(outcomes, output, overwrite) if output or not as_json else []
    failed = [outcome.name for outcome in outcomes if not outcome.passed]
    if as_json:
        status, cases = "failed" if failed else "ok", [record(outcome) for outcome in outcomes]
        timings = {"run": wall}
        click.echo(summary(status, counts=counts_of(outcomes), timings=timings, outputs=written, cases=cases))
    say(f"{len(outcomes)} cases in {wall:.0f} s", quiet=quiet)
    if failed:
        raise Unverified(f"out of tolerance: {', '.join(failed)}")


def refuse_unwritable(output: str | None, overwrite: bool) -> None:
    """Refuse, before minutes of work, what could not be written after them."""
    refuse_existing(output, overwrite=overwrite)
    if output is None or output == "-":
        return
    target = Path(output)
    if not target.suffix:
        raise UsageProblem(
            f"{output}: expected a file name such as {output}.md; the plots go to the folder {output}"
        )
    if target.with_suffix("").exists() and not overwrite:
        raise UsageProblem(
            f"{target.with_suffix('')}: the folder of plots exists; --overwrite writes into it"
        )


def chosen_cases(only: str | None, quick: bool) -> list:
    """The cases that the options ask for."""
    from beltsim.verify import book

    if only is None:
        return book.chosen(quick=quick)
    names = [name.strip() for name in only.split(",") if name.strip()]
    if not names:
        raise UsageProblem("--only: expected names of cases, with commas between them")
    try:
        return book.chosen(names)
    except KeyError as error:
        raise UsageProblem(
            f"--only: no case {error.args[0]}; `beltsim verify --list` names them all"
        ) from None


def line_of(outcome) -> str:
    """One line about a case that was run."""
    verdict = "pass" if outcome.passed else "FAIL"
    bad = "; ".join(
        f"{row.label}: {row.result:.6g}, expected {row.target:.6g}"
        for row in outcome.findings.rows
        if not row.passed
    )
    text = f"{verdict}  {outcome.name:5} {outcome.case.title} ({outcome.cpu:.1f} s)"
    return "\n      ".join(part for part in (text, outcome.trouble or bad) if part)


def write(outcomes: list, output: str | None, overwrite: bool) -> list[Path]:
    """Write the page and, beside it, its plots; returns what was written."""
    from beltsim import __version__
    from beltsim.verify.book import page, pictures

    cpu = sum(outcome.cpu for outcome in outcomes)
    head = f"beltsim {__version__}; {cpu:.0f} s of one core in all, compilation included."
    if output is None or output == "-":
        with output_file(output) as stream:
            stream.write(page(outcomes, head, lambda name: f"{name}.svg").encode())
        return []
    target = Path(output)
    folder = target.with_suffix("")
    plots = pictures(outcomes)
    if plots:
        folder.mkdir(parents=True, exist_ok=True)
    written = [target]
    for name, text in plots.items():
        with output_file(folder / f"{name}.svg", overwrite=overwrite) as stream:
            stream.write(text.encode())
        written.append(folder / f"{name}.svg")
    with output_file(target, overwrite=overwrite) as stream:
        stream.write(page(outcomes, head, lambda name: f"{folder.name}/{name}.svg").encode())
    return written


def counts_of(outcomes: list) -> dict:
    """How many cases and rows, and how many of them passed."""
    rows = [row for outcome in outcomes for row in outcome.findings.rows]
    return {
        "cases": len(outcomes),
        "cases_passed": sum(outcome.passed for outcome in outcomes),
        "rows": len(rows),
        "rows_passed": sum(row.passed for row in rows),
    }


def record(outcome) -> dict:
    """A case as plain data."""
    names = ("label", "unit", "target", "result", "error", "tolerance", "absolute", "passed")
    return {
        "name": outcome.name,
        "title": outcome.case.title,
        "source": outcome.case.source,
        "cpu": outcome.cpu,
        "passed": outcome.passed,
        "trouble": outcome.trouble,
        "rows": [{name: plain(getattr(row, name)) for name in names} for row in outcome.findings.rows],
    }


def plain(value):
    """numpy scalars as Python's."""
    return value.item() if hasattr(value, "item") else value
