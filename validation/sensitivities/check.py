"""Rows of the sensitivities: responses beside the base's, the grid convergence index, and the order of the bars."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from validation.grid import grid_index
from validation.rows import Row, compare, markdown_table, within
from validation.sensitivities.variations import NAME, REFERENCE
from validation.soundness import sound

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from validation.grid import GridIndex
    from validation.sensitivities.responses import Response
    from validation.sensitivities.variations import Parameter, Variation

__all__ = [
    "KINDS",
    "Answers",
    "Bar",
    "bounds",
    "grid_rows",
    "indices",
    "rows_of",
    "sound_rows",
    "tornado",
    "value_of",
    "values_table",
]

_OWN = "own bound"
KINDS = {
    "mean_speed": ("mean initial speed", "m/s"),
    "largest_speed": ("largest initial speed", "m/s"),
    "number": ("fragments", ""),
    "distance": ("hazardous fragment distance", "m"),
}
"""What is looked at: name, words, unit."""


def bounds(*, quick: bool) -> dict[str, float]:
    """Bounds of `validation.soundness.sound`."""
    table = REFERENCE["sound"]
    return {
        "energy_error": table["energy_error"],
        "coarsest_cell_size": table["quick_coarsest_cell_size" if quick else "coarsest_cell_size"],
    }


def sound_rows(summary: Mapping[str, Any], variation: Variation, *, quick: bool) -> list[Row]:
    """Whether a burst may be compared: sound, and the wall no longer accelerates."""
    rows = sound(NAME, summary, bounds(quick=quick), variation.label)
    done = float(summary["burst"]["acceleration_complete"] is not None)
    return [*rows, within(NAME, f"{variation.label}: acceleration complete", done, 1.0, 1.0, _OWN)]


def value_of(response: Response, kind: str) -> float:
    """A response by its name in `KINDS`."""
    return float(getattr(response, kind))


def rows_of(response: Response, base: Response) -> list[Row]:
    """The four responses of a variation beside the base's; quadrature and hourglass are judged by the mean speed."""
    parameter, rows = response.variation.parameter, []
    for kind, (words, unit) in KINDS.items():
        quantity = f"{response.variation.label}: {words}"
        if kind == "distance":
            quantity += (
                f" (standard error {response.error:.2g} m, of the change {response.error_of_change(base):.2g} m)"
            )
        judged = kind == "mean_speed" and parameter in ("quadrature", "hourglass")
        tolerance = REFERENCE["allowed"][parameter] if judged else None
        rows.append(
            compare(NAME, quantity, value_of(response, kind), value_of(base, kind), tolerance, "the base", unit)
        )
    return rows


def indices(family: Sequence[Response]) -> dict[str, GridIndex]:
    """Grid convergence index of every response, of the three finest of the bursts, from coarse to fine.

    Sizes are those that the numbers of cells give; the size asked for is met by whole numbers of cells only.
    """
    sizes = [response.cells ** (-1.0 / 3.0) for response in family]
    return {kind: grid_index(sizes, [value_of(response, kind) for response in family]) for kind in KINDS}


def grid_rows(family: Sequence[Response]) -> list[Row]:
    """Rows of `indices`; the mean initial speed's is judged."""
    finest, rows = family[-1], []
    for kind, found in indices(family).items():
        words, unit = KINDS[kind]
        at = f"{words} at {finest.variation.size}"
        source = f"Roache 1994, Celik et al. 2008; {found.kind}"
        if found.order is not None:
            source += f", order {found.order:.2g}"
        index, quantity = 100.0 * found.index, f"grid convergence index: {at}"
        if kind == "mean_speed":
            rows.append(within(NAME, quantity, index, 0.0, REFERENCE["allowed"]["grid_index"], source, "%"))
        else:
            rows.append(Row(NAME, quantity, index, None, None, None, None, source, "%"))
        if found.limit is not None:
            rows.append(
                compare(NAME, f"{at} against its limit", value_of(finest, kind), found.limit, None, source, unit)
            )
    return rows


@dataclass(frozen=True)
class Answers:
    """The responses to one parameter, and that which they are held against."""

    parameter: Parameter
    base: Response
    responses: tuple[Response, ...]


@dataclass(frozen=True)
class Bar:
    """How far one parameter moves the hazardous fragment distance.

    Attributes
    ----------
    words : str
        Of the parameter.
    low, high : float
        Smallest and largest change against the base (m) over its values, the base among them.
    low_value, high_value : str
        Values at which they are met.
    low_error, high_error : float
        Their standard errors (m).
    """

    words: str
    low: float
    high: float
    low_value: str
    high_value: str
    low_error: float
    high_error: float

    @property
    def swing(self) -> float:
        """Length of the bar (m)."""
        return self.high - self.low


def tornado(found: Iterable[Answers]) -> list[Bar]:
    """Bars by their swing, the longest first; parameters without a response are left out."""
    bars = []
    for answers in found:
        if not answers.responses:
            continue
        parameter, base = answers.parameter, answers.base
        ends = [(one.change(base), f"{one.variation.value:g}", one.error_of_change(base)) for one in answers.responses]
        ends.append((0.0, f"{parameter.base:g}", 0.0))
        low, high = min(ends), max(ends)
        words = f"{parameter.words}{f' ({parameter.unit})' if parameter.unit else ''}"
        bars.append(Bar(words, low[0], high[0], low[1], high[1], low[2], high[2]))
    return sorted(bars, key=lambda bar: bar.swing, reverse=True)


def values_table(found: Iterable[Answers], base: Response) -> str:
    """One line a variation, for the README: the responses, and the change of the distance."""
    head = ["varied", *(f"{words}{f' ({unit})' if unit else ''}" for words, unit in KINDS.values()), "change (m)"]

    def line(response: Response, words: str, change: str) -> list[str]:
        return [
            words,
            f"{response.mean_speed:.0f}",
            f"{response.largest_speed:.0f}",
            f"{response.number:.0f}",
            f"{response.distance:.1f} ± {response.error:.1f}",
            change,
        ]

    body = [line(base, "base", "")]
    for answers in found:
        if answers.base is not base:
            body.append(line(answers.base, answers.base.variation.label, ""))
        for one in answers.responses:
            change = f"{one.change(answers.base):+.1f} ± {one.error_of_change(answers.base):.1f}"
            body.append(line(one, one.variation.label, change))
    return markdown_table(head, body)
