"""Hits on walls, barricades and buildings, by face."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.case.conversion.surroundings import direction_words
from fragfield.numbers import number
from fragfield.report.blocks import Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.report.reading.run_files import RunFiles

__all__ = ["obstacle_tables"]

_HEAD = ("Face", "Looks to", "Hits", "Hazardous", "Stopped", "Stopped mass (kg)", "Largest energy (J)")


def obstacle_tables(run: RunFiles) -> Iterator[Table]:
    """One table an obstacle, one row a face."""
    for obstacle in run.summary.get("obstacle") or []:
        lines = [(str(face.get("face", "")), _direction(face), *_counts(face)) for face in obstacle.get("faces") or []]
        lines.append(("all", "", *_counts(obstacle)))
        note = (
            "First realisation. The direction is that of the face's outward normal. Fragments stopped here are not "
            "counted on the ground."
        )
        name = f"Hits on {obstacle.get('kind', 'obstacle')} “{obstacle.get('name', '')}”"
        yield Table(name, _HEAD, tuple(lines), note)


def _direction(face: dict[str, Any]) -> str:
    azimuth = face.get("azimuth_deg")
    return "up" if azimuth is None else direction_words(azimuth, face.get("bearing_deg"), whole=True)


def _counts(part: dict[str, Any]) -> tuple[str, ...]:
    whole = [number(part.get(key)) for key in ("hits", "hazardous_hits", "stopped")]
    return (*whole, number(part.get("stopped_mass"), 4), number(part.get("max_energy"), 4))
