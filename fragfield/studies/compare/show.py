"""A comparison on the terminal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from fragfield.hazard.certainty import metres_and_error

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rich.console import Console
    from rich.table import Table


_NEAREST = 10.0  # m, of the table by distance
_MOST_LINES = 12  # of the table by distance, and of differences
_RATIOS = (
    ("number", "hits"),
    ("hazardous", "hazardous_hits"),
    ("largest speed", "max_initial_speed"),
    ("mean speed", "mean_initial_speed"),
)


def print_comparison(found: Mapping[str, Any]) -> None:
    """Print what `comparison.compare_runs` found, tables by distance thinned out."""
    from fragfield.terminal.show import plain_console

    console = plain_console()
    for key, word in (("run", "run"), ("reference", "over")):
        one = found[key]
        number = "not flown" if one["realisations"] is None else f"{one['realisations']} realisations"
        document = f", document {one['document']}" if one["document"] else ""
        console.print(f"{word:5}{one['directory']}: {one['title']} (seed {one['seed']}, {number}{document})")
    _print_lines(console, "the cases differ in", found["differences"])
    for note in found["notes"]:
        console.print(f"note: {note}")
    if found["casing"]:
        console.print(_casing_table(found["casing"]))
    if found["distances"]:
        console.print(_distance_table(found["distances"]))
    for surface in found["witness"]:
        console.print(_witness_table(surface, all_round=found["all_round"]))
    if found["by_distance"]:
        console.print(_density_table(found["by_distance"]))
    if found["places"]:
        console.print(_site_table(found["places"]))
    if found["by_zone"]:
        console.print(_zone_table(found["by_zone"]))
    for path in found.get("files", ()):
        console.print(f"written to {path}")


def _print_lines(console: Console, head: str, lines: Sequence[str]) -> None:
    if not lines:
        return
    console.print(f"{head}")
    for line in lines[:_MOST_LINES]:
        console.print(f"  {line}")
    if len(lines) > _MOST_LINES:
        console.print(f"  and {len(lines) - _MOST_LINES} more keys")


def _table(title: str, heads: Sequence[str], lines: Sequence[Sequence[str]]) -> Table:
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    for number, head in enumerate(heads):
        table.add_column(head, justify="right" if number else "left", no_wrap=bool(number))
    for line in lines:
        table.add_row(*line)
    return table


def _pairs(row: Mapping[str, Any], *names: str, ratio: bool = False) -> list[str]:
    """Values of the run and of the reference by name, with `ratio` the ratios too."""
    cells = []
    for name in names:
        cells += [_number(row[name][key]) for key in ("run", "reference")]
        cells += [_with_error(row[name], "ratio")] if ratio else []
    return cells


def _casing_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    lines = [
        [f"{row['quantity']}{f' ({unit})' if (unit := row['unit']) else ''}",
         *(_number(row[key]) for key in ("run", "reference", "ratio"))]
        for row in rows
    ]  # fmt: skip
    return _table("", ("", "run", "over", "ratio"), lines)


def _distance_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    lines = [
        [row["label"], *(metres_and_error(row[key], row[f"{key}_error"]) for key in ("run", "reference")),
         _with_error(row, "ratio")]
        for row in rows
    ]  # fmt: skip
    return _table("distances (m) ± standard error", ("", "run", "over", "ratio"), lines)


def _witness_table(surface: Mapping[str, Any], *, all_round: bool) -> Table:
    over = " over the mean of all azimuths" if all_round else ""
    title = (
        f"witness {surface['name']}, sectors of {surface['sector_width_deg']:g} degrees{over}; ratios ± standard error"
    )
    lines = [
        [azimuth, *_pairs(row, "hits"), *(_with_error(row[key], "ratio") for _, key in _RATIOS)]
        for azimuth, row in (
            *((f"{row['azimuth_deg']:g}", row) for row in surface["by_azimuth"]), ("all", surface["total"])
        )
    ]  # fmt: skip
    return _table(title, ("azimuth", "hits", "over", *(head for head, _ in _RATIOS)), lines)


def _density_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    """Every so manieth distance, from some metres to the farthest at which there is anything."""
    rows = [row for row in rows if row["distance_m"] >= _NEAREST]
    filled = [number for number, row in enumerate(rows) if any(row["ground_density"][k] for k in ("run", "reference"))]
    rows = rows[: filled[-1] + 1] if filled else []
    lines = []
    for row in rows[:: max(1, -(-len(rows) // _MOST_LINES))]:
        hundred = {
            name: row[name] | {key: 100.0 * row[name][key] for key in ("run", "reference")}
            for name in ("ground_density", "normal_density")
        }
        lines.append([f"{row['distance_m']:.3g}", *_pairs(hundred, *hundred, ratio=True)])
    heads = ("m", "on the ground", "over", "ratio", "normal to the paths", "over", "ratio")
    return _table("expected hazardous fragments per 100 m2 by distance", heads, lines)


def _site_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    lines = [
        [row["name"], *(row[key]["verdict"] or "-" for key in ("run", "reference")),
         *(_number(row[key][name]) for name in ("part_of_criterion", "margin") for key in ("run", "reference"))]
        for row in rows
    ]  # fmt: skip
    heads = ("exposed site", "verdict", "over", "part of criterion", "over", "margin m", "over")
    return _table("exposed sites; upper bounds (95 %)", heads, lines)


def _zone_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    names = ("number", "mass", "mean_speed", "max_speed")
    lines = [[f"{row['from_deg']:g} to {row['to_deg']:g}", *_pairs(row, *names)] for row in rows]
    heads = ("degrees from the nose", "number", "over", "kg", "over", "mean m/s", "over", "largest m/s", "over")
    return _table("fragments of one round by polar zone, at launch", heads, lines)


def _number(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def _with_error(row: Mapping[str, Any], key: str) -> str:
    value, error = row[key], row[f"{key}_error"]
    if value is None:
        return "-"
    if not error:
        return f"{value:.2f}"
    # Two decimals, more where the error would read as none.
    decimals = max(2, -math.floor(math.log10(error))) if math.isfinite(error) else 2
    return f"{value:.{decimals}f} ± {error:.{decimals}f}"
