"""Output of `fragfield check` on the terminal."""

from __future__ import annotations

from io import StringIO
from typing import TYPE_CHECKING, Any, TextIO

from rich.table import Table

from fragfield.case import to_toml
from fragfield.case.conversion.attitude import attitude_words
from fragfield.case.conversion.surroundings import direction_words
from fragfield.hazard.contents import quantity_words
from fragfield.results.hazard import Attitude
from fragfield.results.rules import DistanceToApply
from fragfield.results.words import metres
from fragfield.terminal.show import OFFICIAL_LABELS, number_text, plain_console, stripped
from fragfield_base.substances import substance_title

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from fragfield.case import CaseTable


# Quantity, key, factor from SI, unit and digits, for reading.
_ROUND_ROWS = (
    ("length", "length", 1e3, "mm"),
    ("outer diameter", "outer_diameter", 1e3, "mm"),
    ("casing mass", "casing_mass", 1.0, "kg"),
    ("charge mass", "charge_mass", 1.0, "kg"),
    ("fuze mass", "fuze_mass", 1.0, "kg"),
    ("fuze, mean density", "fuze_density", 1.0, "kg/m3"),
    ("charge ratio C/M", "charge_ratio", 1.0, ""),
    ("Gurney constant sqrt(2E), Eq. 24", "gurney_constant", 1.0, "m/s"),
    ("Gurney speed, Eq. 23", "gurney_speed", 1.0, "m/s"),
    ("P0", "P0", 1e-9, "GPa"),
    ("Pk", "Pk", 1e-6, "MPa"),
    ("Vk/V0", "Vk_over_V0", 1.0, ""),
)


def print_check(found: Mapping[str, Any], case: CaseTable | None = None, file: TextIO | None = None) -> None:
    """Print what `fragfield.checking.check.check_report` found of a case, and the resolved case where given."""
    console = plain_console(file)
    for part in _found(found):
        console.print(part)
    if case is not None:
        console.print(f"\nthe case as resolved:\n{to_toml(case, brief=True)}")


def check_text(found: Mapping[str, Any]) -> str:
    """What `fragfield.checking.check.check_report` found, without the case."""
    text = StringIO()
    print_check(found, file=text)
    return stripped(text.getvalue())


def _found(found: Mapping[str, Any]) -> Iterator[str | Table]:
    if "mesh" in found:
        yield from _burst(found)
    if held := found.get("fragments"):
        yield f"{held['file']}: {held['number']:.10g} fragments of {held['mass']:.4g} kg"
        if recovered := held.get("recovered"):
            yield recovered["words"]
    if "distance_to_apply" in found:
        yield from _prescribed(found)
    for warning in found["warnings"]:
        yield f"warning: {warning}"
    for path in found.get("drawings") or ():
        yield f"drawing: {path}"


def _burst(found: Mapping[str, Any]) -> Iterator[str | Table]:
    for names, entry in _alike(found["rounds"]):
        yield _round_table(_listed(names), entry)
        if contour := entry.get("contour"):
            yield f"contour: {contour['source']}"
            for note in filter(None, contour["notes"].split("; ")):
                yield f"  note: {note}"
        if entry.get("segments"):
            yield _segment_table(entry["segments"])
        for kind in ("explosive", "casing"):
            name, grades = entry[kind]["name"], entry[kind]["grades"]
            title = substance_title(name, kind) if grades else "values of the user's own"
            yield f"{kind} {name}: {title}{f' ({grades})' if grades else ''}"
    yield from _arrangement(found["arrangement"])
    mesh, expected = found["mesh"], found["expected"]
    yield f"burst: {found['geometry']['choice']} ({found['geometry']['reason']})"
    yield (
        f"mesh: {mesh['cells']} cells, {mesh['nodes']} nodes, smallest scaled Jacobian "
        f"{mesh['min_scaled_jacobian']:.3f}, largest aspect ratio {mesh['max_aspect_ratio']:.1f}, "
        f"shortest edge {mesh['min_edge'] * 1e3:.3g} mm"
    )
    from burst_fenicsx.symmetry import symmetry_words

    yield from symmetry_words(found["symmetry"])
    end = "" if expected["end_time"] is None else f", a burst to {expected['end_time'] * 1e6:.3g} us"
    memory = expected["memory_bytes"] / 1e9
    yield f"expected: about {f'{memory:.2g}' if memory < 99.5 else f'{memory:.0f}'} GB{end}"
    if number := expected.get("attitudes"):
        yield (
            f"mixed attitudes: the flight is computed in {number} attitudes and in finer steps beside the worst; it "
            f"takes about {number} to {3 * number} times as long as in one attitude"
        )


def _prescribed(found: Mapping[str, Any]) -> Iterator[str | Table]:
    if official := found.get("official"):
        for key, label in OFFICIAL_LABELS.items():
            if official[key] is not None:
                yield f"{label}: {metres(official[key])}, {official['source']}"
    if contents := found.get("contents"):
        yield quantity_words(contents["explosive"], contents["tnt"], contents["equivalents"])
    to_apply = DistanceToApply.read(found["distance_to_apply"])
    yield f"{to_apply.line}, as prescribed; a larger computed distance takes its place"
    yield from (f"  {words}" for words in to_apply.words)


def _alike(rounds: Iterable[Mapping[str, Any]]) -> list[tuple[list[str], Mapping[str, Any]]]:
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


def _arrangement(found: Mapping[str, Any]) -> Iterator[str | Table]:
    table = Table(title="arrangement", title_justify="left", box=None, pad_edge=False)
    for head in ("round", "x mm", "y mm", "z mm", "axis", "initiated"):
        table.add_column(head, justify="right" if head.endswith("mm") else "left")
    for entry in found["rounds"]:
        place = (f"{value * 1e3 + 0.0:.2f}" for value in entry["position"])
        axis = ", ".join(f"{value:g}" for value in entry["axis"])
        table.add_row(entry["name"], *place, f"({axis})", _ignition(entry))
    yield table
    yield f"attitude: {attitude_words(Attitude.read(found['attitude']))}"
    if nearest := found["min_clearance"]:
        first, second = nearest["rounds"]
        yield f"smallest clear distance: {nearest['clearance'] * 1e3:.4g} mm, {first} to {second}"
    for plane in found["planes"]:
        normal = ", ".join(f"{value:.4g}" for value in plane["normal"])
        friction = plane["friction_angle_deg"]
        yield (
            f"plane {plane['name']}: {plane['kind']}, normal ({normal}), "
            + ("mirrors the rounds" if friction is None else f"friction {friction:g} degrees")
            + f", {plane['clearance'] * 1e3:.4g} mm from {plane['nearest_round']}"
        )
    yield from _surroundings(found["surroundings"])
    contact = found["contact"]
    inner = "charge and casing share their nodes"
    if contact["charge_casing"] == "sliding":
        inner = (
            f"charge bonded to casing, cohesion {contact['cohesion'] / 1e6:.4g} MPa, tensile strength "
            f"{contact['tensile_strength'] / 1e6:.4g} MPa, friction {contact['friction_angle_deg']:.4g} degrees"
        )
    outer = "surfaces pass through each other"
    if contact["surfaces"]:
        outer = f"contact between colliding surfaces, friction {contact['surface_friction_angle_deg']:.4g} degrees"
    yield f"contact: {inner}; {outer}"


def _map(ground: Mapping[str, Any]) -> Iterator[str | Table]:
    (west, east), (south, north), (low, high) = ground["x"], ground["y"], ground["z"]
    yield (
        f"ground: {ground['map']}, {ground['nodes'][0]} x {ground['nodes'][1]} nodes {ground['cell'][0]:.5g} m by "
        f"{ground['cell'][1]:.5g} m apart, x {west:.6g} to {east:.6g} m, y {south:.6g} to {north:.6g} m, z {low:.4g} "
        f"to {high:.4g} m; beyond it level at the height of its edge"
    )
    if not ground.get("format"):
        return
    holes = f"{ground['filled']} nodes, filled" if ground["filled"] else "none"
    for label, words in (
        ("format", ground["format"]), ("coordinate system", ground["crs"]), ("plan", ground["plan_unit"]),
        ("position", ground["position"]), ("north", ground["north"]), ("heights", ground["height_unit"]),
        ("datum of heights", f"{ground['vertical']}; z = 0 at {ground['datum']:.6g} m"), ("holes", holes),
        *(("note", note) for note in ground["notes"]),
    ):  # fmt: skip
        yield f"  {label}: {words}"


def _surroundings(found: Mapping[str, Any]) -> Iterator[str | Table]:
    ground = found["ground"]
    if "map" in ground:
        yield from _map(ground)
    yield f"air: {found['air']}"
    yield f"wind: {found['wind']}"
    law = found["ricochet"]
    words = "none: fragments stay where they land"
    if law is not None:
        words = (
            f"{law['name']}, up to {law['critical_angle']:.3g} degrees, where {law['speed_kept']:.2g} of the speed is "
            f"kept; departure at {law['departure']:.2g} of the angle of impact, roughness {law['roughness']:.2g} deg"
        )
    yield f"ricochet off the ground: {words}"
    for entry in found["obstacles"]:
        yield (
            f"obstacle {entry['name']}: {entry['kind']}, z {entry['base']:.4g} to {entry['top']:.4g} m, "
            + (f"its top {entry['height']:.4g} m over the ground below, " if entry["follows"] else "")
            + ("stops fragments" if entry["ricochet"] == "none" else f"ricochet as off {entry['ricochet']}")
        )
    for entry in found["exposed"]:
        yield (
            f"exposed {entry['name']}: {entry['kind']}, {entry['distance']:.1f} m at "
            + direction_words(entry["azimuth_deg"], entry["bearing_deg"], whole=True)
        )


def _ignition(entry: Mapping[str, Any]) -> str:
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
            table.add_row(label, number_text(entry[key], factor), unit)
    for key, known in entry.get("drawing", {}).items():
        table.add_row(f"{key} mass of the drawing", number_text(known["mass"], 1.0), "kg")
        table.add_row(f"{key} mass, contours against drawing", f"{round(known['deviation'] * 100, 2) + 0.0:+.2f}", "%")
    for key, error in entry["mass_error_of_mesh"].items():
        table.add_row(f"{key.replace('_', ' ')}, mesh against exact", f"{error * 100:+.3f}", "%")
    for volume, speed in entry.get("effective_gurney_constant", {}).items():
        table.add_row(f"effective Gurney constant at V/V0 = {float(volume):g}", f"{speed:.0f}", "m/s")
    return table


def _segment_table(segments: Iterable[Mapping[str, Any]]) -> Table:
    table = Table(box=None, pad_edge=False)
    for head in ("segment", "kind", "from mm", "to mm", "mean wall mm", "casing kg", "charge kg", "Gurney m/s"):
        table.add_column(head, justify="left" if head in ("segment", "kind") else "right")
    for segment in segments:
        lengths = (f"{segment[key] * 1e3:.1f}" for key in ("start", "end", "mean_wall"))
        masses = (f"{segment[key]:.3f}" for key in ("casing_mass", "charge_mass"))
        table.add_row(segment["name"], segment["kind"], *lengths, *masses, number_text(segment["gurney_speed"], 1.0))
    return table
