"""The report's first page: what was computed, the recommended distance, verdicts, reasons and signatures."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from fragfield.case.conversion.surroundings import air_words, wind_words
from fragfield.hazard.certainty import basis_words, whole_metres
from fragfield.hazard.recommended import parts_words
from fragfield.numbers import Row, number
from fragfield.report.blocks import Block, Card, Cards, Columns, Group, Paragraph, Points, Rows, Section, Signatures
from fragfield.report.findings.reasons import reasons_against, reasons_for
from fragfield.report.tables.attitudes import attitude_sentence
from fragfield.report.tables.exposed_sites import verdict_table
from fragfield.report.tables.rules import prescribed_table
from fragfield.results.rules import DistanceToApply
from fragfield_base.substances import substance_title

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from fragfield.case import CaseTable
    from fragfield.report.blocks import Finding
    from fragfield.report.reading.run_files import RunFiles


def decision_section(run: RunFiles, all_findings: Sequence[Finding]) -> Section:
    """The page on which a decision is taken and signed."""
    trust, doubt = reasons_for(run), reasons_against(run, all_findings)
    blocks: list[Block] = [
        Columns((
            Group((Cards(tuple(_distances(run))), *_prescribed(run))),
            Rows("What was computed", tuple(_what(run))),
        )),
        *verdict_table(run),
        Columns((
            Group((Paragraph("Reasons to trust it", kind="heading"), Points(tuple(trust)))),
            Group((Paragraph("Reasons against", kind="heading"), Points(tuple(doubt)))),
        )),
        _signatures(run),
    ]  # fmt: skip
    return Section("decision", "Decision", blocks)


def _prescribed(run: RunFiles) -> Iterator[Block]:
    """What each distance is by, what was left out, and the prescribed ones."""
    if part := run.part("distance_to_apply"):
        yield Points(DistanceToApply.read(part).words)
    yield from prescribed_table(run)


def _distances(run: RunFiles) -> Iterator[Card]:
    """The distance to apply, and the computed one with its parts in one line."""
    if part := run.part("distance_to_apply"):
        yield Card("Distance to apply", DistanceToApply.read(part).distances, "")
    title, hazard = "Computed: recommended distance", run.summary.hazard
    if hazard is None:
        yield Card(title, "–", "", "not computed")
    elif not hazard.determined:
        yield Card(title, "not determined", "", hazard.reason)
    else:
        note = f"{parts_words(hazard)}. Basis: {basis_words(hazard)}."
        yield Card(title, whole_metres(hazard.recommended), "m", note)


def _what(run: RunFiles) -> Iterator[Row]:
    """The rows of the arrangement and its site."""
    case = run.case
    if run.fragments_file is not None:
        yield Row("Fragments", f"of {run.fragments_file}; no burst was computed")
    else:
        yield from _rounds(run)
    if contents := run.part("rules").get("contents"):
        yield Row(
            "Net explosive quantity",
            f"{number(contents['explosive'], 3)} kg (TNT equivalent {number(contents['tnt'], 3)} kg)",
        )
    if attitude := attitude_sentence(run):
        yield Row("Attitude and height", attitude.removeprefix("Attitude: ").removesuffix("."))
    if case is None:
        return
    yield from _site(case)
    criteria = run.criteria
    yield Row("Criterion", f"{criteria.energy:.3g} J, 1 per {1.0 / criteria.density:.1f} m²")
    if case.burst is not None and run.fragments_file is None:
        size = f"{number(1e3 * case.burst.cell_size, 3)} mm"
        yield Row("Cell size", f"{size}; grid convergence: {case.burst.convergence}")
    if count := run.part("hazard").get("realisations"):
        yield Row("Realisations", number(count))


def _rounds(run: RunFiles) -> Iterator[Row]:
    """Round, fill and casing, each kind once."""
    kinds: dict[tuple[str, str, str], list[str]] = {}
    for item in run.rounds:
        casing, charge = (number(float(item.attributes[f"{part}_mass"]), 3) for part in ("casing", "charge"))
        entry = next((one for one in (run.case.round if run.case else []) if one.name == item.name), None)
        named = getattr(entry, "casing", None)
        material = f" of {getattr(named, 'name', named)}" if named is not None else ""
        fill = f"{substance_title(str(item.attributes['explosive']))}, {charge} kg"
        profile = str(item.attributes.get("profile") or "")
        kinds.setdefault((profile, fill, f"{casing} kg{material}"), []).append(item.name)
    if not kinds:
        yield Row("Round", "this directory contains no burst")
    for (profile, fill, casing), names in kinds.items():
        listed = ", ".join(names) if len(names) <= 4 else f"{names[0]} … {names[-1]} ({len(names)} rounds)"
        yield Row("Round", f"{listed}{f' ({profile})' if profile else ''}{', each' if len(names) > 1 else ''}")
        yield Row("Fill", fill)
        yield Row("Casing", casing)
    if kinds:
        images = sum(bool(item.get("mirror_of")) for item in run.part("break_up").get("rounds") or [])
        behind = f"; {number(images)} more behind planes of symmetry" if images else ""
        yield Row("Number of rounds", f"{number(len(run.rounds))}{behind}")


def _site(case: CaseTable) -> Iterator[Row]:
    ground = case.flight.ground
    ricochet = "no ricochet" if ground.ricochet == "none" else f"ricochet off {ground.ricochet.replace('_', ' ')}"
    yield Row("Ground", f"{'map of heights' if ground.map is not None else 'flat'}, {ricochet}")
    yield Row("Wind", wind_words(case))
    yield Row("Air", air_words(case))
    stops = [f"{one.kind} {one.name}" for one in case.obstacle]
    shown = ", ".join(stops) if len(stops) <= 4 else f"{', '.join(stops[:4])} and {len(stops) - 4} more"
    yield Row("Barricades and buildings", shown or "none")
    if case.site is not None:
        latitude, longitude = (math.degrees(angle) for angle in (case.site.latitude, case.site.longitude))
        yield Row("Site", f"{latitude:.5f}°, {longitude:.5f}°")


def _signatures(run: RunFiles) -> Signatures:
    document = run.document
    return Signatures(
        ("Computed by", "Reviewed by", "Approved by"),
        (document.prepared_by, document.reviewed_by, document.approved_by),
    )
