"""The catalogue of output quantities, made from the parts of the summary: where each is shown, with label and unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fragfield.hazard.verdict import exposed_rounds, exposure_words
from fragfield.numbers import SPACE, number, with_unit
from fragfield.results.part import Out, Part, outputs, part_in, value_at
from fragfield.results.summary import STAGE_OF, Summary
from fragfield.results.words import rounded_metres, whole_metres

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from fragfield.results.burst import Ignition


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

    def words(self, value: float) -> str:
        """A value in a practical unit, for a table."""
        if self.rounding:
            return f"{whole_metres(value) if self.rounding == 'up' else rounded_metres(value)}{SPACE}{self.unit}"
        return with_unit(value, "%" if self.percent else self.unit, self.digits)


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


def numbers_of(summary: Summary) -> Iterator[tuple[str, str, str]]:
    """The main numbers by stage, as terminal and report list them: stage, what it is, and its value in words."""
    for entry in shown("terminal"):
        if (value := entry.of(summary)) is not None:
            yield entry.stage, f"{entry.label[0].lower()}{entry.label[1:]}", entry.words(value)
    rounds = () if summary.burst is None else summary.burst.rounds
    for one in rounds if len(rounds) > 1 else ():
        yield "burst", f"ignition of {one.name}", _initiated(one.ignition)
    for name, exposure, initiated in exposed_rounds(rounds):
        yield "burst", f"{name}, {'initiated' if initiated else 'not initiated'}", exposure_words(exposure)
    for surface in summary.witness or ():
        yield "witness", f"hits on {surface.name}", number(surface.hits)
    for obstacle in summary.obstacle or ():
        hits = f"{obstacle.hits:d}, hazardous {obstacle.hazardous_hits:d}, stopped {obstacle.stopped:d}"
        yield "obstacle", f"hits on {obstacle.name}", hits


def _initiated(ignition: Sequence[Ignition]) -> str:
    if not ignition:
        return "never initiated"
    return f"{ignition[0].time * 1e6:.4g}{SPACE}µs{', by shock' if ignition[0].by == 'shock' else ''}"
