"""The case file: its schema with units, its checks, and its conversion to what the stages take."""

from __future__ import annotations

from fragfield.case.difference import differences
from fragfield.case.load import load_case, read_resolved
from fragfield.case.schema import Case
from fragfield.case.write import plain, to_toml

__all__ = ["Case", "differences", "load_case", "plain", "read_resolved", "to_toml"]
