"""`fragfield warm-up`: compile the kernels before the first run, by two tiny runs that need nearly all of them."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

from fragfield.case import load_case
from fragfield.pipeline.kernels import compiled_beside
from fragfield.studies.sweep import run_sweep
from fragfield_base.kernel_cache import cache_root

_CASE = """
title = "Kernels compiled"

[burst]
cell_size = "12 mm"
end_time = "30 us"

[[round]]
name = "shell"
profile = "m107"
explosive = "tnt"
casing = "steel_m107"
attitude = "upright"
position = ["0 m", "0 m", "1 m"]

[stack]
arrangement = "row"
count = 1
gap = "20 mm"

[flight]
drag = "shell_fragment"

[[witness]]
name = "ring"
radius = "25 ft"
"""
_ROUNDS = "stack.count=1,2"  # a meridian, and a pair in three dimensions: little is common to them


def warm_up() -> dict[str, Any]:
    """Compile into the user's cache what is not there yet, side by side on two cores.

    Returns
    -------
    dict
        `seconds`; `cache`, the folder, or None where nothing can be kept; `failures`, why runs failed.
    """
    began = time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="fragfield-") as name:
        case = Path(name) / "warm_up.toml"
        case.write_text(_CASE, encoding="utf-8")
        # both runs fly by the same kernels, and each would compile them
        with compiled_beside(load_case(case), quiet=True) as flight_compiled:
            run_sweep(case, [_ROUNDS], out=Path(name) / "bursts", stage="burst", progress=False)
            flight_compiled()
        # a row alone needs fewer kernels
        swept = run_sweep(case, [_ROUNDS], out=Path(name) / "runs", keep_runs=True, progress=False)
    root = cache_root()
    return {
        "seconds": time.perf_counter() - began,
        "cache": None if root is None else str(root),
        "failures": list(swept.failures.values()),
    }
