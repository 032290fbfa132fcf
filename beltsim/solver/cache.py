"""Where compiled kernels are kept: a folder for each state of the sources, never stale, safe for several processes.

numba stamps a cached kernel with the hash of its own file only, so an edit of a law in another file would silently run
the old machine code (measured: the old result came back). The folder is therefore named after everything that the
machine code depends on: all sources of the solver, numba, llvmlite and the CPU.

A process that uses a folder holds a shared lock on its mark. Folders of other sources are removed when they have not
been used for long or are too many, but never one that is locked. Nothing that goes wrong here stops a run.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import re
import shutil
import signal
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import llvmlite
import llvmlite.binding
import numba

try:
    import fcntl
except ImportError:  # Windows: no locks, so nothing is removed before its time
    fcntl = None

KEPT = 10
"""Folders of other sources that are kept, the last used: some 5 to 60 MB each."""

KEPT_TIME = 30 * 86400.0
"""s since the last use after which they are removed all the same."""

MARK = "in_use"

OURS = re.compile(r"[0-9a-f]{16}|\.[0-9a-f]{16}\.\d+")
"""Names of cache folders, and of those on their way out."""


def cache_folder() -> Path:
    """Folder of the compiled kernels of exactly these sources, numba, llvmlite and CPU."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return (Path(given) if given else home) / "beltsim-kernels" / state_of_sources()


def state_of_sources() -> str:
    """Hash of all that compiled kernels depend on."""
    cpu = numba.config.CPU_NAME or llvmlite.binding.get_host_cpu_name()
    digest = hashlib.sha256("\n".join((numba.__version__, llvmlite.__version__, cpu)).encode())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.name.encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


class Store:
    """The cache folder of this process, locked while it lives.

    Where the folder may not be written to, as in the image of a container or a home that is read only, it is a private
    copy that ends with the process, and `lasting` is False.
    """

    def __init__(self, folder: Path):
        self.lasting, self.lock = True, None
        try:
            self.lock = hold(folder)
            self.folder = folder
            prune(folder)
        except OSError:
            self.lasting = False
            self.folder = private_copy(folder)

    @contextmanager
    def alone(self) -> Iterator[None]:
        """One process at a time, and no signal on the way: an entry is whole.

        Two that save at once could take the same file name for different kernels.
        """
        with (self.folder / "saving").open("a") as file:
            if fcntl is None:
                yield
                return
            fcntl.flock(file, fcntl.LOCK_EX)
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
            try:
                yield
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def guard(self, dispatcher) -> None:
        """Let a kernel of numba save itself under the lock; one that cannot be saved, as on a full disk, is not.

        Files that are not what was saved, as after a crash of the machine, are forgotten: numba would stop at them.
        """
        cache = dispatcher._cache
        save, load = cache.save_overload, cache.load_overload

        def save_alone(signature, data) -> None:
            with suppress(OSError), self.alone():
                save(signature, data)

        def load_whole(signature, target):
            try:
                return load(signature, target)
            except Exception:  # unpickling raises almost any
                with suppress(OSError), self.alone():
                    cache.flush()
                return None

        cache.save_overload, cache.load_overload = save_alone, load_whole


def holds(dispatcher, signature) -> bool:
    """Whether a kernel of numba has been kept for a signature or types of arguments; also if nobody can say."""
    cache = dispatcher._cache
    try:
        return cache._index_key(signature, dispatcher.targetctx.codegen()) in cache._cache_file._load_index()
    except Exception:  # unpickling raises almost any
        return True


def hold(folder: Path) -> int:
    """Make a folder if need be, note its use, and lock it against removal until the process ends; returns the lock."""
    while True:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()  # may we write?
        mark = os.open(folder / MARK, os.O_WRONLY | os.O_CREAT, 0o666)
        os.utime(folder / MARK)
        if fcntl is None:
            return mark
        with suppress(OSError):  # a file system without locks
            fcntl.flock(mark, fcntl.LOCK_SH)
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(mark), (folder / MARK).stat()):
                return mark
        os.close(mark)  # removed by another process in between: make it again


def private_copy(folder: Path) -> Path:
    """A copy of what is in a folder, if anything, for this process alone."""
    place = Path(tempfile.mkdtemp(prefix="beltsim-kernels-"))
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    with suppress(OSError, shutil.Error):
        shutil.copytree(folder, place, dirs_exist_ok=True)
    for inside in (place, *place.glob("*/")):
        inside.chmod(0o700)  # the original may be read only
    return place


def prune(folder: Path) -> None:
    """Remove the folders beside the one in use that nobody has used for long, and the oldest if they are many."""
    with suppress(OSError):
        others = [
            place for place in folder.parent.iterdir() if place != folder and OURS.fullmatch(place.name)
        ]
        others.sort(key=last_use, reverse=True)
        for rank, place in enumerate(others):
            if rank >= KEPT or time.time() - last_use(place) > KEPT_TIME:
                remove(place)


def last_use(folder: Path) -> float:
    """When a folder was last used, as a time stamp [s]."""
    mark = folder / MARK
    with suppress(OSError):
        return (mark if mark.exists() else folder).stat().st_mtime
    return 0.0


def remove(folder: Path) -> None:
    """Remove a folder unless a process uses it: first out of the way in one move, so that nobody sees half of it.

    Without a lock on its mark we cannot know, so it goes by age alone.
    """
    with suppress(OSError):
        mark = folder / MARK
        if fcntl is None or not mark.exists():
            if time.time() - last_use(folder) > KEPT_TIME:
                shutil.rmtree(folder, ignore_errors=True)
            return
        with mark.open("a") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            aside = folder.with_name(f".{folder.name.strip('.')[:16]}.{os.getpid()}")
            folder.rename(aside)
        shutil.rmtree(aside, ignore_errors=True)
