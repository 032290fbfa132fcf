"""What the three commands share: exit codes, messages, outputs that are whole or absent, JSON summaries.

Imports nothing heavy, since every command imports it before it knows what it will do.
"""

from __future__ import annotations

import functools
import hashlib
import os
import re
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from enum import IntEnum
from pathlib import Path
from typing import BinaryIO

import click


class ExitCode(IntEnum):
    """Exit codes of all commands; the table is in docs/cli.md."""

    OK = 0
    INTERNAL = 1
    USAGE = 2
    INVALID_INPUT = 3
    NOT_CONVERTIBLE = 4
    BLOW_UP = 5
    LIMIT_FAILED = 6
    RESUMABLE = 75
    INTERRUPTED = 130
    TERMINATED = 143


class CommandError(Exception):
    """An error that a person can act on: printed as it is, without a traceback.

    Libraries raise subclasses of it; `text` may hold several lines, one problem each.
    """

    exit_code: ExitCode = ExitCode.INVALID_INPUT


class Ending(BaseException):
    """An end that nothing on its way may catch but `guarded`; no `Exception`: the compiler of kernels catches those."""

    def __init__(self, message: str, exit_code: ExitCode):
        super().__init__(message)
        self.exit_code = exit_code


class UsageProblem(CommandError):
    """The options or file names are off (exit code 2)."""

    exit_code = ExitCode.USAGE


def say(message: str, *, quiet: bool = False) -> None:
    """Write one message to stderr; stdout is kept for the product."""
    if not quiet:
        click.echo(message, err=True)


def guarded(command: Callable) -> Callable:
    """Decorate a click command: known errors become one message and their exit code."""

    @functools.wraps(command)
    def wrapper(*args, **kwargs):
        try:
            return command(*args, **kwargs)
        except (CommandError, Ending) as error:
            say(str(error))
            raise SystemExit(int(error.exit_code)) from None
        except BrokenPipeError:
            # The reader of our pipe has gone, as `| head` does. Python would complain again while it flushes.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise SystemExit(int(ExitCode.OK)) from None
        except (OSError, UnicodeDecodeError) as error:
            say(f"{_file_of(error)}{error.strerror if isinstance(error, OSError) else error}")
            raise SystemExit(int(ExitCode.INVALID_INPUT)) from None
        except KeyboardInterrupt:
            say("interrupted")
            raise SystemExit(int(ExitCode.INTERRUPTED)) from None

    return wrapper


def _file_of(error: Exception) -> str:
    name = getattr(error, "filename", None)
    return f"{name}: " if name else ""


class Quantity(click.ParamType):
    """A number with an optional unit, as `133mm` or `2.5 m/s`; without one SI."""

    def __init__(self, dimension: str, *, signed: bool = False, zero: bool = False):
        self.dimension, self.signed, self.zero = dimension, signed, zero
        self.name = dimension

    def convert(self, value, param, ctx):
        """SI float of the text."""
        if isinstance(value, float):
            return value
        from beltsim.inp.units import UNITS, to_si

        units = UNITS[self.dimension]
        match = re.fullmatch(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)\s*(.*)", value.strip())
        if not match:
            self.fail(f"'{value}' is not a number with a unit such as 1.5 {next(iter(units))}", param, ctx)
        if match[2] and match[2] not in units:
            self.fail(f"unit '{match[2]}' in '{value}', expected one of {', '.join(units)}", param, ctx)
        si = to_si(match[1], units[match[2]] if match[2] else next(iter(units.values())))
        if not abs(si) < 1e300 or (si < 0 and not self.signed) or (si == 0 and not self.zero):
            self.fail(f"'{value}' is out of range", param, ctx)
        return si


def refuse_existing(path: str | Path | None, *, overwrite: bool, inputs: Iterable[str | Path] = ()) -> None:
    """Raise `UsageProblem` if `path` cannot be written: no folder or no right, one of `inputs`, or there already."""
    if path is None or str(path) == "-":
        return
    target = Path(path)
    if not target.parent.is_dir():
        raise UsageProblem(f"{path}: the folder {target.parent} does not exist")
    if target.is_dir():
        raise UsageProblem(f"{path}: found a folder, expected the name of a file to write")
    if not os.access(target.parent, os.W_OK):
        raise UsageProblem(f"{path}: the folder {target.parent} may not be written to")
    if not target.exists():
        return
    for name in inputs:
        if Path(name).exists() and target.samefile(name):
            raise UsageProblem(f"{path}: the output would replace the input {name}")
    if not overwrite:
        raise UsageProblem(f"{path}: the file exists; --overwrite replaces it")


@contextmanager
def output_file(path: str | Path | None, *, overwrite: bool = False) -> Iterator[BinaryIO]:
    """Binary stream to `path`, which appears whole or not at all; None or "-" is stdout.

    The text goes to a temporary file in the same folder, renamed when the block ends without an error.
    """
    if path is None or str(path) == "-":
        yield sys.stdout.buffer
        sys.stdout.buffer.flush()
        return
    refuse_existing(path, overwrite=overwrite)
    target = Path(path)
    handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    try:
        with os.fdopen(handle, "wb") as stream:
            yield stream
        umask = os.umask(0)
        os.umask(umask)
        Path(name).chmod(0o666 & ~umask)  # mkstemp makes private files; an output has the user's usual rights
        Path(name).replace(target)
    except BaseException:
        with suppress(FileNotFoundError):
            Path(name).unlink()
        raise


def read_input(path: str) -> bytes:
    """All bytes of a file, or of stdin for "-"."""
    return sys.stdin.buffer.read() if path == "-" else Path(path).read_bytes()


def sha256_of(path: str | Path) -> str:
    """Hexadecimal sha256 of a file."""
    with Path(path).open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def summary(
    status: str,
    *,
    counts: dict | None = None,
    warnings: list[str] | None = None,
    timings: dict | None = None,
    outputs: list[str | Path] = (),
    **more,
) -> str:
    """The `--json` object that every command prints, as text: one schema for all."""
    import orjson

    body = {
        "schema_version": 1,
        "status": status,
        "counts": counts or {},
        "warnings": list(warnings or []),
        "timings": timings or {},
        "outputs": [{"path": str(path), "sha256": sha256_of(path)} for path in outputs],
        **more,
    }
    return orjson.dumps(body, option=orjson.OPT_INDENT_2 | orjson.OPT_SERIALIZE_NUMPY).decode()
