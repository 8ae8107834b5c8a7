"""Rows of the pair: its forms beside the quarter, two finest cell sizes beside each other, the paper's figures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from validation.files import reference_beside
from validation.grid import GridIndex, grid_index
from validation.m107_pair.sectors import BINS, UNITS, scatter
from validation.paper_3_2.check import REFERENCE as PAPER
from validation.rows import Row, compare, within
from validation.runs import StudyError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from validation.m107_pair.sectors import Key
    from validation.paper_3_2.ratios import Estimate

__all__ = [
    "BINS_OF_PAPER", "NAME", "REFERENCE", "convergence_rows", "cost_rows", "end_row", "index_of", "paper_of",
    "reading_rows", "symmetry_rows",
]  # fmt: skip

NAME = "m107_pair"
REFERENCE = reference_beside(__file__)
BINS_OF_PAPER: list[float] = PAPER["bins"]
"""Widths of the bins (degrees) in which peaks are read; the paper states none."""
_SOURCE = REFERENCE["source"]


def end_row(name: str, *, ended: bool) -> Row:
    """Whether a burst reached its end, or was stopped for its numbers."""
    return within(NAME, f"{name}: burst reaches its end", float(ended), 1.0, 1.0, _SOURCE)


def cost_rows(size: str, bursts: Mapping[str, Mapping[str, Any]]) -> list[Row]:
    """Cells and wall time of every form; `bursts` are the entries "burst" of their summaries."""
    rows = []
    for form, burst in bursts.items():
        for words, key, unit in (("cells", "cells", ""), ("wall time of the burst", "wall_seconds", "s")):
            rows.append(_informs(f"{size}, {form}: {words}", float(burst[key]), "side by side", unit))
    return rows


def symmetry_rows(
    size: str, forms: Mapping[str, Mapping[Key, Estimate]], fans: Mapping[str, Sequence[Mapping[Key, Estimate]]]
) -> list[Row]:
    """Profiles of the forms of one cell size against the first of them.

    Of the bins of 10 degrees only the one farthest off has a row. `fans` are, by form, profiles of bursts that differ
    by round-off alone; their scatter stands beside each row.
    """
    (first, base), *others = forms.items()
    rows = []
    for form, found in others:
        sectors = [key for key in found if key[1] not in BINS]
        for kind in UNITS:
            bins = [key for key in found if key[0] == kind and key[1] in BINS]
            sectors.append(max(bins, key=lambda key: abs(found[key].over(base[key]).value - 1.0)))
        for key in sectors:
            kind, place = key
            noise = [f"standard error {found[key].over(base[key]).error:.2%}"]
            of_both = {name: fan for name, fan in fans.items() if name in (first, form)}
            noise += [f"scatter of {name} {scatter(fan, key):.2%}" for name, fan in of_both.items()]
            farthest = ", the bin farthest off" if place in BINS else ""
            quantity = f"{size}, {form}: {kind} {place}{farthest} ({', '.join(noise)})"
            values, allowed = (found[key].value, base[key].value), REFERENCE["symmetry"][kind]
            rows.append(compare(NAME, quantity, *values, allowed, f"the {first}", UNITS.get(kind, "m/s")))
    return rows


def convergence_rows(found: Mapping[str, Mapping[Key, Estimate]]) -> list[Row]:
    """The focus by cell size, coarse to fine; of three or more the two finest beside each other, and Roache's index."""
    rows = []
    for size, focus in found.items():
        for (kind, place), value in focus.items():
            quantity = f"{size}: {kind} {place} (standard error {value.error:.2g})"
            reference = "undisturbed = 1" if kind in UNITS else "no bound"
            rows.append(_informs(quantity, value.value, reference, "" if kind in UNITS else "m/s"))
    if len(found) < 3:
        return rows
    (coarser, before), (finer, last) = list(found.items())[-2:]
    for key, value in last.items():
        kind, place = key
        judged = place == ("within 10 deg" if kind in UNITS else "within 5 deg")
        error = value.over(before[key]).error
        rows.append(
            compare(NAME, f"{finer} against {coarser}: {kind} {place} (standard error {error:.1%})", value.value,
                    before[key].value, REFERENCE["finest"][kind] if judged else None, _SOURCE,
                    "" if kind in UNITS else "m/s")
        )  # fmt: skip
        index = index_of({size: focus[key].value for size, focus in found.items()})
        rows.append(_informs(f"grid convergence index: {kind} {place} ({index.kind})", index.index, "Roache 1994"))
    return rows


def reading_rows(found: Mapping[str, Mapping[str, Estimate]]) -> list[Row]:
    """Peaks and the lobe's integral by cell size and, of three or more, extrapolated, beside the paper's figures.

    They only inform: the paper states neither the width of its bins nor its cells.
    """
    rows = []
    for size, values in found.items():
        for name, value in values.items():
            rows.append(_beside_paper(f"{size}: {name} (standard error {value.error:.2g})", name, value.value))
    if len(found) < 3:
        return rows
    for name in next(iter(found.values())):
        values = {size: one[name].value for size, one in found.items()}
        index = index_of(values)
        finest = list(values.values())[-1]
        limit = finest if index.limit is None else index.limit
        words = "finest" if index.limit is None else "extrapolated"
        uncertain = abs(index.index * finest)
        rows.append(_beside_paper(f"{words}: {name} (± {uncertain:.2g} by the cells, {index.kind})", name, limit))
    return rows


def index_of(values: Mapping[str, float]) -> GridIndex:
    """Grid convergence index of the three finest of values by cell size, such as "3 mm", coarse to fine."""
    sizes = list(values)[-3:]
    if any(size.split()[1:] != ["mm"] for size in sizes):
        raise StudyError(f"{NAME}: cell sizes {', '.join(sizes)}; millimetres are expected")
    return grid_index([float(size.split()[0]) for size in sizes], [values[size] for size in sizes])


def paper_of(name: str) -> float | None:
    """The paper's figure for a quantity of `sectors.reading`; None where it has none."""
    if not name.startswith("peak"):
        return None
    return float(PAPER["number_ratio" if "number" in name else "speed_ratio"])


def _beside_paper(quantity: str, name: str, value: float) -> Row:
    reference = paper_of(name)
    if reference is None:
        return _informs(quantity, value, "all caught and as fine: 360 over all azimuths", "deg")
    return compare(NAME, quantity, value, reference, None, PAPER["source"])


def _informs(quantity: str, value: float, source: str, unit: str = "") -> Row:
    return Row(NAME, quantity, value, None, None, None, None, source, unit)
