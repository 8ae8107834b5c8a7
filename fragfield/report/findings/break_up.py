"""Findings on the break-up: mass, momentum and energy, the mean mass, and pieces that a test counted."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

from fragfield.numbers import number
from fragfield.report.findings.finding import Finding, value_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from fragfield.report.reading.run_files import RunFiles


_REJECTED = 0.05  # of probability; the break-up widens the standard error there
_COMPLETE = (0.8, 1.05)  # mass of the pieces over that of the law in the same range


def break_up_findings(run: RunFiles) -> Iterator[Finding]:
    """Mass, momentum and energy of the fragments against the burst, and how well the mean mass is known."""
    part = run.part("break_up")
    mass = value_of(part, "mass_error")
    if mass is not None and abs(mass) > 1e-6:
        yield Finding(
            "warning",
            f"Fragments hold {number(100 * abs(mass), 3)} % {'less' if mass < 0 else 'more'} mass than the casing"
            + (" (the graded sampler drops the heaviest, which fly farthest)." if mass < 0 else "."),
        )
    for name, what in (("momentum_error", "momentum"), ("energy_error", "kinetic energy")):
        value = value_of(part, name)
        if value is not None and abs(value) > 0.05:
            yield Finding("note", f"Fragments carry {what} that differs by {100 * abs(value):.2g} % from the burst.")
    if (mean := part.get("mean_mass")) is not None:
        test = mean.get("test")
        own = mean["factor_source"] == "input"
        yield from _counted(test, mean["factor"], own_factor=own) if test else _by_law(mean)


def _by_law(part: Mapping[str, Any]) -> Iterator[Finding]:
    """How well a mean fragment mass that is not fitted to a test is known, and where no data are near."""
    law = "is given" if part["law"] == "given" else f"follows the law “{part['law']}”"
    own = part["factor_source"] == "input"
    if part["factor"] is None:
        stated = f"No factor of its uncertainty is stated: {part['factor_source']}. Set `break_up.mean_mass_factor`."
    else:
        source = "as given in the case" if own else part["factor_source"]
        known = "Where published data are near, it" if part["outside_data"] and not own else "It"
        stated = (
            f"{known} is uncertain by a factor of {number(float(part['factor']), 3)} either way (one geometric "
            f"standard deviation; {source}): repeat the break-up with it multiplied and divided by this factor, and "
            "compare the distances."
        )
    yield Finding("note", f"The mean fragment mass {law}. {stated}")
    by_round: dict[str, list[str]] = {}
    for one in part["outside_data"]:
        by_round.setdefault(str(one["round"]), []).append(str(one["text"]))
    for name, texts in by_round.items():
        end = "" if own else " No stated factor covers it."
        text = f"No published mean fragment masses are close to round “{name}”: {'; '.join(texts)}.{end}"
        yield Finding("warning", text)


def _counted(test: dict[str, Any], factor: float, *, own_factor: bool) -> Iterator[Finding]:
    """What the mean mass was fitted to, how well the law fits, and how much of the casing the pieces hold.

    `test`: `break_up.mean_mass.test` of summary.json; `factor`: factor of the mean mass's uncertainty; `own_factor`:
    whether the case gives that factor.
    """
    recovered, in_range = test["recovered_fraction"], test["fraction_in_range"]
    several = "" if test["rounds"] == 1.0 else f" of {number(test['rounds'], 3)} rounds"
    error = f"standard error {number(100.0 * test['standard_error'], 2)} %"
    uncertain = (
        f"The case gives a factor of {number(factor, 3)} for its uncertainty."
        if own_factor
        else f"It is uncertain by a factor of {number(factor, 3)} either way; from round to round it may scatter more."
    )
    yield Finding(
        "note",
        f"The mean fragment mass is fitted to {test['source']}, {test['what']}{several}, {error}: "
        f"{number(1e3 * test['mean'], 3)} g, {number(test['scale'], 3)} times that of Mott's law (Eq. 21), whose "
        f"ratios between segments it keeps. The pieces hold {number(100.0 * recovered, 3)} % of the casing's mass, "
        f"where the law has {number(100.0 * in_range, 3)} % in their range of masses. {uncertain}",
    )
    share, margin = recovered / in_range, test["mass_margin"]
    if not _COMPLETE[0] / margin <= share <= _COMPLETE[1] * margin:
        why = (
            "pieces were lost, and the fit holds only if light and heavy ones were lost alike"
            if share < 1.0
            else "they may be of the fuze or of another round, or the law has too few heavy ones"
        )
        text = (
            f"The pieces of {test['source']} hold {number(100.0 * share, 3)} % of the law's mass in their range: {why}."
        )
        yield Finding("warning", text)
    probability = test["probability"]
    if probability is not None and probability < _REJECTED:
        worst = max(counted_groups(test), key=lambda one: (one[1] - one[2]) ** 2 / max(one[2], 5.0))
        widened = test["standard_error"] / test["curvature_error"]
        yield Finding(
            "warning",
            f"Mott's law does not describe the pieces of {test['source']}: chi-square {number(test['chi_square'], 3)} "
            f"with {test['degrees_of_freedom']} degrees of freedom (probability {number(100.0 * probability, 2)} %). "
            f"Most out of line: {worst[0]} g, {number(worst[1], 4)} counted, {number(worst[2], 4)} expected. The "
            f"standard error is widened {number(widened, 2)} times for it. Compare the numbers of the heavy pieces, "
            "which decide the distance.",
        )


def counted_groups(test: dict[str, Any]) -> list[tuple[str, float, float]]:
    """Range of mass in g, pieces counted and pieces expected, of `break_up.mean_mass.test`."""
    edges = [1e3 * edge for edge in test["edges"]]
    names = [f"{number(low, 3)} to {number(high, 3)}" for low, high in pairwise(edges)]
    if len(names) < len(test["number"]):
        names.append(f"above {number(edges[-1], 3)}")
    return list(zip(names, test["number"], test["expected"], strict=True))
