"""Time and memory of flying N fragments and of writing all files: `python -m benchmarks.flight_files N`.

The files are fragments.h5 and .csv, landing.h5 and .csv, hits.h5 and witness.csv of one ring, as `fragfield fly` writes
them. Beside it stands the table of landings written row by row by Python's "%.10g", as it was before 2026-11-23.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.fresh import figures_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

__all__ = ["plainly", "written"]


def written(number: int) -> dict[str, Any]:
    """Core-seconds of the flight and of the files, bytes on the disk, and the largest memory of the process."""
    return figures_of("benchmarks.flight_files", number)


def plainly(path: Path, columns: Mapping[str, NDArray[Any]]) -> None:
    """A table without texts, row by row."""
    form = ",".join("%d" if column.dtype.kind in "iub" else "%.10g" for column in columns.values())
    with path.open("w", encoding="utf-8") as file:
        file.write(",".join(columns) + "\n")
        for row in zip(*(column.tolist() for column in columns.values()), strict=True):
            file.write(form % row + "\n")


def _core_seconds(work: Callable[[], object]) -> float:
    began = time.process_time()
    work()
    return time.process_time() - began


def _main(number: int) -> None:
    from benchmarks.flight_plain import burst_cloud
    from benchmarks.fresh import peak_bytes
    from flight import Cylinder, fly
    from flight.files.text_tables import write_columns
    from flight.result import FlightResult
    from flight.rows import flat_columns

    ring = Cylinder(name="ring", centre=(0.0, 0.0), radius=7.62)
    fragments = burst_cloud(number)
    results: list[FlightResult] = []
    with tempfile.TemporaryDirectory(prefix="fragfield-bench-") as name:
        folder = Path(name)
        fly(fragments.select(slice(0, 5000)), witnesses=[ring]).write(folder)  # compiles
        flown = _core_seconds(lambda: results.append(fly(fragments, witnesses=[ring])))
        result = results[0]

        def write() -> None:
            fragments.write(folder / "fragments.h5")
            fragments.write(folder / "fragments.csv")
            result.write(folder)

        seconds, peak = _core_seconds(write), peak_bytes()
        bytes_written = sum(file.stat().st_size for file in folder.iterdir())
        part = flat_columns(result.landing[: max(1, number // 10)])
        ours = _core_seconds(lambda: write_columns(folder / "ours.csv", part, {}))
        plain = _core_seconds(lambda: plainly(folder / "plain.csv", part))
        same = (folder / "ours.csv").read_bytes() == (folder / "plain.csv").read_bytes()
    print(
        json.dumps(
            {
                "fragments": number,
                "core_seconds_of_the_flight": flown,
                "core_seconds_of_the_files": seconds,
                "bytes_written": bytes_written,
                "peak_bytes": peak,
                "same_text_as_row_by_row": same,
                "row_by_row_over_this": plain / ours,
            }
        )
    )


if __name__ == "__main__":
    _main(int(sys.argv[1]))
