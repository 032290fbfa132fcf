"""Calls of a pass shared out among threads: what `prange` does, without compiling the pass in another form for it.

numba would compile each loop over chunks as a function of its own with the body of the pass in it, and once more what
hands it out: 8 of 36 s for a conveyor. Here threads call the pass by its name; numba only lends them.
"""

from __future__ import annotations

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.errors import TypingError
from numba.extending import intrinsic
from numba.np.ufunc.parallel import _launch_threads

from beltsim.solver.standing import declared

INT, BYTES = ir.IntType(64), ir.IntType(8).as_pointer()
WORK = ir.FunctionType(ir.VoidType(), [BYTES.as_pointer(), INT.as_pointer(), INT.as_pointer(), BYTES])
"""What numba's threads call: with the addresses, lengths and strides of arrays, and anything else."""

BEGIN, STRIDE, COUNT, TEAM, CODE, REASON, TOTALS = range(7)
"""What the threads are told first and leave, the error of one of them too; then the sums, then the arguments."""


@intrinsic
def share(context, called, begin, stop, stride, team, arguments):  # noqa: ARG001 - whole numbers all
    """`called(n, *arguments)` for n in range(begin, stop, stride) by a team of threads; the sums of what it returns.

    The numbers are cut into `team` stretches, one for each thread. What is returned is whole numbers: their sums have
    no order.
    """
    if not isinstance(called, types.Function) or not isinstance(arguments, types.BaseTuple):
        raise TypingError("threads share a pass, with a tuple of its arguments")
    taken = called.get_call_type(context, (types.int64, *arguments.types), {})
    if any(each != types.int64 for each in numbers_in(taken.return_type)):
        raise TypingError(f"no sums of {taken.return_type}")
    signature = taken.return_type(called, *[types.int64] * 4, arguments)

    def emit(context, builder, _, values):
        return shared(context, builder, called.typing_key.function, taken, *values[1:])

    return signature, emit


def numbers_in(returned) -> tuple:
    """The types of the numbers that a pass returns."""
    if isinstance(returned, types.NoneType):
        return ()
    return returned.types if isinstance(returned, types.BaseTuple) else (returned,)


def shared(context, builder, function, signature, begin, stop, stride, team, arguments):
    """Have the threads work, pass on their error if any, and return the sums."""
    module, sums = builder.module, range(TOTALS, TOTALS + len(numbers_in(signature.return_type)))
    packer = context.get_arg_packer(signature.args[1:])
    flat = packer.as_arguments(builder, cgutils.unpack_tuple(builder, arguments))
    reason = context.call_conv._get_excinfo_argument(builder.function).type.pointee
    kinds = [INT, INT, INT, INT, ir.IntType(32), reason, *(INT for _ in sums), *(each.type for each in flat)]
    told = cgutils.alloca_once(builder, ir.LiteralStructType(kinds))
    count = builder.sdiv(builder.add(builder.sub(stop, begin), builder.sub(stride, INT(1))), stride)
    values = [begin, stride, count, team, ir.IntType(32)(0), reason(None), *(INT(0) for _ in sums), *flat]
    for place, value in enumerate(values):
        builder.store(value, field(builder, told, place))

    library = context.active_code_library
    library._reload_init.add(_launch_threads)
    work = worker(context, module, declared(context, function, signature), signature, told.type, packer)
    # One array of bytes at address 0: the address of byte r, which the thread for stretch r gets, is the number r.
    array, length, step = (cgutils.alloca_once(builder, kind) for kind in (BYTES, INT, INT))
    for value, place in ((BYTES(None), array), (team, length), (INT(1), step)):
        builder.store(value, place)
    threads = cgutils.get_or_insert_function(module, ir.FunctionType(ir.IntType(32), []), "get_num_threads")
    start_type = ir.FunctionType(ir.VoidType(), [*[BYTES] * 5, *[INT] * 3])
    start = cgutils.get_or_insert_function(module, start_type, "numba_parallel_for")
    places = [builder.bitcast(each, BYTES) for each in (work, array, length, step, told)]
    builder.call(start, [*places, INT(0), INT(1), builder.zext(builder.call(threads, []), INT)])

    found = [builder.load(field(builder, told, place)) for place in (CODE, REASON)]
    status = context.call_conv._get_return_status(builder, *found)
    with cgutils.if_unlikely(builder, status.is_error):
        context.call_conv.return_status_propagate(builder, status)
    totals = [builder.load(field(builder, told, place)) for place in sums]
    if isinstance(signature.return_type, types.BaseTuple):
        return context.make_tuple(builder, signature.return_type, totals)
    return totals[0] if totals else context.get_dummy_value()


def field(builder, struct, place: int):
    """The address of a field of a struct."""
    return cgutils.gep_inbounds(builder, struct, 0, place)


def worker(context, module, pass_, signature, told, packer):
    """What threads do: their stretches of the numbers, one call after the other.

    Numbers are cut into as many stretches as there are threads, and one thread may be given several at a time.
    """
    work = ir.Function(module, WORK, module.get_unique_name("share"))
    work.linkage = "internal"
    builder = ir.IRBuilder(work.append_basic_block())
    struct = builder.bitcast(work.args[3], told)
    rank, stretches = builder.ptrtoint(builder.load(work.args[0]), INT), builder.load(work.args[1])
    values = [builder.load(field(builder, struct, place)) for place in range(len(told.pointee.elements))]
    numbers = numbers_in(signature.return_type)
    arguments = packer.from_arguments(builder, values[TOTALS + len(numbers) :])
    sums = [cgutils.alloca_once_value(builder, INT(0)) for _ in numbers]
    first, last = (
        builder.sdiv(builder.mul(values[COUNT], each), values[TEAM])
        for each in (rank, builder.add(rank, stretches))
    )
    with cgutils.for_range_slice(builder, first, last, INT(1)) as (n, _):
        n = builder.add(values[BEGIN], builder.mul(n, values[STRIDE]))
        status, result = context.call_internal_no_propagate(builder, pass_, signature, [n, *arguments])
        with cgutils.if_unlikely(builder, status.is_error):
            builder.store(status.code, field(builder, struct, CODE))
            builder.store(status.excinfoptr, field(builder, struct, REASON))
            builder.ret_void()
        results = (result,)
        if isinstance(signature.return_type, types.BaseTuple):
            results = cgutils.unpack_tuple(builder, result)
        for total, each in zip(sums, results, strict=False):
            builder.store(builder.add(builder.load(total), each), total)
    for place, total in enumerate(sums):
        builder.atomic_rmw("add", field(builder, struct, TOTALS + place), builder.load(total), "monotonic")
    builder.ret_void()
    return work
