"""The sections of the report in their order, from a run's files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.report.blocks import (
    Block,
    Findings,
    Paragraph,
    Points,
    Section,
    Signatures,
    Text,
)
from fragfield.report.findings import statements
from fragfield.report.findings.findings import findings
from fragfield.report.findings.validation_status import read_record, validation_blocks
from fragfield.report.first_page import summary_section
from fragfield.report.stage_sections import (
    blocks_of_stage,
    break_up_section,
    burst_section,
    convergence_section,
    flight_section,
    hazard_section,
    ledger_section,
)
from fragfield.report.tables.attitudes import attitude_sections
from fragfield.report.tables.distances import sector_table
from fragfield.report.tables.inputs import input_tables
from fragfield.report.tables.profile import profile_section
from fragfield.report.tables.rounds import (
    arrangement_table,
)
from fragfield.report.tables.stages import (
    azimuth_tables,
    mesh_rows,
    provenance_rows,
)
from fragfield.report.tables.uncertainty import uncertainty_section

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from fragfield.case.tables.document import DocumentTable
    from fragfield.report.blocks import Illustration
    from fragfield.report.reading.run_files import RunFiles

    Draw = Callable[[str, str, str, Callable[[RunFiles, bool], Figure | None]], list[Illustration]]
    Picture = Callable[[str, str, str], list[Block]]

__all__ = ["sections"]


def sections(run: RunFiles, draw: Draw, picture: Picture) -> list[Section]:
    """All sections in order.

    Parameters
    ----------
    run : RunFiles
        The run.
    draw : callable
        Makes a figure from its name, title, caption and drawing function; an empty list where there is no data.
    picture : callable
        Makes one of the off-screen pictures from its name, title and caption, alike.
    """
    found = tuple(findings(run))
    return [
        summary_section(run, found),
        Section("warnings", "Warnings and checks", [Findings(found)]),
        *(_burst_sections(run, draw, picture) if "burst" in run.stages else []),
        break_up_section(run, draw, picture),
        flight_section(run, draw),
        hazard_section(run, draw),
        *([convergence_section(run, draw)] if "burst" in run.stages else []),
        *uncertainty_section(run, draw),
        Section(
            "tables",
            "Tables by azimuth",
            blocks_of_stage(run, "flight", lambda: [*azimuth_tables(run), *sector_table(run)]),
        ),
        _validation(run),
        _provenance(run),
        _use(),
        _signatures(run),
        _inputs(run),
        *attitude_sections(run),
        *profile_section(run),
    ]


def _burst_sections(run: RunFiles, draw: Draw, picture: Picture) -> list[Section]:
    """What only a run with a burst of its own has."""
    found = [
        Section("mesh", "Mesh and its quality", blocks_of_stage(run, "burst", lambda: [mesh_rows(run)])),
        ledger_section(run, draw),
        burst_section(run, draw, picture),
    ]
    arrangement: list[Block] = [*arrangement_table(run)]
    return [Section("arrangement", "Arrangement of the rounds", arrangement), *found] if arrangement else found


def _inputs(run: RunFiles) -> Section:
    """The annex: every input that took part, and the case's own text."""
    blocks: list[Block] = []
    if run.case is not None:
        note = "Keys that do not apply to this run (those of other choices) are listed in case.toml only."
        blocks += [Paragraph(note), *input_tables(run), Text("case.toml, as resolved", run.case_text)]
    else:
        blocks.append(Paragraph("This directory contains no case."))
    return Section("inputs", "Annex: inputs as resolved", blocks)


def _validation(run: RunFiles) -> Section:
    return Section("validation", "Validation of this version", list(validation_blocks(read_record(), run)))


def _provenance(run: RunFiles) -> Section:
    blocks: list[Block] = [*provenance_rows(run)]
    return Section("provenance", "Provenance", blocks)


def _use() -> Section:
    return Section(
        "use",
        "What this result may be used for",
        [
            Paragraph("It may be used for", kind="heading"),
            Points(statements.MAY_BE_USED_FOR),
            Paragraph("It must not be used for", kind="heading"),
            Points(statements.MUST_NOT_BE_USED_FOR),
        ],
    )


def _signatures(run: RunFiles) -> Section:
    document = run.document
    changes = [*_changes(document)]
    return Section(
        "signatures",
        "Signatures",
        [
            Paragraph(
                "By signing, the reviewer confirms to have read the warnings, the limits and the inputs (annex)."
            ),
            Signatures(
                ("Computed by", "Reviewed by", "Approved by"),
                (document.prepared_by, document.reviewed_by, document.approved_by),
            ),
            *changes,
        ],
    )


def _changes(document: DocumentTable) -> list[Block]:
    if not document.changes:
        return []
    head = f"Changes of revision {document.revision}" if document.revision else "Changes of this revision"
    return [Paragraph(head, kind="heading"), Points(tuple(document.changes))]
