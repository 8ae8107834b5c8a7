"""`fragfield.import_table`: a table of a test as a file that a case reads."""

from __future__ import annotations

import hashlib
import math
import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from flight.arena import ArenaTable
from flight.errors import InputError as FlightInputError
from flight.files.text_tables import write_columns
from fragfield.case import load_case
from fragfield.case.checks.expected_masses import RECOVERED
from fragfield.case.conversion.mean_mass import read_counts
from fragfield.case.conversion.rounds import masses_of
from fragfield.errors import InputError
from fragfield.importing.columns import GROUPS, QUANTITIES, Columns
from fragfield.importing.sheet import Guess, QuestionError, read_sheet
from fragfield.interface.kinds import File, Kind, PathName
from fragfield_base.errors import names_allowed
from fragfield_base.paths import absolute
from fragfield_base.units import UnitError, read_measure
from fragfield_base.version import __version__
from fragfield_base.writing import write_bytes
from transition.errors import InputError as BreakUpInputError

Array = NDArray[np.float64]


KINDS = {
    "arena": "fragments of one round by polar zone and mass group: --fragments",
    "pit": "fragments counted by mass: break_up.mean_mass",
}
"""Kinds of tables, and where a case takes them."""
_ARENA = (
    "zone_from", "zone_to", "zone", "mass_from", "mass_to", "mass_group", "number", "mean_mass", "total_mass", "mass",
    "mean_speed", "max_speed",
)  # fmt: skip
_PIT = ("mass_above", "mass_from", "mass_to", "mass_group", "number", "total_mass", "mass")
_SNAP = 0.02  # degrees by which rounded radians may miss 180
_LABELS = {
    "rows": ("rows", "{:g}"), "pieces": ("pieces", "{:.10g}"), "mass": ("total mass", "{:.4g} kg"),
    "zones": ("polar zones", "{:g}"), "largest_mean_mass": ("heaviest group, mean mass", "{:.4g} kg"),
    "mean_speeds": ("mean speeds", "{:.4g} to {:.4g} m/s"), "lightest": ("lightest mass counted", "{:.4g} kg"),
    "most_mass_deg": ("zone of the most mass", "{:g} to {:g} degrees from the nose"),
    "casing_mass": ("mass of the casing", "{:.4g} kg"), "recovered_fraction": ("of it recovered", "{:.1%}"),
}  # fmt: skip


@dataclass(frozen=True, repr=False)
class ImportedTable:
    """A table in our units, with all that was concluded on the way.

    Attributes
    ----------
    kind : str
        One of `KINDS`.
    source : Path
        The file that was read.
    content : ArenaTable or dict of columns (pit)
        The table.
    guesses : list of Guess
        What was concluded of the file: `what`, `value`, `reason`.
    dropped : list of str
        Columns that were left out.
    summary : dict
        Numbers to compare with the test's report: pieces, masses (kg), zones, speeds (m/s).
    rounds : float
        That the numbers of a pit test are of.
    provenance : dict of str
        Source with its SHA-256, what was concluded and left out: comments at the head of the file that is written.
    """

    kind: str
    source: Path
    content: Any
    guesses: list[Guess]
    dropped: list[str]
    summary: dict[str, Any]
    rounds: float = 1.0
    provenance: dict[str, str] = field(default_factory=dict)

    def write(self, path: PathName | None = None) -> Path:
        """Write the file that a case reads; without a path into the working folder, called after source and kind.

        Raises InputError: it would replace its own source, or cannot be written.
        """
        target = absolute(f"{self.source.stem}_{self.kind}.csv" if path is None else path, InputError)
        if target.suffix.lower() != ".csv":
            raise InputError(f"{target}: a table of the kind {self.kind} is written as .csv; name it so")
        if target.resolve() == self.source.resolve():
            raise InputError(f"{target}: is the file that was read; name another with --out")
        try:
            if isinstance(self.content, dict):
                write_columns(target, self.content)
            else:
                self.content.write(target)
        except FlightInputError as error:
            raise InputError(str(error)) from None
        head = [f"# {key}: {' '.join(value.split())}\n" for key, value in self.provenance.items() if value]
        if self.rounds != 1.0:  # our reader of pit tests takes the number from this comment
            head.append(f"# rounds = {self.rounds:.10g}\n")
        write_bytes(target, "".join(head).encode() + target.read_bytes(), InputError)
        return target

    def __repr__(self) -> str:
        return f"<fragfield.ImportedTable {self.kind} of {self.source.name!r}: {self.summary['rows']} rows>"

    def __str__(self) -> str:
        lines = [*map(str, self.guesses), *(f"left out: {one}" for one in self.dropped)]
        for name, value in self.summary.items():
            label, form = _LABELS[name]
            lines.append(f"{label}: {form.format(*(value if isinstance(value, list) else [value]))}")
        low, high = RECOVERED
        if not low <= self.summary.get("recovered_fraction", 1.0) <= high:
            lines.append(
                f"warning: `fly` refuses a table with less than {low:.0%} or more than {high:.0%} of the casing; are "
                "its numbers those of one round (--rounds), its masses in their unit (--unit)?"
            )
        head = f"{self.source.name}: {self.kind} ({KINDS[self.kind].partition(':')[0]})"
        return "\n  ".join([head, *lines])


def import_table(
    path: File,
    kind: str | None = None,
    *,
    columns: Annotated[Mapping[str, str] | None, Kind(dict, "QUANTITY=NAME", "--column")] = None,
    units: Annotated[Mapping[str, str] | None, Kind(dict, "QUANTITY=UNIT", "--unit")] = None,
    encoding: str | None = None,
    separator: str | None = None,
    decimal: str | None = None,
    sheet: str | None = None,
    rows: str | None = None,
    number_of_rounds: Annotated[float | None, Kind(float, "N", "--rounds")] = None,
    zone_width: float = 5.0,
    zone_angle: str | None = None,
    from_base: bool = False,
    empty_zones: bool = False,
    case: File | None = None,
    casing_mass: str | float | None = None,
) -> ImportedTable:
    """Read a table of a test: CSV, XLSX.

    Parameters
    ----------
    path : path
        Table of a test: CSV, XLSX.
    kind : str, optional
        arena or pit; default: as its columns show.
    columns : mapping
        Column of a quantity by name or number; repeatable: mass="Weight (g)". In Python `{"mass": "Weight (g)"}`.
    units : mapping
        Unit of a quantity, or of all masses, speeds, angles; repeatable: mass=g. In Python `{"mass": "g"}`.
    encoding : str, optional
        Of a text: utf-8, cp1252, mac_roman ...
    separator : str, optional
        Between cells: comma, semicolon, tab, bar.
    decimal : str, optional
        Of the numbers of a text: point or comma.
    sheet : str, optional
        Sheet of a workbook, by name or number.
    rows : str, optional
        Lines of the table with its names: 3:18 or 3,5:18.
    number_of_rounds : float, optional
        Rounds that the numbers are of together; 0.25: a quarter of the azimuth.
    zone_width : float
        Of the zones that single pieces are put into (degrees).
    zone_angle : str, optional
        What the one angle of a zone is: from, centre or to.
    from_base : bool
        Angles of an arena table count from the base, not the nose.
    empty_zones : bool
        Zones without a row hold no fragment.
    case : path, optional
        Compare the mass with the casing of this case.
    casing_mass : str or float, optional
        Compare the mass with that of the casing: "12.1 kg". In Python also a number in kg.

    Raises
    ------
    InputError
        The file is no table of this kind; `QuestionError` where something in it has two meanings that differ by a
        factor: its `option` names the parameter that answers, `choices` the answers.
    """
    source = absolute(path, InputError)
    if kind is not None and kind not in KINDS:
        raise InputError(f"{source}: kind {kind!r}{names_allowed(kind, KINDS)}")
    known = [*GROUPS.values(), *(name for name, one in QUANTITIES.items() if one.unit)]
    for what, given, allowed in (("column", columns or {}, list(QUANTITIES)), ("unit of", units or {}, known)):
        for name in given:
            if name not in allowed:
                raise InputError(f"{source}: {what} {name!r}{names_allowed(name, allowed)}")
    casing = _casing(case, casing_mass)
    cells = read_sheet(source, encoding=encoding, separator=separator, sheet=sheet)
    table = Columns(cells, chosen=columns or {}, units=units or {}, decimal=decimal, lines=rows)
    kind = kind or _kind_of(table)
    table.find(_ARENA if kind == "arena" else _PIT)
    rounds = _rounds(table, number_of_rounds)
    content: ArenaTable | dict[str, Array]
    if kind == "arena":
        try:
            content = _arena(table, rounds, zone_width, zone_angle, from_base, empty_zones)
        except FlightInputError as error:
            raise InputError(f"{source}: {error}") from None
        table.guesses.append(Guess("angles", f"from the {'base' if from_base else 'nose'}", "--from-base turns them"))
        table.guesses.append(Guess("numbers", f"of {rounds:g} round{'' if rounds == 1 else 's'}", "--rounds"))
    else:
        content = _pit(table)
        _check_pit(source, content, rounds)
    provenance = {
        "what": KINDS[kind].partition(":")[0],
        "source": source.name,
        "source_sha256": hashlib.sha256(source.read_bytes()).hexdigest(),
        "concluded": "; ".join(map(str, table.guesses)),
        "left out": "; ".join(table.unused()),
        "program": "fragfield import",
        "program_version": __version__,
    }
    summary = _summary(content, len(table.rows), casing)
    return ImportedTable(kind, source, content, table.guesses, table.unused(), summary, rounds, provenance)


def _rounds(table: Columns, given: float | None) -> float:
    """Rounds that the numbers are of; a line above the table that names several has to be confirmed."""
    if given is not None:
        if not (math.isfinite(given) and given > 0.0):
            raise InputError(f"{table.sheet.path}: {given} rounds; needed: above zero")
        return given
    for line in table.above:
        if own := re.fullmatch(r"\s*rounds\s*[=:]\s*([\d.]+)\s*", line):
            return _rounds(table, float(own[1]))
        said = re.search(r"number of (?:rounds?|tests?|shots?)\b\D{0,12}?(\d+(?:\.\d+)?)", line.casefold())
        if said and float(said[1]) not in (0.0, 1.0):
            raise QuestionError(
                f"{table.sheet.path}: {line!r} stands above the table: its numbers are of one round, or of all",
                "rounds", ("1", said[1]),
            )  # fmt: skip
    return 1.0


def _casing(case: PathName | None, mass: str | float | None) -> float | None:
    if case is not None:
        values = load_case(absolute(case, InputError), burst=False)
        if not values.round:
            raise InputError(f"{case}: has no [[round]], so that the mass of its casing is not known")
        return float(masses_of(values.round[0]).casing)
    if mass is None:
        return None
    try:
        measure = read_measure(mass if isinstance(mass, str) else f"{mass!r} kg")
    except UnitError as error:
        raise InputError(f"casing mass: found {mass!r}, {error}; allowed: a mass such as 12.1 kg") from None
    if not (measure.is_of("kg") and measure.value > 0.0):
        raise InputError(f"casing mass: found {mass!r}; allowed: a mass above zero such as 12.1 kg")
    return measure.value


def _kind_of(table: Columns) -> str:
    meant = {*table.chosen, *table.meanings()}
    if meant & {"zone", "zone_from"}:
        return "arena"
    if meant & {"mass_above", "mass_from", "mass_group", "mass"}:
        return "pit"
    titles = [repr(one) for one in table.names if one]
    have = f"found the columns {', '.join(titles)}" if titles else "its columns have no names"
    raise QuestionError(f"{table.sheet.path}: the kind of table is not known: {have}", "kind", list(KINDS))


def _arena(
    table: Columns, rounds: float, width: float, zone_angle: str | None, from_base: bool, empty_zones: bool
) -> ArenaTable:
    """One row a piece, a zone, or a zone and group of mass; numbers of one round."""
    if "number" not in table and "zone" in table and "mass" in table:
        table.require("mean_speed")
        polar, mass, speed = (table.whole(name) for name in ("zone", "mass", "mean_speed"))
        for name, values, bad, allowed in (
            ("zone", polar, (polar < 0.0) | (polar > 180.0), "0 to 180 degrees from the nose"),
            ("mass", mass, ~(mass > 0.0), "above zero"),
        ):
            if bad.any():
                at = int(np.argmax(bad))
                raise InputError(f"{table.place(at, name)}: found {values[at]:g}; allowed: {allowed}")
        table.guesses.append(Guess("layout", "one row a piece", "an angle and a mass, but no count"))
        return ArenaTable.of_pieces(mass, 180.0 - polar if from_base else polar, speed, rounds, width=width)
    start, end = _zones(table, zone_angle)
    table.require("number", "mean_speed")
    number = np.nan_to_num(table.values("number"))
    table.refuse_sum(number)
    if (number < 0.0).any():
        raise InputError(f"{table.place(int(np.argmin(number)), 'number')}: found {number.min():g}; needed: 0 or more")
    held = number > 0.0
    low, high = _groups(table) or (np.zeros(len(number)), np.full(len(number), math.inf))
    mean, speed = _mean_mass(table, number), table.whole("mean_speed", held)
    largest = np.maximum(table.values("max_speed") if "max_speed" in table else speed, speed)
    if from_base:
        start, end = 180.0 - end, 180.0 - start
    zones, zone = _edges(table, start, end, empty_zones)
    keep = held if held.any() else np.ones(len(held), dtype=bool)
    columns = (low, high, number / rounds, mean, speed, largest)
    return ArenaTable.of_rows(zones, zone[keep], *(np.nan_to_num(one, posinf=math.inf)[keep] for one in columns))


def _down(values: Array) -> Array:
    """Values, empty ones as those above them: merged cells."""
    return values[np.maximum.accumulate(np.where(np.isnan(values), 0, np.arange(len(values))))]


def _zones(table: Columns, zone_angle: str | None) -> tuple[Array, Array]:
    if "zone_from" in table or "zone" not in table:
        table.require("zone_from", "zone_to")
        return _down(table.values("zone_from")), _down(table.values("zone_to"))
    if ranges := table.ranges("zone"):
        return _down(ranges[0]), _down(ranges[1])
    angles = _down(table.values("zone"))
    each = np.unique(angles[~np.isnan(angles)])
    if len(each) < 2 or zone_angle not in ("from", "centre", "to"):
        words = ", ".join(f"{one:g}" for one in (each if len(each) < 4 else [*each[:2], each[-1]]))
        raise QuestionError(
            f"{table.sheet.path}: zone: one angle a zone, {words}", "zone-angle", ("from", "centre", "to")
        )
    edges = {
        "from": np.append(each, 180.0),
        "to": np.insert(each, 0, 0.0),
        "centre": np.concatenate([[0.0], np.round((each[1:] + each[:-1]) / 2.0, 9), [180.0]]),
    }[zone_angle]
    at = np.searchsorted(each, angles)
    return edges[at], edges[at + 1]


def _groups(table: Columns) -> tuple[Array, Array] | None:
    """Lower and upper masses of groups (kg), the last without an upper end where it is empty; None without columns."""
    if "mass_group" in table and (ranges := table.ranges("mass_group")):
        if np.isnan(ranges[0]).any():
            table.whole("mass_group")
        return ranges
    if "mass_from" not in table:
        return None
    table.require("mass_to")
    high = table.values("mass_to")
    return table.whole("mass_from"), np.where(np.isnan(high), math.inf, high)


def _mean_mass(table: Columns, number: Array) -> Array:
    """Mean mass of every row; a column "mass" is the mean or the total, which the caller says."""
    held = number > 0.0
    if "mean_mass" in table:
        return table.whole("mean_mass", held)
    if "total_mass" in table:
        return np.divide(table.whole("total_mass", held), number, out=np.zeros(len(number)), where=held)
    if "mass" not in table:
        table.require("mean_mass")
    title = table.names[table.index["mass"]] or str(table.index["mass"] + 1)
    raise QuestionError(
        f"{table.sheet.path}: mass ({title!r}) is that of one fragment, or of all of the row", "column",
        [f'mean_mass="{title}"', f'total_mass="{title}"'],
    )  # fmt: skip


def _edges(table: Columns, start: Array, end: Array, empty_zones: bool) -> tuple[Array, NDArray[np.int64]]:
    """Edges of all zones, and the zone of every row; zones without rows are refused or empty."""
    start, end = (np.round(np.where(np.abs(one - 180.0) < _SNAP, 180.0, one), 9) for one in (start, end))
    bad = ~((start >= 0.0) & (end <= 180.0) & (start < end))
    path = table.sheet.path
    if bad.any():
        at = int(np.argmax(bad))
        raise InputError(
            f"{table.sheet.place(table.rows[at].line)}: a zone from {start[at]:g} to {end[at]:g} degrees; "
            "allowed: rising, from 0 to 180"
        )
    edges = np.unique(np.concatenate([start, end]))
    zone = np.searchsorted(edges, start)
    over = end != edges[zone + 1]
    if over.any():
        raise InputError(f"{path}: the zone from {start[over][0]:g} to {end[over][0]:g} degrees overlaps another")
    whole = np.unique(np.concatenate([edges, [0.0, 180.0]]))
    zone = np.searchsorted(whole, start).astype(np.int64)
    gaps = np.setdiff1d(np.arange(len(whole) - 1), zone)
    if len(gaps) and not empty_zones:
        words = ", ".join(f"{whole[at]:g} to {whole[at + 1]:g}" for at in gaps[:4])
        raise QuestionError(
            f"{path}: no row for {words} degrees{' and more' if len(gaps) > 4 else ''}: nothing fell there, which "
            "--empty-zones says, or it was not measured, which cannot be flown", "empty-zones",
        )  # fmt: skip
    return whole, zone


def _pit(table: Columns) -> dict[str, Array]:
    if "mass_above" in table:
        table.require("number")
        return {"mass_above_kg": table.whole("mass_above"), "number": table.whole("number")}
    if groups := _groups(table):
        table.require("number")
        number = np.nan_to_num(table.values("number"))
        table.refuse_sum(number)
        found = {"mass_from_kg": groups[0], "mass_to_kg": groups[1], "number": number}
        weighed = next((name for name in ("total_mass", "mass") if name in table), None)
        return found if weighed is None else found | {"mass_kg": np.nan_to_num(table.values(weighed))}
    table.require("mass")
    found = {"mass_kg": table.whole("mass")}
    return found | ({"number": table.whole("number")} if "number" in table else {})


def _check_pit(path: Path, content: Mapping[str, Any], rounds: float) -> None:
    with tempfile.TemporaryDirectory() as folder:
        try:
            read_counts(ImportedTable("pit", path, content, [], [], {}, rounds).write(Path(folder) / "pit.csv"))
        except (InputError, FlightInputError, BreakUpInputError) as error:
            message = str(error).replace(f"{Path(folder) / 'pit.csv'}: ", "").replace("pit.csv: ", "")
            raise InputError(f"{path}: {message}") from None


def _summary(content: ArenaTable | dict[str, Array], rows: int, casing: float | None) -> dict[str, Any]:
    found: dict[str, Any] = {"rows": rows}
    if isinstance(content, ArenaTable):
        held = content.number > 0.0
        speed = content.speed[held]
        at = int(np.argmax(content.by_zone()["mass"]))
        found |= {
            "pieces": float(content.number.sum()), "mass": content.total_mass, "zones": len(content.zones) - 1,
            "largest_mean_mass": float(content.mass[held].max(initial=0.0)),
            "mean_speeds": [float(speed.min(initial=np.inf)), float(speed.max(initial=0.0))],
            "most_mass_deg": [float(content.zones[at]), float(content.zones[at + 1])],
        }  # fmt: skip
    elif "mass_above_kg" in content:
        found |= {"pieces": float(content["number"].max()), "lightest": float(content["mass_above_kg"].min())}
    else:
        number = content.get("number", np.ones(rows))
        found["pieces"] = float(number.sum())
        if "mass_kg" in content:
            found["mass"] = float((content["mass_kg"] * (1.0 if "mass_from_kg" in content else number)).sum())
    if casing is not None and "mass" in found:
        found |= {"casing_mass": casing, "recovered_fraction": found["mass"] / casing}
    return found
