"""Burst, break-up and flight of a case for its numbers alone, in the process of a study: no run directory is kept."""

from __future__ import annotations

import json
import pickle
import shutil
import tempfile
import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.errors import EXIT_DONE, EXIT_INTERRUPTED, exit_code_of, message_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from fragfield.case import CaseTable
    from transition import Snapshot

    Burst = tuple[Mapping[str, Any], Snapshot]

__all__ = ["answer_of", "burst_of", "flown_parts", "shared_burst"]

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
    from burst_fenicsx import simulate
    from fragfield.case.conversion.rounds import burst_rounds
    from fragfield.case.conversion.stages import burst_settings
    from fragfield.pipeline.parallel import Team
    from transition import Snapshot

    asked = burst_rounds(case), burst_settings(case)

    def made() -> Burst:
        inside = scratch if scratch is not None and scratch.is_dir() else None
        folder = Path(tempfile.mkdtemp(prefix="sample-", dir=inside))
        try:
            done = simulate(*asked, folder, comm=Team().alone, series=False)
            return done.summary, Snapshot.read(folder / "burst_snapshot.h5")
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    return _kept(pickle.dumps(asked), made)


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


def flown_parts(case: CaseTable, burst: Burst, threads: int = 1) -> dict[str, Any]:
    """Break the casings up and fly the fragments as a run does, to the same numbers.

    Returns
    -------
    dict
        Of summary.json: `burst`, `hazard` without what the surroundings add, of `break_up` and `flight` the number of
        `fragments` and `wall_seconds`, and `exposed`.
    """
    import transition
    from fragfield.case.conversion.stages import break_up_settings
    from fragfield.files.run_directory import RunDirectory
    from fragfield.pipeline.attitudes import fly_all
    from fragfield.pipeline.job import Job, RunOptions
    from fragfield.pipeline.parallel import Team
    from fragfield.terminal.progress import ProgressReporter

    summary, snapshot = burst
    broken = transition.BreakUp(snapshot, break_up_settings(case))
    realisations = broken.many(case.seed, range(case.break_up.realisations), threads)
    nowhere = RunDirectory(Path())
    options = RunOptions(nowhere.path, threads=threads, lean=True)
    began = time.perf_counter()
    flown = fly_all(Job(case, nowhere, nowhere, Team(), ProgressReporter(enabled=False), options), realisations, broken)
    assert flown is not None  # a team of one
    return {
        "burst": summary,
        "break_up": {"fragments": len(realisations[0])},
        "flight": {"wall_seconds": time.perf_counter() - began},
        "hazard": flown.hazard.headline,
        "exposed": flown.exposed,
    }
