"""Wall-clock times of a burst."""

from __future__ import annotations

import time as clock
from dataclasses import dataclass, field

__all__ = ["Clocks"]


@dataclass
class Clocks:
    """Wall-clock times of a run (s): its start, what came before the first step, the stepping, the last progress."""

    start: float = field(default_factory=clock.perf_counter)
    first_step: float = 0.0
    stepping: float = 0.0
    last_progress: float = 0.0
