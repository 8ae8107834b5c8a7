"""Common base of the errors of all stages, so that one name catches them."""

from __future__ import annotations

__all__ = ["InputError", "NumericalStop"]


class InputError(ValueError):
    """The input cannot be used; the message says where, what was found and what is allowed.

    Every stage raises one of its own, which is one of these.
    """


class NumericalStop(RuntimeError):  # noqa: N818 - it ends a run, it does not crash it
    """A computation left its bounds and was ended; the message says where and when."""
