"""Results for people, on stdout."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from fragfield.case import to_toml
from fragfield.progress import duration

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from fragfield.case import Case

__all__ = ["print_check", "print_info", "print_summary"]

# Quantity, key, factor from SI, unit and digits, as a person wants to read it.
_ROUND_ROWS = (
    ("length", "length", 1e3, "mm"),
    ("outer diameter", "outer_diameter", 1e3, "mm"),
    ("casing mass", "casing_mass", 1.0, "kg"),
    ("charge mass", "charge_mass", 1.0, "kg"),
    ("fuze mass", "fuze_mass", 1.0, "kg"),
    ("charge ratio C/M", "charge_ratio", 1.0, ""),
    ("Gurney constant sqrt(2E), Eq. 24", "gurney_constant", 1.0, "m/s"),
    ("Gurney speed, Eq. 23", "gurney_speed", 1.0, "m/s"),
    ("P0", "P0", 1e-9, "GPa"),
    ("Pk", "Pk", 1e-6, "MPa"),
    ("Vk/V0", "Vk_over_V0", 1.0, ""),
)
_SUMMARY_ROWS = (
    ("burst", "cells", 1.0, ""),
    ("burst", "steps", 1.0, ""),
    ("burst", "end_time", 1e6, "us"),
    ("burst", "wall_seconds", 1.0, "s"),
    ("burst", "mean_initial_speed", 1.0, "m/s"),
    ("burst", "max_initial_speed", 1.0, "m/s"),
    ("burst", "outer_diameter", 1e3, "mm"),
    ("burst", "lost_cells", 1.0, ""),
    ("burst", "energy_error", 1e2, "%"),
    ("break_up", "fragments", 1.0, ""),
    ("break_up", "mass", 1.0, "kg"),
    ("flight", "landed", 1.0, ""),
    ("flight", "max_range", 1.0, "m"),
    ("flight", "hazardous_fragment_distance", 1.0, "m"),
    ("flight", "hazardous_fragment_distance_all_round_normal", 1.0, "m"),
)
_LABELS = {
    "hazardous_fragment_distance": "hazardous fragment distance, worst sector",
    "hazardous_fragment_distance_all_round_normal": "hazardous fragment distance, all round",
}


def _console() -> Console:
    return Console(highlight=False, soft_wrap=True)


def _number(value: object, factor: float) -> str:
    if isinstance(value, int) and factor == 1.0:
        return f"{value:d}"
    return f"{value * factor:.4g}" if isinstance(value, (int, float)) else "-"


def print_check(found: Mapping[str, Any], case: Case) -> None:
    """Print the resolved case and what `fragfield.check.check_report` found of it."""
    console = _console()
    console.print(to_toml(case), markup=False)
    for entry in found["rounds"]:
        console.print(_round_table(entry))
        if entry.get("segments"):
            console.print(_segment_table(entry["segments"]))
    mesh, expected = found["mesh"], found["expected"]
    console.print(
        f"mesh: {mesh['cells']} cells, {mesh['nodes']} nodes, smallest scaled Jacobian "
        f"{mesh['min_scaled_jacobian']:.3f}, largest aspect ratio {mesh['max_aspect_ratio']:.1f}, "
        f"shortest edge {mesh['min_edge'] * 1e3:.3g} mm"
    )
    console.print(
        f"expected: about {expected['steps']} steps of {expected['mean_time_step'] * 1e9:.3g} ns to "
        f"{expected['end_time'] * 1e6:.3g} us, {expected['memory_bytes'] / 1e9:.2g} GB"
    )
    for warning in found["warnings"]:
        console.print(f"warning: {warning}", markup=False)


def _round_table(entry: Mapping[str, Any]) -> Table:
    table = Table(title=f"{entry['name']}", title_justify="left", box=None, show_header=False, pad_edge=False)
    for label, key, factor, unit in _ROUND_ROWS:
        if key in entry:
            table.add_row(label, _number(entry[key], factor), unit)
    for key, error in entry["mass_error_of_mesh"].items():
        table.add_row(f"{key.replace('_', ' ')}, mesh against exact", f"{error * 100:+.3f}", "%")
    for volume, speed in entry.get("effective_gurney_constant", {}).items():
        table.add_row(f"effective Gurney constant at V/V0 = {float(volume):g}", f"{speed:.0f}", "m/s")
    return table


def _segment_table(segments: Iterable[Mapping[str, Any]]) -> Table:
    table = Table(box=None, pad_edge=False)
    for head in ("segment", "kind", "from mm", "to mm", "wall mm", "casing kg", "charge kg", "Gurney m/s"):
        table.add_column(head, justify="left" if head in ("segment", "kind") else "right")
    for segment in segments:
        lengths = (f"{segment[key] * 1e3:.1f}" for key in ("start", "end", "wall"))
        masses = (f"{segment[key]:.3f}" for key in ("casing_mass", "charge_mass"))
        table.add_row(segment["name"], segment["kind"], *lengths, *masses, _number(segment["gurney_speed"], 1.0))
    return table


def print_summary(summary: Mapping[str, Any]) -> None:
    """Print the main numbers of a summary."""
    table = Table(
        title=str(summary.get("title", "")), title_justify="left", box=None, show_header=False, pad_edge=False
    )
    for part, key, factor, unit in _SUMMARY_ROWS:
        found = summary.get(part)
        if isinstance(found, dict) and found.get(key) is not None:
            table.add_row(
                part.replace("_", " "), _LABELS.get(key, key.replace("_", " ")), _number(found[key], factor), unit
            )
    for surface in summary.get("witness") or []:
        table.add_row("witness", f"hits on {surface['name']}", _number(surface["hits"], 1.0), "")
    console = _console()
    console.print(table)
    if "directory" in summary:
        console.print(f"written to {summary['directory']}", markup=False)


def print_info(found: Mapping[str, Any]) -> None:
    """Print what `fragfield.info.describe` found."""
    console = _console()
    if "directory" in found:
        stages = ", ".join(f"{name} {'done' if done else 'missing'}" for name, done in found["stages"].items())
        console.print(f"{found['directory']}: {stages}", markup=False)
        print_summary({"title": found["title"], **found["summary"]})
        if (seconds := (found["summary"].get("burst") or {}).get("wall_seconds")) is not None:
            console.print(f"burst computed in {duration(seconds)}")
        for name, size in found["files"].items():
            console.print(f"{size / 1e6:10.3f} MB  {name}", markup=False)
        return
    console.print(f"{found['file']}: {found['format']}", markup=False)
    for key, value in found["attributes"].items():
        text = str(value)
        console.print(f"  {key} = {text if len(text) < 100 else text[:97] + '...'}", markup=False)
    for name, shape in found["datasets"].items():
        console.print(f"  /{name}: {shape}", markup=False)
