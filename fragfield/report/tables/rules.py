"""Published rules, compared with the computed distance."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.hazard.certainty import whole_metres
from fragfield.hazard.prescribed import USES
from fragfield.report.blocks import Paragraph, Points, Table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from fragfield.report.blocks import Block
    from fragfield.report.reading.run_files import RunFiles

__all__ = ["rule_tables"]


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
