"""One sample: burst, break-up and flight of its case; only numbers are kept."""

from __future__ import annotations

import json
import shutil
import tempfile
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.errors import EXIT_DONE, EXIT_INTERRUPTED, exit_code_of, message_of
from fragfield.quantities import shown

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fragfield.case import Case

__all__ = ["perform_sample", "results_of_summary"]


def perform_sample(request: dict[str, Any]) -> tuple[int, str]:
    """Make a sample in this process; exit code, and its results as JSON, or why there are none.

    Parameters
    ----------
    request : dict
        `case`: the tables of its resolved case; `scratch`: a folder for the burst's files, which are removed, or one
        that is not there, for the machine's own folder; `burst`: run directory of a burst that is shared, or None.
    """
    from fragfield.terminal.logs import to_stderr

    try:
        with to_stderr(quiet=True), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return EXIT_DONE, json.dumps(_made(request), allow_nan=False)
    except KeyboardInterrupt as error:
        return EXIT_INTERRUPTED, message_of(error)
    except Exception as error:  # noqa: BLE001 - a failed sample is a line of the table
        return exit_code_of(error), message_of(error)


def _made(request: Mapping[str, Any]) -> dict[str, Any]:
    from fragfield.case.load import case_from_document
    from fragfield.files.run_directory import RunDirectory

    case = case_from_document(request["case"], source="sample", folder=Path())
    if request.get("burst"):
        shared = RunDirectory(Path(request["burst"]))
        return _flown(case, shared.file("burst_snapshot.h5"), shared.summary()["burst"])
    scratch = Path(request["scratch"])
    folder = Path(tempfile.mkdtemp(prefix="sample-", dir=scratch if scratch.is_dir() else None))
    try:
        return _flown(case, folder / "burst_snapshot.h5", _burst(case, folder))
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _burst(case: Case, folder: Path) -> Mapping[str, Any]:
    """Compute the burst into a folder; its summary."""
    from burst_fenicsx import simulate
    from fragfield.case.conversion.burst import burst_rounds
    from fragfield.case.conversion.stages import burst_settings
    from fragfield.pipeline.parallel import Team

    done = simulate(burst_rounds(case), burst_settings(case), folder, comm=Team().alone, series=False)
    found: Mapping[str, Any] = done.summary
    return found


def _flown(case: Case, snapshot: Path, burst: Mapping[str, Any]) -> dict[str, Any]:
    """Break the casings up and fly the fragments as a run does, on one thread, without its files."""
    import transition
    from fragfield.case.conversion.stages import break_up_settings
    from fragfield.files.run_directory import RunDirectory
    from fragfield.pipeline.attitudes import fly_all
    from fragfield.pipeline.job import Job, RunOptions
    from fragfield.pipeline.parallel import Team
    from fragfield.terminal.progress import ProgressReporter

    broken = transition.BreakUp(transition.Snapshot.read(snapshot), break_up_settings(case))
    first = broken.realisation(case.seed)
    further = broken.many(case.seed, range(1, case.break_up.realisations), 1)
    directory = RunDirectory(snapshot.parent)
    options = RunOptions(directory.path, threads=1, lean=True)
    job = Job(case, directory, directory, Team(), ProgressReporter(enabled=False), options)
    flown = fly_all(job, [first.fragments, *further])
    assert flown is not None  # a team of one
    hazard = {**(flown.hazard.headline or {})}
    parts = {"hazard": hazard, "burst": burst, "break_up": first.summary, "exposed": flown.exposed}
    return results_of_summary(parts)


def results_of_summary(summary: Mapping[str, Any]) -> dict[str, Any]:
    """The numbers of a sample that are kept (SI).

    `distance`, the expected one, with its `standard_error`, None where it is not `determined` (`reason` says why);
    `mean_initial_speed`, `speed_99`, `fragments`, and for each exposed site its expected `density` (the larger of that
    normal to the path and that on the ground), `hits` and `probability` with their standard errors.
    """
    hazard = summary["hazard"]
    determined = bool(hazard["determined"])
    return {
        "distance": hazard["expected"] if determined else None,
        "standard_error": hazard["standard_error"] if determined else None,
        "determined": determined,
        "reason": "" if determined else str(hazard["reason"]),
        **{one.name: one.of(summary) for one in shown("uncertainty")},
        "exposed": [_place(entry) for entry in summary.get("exposed") or []],
    }


def _place(entry: Mapping[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {"name": entry["name"]}
    densities = [entry[name] for name in ("density_normal", "density_ground") if entry.get(name)]
    worst = max(densities, key=lambda one: one["expected"] or 0.0, default=None)
    for name, value in (("density", worst), ("hits", entry.get("expected_hits"))):
        found[name] = None if value is None else value["expected"]
        found[f"{name}_standard_error"] = None if value is None else value["standard_error"]
    probability = entry.get("probability")
    found["probability"] = None if probability is None else probability["expected"]
    return found
