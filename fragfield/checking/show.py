"""Output of `fragfield check` on the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from io import StringIO
from typing import Literal, TextIO

from rich.table import Table

from fragfield.case import CaseTable, to_toml
from fragfield.case.conversion.attitude import attitude_words
from fragfield.case.conversion.surroundings import direction_words
from fragfield.hazard.contents import quantity_words
from fragfield.results import check as results
from fragfield.results.part import to_json
from fragfield.results.words import metres
from fragfield.terminal.show import OFFICIAL_LABELS, number_text, plain_console, stripped
from fragfield_base.substances import substance_title

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
    ("P0", "initial_pressure", 1e-9, "GPa"),
    ("Pk", "knee_pressure", 1e-6, "MPa"),
    ("Vk/V0", "knee_volume", 1.0, ""),
)


def print_check(
    found: results.Checked, case: CaseTable | None = None, file: TextIO | None = None, drawings: Sequence[str] = ()
) -> None:
    """Print what `fragfield.checking.check.check_report` found of a case, paths of drawings, and the resolved case."""
    console = plain_console(file)
    for part in _found(found):
        console.print(part)
    for path in drawings:
        console.print(f"drawing: {path}")
    if case is not None:
        console.print(f"\nthe case as resolved:\n{to_toml(case, brief=True)}")


def check_text(found: results.Checked) -> str:
    """What `fragfield.checking.check.check_report` found, without the case."""
    text = StringIO()
    print_check(found, file=text)
    return stripped(text.getvalue())


def _found(found: results.Checked) -> Iterator[str | Table]:
    if isinstance(found, results.CheckedBurst):
        yield from _burst(found)
    if held := found.fragments:
        yield f"{held.file}: {held.number:.10g} fragments of {held.mass:.4g} kg"
        if held.recovered:
            yield held.recovered.words
    if official := found.official:
        for key, label in OFFICIAL_LABELS.items():
            if (distance := getattr(official, key)) is not None:
                yield f"{label}: {metres(distance)}, {official.source}"
    if contents := found.contents:
        yield quantity_words(contents.explosive, contents.tnt, contents.equivalents)
    yield f"{found.distance_to_apply.line}, as prescribed; a larger computed distance takes its place"
    yield from (f"  {words}" for words in found.distance_to_apply.words)
    for warning in found.warnings:
        yield f"warning: {warning}"


def _burst(found: results.CheckedBurst) -> Iterator[str | Table]:
    for names, entry in _alike(found.rounds):
        yield _round_table(_listed(names), entry)
        if contour := entry.contour:
            yield f"contour: {contour.source}"
            for note in filter(None, contour.notes.split("; ")):
                yield f"  note: {note}"
        if entry.segments:
            yield _segment_table(entry.segments)
        yield _substance("explosive", entry.explosive)
        yield _substance("casing", entry.casing)
    yield from _arrangement(found.arrangement)
    mesh, expected = found.mesh, found.expected
    yield f"burst: {found.geometry.choice} ({found.geometry.reason})"
    yield (
        f"mesh: {mesh.cells} cells, {mesh.nodes} nodes, smallest scaled Jacobian {mesh.min_scaled_jacobian:.3f}, "
        f"largest aspect ratio {mesh.max_aspect_ratio:.1f}, shortest edge {mesh.min_edge * 1e3:.3g} mm"
    )
    from burst_fenicsx.symmetry import symmetry_words

    yield from symmetry_words(to_json(found.symmetry))
    end = "" if expected.end_time is None else f", a burst to {expected.end_time * 1e6:.3g} us"
    memory = expected.memory_bytes / 1e9
    yield f"expected: about {f'{memory:.2g}' if memory < 99.5 else f'{memory:.0f}'} GB{end}"
    if number := expected.attitudes:
        yield (
            f"mixed attitudes: the flight is computed in {number} attitudes and in finer steps beside the worst; it "
            f"takes about {number} to {3 * number} times as long as in one attitude"
        )


def _substance(kind: Literal["explosive", "casing"], one: results.Graded) -> str:
    title = substance_title(one.name, kind) if one.grades else "values of the user's own"
    return f"{kind} {one.name}: {title}{f' ({one.grades})' if one.grades else ''}"


def _alike(rounds: Sequence[results.CheckedRound]) -> list[tuple[list[str], results.CheckedRound]]:
    groups: list[tuple[list[str], results.CheckedRound]] = []
    for entry in rounds:
        same = next((group for group in groups if replace(group[1], name=entry.name) == entry), None)
        if same is None:
            groups.append(([entry.name], entry))
        else:
            same[0].append(entry.name)
    return groups


def _listed(names: list[str]) -> str:
    if len(names) <= 3:
        return ", ".join(names)
    return f"{names[0]}, {names[1]}, ... {names[-1]} ({len(names)} rounds alike)"


def _arrangement(found: results.Arrangement) -> Iterator[str | Table]:
    table = Table(title="arrangement", title_justify="left", box=None, pad_edge=False)
    for head in ("round", "x mm", "y mm", "z mm", "axis", "initiated"):
        table.add_column(head, justify="right" if head.endswith("mm") else "left")
    for entry in found.rounds:
        place = (f"{value * 1e3 + 0.0:.2f}" for value in entry.position)
        axis = ", ".join(f"{value:g}" for value in entry.axis)
        table.add_row(entry.name, *place, f"({axis})", _ignition(entry))
    yield table
    yield f"attitude: {attitude_words(found.attitude)}"
    if nearest := found.min_clearance:
        first, second = nearest.rounds
        yield f"smallest clear distance: {nearest.clearance * 1e3:.4g} mm, {first} to {second}"
    for plane in found.planes:
        normal = ", ".join(f"{value:.4g}" for value in plane.normal)
        friction = plane.friction_angle_deg
        yield (
            f"plane {plane.name}: {plane.kind}, normal ({normal}), "
            + ("mirrors the rounds" if friction is None else f"friction {friction:g} degrees")
            + f", {plane.clearance * 1e3:.4g} mm from {plane.nearest_round}"
        )
    yield from _surroundings(found.surroundings)
    contact = found.contact
    inner = "charge and casing share their nodes"
    if contact.charge_casing == "sliding":
        inner = (
            f"charge bonded to casing, cohesion {contact.cohesion / 1e6:.4g} MPa, tensile strength "
            f"{contact.tensile_strength / 1e6:.4g} MPa, friction {contact.friction_angle_deg:.4g} degrees"
        )
    outer = "surfaces pass through each other"
    if contact.surfaces:
        outer = f"contact between colliding surfaces, friction {contact.surface_friction_angle_deg:.4g} degrees"
    yield f"contact: {inner}; {outer}"


def _map(ground: results.GroundMap) -> Iterator[str | Table]:
    (west, east), (south, north), (low, high) = ground.x, ground.y, ground.z
    yield (
        f"ground: {ground.map}, {ground.nodes[0]} x {ground.nodes[1]} nodes {ground.cell[0]:.5g} m by "
        f"{ground.cell[1]:.5g} m apart, x {west:.6g} to {east:.6g} m, y {south:.6g} to {north:.6g} m, z {low:.4g} "
        f"to {high:.4g} m; beyond it level at the height of its edge"
    )
    if not ground.format:
        return
    holes = f"{ground.filled} nodes, filled" if ground.filled else "none"
    for label, words in (
        ("format", ground.format), ("coordinate system", ground.crs), ("plan", ground.plan_unit),
        ("position", ground.position), ("north", ground.north), ("heights", ground.height_unit),
        ("datum of heights", f"{ground.vertical}; z = 0 at {ground.datum:.6g} m"), ("holes", holes),
        *(("note", note) for note in ground.notes or ()),
    ):  # fmt: skip
        yield f"  {label}: {words}"


def _surroundings(found: results.Surroundings) -> Iterator[str | Table]:
    if isinstance(found.ground, results.GroundMap):
        yield from _map(found.ground)
    yield f"air: {found.air}"
    yield f"wind: {found.wind}"
    words = "none: fragments stay where they land"
    if (law := found.ricochet) is not None:
        words = (
            f"{law.name}, up to {law.critical_angle:.3g} degrees, where {law.speed_kept:.2g} of the speed is "
            f"kept; departure at {law.departure:.2g} of the angle of impact, roughness {law.roughness:.2g} deg"
        )
    yield f"ricochet off the ground: {words}"
    for entry in found.obstacles:
        yield (
            f"obstacle {entry.name}: {entry.kind}, z {entry.base:.4g} to {entry.top:.4g} m, "
            + (f"its top {entry.height:.4g} m over the ground below, " if entry.follows else "")
            + ("stops fragments" if entry.ricochet == "none" else f"ricochet as off {entry.ricochet}")
        )
    for site in found.exposed:
        where = direction_words(site.azimuth_deg, site.bearing_deg, whole=True)
        yield f"exposed {site.name}: {site.kind}, {site.distance:.1f} m at {where}"


def _ignition(entry: results.PlacedRound) -> str:
    words = []
    if entry.delays is not None:
        first, last = (f"{time * 1e6:.4g}" for time in entry.delays)
        points = "" if entry.ignition_points == 1 else f" at {entry.ignition_points} points"
        words.append(f"at {first} us{points}" if first == last else f"at {first} to {last} us{points}")
    if shock := entry.initiation:
        if shock.pressure is not None:
            words.append(f"by {shock.pressure / 1e9:.4g} GPa held for {(shock.duration or 0.0) * 1e6:.4g} us")
        elif not words:
            words.append("never; shock reported")
    return ", or ".join(words)


def _round_table(title: str, entry: results.CheckedRound) -> Table:
    table = Table(title=title, title_justify="left", box=None, show_header=False, pad_edge=False)
    for label, key, factor, unit in _ROUND_ROWS:
        if (value := getattr(entry, key)) is not None:
            table.add_row(label, number_text(value, factor), unit)
    for key, known in (entry.drawing or {}).items():
        table.add_row(f"{key} mass of the drawing", number_text(known.mass, 1.0), "kg")
        table.add_row(f"{key} mass, contours against drawing", f"{round(known.deviation * 100, 2) + 0.0:+.2f}", "%")
    for key, error in entry.mass_error_of_mesh.items():
        table.add_row(f"{key.replace('_', ' ')}, mesh against exact", f"{error * 100:+.3f}", "%")
    for volume, speed in (entry.effective_gurney_constant or {}).items():
        table.add_row(f"effective Gurney constant at V/V0 = {float(volume):g}", f"{speed:.0f}", "m/s")
    return table


def _segment_table(segments: Sequence[results.CheckedSegment]) -> Table:
    table = Table(box=None, pad_edge=False)
    for head in ("segment", "kind", "from mm", "to mm", "mean wall mm", "casing kg", "charge kg", "Gurney m/s"):
        table.add_column(head, justify="left" if head in ("segment", "kind") else "right")
    for one in segments:
        lengths = (f"{length * 1e3:.1f}" for length in (one.start, one.end, one.mean_wall))
        masses = (f"{mass:.3f}" for mass in (one.casing_mass, one.charge_mass))
        table.add_row(one.name, one.kind, *lengths, *masses, number_text(one.gurney_speed, 1.0))
    return table
