"""Compare a run of case 3.1 with the paper: speed, diameter, place of the fastest, cost."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from validation.files import reference_beside
from validation.grid import convergence
from validation.rows import Row, compare, markdown_table, within

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = [
    "FIGURES",
    "MERIDIAN_SIZES",
    "QUICK_SIZE",
    "REFERENCE",
    "SIZES",
    "check",
    "meridian_rows",
    "readme_tables",
]

NAME = "paper_3_1"
REFERENCE = reference_beside(__file__)
SIZES = ("8 mm", "6 mm", "4 mm", "3 mm")
MERIDIAN_SIZES = ("6 mm", "3 mm", "1.5 mm")
"""Of the axisymmetric burst, which costs seconds: beside the three-dimensional one, and finer."""
QUICK_SIZE = "8 mm"
FIGURES = ("picture_of_burst", "picture_of_fragments", "speed_along_round", "number_by_mass")
"""Figures of the finest run that the README shows."""


def check(summary: Mapping[str, Any]) -> list[Row]:
    """Rows of one run.

    Parameters
    ----------
    summary : the run's summary.json.
    """
    burst, allowed, source = summary["burst"], REFERENCE["allowed"], REFERENCE["source"]
    fastest = burst["rounds"][0]["fastest_station"] / burst["rounds"][0]["length"]
    sound = [
        within(
            NAME,
            "energy error at the outputs",
            burst["energy_error_at_outputs"],
            0.0,
            allowed["energy_error"],
            "own bound",
        ),
        within(NAME, "lost cells", float(burst["lost_cells"]), 0.0, 0.0, "own bound"),
    ]
    if not all(row.passed for row in sound):
        return sound  # an open ledger or lost cells make the comparison void
    low, high = REFERENCE["fastest_between"]
    return [
        *sound,
        compare(
            NAME,
            "mean initial speed",
            burst["mean_initial_speed"],
            REFERENCE["mean_initial_speed"],
            allowed["mean_initial_speed"],
            source,
            "m/s",
        ),
        compare(
            NAME,
            "diameter at the end",
            1e3 * burst["outer_diameter"],
            1e3 * REFERENCE["diameter_at_end"],
            allowed["diameter_at_end"],
            source,
            "mm",
        ),
        within(NAME, "fastest place, fraction of the length from the nose", fastest, low, high, source),
        compare(NAME, "cells", burst["cells"], REFERENCE["cells"], None, source),
        compare(NAME, "wall time of the burst", burst["wall_seconds"], REFERENCE["wall_seconds"], None, source, "s"),
    ]


def meridian_rows(summaries: Mapping[str, Mapping[str, Any]]) -> list[Row]:
    """Rows of the axisymmetric bursts, beside those of three dimensions: the finest judges as they do."""
    rows: list[Row] = []
    for number, (size, summary) in enumerate(summaries.items(), start=1):
        burst, allowed, source = summary["burst"], REFERENCE["allowed"], REFERENCE["source"]
        finest = number == len(summaries)
        label = f"axisymmetric, {size}"
        error, bound = burst["energy_error_at_outputs"], allowed["energy_error"]
        found = [
            within(NAME, f"{label}: energy error at the outputs", error, 0.0, bound, "own bound"),
            within(NAME, f"{label}: lost cells", float(burst["lost_cells"]), 0.0, 0.0, "own bound"),
        ]
        rows += found
        if not all(row.passed for row in found):
            continue  # void
        for key, words, wanted, factor, unit in (
            ("mean_initial_speed", "mean initial speed", "mean_initial_speed", 1.0, "m/s"),
            ("outer_diameter", "diameter at the end", "diameter_at_end", 1e3, "mm"),
        ):
            tolerance = allowed[wanted] if finest else None
            value, reference = factor * burst[key], factor * REFERENCE[wanted]
            rows.append(compare(NAME, f"{label}: {words}", value, reference, tolerance, source, unit))
    return rows


def readme_tables(
    summaries: Mapping[str, Mapping[str, Any]],
    snapshot: Path,
    meridian: Mapping[str, Mapping[str, Any]] | None = None,
) -> dict[str, str]:
    """Tables for the README: the finest run beside the paper, its speeds along the round, and the cell sizes.

    Parameters
    ----------
    summaries : summary.json by cell size, from coarse to fine.
    snapshot : burst_snapshot.h5 of the finest.
    meridian : summary.json of axisymmetric bursts by cell size, alike.
    """
    sizes = list(summaries)
    finest = summaries[sizes[-1]]
    return {
        "paper_3_1": _against_paper(finest),
        "paper_3_1_along": _along(snapshot),
        "paper_3_1_grid": _grid(summaries, meridian or {}),
        "paper_3_1_versions": f"Computed with {_versions(finest)}.",
    }


def _versions(summary: Mapping[str, Any]) -> str:
    wanted = ("fragfield", "dolfinx", "numpy", "numba", "python")
    return ", ".join(f"{name} {summary['versions'][name]}" for name in wanted if name in summary["versions"])


def _against_paper(summary: Mapping[str, Any]) -> str:
    burst = summary["burst"]
    place = burst["rounds"][0]
    growth = burst["kinetic_energy_growth"]
    low, high = REFERENCE["fastest_between"]
    body = [
        ("cells", f"{burst['cells'] / 1e3:.1f} thousand", f"{REFERENCE['cells'] / 1e3:.1f} thousand"),
        ("cell size", f"{1e3 * burst['cell_size']:g} mm", f"{1e3 * REFERENCE['cell_size']:g} mm"),
        ("products", burst["products"], "Landau"),
        ("mean initial speed", *_both(burst["mean_initial_speed"], REFERENCE["mean_initial_speed"], "m/s")),
        ("largest initial speed", f"{burst['max_initial_speed']:.0f} m/s", "-"),
        ("diameter at 120 us", *_both(1e3 * burst["outer_diameter"], 1e3 * REFERENCE["diameter_at_end"], "mm")),
        (
            "fastest place from the nose",
            f"{100 * place['fastest_station'] / place['length']:.0f} % of the length",
            f"{100 * low:.0f} to {100 * high:.0f} %",
        ),
        (
            "casing's kinetic energy, growth in the last 10 us",
            f"{100 * growth:.1f} %",
            "acceleration ends at 120 us",
        ),
        ("products' work and energy left over rho Q", f"{burst['products_balance']:.3f}", "-"),
        ("lost cells", f"{burst['lost_cells']}", "-"),
        ("largest error of the energy ledger", f"{100 * burst['energy_error']:.2f} % of the work", "-"),
        ("steps of a cell, on average", f"{burst['cell_steps'] / burst['cells']:.0f}", "12000 (fixed at 1e-8 s)"),
        (
            "wall time of the burst",
            f"{burst['wall_seconds']:.0f} s on {burst['threads'] * burst['ranks']} cores",
            f"{REFERENCE['wall_seconds']:.0f} s (AUTODYN 3 to 5 h)",
        ),
        ("peak memory", f"{burst['peak_memory_bytes'] / 1e9:.2f} GB", "-"),
    ]
    return markdown_table(("case 3.1", "fragfield", "the paper"), body)


def _along(snapshot: Path) -> str:
    """Speeds and diameters at ten places, each the mean over a tenth of the length, weighted by mass."""
    with h5py.File(snapshot, "r") as file:
        along = file["rounds/0/along"][()]
        place = along["station"] / file["rounds/0"].attrs["length"]
    columns = []
    for tenth in range(10):
        rows = along[(place >= tenth / 10) & (place < (tenth + 1) / 10)]
        mean = (rows["mean_speed"] * rows["casing_mass"]).sum() / rows["casing_mass"].sum()
        diameter = f"{1e3 * np.nanmean(rows['outer_diameter']):.0f}"
        columns.append((f"{10 * tenth + 5}", f"{mean:.0f}", f"{rows['max_speed'].max():.0f}", diameter))
    names = ("% of the length", "mean (m/s)", "largest (m/s)", "diameter (mm)")
    lines = [(name, *(column[k] for column in columns)) for k, name in enumerate(names)]
    return markdown_table(lines[0], lines[1:])


def _both(ours: float, reference: float, unit: str) -> tuple[str, str]:
    return f"{ours:.0f} {unit} ({100 * (ours / reference - 1):+.1f} %)", f"{reference:.0f} {unit}"


def _grid(summaries: Mapping[str, Mapping[str, Any]], meridian: Mapping[str, Mapping[str, Any]]) -> str:
    head = (
        "cell size",
        "cells",
        "steps of a cell",
        "mean speed (m/s)",
        "largest speed (m/s)",
        "diameter (mm)",
        "energy error (%)",
        "lost cells",
        "wall time (s)",
    )
    body = _by_size([summary["burst"] for summary in summaries.values()], "")
    if meridian:
        body += _by_size([summary["burst"] for summary in meridian.values()], ", axisymmetric")
    return markdown_table(head, body)


def _by_size(bursts: Sequence[Mapping[str, Any]], label: str) -> list[tuple[str, ...]]:
    """Lines of bursts from coarse to fine, and one of their observed order."""
    sizes = [burst["cell_size"] for burst in bursts]
    body: list[tuple[str, ...]] = [
        (
            f"{1e3 * burst['cell_size']:g} mm{label}",
            f"{burst['cells']}",
            f"{burst['cell_steps'] / burst['cells']:.0f}",
            f"{burst['mean_initial_speed']:.1f}",
            f"{burst['max_initial_speed']:.0f}",
            f"{1e3 * burst['outer_diameter']:.1f}",
            f"{100 * burst['energy_error']:.2f}",
            f"{burst['lost_cells']}",
            f"{burst['wall_seconds']:.0f}",
        )
        for burst in bursts
    ]
    body.append(
        (
            f"observed order{label}",
            "",
            "",
            _order(sizes, [burst["mean_initial_speed"] for burst in bursts], 1.0, "m/s"),
            "",
            _order(sizes, [burst["outer_diameter"] for burst in bursts], 1e3, "mm"),
            "",
            "",
            "",
        )
    )
    return body


def _order(sizes: Sequence[float], values: Sequence[float], factor: float, unit: str) -> str:
    if len(sizes) < 3:
        return "-"
    found = convergence(sizes, values)
    if not found.monotone or found.limit is None:
        return "not monotone"
    return f"{found.order:.2f}, limit {factor * found.limit:.0f} {unit}"
