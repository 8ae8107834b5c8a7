"""The copper cylinder test with TNT: how fast the products drive a wall that holds them."""

from __future__ import annotations
