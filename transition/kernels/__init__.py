"""Compiled loops of the break-up: arrays in, arrays out, numba only."""

from __future__ import annotations
