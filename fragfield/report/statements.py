"""Basis, scope and permitted uses of a result for the case at hand; three reasons to trust it and three against."""

from __future__ import annotations

from itertools import chain, islice
from typing import TYPE_CHECKING

from fragfield.hazard.recommended import RULE
from fragfield.numbers import number
from fragfield.report.evidence import bearing
from fragfield.report.findings import burst_findings, convergence_findings, flight_findings, ledger_findings
from fragfield.results.words import PARTS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from fragfield.case import CaseTable
    from fragfield.report.evidence import Comparison
    from fragfield.report.findings import Finding
    from fragfield.results.run import StoredRun


_MEANS = {
    "integral": "an integral over all fragments",
    "weighted_fragments": "a sum over fragments that stand for all others, each with a weight",
    "realisations": "the mean over realisations of the random break-up",
}


def summary_terms(run: StoredRun) -> str:
    """What the recommended distance and its parts are; nothing before there is one."""
    criteria, hazard = run.criteria, run.summary.hazard
    if hazard is None:
        return ""
    if run.fragments_file is None:
        mean = _MEANS[hazard.method]
    elif hazard.realisations > 1:
        mean = f"the mean over random draws from the table {run.fragments_file}"
    else:
        mean = f"of the fragments of {run.fragments_file} alone"
    text = (
        f"The expected distance is where the expected density of fragments of {criteria.energy:.3g} J or more falls "
        f"below one per {1.0 / criteria.density:.1f} m² for the last time: {mean}, on the ground or normal to the "
        "paths below a person's height, whichever distance is larger. "
    )
    if hazard.upper is not None and hazard.method == "realisations":
        what = "the break-up" if run.fragments_file is None else "the draws"
        text += f"The randomness of {what} is a one-sided band of 95 % by a bootstrap over the realisations. "
    if hazard.recommended is not None:
        text += f"Recommended distance: {RULE[0].lower()}{RULE[1:]} "
    if hazard.ricochet != "none":
        text += (
            "It counts what fragments do after their first impact on the ground too, from which they ricochet at "
            "grazing angles: that is the larger distance, and the one without ricochet is given beside it. "
        )
    return f"{text}Distances are measured from the origin given in the case."


def limits(run: StoredRun) -> Iterator[str]:
    """What the result does not cover: only what holds for the case at hand."""
    yield (
        "Fragments of the casings only: no blast, heat or ground shock, no debris of buildings, vehicles or soil, no "
        "secondary fragments."
    )
    if run.fragments_file is None:
        yield from _of_burst(run)
    else:
        yield (
            f"Number, mass, speed and direction of the fragments are those of {run.fragments_file}: what was not "
            "measured there is not in the result."
        )
    if run.summary.hazard and run.summary.hazard.attitude.kind == "any":
        yield (
            "Mixed attitudes: the recommended distance is that of the worst attitude and holds in every direction. "
            "Landings, densities, hits on witness surfaces and tables by azimuth are those of that attitude, nose to "
            "azimuth 0."
        )
    if run.values is not None:
        yield from _of_flight(run.values, several=many_rounds(run))


def _of_burst(run: StoredRun) -> Iterator[str]:
    if many_rounds(run):
        yield (
            "Every round is assumed to detonate as specified in the case; whether and when neighbours are "
            "initiated is an "
            "input, or follows from the threshold of pressure and time that the case gives."
        )
        yield "Casings of neighbouring rounds collide only during the computed burst."
    yield (
        "Detonation is a prescribed burn; burning, deflagration and partial reactions throw fewer, heavier pieces "
        "and are not covered."
    )
    yield (
        "Natural break-up after a statistical law: single fragments are not predicted. Numbers and masses rest on "
        "calibrated inputs."
    )
    yield (
        "The burst's final speed depends most on the leakage radius (burst.leakage.radius_ratio) and on the cell size: "
        "vary both before basing a decision on the result."
    )


def _of_flight(case: CaseTable, *, several: bool) -> Iterator[str]:
    if not several:
        yield (
            "Fragments of one round do not collide with each other in flight: their deviation from the casing's "
            "directions is the scatter of directions."
        )
    elif case.flight.collisions == "none":
        yield "Collisions of fragments with each other in flight are not computed."
    else:
        yield (
            "Fragments of different rounds collide in flight as spheres, within the first metres (flight.collisions); "
            "those of one round do not: their deviation from the casing's directions is the scatter of directions."
        )
    if case.flight.shape.model == "mean":
        yield "Flight is that of tumbling fragments with a mean presented area; one that flies edge-on travels farther."
    else:
        yield f"Presented areas are drawn by the model “{case.flight.shape.model}”; real shapes are not known."
    if case.flight.ground.ricochet == "none":
        yield (
            'Fragments stay where they first meet the ground (flight.ground.ricochet = "none"): steel that grazes the '
            "ground at a few degrees ricochets off most kinds of it and carries the hazard farther."
        )
    else:
        kind = case.flight.ground.ricochet.replace("_", " ")
        yield (
            f"Ricochet off {kind}: critical angle and share of speed kept are deduced or judged, without a measurement "
            "of steel fragments; vary flight.ground.departure_factor and roughness_factor, which decide most."
        )
    ground = "the height map" if case.flight.ground.map is not None else "flat ground"
    names = [f"{one.kind} “{one.name}”" for one in case.obstacle]
    if stops := ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else ""):
        yield f"Fragments land on {ground}; only what the case defines stops them: {stops}. Vegetation is not modelled."
    else:
        yield f"Fragments land on {ground}, and nothing stops them: the case has no walls, barricades or buildings."


def many_rounds(run: StoredRun) -> bool:
    """Whether several rounds burst, those behind planes of symmetry among them."""
    if run.values is None:
        return len(run.rounds) > 1
    return len(run.values.round) > 1 or any(plane.kind == "symmetry" for plane in run.values.plane)


MAY_BE_USED_FOR = (
    "estimating how far, how densely and how fast fragments of stored, handled or tested cased charges fly",
    "comparing arrangements, fills and separations with each other",
    "planning trials and supporting, with test data, the review of a safety case by qualified persons",
)

MUST_NOT_BE_USED_FOR = (
    "replacing the quantity-distances that the competent authority prescribes, or its approval",
    "reducing a distance on the strength of one run, without bands, grid convergence and comparison with tests",
    "rating or improving the effect of a munition on a target, for which this program has no function",
)


_EACH = 3
_CLOSE = 0.5  # largest difference of a study that speaks for a result
_DIFFERS = {"m107_1944": "; counted over the whole sphere without gravity: beside the round fragments are denser"}
"""How the quantity of a study differs from that of a run."""


def reasons_for(run: StoredRun) -> list[str]:
    """Checks that passed: validation by measurement, grid, number of realisations, energy."""
    checks = chain(convergence_findings(run), flight_findings(run), ledger_findings(run), burst_findings(run))
    passed = (item.text for item in checks if item.weight == "good")
    return _three(chain(islice(_measured(run, close=True), 1), passed))


def reasons_against(run: StoredRun, found: Sequence[Finding]) -> list[str]:
    """What was found wrong or doubtful, the gravest first; then missed checks of the validation and limits."""
    grave = [item.text for item in found if item.weight in ("stop", "warning")]
    more = len(grave) - _EACH
    measured = chain(_missed(run), _measured(run, close=False))
    texts = _three(chain(grave, islice(measured, 1), _left_out(run), limits(run)))
    if more > 0:
        texts[-1] += f" {number(more)} more {'warning' if more == 1 else 'warnings'}: see below."
    return texts


def _three(texts: Iterator[str]) -> list[str]:
    return list(islice((_first_sentence(text) for text in texts), _EACH))


def _first_sentence(text: str) -> str:
    """The first sentence: what is meant, without how to go on; a point within a number or name ends none."""
    head, point, _ = text.partition(". ")
    return f"{head}." if point else text


def _fitting(run: StoredRun) -> list[Comparison]:
    """Comparisons that bear on the run; a single round says nothing of what neighbours do to each other."""
    several = many_rounds(run)
    return [one for one in bearing(run) if not several or {"stack", "collision"}.intersection(one.subjects)]


def _measured(run: StoredRun, *, close: bool) -> Iterator[str]:
    """By study, of those with all comparisons `close` or of the others: that of the median error, and the largest."""
    rows = _fitting(run)
    for study in dict.fromkeys(row.case for row in rows):
        own = sorted((row for row in rows if row.case == study), key=lambda row: abs(row.error))
        if (abs(own[-1].error) <= _CLOSE) != close:
            continue
        example = own[len(own) // 2]
        ours, theirs, *_ = example.cells
        yield (
            f"Validation {study} ({example.source.partition(';')[0]}): {example.quantity} {ours}, there "
            f"{theirs}; largest of {len(own)} differences {own[-1].cells[2]}{_DIFFERS.get(study, '')}."
        )


def _missed(run: StoredRun) -> Iterator[str]:
    missed = [(abs(row.error) / row.tolerance, row) for row in _fitting(run) if row.tolerance]
    for times, row in sorted(missed, key=lambda one: -one[0]):
        if times > 1.0:
            ours, theirs, error, tolerance = row.cells
            known = f"({error}; the test is known to {tolerance})"
            yield f"Validation {row.case}: {row.quantity} {ours}, in the test {theirs} {known}."


def _left_out(run: StoredRun) -> Iterator[str]:
    for name, why in run.summary.hazard.not_included.items() if run.summary.hazard else ():
        yield f"The recommended distance does not include the part “{PARTS[name]}”: {why}."
