"""Three reasons to trust a result and three against: validation that bears on it, checks, warnings, limits."""

from __future__ import annotations

from itertools import chain, islice
from typing import TYPE_CHECKING, Any

from fragfield.hazard.recommended import PARTS
from fragfield.numbers import number
from fragfield.report.findings.burst import burst_findings, ledger_findings
from fragfield.report.findings.hazard import convergence_findings, flight_findings
from fragfield.report.findings.statements import limits, many_rounds
from fragfield.report.findings.validation_status import read_record, shown_size, shown_value

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from fragfield.report.blocks import Finding
    from fragfield.report.reading.run_files import RunFiles


_EACH = 3
_MEASURED = {
    "m107_1944": "; counted there over the whole sphere without gravity: beside the round fragments are denser",
    "polar_zones": "", "copper_cylinder": "", "colliding_tubes": "", "steel_tubes": "",
    "paper_3_1": "", "paper_3_2": "",
}  # fmt: skip
"""Studies against measurements or published results, the nearest to a distance first, and what differs there."""
_STACKS = {"stack", "collision"}


def reasons_for(run: RunFiles) -> list[str]:
    """Checks that passed: validation by measurement, grid, number of realisations, energy."""
    checks = chain(convergence_findings(run), flight_findings(run), ledger_findings(run), burst_findings(run))
    passed = (item.text for item in checks if item.weight == "good")
    return _three(chain(islice(_measured(run), 1), passed))


def reasons_against(run: RunFiles, found: Sequence[Finding]) -> list[str]:
    """What was found wrong or doubtful, the gravest first; then missed checks of the validation and limits."""
    grave = [item.text for item in found if item.weight in ("stop", "warning")]
    more = len(grave) - _EACH
    texts = _three(chain(grave, islice(_missed(run), 1), _left_out(run), limits(run)))
    if more > 0:
        texts[-1] += f" {number(more)} more {'warning' if more == 1 else 'warnings'}: see below."
    return texts


def _three(texts: Iterator[str]) -> list[str]:
    return list(islice((_first_sentence(text) for text in texts), _EACH))


def _first_sentence(text: str) -> str:
    """The first sentence: what is meant, without how to go on; a point within a number or name ends none."""
    head, point, _ = text.partition(". ")
    return f"{head}." if point else text


def _compared(run: RunFiles) -> list[Mapping[str, Any]]:
    """Comparisons of the studies against measurements that bear on the run, the nearest first."""
    rows = [row for row in read_record().compared(run) if row["case"] in _MEASURED and row["error"] is not None]
    if many_rounds(run):  # a single round says nothing of what neighbours do to each other
        rows = [row for row in rows if _STACKS.intersection(row["subjects"])]
    # A row of what only such runs have says more of this one.
    return sorted(rows, key=lambda row: (-len(row["subjects"]), list(_MEASURED).index(row["case"])))


def _measured(run: RunFiles) -> Iterator[str]:
    """By study: how far off its comparisons are, with the one of the median error as the example."""
    rows = _compared(run)
    for study in dict.fromkeys(row["case"] for row in rows):
        own = sorted((row for row in rows if row["case"] == study), key=lambda row: abs(row["error"]))
        example, last = own[len(own) // 2], own[-1]
        yield (
            f"Validation {study} ({example['source'].partition(';')[0]}): {example['quantity']} "
            f"{shown_value(example['ours'], example)}, there {shown_value(example['reference'], example)}; largest of "
            f"{len(own)} differences {shown_size(last, 'error')}{_MEASURED[study]}."
        )


def _missed(run: RunFiles) -> Iterator[str]:
    """Comparisons outside the test's own uncertainty, the farthest first."""
    missed = [row for row in _compared(run) if row["passed"] is False and row["tolerance"]]
    for row in sorted(missed, key=lambda row: -abs(row["error"]) / row["tolerance"]):
        ours, theirs = (shown_value(row[key], row) for key in ("ours", "reference"))
        error, tolerance = (shown_size(row, key) for key in ("error", "tolerance"))
        yield (
            f"Validation {row['case']}: {row['quantity']} {ours}, in the test {theirs} ({error}; the test is known to "
            f"{tolerance})."
        )


def _left_out(run: RunFiles) -> Iterator[str]:
    """Parts of the recommended distance that are not known."""
    for name, why in (run.part("hazard").get("not_included") or {}).items():
        yield f"The recommended distance does not include the part “{PARTS[name]}”: {why}."
