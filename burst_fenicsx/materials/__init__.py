"""Material laws: arrays in, arrays out, nothing of dolfinx."""

from __future__ import annotations
