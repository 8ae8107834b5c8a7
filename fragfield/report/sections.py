"""The sections of the report in their order, from a run's files: first page, body, annexes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.report.blocks import Block, Columns, Findings, Group, Paragraph, Points, Section, Text
from fragfield.report.findings import statements
from fragfield.report.findings.evidence import validation_blocks
from fragfield.report.findings.findings import findings
from fragfield.report.first_page import decision_section
from fragfield.report.stage_sections import (
    annexes_of_stages,
    convergence_section,
    fragments_section,
    hazard_section,
    rounds_section,
    speeds_section,
)
from fragfield.report.tables.attitudes import attitude_sections
from fragfield.report.tables.stages import provenance_rows
from fragfield.report.tables.uncertainty import uncertainty_section

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from matplotlib.figure import Figure

    from fragfield.report.blocks import Finding, Illustration
    from fragfield.report.reading.run_files import RunFiles

    Draw = Callable[[str, str, str, Callable[[RunFiles], Figure | None]], list[Illustration]]
    Picture = Callable[[str, str, str], list[Block]]


def sections(run: RunFiles, draw: Draw, picture: Picture) -> list[Section]:
    """All sections in order.

    `run`: the run; `draw`: makes a figure from its name, title, caption and drawing function; an empty list where there
    is no data; `picture`: makes one of the off-screen pictures from its name, title and caption, alike.
    """
    found = tuple(findings(run))
    return [
        decision_section(run, found),
        *([rounds_section(run, draw)] if run.fragments_file is None else []),
        hazard_section(run, draw),
        _warnings(run, found),
        fragments_section(run, draw, picture),
        *([speeds_section(run, draw, picture), convergence_section(run, draw)] if "burst" in run.stages else []),
        *uncertainty_section(run, draw),
        *annexes_of_stages(run, draw),
        Section("validation", "Validation of this version", list(validation_blocks(run)), annex=True),
        Section("provenance", "Versions and files", list(provenance_rows(run)), annex=True),
        Section("inputs", "Inputs as resolved", list(_inputs(run)), annex=True),
        *attitude_sections(run),
    ]


def _warnings(run: RunFiles, found: Sequence[Finding]) -> Section:
    """All findings, the limits of validity and the uses."""
    terms = (statements.summary_terms(run),) if run.part("hazard") else ()
    blocks: list[Block] = [
        Findings(tuple(found)),
        Paragraph("Limits of validity", kind="heading"),
        Points((*terms, *statements.limits(run))),
        Columns((
            Group((Paragraph("It may be used for", kind="heading"), Points(statements.MAY_BE_USED_FOR))),
            Group((Paragraph("It must not be used for", kind="heading"), Points(statements.MUST_NOT_BE_USED_FOR))),
        )),
    ]  # fmt: skip
    if changes := run.document.changes:
        head = f"Changes of revision {run.document.revision}" if run.document.revision else "Changes of this revision"
        blocks += [Paragraph(head, kind="heading"), Points(tuple(changes))]
    return Section("warnings", "Warnings, checks and limits", blocks)


def _inputs(run: RunFiles) -> Iterator[Block]:
    """The case's own text."""
    if run.case is None:
        yield Paragraph("This directory contains no case.")
        return
    yield Text("case.toml, as resolved", run.case_text)
