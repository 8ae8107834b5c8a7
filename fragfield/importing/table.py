"""`fragfield.import_table`: a table of a test, in any usual form, as a file that a case reads."""

from __future__ import annotations

import hashlib
import math
import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from flight.errors import InputError as FlightInputError
from flight.files.text_tables import write_columns
from fragfield.case.checks.expected_masses import RECOVERED
from fragfield.errors import InputError
from fragfield.importing import arena
from fragfield.importing.cells import GROUPS, QUANTITIES, plain
from fragfield.importing.columns import Columns, columns_by_name
from fragfield.importing.layout import lay_out
from fragfield.importing.sheet import Guess, QuestionError, read_text_file
from fragfield.importing.workbook import is_workbook, read_workbook
from fragfield.interface.kinds import File, Kind, PathName
from fragfield.version import __version__
from fragfield_base.errors import names_allowed
from fragfield_base.paths import absolute
from fragfield_base.units import UnitError, read_measure
from fragfield_base.writing import write_bytes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.arena import ArenaTable
    from fragfield.importing.layout import Layout
    from fragfield.importing.sheet import Sheet


KINDS = {
    "arena": "fragments of one round by polar zone and mass group: --fragments",
    "pit": "fragments counted by mass: break_up.mean_mass",
}
"""Kinds of tables, and where a case takes them."""
_PIT = ("mass_above", "mass_from", "mass_to", "mass_group", "number", "total_mass", "mass")


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
        Rows and columns that were left out.
    summary : dict
        Numbers to compare with the test's report: pieces, masses (kg), zones, speeds (m/s).
    rounds : float
        That the numbers of a pit test are of.
    provenance : dict of str
        Goes beside the file that is written.
    """

    kind: str
    source: Path
    content: Any
    guesses: list[Guess]
    dropped: list[str]
    summary: dict[str, Any]
    rounds: float = 1.0
    provenance: dict[str, str] = field(default_factory=dict)

    @property
    def default_name(self) -> str:
        """Name of the file beside the source that `write` takes."""
        return f"{self.source.stem}_{self.kind}.csv"

    def write(self, path: PathName | None = None) -> Path:
        """Write the file that a case reads; without a path into the working folder under `default_name`.

        Raises InputError: it would replace its own source, or cannot be written.
        """
        target = absolute(self.default_name if path is None else path, InputError)
        if target.suffix.lower() != ".csv":
            raise InputError(f"{target}: a table of the kind {self.kind} is written as .csv; name it so")
        if target.resolve() == self.source.resolve():
            raise InputError(f"{target}: is the file that was read; name another with --out")
        try:
            if not isinstance(self.content, dict):
                return self.content.write(target)
            write_columns(target, self.content)
        except FlightInputError as error:
            raise InputError(str(error)) from None
        if self.rounds != 1.0:  # a comment that our reader of pit tests takes the number from
            write_bytes(target, f"# rounds = {self.rounds:.10g}\n".encode() + target.read_bytes(), InputError)
        return target

    def __repr__(self) -> str:
        return f"<fragfield.ImportedTable {self.kind} of {self.source.name!r}: {self.summary['rows']} rows>"

    def __str__(self) -> str:
        lines = [f"{self.source.name}: {self.kind} ({KINDS[self.kind].partition(':')[0]})"]
        lines += [f"  {guess}" for guess in self.guesses]
        lines += [f"  left out: {one}" for one in self.dropped]
        lines += [f"  {line}" for line in summary_lines(self.summary)]
        return "\n".join(lines)


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
    """Read a table of a test in any usual form: CSV, XLSX, ODS.

    Parameters
    ----------
    path : path
        Table of a test: CSV, XLSX, ODS.
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
        Lines of the table with its names: 3:18 or 3:18,22:30.
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
    _check_choices(source, kind, columns or {}, units or {})
    casing = _casing(case, casing_mass)
    layout = lay_out(open_sheet(source, encoding, separator, sheet), decimal=decimal, rows=rows)
    chosen, given = dict(columns or {}), dict(units or {})
    kind = kind or _kind_of(layout, chosen)
    rounds = _rounds(layout, number_of_rounds)
    options = arena.ArenaOptions(rounds, zone_width, from_base, empty_zones, zone_angle)
    content, guesses, dropped = _content(layout, kind, chosen, given, options)
    summary = _summary(kind, content, len(layout.rows), casing)
    provenance = {
        "what": KINDS[kind].partition(":")[0],
        "source": source.name,
        "source_sha256": hashlib.sha256(source.read_bytes()).hexdigest(),
        "concluded": "; ".join(map(str, guesses)),
        "left out": "; ".join(dropped),
        "program": "fragfield import",
        "program_version": __version__,
    }
    return ImportedTable(kind, source, content, guesses, dropped, summary, rounds, provenance)


def open_sheet(
    path: Path, encoding: str | None = None, separator: str | None = None, sheet: str | None = None
) -> Sheet:
    """The cells of a file, before anything is concluded of their meaning; raises as `import_table`."""
    return read_workbook(path, sheet) if is_workbook(path) else read_text_file(path, encoding, separator)


_ROUNDS = re.compile(r"number of (?:rounds?|tests?|shots?)\b\D{0,12}?(\d+(?:\.\d+)?)")
"""What a line above a table says of the rounds that it is of, as `plain` has it."""


def _rounds(layout: Layout, given: float | None) -> float:
    """Rounds that the numbers are of; a line above the table that names several has to be confirmed."""
    if given is not None:
        if not (np.isfinite(given) and given > 0.0):
            raise InputError(f"{layout.sheet.path}: {given} rounds; needed: above zero")
        return given
    for line in layout.above:
        if own := re.fullmatch(r"\s*rounds\s*[=:]\s*([\d.]+)\s*", line):
            layout.guesses.append(Guess("rounds", own[1], f"the comment {line!r}"))
            return _rounds(layout, float(own[1]))
        said = _ROUNDS.search(plain(line))
        if said and float(said[1]) not in (0.0, 1.0):
            raise QuestionError(
                f"{layout.sheet.path}: {line!r} stands above the table: its numbers are of one round, or of all",
                "rounds", ("1", said[1]),
            )  # fmt: skip
    return 1.0


def _check_choices(path: Path, kind: str | None, columns: Mapping[str, str], units: Mapping[str, str]) -> None:
    if kind is not None and kind not in KINDS:
        raise InputError(f"{path}: kind {kind!r}{names_allowed(kind, KINDS)}")
    for name in columns:
        if name not in QUANTITIES:
            raise InputError(f"{path}: column {name!r}{names_allowed(name, QUANTITIES)}")
    known = [*GROUPS.values(), *(name for name, one in QUANTITIES.items() if one.unit)]
    for name in units:
        if name not in known:
            raise InputError(f"{path}: unit of {name!r}{names_allowed(name, known)}")


def _casing(case: PathName | None, mass: str | float | None) -> float | None:
    """Mass of the casing (kg), of a case or as given."""
    if case is not None:
        from fragfield.case import load_case
        from fragfield.case.conversion.rounds import masses_of

        values = load_case(absolute(case, InputError), burst=False)
        if not values.round:
            raise InputError(f"{case}: has no [[round]], so that the mass of its casing is not known")
        return float(masses_of(values.round[0]).casing)
    if mass is None:
        return None
    if isinstance(mass, str):
        try:
            measure = read_measure(mass)
        except UnitError as error:
            raise InputError(f"casing mass: found {mass!r}, {error}; allowed: a mass such as 12.1 kg") from None
        if not measure.is_of("kg"):
            raise InputError(f"casing mass: found {mass!r}; allowed: a mass such as 12.1 kg")
        mass = measure.value
    if not (np.isfinite(mass) and mass > 0.0):
        raise InputError(f"casing mass: found {mass} kg; needed: above zero")
    return float(mass)


def _kind_of(layout: Layout, chosen: Mapping[str, str]) -> str:
    """The kind whose columns a table has."""
    if {"zone", "zone_from"} & set(columns_by_name(layout, ("zone", "zone_from"), chosen)):
        return "arena"
    masses = ("mass_above", "mass_from", "mass_group", "mass")
    if any(columns_by_name(layout, [one], chosen) for one in masses):
        return "pit"
    titles = [repr(one) for one in layout.names if one]
    have = f"found the columns {', '.join(titles)}" if titles else "its columns have no names"
    raise QuestionError(f"{layout.sheet.path}: the kind of table is not known: {have}", "kind", list(KINDS))


def _content(
    layout: Layout, kind: str, chosen: Mapping[str, str], units: Mapping[str, str], options: arena.ArenaOptions
) -> tuple[ArenaTable | dict[str, NDArray[np.float64]], list[Guess], list[str]]:
    if kind == "arena":
        return arena.arena_table(layout, chosen, units, options)
    columns = Columns(layout, columns_by_name(layout, _PIT, chosen), units, chosen)
    content = _pit_columns(columns)
    _check_pit(layout.sheet.path, content, options.rounds)
    dropped = [*layout.dropped, *(f"column {one!r}" for one in columns.unused())]
    return content, [*layout.guesses, *columns.guesses], dropped


def _pit_columns(columns: Columns) -> dict[str, NDArray[np.float64]]:
    """Columns of a file that `break_up.mean_mass` names: groups of mass, numbers above masses, or pieces."""
    if "mass_above" in columns:
        columns.require("number")
        return {"mass_above_kg": columns.whole("mass_above"), "number": columns.whole("number")}
    if "mass_group" in columns or "mass_from" in columns:
        low, high = _groups(columns)
        columns.require("number")
        number = np.nan_to_num(columns.values("number"))
        columns.refuse_sum(number)
        found = {"mass_from_kg": low, "mass_to_kg": high, "number": number}
        weighed = next((name for name in ("total_mass", "mass") if name in columns), None)
        return found if weighed is None else found | {"mass_kg": np.nan_to_num(columns.values(weighed))}
    columns.require("mass")
    found = {"mass_kg": columns.whole("mass")}
    return found | ({"number": columns.whole("number")} if "number" in columns else {})


def _groups(columns: Columns) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    if "mass_group" not in columns:
        columns.require("mass_from", "mass_to")
        high = columns.values("mass_to")
        high[-1] = math.inf if np.isnan(high[-1]) else high[-1]
        if np.isnan(high).any():
            columns.whole("mass_to")
        return columns.whole("mass_from"), high
    ranges = columns.intervals("mass_group", "kg")
    for row, one in zip(columns.layout.rows, ranges, strict=True):
        if one is None:
            raise InputError(f"{columns.place(row, 'mass_group')}: not a range; allowed: from and to, as 5-10 or > 50")
    return np.array([one.low for one in ranges if one]), np.array([one.high for one in ranges if one])


def _check_pit(path: Path, content: Mapping[str, Any], rounds: float) -> None:
    """Refuse what our own reader would refuse."""
    from fragfield.case.conversion.mean_mass import read_counts
    from transition.errors import InputError as BreakUpInputError

    with tempfile.TemporaryDirectory() as folder:
        try:
            read_counts(ImportedTable("pit", path, content, [], [], {}, rounds).write(Path(folder) / "pit.csv"))
        except (InputError, FlightInputError, BreakUpInputError) as error:
            message = str(error).replace(f"{Path(folder) / 'pit.csv'}: ", "").replace("pit.csv: ", "")
            raise InputError(f"{path}: {message}") from None


def _summary(kind: str, content: Any, rows: int, casing: float | None) -> dict[str, Any]:  # noqa: ANN401
    found: dict[str, Any] = {"rows": rows}
    if kind == "arena":
        held = content.number > 0.0
        speed = content.speed[held]
        zones = content.by_zone()
        at = int(np.argmax(zones["mass"]))
        found |= {
            "pieces": float(content.number.sum()), "mass": content.total_mass, "zones": len(content.zones) - 1,
            "largest_mean_mass": float(content.mass[held].max(initial=0.0)),
            "mean_speeds": [float(speed.min(initial=np.inf)), float(speed.max(initial=0.0))],
            "most_mass_deg": [float(content.zones[at]), float(content.zones[at + 1])],
        }  # fmt: skip
    else:
        number = content.get("number", np.ones(rows))
        if "mass_above_kg" in content:
            found |= {"pieces": float(number.max()), "lightest": float(content["mass_above_kg"].min())}
        else:
            found["pieces"] = float(number.sum())
            if "mass_kg" in content:
                single = "mass_from_kg" not in content
                found["mass"] = float((content["mass_kg"] * number).sum() if single else content["mass_kg"].sum())
    if casing is not None and "mass" in found:
        found |= {"casing_mass": casing, "recovered_fraction": found["mass"] / casing}
    return found


_LABELS = {
    "rows": ("rows", "{:g}"), "pieces": ("pieces", "{:.10g}"), "mass": ("total mass", "{:.4g} kg"),
    "zones": ("polar zones", "{:g}"), "largest_mean_mass": ("heaviest group, mean mass", "{:.4g} kg"),
    "mean_speeds": ("mean speeds", "{:.4g} to {:.4g} m/s"), "lightest": ("lightest mass counted", "{:.4g} kg"),
    "most_mass_deg": ("zone of the most mass", "{:g} to {:g} degrees from the nose"),
    "casing_mass": ("mass of the casing", "{:.4g} kg"), "recovered_fraction": ("of it recovered", "{:.1%}"),
}  # fmt: skip


def summary_lines(summary: Mapping[str, Any]) -> list[str]:
    """A summary as lines of text."""
    lines = []
    for name, value in summary.items():
        label, form = _LABELS[name]
        lines.append(f"{label}: {form.format(*(value if isinstance(value, list) else [value]))}")
    low, high = RECOVERED
    if not low <= summary.get("recovered_fraction", 1.0) <= high:
        lines.append(
            f"warning: `fly` refuses a table with less than {low:.0%} or more than {high:.0%} of the casing; are its "
            "numbers those of one round (--rounds), its masses in their unit (--unit)?"
        )
    return lines
