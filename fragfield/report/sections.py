"""The sections of the report in their order: what the template of each shows, from a run's files."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.case.conversion.attitude import attitude_of, attitude_words
from fragfield.case.conversion.surroundings import air_words, wind_words
from fragfield.hazard.recommended import RULE
from fragfield.hazard.to_apply import USES
from fragfield.numbers import SPACE, UNKNOWN, Row, number
from fragfield.pipeline.grid_convergence import KINDS
from fragfield.quantities import numbers_of, shown
from fragfield.report import evidence, statements
from fragfield.report.figures.site import site_shapes
from fragfield.report.findings import counted_groups, findings
from fragfield.report.statements import reasons_against, reasons_for
from fragfield.results.words import basis_words, distances, headline, parts_of, parts_words, whole_metres
from fragfield_base.substances import substance_title

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from fragfield.case import CaseTable
    from fragfield.quantities import Quantity
    from fragfield.results.convergence import ConvergedQuantity
    from fragfield.results.run import StoredRun
    from fragfield.results.uncertainty import UncertaintyResult

    Context = Callable[[StoredRun], dict[str, Any] | None]


@dataclass(frozen=True)
class Section:
    """A numbered section, or an annex with a letter; its template is templates/KEY.html."""

    key: str
    title: str
    context: Context
    """What its template shows; None leaves the section out."""
    stage: str = ""
    """Without which it says that this stage has not been run; an annex is left out then."""
    annex: bool = False


SECTIONS: list[Section] = []
"""Of the report, in order."""


def section(key: str, title: str, *, stage: str = "", annex: bool = False) -> Callable[[Context], Context]:
    """Enter a function as a section."""

    def enter(function: Context) -> Context:
        SECTIONS.append(Section(key, title, function, stage, annex))
        return function

    return enter


_GRAVEST = ("not met", "not determined", "not shown", "met")
_MOST_SITES = 8  # that the first page shows


@section("decision", "Decision")
def _decision(run: StoredRun) -> dict[str, Any]:
    entries = sorted(run.summary.exposed or (), key=lambda one: _GRAVEST.index(one.verdict))
    left, to_apply = len(entries) - _MOST_SITES, run.summary.distance_to_apply
    return {
        "distances": list(_decided(run)),
        "to_apply": to_apply.words if to_apply else (),
        "prescribed": list(prescribed_lines(run)),
        "what": list(_what_was_computed(run)),
        "verdicts": entries[:_MOST_SITES],
        "verdict_note": "Part: upper bound (95 %) of the expected value over the site's limit. “Not shown”: the "
        "expected value meets the criterion, its bound does not."
        + (f" {number(left)} more sites are in the annex, none of a graver verdict." if left > 0 else ""),
        "trust": reasons_for(run),
        "doubt": reasons_against(run, findings(run)),
    }


def _decided(run: StoredRun) -> Iterator[tuple[str, str, str, str]]:
    if part := run.summary.distance_to_apply:
        yield "Distance to apply", part.distances, "", ""
    hazard, shown = run.summary.hazard, headline(run.summary.hazard)
    basis = f". Basis: {basis_words(hazard)}." if hazard and hazard.determined else ""
    yield "Computed: recommended distance", shown.value, shown.unit, f"{shown.note}{basis}"


def prescribed_lines(run: StoredRun) -> Iterator[tuple[str, str, str]]:
    """Distances that an authority publishes for the round, and the largest rule in range of each kind."""
    official, listed = run.summary.official, run.summary.rules.rules if run.summary.rules else ()
    if official and official.hazardous_fragment_distance is not None:
        words = "Official hazardous fragment distance"
        yield words, whole_metres(official.hazardous_fragment_distance), official.source
    if official and official.maximum_fragment_distance is not None:
        yield "Official maximum fragment distance", whole_metres(official.maximum_fragment_distance), official.source
    for use, title in USES.items():
        for against in ("fragments", "blast"):
            inside = [
                (one.distance, one.name) for one in listed
                if one.use == use and one.hazard == against and one.distance is not None
            ]  # fmt: skip
            if inside:
                distance, name = max(inside, key=lambda one: one[0])
                yield f"{title[0].upper()}{title[1:]}, {against}", whole_metres(distance), name


def _what_was_computed(run: StoredRun) -> Iterator[Row]:
    case = run.values
    if run.fragments_file is not None:
        yield Row("Fragments", f"of {run.fragments_file}; no burst was computed")
    else:
        yield from _round_rows(run)
    rules, hazard = run.summary.rules, run.summary.hazard
    if contents := rules.contents if rules else None:
        yield Row(
            "Net explosive quantity",
            f"{number(contents.explosive, 3)} kg (TNT equivalent {number(contents.tnt, 3)} kg)",
        )
    if hazard is not None:
        yield Row("Attitude and height", attitude_words(hazard.attitude))
    elif case is not None:
        yield Row("Attitude and height", attitude_words(attitude_of(case, given=run.fragments_file is not None)))
    if case is None:
        return
    yield from _site(case)
    criteria = run.criteria
    yield Row("Criterion", f"{criteria.energy:.3g} J, 1 per {1.0 / criteria.density:.1f} m²")
    if case.burst is not None and run.fragments_file is None:
        size = f"{number(1e3 * case.burst.cell_size, 3)} mm"
        geometry = f", {run.summary.burst.geometry}" if run.summary.burst else ""
        yield Row("Cell size", f"{size}; grid convergence: {case.burst.convergence}{geometry}")
    if hazard is not None:
        yield Row("Realisations", number(hazard.realisations))


def _round_rows(run: StoredRun) -> Iterator[Row]:
    kinds: dict[tuple[str, str, str], list[str]] = {}
    for item in run.rounds:
        casing, charge = number(item.casing_mass, 3), number(item.charge_mass, 3)
        entry = next((one for one in (run.values.round if run.values else []) if one.name == item.name), None)
        named = getattr(entry, "casing", None)
        material = f" of {getattr(named, 'name', named)}" if named is not None else ""
        fill = f"{substance_title(item.explosive)}, {charge} kg"
        kinds.setdefault((item.profile, fill, f"{casing} kg{material}"), []).append(item.name)
    if not kinds:
        yield Row("Round", "this directory contains no burst")
    for (profile, fill, casing), names in kinds.items():
        listed = ", ".join(names) if len(names) <= 4 else f"{names[0]} … {names[-1]} ({len(names)} rounds)"
        yield Row("Round", f"{listed}{f' ({profile})' if profile else ''}{', each' if len(names) > 1 else ''}")
        yield Row("Fill", fill)
        yield Row("Casing", casing)
    if kinds:
        images = sum(bool(one.mirror_of) for one in run.summary.break_up.rounds) if run.summary.break_up else 0
        behind = f"; {number(images)} more behind planes of symmetry" if images else ""
        yield Row("Number of rounds", f"{number(len(run.rounds))}{behind}")


def _site(case: CaseTable) -> Iterator[Row]:
    ground = case.flight.ground
    ricochet = "no ricochet" if ground.ricochet == "none" else f"ricochet off {ground.ricochet.replace('_', ' ')}"
    yield Row("Ground", f"{'map of heights' if ground.map is not None else 'flat'}, {ricochet}")
    yield Row("Wind", wind_words(case))
    yield Row("Air", air_words(case))
    stops = [f"{one.kind} {one.name}" for one in case.obstacle]
    shown = ", ".join(stops) if len(stops) <= 4 else f"{', '.join(stops[:4])} and {len(stops) - 4} more"
    yield Row("Barricades and buildings", shown or "none")
    if case.site is not None:
        latitude, longitude = (math.degrees(angle) for angle in (case.site.latitude, case.site.longitude))
        yield Row("Site", f"{latitude:.5f}°, {longitude:.5f}°")


@section("rounds", "Rounds")
def _rounds(run: StoredRun) -> dict[str, Any] | None:
    return {} if run.fragments_file is None else None


@section("hazard", "Distances and site", stage="flight")
def _hazard(run: StoredRun) -> dict[str, Any]:
    hazard, broken = run.summary.hazard, run.summary.break_up
    note = (
        f"{RULE} ± is the standard error: over the sets of points of an integral or of weighted fragments, else over "
        "the realisations."
    )
    if broken and broken.tilt_deviation:
        note += (
            " Every realisation is tilted at random from the vertical, by a standard deviation of "
            f"{np.degrees(broken.tilt_deviation):.3g}° about each horizontal axis (break_up.tilt, a judgement)."
        )
    return {
        "distances": [one[:3] for one in distances(hazard)] if hazard else [],
        "distance_note": note if hazard and hazard.determined else "",
        "has_map": site_shapes(run) is not None,
    }


@section("warnings", "Warnings, checks and limits")
def _warnings(run: StoredRun) -> dict[str, Any]:
    terms = (terms,) if (terms := statements.summary_terms(run)) else ()
    return {
        "found": findings(run),
        "limits": (*terms, *statements.limits(run)),
        "may": statements.MAY_BE_USED_FOR,
        "must_not": statements.MUST_NOT_BE_USED_FOR,
    }


@section("fragments", "Fragments", stage="break-up")
def _fragments(run: StoredRun) -> dict[str, Any]:
    test = run.summary.break_up.mean_mass.test if run.summary.break_up else None
    groups = counted_groups(test) if test else []
    return {"test": test, "groups": [(name, number(seen, 4), number(known, 4)) for name, seen, known in groups]}


@section("speeds", "Burst and speeds", stage="burst")
def _speeds(run: StoredRun) -> dict[str, Any] | None:
    return {} if "burst" in run.expected_stages else None


@section("convergence", "Grid convergence", stage="flight")
def _convergence(run: StoredRun) -> dict[str, Any] | None:
    if "burst" not in run.expected_stages:
        return None
    found, burst = run.summary.convergence, run.summary.burst
    if found is None or found.sizes is None:
        return {"reason": found.reason if found else "", "head": ()}
    own, followed = burst.cell_size if burst else 0.0, {one.name: one for one in shown("convergence")}
    sizes = [
        f"{number(1e3 * size, 3)}{SPACE}mm{' (this run)' if abs(size - own) < 1e-9 else ''}" for size in found.sizes
    ]
    lines = [_convergence_line(followed[name], entry) for name, entry in (found.quantities or {}).items()]
    head = ("Quantity", *sizes, "order", "limit", "uncertainty", "")
    return {"reason": found.reason, "head": head, "lines": lines}


def _convergence_line(followed: Quantity, entry: ConvergedQuantity) -> tuple[str, ...]:
    factor, unit = (1e3, "mm") if followed.path == "burst.outer_diameter" else (1.0, followed.unit)
    errors = entry.standard_errors or [None] * len(entry.values)
    values = [
        UNKNOWN if value is None
        else number(factor * value, 4) + ("" if error is None else f"{SPACE}±{SPACE}{number(factor * error, 2)}")
        for value, error in zip(entry.values, errors, strict=True)
    ]  # fmt: skip
    limit, uncertainty = (
        "–" if value is None else number(factor * value, digits)
        for value, digits in ((entry.extrapolated, 4), (entry.uncertainty, 2))
    )
    order = "–" if entry.order is None else number(entry.order, 2)
    return (f"{followed.label}{f' ({unit})' if unit else ''}", *values, order, limit, uncertainty, KINDS[entry.kind])


_ESTIMATOR = (
    "By regression of the ranks of {samples} samples on the inputs; it leaves {left} % of their variance: joint "
    "effects, effects that are not monotone, and statistical errors of the samples. Errors by bootstrap."
)
_APPLIES = {"value": "", "factor": "factor on the case's value: ", "shift": "added to the case's value: "}


@section("uncertainty", "Uncertainty of the inputs")
def study(run: StoredRun) -> dict[str, Any] | None:
    """A study of uncertainty: the recommended distance with its parts, shares of the inputs, and their sources."""
    if (found := run.study) is None:
        return None
    shown_inputs = {"study": found, "inputs": [*_uncertain_inputs(found)], "places": [*_places(found)]}
    if (entry := found.distance) is None or (hazard := found.hazard) is None:
        return shown_inputs
    spread, estimator = entry.spread, entry.estimator
    span = f"{whole_metres(spread.low)}{SPACE}–{SPACE}{whole_metres(spread.high)}"
    error, what = f"± {spread.median_standard_error:.1f}", "taken out" if spread.resolved else "included"
    shares = [
        (
            one.name,
            f"{100 * one.share:.1f}{SPACE}±{SPACE}{100 * one.share_standard_error:.1f}",
            f"{100 * one.share_low:.0f}{SPACE}–{SPACE}{100 * one.share_high:.0f}",
        )
        for one in sorted(entry.shares, key=lambda one: -one.share)
    ]
    left = f"{100 * (1.0 - (estimator.explained or 0.0)):.0f}"
    return shown_inputs | {
        "cards": (
            ("Recommended distance", whole_metres(hazard.recommended), "m", parts_words(hazard)),
            ("Median over the inputs", whole_metres(spread.median), "m", f"{error} m for the number of samples"),
            ("5 to 95 % over the inputs", span, "m", f"statistical errors of the samples {what}"),
        ),
        "parts": [
            *((one.words, "–" if one.value is None else f"{one.value:.1f}", one.reason) for one in parts_of(hazard)),
            ("recommended distance", f"{hazard.recommended:.1f}", ""),
        ],
        "rule": RULE,
        "shares": shares,
        "estimator": _ESTIMATOR.format(samples=estimator.samples, left=left) if shares else "",
    }


def _places(found: UncertaintyResult) -> Iterator[tuple[str, ...]]:
    for site in found.exposed:
        for entry, words in (
            (site.density, "density (1/m²)"), (site.hits, "expected hits"), (site.probability, "probability of a hit"),
        ):  # fmt: skip
            if entry is None:
                continue
            largest = max(entry.shares, key=lambda one: one.share, default=None)
            most = "–" if largest is None else f"{largest.name} ({100 * largest.share:.0f}{SPACE}%)"
            values = (entry.nominal, entry.spread.low, entry.spread.median, entry.spread.high)
            yield (site.name, words, *(f"{value:.3g}" for value in values), most)


def _uncertain_inputs(found: UncertaintyResult) -> Iterator[Row]:
    for entry in found.inputs:
        more = f" and {len(entry.keys) - 2} more" if len(entry.keys) > 2 else ""
        words, source = (text[:1].upper() + text[1:] for text in (_APPLIES[entry.applies] + entry.words, entry.source))
        yield Row(
            entry.name[:1].upper() + entry.name[1:],
            f"{words}. Key: {', '.join(entry.keys[:2])}{more}. {source}",
            note="judgement" if entry.judgement else "",
        )


STUDY = (
    Section("study", "The recommended distance", study),
    Section("shares", "What moves it", lambda run: study(run) if run.study and run.study.distance else None),
    Section("uncertain-inputs", "Uncertain inputs", study),
)
"""Of the page of a study of uncertainty."""


@section("distances", "Rules and exposed sites", annex=True)
def _rules(run: StoredRun) -> dict[str, Any] | None:
    """The distance of every rule and what it rests on, all numbers of every exposed site, and how walls were judged."""
    rules, entries = run.summary.rules, run.summary.exposed or ()
    if rules is None and not entries:
        return None
    without = "; ".join(f"{one.name}: {one.no_margin}" for one in entries if one.no_margin)
    judged = [one for one in entries if one.not_stopped]
    return {
        "rules": rules,
        "exposed": entries,
        "exposed_note": f"Expected value and, after it, its upper bound (95 %), over "
        f"{number(entries[0].realisations)} realisations, along the computed paths: barricades, terrain and "
        "obstacles shield. Of a site in the open the worst place of the size of a person or a vehicle counts; where "
        "all azimuths are alike, densities are those over all azimuths. Hits on people and vehicles: assuming that all "
        "are present; on a building: on its walls and roof. Margin: from the nearest edge to the line of the expected "
        "density (its bound by direction), negative inside." + (f" Without a margin: {without}." if without else "")
        if entries
        else "",
        "judged": judged,
        "barrier_sources": "; ".join(sorted({source for one in judged for source in (one.barrier or {}).values()})),
    }


@section("numbers", "Numbers of the run", annex=True)
def _numbers(run: StoredRun) -> dict[str, Any] | None:
    """Those that the terminal lists; all else is in summary.json and the tables of the run."""
    recovered = run.summary.flight.recovered if run.summary.flight else None
    if not (numbers := [*numbers_of(run.summary)]):
        return None
    return {
        "numbers": numbers,
        "rounds": run.summary.burst.rounds if run.summary.burst else (),
        "note": recovered.words if recovered else "",
    }


@section("validation", "Validation of this version", annex=True)
def _validation(run: StoredRun) -> dict[str, Any]:
    rows = evidence.bearing(run)
    sources = dict.fromkeys(f"{one.case}: {one.source}" for one in rows)
    return {
        "words": evidence.validation_words(run)[1],
        "comparisons": [(one, *one.cells) for one in rows],
        "sources": f"{'; '.join(sources)}.",
    }


@section("provenance", "Versions and files", annex=True)
def _provenance(run: StoredRun) -> dict[str, Any]:
    known = {
        "program": "Program", "program_version": "Version", "revision": "Revision", "date": "Date (UTC)",
        "seed": "Seed", "platform": "Platform",
    }  # fmt: skip
    rows = [Row(words, run.provenance[key]) for key, words in known.items() if run.provenance.get(key)]
    versions = run.summary.versions or json.loads(run.provenance.get("versions") or "{}")
    rows += [Row(f"Version of {name}", str(value)) for name, value in versions.items() if name != "fragfield"]
    return {"program": rows, "files": [*_files(run.path)]}


def _files(folder: Path) -> Iterator[tuple[str, str, str]]:
    for path in sorted(folder.iterdir()):
        if path.is_file() and path.suffix in {".toml", ".json", ".h5", ".csv", ".xdmf"}:
            size = path.stat().st_size
            yield path.name, number(size), "too large" if size > 200_000_000 else digest_of(path)


def digest_of(path: Path) -> str:
    """First 16 digits of a file's SHA-256."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


@section("inputs", "Inputs as resolved", annex=True)
def _inputs(run: StoredRun) -> dict[str, Any]:
    return {"case_text": None if run.values is None else run.case_text}
