"""What the report and its own page show of a study of uncertainty."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.hazard.recommended import RULE
from fragfield.numbers import SPACE, Row
from fragfield.results.words import parts_of, parts_words, whole_metres

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.results.run import StoredRun
    from fragfield.results.uncertainty import UncertaintyResult


_ESTIMATOR = (
    "By regression of the ranks of {samples} samples on the inputs; it leaves {left} % of their variance: joint "
    "effects, effects that are not monotone, and statistical errors of the samples. Errors by bootstrap."
)
_APPLIES = {"value": "", "factor": "factor on the case's value: ", "shift": "added to the case's value: "}


def study(run: StoredRun) -> dict[str, Any] | None:
    """A study of uncertainty: the recommended distance with its parts, shares of the inputs, and their sources."""
    if (found := run.study) is None:
        return None
    shown_inputs = {"study": found, "inputs": [*_uncertain_inputs(found)], "places": [*_places(found)]}
    if (entry := found.distance) is None or (hazard := found.hazard) is None:
        return shown_inputs
    spread, estimator = entry.spread, entry.estimator
    span = f"{whole_metres(spread.low)}{SPACE}–{SPACE}{whole_metres(spread.high)}"
    error, what = f"± {spread.median_standard_error:.1f}", "taken out" if spread.resolved else "included"
    shares = [
        (
            one.name,
            f"{100 * one.share:.1f}{SPACE}±{SPACE}{100 * one.share_standard_error:.1f}",
            f"{100 * one.share_low:.0f}{SPACE}–{SPACE}{100 * one.share_high:.0f}",
        )
        for one in sorted(entry.shares, key=lambda one: -one.share)
    ]
    left = f"{100 * (1.0 - (estimator.explained or 0.0)):.0f}"
    return shown_inputs | {
        "cards": (
            ("Recommended distance", whole_metres(hazard.recommended), "m", parts_words(hazard)),
            ("Median over the inputs", whole_metres(spread.median), "m", f"{error} m for the number of samples"),
            ("5 to 95 % over the inputs", span, "m", f"statistical errors of the samples {what}"),
        ),
        "parts": [
            *((one.words, "–" if one.value is None else f"{one.value:.1f}", one.reason) for one in parts_of(hazard)),
            ("recommended distance", f"{hazard.recommended:.1f}", ""),
        ],
        "rule": RULE,
        "shares": shares,
        "estimator": _ESTIMATOR.format(samples=estimator.samples, left=left) if shares else "",
    }


def of_distance(run: StoredRun) -> dict[str, Any] | None:
    """The same, where samples gave a distance."""
    return study(run) if run.study and run.study.distance else None


def _places(found: UncertaintyResult) -> Iterator[tuple[str, ...]]:
    for site in found.exposed:
        for entry, words in (
            (site.density, "density (1/m²)"), (site.hits, "expected hits"), (site.probability, "probability of a hit"),
        ):  # fmt: skip
            if entry is None:
                continue
            largest = max(entry.shares, key=lambda one: one.share, default=None)
            most = "–" if largest is None else f"{largest.name} ({100 * largest.share:.0f}{SPACE}%)"
            values = (entry.nominal, entry.spread.low, entry.spread.median, entry.spread.high)
            yield (site.name, words, *(f"{value:.3g}" for value in values), most)


def _uncertain_inputs(found: UncertaintyResult) -> Iterator[Row]:
    for entry in found.inputs:
        more = f" and {len(entry.keys) - 2} more" if len(entry.keys) > 2 else ""
        words, source = (text[:1].upper() + text[1:] for text in (_APPLIES[entry.applies] + entry.words, entry.source))
        yield Row(
            entry.name[:1].upper() + entry.name[1:],
            f"{words}. Key: {', '.join(entry.keys[:2])}{more}. {source}",
            note="judgement" if entry.judgement else "",
        )
