"""Speed, as ratios within one run on one machine. `python -m benchmarks --help`."""

from __future__ import annotations
