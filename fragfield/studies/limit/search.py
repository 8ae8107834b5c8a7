"""Search for the largest number of rounds by bisection over runs of a sweep."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import hypot
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.errors import EXIT_DONE, EXIT_NUMERICAL
from fragfield.files.run_directory import RunDirectory
from fragfield.hazard.certainty import metres
from fragfield.studies.limit.criteria import judged
from fragfield.studies.limit.plan import round_count
from fragfield.studies.limit.results import write_limit
from fragfield.studies.sweep.results import FAILED, WAITING
from fragfield.studies.sweep.work import check_directories, make_runs, planned_row

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from fragfield.studies.limit.criteria import LimitCriteria
    from fragfield.studies.sweep.plan import SweepPlan
    from fragfield.studies.sweep.work import SweepOptions


_SIGNIFICANT = 2.0  # standard errors of a difference


def find_limit(
    plan: SweepPlan, criteria: LimitCriteria, options: SweepOptions, *, every: bool = False
) -> dict[str, Any]:
    """Compute the smallest and the largest number of rounds, then halve the interval between met and not met.

    A number that fails, or whose distance is not determined, counts as not met.

    Parameters
    ----------
    plan : SweepPlan
        Runs in the order of their number of rounds, from `plan_limit`.
    criteria : LimitCriteria
        What is to be met.
    options : SweepOptions
        Folder, threads, resume and so on, as of a sweep.
    every : bool
        Compute every number instead.

    Returns
    -------
    dict
        `directory`, `case_file`, `key`, `criteria`, `limit` (value, rounds, explosive, run; None where not even the
        smallest meets them), `first_not_met` (the same; None where all meet them), `words`, `exit_code` (3 where a run
        failed or has no distance) and `runs`: those computed, as in a sweep, with `rounds`, `met` and what `judged`
        gives.

    Raises
    ------
    InputError
        A directory holds another case's run and `overwrite` is not asked for, or cannot be written.
    """
    options = replace(options, keep_runs=True)  # each is judged by all of its summary
    check_directories(plan, options)
    key = plan.keys[0]
    rows = [{**planned_row(one, options), "rounds": round_count(one.case), "met": None} for one in plan.runs]
    found: dict[str, Any] = {
        "directory": str(options.folder), "case_file": str(plan.case_file), "key": key, "criteria": criteria.words,
        "limit": None, "first_not_met": None, "words": [], "exit_code": EXIT_DONE, "runs": [],
    }  # fmt: skip

    def compute(*numbers: int) -> None:
        some = replace(plan, runs=tuple(plan.runs[number] for number in numbers))
        make_runs(some, [rows[number] for number in numbers], options)
        for number in numbers:
            _judge(rows[number], criteria)
        found["runs"] = [row for row in rows if row["state"] != WAITING]
        found.update(limit_of(found["runs"], key, asked=[row["rounds"] for row in rows]))
        write_limit(found, options.folder)

    last = len(rows) - 1
    compute(*(range(last + 1) if every else (0, last)))
    low, high = 0, last
    while not every and rows[0]["met"] and not rows[last]["met"] and high - low > 1:
        middle = (low + high) // 2
        compute(middle)
        low, high = (middle, high) if rows[middle]["met"] else (low, middle)
    return found


def _judge(row: dict[str, Any], criteria: LimitCriteria) -> None:
    """Fill a row with the run's quantities and whether it meets the criteria."""
    summary: Mapping[str, Any] = RunDirectory(Path(row["directory"])).summary() if row["state"] != FAILED else {}
    row.update(judged(summary, criteria))
    if row["state"] == FAILED:
        row["reasons"] = [f"the run failed: {row['message']}"]
    row["met"] = not row["reasons"]


def limit_of(rows: Sequence[Mapping[str, Any]], key: str, *, asked: Sequence[int]) -> dict[str, Any]:
    """The limit by the computed rows, in the order of their rounds, with sentences and exit code.

    The limit is the largest number up to which every computed one meets the criteria. `asked` are all numbers of rounds
    that were asked for.
    """
    met_up_to, first_not_met = None, None
    for row in rows:
        if not row["met"]:
            first_not_met = row
            break
        met_up_to = row
    words = []
    if met_up_to is None:
        words.append(f"Not even the smallest number, {asked[0]}, meets the criteria.")
    elif first_not_met is None:
        words.append(f"The largest number asked for, {asked[-1]}, meets the criteria; more may do so too.")
    elif first_not_met["rounds"] > met_up_to["rounds"] + 1:
        between = f"between {met_up_to['rounds']} and {first_not_met['rounds']} rounds"
        known = not any(met_up_to["rounds"] < number < first_not_met["rounds"] for number in asked)
        words.append(f"Nothing {between} was {'asked for' if known else 'computed'}.")
    computed = {row["rounds"] for row in rows}
    below = [number for number in asked if met_up_to is not None and number < met_up_to["rounds"]]
    left_out = [number for number in below if number not in computed]
    if left_out:
        words.append(
            f"Not computed, and taken to meet the criteria since a larger number does: {_listed(left_out)} rounds "
            "(--all computes every one)."
        )
    words += _not_monotonic(rows)
    if met_up_to is not None and met_up_to["to_apply"] is not None and met_up_to["to_apply"] > met_up_to["recommended"]:
        words.append(
            f"At the limit the distance to apply for storage and handling is {metres(met_up_to['to_apply'])}, more "
            f"than the recommended {metres(met_up_to['recommended'])}."
        )
    failed = any(row["exit_code"] not in (EXIT_DONE, None) for row in rows)
    return {
        "limit": _named(met_up_to, key), "first_not_met": _named(first_not_met, key), "words": words,
        "exit_code": EXIT_NUMERICAL if failed else EXIT_DONE,
    }  # fmt: skip


def _listed(numbers: Sequence[int]) -> str:
    return (
        ", ".join(map(str, numbers)) if len(numbers) <= 6 else f"{numbers[0]} to {numbers[-1]}, {len(numbers)} of them"
    )


def _named(row: Mapping[str, Any] | None, key: str) -> dict[str, Any] | None:
    if row is None:
        return None
    return {"value": row["values"][key], **{name: row[name] for name in ("rounds", "explosive", "recommended")},
            "run": row["directory"]}  # fmt: skip


def _not_monotonic(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Where more rounds have a smaller distance, or meet what fewer do not; bisection rests on neither happening."""
    words = []
    known = [row for row in rows if row["recommended"] is not None]
    for fewer, more in pairwise(known):
        drop = fewer["recommended"] - more["recommended"]
        if drop <= 0.0:
            continue
        error = hypot(fewer["standard_error"] or 0.0, more["standard_error"] or 0.0)
        how = "within the statistical error" if drop <= _SIGNIFICANT * error else "beyond the statistical error"
        words.append(
            f"Not monotonic: {more['rounds']} rounds have a recommended distance of {metres(more['recommended'])}, "
            f"{fewer['rounds']} have {metres(fewer['recommended'])} ({how})."
        )
    for fewer, more in pairwise(rows):
        if more["met"] and not fewer["met"]:
            words.append(
                f"Not monotonic: {more['rounds']} rounds meet the criteria, {fewer['rounds']} do not; the limit is "
                "below the smallest that does not."
            )
    return words
