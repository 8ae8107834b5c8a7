"""The validation behind the report: numbers of checks, and the comparisons that bear on a run."""

from __future__ import annotations

import json
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Literal, NamedTuple

from fragfield.numbers import number
from fragfield_base.substances import substance_key

if TYPE_CHECKING:
    from fragfield.results.run import StoredRun


class Comparison(NamedTuple):
    """A value of a validation case beside that of the test; `error` and the test's own uncertainty are fractions."""

    case: str
    quantity: str
    ours: float
    reference: float
    unit: str
    error: float
    tolerance: float | None
    source: str
    subjects: tuple[str, ...]

    @property
    def cells(self) -> tuple[str, str, str, str]:
        """Both values, their difference, and the uncertainty that the test states."""
        ours, reference = (f"{number(value)} {self.unit}".strip() for value in (self.ours, self.reference))
        tolerance = "–" if self.tolerance is None else f"{100 * self.tolerance:.1f} %"
        return ours, reference, f"{100 * self.error:+.1f} %".replace("-", "−"), tolerance


class Evidence(NamedTuple):
    """Checks passed and judged, versions and revisions that computed them, and the comparisons."""

    checks: tuple[int, int]
    versions: list[str]
    revisions: list[str]
    comparisons: list[Comparison]


@cache
def evidence() -> Evidence:
    """Those that come with the program."""
    found = json.loads((resources.files("fragfield") / "data" / "evidence.json").read_text(encoding="utf-8"))
    return Evidence(**found | {"comparisons": [Comparison(**one) for one in found.pop("comparisons")]})


def subjects_of(run: StoredRun) -> set[str]:
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


def bearing(run: StoredRun) -> list[Comparison]:
    """Comparisons whose subjects a run has all: of what only such runs have first, then the nearest to a distance."""
    own = subjects_of(run)
    fitting = (one for one in evidence().comparisons if own.issuperset(one.subjects))
    return sorted(fitting, key=lambda one: -len(one.subjects))


def validation_words(run: StoredRun) -> tuple[Literal["warning", "note", "good"], str]:
    """The weight and the words of what the checks mean for a run."""
    (passed, judged), versions, revisions, _ = evidence()
    version, revision = (run.provenance.get(key, "") for key in ("program_version", "revision"))
    text = f"Validation: {number(passed)} of {number(judged)} checks passed"
    if versions != [version]:
        whose = f"version {version or 'of this result, which is not known'}"
        return "warning", f"{text}, but not all computed by {whose}."
    if revision and not revision.endswith("+") and revisions == [revision]:
        return "good" if passed == judged else "note", f"{text}, computed by the same revision as this result."
    return "note", f"{text}, computed by version {version}, but by another revision of the source than this result."
