"""Hazard distances of the fragments of cased charges, from the burst to the ground, for explosives safety."""

from __future__ import annotations

__all__ = ["__version__"]

__version__ = "0.1.0"
