"""Recommended, official and prescribed distances beside each other, for the first page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.hazard.certainty import whole_metres
from fragfield.hazard.prescribed import USES, official_note
from fragfield.report.blocks import Table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from fragfield.report.reading.run_files import RunFiles

__all__ = ["minimum_words", "prescribed_table"]

_OFFICIAL = (
    ("hazardous_fragment_distance", "Official hazardous fragment distance"),
    ("maximum_fragment_distance", "Official maximum fragment distance"),
)


def minimum_words(run: RunFiles) -> Iterator[str]:
    """For each activity the distance not to go below; none for a run of a former version."""
    minimum = run.part("minimum")
    if not minimum:
        return
    for use, title in USES.items():
        if minimum[use]["distance"] is not None:
            distance, by = whole_metres(minimum[use]["distance"]), minimum[use]["by"]
            yield f"{title[0].upper()}{title[1:]}: do not apply less than {distance} m, by {by}."


def prescribed_table(run: RunFiles) -> Iterator[Table]:
    """Distances that an authority publishes for the round, and the largest rule in range of each kind."""
    if not run.part("minimum"):
        return
    official, listed = run.part("official"), run.part("rules").get("rules") or ()
    lines = [
        (label, whole_metres(official[key]), official["source"])
        for key, label in _OFFICIAL
        if official.get(key) is not None
    ]
    for use, title in USES.items():
        inside = [rule for rule in listed if rule.get("use") == use and rule["distance"] is not None]
        for against in ("fragments", "blast"):
            lines += _largest([rule for rule in inside if rule["hazard"] == against], f"{title}, {against}")
    note = official_note(official) if official else "No official distance of the round is in the case ([official])."
    yield Table("Prescribed distances", ("Prescribed for", "m", "By"), tuple(lines), note)


def _largest(rules: list[Mapping[str, object]], what: str) -> Iterator[tuple[str, str, str]]:
    """The rule of the largest distance, as a line of the table."""
    if rules:
        rule = max(rules, key=lambda one: float(str(one["distance"])))
        yield f"{what[0].upper()}{what[1:]}", whole_metres(float(str(rule["distance"]))), str(rule["name"])
