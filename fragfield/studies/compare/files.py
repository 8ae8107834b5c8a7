"""The files of a comparison: comparison.json, CSV tables and a picture."""

from __future__ import annotations

import csv
import io
import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import InputError
from fragfield.report.figures.drawing import GREY, LINES, WIDE, drawing_style, new_figure, to_bytes
from fragfield.studies.compare.comparison import flat_tables
from fragfield_base.errors import show
from fragfield_base.writing import harmless, write_bytes, write_text

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_PICTURED = (("hits", "ratio of numbers"), ("max_initial_speed", "ratio of largest speeds"))


def write_comparison(found: dict[str, Any], folder: Path) -> None:
    """Write comparison.json, a table of each kind as CSV, and comparison.png.

    Tables that would be empty are left out. The paths go into `found["files"]`. Raises InputError: the folder cannot be
    made or written, or is a run's.
    """
    if (folder / "case.toml").exists():
        raise InputError(f"{folder}: holds a run; a comparison needs a folder of its own")
    tables = {f"{name}.csv": rows for name, rows in flat_tables(found).items()}
    written = ["comparison.json", *(name for name, rows in tables.items() if rows)]
    pictured = bool(found["witness"] or found["by_distance"])
    found["files"] = [str(folder / name) for name in [*written, *(["comparison.png"] if pictured else [])]]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: the comparison cannot be written ({error.strerror})") from None
    write_text(folder / "comparison.json", json.dumps(found, indent=1, allow_nan=False) + "\n", InputError)
    for name in written[1:]:
        _write_table(folder / name, tables[name])
    if pictured:
        write_bytes(folder / "comparison.png", _picture(found), InputError)


def _write_table(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    text = io.StringIO()
    table = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    table.writeheader()
    table.writerows({key: harmless(one) if isinstance(one, str) else one for key, one in row.items()} for row in rows)
    write_text(path, text.getvalue(), InputError)


def _picture(found: Mapping[str, Any]) -> bytes:
    """Ratios by azimuth, a line of panels a surface, and below them the densities by distance."""
    rows = len(found["witness"]) + bool(found["by_distance"])
    with drawing_style():
        figure, axes = new_figure(rows, 2, width=WIDE, height=2.4 * rows + 0.5)
        for number, surface in enumerate(found["witness"]):
            for (key, label), axis in zip(_PICTURED, axes[2 * number : 2 * number + 2], strict=True):
                _draw_ratio(axis, surface, key, label)
        if found["by_distance"]:
            for (key, title), axis in zip(
                (("ground_density", "by area of ground"), ("normal_density", "normal to paths")),
                axes[-2:],
                strict=True,
            ):
                _draw_density(axis, found, key, title)
        _put_title(figure, found)
        return to_bytes(figure, "png")


def _put_title(figure: Figure, found: Mapping[str, Any]) -> None:
    first, second = (found[key]["title"] or found[key]["directory"] for key in ("run", "reference"))
    figure.suptitle(f"{show(first)}\nover {show(second)}", fontsize=9)


def _column(rows: Sequence[Mapping[str, Any]], name: str, key: str) -> np.ndarray[Any, Any]:
    return np.array([math.nan if row[name][key] is None else row[name][key] for row in rows])


def _draw_ratio(axis: Axes, surface: Mapping[str, Any], key: str, label: str) -> None:
    rows = surface["by_azimuth"]
    azimuth = np.array([row["azimuth_deg"] for row in rows])
    ratio, error = _column(rows, key, "ratio"), _column(rows, key, "ratio_error")
    axis.axhline(1.0, color=GREY, linewidth=0.8)
    axis.errorbar(azimuth, ratio, np.nan_to_num(error), capsize=1.5, elinewidth=0.8, **LINES[0])
    axis.set(title=f"{surface['name']}: {label}", xlabel="azimuth (degrees)", ylabel="ratio", xlim=(-5, 360))
    axis.set_xticks(range(0, 361, 90))
    axis.set_ylim(bottom=0.0)


def _draw_density(axis: Axes, found: Mapping[str, Any], key: str, title: str) -> None:
    rows = found["by_distance"]
    distance = [row["distance_m"] for row in rows]
    for style, name, label in zip(LINES, ("run", "reference"), ("run", "reference"), strict=False):
        density = _column(rows, key, name)
        axis.plot(distance, np.where(density > 0.0, density, math.nan), label=label, **style)
    axis.set_yscale("log")
    axis.set(title=f"hazardous fragments, {title}", xlabel="distance (m)", ylabel="per m²")
    axis.legend()
