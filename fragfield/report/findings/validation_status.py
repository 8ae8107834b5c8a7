"""The validation behind the report: its last record, and whether that is of the version that computed the run.

The record is the file data/validation.json of the package, written by `python -m validation --record`; this module
reads the file and is independent of how the cases are computed.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib import resources
from typing import TYPE_CHECKING, Any, Literal

from fragfield.errors import InputError
from fragfield.numbers import number
from fragfield.report.blocks import Paragraph, Table
from fragfield.report.findings.bearing import bears_on

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from importlib.resources.abc import Traversable

    from fragfield.report.blocks import Block
    from fragfield.report.reading.run_files import RunFiles


_FORMAT, _FORMAT_VERSION = "fragfield validation", 1
_COMMAND = "“python -m validation --record”"


@dataclass(frozen=True)
class Record:
    """The recorded cases by name; empty where no record goes with the program."""

    cases: Mapping[str, Mapping[str, Any]]

    @property
    def rows(self) -> list[Mapping[str, Any]]:
        """The rows of all cases."""
        return [row for case in self.cases.values() for row in case["rows"]]

    def misses(self) -> list[Mapping[str, Any]]:
        """Checks that failed: rows outside a bound that theory sets. A comparison with a test is none."""
        return [row for row in self.rows if row["passed"] is False and row["kind"] != "comparison"]

    def compared(self, run: RunFiles) -> list[Mapping[str, Any]]:
        """Comparisons with tests and other codes that bear on a run."""
        return [row for row in self.rows if row["kind"] == "comparison" and bears_on(row, run)]

    def stopped(self) -> list[str]:
        """Names of the cases that could not be computed to their end."""
        return [name for name, case in self.cases.items() if case["stopped"]]

    def kinship(self, version: str, revision: str) -> Literal["same", "version", "other"]:
        """Whether every case was computed by that very source, only by that version, or by another one.

        A source with local changes ("+") is never known to be the same.
        """
        if any(case["fragfield"] != version for case in self.cases.values()):
            return "other"
        known = bool(revision) and not revision.endswith("+")
        return "same" if known and all(case["revision"] == revision for case in self.cases.values()) else "version"


def read_record(path: Traversable | None = None) -> Record:
    """Read the record of the validation; one that is not there is empty.

    Raises InputError: the file is no such record.
    """
    file = path if path is not None else resources.files("fragfield") / "data" / "validation.json"
    if not file.is_file():
        return Record({})
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        if content["format"] != _FORMAT or content["format_version"] != _FORMAT_VERSION:
            raise InputError(
                f"{file}: found {content['format']!r} of version {content['format_version']}, expected "
                f"{_FORMAT!r} of version {_FORMAT_VERSION}; write it again by {_COMMAND}"
            )
        return Record(content["cases"])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{file}: no record of the validation ({error}); write it again by {_COMMAND}") from error


def validation_words(record: Record, run: RunFiles) -> tuple[Literal["warning", "note", "good"], str]:
    """The weight and the words of what the record means for a run."""
    if not record.cases:
        return "warning", f"No validation record comes with this program; make one by {_COMMAND}."
    version, revision = (run.provenance.get(key, "") for key in ("program_version", "revision"))
    kinship = record.kinship(version, revision)
    misses, stopped = len(record.misses()), record.stopped()
    judged = sum(row["passed"] is not None and row["kind"] != "comparison" for row in record.rows)
    text = f"Validation: {number(judged - misses)} of {number(judged)} checks passed"
    if stopped:
        text += f", {', '.join(stopped)} stopped"
    bearing = ""
    if misses:
        near = sum(bears_on(row, run) for row in record.misses())
        bearing = f" Of the {number(misses)} missed {number(near)} bear on this case."
    if kinship == "same":
        weight: Literal["note", "good"] = "note" if misses or stopped else "good"
        return weight, f"{text}, computed by the same revision as this result.{bearing}"
    if kinship == "version":
        whose = f"version {version}, but by another revision of the source than this result"
        return "note", f"{text}, computed by {whose}.{bearing}"
    whose = f"version {version or 'of this result, which is not known'}"
    return "warning", f"{text}, but not all computed by {whose}.{bearing}"


def validation_blocks(record: Record, run: RunFiles) -> Iterator[Block]:
    """The section: what the record says of this version, a line a study, and the misses that bear on the run."""
    yield Paragraph(validation_words(record, run)[1])
    if not record.cases:
        return
    lines = []
    for name, case in record.cases.items():
        judged = [row for row in case["rows"] if row["passed"] is not None and row["kind"] != "comparison"]
        state = f"stopped: {case['stopped']}" if case["stopped"] else "coarse cells" if case["quick"] else "full"
        verdict = f"{sum(row['passed'] for row in judged)} of {len(judged)}"
        comparisons = str(sum(row["kind"] == "comparison" for row in case["rows"]))
        lines.append((name, verdict, comparisons, state, case["fragfield"], case["revision"] or "–", case["date"][:10]))
    yield Table(
        "Validation cases",
        ("Case", "Checks passed", "Comparisons", "Computed", "Version", "Revision", "Date"),
        tuple(lines),
        f"The cases are described in validation/README.md of the source. {_COMMAND} computes them again.",
    )
    if missed := [row for row in record.misses() if bears_on(row, run)]:
        head = ("Check", "Computed", "Reference", "Error", "Tolerance")
        yield Table("Checks missed that bear on this case", head, _lines(missed), _sources(missed))
    if compared := record.compared(run):
        head = ("Quantity", "Computed", "Test or other code", "Difference", "Its own uncertainty")
        yield Table("Compared with tests and bearing on this case", head, _lines(compared), _sources(compared))


def _lines(rows: Sequence[Mapping[str, Any]]) -> tuple[tuple[str, ...], ...]:
    return tuple(
        (
            f"{row['case']}: {row['quantity']}",
            shown_value(row["ours"], row),
            shown_value(row["reference"], row),
            shown_size(row, "error"),
            shown_size(row, "tolerance"),
        )
        for row in rows
    )


def _sources(rows: Sequence[Mapping[str, Any]]) -> str:
    sources = dict.fromkeys(f"{row['case']}: {row['source']}" for row in rows)
    return f"References: {'; '.join(sources)}."


def shown_value(value: float | None, row: Mapping[str, Any]) -> str:
    """A value of a check with its unit."""
    return "–" if value is None else f"{number(value)} {row.get('unit') or ''}".strip()


def shown_size(row: Mapping[str, Any], key: str) -> str:
    """An error or a tolerance: relative in per cent, or where a bound is judged the distance outside of it."""
    value = row[key]
    if value is None:
        return "–"
    if row["tolerance"] == 0.0:
        return number(value, 3) if key == "error" else "a bound"
    text = f"{100 * value:+.1f} %" if key == "error" else f"{100 * value:.1f} %"
    return text.replace("-", "−")
