"""Arrays that are sorted by stretches: counting, sorting and finding within one, and room for more."""

from __future__ import annotations

import numpy as np

from beltsim.solver.jit import inner, inner_maker


@inner_maker
def starts_of(row, rows):
    """Where each of `rows` rows begins (rows + 1,) int64 if entries are sorted by `row`."""
    start = np.zeros(rows + 1, np.int64)
    for n in range(row.size):
        start[row[n] + 1] += 1
    for r in range(rows):
        start[r + 1] += start[r]
    return start


@inner
def sort_stretch(value, partner, begin, end):
    """Sort value[begin:end] and its partners by insertion over shrinking gaps: one look at what is sorted already."""
    gap = 1
    while 9 * gap < end - begin:
        gap = 3 * gap + 1
    while gap > 0:
        for n in range(begin + gap, end):
            moved, with_it, place = value[n], partner[n], n
            while place >= begin + gap and value[place - gap] > moved:
                value[place], partner[place] = value[place - gap], partner[place - gap]
                place -= gap
            value[place], partner[place] = moved, with_it
        gap //= 3


@inner
def first_from(values, begin, end, least):
    """Place of the first of the ascending values[begin:end] that is not below `least`; `end` if all are."""
    while begin < end:
        middle = (begin + end) >> 1
        if values[middle] < least:
            begin = middle + 1
        else:
            end = middle
    return begin


@inner
def place_of(values, wanted, begin, end):
    """Where `wanted` stands in the ascending values[begin:end], -1 if nowhere."""
    place = first_from(values, begin, end, wanted)
    return place if place < end and values[place] == wanted else -1


@inner_maker
def with_room(values, wanted):
    """The array itself, or one twice as long as wanted if it is shorter than that.

    A loop: assigning to a slice took two more seconds to compile.
    """
    if wanted <= values.size:
        return values
    larger = np.empty(2 * wanted, values.dtype)
    for n in range(values.size):
        larger[n] = values[n]
    return larger
