"""Calls of kernels from Python by several threads, for what no compiled loop shares out: the search for pairs."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache


@cache
def others(count: int) -> ThreadPoolExecutor:
    """Threads beside the one that asks."""
    return ThreadPoolExecutor(count, "beltsim")


def together(team: int | None, calls: list[Callable]) -> list:
    """What some calls return; `team` threads share them out, None: one. They must not use `together` themselves."""
    if team in (None, 1) or len(calls) < 2:
        return [call() for call in calls]
    waiting = [others(team - 1).submit(call) for call in calls[1:]]
    return [calls[0](), *(each.result() for each in waiting)]
