"""Scratch space of passes, on the stack: nothing to allocate, to count or to free, and aligned to cache lines."""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.core.typing import signature
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array
from numba.np.numpy_support import as_dtype

from beltsim.solver.jit import inner
from beltsim.solver.state import CACHE_LINE


def on_stack(context, builder, array_type, shape):
    """An array of a fixed shape in the stack of the function, not initialised."""
    item = context.get_data_type(array_type.dtype)
    with builder.goto_entry_block():
        place = builder.alloca(item, size=ir.Constant(ir.IntType(64), int(np.prod(shape))))
    place.align = CACHE_LINE
    size = as_dtype(array_type.dtype).itemsize
    strides = [size * int(np.prod(shape[k + 1 :])) for k in range(len(shape))]
    word = context.get_value_type(types.intp)
    array = make_array(array_type)(context, builder)
    populate_array(
        array,
        data=builder.bitcast(place, array.data.type),
        shape=[word(n) for n in shape],
        strides=[word(n) for n in strides],
        itemsize=word(size),
        meminfo=None,
    )
    return array._getvalue()


@intrinsic(prefer_literal=True)
def scratch_row(_typing_context, size, dtype):
    """(size,) array of a dtype, not initialised; `size` is a constant. Gone when the function returns."""
    made = types.Array(dtype.dtype, 1, "C")

    def emit(context, builder, *_):
        return on_stack(context, builder, made, (size.literal_value,))

    return signature(made, size, dtype), emit


@intrinsic(prefer_literal=True)
def scratch_rows(_typing_context, rows, size):
    """(rows, size) array of doubles, not initialised; both are constants. Gone when the function returns."""
    made = types.Array(types.float64, 2, "C")

    def emit(context, builder, *_):
        return on_stack(context, builder, made, (rows.literal_value, size.literal_value))

    return signature(made, rows, size), emit


@inner
def clear(tile, numbers):
    """Zeros everywhere: the last columns that a law runs over may never have been written."""
    for row in range(tile.shape[0]):
        for n in range(tile.shape[1]):
            tile[row, n] = 0.0
    for n in range(numbers.size):
        numbers[n] = 0
