"""Errors that the burst stage raises on purpose, each with a message a user can act on."""

from __future__ import annotations

from fragfield_base import errors


class InputError(errors.InputError):
    """The input cannot be computed; the message says what was found and what is allowed."""


class NumericalStop(errors.NumericalStop):
    """The computation left its bounds (lost cell, open ledger, not a number).

    Parameters
    ----------
    reason : what went wrong and where, in words.
    time : simulated time (s).
    """

    def __init__(self, reason: str, time: float) -> None:
        super().__init__(f"{reason} (at {time * 1e6:.2f} us)")
        self.reason = reason
        self.time = time
