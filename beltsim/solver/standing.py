"""Passes that stand alone: who calls one holds its name, not its code, and the machine code is found when it is loaded.

Else LLVM optimises the code of each pass once more in every kernel that calls it (3 of 26 s for a conveyor), and no
kernel can be begun before all its passes are done. The name is the same in every process, and a kernel in the cache
keeps beside it which passes it needs: they are loaded, or compiled, before it is.
"""

from __future__ import annotations

import hashlib
import importlib
from collections.abc import Callable
from typing import NamedTuple

from numba.core import types
from numba.core.funcdesc import ExternalFunctionDescriptor
from numba.core.typing.templates import AbstractTemplate
from numba.extending import lower_builtin

awaited: list[Callable[[], None]] = []
"""Called before a kernel is loaded that needs passes: who has another process compile them waits here."""


class Need(NamedTuple):
    """A pass for arguments of some types, as a kernel in the cache keeps it."""

    module: str
    name: str
    arguments: tuple

    def __call__(self) -> None:
        """Have its machine code there."""
        while awaited:
            awaited.pop()()
        getattr(importlib.import_module(self.module), self.name).ready(self.arguments)


def symbol_of(function: Callable, arguments: tuple) -> str:
    """The name of the machine code of a pass for arguments of some types: the same in every process."""
    digest = hashlib.sha256("\n".join(map(str, arguments)).encode()).hexdigest()[:24]
    return f"{function.__module__}.{function.__qualname__}.{digest}"


def by_name(owner) -> types.Function:
    """The type of a pass for numba: a function whose result is known, and which is called by its name.

    `owner` has the Python function, what it `returns`, and `ready(types)`, which has it compiled.
    """
    if "<locals>" in owner.function.__qualname__:
        raise TypeError(f"{owner.function.__qualname__} cannot be found from another process")

    class Called(AbstractTemplate):
        key = owner

        def generic(self, arguments, words):
            if words:
                raise TypeError("passes take their arguments in order")
            return owner.returns(*map(types.unliteral, arguments))

    lower_builtin(owner, types.VarArg(types.Any))(
        lambda context, builder, signature, arguments: context.call_internal(
            builder, declared(context, owner.function, signature), signature, arguments
        )
    )
    return types.Function(Called)


def declared(context, function: Callable, signature) -> ExternalFunctionDescriptor:
    """What numba must know to call a pass that is compiled elsewhere; the code that calls it notes the need."""
    library = context.active_code_library
    if not getattr(library, "minds_needs", False):
        raise TypeError(f"{function.__name__} is called by {library.name}, which would not have it loaded")
    library._reload_init.add(Need(function.__module__, function.__name__, signature.args))
    return ExternalFunctionDescriptor(
        symbol_of(function, signature.args), signature.return_type, signature.args
    )
