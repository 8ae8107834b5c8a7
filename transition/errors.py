"""The error that the break-up raises on purpose, with a message a user can act on."""

from __future__ import annotations

from fragfield_base import errors
from fragfield_base.errors import names_allowed as nearest

__all__ = ["InputError", "nearest"]


class InputError(errors.InputError):
    """The input cannot be broken up; the message says what was found and what is allowed."""
