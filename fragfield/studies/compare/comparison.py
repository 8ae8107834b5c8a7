"""The comparison of two runs as nested tables."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.studies.compare.exposed_sites import compare_places
from fragfield.studies.compare.hazards import compare_densities, compare_distances
from fragfield.studies.compare.runs import check_alike, differences_of, notes_on, read_compared_run
from fragfield.studies.compare.witness import compare_hits, sectors_together
from fragfield.studies.compare.zones import compare_zones

if TYPE_CHECKING:
    from pathlib import Path

    from fragfield.studies.compare.runs import ComparedRun

__all__ = ["compare_runs"]

_CASINGS = (
    ("burst", "mean_initial_speed", "casing, mean initial speed", "m/s"),
    ("burst", "max_initial_speed", "casing, largest initial speed", "m/s"),
    ("burst", "outer_diameter", "outer diameter", "m"),
    ("burst", "casing_mass", "mass of the casings", "kg"),
    ("burst", "charge_mass", "mass of the charges", "kg"),
    ("break_up", "fragments", "fragments", ""),
)


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
        by_distance = compare_densities(run.hazard, reference.hazard)
        if not by_distance:
            notes.append("densities are not compared: hazard.distance_cell differs")
    return {
        "run": _described(run),
        "reference": _described(reference),
        "differences": differences_of(run, reference),
        "notes": notes,
        "all_round": all_round,
        "casing": list(_casings(run, reference)),
        "witness": [
            {"name": name, **compare_hits(run.hits[name], reference.hits[name], number, all_round=all_round)}
            for name, number in zip(surfaces, together, strict=True)
        ],
        "distances": compare_distances(run, reference),
        "by_distance": by_distance,
        "by_zone": compare_zones(run, reference),
        "places": compare_places(run, reference),
    }


def _described(run: ComparedRun) -> dict[str, Any]:
    return {
        "directory": str(run.folder),
        "title": str(run.case.get("title", "")),
        "document": " ".join(
            str(document[key])
            for key in ("number", "revision")
            if (document := run.case.get("document") or {}).get(key)
        ),
        "seed": run.summary.get("seed"),
        "realisations": (run.part("flight").get("realisations") or 1) if run.flown else None,
        "program_version": run.summary.get("program_version"),
    }


def _casings(run: ComparedRun, reference: ComparedRun) -> list[dict[str, Any]]:
    rows = []
    for part, key, label, unit in _CASINGS:
        ours, theirs = run.part(part).get(key), reference.part(part).get(key)
        if ours is not None and theirs is not None:
            ratio = ours / theirs if theirs else None
            rows.append({"quantity": label, "unit": unit, "run": ours, "reference": theirs, "ratio": ratio})
    return rows
