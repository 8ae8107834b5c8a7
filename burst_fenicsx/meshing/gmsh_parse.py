"""Reads a gmsh mesh of unknown origin in a process of its own: `python gmsh_parse.py FILE`.

meshio takes the numbers of nodes and of entries that a file declares, and would fill the memory or count for days
where they are wrong. Here time and memory are those that a file of its size needs. Written to standard output is an
archive of numpy: `points` (n, 3), `names` and `tags` of the physical volumes, and of every block of cells that are not
flat its `kind_`, `cells_` and `groups_` with a number behind; or `fault` alone.
"""

from __future__ import annotations

import io
import os
import resource
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

_SECONDS, _BYTES_A_SECOND = 6, 200_000
_MEMORY, _MEMORY_OF_A_BYTE = 1 << 29, 64
_FLAT = ("vertex", "line", "triangle", "quad")


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


def _read(path: str) -> dict[str, Any]:
    """What the file holds, by name."""
    import meshio
    import numpy as np

    _limited(Path(path).stat().st_size)
    try:
        mesh = meshio.read(path, file_format="gmsh")
    except MemoryError:
        return {"fault": "it declares more than a file of its size can hold"}
    except (Exception, SystemExit) as error:  # noqa: BLE001 - meshio leaves the program on some faults
        return {"fault": f"{type(error).__name__}: {' '.join(str(error).split())[:300]}"}
    if mesh.points.ndim != 2 or mesh.points.shape[1] < 3:
        return {"fault": f"its nodes are an array of shape {mesh.points.shape}"}
    volumes = {int(tag): str(name) for name, (tag, dimension) in mesh.field_data.items() if dimension == 3}
    found: dict[str, Any] = {
        "points": np.asarray(mesh.points[:, :3], dtype=np.float64),
        "names": list(volumes.values()),
        "tags": list(volumes),
    }
    groups = mesh.cell_data.get("gmsh:physical", [None] * len(mesh.cells))
    for number, (block, group) in enumerate(zip(mesh.cells, groups, strict=True)):
        if block.type.rstrip("0123456789") not in _FLAT:
            of_cells = np.full(len(block.data), -1) if group is None else group
            found |= {f"kind_{number}": block.type, f"cells_{number}": np.asarray(block.data, dtype=np.int64)}
            found[f"groups_{number}"] = np.asarray(of_cells, dtype=np.int64)
    return found


def main(path: str) -> None:
    """Write what a file holds."""
    import numpy as np

    out = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # meshio reports to the console
    archive = io.BytesIO()
    np.savez(archive, **_read(path))
    out.write(archive.getbuffer())
    out.close()


if __name__ == "__main__":
    main(sys.argv[1])
