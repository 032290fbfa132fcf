"""The verification book: which cases there are, running them, and the page that shows them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from beltsim.verify import (
    belt_bending,
    belt_sag,
    belt_statics,
    belt_waves,
    chung_ooi,
    chung_ooi_tangential,
    feeding,
    grids,
    impacts,
    invariants,
    pulleys,
    rolling,
    strings,
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
    "Belts on pulleys": pulleys.CASES,
    "Energy, momenta, breakage": invariants.CASES,
    "Impacts": impacts.CASES,
    "Benchmarks of Chung and Ooi": chung_ooi.CASES | chung_ooi_tangential.CASES,
    "Rolling, sliding, sticking": rolling.CASES,
    "Feeding": feeding.CASES,
}


@dataclass(frozen=True)
class Outcome:
    """A case that was run. `trouble` says why it has no findings, if it has none."""

    name: str
    chapter: str
    case: Case
    findings: Findings
    wall: float  # s
    trouble: str = ""

    @property
    def passed(self) -> bool:
        """Whether every row is within its tolerance."""
        return not self.trouble and all(row.passed for row in self.findings.rows)


def chosen(names: list[str] | None = None, *, quick: bool = False) -> list[tuple[str, str, Case]]:
    """Chapter, name and case of what is to be run.

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
        known = {name for _, name, _ in everything}
        unknown = [name for name in names if name not in known]
        if unknown:
            raise KeyError(", ".join(unknown))
        return [entry for entry in everything if entry[1] in names]
    if quick:
        return [entry for entry in everything if entry[2].quick]
    return [entry for entry in everything if not entry[1].endswith("q")]


def run_cases(cases: list[tuple[str, str, Case]]) -> Iterator[Outcome]:
    """Run cases one after the other; one that ends in an error has no rows and says so."""
    for chapter, name, case in cases:
        clock = time.perf_counter()
        try:
            findings, trouble = case.find(), ""
        except Exception as error:  # a case that cannot run is a finding, and the others still count
            findings, trouble = Findings([]), f"{type(error).__name__}: {error}"
        yield Outcome(name, chapter, case, findings, time.perf_counter() - clock, trouble)


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
    for chapter in CHAPTERS:
        inside = [outcome for outcome in outcomes if outcome.chapter == chapter]
        if inside:
            lines += [f"## {chapter}", ""]
            for outcome in inside:
                lines += section(outcome, picture_of)
    return "\n".join(lines)


def section(outcome: Outcome, picture_of: Callable[[str], str]) -> list[str]:
    """Lines of one case."""
    case = outcome.case
    lines = [f"### {outcome.name} {case.title}", "", f"{case.source}. {outcome.wall:.1f} s.", ""]
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
