"""The validation behind the report: numbers of checks, and the comparisons that bear on a run."""

from __future__ import annotations

import json
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any, Literal

from fragfield.numbers import number
from fragfield_base.substances import substance_key

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fragfield.interface.results import Run


@cache
def evidence() -> dict[str, Any]:
    """`checks` (passed, judged), `versions`, `revisions` that computed them, and `comparisons`."""
    return dict(json.loads((resources.files("fragfield") / "data" / "evidence.json").read_text(encoding="utf-8")))


def subjects_of(run: Run) -> set[str]:
    """What a run has, in the words of the comparisons."""
    found, case = {"flight"}, run.values
    if "burst" not in run.expected_stages or case is None or case.burst is None:
        return found
    found |= {"burst", "break_up", f"products:{case.burst.products}"}
    meridian = run.summary.burst is not None and run.summary.burst.geometry == "axisymmetric"
    found.add("meridian" if meridian else "three dimensions")
    if len(case.round) > 1 or any(plane.kind == "symmetry" for plane in case.plane):
        found |= {"stack", "collision"}
    if case.plane:
        found.add("collision")
    for one in case.round:
        name = one.explosive if isinstance(one.explosive, str) else one.explosive.name
        found.add(f"explosive:{substance_key(name)}")
        found.add(f"profile:{one.profile.get('name') if isinstance(one.profile, dict) else one.profile}")
    return found


def bearing(run: Run) -> list[Mapping[str, Any]]:
    """Comparisons whose subjects a run has all: of what only such runs have first, then the nearest to a distance."""
    own = subjects_of(run)
    return sorted((row for row in evidence()["comparisons"] if set(row["subjects"]) <= own),
                  key=lambda row: -len(row["subjects"]))  # fmt: skip


def validation_words(run: Run) -> tuple[Literal["warning", "note", "good"], str]:
    """The weight and the words of what the checks mean for a run."""
    (passed, judged), versions, revisions = (evidence()[key] for key in ("checks", "versions", "revisions"))
    version, revision = (run.provenance.get(key, "") for key in ("program_version", "revision"))
    text = f"Validation: {number(passed)} of {number(judged)} checks passed"
    if versions != [version]:
        whose = f"version {version or 'of this result, which is not known'}"
        return "warning", f"{text}, but not all computed by {whose}."
    if revision and not revision.endswith("+") and revisions == [revision]:
        return "good" if passed == judged else "note", f"{text}, computed by the same revision as this result."
    return "note", f"{text}, computed by version {version}, but by another revision of the source than this result."


def shown(row: Mapping[str, Any]) -> tuple[str, str, str, str]:
    """Both values of a comparison, their difference, and the uncertainty that the test states."""
    ours, reference = (f"{number(row[key])} {row['unit']}".strip() for key in ("ours", "reference"))
    error, tolerance = ("–" if row[key] is None else f"{100 * row[key]:.1f} %" for key in ("error", "tolerance"))
    return ours, reference, error.replace("-", "−") if error[0] == "-" else f"+{error}", tolerance
