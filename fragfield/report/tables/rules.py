"""Published rules, compared with the computed distance."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.hazard.certainty import whole_metres
from fragfield.hazard.to_apply import USES
from fragfield.report.blocks import Paragraph, Points, Table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from fragfield.report.blocks import Block
    from fragfield.report.reading.run_files import RunFiles


def rule_tables(run: RunFiles) -> Iterator[Block]:
    """The computed distance, every rule's distance, and what each rests on."""
    part = run.part("rules")
    rules = part.get("rules") or []
    if not rules:
        return
    hazard = run.part("hazard")
    own = hazard.get("recommended")
    known = own is not None and hazard.get("determined")
    lines = [
        (
            "Recommended distance, this computation",
            "fragments",
            whole_metres(own) if known else "–",
            "–",
            "computed from the burst",
        )
    ]
    lines += [
        (
            rule["name"],
            rule["hazard"],
            whole_metres(rule["distance"]),
            USES.get(rule.get("use", ""), "comparison"),
            _based(rule),
        )
        for rule in rules
    ]
    note = (
        "Rules from mass alone account neither for this round nor for this site. Those of TP-12 take the fragments of "
        "one round alone, without its attitude, height and site. “–”: the rule does not apply to this arrangement, "
        "for the reason in the last column. Sources, formulas, inputs and ranges follow."
    )
    yield Table(
        "Distances by rules, compared with the computed one",
        ("Rule", "Against", "Distance (m)", "For", "Based on"),
        tuple(lines),
        note,
    )
    yield Points(
        tuple(
            f"{rule['name']}: {rule['formula']}; {rule['inputs']}; range: {rule['range']}. Source: {rule['source']}."
            for rule in rules
        )
    )
    yield Paragraph("Rules left out", kind="heading")
    yield Points(tuple(part.get("left_out") or ()))


def _based(rule: Mapping[str, str]) -> str:
    """What a rule rests on, or why it does not apply."""
    if rule.get("reason"):
        return f"does not apply: {rule['reason']}"
    return f"{rule['basis']}; not from the burst" if rule["hazard"] == "blast" else rule["basis"]


_OFFICIAL = (
    ("hazardous_fragment_distance", "Official hazardous fragment distance"),
    ("maximum_fragment_distance", "Official maximum fragment distance"),
)


def prescribed_table(run: RunFiles) -> Iterator[Table]:
    """Distances that an authority publishes for the round, and the largest rule in range of each kind."""
    if not run.part("distance_to_apply"):
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
    yield Table("Prescribed distances", ("Prescribed for", "m", "By"), tuple(lines))


def _largest(rules: list[Mapping[str, object]], what: str) -> Iterator[tuple[str, str, str]]:
    """The rule of the largest distance, as a line of the table."""
    if rules:
        rule = max(rules, key=lambda one: float(str(one["distance"])))
        yield f"{what[0].upper()}{what[1:]}", whole_metres(float(str(rule["distance"]))), str(rule["name"])
