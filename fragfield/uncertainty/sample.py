"""One sample: burst, break-up and flight of its case in a scratch folder, of which its numbers are kept."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.errors import EXIT_DONE, EXIT_INTERRUPTED, exit_code_of, message_of

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["perform_sample", "results_of_summary"]


def perform_sample(request: dict[str, Any]) -> tuple[int, str]:
    """Make a sample in this process; exit code, and its results as JSON, or why there are none.

    Parameters
    ----------
    request : dict
        `text`: the case; `scratch`: a folder for the sample's files, which are removed, or one that is not there, for
        the machine's own folder; `burst`: run directory of a burst that is shared, or None.
    """
    from fragfield.logs import to_stderr

    try:
        with to_stderr(quiet=True):
            return EXIT_DONE, json.dumps(_made(request), allow_nan=False)
    except KeyboardInterrupt as error:
        return EXIT_INTERRUPTED, message_of(error)
    except Exception as error:  # noqa: BLE001 - a failed sample is a line of the table
        return exit_code_of(error), message_of(error)


def _made(request: Mapping[str, Any]) -> dict[str, Any]:
    from fragfield.pipeline import Request, run_chain

    scratch = Path(request["scratch"])
    folder = Path(tempfile.mkdtemp(prefix="sample-", dir=scratch if scratch.is_dir() else None))
    try:
        case_file, out = folder / "sample.toml", folder / "run"
        case_file.write_text(request["text"], encoding="utf-8")
        if request.get("burst"):
            _take_burst(Path(request["burst"]), case_file, out)
        shared = bool(request.get("burst"))
        return results_of_summary(run_chain(Request(case_file, out, resume=shared, quiet=True, lean=True)))
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _take_burst(burst: Path, case_file: Path, out: Path) -> None:
    """Begin a run directory with a burst that was computed before."""
    from fragfield.case import load_case
    from fragfield.run_directory import RunDirectory

    source, target = RunDirectory(burst), RunDirectory(out)
    target.make()
    target.write_case(load_case(case_file))
    name = "burst_snapshot.h5"
    try:
        os.link(source.file(name), target.file(name))
    except OSError:  # another file system
        with suppress(FileNotFoundError):
            shutil.copyfile(source.file(name), target.file(name))
    target.write_summary({"burst": source.summary()["burst"]})


def results_of_summary(summary: Mapping[str, Any]) -> dict[str, Any]:
    """The numbers of a sample that are kept (SI).

    `distance` with its `standard_error`, None where it is not `determined` (`reason` says why); `mean_initial_speed`,
    `speed_99`, `fragments`, and for each exposed place its expected `density` (the larger of that normal to the path
    and that on the ground), `hits` and `probability` with their standard errors.
    """
    hazard, burst = summary["hazard"], summary["burst"]
    determined = bool(hazard["determined"])
    return {
        "distance": hazard["distance"] if determined else None,
        "standard_error": hazard["standard_error"] if determined else None,
        "determined": determined,
        "reason": "" if determined else str(hazard["reason"]),
        "mean_initial_speed": burst.get("mean_initial_speed"),
        "speed_99": (burst.get("speed_quantiles") or {}).get("99"),
        "fragments": summary["break_up"]["fragments"],
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
