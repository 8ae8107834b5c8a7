"""Annex: measured time of the parts of the burst."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.report.blocks import Section, Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.report.reading.run_files import RunFiles

__all__ = ["profile_section"]

_HEAD = ("Part", "Seconds", "Share, %", "Calls", "ns per cell and step")


def profile_section(run: RunFiles) -> Iterator[Section]:
    """The annex of a burst that was computed with `--profile`; nothing for others."""
    burst = run.part("burst")
    if not burst.get("profile"):
        return
    # Those since the burst was begun or resumed, as the times are.
    cell_steps = burst["stepping_seconds"] / burst["seconds_per_cell_step"]
    lines = tuple(
        (
            str(part["part"]),
            f"{part['seconds']:.2f}",
            f"{100.0 * part['share']:.1f}",
            f"{part['calls']:d}",
            f"{1e9 * part['seconds'] / cell_steps:.1f}",
        )
        for part in burst["profile"]
    )
    note = (
        f"Stepping took {burst['stepping_seconds']:.1f} s for {cell_steps:.3g} steps of cells, "
        f"{1e9 * burst['seconds_per_cell_step']:.0f} ns each; "
        f"ranks: {burst['ranks']}, threads of each: {burst['threads']}. "
        "The seconds of a part exclude those of the parts it calls; means over the ranks."
    )
    yield Section(
        "profile", "Time of the burst by part", [Table("Parts of the stepping", _HEAD, lines, note)], annex=True
    )
