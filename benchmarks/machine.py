"""What the figures were taken on."""

from __future__ import annotations

import os
import platform
import re
from datetime import UTC, datetime
from pathlib import Path

from fragfield.provenance import versions

__all__ = ["machine"]

_VERSIONS = ("fragfield", "python", "dolfinx", "numpy", "numba", "llvmlite")


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
