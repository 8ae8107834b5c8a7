"""Kernels as other kernels call them: without the ways in from Python, which cost a fifth of all compiling.

Numba gives every compiled function a wrapper that unpacks its arguments from Python objects and another for C, even
where only compiled code calls it; for a state of fifty arrays they are longer than the function. It also compiles a
function again for every constant it is called with (`load(scratch, 3, lane)`), though the constant is known anyway
where the function is compiled into its caller. So a caller gets a version of the function of its own.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from fragfield_base.lean_libraries import for_callers, teach

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["bare_for_callers"]

_BARE = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def bare_for_callers(compiler: Any, dispatcher: Any, function: Callable[..., Any], **options: Any) -> Any:  # noqa: ANN401
    """Let kernels that call a compiled function compile a bare version of it; from Python it is called as before.

    Parameters
    ----------
    compiler : module
        numba.
    dispatcher
        What numba.njit has made of the function.
    function : callable
        What is compiled.
    options
        Of numba.njit.

    Returns
    -------
    object
        `dispatcher`.
    """
    if compiler.config.DISABLE_JIT:  # nothing is compiled, for anyone
        return dispatcher
    _teach(type(dispatcher))
    teach()
    bare = compiler.njit(**_BARE, **options)(function)
    template = bare.get_call_template

    def of_plain_numbers(args: Any, kws: Any) -> Any:  # noqa: ANN401 - numba's types
        plain = {name: _plain(compiler.types, given) for name, given in kws.items()}
        with for_callers():
            return template(tuple(_plain(compiler.types, given) for given in args), plain)

    bare.get_call_template = of_plain_numbers
    dispatcher.fragfield_bare = bare
    return dispatcher


def _plain(types: Any, given: Any) -> Any:  # noqa: ANN401
    """Type of a number for that of a constant."""
    return types.unliteral(given) if isinstance(given, types.IntegerLiteral | types.BooleanLiteral) else given


def _teach(dispatcher_class: type) -> None:
    """Have numba take the bare version where a kernel names a function."""
    type_of = importlib.import_module("numba.extending").typeof_impl  # by name: only those who compile load numba
    if dispatcher_class in type_of.registry:
        return

    @type_of.register(dispatcher_class)
    def _(value: Any, purpose: Any) -> Any:  # noqa: ANN401, ARG001
        return getattr(value, "fragfield_bare", value)._numba_type_
