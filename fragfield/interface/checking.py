"""`fragfield.check` and `fragfield.convert`: what follows from a case, its drawing, and files as tables of a case."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from pydantic import ValidationError

from fragfield.case.changes import read_settings
from fragfield.case.messages import explain, join_faults
from fragfield.case.tables.round import ContourTable
from fragfield.case.tables.site import PlacesTable, SiteTable
from fragfield.case.write import plain, tables_to_toml
from fragfield.checking import check as checking
from fragfield.checking.check import fragments_report
from fragfield.contours import read as contours
from fragfield.errors import InputError
from fragfield.interface.case import Case, case_of
from fragfield_base.paths import absolute
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from fragfield.case import CaseTable
    from fragfield.case.tables.base import Table


def write_drawings(case: CaseTable, path: Path) -> list[Path]:
    """Write the drawing of a resolved case's round as SVG; of several different rounds one each, numbered.

    Raises
    ------
    InputError
        The file's ending is not .svg, there are no rounds, one is a mesh, or it cannot be written.
    """
    from fragfield.report.figures.rounds import draw_round, drawn_rounds, expected_masses
    from fragfield_base.writing import write_text

    if path.suffix.lower() != ".svg":
        raise InputError(f"--drawing: found {path.name}; allowed: a name that ends in .svg")
    if not case.round:
        raise InputError("--drawing: found a case without [[round]]; allowed: a case with a round")
    different = drawn_rounds(case)
    written = []
    for number, (item, expected) in enumerate(zip(different, expected_masses(case), strict=True), start=1):
        target = path if len(different) == 1 else path.with_name(f"{path.stem}_{number}{path.suffix}")
        written.append(write_text(target, draw_round(item, expected), InputError))
    return written


@dataclass(frozen=True, repr=False)
class CheckResult:
    """What a case was found to be; `print` shows it as `fragfield check` does, without the case itself.

    Attributes
    ----------
    case : Case
        The case.
    found : dict
        As `fragfield check --json` prints it: `rounds`, `arrangement`, `geometry`, `mesh`, `symmetry`, `expected`,
        `warnings`, `official`, `contents`, `rules`, `distance_to_apply`, and `fragments` where such were given; numbers
        in SI. Of a case without a burst there are no `rounds` to `expected`.
    """

    case: Case
    found: dict[str, Any]

    @property
    def warnings(self) -> list[str]:
        """What looks doubtful in the case."""
        return list(self.found["warnings"])

    def draw(self, path: str | os.PathLike[str]) -> list[Path]:
        """Write the dimensioned drawing of the round (.svg), of different rounds one each; their paths.

        Raises
        ------
        InputError
            Another ending, no round, a round from a mesh file, or no right to write.
        """
        return write_drawings(self.case.values, absolute(path, InputError))

    def __repr__(self) -> str:
        what = f"{self.found['mesh']['cells']} cells" if "mesh" in self.found else "no burst"
        return f"<fragfield.CheckResult {self.case.title!r}: {what}, {len(self.warnings)} warnings>"

    def __str__(self) -> str:
        from fragfield.checking.show import check_text

        return check_text(self.found)


def check(
    case: Case | str | os.PathLike[str],
    *,
    set: Sequence[str] | Mapping[str, Any] = (),  # noqa: A002 - as `--set`
    fragments: str | os.PathLike[str] | None = None,
) -> CheckResult:
    """Masses, speeds, mesh and cost that follow from a case, and warnings.

    Parameters
    ----------
    case : Case or path
        A case, a case file or a run directory.
    set
        Values that replace those of the case, see `Case.from_toml`.
    fragments : path, optional
        Fragments or an arena table that are to be flown instead of the run's own: `found["fragments"]` says what of the
        casing they hold. The case then needs no burst, and without one nothing is said of it.

    Raises
    ------
    InputError
        The case is at fault, its mesh cannot be made, or the fragments do not fit it.
    """
    found = case_of(case, set=set, burst=fragments is None)
    given = None if fragments is None else fragments_report(found.values, absolute(fragments, InputError))
    if found.values.burst is None and given is not None:
        return CheckResult(found, {"case": plain(found.values), **given})
    report = checking.check_report(found.values)
    if given is not None:
        report |= {"fragments": given["fragments"], "warnings": [*report["warnings"], *given["warnings"]]}
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

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the text into a new file (.toml); its path. Raises InputError where there is such a file."""
        target = absolute(path, InputError)
        if target.suffix != ".toml":
            raise InputError(f"{target}: found a name that ends in {target.suffix or 'nothing'}; allowed: .toml")
        if target.exists():
            raise InputError(f"{target}: is there already; nothing was written, choose another name")
        return write_text(target, self.to_toml(), InputError)


def convert(
    file: str | os.PathLike[str],
    *,
    set: Sequence[str] | Mapping[str, Any] = (),  # noqa: A002 - as `--set`
) -> Converted:
    """Turn a drawing, a table of diameters, or a map of places into what a case holds.

    Parameters
    ----------
    file : path
        .dxf, .csv, .xlsx or .ods of a round's casing, or .geojson, .json, .kml or .kmz of places.
    set : sequence of str, or mapping
        Values of the keys of `round.contour`, such as `["unit=1 mm"]`; of a map those of `site.places`, and `latitude`,
        `longitude` and `bearing` of the site.

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
    from flight.hazard.site import Site
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
        raise InputError(join_faults("--set", explain(error, model))) from None
