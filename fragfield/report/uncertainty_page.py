"""A study of uncertainty as a short separate page, with the template and figures of the report."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.report.assemble import write_page
from fragfield.report.blocks import Section
from fragfield.report.reading.run_files import read_run
from fragfield.report.tables.uncertainty import uncertainty_blocks

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from fragfield.report.blocks import Block
    from fragfield.report.reading.run_files import RunFiles


_PARTS = (
    ("uncertainty", "The recommended distance"),
    ("shares", "What moves it"),
    ("inputs", "Uncertain inputs"),
)


def write_uncertainty_page(folder: Path, run_directory: Path, found: Mapping[str, Any]) -> Path:
    """Write uncertainty.html and its figures.

    `folder`: the study's; `run_directory`: the nominal run, for title, document number and version; `found`:
    uncertainty.json.
    """
    run = read_run(run_directory)
    run.study = dict(found)
    return write_page(run, folder / "uncertainty.html", lambda draw: _sections(run, draw))


def _sections(run: RunFiles, draw: Any) -> list[Section]:  # noqa: ANN401 - of the report
    """The blocks of the report's section, in three."""
    sections = [Section(key, title) for key, title in _PARTS]
    place = 0
    for block in uncertainty_blocks(run, draw):
        place = max(place, _place_of(block))
        sections[place].blocks.append(block)
    return [section for section in sections if section.blocks]


def _place_of(block: Block) -> int:
    title = getattr(block, "title", "")
    if title.startswith("Uncertain inputs"):
        return 2
    return 1 if title.startswith(("Effect of each", "Share of each", "Exposed sites")) else 0
