"""The error that the break-up raises on purpose, with a message a user can act on."""

from __future__ import annotations

from fragfield_base import errors


class InputError(errors.InputError):
    """The input cannot be broken up; the message says what was found and what is allowed."""
