"""The table [document]: data for an organisation's document control."""

from __future__ import annotations

from pydantic import Field

from fragfield.case.tables.base import Table

__all__ = ["DocumentTable"]


class DocumentTable(Table):
    """What stands on the first page of the report and at the foot of every printed page."""

    number: str = ""
    """Document number."""
    revision: str = ""
    """Revision, for example "B"."""
    classification: str = ""
    """Classification line, printed as it is written here."""
    prepared_by: str = ""
    """Who prepared the report."""
    reviewed_by: str = ""
    """Who reviewed it."""
    approved_by: str = ""
    """Who approved it."""
    changes: list[str] = Field(default_factory=list)
    """What this revision changed, a line each."""
