"""Machine code for what Python calls alone: a fifth to a third of compiling was code that is never run.

Numba optimises and turns to machine code every function that it compiles. A kernel that calls others has them in its
own code, though, so theirs is never run, nor is that of what numba wraps around a loop over threads. While a kernel is
compiled for its callers, it is kept as LLVM's code, and the wrappers are left for the caller to optimise. The Python
objects that the code refers to are set where the machine code is made in the end. With a version of numba that has not
been tried, or whose classes are not as they are known here, all is compiled as usual.
"""

from __future__ import annotations

import importlib
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["for_callers", "teach"]

_FIRST, _BEHIND = (0, 61), (0, 69)  # versions of numba: from 0.61.0 to 0.68.1 it has been tried
_WRAPPER, _OBJECTS = "_ZN7cpython", "_ZN08NumbaEnv"  # how names begin: of ways in from Python, of objects looked up
_LOOP_WRAPPERS = ("parallelgufuncwrapper", "<numba.np.ufunc.wrappers.")  # names of what goes around a parallel loop
_depth = 0


@contextmanager
def for_callers() -> Iterator[None]:
    """What is compiled meanwhile is called by kernels alone, unless it has a way in from Python."""
    global _depth  # noqa: PLW0603 - numba compiles under one lock
    _depth += 1
    try:
        yield
    finally:
        _depth -= 1


def teach() -> None:
    """Have numba keep from making machine code of what is compiled in `for_callers`."""
    version = importlib.import_module("numba").__version__  # by name: only those who compile load numba
    if not _FIRST <= tuple(int(part) for part in version.split(".")[:2]) < _BEHIND:
        return
    module = importlib.import_module("numba.core.codegen")
    library: Any = getattr(module, "JITCodeLibrary", None)
    codegen: Any = getattr(module, "JITCPUCodegen", None)
    known = (
        "_finalize_final_module", "_finalize_dynamic_globals", "_optimize_final_module", "_verify_declare_only_symbols",
    )  # fmt: skip
    if not all(hasattr(library, name) for name in known) or not hasattr(codegen, "set_env"):
        return
    if not hasattr(library, "fragfield_lean"):
        library.fragfield_lean = True
        _keep_libraries(library)
        _set_objects(codegen)


def _keep_libraries(library: Any) -> None:  # noqa: ANN401 - numba's class
    make, optimise = library._finalize_final_module, library._optimize_final_module
    lookup = importlib.import_module("numba.core.environment").lookup_environment

    def finalize(self: Any) -> None:  # noqa: ANN401
        module = self._final_module
        # What comes from the cache has its machine code, and no functions in its module.
        own = any(not f.is_declaration for f in module.functions)
        wrapped = any(f.name.startswith(_WRAPPER) and not f.is_declaration for f in module.functions)
        if _depth and own and not wrapped:
            self._finalize_dynamic_globals()
            self._verify_declare_only_symbols()
            self._finalized = True
            return
        make(self)
        for variable in module.global_variables:
            if variable.name.startswith(_OBJECTS) and (objects := lookup(variable.name)) is not None:
                self._codegen.set_env(variable.name, objects)

    def optimise_final(self: Any) -> None:  # noqa: ANN401
        if not (_depth and self.name.startswith(_LOOP_WRAPPERS)):
            optimise(self)

    library._finalize_final_module, library._optimize_final_module = finalize, optimise_final


def _set_objects(codegen: Any) -> None:  # noqa: ANN401 - numba's class
    put = codegen.set_env

    def set_env(self: Any, name: str, objects: Any) -> None:  # noqa: ANN401
        if self._engine.is_symbol_defined(name):
            put(self, name, objects)

    codegen.set_env = set_env
