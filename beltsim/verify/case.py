"""What a verification case is: a name, where its target comes from, and rows of target against result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Row:
    """One number of a case: what theory or a publication says, and what the solver gave."""

    label: str
    unit: str
    target: float
    result: float
    tolerance: float  # relative to the target, or in its unit if `absolute`
    absolute: bool = False

    @property
    def error(self) -> float:
        """Deviation from the target, relative or in its unit as the tolerance is."""
        deviation = abs(self.result - self.target)
        return float(deviation if self.absolute else deviation / abs(self.target))

    @property
    def passed(self) -> bool:
        """Whether the error is within the tolerance; never for NaN."""
        return bool(self.error <= self.tolerance)


@dataclass(frozen=True)
class Series:
    """One curve of a plot: a line of the theory or publication, or the solver's points."""

    label: str
    x: np.ndarray
    y: np.ndarray
    points: bool = False


@dataclass(frozen=True)
class Plot:
    """A picture of a case; `name` is its file name without suffix."""

    name: str
    title: str
    x_label: str
    y_label: str
    series: list[Series]


@dataclass(frozen=True)
class Findings:
    """What a case found."""

    rows: list[Row]
    plots: list[Plot] = field(default_factory=list)


@dataclass(frozen=True)
class Case:
    """A case of the book; `quick` ones take a second or two and run in the tests."""

    title: str
    source: str
    find: Callable[[], Findings]
    quick: bool = True
    note: str = ""  # said under the table: the variant that was run, or why a row fails
