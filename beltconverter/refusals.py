"""The two ways a file is turned down, each with its cause, its place and what to do about it."""

from __future__ import annotations

import numpy as np

from beltsim.console import CommandError, ExitCode

SHOWN = 20  # problems of one file that are told


class UnreadableMesh(CommandError):
    """The bytes are not a whole mesh file (exit code 3)."""

    exit_code = ExitCode.INVALID_INPUT

    def __init__(self, name: str, found: str, expected: str, line: int | None = None):
        where = name if line is None else f"{name}:{line}"
        super().__init__(f"{where}: {found}, expected {expected}")
        self.line = line or 0


class UnreadableMeshes(UnreadableMesh):
    """All that is wrong with the bytes of one file, in the order of its lines."""

    def __init__(self, problems: list[UnreadableMesh]):
        shown = [str(problem) for problem in sorted(problems, key=lambda problem: problem.line)]
        more = [f"and {len(shown) - SHOWN} problems more"] if len(shown) > SHOWN else []
        Exception.__init__(self, "\n".join(shown[:SHOWN] + more))


class NotABelt(CommandError):
    """The mesh was read, but it is no proven grid of a belt (exit code 4).

    `cause` is one word for programs ("hole", "solid", "notch", ...), `found` and `remedy` are for people;
    `place` is a point (3,) in the file's own unit, so that it can be looked up in the CAD system.
    """

    exit_code = ExitCode.NOT_CONVERTIBLE

    def __init__(self, cause: str, found: str, remedy: str, place: np.ndarray | None = None):
        super().__init__(cause, found, remedy)
        self.cause, self.found, self.remedy, self.place = cause, found, remedy, place
        self.name = ""

    def __str__(self) -> str:
        prefix = f"{self.name}: " if self.name else ""
        place = "" if self.place is None else " near ({:.6g}, {:.6g}, {:.6g})".format(*self.place)
        return f"{prefix}no belt was written: {self.cause}: {self.found}{place}; {self.remedy}"
