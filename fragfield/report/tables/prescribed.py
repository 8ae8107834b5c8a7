"""Computed, official and prescribed distances beside each other, for the first page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.hazard.certainty import whole_metres
from fragfield.hazard.contents import quantity_words
from fragfield.hazard.prescribed import USES
from fragfield.report.blocks import Paragraph, Points, Table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from fragfield.report.blocks import Block
    from fragfield.report.reading.run_files import RunFiles

__all__ = ["prescribed_blocks"]

_OFFICIAL = (
    ("hazardous_fragment_distance", "Official, hazardous fragments"),
    ("maximum_fragment_distance", "Official, farthest fragment"),
)


def prescribed_blocks(run: RunFiles) -> Iterator[Block]:
    """Table of the distances, net explosive quantity, and which not to go below; none for a run of a former version."""
    if not run.part("minimum"):
        return
    minimum, official, rules = run.part("minimum"), run.part("official"), run.part("rules")
    listed = rules.get("rules") or ()
    recommended = run.part("hazard").get("recommended")
    lines = [("Recommended distance", whole_metres(recommended, "not determined"), "this computation")]
    lines += [
        (label, whole_metres(official[key]), official["source"])
        for key, label in _OFFICIAL
        if official.get(key) is not None
    ]
    for use, title in USES.items():
        inside = [rule for rule in listed if rule.get("use") == use and rule["distance"] is not None]
        for against in ("fragments", "blast"):
            lines += _largest([rule for rule in inside if rule["hazard"] == against], f"{title}, {against}")
    for use, title in USES.items():
        if minimum[use]["distance"] is not None:
            lines.append(
                (f"Do not apply less than: {title}", whole_metres(minimum[use]["distance"]), minimum[use]["by"])
            )
    yield Table("Prescribed distances", ("Distance", "m", "By"), tuple(lines))
    if contents := rules.get("contents"):
        words = quantity_words(contents["explosive"], contents["tnt"], contents["equivalents"])
        yield Paragraph(f"{words[0].upper()}{words[1:]}.")
    yield Points(tuple(minimum["words"]))


def _largest(rules: list[Mapping[str, object]], what: str) -> Iterator[tuple[str, str, str]]:
    """The rule of the largest distance, as a line of the table."""
    if rules:
        rule = max(rules, key=lambda one: float(str(one["distance"])))
        yield f"Rules in range, {what}", whole_metres(float(str(rule["distance"]))), str(rule["name"])
