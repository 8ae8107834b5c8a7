"""Numba's compiler for kernels that other kernels call: their code is linked into the callers', and optimised there.

Numba makes a library of every function: with all that it calls it is optimised, translated to machine code, and
optimised again in whatever calls it. Of a kernel that kernels alone call, the bitcode is all that is needed.
"""

from __future__ import annotations

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


class LinkedCompiler(Compiler):
    """Numba's pipeline, with a library that is neither optimised as a whole nor translated."""

    def define_pipelines(self) -> Any:  # noqa: ANN401 - numba has no types
        """As numba's own; the library is made here, where its name is known."""
        self.state.library = _LinkedLibrary(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        return super().define_pipelines()


class _LinkedLibrary(JITCodeLibrary):
    @property
    def codegen(self) -> _LinkedLibrary:
        return self

    def set_env(self, *_: object) -> None:
        """No environment: errors whose text is no constant would look at it, which kernels do not raise."""

    def get_pointer_to_function(self, name: str) -> int:  # noqa: ARG002
        self._ensure_finalized()
        return 0

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True
