"""Where a trajectory comes from: versions, command line, inputs with their hashes, the expanded case."""

from __future__ import annotations

import platform
import sys
from importlib.metadata import PackageNotFoundError, version

from beltsim import __version__, inp
from beltsim.console import sha256_of
from beltsim.inp import Deck

PACKAGES = ("numpy", "numba", "h5py", "scipy")


def case_text(deck: Deck) -> bytes:
    """The expanded INP text: includes resolved, numbers in SI."""
    return inp.dumps(deck)


def provenance(deck: Deck, command: list[str]) -> dict:
    """What JSON can hold of a run's origin."""
    return {
        "beltsim": __version__,
        "python": platform.python_version(),
        "platform": sys.platform,
        "machine": platform.machine(),
        "packages": {name: installed(name) for name in PACKAGES},
        "command": command,
        "seeds": {block["NAME"]: block["SEED"] for block in deck.blocks("SOURCE")},
        "inputs": inputs_of(deck),
    }


def installed(package: str) -> str:
    """Version of a package, or "absent"."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "absent"


def inputs_of(deck: Deck) -> list[dict]:
    """Path and sha256 of every file that the deck was read from."""
    files = dict.fromkeys(block.where.file for block in deck.blocks())
    found = []
    for name in files:
        try:
            found.append({"path": str(name), "sha256": sha256_of(name)})
        except OSError:  # stdin and decks made in Python have no file
            found.append({"path": str(name)})
    return found
