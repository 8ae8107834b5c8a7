"""A burst in a plane section: its description, and the directions of its casings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.report.blocks import Paragraph, Rows, Table
from fragfield.report.quantities import number, row

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.report.blocks import Block
    from fragfield.report.reading.run_files import RunFiles

__all__ = ["CAUTION", "WORDS", "section_blocks"]

WORDS = "plane section: no axial flow"
"""What every page says of such a burst."""

CAUTION = (
    "Plane section: no axial flow. Every round's section is initiated everywhere at once; masses, momenta and "
    "energies are per metre "
    "of the rounds. For quick studies of directions and speeds: no break-up, flight or hazard distance follows."
)


def section_blocks(run: RunFiles) -> Iterator[Block]:
    """What the section is, its focus, and mass and speed by azimuth; nothing for other bursts."""
    found = run.part("burst").get("section")
    if not run.is_section or not found:
        return
    yield Paragraph(CAUTION)
    rounds = run.part("burst").get("rounds") or []
    rows = [
        row("Torn metal, in kg per metre", found["torn_mass"], "kg", "folded, released or stretched without strength")
    ]
    for entry in rounds:
        rows.append(row(f"Station of {entry['name']}", entry["section_station"], "m", "from the nose"))
        rows.append(
            row(f"Ignition of {entry['name']}", entry["section_ignition"], "s", "when the front reaches the axis")
        )
    focus = found.get("focus")
    if focus:
        rows.append(row("Azimuth of the focus", focus["azimuth_deg"], "°", "from u to v, and its opposite"))
        for width, ratio in focus["mass_ratio"].items():
            rows.append(
                row(f"Mass within {width}° of the focus", ratio, "", "per degree, over that beyond 60°", digits=3)
            )
        rows.append(row("Speed of 99 % of the mass within 5°", focus["speed_99_percent"], "m/s"))
        rows.append(row("Largest speed within 5°", focus["max_speed"], "m/s", "grows as cells get smaller"))
        rows.append(
            row("Largest speed of whole metal within 5°", focus["max_speed_of_whole"], "m/s", "torn cells left out")
        )
        rows.append(row("Mean speed beyond 60°", focus["undisturbed_speed"], "m/s"))
    yield Rows("Plane section", tuple(rows))
    lines = [
        (
            number(entry["azimuth_deg"]),
            number(entry["mass"], 4),
            number(entry["momentum"], 4),
            number(entry["max_speed"], 4),
        )
        for entry in found["by_azimuth"]
    ]
    yield Table(
        "Casing by azimuth of flight, per metre", ("Azimuth °", "kg/m", "kg m/s per m", "Fastest m/s"), tuple(lines)
    )
