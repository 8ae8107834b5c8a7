"""The case file: its schema with units, its checks, and its conversion to what the stages take."""

from __future__ import annotations

from fragfield.case.changes import changed_document, load_case, load_changed_case
from fragfield.case.load import read_resolved
from fragfield.case.schema import CaseTable
from fragfield.case.write import differences, plain, to_toml

__all__ = [
    "CaseTable",
    "changed_document",
    "differences",
    "load_case",
    "load_changed_case",
    "plain",
    "read_resolved",
    "to_toml",
]
