"""`fragfield.convert`: a drawing as the file of a profile, a map of places as tables of a case."""

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
from fragfield.case.write import tables_to_toml
from fragfield.contours import read as contours
from fragfield.errors import InputError
from fragfield_base.paths import absolute
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping, Sequence

    from fragfield.case.tables.base import Table

__all__ = ["Converted", "convert"]

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
        .dxf, .svg, .csv, .xlsx or .ods of a round's casing, or .geojson, .json, .kml or .kmz of places.
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
