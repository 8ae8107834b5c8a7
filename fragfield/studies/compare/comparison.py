"""The comparison of two runs as nested tables, and the same as flat rows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.hazard.exposed import NORMAL_95
from fragfield.hazard.verdict import part_of_criterion
from fragfield.quantities import shown, value_at
from fragfield.report.tables.zones import wide_zones
from fragfield.studies.compare.runs import check_alike, differences_of, notes_on, read_compared_run
from fragfield.studies.compare.witness import Estimates, compare_hits, compared, sectors_together

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from flight.hazard.density.distance import ExpectedDistance
    from flight.hazard.ensemble import EnsembleHazard
    from fragfield.studies.compare.runs import ComparedRun


DENSITIES = ("ground_density", "normal_density")
"""Hazardous fragments (1/m2) by area of ground and normal to paths, over all azimuths or in the worst direction."""


def compare_runs(
    run_folder: Path, reference_folder: Path, *, sector: float | None = None, all_round: bool = False
) -> dict[str, Any]:
    """Divide what a run gave by what a reference run gave.

    Parameters
    ----------
    run_folder, reference_folder : Path
        Run directories with the same witness surfaces.
    sector : float, optional
        Width of the azimuth sectors (degrees); see `witness.sectors_together`.
    all_round : bool
        Divide hits by the reference's mean over all azimuths.

    Returns
    -------
    dict
        `run` and `reference` (directory, title, seed, realisations, program_version), `differences` of the cases (one
        line a key), `notes`, `all_round`, `casing` (rows: quantity, unit, run, reference, ratio), `witness` (a surface
        each: name, and as `witness.compare_hits`), `distances`, `by_distance`, `by_zone` (polar zones of arena tables),
        `places` (exposed ones). Values in SI; None where unknown.

    Raises
    ------
    InputError
        A directory is no run, the witness surfaces differ, or the sector is not possible.
    """
    run, reference = read_compared_run(run_folder), read_compared_run(reference_folder)
    check_alike(run, reference)
    surfaces = [name for name in run.hits if name in reference.hits]
    together = [sectors_together(run.hits[name].shape[1], sector) for name in surfaces]
    notes, by_distance = notes_on(run, reference), []
    if run.hazard is not None and reference.hazard is not None:
        by_distance = _densities(run.hazard, reference.hazard)
        if not by_distance:
            notes.append("densities are not compared: hazard.distance_cell differs")
    return {
        "run": run.described(),
        "reference": reference.described(),
        "differences": differences_of(run, reference),
        "notes": notes,
        "all_round": all_round,
        "casing": list(_casings(run, reference)),
        "witness": [
            {"name": name, **compare_hits(run.hits[name], reference.hits[name], number, all_round=all_round)}
            for name, number in zip(surfaces, together, strict=True)
        ],
        "distances": list(_distances(run, reference)),
        "by_distance": by_distance,
        "by_zone": _zones(run, reference),
        "places": list(_places(run, reference)),
    }


def flat_tables(found: Mapping[str, Any]) -> dict[str, list[dict[str, Any]]]:
    """Rows of every table of a comparison; tables within a row are columns NAME_run, NAME_run_error and so on."""
    rows = {name: found[name] for name in ("casing", "distances", "by_distance", "by_zone", "places")}
    rows["by_azimuth"] = [
        {"witness": surface["name"], **row} for surface in found["witness"] for row in surface["by_azimuth"]
    ]
    return {name: [_flat(row) for row in each] for name, each in rows.items()}


def _flat(row: Mapping[str, Any]) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in row.items():
        flat |= {f"{name}_{key}": entry for key, entry in value.items()} if isinstance(value, dict) else {name: value}
    return flat


def _casings(run: ComparedRun, reference: ComparedRun) -> Iterator[dict[str, Any]]:
    """What the catalogue compares of burst and break-up."""
    for one in shown("compare", "burst", "burst.speed_quantiles", "break_up"):
        ours, theirs = one.of(run.summary), one.of(reference.summary)
        if ours is not None and theirs is not None:
            ratio = ours / theirs if theirs else None
            yield {"quantity": one.label, "unit": one.unit, "run": ours, "reference": theirs, "ratio": ratio}


def _distances(run: ComparedRun, reference: ComparedRun) -> Iterator[dict[str, Any]]:
    """One row a distance that the catalogue compares, as `witness.compared` has it.

    A distance that is not determined is None, and so is its ratio. `run_basis` and `reference_basis` say in which
    direction the distances hold; a largest throw has none, and no error: it grows with the realisations.
    """
    both = run.part("hazard"), reference.part("hazard")
    if not all(both):
        return
    for one in shown("compare", "hazard", "hazard.without_ricochet"):
        name = one.path.removeprefix("hazard.")
        values = (
            Estimates.single(one.of(each.summary), value_at(each.summary, one.error) if one.error else None)
            for each in (run, reference)
        )
        bases = [None if name == "largest_throw" else part.get("basis") for part in both]
        row: dict[str, Any] = {"name": name, "label": one.label, **compared(*values)[0]}
        yield row | dict(zip(("run_basis", "reference_basis"), bases, strict=True))


def _densities(run: EnsembleHazard, reference: EnsembleHazard) -> list[dict[str, Any]]:
    """One row a distance: `distance_m` and, for each of DENSITIES, a table as `witness.compared` has it.

    Expected densities in the directions that decide, with the standard errors of the bootstrap; none beyond a run's
    farthest hazardous fragment. Empty where the runs estimate at different distances.
    """
    curves = run.expected, reference.expected
    radius = max((one.radius for one in curves), key=len)
    if not all(np.array_equal(radius[: len(one.radius)], one.radius) for one in curves):
        return []
    columns = {
        name: compared(*(_density(one, kind, len(radius)) for one in curves)) for kind, name in enumerate(DENSITIES)
    }
    return [
        {"distance_m": float(distance), **dict(zip(columns, row, strict=True))}
        for distance, row in zip(radius, zip(*columns.values(), strict=True), strict=True)
    ]


def _density(found: ExpectedDistance, kind: int, number: int) -> Estimates:
    beyond = (0, number - len(found.radius))
    error = np.full(number, np.nan)
    if found.density_low.size:
        error = np.pad((found.density_high[kind] - found.density_low[kind]) / (2.0 * NORMAL_95), beyond)
    return Estimates(np.pad(found.density[kind], beyond), error)


def _zones(run: ComparedRun, reference: ComparedRun) -> list[dict[str, Any]]:
    """Rows by polar zone with values of both and their ratio; empty where a run has no arena table, or zones differ."""
    from flight.arena import ArenaTable

    files = [one.folder / "arena.csv" for one in (run, reference)]
    if not all(path.is_file() for path in files):
        return []
    ours, theirs = (wide_zones(ArenaTable.read(path)) for path in files)
    if not np.array_equal(ours["from_deg"], theirs["from_deg"]):
        return []
    rows = []
    for zone in range(len(ours["from_deg"])):
        row: dict[str, Any] = {name: float(ours[name][zone]) for name in ("from_deg", "to_deg")}
        for name in ("number", "mass", "mean_speed", "max_speed", "hazardous"):
            mine, other = float(ours[name][zone]), float(theirs[name][zone])
            row[name] = {"run": mine, "reference": other, "ratio": mine / other if other > 0.0 else None}
        rows.append(row)
    return rows


def _places(run: ComparedRun, reference: ComparedRun) -> Iterator[dict[str, Any]]:
    """Rows by the name of the site: verdict, bound over the criterion, probability of a hit and margin of both.

    A site that only one run has stands with None for the other.
    """
    ours, theirs = (
        {str(entry["name"]): entry for entry in one.summary.get("exposed") or []} for one in (run, reference)
    )
    for name in dict.fromkeys([*ours, *theirs]):
        yield {"name": name, "run": _place(ours.get(name)), "reference": _place(theirs.get(name))}


def _place(entry: Mapping[str, Any] | None) -> dict[str, Any]:
    if entry is None:
        return dict.fromkeys(("verdict", "quantity", "part_of_criterion", "probability", "margin"))
    return {
        "verdict": entry["verdict"],
        "quantity": entry["criterion"]["quantity"],
        "part_of_criterion": part_of_criterion(entry),
        "probability": (entry["probability"] or {}).get("upper"),
        "margin": entry["margin"],
    }
