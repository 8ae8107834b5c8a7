"""`fragfield.check` and `fragfield.convert`: what follows from a case, its drawing, and files as tables of a case."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from pydantic import ValidationError

from fragfield.case.changes import read_settings
from fragfield.case.faults import CaseFaults, explain
from fragfield.case.tables.round import ContourTable
from fragfield.case.tables.surroundings import PlacesTable, SiteTable
from fragfield.case.write import tables_to_toml
from fragfield.checking import check as checking
from fragfield.checking.check import fragments_report
from fragfield.contours import read as contours
from fragfield.errors import InputError
from fragfield.interface.case import Case, case_of
from fragfield.interface.kinds import CaseOrRun, File, PathName, Settings
from fragfield.results.check import Checked, CheckedBurst
from fragfield_base.paths import absolute
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from fragfield.case.tables.base import Table


@dataclass(frozen=True, repr=False)
class CheckResult:
    """What a case was found to be; `print` shows it as `fragfield check` does, without the case itself.

    Attributes
    ----------
    case : Case
        The case.
    found : Checked
        What `fragfield check --json` prints, by attribute: `warnings`, `official`, `contents`, `rules`,
        `distance_to_apply`, `fragments` (None where none were given), and of a case with a burst `rounds`,
        `arrangement`, `geometry`, `mesh`, `symmetry`, `expected`; numbers in SI.
    """

    case: Case
    found: Checked | CheckedBurst

    @property
    def warnings(self) -> list[str]:
        """What looks doubtful in the case."""
        return list(self.found.warnings)

    def draw(self, path: PathName) -> list[Path]:
        """Write the dimensioned drawing of the round (.svg), of different rounds one each; their paths.

        Raises
        ------
        InputError
            Another ending, no round, a round from a mesh file, or no right to write.
        """
        from fragfield.report.figures.rounds import draw_round, drawn_rounds, expected_masses

        case, target = self.case.values, absolute(path, InputError)
        if target.suffix.lower() != ".svg":
            raise InputError(f"--drawing: found {target.name}; allowed: a name that ends in .svg")
        if not case.round:
            raise InputError("--drawing: found a case without [[round]]; allowed: a case with a round")
        different, written = drawn_rounds(case), []
        for number, (item, expected) in enumerate(zip(different, expected_masses(case), strict=True), start=1):
            name = target.name if len(different) == 1 else f"{target.stem}_{number}{target.suffix}"
            written.append(write_text(target.with_name(name), draw_round(item, expected), InputError))
        return written

    def __repr__(self) -> str:
        what = f"{self.found.mesh.cells} cells" if isinstance(self.found, CheckedBurst) else "no burst"
        return f"<fragfield.CheckResult {self.case.title!r}: {what}, {len(self.warnings)} warnings>"

    def __str__(self) -> str:
        from fragfield.checking.show import check_text

        return check_text(self.found)


def check(
    case: CaseOrRun,
    *,
    set: Settings = (),  # noqa: A002 - as `--set`
    fragments: File | None = None,
) -> CheckResult:
    """Masses, speeds, mesh and cost that follow from a case, and warnings.

    Parameters
    ----------
    case : Case or path
        A case file, or the directory of a run.
    set : sequence of str, or mapping
        Replaces a value of the case, by its dotted key; repeatable. In Python see `Case.from_toml`.
    fragments : path, optional
        Fly these fragments (.h5, .csv, or an arena table), not the run's. In Python `found.fragments` says what of
        the casing they hold.

    Raises
    ------
    InputError
        The case is at fault, its mesh cannot be made, or the fragments do not fit it.
    """
    found = case_of(case, set=set, burst=fragments is None)
    given = None if fragments is None else fragments_report(found.values, absolute(fragments, InputError))
    if found.values.burst is None and given is not None:
        return CheckResult(found, given)
    report = checking.check_report(found.values)
    if given is not None:
        report = replace(report, fragments=given.fragments, warnings=(*report.warnings, *given.warnings))
    return CheckResult(found, report)


Model = TypeVar("Model", bound="Table")
_MAPS = (".geojson", ".json", ".kml", ".kmz")
_SITE = ("latitude", "longitude", "bearing")


@dataclass(frozen=True)
class Converted:
    """What a file was turned into.

    Attributes
    ----------
    kind : str
        "profile", for `round.profile`, or "places", tables [[exposed]] and [[obstacle]].
    tables : dict
        As the case file has them.
    notes : list of str
        How the file was read, and what was left out.
    """

    kind: str
    tables: dict[str, Any]
    notes: list[str]

    def to_toml(self) -> str:
        """The tables as text, after the notes."""
        head = "".join(f"# {note}\n" for note in self.notes if self.kind == "places")
        return head + tables_to_toml(self.tables)

    def write(self, path: PathName) -> Path:
        """Write the text into a new file (.toml); its path. Raises InputError where there is such a file."""
        target = absolute(path, InputError)
        if target.suffix != ".toml":
            raise InputError(f"{target}: found a name that ends in {target.suffix or 'nothing'}; allowed: .toml")
        if target.exists():
            raise InputError(f"{target}: is there already; nothing was written, choose another name")
        return write_text(target, self.to_toml(), InputError)


def convert(
    file: File,
    *,
    set: Settings = (),  # noqa: A002 - as `--set`
) -> Converted:
    """Turn a drawing, a table of diameters, or a map of places into what a case holds.

    Parameters
    ----------
    file : path
        Drawing (.dxf), table of diameters, or map (.geojson, .kml, .kmz).
    set : sequence of str, or mapping
        How it is read: a key of round.contour or site.places. Of a map in Python `latitude`, `longitude` and `bearing`.

    Raises
    ------
    InputError
        The file cannot be read or is not clear, or a key is not one of these.
    """
    path = absolute(file, InputError)
    values = read_settings(set)
    kind = path.suffix.casefold()
    if kind in _MAPS:
        return _places(path, values)
    if kind not in contours.KINDS:
        allowed = ", ".join([*contours.KINDS, *_MAPS])
        raise InputError(f"{path}: found a file that ends in {kind or 'nothing'}; allowed: {allowed}")
    made, _ = contours.profile_of_contour(_table(ContourTable, {"file": path.name, **values}), path)
    return Converted("profile", made, [note for key in ("source", "notes") if (note := made.get(key))])


def _places(path: Path, values: Mapping[str, Any]) -> Converted:
    from fragfield.places.site import Site
    from fragfield.places.tables import tables_of_places

    site = _table(SiteTable, {key: value for key, value in values.items() if key in _SITE})
    places = {key: value for key, value in values.items() if key not in _SITE}
    table = _table(PlacesTable, {"file": path.name, **places})
    on_earth = Site(*(round(math.degrees(getattr(site, key)), 10) for key in _SITE))
    tables, notes = tables_of_places(table, path, on_earth)
    where = (
        f"latitude {on_earth.latitude:.9g}, longitude {on_earth.longitude:.9g}, bearing of +x {on_earth.bearing:.6g}"
    )
    return Converted("places", dict(tables), [f"{path.name}, x and y about {where} degrees", *notes])


def _table(model: type[Model], values: Mapping[str, Any]) -> Model:
    try:
        return model.model_validate(dict(values))
    except ValidationError as error:
        raise CaseFaults("--set", explain(error, model)) from None
