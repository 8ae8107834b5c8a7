"""Numbers of fragments by mass against Mott's law, and the mass that each sampler hands over (Figs. 2.6 and 3.4).

The law is computed from the burst, and the paper prints no numbers of its figures: what is checked here is that the
samplers follow the law that they are given, segment by segment and in total.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from transition import BreakUp, Snapshot
from validation.rows import Row, compare, within

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from transition import BreakUpSettings
    from transition.law.segment_law import SegmentLaw

    Number = Callable[["SegmentNumbers", NDArray[np.float64]], NDArray[np.float64]]

__all__ = ["SegmentNumbers", "draw_numbers", "number_rows", "numbers_of_run", "segment_numbers"]

NAME = "paper_3_1"
SOURCE = "Mott's law, Eq. 19"
REALISATIONS = 50
STEPS = (0.1e-3, 1e-3, 5e-3)
"""Steps dm of the paper's grades (kg); it states none."""
MASS_ERROR = 1e-12
"""Of the casing's mass: round-off."""
TOTAL = 0.01
"""Largest difference of N(m) of all fragments from the law, over N0."""
ERRORS = 3.0
"""Largest difference of a segment's N(m) from the law, in standard errors of the mean of the realisations."""


@dataclass(frozen=True, eq=False)
class SegmentNumbers:
    """A segment's law and what the samplers drew by it.

    Attributes
    ----------
    law : SegmentLaw
        Its law and number.
    name : str
        Of the segment.
    quantile : tuple of (n,) float64
        Masses (kg) of every realisation by the stratified sampler.
    graded : mapping from steps dm (kg) to (n,) float64
        Masses (kg) by the paper's grades.
    """

    law: SegmentLaw
    name: str
    quantile: tuple[NDArray[np.float64], ...]
    graded: dict[float, NDArray[np.float64]]

    def expected(self, mass: NDArray[np.float64]) -> NDArray[np.float64]:
        """Number heavier than `mass` (kg) by the law."""
        return np.asarray(self.law.n0 * self.law.law.survival(mass))

    def drawn(self, mass: NDArray[np.float64]) -> NDArray[np.float64]:
        """The same of the stratified sampler, mean of the realisations."""
        return np.asarray(np.mean([_heavier(one, mass) for one in self.quantile], axis=0))

    def by_grades(self, mass: NDArray[np.float64]) -> NDArray[np.float64]:
        """The same of the paper's grades, of the widest step."""
        return _heavier(self.graded[max(self.graded)], mass)

    @property
    def standard_error(self) -> float:
        """Of the mean number of the realisations, over N0: statistical scatter of a few hundred pieces."""
        sizes = [one.size for one in self.quantile]
        return float(np.std(sizes, ddof=1) / np.sqrt(len(sizes)) / self.law.n0)


def _heavier(drawn: NDArray[np.float64], mass: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(drawn.size - np.searchsorted(np.sort(drawn), mass, side="right"), dtype=np.float64)


def numbers_of_run(folder: Path) -> list[SegmentNumbers]:
    """Numbers of a finished run, with the break-up of its case."""
    from fragfield.case import read_resolved
    from fragfield.case.conversion.stages import break_up_settings

    case = read_resolved(folder / "case.toml")
    return segment_numbers(Snapshot.read(folder / "burst_snapshot.h5"), break_up_settings(case), case.seed)


def segment_numbers(
    snapshot: Snapshot, settings: BreakUpSettings, seed: int, realisations: int = REALISATIONS
) -> list[SegmentNumbers]:
    """Both samplers' fragments of every segment."""
    quantile = BreakUp(snapshot, replace(settings, sampler="quantile"))
    many = quantile.many(seed, range(realisations))
    by_step = {
        step: BreakUp(snapshot, replace(settings, sampler="graded", graded_dm=step)).realisation(seed).segments
        for step in STEPS
    }
    found = []
    for place, result in enumerate(by_step[STEPS[0]]):
        number, index = result.round, result.segment.index
        drawn = tuple(one.mass[(one.round == number) & (one.segment == index)] for one in many)
        graded = {step: segments[place].draw.mass for step, segments in by_step.items()}
        found.append(SegmentNumbers(result.law, result.segment.data.name, drawn, graded))
    return found


def number_rows(numbers: list[SegmentNumbers]) -> list[Row]:
    """Rows of both samplers: mass handed over, number, and N(m) against the law."""
    casing = sum(one.law.mass for one in numbers)
    expected = sum(one.law.n0 for one in numbers)
    handed = [sum(float(one.quantile[k].sum()) for one in numbers) for k in range(len(numbers[0].quantile))]
    worst = max((mass / casing - 1.0 for mass in handed), key=abs)
    number = float(np.mean([sum(one.quantile[k].size for one in numbers) for k in range(len(handed))]))
    total = _difference(numbers, SegmentNumbers.drawn)
    segment = max(_difference([one], SegmentNumbers.drawn) / one.standard_error for one in numbers)
    return [
        within(NAME, "fragments' mass over the casing's - 1, quantile", worst, -MASS_ERROR, MASS_ERROR, "own bound"),
        compare(NAME, "fragments, mean of the realisations, quantile", number, expected, TOTAL, SOURCE),
        within(NAME, "N(m) - law over N0, largest, all fragments, quantile", total, 0.0, TOTAL, SOURCE),
        within(NAME, "N(m) - law in standard errors, worst segment, quantile", segment, 0.0, ERRORS, SOURCE),
        *(row for step in STEPS for row in _graded_rows(numbers, step, casing, expected)),
    ]


def _graded_rows(numbers: list[SegmentNumbers], step: float, casing: float, expected: float) -> list[Row]:
    """What the paper's grades hand over: for information, since they end where one holds less than one fragment."""
    left = 1.0 - sum(float(one.graded[step].sum()) for one in numbers) / casing
    number = sum(one.graded[step].size for one in numbers)
    grades = f"grades of {1e3 * step:g} g (Eqs. 26-29)"
    return [
        Row(NAME, f"part of the mass that no fragment carries, {grades}", left, None, None, None, None, SOURCE),
        compare(NAME, f"fragments, {grades}", float(number), expected, None, SOURCE),
    ]


def _difference(numbers: list[SegmentNumbers], drawn: Number) -> float:
    """Largest difference of the number heavier than any mass from the law, over N0."""
    heaviest = max(float(one.law.law.inverse(1e-4)) for one in numbers)
    mass = np.concatenate([[0.0], np.geomspace(1e-6 * heaviest, heaviest, 400)])
    ours = np.sum([drawn(one, mass) for one in numbers], axis=0)
    theirs = np.sum([one.expected(mass) for one in numbers], axis=0)
    return float(np.abs(ours - theirs).max() / theirs[0])


def draw_numbers(numbers: list[SegmentNumbers], path: Path) -> Path:
    """Write the figure after the paper's Figs. 2.6 and 3.4 as PNG: N(m) by law and both samplers."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, (total, parts) = plt.subplots(1, 2, figsize=(11.0, 4.4), layout="constrained", sharey=True)
    heaviest = max(float(one.quantile[0].max()) for one in numbers)
    mass = np.linspace(0.0, np.sqrt(heaviest), 300) ** 2
    for label, style, values in (
        ("law", {"color": "0.2", "linewidth": 1.4}, sum(one.expected(mass) for one in numbers)),
        (
            f"quantile, mean of {REALISATIONS}",
            {"color": "black", "linestyle": ":"},
            sum(one.drawn(mass) for one in numbers),
        ),
        (
            f"grades of {1e3 * max(STEPS):g} g",
            {"color": "0.45", "linestyle": "--"},
            sum(one.by_grades(mass) for one in numbers),
        ),
    ):
        _line(total, mass, values, label, style)
    total.set(title="(a) all fragments", ylabel="number heavier than m")
    greys = np.linspace(0.0, 0.65, len(numbers))
    for one, grey in zip(numbers, greys, strict=True):
        _line(parts, mass, one.expected(mass), one.name, {"color": str(grey), "linewidth": 1.2})
        _line(parts, mass, one.drawn(mass), None, {"color": str(grey), "linestyle": ":"})
        _line(parts, mass, one.by_grades(mass), None, {"color": str(grey), "linestyle": "--", "linewidth": 0.9})
    parts.set(title="(b) by segment: law, quantile (dotted), grades (dashed)")
    for axes in (total, parts):
        axes.set(yscale="log", xlabel="root of the mass (root of g)", ylim=(0.02, None), xlim=(0.0, None))
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(frameon=False, fontsize=8)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
    plt.close(figure)
    return path


def _line(
    axes: Axes, mass: NDArray[np.float64], number: NDArray[np.float64], label: str | None, style: dict[str, object]
) -> None:
    axes.plot(np.sqrt(1e3 * mass), np.where(number > 0.0, number, np.nan), label=label, **style)  # type: ignore[arg-type]
