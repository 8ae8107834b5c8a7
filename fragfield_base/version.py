"""Version of both distributions, here alone; written to their files."""

from __future__ import annotations

__version__ = "0.1.0"
