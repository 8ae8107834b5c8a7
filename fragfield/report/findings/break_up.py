"""Findings on the break-up: mass, momentum and energy, the mean mass, and pieces that a test counted."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from fragfield.numbers import number
from fragfield.report.findings.finding import Finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.interface.results import Run
    from fragfield.results.break_up import FragmentTest, MeanMass


_REJECTED = 0.05  # of probability; the break-up widens the standard error there
_COMPLETE = (0.8, 1.05)  # mass of the pieces over that of the law in the same range


def break_up_findings(run: Run) -> Iterator[Finding]:
    """Mass, momentum and energy of the fragments against the burst, and how well the mean mass is known."""
    if (broken := run.summary.break_up) is None:
        return
    if abs(mass := broken.mass_error) > 1e-6:
        yield Finding(
            "warning",
            f"Fragments hold {number(100 * abs(mass), 3)} % {'less' if mass < 0 else 'more'} mass than the casing"
            + (" (the graded sampler drops the heaviest, which fly farthest)." if mass < 0 else "."),
        )
    for value, what in ((broken.momentum_error, "momentum"), (broken.energy_error, "kinetic energy")):
        if abs(value) > 0.05:
            yield Finding("note", f"Fragments carry {what} that differs by {100 * abs(value):.2g} % from the burst.")
    mean = broken.mean_mass
    yield from _by_law(mean) if mean.test is None else _counted(mean, mean.test)


def _by_law(mean: MeanMass) -> Iterator[Finding]:
    """How well a mean fragment mass that is not fitted to a test is known, and where no data are near."""
    law = "is given" if mean.law == "given" else f"follows the law “{mean.law}”"
    own = mean.factor_source == "input"
    if mean.factor is None:
        stated = f"No factor of its uncertainty is stated: {mean.factor_source}. Set `break_up.mean_mass_factor`."
    else:
        source = "as given in the case" if own else mean.factor_source
        known = "Where published data are near, it" if mean.outside_data and not own else "It"
        stated = (
            f"{known} is uncertain by a factor of {number(mean.factor, 3)} either way (one geometric standard "
            f"deviation; {source}): repeat the break-up with it multiplied and divided by this factor, and compare "
            "the distances."
        )
    yield Finding("note", f"The mean fragment mass {law}. {stated}")
    by_round: dict[str, list[str]] = {}
    for one in mean.outside_data:
        by_round.setdefault(one.round, []).append(one.text)
    for name, texts in by_round.items():
        end = "" if own else " No stated factor covers it."
        text = f"No published mean fragment masses are close to round “{name}”: {'; '.join(texts)}.{end}"
        yield Finding("warning", text)


def _counted(mean: MeanMass, test: FragmentTest) -> Iterator[Finding]:
    """What the mean mass was fitted to, how well the law fits, and how much of the casing the pieces hold."""
    recovered, in_range, factor = test.recovered_fraction, test.fraction_in_range, number(mean.factor, 3)
    several = "" if test.rounds == 1.0 else f" of {number(test.rounds, 3)} rounds"
    uncertain = (
        f"The case gives a factor of {factor} for its uncertainty."
        if mean.factor_source == "input"
        else f"It is uncertain by a factor of {factor} either way; from round to round it may scatter more."
    )
    hold = "" if recovered is None else (
        f" The pieces hold {number(100.0 * recovered, 3)} % of the casing's mass, where the law has "
        f"{number(100.0 * in_range, 3)} % in their range of masses."
    )  # fmt: skip
    yield Finding(
        "note",
        f"The mean fragment mass is fitted to {test.source}, {test.what}{several}, standard error "
        f"{number(100.0 * test.standard_error, 2)} %: {number(1e3 * test.mean, 3)} g, {number(test.scale, 3)} times "
        f"that of Mott's law (Eq. 21), whose ratios between segments it keeps.{hold} {uncertain}",
    )
    share, margin = None if recovered is None else recovered / in_range, test.mass_margin
    if share is not None and not _COMPLETE[0] / margin <= share <= _COMPLETE[1] * margin:
        why = (
            "pieces were lost, and the fit holds only if light and heavy ones were lost alike"
            if share < 1.0
            else "they may be of the fuze or of another round, or the law has too few heavy ones"
        )
        text = f"The pieces of {test.source} hold {number(100.0 * share, 3)} % of the law's mass in their range: {why}."
        yield Finding("warning", text)
    if test.probability is not None and test.probability < _REJECTED:
        worst = max(counted_groups(test), key=lambda one: (one[1] - one[2]) ** 2 / max(one[2], 5.0))
        widened = test.standard_error / test.curvature_error
        yield Finding(
            "warning",
            f"Mott's law does not describe the pieces of {test.source}: chi-square {number(test.chi_square, 3)} with "
            f"{test.degrees_of_freedom} degrees of freedom (probability {number(100.0 * test.probability, 2)} %). "
            f"Most out of line: {worst[0]} g, {number(worst[1], 4)} counted, {number(worst[2], 4)} expected. The "
            f"standard error is widened {number(widened, 2)} times for it. Compare the numbers of the heavy pieces, "
            "which decide the distance.",
        )


def counted_groups(test: FragmentTest) -> list[tuple[str, float, float]]:
    """Range of mass in g, pieces counted and pieces expected."""
    edges = [1e3 * edge for edge in test.edges if edge is not None]
    names = [f"{number(low, 3)} to {number(high, 3)}" for low, high in pairwise(edges)]
    if len(names) < len(test.number):
        names.append(f"above {number(edges[-1], 3)}")
    return list(zip(names, test.number, test.expected, strict=True))
