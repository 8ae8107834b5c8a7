"""Uncertainty of the inputs in the report: the recommended distance with its parts, shares of the inputs, sources."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.hazard.certainty import whole_metres
from fragfield.hazard.recommended import RULE, parts_of, parts_words
from fragfield.numbers import SPACE, Row, number
from fragfield.report.blocks import Block, Card, Cards, Paragraph, Points, Rows, Section, Table
from fragfield.report.figures.uncertainty import distribution_figure, places_figure, tornado_figure
from fragfield.results.hazard import Recommended

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from fragfield.report.reading.run_files import RunFiles


_NOT_IN_IT = (
    "What is not in it: the error of the models themselves, shown by comparison with measurements (section "
    "on validation), and inputs that are not listed. A share says which input is worth a measurement; it does not "
    "make the input better known."
)
_APPLIES = {"value": "", "factor": "factor on the case's value: ", "shift": "added to the case's value: "}
_ESTIMATOR = (
    "By regression of the ranks of {samples} samples on the inputs; it leaves {left} % of their variance: joint "
    "effects, effects that are not monotone, and statistical errors of the samples. Errors by bootstrap."
)


def uncertainty_section(run: RunFiles, draw: Callable[..., Sequence[Block]]) -> list[Section]:
    """The section, or none where the run has no study of uncertainty."""
    found = run.study
    return [Section("uncertainty", "Uncertainty of the inputs", [*uncertainty_blocks(run, draw)])] if found else []


def uncertainty_blocks(run: RunFiles, draw: Callable[..., Sequence[Block]]) -> Iterator[Block]:
    """All blocks of the section and of the page."""
    found = run.study
    yield from _states(found)
    if not found.get("distance"):
        yield Paragraph(f"No result: {found['states'].get('reason', 'no sample gave a distance')}.", kind="caution")
        yield _inputs(found)
        return
    yield from _headline(found)
    yield _parts(found["hazard"])
    yield Paragraph(_NOT_IN_IT)
    yield from draw(
        "uncertainty_distribution", "Distribution of the expected distance",
        "Share of the samples whose distance is not larger, statistical errors of the samples taken out; uprights: 5, "
        "50 and 95 %, the distance of the run itself, and the recommended one.", distribution_figure,
    )  # fmt: skip
    yield from draw(
        "uncertainty_tornado", "Effect of each input on the expected distance",
        "Mean distance with one input at 5 % and at 95 % of its own distribution (for discrete inputs over all steps), "
        "by linear regression. Light: the input at its low end.", tornado_figure,
    )  # fmt: skip
    yield from _shares("Share of each input in the variance of the distance", found["distance"])
    yield from draw(
        "uncertainty_sites", "Exposed sites over the inputs",
        "Expected hits at each exposed site: 5 to 95 % over the inputs (bar), median (dot), the run itself (cross).",
        places_figure,
    )  # fmt: skip
    yield from _places(found)
    yield _inputs(found)


def _states(found: Mapping[str, Any]) -> Iterator[Block]:
    design, states = found["design"], found["states"]
    shared = f" They share {design['bursts']} bursts: {design['geometry']}." if design["bursts"] else ""
    text = (
        f"{number(design['samples'])} samples of {len(found['inputs'])} inputs (Latin hypercube, seed "
        f"{design['seed']}), each with {number(design['realisations'])} realisations of the break-up.{shared}"
    )
    yield Paragraph(text)
    lost = states["failed"] + states["not_determined"] + states["missing"]
    if lost:
        yield Paragraph(
            f"{number(lost)} samples gave no distance and are left out of all numbers below "
            f"({states['failed']} failed, {states['not_determined']} not determined, {states['missing']} not made): "
            "the distribution may be too narrow.",
            kind="caution",
        )
        if states["messages"]:
            yield Points(tuple(states["messages"]))


def _headline(found: Mapping[str, Any]) -> Iterator[Block]:
    spread, hazard = found["distance"]["spread"], found["hazard"]
    span = f"{whole_metres(spread['low'])}{SPACE}–{SPACE}{whole_metres(spread['high'])}"
    what, error = "taken out" if spread["resolved"] else "included", f"± {spread['median_standard_error']:.1f}"
    cards = [
        Card("Recommended distance", whole_metres(hazard["recommended"]), "m", parts_words(Recommended.read(hazard))),
        Card("Median over the inputs", whole_metres(spread["median"]), "m", f"{error} m for the number of samples"),
        Card("5 to 95 % over the inputs", span, "m", f"statistical errors of the samples {what}"),
    ]  # fmt: skip
    yield Cards(tuple(cards))
    if not spread["resolved"]:
        yield Paragraph(
            "The inputs spread the distance by less than the statistical error of a sample: the quantiles are those of "
            "both together, too wide; more realisations for each sample (uncertainty.realisations) separate them.",
            kind="caution",
        )


def _parts(hazard: Mapping[str, Any]) -> Block:
    lines = [
        (row.words, f"{row.value:.1f}" if row.value is not None else "–", row.reason)
        for row in parts_of(Recommended.read(hazard))
    ]
    lines.append(("recommended distance", f"{hazard['recommended']:.1f}", ""))
    return Table("Parts of the recommended distance", ("Part", "m", "Not included"), tuple(lines), RULE)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _shares(title: str, entry: Mapping[str, Any]) -> Iterator[Block]:
    estimator = entry["estimator"]
    if "shares" not in entry:
        yield Paragraph(f"No shares of the inputs: {estimator['reason']}.")
        return
    order = sorted(entry["shares"], key=lambda one: -one["share"])
    lines = tuple(
        (
            one["name"],
            f"{100 * one['share']:.1f}{SPACE}±{SPACE}{100 * one['share_standard_error']:.1f}",
            f"{100 * one['share_low']:.0f}{SPACE}–{SPACE}{100 * one['share_high']:.0f}",
        )
        for one in order
    )
    left = f"{100 * (1.0 - estimator['explained']):.0f}"
    note = _ESTIMATOR.format(samples=estimator["samples"], left=left)
    yield Table(title, ("Input", "share (%)", "95 %"), lines, note)


def _places(found: Mapping[str, Any]) -> Iterator[Block]:
    lines = []
    for place in found["exposed"]:
        for name, words in (
            ("density", "density (1/m²)"),
            ("hits", "expected hits"),
            ("probability", "probability of a hit"),
        ):
            entry = place[name]
            if entry is None:
                continue
            spread = entry["spread"]
            largest = max(entry.get("shares") or [], key=lambda one: one["share"], default=None)
            most = "–" if largest is None else f"{largest['name']} ({100 * largest['share']:.0f}{SPACE}%)"
            values = (entry["nominal"], spread["low"], spread["median"], spread["high"])
            lines.append((place["name"], words, *(f"{value:.3g}" for value in values), most))
    if lines:
        head = ("Exposed site", "Quantity", "the run", "5 %", "50 %", "95 %", "largest share")
        yield Table(
            "Exposed sites over the inputs",
            head,
            tuple(lines),
            "Expected values; densities are the larger of that normal to the path and that on the ground.",
        )


def _inputs(found: Mapping[str, Any]) -> Rows:
    """What is uncertain, and where that comes from, one row of running text for each input."""
    return Rows(
        "Uncertain inputs and their sources",
        tuple(
            Row(
                _capital(entry["name"]),
                f"{_capital(_APPLIES[entry['applies']] + entry['words'])}. Key: {_keys(entry['keys'])}. "
                f"{_capital(entry['source'])}",
                note="judgement" if entry["judgement"] else "",
            )
            for entry in found["inputs"]
        ),
    )


def _keys(keys: Sequence[str]) -> str:
    more = f" and {len(keys) - 2} more" if len(keys) > 2 else ""
    return ", ".join(keys[:2]) + more
