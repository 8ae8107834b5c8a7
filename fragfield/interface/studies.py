"""`fragfield.run_sweep`, `compare_runs` and `run_uncertainty`: many runs of a case, and the ratios of two."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError, NotDeterminedError
from fragfield.hazard.certainty import metres
from fragfield.hazard.recommended import parts_words
from fragfield.interface.case import Case, setting_of, study_folder, written_case
from fragfield.interface.results import Run
from fragfield.interface.results import open as open_run
from fragfield.interface.tables import table_of_rows
from fragfield.results.hazard import Recommended
from fragfield_base.paths import absolute

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping, Sequence

    from fragfield.interface.tables import Table


@dataclass(frozen=True, repr=False)
class Sweep:
    """The runs of a sweep.

    Attributes
    ----------
    path : Path
        Holds sweep.csv and sweep.json, and the run directories that are kept.
    found : dict
        As `fragfield sweep --json` prints it: `keys`, `exit_code`, and `runs` with `name`, `directory` (None where none
        is kept), `values`, `state`, `message` and `results` each.
    """

    path: Path
    found: dict[str, Any]

    @property
    def runs(self) -> list[Run]:
        """The runs that are done and have a run directory, in the order of the values."""
        ended = [one for one in self.found["runs"] if one["state"] in ("done", "kept")]
        return [open_run(one["directory"]) for one in ended if one["directory"] is not None]

    @property
    def failures(self) -> dict[str, str]:
        """By the name of each run that failed: why."""
        return {one["name"]: str(one["message"]) for one in self.found["runs"] if one["state"] == "failed"}

    @property
    def table(self) -> Table:
        """A row a run: its name, the values of the keys, its state, and its results in SI (NaN where there is none)."""
        return table_of_rows("sweep", [_row(one) for one in self.found["runs"]])

    def __repr__(self) -> str:
        return f"<fragfield.Sweep {str(self.path)!r}: {len(self.found['runs'])} runs, {len(self.failures)} failed>"

    def __str__(self) -> str:
        keys = ", ".join(self.found["keys"])
        lines = [f"{len(self.found['runs'])} runs over {keys}, in {self.path}"]
        lines += [f"  {name} failed: {message}" for name, message in self.failures.items()]
        return "\n".join(lines)


def run_sweep(
    case: Case | str | os.PathLike[str],
    values: Mapping[str, Sequence[Any]] | Sequence[str],
    *,
    out: str | os.PathLike[str] | None = None,
    stage: str = "run",
    threads: int | None = None,
    jobs: int | None = None,
    resume: bool = False,
    overwrite: bool = False,
    scheduler: str | None = None,
    keep_runs: bool = False,
    progress: bool = True,
) -> Sweep:
    """Compute a case for every combination of values, side by side.

    Parameters
    ----------
    case : Case or path
        A case file, or a case, which is written beside `out` first.
    values : mapping from key to sequence, or sequence of str
        `{"burst.cell_size": ["8 mm", "6 mm"]}`, or texts as the command line takes them.
    out : path, optional
        Folder of the runs; left out: runs/NAME_sweep. A case made in Python needs one.
    stage : "run" or "burst"
        Burst, break-up and flight, or the burst alone.
    threads, jobs : int, optional
        Threads of a run (default 1), and runs at one time (default: all cores).
    resume, overwrite : bool
        Keep finished runs and continue unfinished ones; replace runs of another case.
    scheduler : str, optional
        Address of a dask scheduler, whose workers make the runs.
    keep_runs : bool
        Keep a run directory of every run, for `Sweep.runs`; left out: of those with a burst in three dimensions.
    progress : bool
        Lines on stderr while runs end.

    Returns
    -------
    Sweep
        A run that fails is recorded in it and raises nothing.

    Raises
    ------
    InputError
        A key or a value is not allowed, or the folder holds runs of another case.
    """
    from fragfield.studies import sweep

    folder, file = study_folder(case, out, "sweep")
    options = sweep.SweepOptions(folder, stage, threads, resume, overwrite, not progress, jobs, scheduler, keep_runs)
    settings = values if not hasattr(values, "items") else [setting_of(key, each) for key, each in values.items()]
    found = sweep.run_sweep(sweep.plan_sweep(written_case(case, file), list(settings)), options)
    return Sweep(folder, found)


def compare_runs(run: Run | str | os.PathLike[str], reference: Run | str | os.PathLike[str]) -> Table:
    """Divide what a run gave by what a reference run gave, a pair by its single round.

    Parameters
    ----------
    run, reference : Run or path
        Runs, or their directories.

    Returns
    -------
    Table
        A row a quantity: `quantity` (its path in the summary), `label`, `unit`, `run`, `reference` (SI), `ratio` and
        `ratio_error` (standard error, NaN where a run has none).

    Raises
    ------
    InputError
        A directory is no run, or its summary is damaged or has no results.
    """
    from fragfield.studies.ratios import ratios

    folders = [one.path if isinstance(one, Run) else absolute(one, InputError) for one in (run, reference)]
    return table_of_rows("ratios", ratios(*folders))


@dataclass(frozen=True, repr=False)
class Uncertainty:
    """What uncertain inputs do to the distance.

    Attributes
    ----------
    path : Path
        Holds uncertainty.html, uncertainty.json, samples.csv and the nominal run.
    found : dict
        As `fragfield uncertainty --json` prints it: `design`, `states`, `inputs`, `distance`, `hazard`,
        `distance_to_apply`, `exposed`.
    """

    path: Path
    found: dict[str, Any]

    @property
    def recommended(self) -> float:
        """The recommended distance (m) of the nominal run with this study; NotDeterminedError where there is none."""
        if not self.found["distance"]:
            reason = self.found["states"].get("reason", "no sample gave a distance")
            raise NotDeterminedError(f"the distance over the inputs is not determined: {reason}")
        return float(self.found["hazard"]["recommended"])

    @property
    def spread(self) -> tuple[float, float, float]:
        """Expected distance (m) at 5, 50 and 95 % of the inputs' distribution; NaN where there is none."""
        found = (self.found["distance"] or {}).get("spread") or {}
        low, median, high = (float(found.get(key, math.nan)) for key in ("low", "median", "high"))
        return low, median, high

    @property
    def effects(self) -> Table:
        """A row an input: its share of the distance's variance, with standard error and 95 % interval.

        Without rows where the samples are too few for shares.
        """
        return table_of_rows("effects", (self.found["distance"] or {}).get("shares") or [])

    def __repr__(self) -> str:
        return f"<fragfield.Uncertainty {str(self.path)!r}: {self.found['design']['samples']} samples>"

    def __str__(self) -> str:
        if not self.found["distance"]:
            return f"no distance over the inputs, see {self.path}"
        low, median, high = (metres(value) for value in self.spread)
        parts = parts_words(Recommended.read(self.found["hazard"]))
        return (
            f"{self.found['distance_to_apply']['line']}\n"
            f"  recommended distance {metres(self.recommended)}: {parts}\n"
            f"  expected distance over the inputs: 5 % {low}, median {median}, 95 % {high}, "
            f"{self.found['design']['samples']} samples"
        )


def run_uncertainty(
    case: Case | str | os.PathLike[str],
    *,
    out: str | os.PathLike[str] | None = None,
    samples: int | None = None,
    seed: int | None = None,
    set: Sequence[str] | Mapping[str, Any] = (),  # noqa: A002 - as `--set`
    jobs: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = True,
) -> Uncertainty:
    """Sample the uncertain inputs of a case.

    Parameters
    ----------
    case : Case or path
        A case file, a run directory, which then is the nominal run, or a case, which is written beside `out` first.
    out : path, optional
        Folder of the study; left out: runs/NAME_uncertainty. A case made in Python needs one.
    samples, seed : optional
        Instead of those of `[uncertainty]`: number, seed of points and samples.
    set
        Values that replace those of the case, see `Case.from_toml`.
    jobs : int, optional
        Samples at one time; left out: all cores.
    scheduler : str, optional
        Address of a dask scheduler, whose workers make the samples.
    resume, overwrite : bool
        Continue the study in the folder, or replace it.
    progress : bool
        Lines on stderr while samples are made.

    Returns
    -------
    Uncertainty
        Samples that fail are counted in it and raise nothing.

    Raises
    ------
    InputError, NumericalStop
        The case or the folder is at fault, or the nominal run stopped.
    """
    from fragfield.interface.running import options_of
    from fragfield.studies.uncertainty import StudyOptions, run_study

    folder, file = study_folder(case, out, "uncertainty")
    options = StudyOptions(folder, samples, seed, jobs, scheduler, resume, overwrite, not progress)
    nominal = options_of(written_case(case, file), set=set, progress=progress)
    return Uncertainty(folder, run_study(nominal, options))


def _row(run: Mapping[str, Any]) -> dict[str, Any]:
    results = {key: value for key, value in (run["results"] or {}).items() if not isinstance(value, (dict, list))}
    return {"name": run["name"], **run["values"], "state": run["state"], **results}
