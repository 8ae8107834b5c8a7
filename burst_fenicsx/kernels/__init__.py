"""Compiled kernels of the burst stage: arrays in, arrays out, nothing of dolfinx.

A kernel works on a block of `LANES` cells of one material. Its scratch is flat, entry `l` of row `k` at
`k * LANES + l`. Every computation is a loop over the lanes whose body is made of functions of one lane's numbers
(`lanes.lane_function`), inlined, so that the loop is vectorised and numbers stay in registers.
"""

from __future__ import annotations
