"""SIGINT and SIGTERM: between batches of steps they are asked for, while kernels compile they end the run at once."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from beltsim.console import CommandError, Ending, ExitCode

PREPARING = "stopped while preparing, between two frames"
LATER = 0.02  # s until a signal whose exception was lost comes again


class Stopped(CommandError):
    """The run was asked to end before its time; what was written is whole."""

    def __init__(self, message: str, exit_code: ExitCode):
        super().__init__(message)
        self.exit_code = exit_code


class AtOnce(Ending):
    """Thrown by a signal, wherever that comes."""

    def __init__(self, exit_code: ExitCode):
        super().__init__(PREPARING, exit_code)


class Stop:
    """What a run asks between two batches: the exit code with which it is to end, or None."""

    def __init__(self, *, at_once: bool = True):
        self.code: ExitCode | None = None
        self.at_once = at_once
        self.again: threading.Timer | None = None  # from when an exception was lost until it is thrown again

    def __call__(self) -> ExitCode | None:
        """The exit code to end with."""
        return self.code

    @contextmanager
    def mode(self, *, at_once: bool) -> Iterator[None]:
        """A stretch of the run in which signals end it at once, or wait until they are asked for."""
        before, self.at_once = self.at_once, at_once
        try:
            if at_once and self.code is not None:
                raise AtOnce(self.code)
            yield
        finally:
            self.at_once = before

    def catch(self, number: int, frame) -> None:  # noqa: ARG002 - the signature is Python's
        """Take a signal; a second SIGINT stops at once, whatever the run does."""
        resent, self.again = self.again is not None, None
        if number == signal.SIGINT and self.code is not None and not resent:
            raise KeyboardInterrupt
        self.code = ExitCode.INTERRUPTED if number == signal.SIGINT else ExitCode.TERMINATED
        if self.at_once:
            raise AtOnce(self.code)

    def throw_again(self, lost) -> None:
        """Python's hook for what is thrown in finalizers and in callbacks of LLVM: it goes no further than there.

        Once a signal has come, nothing else is said of what is lost.
        """
        if isinstance(lost.exc_value, AtOnce):
            number = signal.SIGINT if self.code == ExitCode.INTERRUPTED else signal.SIGTERM
            self.again = threading.Timer(LATER, os.kill, (os.getpid(), number))
            self.again.start()
        elif self.code is None:
            sys.__unraisablehook__(lost)


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
    hook, sys.unraisablehook = sys.unraisablehook, stop.throw_again
    try:
        yield stop
    except CommandError:
        raise
    except (AtOnce, Exception) as error:
        # A compiler whose callback was cut short by a signal fails in ways of its own.
        if isinstance(error, AtOnce) or stop.again is not None:
            # What it has half built complains when it is taken away, if only as Python ends.
            hook = stop.throw_again
            raise Stopped(PREPARING, stop.code) from None
        raise
    finally:
        if stop.again is not None:
            stop.again.cancel()
        sys.unraisablehook = hook
        for number, handler in before.items():
            signal.signal(number, handler)
