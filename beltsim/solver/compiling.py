"""How numba is made to compile no more than it must; `jit.py` has the decorators that use this.

Half of all compile time went into functions that are only ever inlined, which numba also optimises and translates by
themselves, and a quarter into counting references to arrays that only callers own.
"""

from __future__ import annotations

import llvmlite.binding
from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder, Flags
from numba.core.compiler_machinery import AnalysisPass, register_pass
from numba.core.typed_passes import NopythonTypeInference

from beltsim.solver.standing import symbol_of


class Code(JITCodeLibrary):
    """Machine code that is loaded once the passes that it calls are: LLVM ends the process for a name it lacks."""

    minds_needs = True

    def _finalize_final_module(self):
        for need in self._reload_init:
            need()
        super()._finalize_final_module()


class StandingCode(Code):
    """A pass under its name, of which callers get nothing else."""

    def __init__(self, codegen, name, symbol):
        super().__init__(codegen, name)
        self.symbol = symbol
        self._shared_module = llvmlite.binding.parse_assembly(str(codegen._create_empty_module(name)))

    def add_ir_module(self, ir_module):
        """Add the code of the one function that is seen from outside, under its name."""
        (function,) = (f for f in ir_module.functions if not f.is_declaration and not f.linkage)
        function.name = self.symbol
        super().add_ir_module(ir_module)


class Ingredient(JITCodeLibrary):
    """Code of a function that only kernels call: LLVM optimises and translates it there, not by itself too."""

    minds_needs = True  # by those that it goes into

    def get_pointer_to_function(self, name):  # noqa: ARG002
        """No machine code, so no address."""
        return 0

    def _optimize_final_module(self):
        pass

    def _finalize_final_module(self):
        self._finalize_dynamic_globals()
        self._finalized = True

    @property
    def codegen(self):
        """What numba tells where the function's Python environment is, which nothing here has."""
        return self

    def set_env(self, name, environment):
        """Nothing to tell."""


TELLING = ("forceinline", "nrt", "no_cpython_wrapper", "no_cfunc_wrapper", "noalias")
"""The options by which functions here differ."""


def compare_flags_quickly() -> None:
    """Let numba find what it has compiled without reading all of some thirty options of both sides each time.

    Its hash is the same for all, and it compares all options, for 3 of 26 s of a conveyor's compilation. Equal flags
    have equal hashes still, and unequal ones now differ as a rule. A numba that is made otherwise keeps its own.
    """
    if not (isinstance(getattr(Flags(), "_values", None), dict) and set(TELLING) <= set(Flags.options)):
        return
    telling = [(name, Flags.options[name].default) for name in TELLING]
    equal = Flags.__eq__

    def quick_hash(self) -> int:
        given = self._values
        return hash(tuple([given.get(name, default) for name, default in telling]))

    def quickly_equal(self, other) -> bool:
        return (type(self) is type(other) and self._values == other._values) or equal(self, other)

    Flags.__hash__, Flags.__eq__ = quick_hash, quickly_equal


compare_flags_quickly()


@register_pass(mutates_CFG=False, analysis_only=True)
class CheckLoans(AnalysisPass):
    """No array passes between functions that count references and functions that do not, but as an argument.

    Who counts would give back a borrowed view that nobody counted, and its memory would be freed under its owner; who
    does not would never give back a new array.
    """

    _name = "check_loans"

    def __init__(self):
        """Nothing to set up; numba wants it said."""

    def run_pass(self, state):
        """Raise TypeError for the first call that lends or loses an array."""
        counts = state.flags.nrt
        if not counts and not state.flags.no_cpython_wrapper and holds_array(state.return_type):
            raise TypeError(f"{state.func_id.func_name} counts no references and returns an array to Python")
        for expression, signature in state.calltypes.items():
            if getattr(expression, "op", None) != "call" or not holds_array(signature.return_type):
                continue
            called = state.typemap[expression.func.name]
            if isinstance(called, types.Dispatcher) and counts != counting(called.dispatcher):
                names = state.func_id.func_name, called.dispatcher.py_func.__name__
                raise TypeError("of {} and {} one counts references and one does not".format(*names))
        return False


def counting(dispatcher) -> bool:
    """Whether a function counts references to arrays."""
    return dispatcher.targetoptions.get("_nrt", True)


def holds_array(found) -> bool:
    """Whether a type is an array or a tuple with one."""
    if isinstance(found, types.BaseTuple):
        return any(map(holds_array, found))
    return isinstance(found, types.Array)


class Loaded(CompilerBase):
    """numba's usual compiler, for what calls passes."""

    new_library = Code

    def define_pipelines(self):
        """The default pipeline into `Code`."""
        self.state.library = self.new_library(
            self.state.targetctx.codegen(), self.state.func_id.func_qualname
        )
        self.state.library.enable_object_caching()
        return [DefaultPassBuilder.define_nopython_pipeline(self.state)]


class Checked(Loaded):
    """The same with the check of loans."""

    def define_pipelines(self):
        """The same pipeline with the check after type inference."""
        (passes,) = super().define_pipelines()
        passes.add_pass_after(CheckLoans, NopythonTypeInference)
        passes.finalize()
        return [passes]


class StandsAlone(Checked):
    """The same for passes that are called by name."""

    def new_library(self, codegen, name):
        """`StandingCode`."""
        return StandingCode(codegen, name, symbol_of(self.state.func_id.func, self.state.args))


class Inlined(Checked):
    """The same for what only kernels call."""

    new_library = Ingredient


class NoAlias(Inlined):
    """The same, with the promise that array arguments do not overlap.

    Without it LLVM gives up on checking some thirty arrays at run time and the loop stays scalar (7 ns against 50 ns a
    bond). The caller must really pass disjoint arrays; reading the same array at two places is fine.
    """

    def define_pipelines(self):
        """The default pipeline with noalias set."""
        self.state.flags.noalias = True
        return super().define_pipelines()
