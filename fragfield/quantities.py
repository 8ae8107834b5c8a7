"""The catalogue of output quantities: label, unit and rounding of each value of summary.json, and where it is shown.

The catalogue is the schema that goes with the program, data/summary.schema.json. Beside what JSON Schema knows, the
entry of a value may hold

- `title`, its label in every table; `description` says more;
- `unit`, in SI; `percent` for a fraction that is shown in per cent; `digits`, significant ones (4);
- `rounding`, of a distance in whole metres: "up" for one to keep, "nearest" for others;
- `shown`, the views that list it: "terminal", "report", "mesh", "compare", "sweep", "convergence", "uncertainty";
- `name`, its column in their tables, where the key alone would not do; `error`, the path of its standard error;
- `hide_zero`, where nothing is to be said of a zero.

A part of the summary names the `stage` that writes it. A new output is computed and entered here; terminal, report,
studies and the page "Output files" of the guide read it.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

from fragfield.hazard.certainty import rounded_metres, whole_metres
from fragfield.numbers import SPACE, Row, row

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping


@dataclass(frozen=True)
class Quantity:
    """A value of summary.json.

    Attributes
    ----------
    path : str
        Its keys from the top, joined by dots; "[]" behind a list.
    name : str
        Its column in tables of studies.
    label, note : str
        What it is, and more on it.
    unit : str
        In SI; empty for a pure number.
    stage : str
        Stage that writes it, as on the command line.
    views : tuple of str
        Where it is shown.
    percent, digits, rounding, error, hide_zero
        As in the schema.
    """

    path: str
    name: str
    label: str
    note: str
    unit: str
    stage: str
    views: tuple[str, ...] = ()
    percent: bool = False
    digits: int = 4
    rounding: str = ""
    error: str = ""
    hide_zero: bool = False

    def of(self, summary: Mapping[str, Any]) -> Any:  # noqa: ANN401 - a value of JSON
        """Its value in a summary; None where there is none."""
        return value_at(summary, self.path)

    def row(self, value: Any, note: str = "") -> Row:  # noqa: ANN401 - a value of JSON
        """A value with label, practical unit and SI, for a table."""
        if self.rounding and value is not None:
            written = whole_metres(value) if self.rounding == "up" else rounded_metres(value)
            return Row(self.label, f"{written}{SPACE}{self.unit}", "", note)
        return row(self.label, value, "%" if self.percent else self.unit, note, self.digits)

    def rows(self, summary: Mapping[str, Any]) -> Iterator[Row]:
        """The row of a summary; none where it has no value, or a zero of which nothing is to be said."""
        value = self.of(summary)
        if value is not None and not isinstance(value, (dict, list)) and not (self.hide_zero and value == 0):
            yield self.row(value)


def column_of(name: str, unit: str) -> str:
    """Column of a value in a table: its name and unit, as `mean_initial_speed_m_s`."""
    end = unit.replace("/", "_").replace("^", "")
    return name if not end or name.endswith(f"_{end}") else f"{name}_{end}"


def value_at(summary: Mapping[str, Any], path: str) -> Any:  # noqa: ANN401 - a value of JSON
    """The value at a path of keys joined by dots; None where a key is missing."""
    found: Any = summary
    for key in path.split("."):
        found = found.get(key) if isinstance(found, dict) else None
    return found


@cache
def schema() -> dict[str, Any]:
    """The schema of summary.json."""
    text = (resources.files("fragfield") / "data" / "summary.schema.json").read_text(encoding="utf-8")
    found: dict[str, Any] = json.loads(text)
    return found


def _entries(properties: Mapping[str, Any], path: str, stage: str) -> Iterator[Quantity]:
    for key, value in properties.items():
        entry = {**schema()["$defs"][value["$ref"].rpartition("/")[2]], **value} if "$ref" in value else value
        at, of_stage = f"{path}.{key}".lstrip("."), entry.get("stage", stage)
        if "properties" in entry:
            yield from _entries(entry["properties"], at, of_stage)
        elif "properties" in (items := entry.get("items", {})):
            yield from _entries(items["properties"], f"{at}[]", of_stage)
        else:
            label, note = entry.get("title", ""), entry.get("description", "")
            known = {
                name: entry[name] for name in ("percent", "digits", "rounding", "error", "hide_zero") if name in entry
            }
            yield Quantity(
                at, entry.get("name", key), label or note, note if label else "", entry.get("unit", ""), of_stage,
                () if "[]" in at else tuple(entry.get("shown", ())), **known,
            )  # fmt: skip


QUANTITIES: dict[str, Quantity] = {one.path: one for one in _entries(schema()["properties"], "", "")}
"""All values of summary.json by their paths, in the order of the schema."""


def quantity(path: str) -> Quantity:
    """A value by its path; raises KeyError with the nearest known path."""
    if path not in QUANTITIES:
        from fragfield.errors import nearest

        raise KeyError(f"{path}: no such value of summary.json{nearest(path, QUANTITIES)}")
    return QUANTITIES[path]


def shown(view: str, *parts: str) -> list[Quantity]:
    """What a view lists, of some parts of the summary ("burst", "burst.contact", ...) or of all."""
    return [
        one for one in QUANTITIES.values()
        if view in one.views and (not parts or one.path.rpartition(".")[0] in parts)
    ]  # fmt: skip
