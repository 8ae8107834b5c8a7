"""Version of the program, written to its files."""

from __future__ import annotations

__version__ = "0.1.0"
