"""Parses a gmsh mesh of unknown origin in a process of its own: `python gmsh_parse.py FILE`.

meshio takes the numbers of nodes and of entries that a file declares, and would fill the memory or count for days
where they are wrong. Here time and memory are those that a file of its size needs. Written to standard output are a
line of JSON and then arrays: nodes (8-byte reals), and of every block its cells and physical tags (8-byte integers).
"""

from __future__ import annotations

import json
import os
import resource
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

_SECONDS, _BYTES_A_SECOND = 6, 200_000
_MEMORY, _MEMORY_OF_A_BYTE = 1 << 29, 64


def _limited(size: int) -> None:
    """Take no more time and memory from here on than a mesh of `size` bytes needs."""
    seconds = _SECONDS + size // _BYTES_A_SECOND
    with suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
    with suppress(OSError, ValueError):
        taken = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
        most = taken + _MEMORY + _MEMORY_OF_A_BYTE * size
        resource.setrlimit(resource.RLIMIT_AS, (most, most))


def _parsed(path: str) -> tuple[dict[str, Any], list[Any]]:
    """What the file holds: the line of JSON, and the arrays."""
    import meshio
    import numpy as np

    _limited(Path(path).stat().st_size)
    try:
        found = meshio.read(path, file_format="gmsh")
    except MemoryError:
        return {"fault": "it declares more than a file of its size can hold"}, []
    except (Exception, SystemExit) as error:  # noqa: BLE001 - meshio leaves the program on some faults
        return {"fault": f"{type(error).__name__}: {' '.join(str(error).split())[:300]}"}, []
    tags = found.cell_data.get("gmsh:physical", [None] * len(found.cells))
    fields: Mapping[str, Any] = found.field_data
    head = {
        "names": {str(name): [int(value) for value in pair] for name, pair in fields.items()},
        "blocks": [block.type for block in found.cells],
        "tagged": [tag is not None for tag in tags],
    }
    arrays = [np.asarray(found.points, dtype=np.float64)]
    for block, tag in zip(found.cells, tags, strict=True):
        arrays.append(np.asarray(block.data, dtype=np.int64))
        arrays += [] if tag is None else [np.asarray(tag, dtype=np.int64)]
    head["shapes"] = [array.shape for array in arrays]
    return head, arrays


def main(path: str) -> None:
    """Write what a file holds, or `{"fault": ...}`."""
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # meshio reports to the console
    head, arrays = _parsed(path)
    out.write(json.dumps(head).encode() + b"\n")
    for array in arrays:
        out.write(array.tobytes())
    out.close()


if __name__ == "__main__":
    main(sys.argv[1])
