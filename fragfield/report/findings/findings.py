"""Findings that a reader must know before using the numbers, ordered by severity."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.checking.case_warnings import doubts
from fragfield.report.findings.break_up import break_up_findings
from fragfield.report.findings.burst import burst_findings, ledger_findings
from fragfield.report.findings.evidence import validation_words
from fragfield.report.findings.finding import Finding
from fragfield.report.findings.hazard import convergence_findings, flight_findings, imprint_findings

if TYPE_CHECKING:
    from fragfield.interface.results import Run
    from fragfield.report.findings.finding import Weight


_ORDER: dict[Weight, int] = {"stop": 0, "warning": 1, "note": 2, "good": 3}
_JUDGED = {"certainty", "contact_energy", "drag_table", "no_end", "passed_through", "rounds_alone"}
"""Codes of recorded warnings whose matter is judged here from numbers."""


def findings(run: Run) -> list[Finding]:
    """All findings of a run, the gravest first."""
    found = [
        *_stages(run),
        *ledger_findings(run),
        *burst_findings(run),
        *break_up_findings(run),
        *flight_findings(run),
        *imprint_findings(run),
    ]
    found += [*convergence_findings(run), *_recorded(run)]
    if run.provenance:
        found.append(Finding(*validation_words(run)))
    return sorted(found, key=lambda item: _ORDER[item.weight])


def _stages(run: Run) -> list[Finding]:
    if not run.missing:
        return []
    names = ", ".join(run.missing)
    return [Finding("warning", f"Not yet run: {names}. Results that depend on it are missing below.")]


def _recorded(run: Run) -> list[Finding]:
    """What the case is unusual in, and what the stages warned of, each once."""
    found = list(doubts(run.values, burst=run.fragments_file is None)) if run.values is not None else []
    found += [one.text for one in run.summary.findings if one.code not in _JUDGED]
    return [Finding("warning", _sentence(text)) for text in dict.fromkeys(found)]


def _sentence(text: str) -> str:
    """A text with a full stop, and with a capital letter unless it begins with a key of the case."""
    first = text[0] if "." in text.partition(" ")[0] else text[0].upper()
    return f"{first}{text[1:]}{'' if text.endswith('.') else '.'}"
