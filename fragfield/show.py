"""Results for people, on stdout."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from fragfield.case import to_toml
from fragfield.convergence import convergence_words
from fragfield.exposure_words import exposed_rounds, exposure_words
from fragfield.progress import duration

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from fragfield.case import Case

__all__ = ["print_check", "print_info", "print_summary"]

# Quantity, key, factor from SI, unit and digits, as a person wants to read it.
_ROUND_ROWS = (
    ("length", "length", 1e3, "mm"),
    ("station of the section", "section_station", 1e3, "mm from the nose"),
    ("outer diameter", "outer_diameter", 1e3, "mm"),
    ("casing mass", "casing_mass_per_metre", 1.0, "kg/m"),
    ("charge mass", "charge_mass_per_metre", 1.0, "kg/m"),
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
    ("burst", "speed_99", 1.0, "m/s"),
    ("burst", "max_initial_speed", 1.0, "m/s"),
    ("burst", "outer_diameter", 1e3, "mm"),
    ("burst", "lost_cells", 1.0, ""),
    ("burst", "energy_error", 1e2, "%"),
    ("break_up", "fragments", 1.0, ""),
    ("break_up", "mass", 1.0, "kg"),
    ("flight", "landed", 1.0, ""),
)

_LABELS = {
    "speed_99": "speed of 99 % of the mass",
    "max_initial_speed": "max initial speed (of a cell)",
}


def _console() -> Console:
    # Without markup: names of rounds and surfaces may hold brackets.
    return Console(highlight=False, markup=False, soft_wrap=True)


def _number(value: object, factor: float) -> str:
    if isinstance(value, int) and factor == 1.0:
        return f"{value:d}"
    return f"{value * factor:.4g}" if isinstance(value, (int, float)) else "-"


def print_check(found: Mapping[str, Any], case: Case) -> None:
    """Print the resolved case and what `fragfield.check.check_report` found of it."""
    console = _console()
    console.print(to_toml(case, brief=True))
    for names, entry in _alike(found["rounds"]):
        console.print(_round_table(_listed(names), entry))
        if entry.get("segments"):
            console.print(_segment_table(entry["segments"]))
    _print_arrangement(console, found["arrangement"])
    mesh, expected = found["mesh"], found["expected"]
    words = f": {found['geometry']['words']}" if "words" in found["geometry"] else ""
    console.print(f"burst: {found['geometry']['choice']} ({found['geometry']['reason']}){words}")
    console.print(
        f"mesh: {mesh['cells']} cells, {mesh['nodes']} nodes, smallest scaled Jacobian "
        f"{mesh['min_scaled_jacobian']:.3f}, largest aspect ratio {mesh['max_aspect_ratio']:.1f}, "
        f"shortest edge {mesh['min_edge'] * 1e3:.3g} mm"
    )
    from burst_fenicsx.symmetry.words import symmetry_words

    for line in symmetry_words(found["symmetry"]):
        console.print(line, markup=False)
    console.print(
        f"expected: about {expected['steps']} steps of a cell, {expected['mean_time_step'] * 1e9:.3g} ns on average, "
        f"to {expected['end_time'] * 1e6:.3g} us, {expected['memory_bytes'] / 1e9:.2g} GB, "
        f"about {duration(expected['core_seconds'])} on one core"
    )
    if len(found["rounds"]) > 1:
        each = expected["per_round"]
        console.print(
            f"per round: {each['cells']:.0f} cells, {each['memory_bytes'] / 1e9:.2g} GB, "
            f"{duration(each['core_seconds'])} on one core"
        )
    for warning in found["warnings"]:
        console.print(f"warning: {warning}")


def _alike(rounds: Iterable[Mapping[str, Any]]) -> list[tuple[list[str], Mapping[str, Any]]]:
    """Rounds with the same numbers together: their names, and the numbers."""
    groups: list[tuple[list[str], Mapping[str, Any]]] = []
    for entry in rounds:
        same = next((group for group in groups if {**group[1], "name": entry["name"]} == entry), None)
        if same is None:
            groups.append(([entry["name"]], entry))
        else:
            same[0].append(entry["name"])
    return groups


def _listed(names: list[str]) -> str:
    if len(names) <= 3:
        return ", ".join(names)
    return f"{names[0]}, {names[1]}, ... {names[-1]} ({len(names)} rounds alike)"


def _print_arrangement(console: Console, found: Mapping[str, Any]) -> None:
    """Places of the rounds, their nearest pair, planes and contact."""
    table = Table(title="arrangement", title_justify="left", box=None, pad_edge=False)
    for head in ("round", "x mm", "y mm", "z mm", "axis", "initiated"):
        table.add_column(head, justify="right" if head.endswith("mm") else "left")
    for entry in found["rounds"]:
        place = (f"{value * 1e3 + 0.0:.2f}" for value in entry["position"])
        axis = ", ".join(f"{value:g}" for value in entry["axis"])
        table.add_row(entry["name"], *place, f"({axis})", _ignition(entry))
    console.print(table)
    if nearest := found["min_clearance"]:
        first, second = nearest["rounds"]
        console.print(f"smallest clear distance: {nearest['clearance'] * 1e3:.4g} mm, {first} to {second}")
    for plane in found["planes"]:
        normal = ", ".join(f"{value:.4g}" for value in plane["normal"])
        friction = plane["friction_angle_deg"]
        console.print(
            f"plane {plane['name']}: {plane['kind']}, normal ({normal}), "
            + ("mirrors the rounds" if friction is None else f"friction {friction:g} degrees")
            + f", {plane['clearance'] * 1e3:.4g} mm from {plane['nearest_round']}",
            markup=False,
        )
    _print_surroundings(console, found["surroundings"])
    contact = found["contact"]
    inner = "charge and casing share their nodes"
    if contact["charge_casing"] == "bonded":
        inner = (
            f"charge bonded to casing, cohesion {contact['cohesion'] / 1e6:.4g} MPa, tensile strength "
            f"{contact['tensile_strength'] / 1e6:.4g} MPa, friction {contact['friction_angle_deg']:.4g} degrees"
        )
    outer = "surfaces pass through each other"
    if contact["surfaces"]:
        outer = f"surfaces that meet push each other, friction {contact['surface_friction_angle_deg']:.4g} degrees"
    console.print(f"contact: {inner}; {outer}")


def _print_surroundings(console: Console, found: Mapping[str, Any]) -> None:
    """Ground and obstacles of the flight."""
    ground = found["ground"]
    if "map" in ground:
        (west, east), (south, north), (low, high) = ground["x"], ground["y"], ground["z"]
        console.print(
            f"ground: {ground['map']}, {ground['nodes'][0]} x {ground['nodes'][1]} nodes, x {west:g} to {east:g} m, "
            f"y {south:g} to {north:g} m, z {low:.4g} to {high:.4g} m; beyond it fragments have left",
            markup=False,
        )
    if bounce := found["bounce"]:
        console.print(
            f"bounce: {bounce['name']}, restitution {bounce['normal']:g} normal and {bounce['tangential']:g} along, "
            f"friction {bounce['friction']:g}" + (f"; {bounce['source']}" if bounce["source"] else ""),
            markup=False,
        )
    for entry in found["obstacles"]:
        console.print(
            f"obstacle {entry['name']}: {entry['kind']}, z {entry['base']:.4g} to {entry['top']:.4g} m, "
            + ("stops fragments" if entry["ricochet"] is None else f"turns fragments off like {entry['ricochet']}"),
            markup=False,
        )
    for entry in found["exposed"]:
        console.print(
            f"exposed {entry['name']}: {entry['kind']}, {entry['distance']:.1f} m at {entry['azimuth_deg']:.0f} degrees"
            + (f", in {entry['pieces']} pieces" if entry["pieces"] > 1 else ""),
            markup=False,
        )


def _ignition(entry: Mapping[str, Any]) -> str:
    """How a round is initiated, in words."""
    words = []
    if entry["delays"] is not None:
        first, last = (f"{time * 1e6:.4g}" for time in entry["delays"])
        points = "" if entry["ignition_points"] == 1 else f" at {entry['ignition_points']} points"
        words.append(f"at {first} us{points}" if first == last else f"at {first} to {last} us{points}")
    if entry["initiation"]:
        pressure, time = entry["initiation"]["pressure"], entry["initiation"]["duration"]
        if pressure is not None:
            words.append(f"by {pressure / 1e9:.4g} GPa held for {time * 1e6:.4g} us")
        elif not words:
            words.append("never; shock reported")
    return ", or ".join(words)


def _round_table(title: str, entry: Mapping[str, Any]) -> Table:
    table = Table(title=title, title_justify="left", box=None, show_header=False, pad_edge=False)
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
        if isinstance(found, dict) and key == "speed_99":
            found = {key: (found.get("speed_quantiles") or {}).get("99")}
        if isinstance(found, dict) and found.get(key) is not None:
            label = _LABELS.get(key, key.replace("_", " "))
            table.add_row(part.replace("_", " "), label, _number(found[key], factor), unit)
    section = (summary.get("burst") or {}).get("section")
    if section:
        table.add_row("burst", section["words"], "masses per metre")
        for width, ratio in ((section["focus"] or {}).get("mass_ratio") or {}).items():
            table.add_row("burst", f"mass within {width} deg of the focus", f"{ratio:.3g}", "per degree")
    rounds = (summary.get("burst") or {}).get("rounds") or []
    for entry in rounds if len(rounds) > 1 else []:
        if "ignition" in entry:
            table.add_row("burst", f"ignition of {entry['name']}", *_initiated(entry["ignition"]))
    for name, exposure, initiated in exposed_rounds(summary.get("burst") or {}):
        label = "initiated" if initiated else "not initiated"
        table.add_row("burst", f"{name}, {label}", exposure_words(exposure), "")
    for surface in summary.get("witness") or []:
        table.add_row("witness", f"hits on {surface['name']}", _number(surface["hits"], 1.0), "")
    for obstacle in summary.get("obstacle") or []:
        hits = f"{obstacle['hits']:d}, hazardous {obstacle['hazardous_hits']:d}"
        table.add_row("obstacle", f"hits on {obstacle['name']}", hits, "")
    console = _console()
    console.print(table)
    _print_hazard(console, summary.get("hazard") or {})
    for line in convergence_words(summary.get("convergence") or {}):
        console.print(line, markup=False)
    for entry in summary.get("exposed") or []:
        margin = "" if entry["margin"] is None else f", margin {entry['margin']:+.0f} m"
        console.print(f"exposed {entry['name']}: criterion {entry['verdict']}{margin}", markup=False)
    if "directory" in summary:
        console.print(f"written to {summary['directory']}")


def _initiated(ignition: Sequence[Mapping[str, Any]]) -> tuple[str, str]:
    """When a round was initiated and by what, as the value and the unit of a line."""
    if not ignition:
        return "never initiated", ""
    by = "us, by shock" if ignition[0]["by"] == "shock" else "us"
    return f"{ignition[0]['time'] * 1e6:.4g}", by


def _print_hazard(console: Console, hazard: Mapping[str, Any]) -> None:
    """The hazard distance, what it rests on, and beside it what single events do."""
    from fragfield.certainty import basis_words, metres, single_words

    if not hazard:
        return
    if not hazard["determined"]:
        console.print(f"hazard distance: not determined\n  {hazard['reason']}", markup=False)
        return
    number = f"{hazard['realisations']} realisation{'s' if hazard['realisations'] > 1 else ''}"
    lines = [("hazard distance", metres(hazard["distance"]), f"no upper bound: {number}; {basis_words(hazard)}")]
    if hazard["upper"] is not None:
        error = f"± {hazard['standard_error']:.2g} m standard error, {number}"
        lines = [
            ("hazard distance, upper bound (95 %)", metres(hazard["upper"]), basis_words(hazard)),
            ("distance of the expected density", f"{hazard['distance']:,.0f} m", error),
        ]
    lines += [
        ("no hazard distances: single events", single_words(hazard), "5 to 95 %"),
        ("  largest throw", f"{hazard['largest_throw']:,.0f} m", "of a single fragment"),
    ]
    for label, value, note in lines:
        console.print(f"{label:37}{value:>16}  {note}", markup=False)


def print_info(found: Mapping[str, Any]) -> None:
    """Print what `fragfield.info.describe` found."""
    console = _console()
    if "directory" in found:
        stages = ", ".join(f"{name} {'done' if done else 'missing'}" for name, done in found["stages"].items())
        console.print(f"{found['directory']}: {stages}")
        print_summary({"title": found["title"], **found["summary"]})
        if (seconds := (found["summary"].get("burst") or {}).get("wall_seconds")) is not None:
            console.print(f"burst computed in {duration(seconds)}")
        for name, size in found["files"].items():
            console.print(f"{size / 1e6:10.3f} MB  {name}")
        return
    console.print(f"{found['file']}: {found['format']}")
    for key, value in found["attributes"].items():
        text = str(value)
        console.print(f"  {key} = {text if len(text) < 100 else text[:97] + '...'}")
    for name, shape in found["datasets"].items():
        console.print(f"  /{name}: {shape}")
