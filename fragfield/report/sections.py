"""The sections of the report in their order: what the template of each shows, from a run's files."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.case.tables.round import ExplosiveTable
from fragfield.hazard.recommended import RULE
from fragfield.hazard.to_apply import USES
from fragfield.hazard.verdict import exposed_rounds
from fragfield.numbers import SPACE, UNKNOWN, Row, number, row
from fragfield.pipeline.grid_convergence import KINDS
from fragfield.quantities import shown
from fragfield.report import evidence, statements
from fragfield.report.figures.site import site_shapes
from fragfield.report.findings import counted_groups, findings
from fragfield.report.first_page import what_was_computed
from fragfield.report.statements import reasons_against, reasons_for
from fragfield.report.study import of_distance, study
from fragfield.results.part import to_json
from fragfield.results.words import basis_words, distances, headline, metres_and_error, whole_metres
from fragfield_base.substances import substance_title

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from pathlib import Path

    from fragfield.quantities import Quantity
    from fragfield.results.convergence import ConvergedQuantity
    from fragfield.results.run import StoredRun

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
STUDY = (
    Section("study", "The recommended distance", study),
    Section("shares", "What moves it", of_distance),
    Section("uncertain-inputs", "Uncertain inputs", study),
)
"""Of the page of a study of uncertainty."""


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
        "what": list(what_was_computed(run)),
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


section("uncertainty", "Uncertainty of the inputs")(study)


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


@section("flight", "Flight", annex=True)
def _flight(run: StoredRun) -> dict[str, Any] | None:
    flight = run.summary.flight
    if flight is None:
        return None
    area, rows = flight.presented_area, [*catalogue(run, "flight", "flight.recovered", "flight.contact")]
    words = area.model + (" " + ":".join(f"{ratio:g}" for ratio in area.ratios) if area.ratios else "")
    words += f", spread {area.spread:g}" if area.spread is not None else ""
    low, high = number(area.shape_factor_5_percent), number(area.shape_factor_95_percent)
    factors = f"{low} kg/m³" if low == high else f"{low} to {high} kg/m³ for 90 % of the fragments"
    rows.append(row("Presented areas", words, "", f"shape factor {factors}"))
    rows += [row(f"Fragments through “{one.name}”", one.hits) for one in run.summary.witness or ()]
    return {
        "flight_rows": rows, "obstacles": run.summary.obstacle or (), "directed": "flight" not in run.missing,
        "has_map": site_shapes(run) is not None,
    }  # fmt: skip


@section("break-up", "Break-up", stage="break-up", annex=True)
def _break_up(run: StoredRun) -> dict[str, Any] | None:
    if (launched := run.launched) is None:
        return None
    mass, speed = launched.mass, launched.speed
    rows = [
        row("Fragments", len(mass)),
        row("Mass of all", float(mass.sum()), "kg"),
        row("Mean mass", float(mass.mean()) if len(mass) else None, "kg"),
        row("Heaviest", float(mass.max(initial=0.0)), "kg"),
        row("Fastest", float(speed.max(initial=0.0)), "m/s"),
    ]
    return {"fragment_rows": [*rows, *(catalogue(run, "break_up") if run.fragments_file is None else ())]}


@section("burst", "Burst", stage="burst", annex=True)
def _burst(run: StoredRun) -> dict[str, Any] | None:
    from burst_fenicsx.symmetry import symmetry_words

    burst = run.summary.burst
    if "burst" not in run.expected_stages or burst is None:
        return None
    size = burst.cell_size
    rows = [row("Cell size", size, "m"), *(line for one in shown("mesh", "burst") for line in one.rows(run.summary))]
    words = {"3d": "three dimensions", "axisymmetric": "axisymmetric"}[burst.geometry]
    rows.append(row("Geometry of the burst", words, "", burst.geometry_reason))
    for line in symmetry_words(to_json(burst.symmetry)):
        head, _, rest = line.partition(": ")
        rows.append(Row(head.capitalize(), rest))
    for one in shown("report", "burst.contact", "burst.passed_through"):
        overlap = one.of(run.summary) if size and one.unit == "m" else None
        note = f"{number(100 * overlap / size, 2)} % of a cell" if overlap and size else ""
        rows += [Row(line.name, line.value, line.si, note) for line in one.rows(run.summary)]
    charges = [entry.explosive for entry in run.values.round] if run.values is not None else []
    sources = {one.critical_energy_source for one in charges if isinstance(one, ExplosiveTable)} - {""}
    fills = {one.name: substance_title(one.explosive) for one in run.rounds}
    lines = [
        (
            one.name, fills.get(one.name, "–"), number(one.casing_mass, 4), number(one.charge_mass, 4),
            number(one.charge_mass / one.casing_mass, 3), number(round(one.mean_initial_speed)),
            number(round(one.max_initial_speed)), number(round(1e3 * one.outer_diameter)),
            number(100 * one.products_balance, 4),
        )
        for one in burst.rounds
    ]  # fmt: skip
    return {
        "mesh_rows": rows, "rounds": burst.rounds, "round_lines": lines,
        "exposures": list(exposed_rounds(burst.rounds)),
        "exposure_note": " ".join([_EXPOSURE_NOTE, *sorted(sources)]),
    }  # fmt: skip


_EXPOSURE_NOTE = (
    "Strongest pulse: that of the most energy per area, the integral of p²/(ρ₀U) while a cell's pressure stays above "
    "the floor (Walker and Wasley 1969), in the unreacted charge, as the constant pressure and the time that have the "
    "same integrals of p and p². Published energies depend on how the charge was made. Largest cells: those that "
    "resolve the pulse."
)


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


@section("attitudes", "Distance by attitude", annex=True)
def _attitudes(run: StoredRun) -> dict[str, Any] | None:
    curve = run.summary.hazard.attitude.curve if run.summary.hazard else ()
    if not curve:
        return None
    rolled = any(one.roll_deg for one in curve)
    head = (
        "Inclination (°)", *(("Roll (°)",) if rolled else ()), "Expected distance (m), upper bound",
        "Of the expected density", "Worst direction from the nose (°)", "Realisations",
    )  # fmt: skip
    lines = [
        (
            number(one.inclination_deg, 4), *((number(one.roll_deg, 4),) if rolled else ()),
            whole_metres(one.upper), metres_and_error(one.expected, one.standard_error, SPACE),
            "all alike" if one.direction_deg is None else f"{one.direction_deg:g}", number(one.realisations),
        )
        for one in curve
    ]  # fmt: skip
    return {"head": head, "lines": lines}


def catalogue(run: StoredRun, *parts: str) -> Iterable[Row]:
    """What the catalogue lists of parts of the summary in a report."""
    return [line for one in shown("report", *parts) for line in one.rows(run.summary)]
