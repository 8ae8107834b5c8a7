"""Text cells of CSV files: quoted where necessary, and never a formula for a spreadsheet."""

from __future__ import annotations

__all__ = ["csv_cell", "harmless"]

_FORMULA = ("=", "+", "-", "@", "\t", "\r")
_QUOTED = (",", '"', "\n", "\r")


def harmless(text: str) -> str:
    """The text, behind an apostrophe where a spreadsheet would compute what it says (`=cmd|...`)."""
    return f"'{text}" if text.startswith(_FORMULA) else text


def csv_cell(text: str) -> str:
    """One cell after RFC 4180: in quotes, with quotes doubled, where it holds a comma, a quote or a new line."""
    text = harmless(text)
    return '"' + text.replace('"', '""') + '"' if any(mark in text for mark in _QUOTED) else text
