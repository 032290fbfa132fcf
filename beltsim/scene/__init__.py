"""Deck -> arrays: everything a run needs, in SI units and 0-based indices. Refuses what the solver cannot run."""

from .build import Scene, build

__all__ = ["Scene", "build"]
