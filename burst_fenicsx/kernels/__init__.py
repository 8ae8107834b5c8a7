"""Compiled kernels of the burst stage: arrays in, arrays out, nothing of dolfinx.

A kernel works on a block of `LANES` cells of one material. Scratch arrays are flat, entry `k` of
lane `l` at `k * LANES + l`, so that the innermost loop runs over the lanes and is vectorised.
"""

from __future__ import annotations
