"""Writes samples.csv and uncertainty.json, and shows a study on the terminal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import EXIT_DONE, EXIT_NUMERICAL, InputError
from fragfield.files.stamped import read_stamped_json, stamped_json
from fragfield.hazard.certainty import metres
from fragfield.hazard.recommended import parts_words, recommended_of
from fragfield.hazard.site_map import write_contours
from fragfield.hazard.to_apply import distance_to_apply
from fragfield.quantities import column_of, shown
from fragfield.results.hazard import Hazard, Recommended
from fragfield.results.part import to_json
from fragfield.results.rules import Official, Rule
from fragfield.studies.uncertainty.sample import results_of_summary
from fragfield.studies.uncertainty.shares import Analysis, analyse
from fragfield.studies.uncertainty.spread import spread_of, without_statistical_error
from fragfield.version import __version__
from fragfield_base.writing import csv_table, write_text

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from fragfield.files.run_directory import RunDirectory
    from fragfield.studies.uncertainty.plan import Study


RESULT = "uncertainty.json"
_SITE = ("density", "hits", "probability")
_RECOMMENDED = ("recommended", "parts", "not_included")
_LEVELS = (0.01, *(round(0.02 * step, 2) for step in range(1, 50)), 0.99)
_FEWEST = 8  # samples with a result, below which nothing is said


def write_results(
    study: Study, rows: Mapping[int, Mapping[str, Any]], nominal: RunDirectory, folder: Path, cost: Mapping[str, Any]
) -> dict[str, Any]:
    """Write samples.csv and uncertainty.json into the study's folder, the latter and its number into the nominal run.

    Returns
    -------
    dict
        uncertainty.json, see `assess`.
    """
    _write_samples(study, rows, folder)
    found = {**assess(study, rows, nominal.summary()), "nominal_run": str(nominal.path), "cost": dict(cost)}
    text = stamped_json(found)
    write_text(folder / RESULT, text, InputError)
    try:
        nominal.make()
        write_text(nominal.file(RESULT), text, InputError)
        _renew(nominal, found)
    except InputError:  # a run that may only be read
        if not nominal.path.is_dir():
            raise
    return found


def _renew(nominal: RunDirectory, study: Mapping[str, Any]) -> None:
    """The recommended distance with the study, in the nominal run's summary.json and map files."""
    summary = nominal.summary()
    hazard = recommended_of(summary["hazard"], summary.get("convergence"), study)
    nominal.write_summary({**summary, "hazard": hazard, "distance_to_apply": _to_apply(hazard, summary)})
    if nominal.file("contours.geojson").is_file():
        from flight.files.ensemble import read_ensemble
        from fragfield.files.provenance import provenance_of

        case, found = nominal.stored_case(), read_ensemble(nominal.file("ensemble.h5"))[0]
        exposed = summary.get("exposed") or ()
        write_contours(case, found, nominal, provenance_of(case), exposed, hazard["recommended"])


def _to_apply(hazard: Mapping[str, Any], summary: Mapping[str, Any]) -> dict[str, Any]:
    rules = (summary.get("rules") or {}).get("rules") or ()
    official = summary.get("official")
    return to_json(
        distance_to_apply(
            Hazard.read(hazard), official and Official.read(official), [Rule.read(entry) for entry in rules]
        )
    )


def read_results(folder: Path) -> dict[str, Any]:
    """uncertainty.json of a folder, empty where there is none; raises InputError where it is damaged."""
    path = folder / RESULT
    return read_stamped_json(path) if path.is_file() else {}


def assess(study: Study, rows: Mapping[int, Mapping[str, Any]], summary: Mapping[str, Any]) -> dict[str, Any]:
    """What the samples say, with the nominal run's summary.

    Returns
    -------
    dict
        `exit_code` (3 where a sample failed or has no distance), `title`, `inputs`, `design`, `states` (numbers of
        samples by state, and the first messages), `distance` (the expected one) and `exposed` (spread, shares,
        tornado), `hazard`, the recommended distance of the nominal run with its parts, and `distance_to_apply` with it,
        as in summary.json.
    """
    values = [rows.get(number, {}).get("results") or {} for number in range(study.samples)]
    distance = _column(values, "distance")
    known = int(np.isfinite(distance).sum())
    nominal = results_of_summary(summary)
    found: dict[str, Any] = {
        "exit_code": EXIT_DONE if known == study.samples else EXIT_NUMERICAL,
        "program_version": __version__,
        "title": study.case.title,
        "inputs": [entry.described() for entry in study.inputs],
        "design": {
            "samples": study.samples, "seed": study.seed, "bursts": study.bursts,
            "realisations": study.realisations, "geometry": study.geometry,
        },
        "states": _states(study, rows, known),
        "nominal": nominal,
        "distance": None,
        "exposed": [],
        "hazard": None,
    }  # fmt: skip
    if known < _FEWEST:
        found["states"]["reason"] = f"{known} samples gave a distance; at least {_FEWEST} are needed"
        return found
    errors = _column(values, "standard_error")
    found["distance"] = _quantity(study, distance, errors)
    hazard = recommended_of(summary["hazard"], summary.get("convergence"), found)
    found["hazard"] = to_json({name: hazard[name] for name in _RECOMMENDED})
    found["distance_to_apply"] = _to_apply(hazard, summary)
    found["exposed"] = [
        {"name": site["name"]} | {name: _of_site(study, values, number, name, site[name]) for name in _SITE}
        for number, site in enumerate(nominal["exposed"])
    ]
    return found


def _states(study: Study, rows: Mapping[int, Mapping[str, Any]], known: int) -> dict[str, Any]:
    failed = {number: row for number, row in sorted(rows.items()) if row["exit_code"] != EXIT_DONE}
    open_ = [
        number
        for number, row in sorted(rows.items())
        if row["exit_code"] == EXIT_DONE and not row["results"]["determined"]
    ]
    messages = [f"sample {number}: exit code {row['exit_code']}: {row['message']}" for number, row in failed.items()]
    messages += [f"sample {number}: not determined: {rows[number]['results']['reason']}" for number in open_]
    return {
        "done": known, "failed": len(failed), "not_determined": len(open_),
        "missing": study.samples - len(rows), "messages": messages[:10],
    }  # fmt: skip


def _column(values: list[Mapping[str, Any]], name: str) -> NDArray[np.float64]:
    return np.array([math.nan if one.get(name) is None else one[name] for one in values], dtype=np.float64)


def _quantity(study: Study, values: NDArray[np.float64], errors: NDArray[np.float64] | None) -> dict[str, Any]:
    """Spread, shares and tornado of one result."""
    known = np.isfinite(values)
    used = None if errors is None or not np.isfinite(errors[known]).all() else errors[known]
    rng = np.random.default_rng(np.random.SeedSequence([study.seed, 3]))
    spread = spread_of(values[known], used, rng, None if study.burst is None else study.burst[known])
    analysis = analyse(
        [entry.distribution for entry in study.inputs], study.points, values,
        seed=study.seed, burst=study.burst,
    )  # fmt: skip
    own, _ = without_statistical_error(values[known], spread.statistical_error**2)
    entry: dict[str, Any] = {
        "spread": spread.as_dict(),
        "curve": {"level": list(_LEVELS), "value": np.quantile(own, _LEVELS).tolist()},
    }
    if isinstance(analysis, Analysis):
        names = [one.name for one in study.inputs]
        entry["estimator"] = analysis.estimator
        entry["shares"] = [{"name": name, **one} for name, one in zip(names, analysis.shares, strict=True)]
        entry["tornado"] = [{"name": name, **one} for name, one in zip(names, analysis.tornado, strict=True)]
    else:
        entry["estimator"] = {"reason": analysis}
    return entry


def _of_site(
    study: Study, values: list[Mapping[str, Any]], number: int, name: str, nominal: float | None
) -> dict[str, Any] | None:
    """One number of an exposed site, of the samples that have it."""
    sites = [one["exposed"][number] if one.get("exposed") else {} for one in values]
    found = _column(sites, name)
    if np.isfinite(found).sum() < _FEWEST:
        return None
    errors = _column(sites, f"{name}_standard_error")
    return {"nominal": nominal, **_quantity(study, found, errors if np.isfinite(errors).any() else None)}


def _write_samples(study: Study, rows: Mapping[int, Mapping[str, Any]], folder: Path) -> None:
    """One row a sample: its draws, its state and its results."""
    sites = [site["name"] for row in rows.values() for site in (row.get("results") or {}).get("exposed") or []]
    names = list(dict.fromkeys(sites))
    results = ["distance", "standard_error", *(one.name for one in shown("uncertainty"))]
    units = {"distance": "m", "standard_error": "m", "density": "1/m^2"}
    units |= {one.name: one.unit for one in shown("uncertainty")}
    columns = [column_of(name, units.get(name, "")) for name in results]
    heads = ["sample", *(column_of(entry.name, entry.unit) for entry in study.inputs), "state", *columns]
    heads += [f"{site}: {column_of(what, units.get(what, ''))}" for site in names for what in _SITE]
    table: list[list[Any]] = [heads]
    for number in range(study.samples):
        row = rows.get(number)
        found = (row or {}).get("results") or {}
        state = (
            "missing" if row is None else "failed" if not found else "done" if found["determined"] else "not determined"
        )
        at = {site["name"]: site for site in found.get("exposed") or []}
        cells = [number, *study.draws(number), state, *(found.get(name) for name in results)]
        cells += [at.get(site, {}).get(what) for site in names for what in _SITE]
        table.append(cells)
    write_text(folder / "samples.csv", csv_table(table), InputError)


def print_study(found: Mapping[str, Any]) -> None:
    """Print the recommended distance, the shares of the inputs and the exposed sites."""
    from rich.table import Table

    from fragfield.terminal.show import plain_console

    console = plain_console(wide=160)
    states = found["states"]
    lost = states["failed"] + states["not_determined"] + states["missing"]
    if lost:
        console.print(f"{lost} of {found['design']['samples']} samples gave no distance and are left out:")
        for message in states["messages"]:
            console.print(f"  {message}")
    if not found["distance"]:
        console.print(f"no result: {states.get('reason', 'no sample gave a distance')}")
        return
    spread = found["distance"]["spread"]
    console.print(
        f"expected distance over the inputs: 5 % {spread['low']:.1f}, median {spread['median']:.1f}, 95 % "
        f"{spread['high']:.1f} m (± {spread['high_standard_error']:.1f} m for {spread['samples']} samples)"
    )
    table = Table(box=None, pad_edge=False)
    for head in ("input", "share of the variance %", "distance at its 5 and 95 %, m"):
        table.add_column(head, justify="left" if head == "input" else "right")
    for one, bar in zip(found["distance"].get("shares") or [], found["distance"].get("tornado") or [], strict=True):
        share = f"{100 * one['share']:.1f} ± {100 * one['share_standard_error']:.1f}"
        table.add_row(one["name"], share, f"{bar['low']:.1f}  {bar['high']:.1f}")
    console.print(table)
    for site in found["exposed"]:
        if site["hits"] is not None:
            over = site["hits"]["spread"]
            words = f"5 % {over['low']:.3g}, median {over['median']:.3g}, 95 % {over['high']:.3g}"
            console.print(f"{site['name']}: expected hits {words}")
    for words in (found["distance_to_apply"]["line"], *found["distance_to_apply"]["words"]):
        console.print(words)
    hazard = Recommended.read(found["hazard"])
    console.print(f"recommended distance {metres(hazard.recommended)}: {parts_words(hazard)}")
    cost = found["cost"]
    if cost["samples_made_now"]:
        each = cost["wall_seconds"] / cost["samples_made_now"]
        console.print(f"{cost['samples_made_now']} samples in {cost['wall_seconds']:.0f} s, {each:.2f} s each")
    console.print(f"written to {found['directory']}")
