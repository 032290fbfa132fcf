"""Live progress on stderr: a bar on a terminal, elsewhere a plain line per 10 % or 60 s."""

from __future__ import annotations

import math
import os
import sys
import time

from beltsim.console import say
from beltsim.run import Progress

LINE_SHARE = 0.1  # of the run between two plain lines
LINE_PAUSE = 60.0  # s between two plain lines
LEAST_PAUSE = 1.0  # s; a run of a moment needs no line


def sentence(progress: Progress) -> str:
    """One line of progress, as `t=0.40/2.00 s  20%  1.2e6 particle-steps/s  ETA 3 min  max|v|=3.1 m/s`."""
    share = progress.time / progress.end if progress.end else 1.0
    speed = progress.particle_steps / progress.wall if progress.wall else 0.0
    remaining = progress.wall * (1.0 / share - 1.0) if share > 0.0 else 0.0
    drift = "" if progress.energy_drift is None else f"  energy drift {progress.energy_drift:.1g}"
    digits = decimals(progress.end)
    return (
        f"t={progress.time:.{digits}f}/{progress.end:.{digits}f} s  {100.0 * share:.0f}%  "
        f"{progress.particles} particles  {speed:.2g} particle-steps/s  ETA {duration(remaining)}  "
        f"max|v|={progress.fastest:.2g} m/s{drift}"
    )


def decimals(end: float) -> int:
    """Digits behind the point of a time up to `end` [s]: two, or as many as show its hundredth part."""
    return 2 if end <= 0.0 else max(2, 2 - math.floor(math.log10(end)))


def duration(seconds: float) -> str:
    """A time to wait, rounded as people say it."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


class PlainLines:
    """A line per tenth of the run, or per minute."""

    def __init__(self):
        self.share, self.clock = 0.0, time.monotonic()

    def __call__(self, progress: Progress) -> None:
        """Print a line if one is due."""
        share = progress.time / progress.end if progress.end else 1.0
        now = time.monotonic()
        waited = now - self.clock
        if waited >= LINE_PAUSE or (share - self.share >= LINE_SHARE - 1e-9 and waited >= LEAST_PAUSE):
            self.share, self.clock = share, now
            say(sentence(progress))

    def close(self) -> None:
        """Nothing is left open."""


class Bar:
    """A bar that is redrawn in place."""

    def __init__(self):
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as RichProgress

        self.bar = RichProgress(
            BarColumn(), TextColumn("{task.description}"), console=Console(stderr=True), refresh_per_second=4
        )
        self.task = self.bar.add_task("", total=1.0)
        self.bar.start()

    def __call__(self, progress: Progress) -> None:
        """Redraw."""
        share = progress.time / progress.end if progress.end else 1.0
        self.bar.update(self.task, completed=share, description=sentence(progress))

    def close(self) -> None:
        """Leave the last state on the screen."""
        self.bar.stop()


class Silence:
    """Nothing, for -q."""

    def __call__(self, progress: Progress) -> None:
        """Say nothing."""

    def close(self) -> None:
        """Nothing is left open."""


def reporter(*, quiet: bool) -> PlainLines | Bar | Silence:
    """What suits the terminal; TERM=dumb and pipes get plain lines, NO_COLOR is honoured by the bar."""
    if quiet:
        return Silence()
    if sys.stderr.isatty() and os.environ.get("TERM") != "dumb":
        return Bar()
    return PlainLines()
