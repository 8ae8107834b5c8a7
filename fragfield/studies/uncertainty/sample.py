"""One sample: burst, break-up and flight of its case; only numbers are kept."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.quantities import shown
from fragfield.studies.numbers import answer_of, burst_of, flown_parts, shared_burst

if TYPE_CHECKING:
    from collections.abc import Mapping


def perform_sample(request: dict[str, Any]) -> tuple[int, str]:
    """Make a sample in this process; exit code, and its results as JSON, or why there are none.

    `request`: `case`: the tables of its resolved case; `scratch`: a folder for the burst's files, which are removed, or
    one that is not there, for the machine's own folder; `burst`: run directory of a burst that is shared, or None.
    """
    return answer_of(lambda: _made(request))


def _made(request: Mapping[str, Any]) -> dict[str, Any]:
    from fragfield.case.load import case_from_document

    case = case_from_document(request["case"], source="sample", folder=Path())
    shared = request.get("burst")
    burst = shared_burst(Path(shared)) if shared else burst_of(case, Path(request["scratch"]))
    return results_of_summary(flown_parts(case, burst, sample=True))


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
