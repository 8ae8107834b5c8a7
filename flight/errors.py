"""Errors and warnings of the flight library, with messages that say what to do."""

from __future__ import annotations

from fragfield_base import errors


class InputError(errors.InputError):
    """The input cannot be flown; the message says what was found and what is allowed."""


class NotDeterminedError(InputError):
    """The flights do not determine a hazard distance; the message says why."""


class FlightWarning(UserWarning):
    """The result stands, but rests on something the user should know; `code` names what, for programs."""

    code = "flight"


class DragTableWarning(FlightWarning):
    """Fragments were faster than the end of the drag table reaches."""

    code = "drag_table"
