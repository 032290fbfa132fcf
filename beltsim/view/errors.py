"""What can be wrong with a wish for a picture."""

from __future__ import annotations

from beltsim.console import ExitCode, UsageProblem


class ViewProblem(UsageProblem):
    """The options or data of a picture make no picture (exit code 2)."""


class NothingToDraw(ViewProblem):
    """The scenery is empty (exit code 3): the file holds nothing that can be seen, or all of it is hidden."""

    exit_code = ExitCode.INVALID_INPUT


def needs_extra(error: ImportError) -> ViewProblem:
    """The message for an import that failed because the optional packages are not installed."""
    return ViewProblem(f"{error.name}: not installed; pictures need it: pip install 'beltsim[view]'")
