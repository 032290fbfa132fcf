"""SIGINT and SIGTERM: between batches of steps they are asked for, while kernels compile they end the run at once."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from beltsim.console import CommandError, ExitCode

LATER = 0.02  # s until a signal that came at a bad moment comes again


class Stopped(CommandError):
    """The run was asked to end before its time; what was written is whole."""

    def __init__(self, message: str, exit_code: ExitCode):
        super().__init__(message)
        self.exit_code = exit_code


class AtOnce(BaseException):
    """Thrown by a signal. No `Exception`: the compiler of kernels catches those."""


class Stop:
    """What a run asks between two batches: the exit code with which it is to end, or None."""

    def __init__(self, *, at_once: bool = True):
        self.code: ExitCode | None = None
        self.at_once = at_once

    def __call__(self) -> ExitCode | None:
        """The exit code to end with."""
        return self.code

    @contextmanager
    def mode(self, *, at_once: bool) -> Iterator[None]:
        """A stretch of the run in which signals end it at once, or wait until they are asked for."""
        before, self.at_once = self.at_once, at_once
        try:
            if at_once and self.code is not None:
                raise AtOnce
            yield
        finally:
            self.at_once = before

    def catch(self, number: int, frame) -> None:
        """Take a signal; a second SIGINT stops at once, whatever the run does."""
        if self.at_once and in_callback(frame):
            threading.Timer(LATER, os.kill, (os.getpid(), number)).start()
            return
        if number == signal.SIGINT and self.code is not None:
            raise KeyboardInterrupt
        self.code = ExitCode.INTERRUPTED if number == signal.SIGINT else ExitCode.TERMINATED
        if self.at_once:
            raise AtOnce


def in_callback(frame) -> bool:
    """Whether LLVM has called back for a compiled module: what is thrown there is printed and lost."""
    while frame is not None:
        if frame.f_code.co_filename.endswith("executionengine.py"):
            return True
        frame = frame.f_back
    return False


@contextmanager
def signals() -> Iterator[Stop]:
    """Let SIGINT and SIGTERM end a run with its exit code, in good order.

    Raises
    ------
    Stopped
        If one came while nothing could be lost.
    """
    stop = Stop()
    before = {number: signal.signal(number, stop.catch) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    except AtOnce:
        raise Stopped("stopped while preparing, between two frames", stop.code) from None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
