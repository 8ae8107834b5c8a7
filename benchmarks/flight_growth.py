"""Time and memory of a flight of N fragments in a process of its own: `python -m benchmarks.flight_growth N`."""

from __future__ import annotations

import json
import sys
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.fresh import figures_of
from benchmarks.goal import near

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["grown"]

_TOLERANCE = 0.1


def grown(numbers: Sequence[int]) -> dict[str, Any]:
    """Exponent of the cores' time over the number of fragments, and the memory of one more."""
    rows = [figures_of("benchmarks.flight_growth", number) for number in numbers]
    count, seconds, peak = (
        np.array([float(row[key]) for row in rows]) for key in ("fragments", "core_seconds", "peak_bytes")
    )
    exponent = float(np.polyfit(np.log(count), np.log(seconds), 1)[0])
    return {
        "bytes_a_fragment": float((peak[-1] - peak[0]) / (count[-1] - count[0])),
        **near(exponent, _TOLERANCE, "exponent of the cores' time over the number of fragments"),
        "numbers": rows,
    }


def _main(number: int) -> None:
    from benchmarks.clouds import burst_cloud
    from benchmarks.fresh import peak_bytes
    from flight import fly

    fragments = burst_cloud(number)
    fly(fragments.select(slice(0, 5000)))
    began, worked = time.perf_counter(), time.process_time()
    landed = fly(fragments).summary["landed"]
    figures = {"seconds": time.perf_counter() - began, "core_seconds": time.process_time() - worked}
    print(json.dumps({"fragments": number, "landed": landed, **figures, "peak_bytes": peak_bytes()}))


if __name__ == "__main__":
    _main(int(sys.argv[1]))
