"""What the figures were taken on."""

from __future__ import annotations

import os
import platform
import re
import time
from datetime import UTC, datetime
from pathlib import Path

from fragfield.files.provenance import versions

__all__ = ["Others", "machine"]

_VERSIONS = ("fragfield", "python", "dolfinx", "numpy", "numba", "llvmlite")


class Others:
    """How many cores other processes have kept busy since this was made; they disturb what is measured."""

    def __init__(self) -> None:
        self._began, self._before = time.perf_counter(), _seconds_of_others()

    @property
    def cores(self) -> float | None:
        """The mean number of cores; None where the system does not say, or in less than a second."""
        passed, now = time.perf_counter() - self._began, _seconds_of_others()
        if self._before is None or now is None or passed < 1.0:
            return None
        return max(now - self._before, 0.0) / passed


def _seconds_of_others() -> float | None:
    """Seconds that cores have worked for processes other than this one and those that it has ended."""
    try:
        ticks = Path("/proc/stat").read_text(encoding="ascii").split()[1:4]
    except OSError:
        return None
    own = os.times()
    everyone = sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")
    return everyone - own.user - own.system - own.children_user - own.children_system


def machine() -> dict[str, object]:
    """Processor, cores that this process may use, caches, memory (bytes), versions and date."""
    return {
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)),
        "caches": _caches(),
        "memory_bytes": os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"),
        "versions": {name: text for name, text in versions().items() if name in _VERSIONS},
        "date": datetime.now(UTC).date().isoformat(),
    }


def _processor() -> str:
    """Name of the processor, with family and model where the name says little."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return platform.processor() or platform.machine()
    found = dict(re.findall(r"^([^\t\n:]+?)\s*:[ \t]*(.*)$", text, re.MULTILINE))
    name = found.get("model name") or platform.machine()
    place = [found[key] for key in ("cpu family", "model") if key in found]
    vectors = "AVX-512" if "avx512f" in found.get("flags", "") else "AVX2" if "avx2" in found.get("flags", "") else ""
    return ", ".join(part for part in (name, f"family {' model '.join(place)}" if place else "", vectors) if part)


def _caches() -> dict[str, str]:
    """Sizes of the first core's caches by name, as the system writes them."""
    sizes = {}
    for folder in sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        kind = (folder / "type").read_text(encoding="ascii").strip()
        level = (folder / "level").read_text(encoding="ascii").strip()
        if kind != "Instruction":
            sizes[f"L{level}"] = (folder / "size").read_text(encoding="ascii").strip()
    return sizes
