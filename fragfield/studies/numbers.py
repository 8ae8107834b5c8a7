"""Burst, break-up and flight of a case for its numbers alone, in the process of a study: no run directory is kept."""

from __future__ import annotations

import json
import pickle
import tempfile
import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.errors import EXIT_DONE, EXIT_INTERRUPTED, exit_code_of, message_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from fragfield.case import CaseTable
    from fragfield.pipeline.beside import Burst


_last: dict[object, Burst] = {}
"""The last burst of this process: runs that differ in the break-up or the flight alone have the same."""


def answer_of(results: Callable[[], dict[str, Any]]) -> tuple[int, str]:
    """Exit code, and results as JSON, or why there are none."""
    from fragfield.terminal.logs import to_stderr

    try:
        with to_stderr(quiet=True), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return EXIT_DONE, json.dumps(results(), allow_nan=False)
    except KeyboardInterrupt as error:
        return EXIT_INTERRUPTED, message_of(error)
    except Exception as error:  # noqa: BLE001 - a failed run is a line of the table
        return exit_code_of(error), message_of(error)


def burst_of(case: CaseTable, scratch: Path | None = None) -> Burst:
    """The burst's summary, and the state at its end.

    Its files lie in a folder within `scratch`, where that is there, else within the machine's own, and are removed.
    """
    from fragfield.case.conversion.rounds import burst_rounds
    from fragfield.case.problem import burst_settings
    from fragfield.pipeline.beside import burst_beside
    from fragfield.pipeline.parallel import Team

    def made() -> Burst:
        inside = scratch if scratch is not None and scratch.is_dir() else None
        return burst_beside(case, Path(tempfile.mkdtemp(prefix="sample-", dir=inside)), Team())

    return _kept(pickle.dumps((burst_rounds(case), burst_settings(case))), made)


def shared_burst(directory: Path) -> Burst:
    """The same of a run directory."""
    from fragfield.files.run_directory import RunDirectory
    from transition import Snapshot

    run = RunDirectory(directory)
    return _kept(directory, lambda: (run.summary()["burst"], Snapshot.read(run.file("burst_snapshot.h5"))))


def _kept(key: object, make: Callable[[], Burst]) -> Burst:
    """The last burst again where it has this key."""
    if key not in _last:
        _last.clear()  # before the next one is made: two of them may not fit into the memory
        _last[key] = make()
    return _last[key]


def flown_parts(case: CaseTable, burst: Burst, threads: int = 1, *, sample: bool = False) -> dict[str, Any]:
    """Break the casings up and fly the fragments as a run does, to the same numbers; a `sample` with fewer points.

    Returns
    -------
    dict
        Of summary.json: `burst`, `hazard` without what the surroundings add, of `break_up` and `flight` the number of
        `fragments` and `wall_seconds`, and `exposed`.
    """
    from fragfield.pipeline.beside import flown_beside

    summary, snapshot = burst
    began = time.perf_counter()
    flown, fragments = flown_beside(case, snapshot, threads, sample=sample)
    return {
        "burst": summary,
        "break_up": {"fragments": fragments},
        "flight": {"wall_seconds": time.perf_counter() - began},
        "hazard": flown.hazard.headline,
        "exposed": flown.exposed,
    }
