"""Long steel tubes with TNT against Gurney's formula, from thick walls to thin ones."""

from __future__ import annotations
