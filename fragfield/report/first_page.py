"""The report's first section: the recommended distance, its basis, and the limits of validity."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.hazard.certainty import basis_words, ricochet_words, rounded_metres, whole_metres
from fragfield.hazard.recommended import parts_words
from fragfield.report.blocks import (
    Block,
    Card,
    Cards,
    Paragraph,
    Points,
    Section,
)
from fragfield.report.findings import statements
from fragfield.report.quantities import SPACE, explosive_title, number
from fragfield.report.reading.landings import landings
from fragfield.report.tables.attitudes import attitude_sentence
from fragfield.report.tables.distances import density_table
from fragfield.report.tables.exposed_sites import verdict_table
from fragfield.report.tables.prescribed import prescribed_blocks

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.figure import Figure

    from fragfield.report.blocks import Finding, Illustration
    from fragfield.report.reading.run_files import RunFiles

    Draw = Callable[[str, str, str, Callable[[RunFiles, bool], Figure | None]], list[Illustration]]
    Picture = Callable[[str, str, str], list[Block]]

__all__ = ["summary_section"]


def summary_section(run: RunFiles, all_findings: Sequence[Finding]) -> Section:
    """The first section: cards with the distances, verdicts, limits of validity."""
    burst = run.part("burst")
    found = landings(run)
    graver = sum(item.weight == "stop" for item in all_findings), sum(item.weight == "warning" for item in all_findings)
    cards = _distances(run)
    if found is not None:
        count = int(found.hazardous.sum())
        cards.append(
            Card("Hazardous fragments", number(count), "", f"of {number(len(found.x))} that landed, first realisation")
        )
    for label, name, note in (
        ("Mean initial speed", "mean_initial_speed", "of the casing, by mass"),
        ("Speed of 99 % of the mass", "speed_99", "not exceeded by 99 % of the casing's mass"),
        ("Largest initial speed", "max_initial_speed", "largest cell mean; increases as cells get smaller"),
    ):
        value = (burst.get("speed_quantiles") or {}).get("99") if name == "speed_99" else burst.get(name)
        if isinstance(value, (int, float)):
            cards.append(Card(label, number(round(value)), "m/s", note))
    blocks: list[Block] = [
        Paragraph(" ".join(words for words in (_sentence(run), attitude_sentence(run)) if words)),
        Cards(tuple(cards)),
        *_caution(*graver),
    ]
    if "flight" not in run.missing:
        blocks += [
            *prescribed_blocks(run),
            *verdict_table(run),
            Paragraph(statements.summary_terms(run)),
            *density_table(run),
        ]
    blocks += [Paragraph("Limits of validity", kind="heading"), Points(statements.limits(run))]
    return Section("summary", "Summary for the safety engineer", blocks)


def _caution(stops: int, warnings: int) -> list[Block]:
    """The word that warnings stand in the next section, before anything is read out of the numbers."""
    parts = []
    if stops:
        parts.append("one reason not to use this result" if stops == 1 else f"{stops} reasons not to use this result")
    if warnings:
        parts.append("one warning" if warnings == 1 else f"{warnings} warnings")
    if not parts:
        return []
    return [Paragraph(f"Read first, in the next section: {' and '.join(parts)}.", kind="caution")]


def _distances(run: RunFiles) -> list[Card]:
    """The recommended distance first, then what it must not be mistaken for."""
    hazard = run.part("hazard")
    if not hazard:
        return [Card("Recommended distance", "–", "", "not computed")]
    if not hazard["determined"]:
        return [Card("Recommended distance", "not determined", "", hazard["reason"])]
    number_of = f"{number(hazard['realisations'])} realisation{'s' if hazard['realisations'] > 1 else ''}"
    note = f"{parts_words(hazard)}; {number_of}; {basis_words(hazard)}"
    cards = [_distance("Recommended distance", hazard["recommended"], note)]
    if short := hazard.get("without_ricochet"):
        note = f"beside it, {ricochet_words(hazard).partition(';')[0]}"
        cards.append(_distance("The same without ricochet", short["recommended"], note))
    single = hazard["single_event"]
    span = f"{rounded_metres(single['low'])}{SPACE}–{SPACE}{rounded_metres(single['high'])}"
    return [
        *cards,
        Card("Single events, 5 to 95 %", span, "m", "no distance to keep: range of the distances of single events"),
        _distance("Largest throw", hazard["largest_throw"], "no distance to keep: the farthest single fragment"),
    ]


def _distance(label: str, value: object, note: str) -> Card:
    if not isinstance(value, (int, float)):
        return Card(label, "–", "", "not computed")
    return Card(label, whole_metres(value), "m", note)


def _sentence(run: RunFiles) -> str:
    kinds: dict[str, list[str]] = {}
    for item in run.rounds:
        casing, charge = (number(float(item.attributes[f"{part}_mass"]), 3) for part in ("casing", "charge"))
        what = f"{charge} kg {explosive_title(str(item.attributes['explosive']))} in {casing} kg of casing"
        kinds.setdefault(what, []).append(item.name)
    if run.fragments_file is not None:
        recovered = run.part("flight").get("recovered")
        words = f" {recovered['words'][0].upper()}{recovered['words'][1:]}." if recovered else ""
        return f"Computed for the fragments of {run.fragments_file}; no burst was computed.{words}"
    if not kinds:
        return "This directory contains no burst; the rounds are described in the annex."
    many = "one round" if len(run.rounds) == 1 else f"{len(run.rounds)} rounds"
    listed = "; ".join(f"{_names(names)} ({what}{' each' if len(names) > 1 else ''})" for what, names in kinds.items())
    images = sum(bool(item.get("mirror_of")) for item in run.part("break_up").get("rounds") or [])
    behind = f" With {number(images)} more behind planes of symmetry." if images else ""
    return f"Computed for {many}: {listed}.{behind}"


def _names(names: list[str]) -> str:
    """Names of rounds, the middle ones of many left out."""
    return ", ".join(names) if len(names) <= 4 else f"{names[0]} … {names[-1]} ({len(names)} rounds)"
