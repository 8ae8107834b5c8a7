"""The catalogue of output quantities, made from the parts of the summary: where each is shown, with label and unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fragfield.numbers import SPACE, Row, row
from fragfield.results.part import Out, Part, outputs, part_in, value_at
from fragfield.results.summary import STAGE_OF, Summary
from fragfield.results.words import rounded_metres, whole_metres

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping


@dataclass(frozen=True)
class Quantity(Out):
    """A value of summary.json: its mark, with the following.

    Attributes
    ----------
    path : str
        Its keys from the top, joined by dots; "[]" behind a list.
    name : str
        Its column in tables of studies.
    stage : str
        Stage that writes it, as on the command line.
    """

    path: str = ""
    stage: str = ""

    def of(self, summary: Summary | Mapping[str, Any]) -> Any:  # noqa: ANN401 - a value of JSON
        """Its value in a summary; None where there is none."""
        return value_at(summary, self.path)

    def row(self, value: Any, note: str = "") -> Row:  # noqa: ANN401 - a value of JSON
        """A value with label, practical unit and SI, for a table."""
        if self.rounding and value is not None:
            written = whole_metres(value) if self.rounding == "up" else rounded_metres(value)
            return Row(self.label, f"{written}{SPACE}{self.unit}", "", note)
        return row(self.label, value, "%" if self.percent else self.unit, note, self.digits)

    def rows(self, summary: Summary | Mapping[str, Any]) -> Iterator[Row]:
        """The row of a summary; none where it has no value, or a zero of which nothing is to be said."""
        value = self.of(summary)
        if isinstance(value, (str, int, float)) and not (self.hide_zero and value == 0):
            yield self.row(value)


def column_of(name: str, unit: str) -> str:
    """Column of a value in a table: its name and unit, as `mean_initial_speed_m_s`."""
    end = unit.replace("/", "_").replace("^", "")
    return name if not end or name.endswith(f"_{end}") else f"{name}_{end}"


def _quantities(part: type[Part], path: str, stage: str) -> Iterator[Quantity]:
    for key, mark, kind in outputs(part):
        at, of_stage = f"{path}.{key}".lstrip("."), stage or STAGE_OF.get(key, "" if mark.label else "fly")
        inner = part_in(kind)
        if inner is not None and not inner.whole:
            many = "[]" if "tuple" in str(kind) else ""
            yield from _quantities(inner, f"{at}{many}", of_stage or "fly")
            continue
        known = vars(mark) | {"name": mark.name or key, "views": () if "[]" in at else mark.views}
        yield Quantity(**known, path=at, stage=of_stage)


QUANTITIES: dict[str, Quantity] = {one.path: one for one in _quantities(Summary, "", "")}
"""All values of summary.json by their paths, in the order of the file."""


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
