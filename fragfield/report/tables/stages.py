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
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    from fragfield.report.reading.run_files import RunFiles


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


def alike_around(run: RunFiles) -> bool:
    """Whether all azimuths are alike, so that a sector differs from the others at random alone."""
    return run.part("hazard").get("basis") == "all_azimuths"


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
