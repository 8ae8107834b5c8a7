"""The tables of the report: practical values with SI beside them."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.numbers import Row, number, row
from fragfield.quantities import shown
from fragfield.report.blocks import Rows, Table

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from fragfield.report.reading.run_files import RunFiles


_LEDGER = {
    "products_work": "Work of the products",
    "kinetic": "Kinetic energy",
    "kinetic_casing": "– of the casing",
    "strain": "Strain energy",
    "plastic": "Plastic work",
    "viscous": "Artificial viscosity",
    "hourglass": "Hourglass control",
    "contact": "Contact: springs and friction",
    "damping": "Damping",
    "products_energy_left": "Energy left in the products",
}


_GEOMETRIES = {"3d": "three dimensions", "axisymmetric": "axisymmetric"}


def _cells(lines: Iterable[Iterable[str]]) -> tuple[tuple[str, ...], ...]:
    return tuple(tuple(line) for line in lines)


def mesh_rows(run: RunFiles) -> Rows:
    """Size of the mesh and quality of its cells."""
    part = run.cells["part"]
    rows = [line for one in shown("mesh", "burst") for line in one.rows(run.summary)]
    rows.insert(1, row("– of the casings", int((part == 0).sum())))
    rows.insert(2, row("– of the charges", int((part == 1).sum())))
    return Rows("Mesh", (row("Cell size", run.cell_size, "m"), *rows, *_geometry_rows(run), *_symmetry_rows(run)))


def _geometry_rows(run: RunFiles) -> Iterator[Row]:
    """In which geometry the burst was computed, and why."""
    burst = run.summary.get("burst", {})
    if "geometry" in burst:
        name = _GEOMETRIES[burst["geometry"]]
        yield row("Geometry of the burst", name, "", str(burst.get("geometry_reason", "")))


def _symmetry_rows(run: RunFiles) -> Iterator[Row]:
    """What of the arrangement was computed, where planes of symmetry bound it."""
    from burst_fenicsx.symmetry import symmetry_words

    found = run.part("burst").get("symmetry")
    if found and found["planes"]:
        yield row("Hexahedra computed", run.part("burst").get("cells"), "", "the others are their images")
    for line in symmetry_words(found) if found else ():
        words, _, rest = line.partition(": ")
        yield Row(words.capitalize(), rest)


def ledger_table(run: RunFiles) -> Iterator[Table]:
    """Entries of the ledger at the end."""
    if "products_work" not in run.history or not len(run.history["products_work"]):
        return
    work = float(run.history["products_work"][-1])
    lines = []
    for key, words in _LEDGER.items():
        if key in run.history:
            value = float(run.history[key][-1])
            share = number(100 * value / work, 3) if work else "–"
            lines.append((words, number(value * 1e-6, 4), share))
    gain = run.history.get("contact_gain")
    if gain is not None:
        share = number(100 * float(gain[-1]) / work, 3) if work else "–"
        lines.append(("Made by contact (part of the imbalance)", number(float(gain[-1]) * 1e-6, 3), share))
    error = run.history.get("energy_error")
    if error is not None:
        worst = float(np.nanmax(np.abs(error), initial=0.0))
        lines.append(("Largest imbalance", number(worst * work * 1e-6, 3), number(worst * 100, 3)))
    yield Table("Ledger at the end of the burst", ("Entry", "MJ", "% of the work"), tuple(lines))


def quantity_rows(run: RunFiles, title: str, *parts: str) -> Iterator[Rows]:
    """What the catalogue lists of some parts of the summary; nothing where none of it is there."""
    if rows := tuple(line for one in shown("report", *parts) for line in one.rows(run.summary)):
        yield Rows(title, rows)


def break_up_rows(run: RunFiles) -> Iterator[Rows]:
    """The break-up in numbers."""
    mass = run.fragments["mass"]
    speed = np.linalg.norm(run.fragments["velocity"], axis=1)
    rows = [
        row("Fragments", len(mass)),
        row("Mass of all", float(mass.sum()), "kg"),
        row("Mean mass", float(mass.mean()) if len(mass) else None, "kg"),
        row("Heaviest", float(mass.max(initial=0.0)), "kg"),
        row("Fastest", float(speed.max(initial=0.0)), "m/s"),
    ]
    if run.fragments_file is None:
        rows += [line for one in shown("report", "break_up") for line in one.rows(run.summary)]
    yield Rows("Fragments", tuple(rows))


def flight_rows(run: RunFiles) -> Iterator[Rows]:
    """The flight in numbers."""
    listed = shown("report", "flight", "flight.recovered", "flight.contact")
    rows = [line for one in listed for line in one.rows(run.summary)]
    rows += _area_rows(run.part("flight").get("presented_area") or {})
    rows += [row(f"Fragments through “{item['name']}”", item["hits"]) for item in run.witnesses]
    yield Rows("Flight", tuple(rows))


def _area_rows(area: Mapping[str, Any]) -> Iterator[Row]:
    """The model of the presented areas."""
    if not area:
        return
    words = str(area.get("model"))
    if "ratios" in area:
        words += " " + ":".join(f"{ratio:g}" for ratio in area["ratios"])
    if "spread" in area:
        words += f", spread {area['spread']:g}"
    low, high = (number(area.get(f"shape_factor_{share}_percent")) for share in (5, 95))
    factors = f"{low} kg/m³" if low == high else f"{low} to {high} kg/m³ for 90 % of the fragments"
    yield row("Presented areas", words, "", f"shape factor {factors}")


def azimuth_tables(run: RunFiles) -> Iterator[Table]:
    """Every witness surface by azimuth."""
    for witness in run.witnesses:
        rows = witness.get("by_azimuth") or []
        if alike_around(run) and rows:
            yield _all_around(witness, rows)
            continue
        lines = [
            (
                f"{line.get('azimuth_deg', 0):.0f}",
                number(line.get("hits")),
                number(line["hazardous_hits"]) if line.get("hazardous_hits") is not None else "–",
                _rounded(line.get("mean_initial_speed")),
                _rounded(line.get("max_initial_speed")),
            )
            for line in rows
        ]
        head = ("Azimuth (°)", "Hits", "Hazardous", "Mean (m/s)", "Largest (m/s)")
        if lines:
            name = witness.get("name", "")
            yield Table(f"Witness “{name}”", head, _cells(lines), "Initial speeds.", columns=2)


def alike_around(run: RunFiles) -> bool:
    """Whether all azimuths are alike, so that a sector differs from the others at random alone."""
    return run.part("hazard").get("basis") == "all_azimuths"


def _all_around(witness: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> Table:
    """One row for sectors that are alike: means of the numbers, the mean of the mean speeds by number."""
    hits, hazardous, mean, largest = (
        np.array([line.get(key) or 0.0 for line in rows], dtype=float)
        for key in ("hits", "hazardous_hits", "mean_initial_speed", "max_initial_speed")
    )
    speed = float(np.average(mean, weights=hits)) if hits.any() else None
    line = (
        f"all {len(rows)} sectors", f"{hits.mean():.1f}", f"{hazardous.mean():.1f}", _rounded(speed),
        _rounded(float(largest.max())),
    )  # fmt: skip
    head = ("Azimuth", "Hits, mean of a sector", "Hazardous", "Mean (m/s)", "Largest (m/s)")
    note = "All azimuths are alike; the sectors of the first realisation differ at random. Initial speeds."
    return Table(f"Witness “{witness.get('name', '')}”", head, (line,), note)


def _rounded(value: float | None, decimals: int = 0) -> str:
    return "–" if value is None or not np.isfinite(value) else f"{value:,.{decimals}f}"


def provenance_rows(run: RunFiles) -> Iterator[Rows | Table]:
    """Program, versions, seed, date, and the fingerprints of the files."""
    rows = [
        Row(words, run.provenance[key])
        for key, words in (
            ("program", "Program"), ("program_version", "Version"), ("revision", "Revision"), ("date", "Date (UTC)"),
            ("seed", "Seed"), ("platform", "Platform"),
        )
        if run.provenance.get(key)
    ]  # fmt: skip
    versions = run.summary.get("versions") or _json(run.provenance.get("versions"))
    rows += [Row(f"Version of {name}", str(value)) for name, value in versions.items() if name != "fragfield"]
    if rows:
        yield Rows("Program", tuple(rows))
    lines = []
    for path in sorted(run.folder.iterdir()):
        if path.is_file() and path.suffix in {".toml", ".json", ".h5", ".csv", ".xdmf"}:
            size = path.stat().st_size
            digest = "too large" if size > 200_000_000 else digest_of(path)
            lines.append((path.name, number(size), digest))
    if lines:
        yield Table("Files of the run", ("File", "Bytes", "SHA-256, first 16"), _cells(lines))


def digest_of(path: Path) -> str:
    """First 16 digits of a file's SHA-256."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def _json(text: str | None) -> dict[str, Any]:
    try:
        found = json.loads(text or "{}")
    except json.JSONDecodeError:
        return {}
    return found if isinstance(found, dict) else {}
