"""Largest accepted file sizes (bytes)."""

from __future__ import annotations

__all__ = ["MOST_CASE"]

MOST_CASE = 1 << 26
"""Bytes of a case file: 64 MB hold ten thousand rounds of inline points."""
