"""Three reasons to trust a result and three against: validation that bears on it, checks, warnings, limits."""

from __future__ import annotations

from itertools import chain, islice
from typing import TYPE_CHECKING, Any

from fragfield.numbers import number
from fragfield.report.findings.burst import burst_findings, ledger_findings
from fragfield.report.findings.evidence import bearing, shown
from fragfield.report.findings.hazard import convergence_findings, flight_findings
from fragfield.report.findings.statements import limits, many_rounds
from fragfield.results.words import PARTS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from fragfield.interface.results import Run
    from fragfield.report.findings.finding import Finding


_EACH = 3
_CLOSE = 0.5  # largest difference of a study that speaks for a result
_DIFFERS = {"m107_1944": "; counted over the whole sphere without gravity: beside the round fragments are denser"}
"""How the quantity of a study differs from that of a run."""


def reasons_for(run: Run) -> list[str]:
    """Checks that passed: validation by measurement, grid, number of realisations, energy."""
    checks = chain(convergence_findings(run), flight_findings(run), ledger_findings(run), burst_findings(run))
    passed = (item.text for item in checks if item.weight == "good")
    return _three(chain(islice(_measured(run, close=True), 1), passed))


def reasons_against(run: Run, found: Sequence[Finding]) -> list[str]:
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


def _fitting(run: Run) -> list[Mapping[str, Any]]:
    """Comparisons that bear on the run; a single round says nothing of what neighbours do to each other."""
    several = many_rounds(run)
    return [row for row in bearing(run) if not several or {"stack", "collision"}.intersection(row["subjects"])]


def _measured(run: Run, *, close: bool) -> Iterator[str]:
    """By study, of those with all comparisons `close` or of the others: that of the median error, and the largest."""
    rows = _fitting(run)
    for study in dict.fromkeys(row["case"] for row in rows):
        own = sorted((row for row in rows if row["case"] == study), key=lambda row: abs(row["error"]))
        if (abs(own[-1]["error"]) <= _CLOSE) != close:
            continue
        example, (ours, theirs, *_) = own[len(own) // 2], shown(own[len(own) // 2])
        yield (
            f"Validation {study} ({example['source'].partition(';')[0]}): {example['quantity']} {ours}, there "
            f"{theirs}; largest of {len(own)} differences {shown(own[-1])[2]}{_DIFFERS.get(study, '')}."
        )


def _missed(run: Run) -> Iterator[str]:
    """Comparisons outside the test's own uncertainty, the farthest first."""
    missed = [row for row in _fitting(run) if row["tolerance"] and abs(row["error"]) > row["tolerance"]]
    for row in sorted(missed, key=lambda row: -abs(row["error"]) / row["tolerance"]):
        ours, theirs, error, tolerance = shown(row)
        yield (
            f"Validation {row['case']}: {row['quantity']} {ours}, in the test {theirs} ({error}; the test is known to "
            f"{tolerance})."
        )


def _left_out(run: Run) -> Iterator[str]:
    """Parts of the recommended distance that are not known."""
    for name, why in run.summary.hazard.not_included.items() if run.summary.hazard else ():
        yield f"The recommended distance does not include the part “{PARTS[name]}”: {why}."
