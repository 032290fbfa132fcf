"""The verification book: which cases there are, running them, and the page that shows them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context

from beltsim.verify import (
    belt_bending,
    belt_sag,
    belt_statics,
    belt_waves,
    capstans,
    chung_ooi,
    chung_ooi_tangential,
    discharge,
    feeding,
    grids,
    heaps,
    impacts,
    invariants,
    orifice,
    reactions,
    rolling,
    strings,
    two_pulleys,
)
from beltsim.verify.case import Case, Findings, Row
from beltsim.verify.svg import svg

CHAPTERS = {
    "Strips at rest": belt_statics.CASES,
    "Strips that swing": belt_waves.CASES,
    "Strings": strings.CASES,
    "Large bending": belt_bending.CASES,
    "Hanging belts": belt_sag.CASES,
    "Lattices": grids.CASES,
    "Belts on pulleys": capstans.CASES | two_pulleys.CASES,
    "Energy, momenta, breakage": invariants.CASES | reactions.CASES,
    "Impacts": impacts.CASES,
    "Benchmarks of Chung and Ooi": chung_ooi.CASES | chung_ooi_tangential.CASES,
    "Rolling, sliding, sticking": rolling.CASES,
    "Bulk": feeding.CASES | discharge.CASES | orifice.CASES | heaps.CASES,
}

ABSENT = {
    "Silo, drum and penetration of Dosta et al. 2024": "up to 100,000 spheres over millions of steps take hours, and "
    "the published curves are not at hand",
    "Critical speed of a moving string": "its frequency falls to zero there; G2 has the law below it",
    "Seams, edges and corners of boxes": "no closed form; that forces change gradually and a belt of boxes is one "
    "surface is in `tests/test_box_contact.py` and `tests/test_rolling_physics.py`",
}
"""What could be asked of such a book and is not in it, and why."""


@dataclass(frozen=True)
class Outcome:
    """A case that was run. `trouble` says why it has no findings, if it has none."""

    name: str
    chapter: str
    case: Case
    findings: Findings
    cpu: float  # s, of one core
    trouble: str = ""

    @property
    def passed(self) -> bool:
        """Whether every row is within its tolerance."""
        return not self.trouble and all(row.passed for row in self.findings.rows)


def chosen(names: list[str] | None = None, *, quick: bool = False) -> list[tuple[str, str, Case]]:
    """Chapter, name and case of what is to be run; names in either case.

    Without names the whole book, from which the short variants of long cases (names that end in q) are left out; or
    all quick cases.

    Raises
    ------
    KeyError
        For a name that no case has.
    """
    everything = [
        (chapter, name, case) for chapter, cases in CHAPTERS.items() for name, case in cases.items()
    ]
    if names:
        known, wanted = {name.casefold() for _, name, _ in everything}, {name.casefold() for name in names}
        unknown = [name for name in names if name.casefold() not in known]
        if unknown:
            raise KeyError(", ".join(unknown))
        return [entry for entry in everything if entry[1].casefold() in wanted]
    if quick:
        return [entry for entry in everything if entry[2].quick]
    return [entry for entry in everything if not entry[1].endswith("q")]


def run_cases(cases: list[tuple[str, str, Case]], jobs: int = 1) -> Iterator[Outcome]:
    """Run cases, in this process or several at a time in `jobs` others; they come in the order given."""
    names = [name for _, name, _ in cases]
    if jobs == 1:
        yield from map(outcome_of, cases, map(findings_of, names))
        return
    with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        yield from map(outcome_of, cases, pool.map(findings_of, names))


def findings_of(name: str) -> tuple[Findings, float, str]:
    """Findings of a case, its time on one core [s], and its trouble: an error leaves no rows and says so."""
    case = next(cases[name] for cases in CHAPTERS.values() if name in cases)
    clock = time.process_time()
    try:
        findings, trouble = case.find(), ""
    except Exception as error:  # a case that cannot run is a finding, and the others still count
        findings, trouble = Findings([]), f"{type(error).__name__}: {error}"
    return findings, time.process_time() - clock, trouble


def outcome_of(entry: tuple[str, str, Case], result: tuple[Findings, float, str]) -> Outcome:
    """A case with what it found."""
    chapter, name, case = entry
    return Outcome(name, chapter, case, *result)


def page(outcomes: list[Outcome], head: str, picture_of: Callable[[str], str]) -> str:
    """The book as Markdown; `picture_of` gives the address of a plot."""
    rows = [row for outcome in outcomes for row in outcome.findings.rows]
    failed = [outcome for outcome in outcomes if not outcome.passed]
    lines = [
        "# Verification",
        "",
        "What theory and publications say, and what the solver gives. Written by `beltsim verify`; not by hand.",
        "",
        head,
        "",
        f"{sum(row.passed for row in rows)} of {len(rows)} rows in {len(outcomes)} cases are within tolerance"
        + (f"; not all of: {', '.join(outcome.name for outcome in failed)}." if failed else "."),
        "",
        "Errors are relative to the target unless they carry a unit (then they are differences, as is the tolerance).",
        "The reference strip has E = 50 MPa, ν = 0.3, 1200 kg/m³ and measures 1 m x 100 mm x 10 mm: E A = 50 kN, "
        "E I = 0.41667 N m², 1.2 kg/m; its end particles have half the mass.",
        "",
    ]
    chapters = {chapter: [run for run in outcomes if run.chapter == chapter] for chapter in CHAPTERS}
    chapters = {chapter: inside for chapter, inside in chapters.items() if inside}
    lines += ["| chapter | cases |", "|---|---|"]
    for chapter, inside in chapters.items():
        lines.append(f"| {chapter} | {'; '.join(f'{run.name} {run.case.title}' for run in inside)} |")
    lines += ["", "Not in the book:", *(f"- {what}: {why}." for what, why in ABSENT.items()), ""]
    for chapter, inside in chapters.items():
        lines += [f"## {chapter}", ""]
        for outcome in inside:
            lines += section(outcome, picture_of)
    return "\n".join(lines)


def section(outcome: Outcome, picture_of: Callable[[str], str]) -> list[str]:
    """Lines of one case."""
    case = outcome.case
    lines = [f"### {outcome.name} {case.title}", "", f"{case.source}. {outcome.cpu:.1f} s.", ""]
    if outcome.trouble:
        return [*lines, f"**Failed:** {outcome.trouble}", ""]
    lines += ["| row | target | result | error | tolerance | |", "|---|---|---|---|---|---|"]
    lines += [table_row(row) for row in outcome.findings.rows]
    lines.append("")
    if case.note:
        lines += [case.note, ""]
    for plot in outcome.findings.plots:
        lines += [f"![{plot.title}]({picture_of(plot.name)})", ""]
    return lines


def table_row(row: Row) -> str:
    """One line of a table."""
    unit = "" if row.unit == "-" else f" {row.unit}"
    own = unit if row.absolute else ""
    verdict = "pass" if row.passed else "**FAIL**"
    return (
        f"| {row.label} | {row.target:.7g}{unit} | {row.result:.7g}{unit} "
        f"| {row.error:.2g}{own} | {row.tolerance:.2g}{own} | {verdict} |"
    )


def pictures(outcomes: list[Outcome]) -> dict[str, str]:
    """SVG text of all plots by name."""
    return {plot.name: svg(plot) for outcome in outcomes for plot in outcome.findings.plots}
