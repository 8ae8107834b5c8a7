"""Exposed sites: the verdicts for the first page, and all numbers for the hazard section."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.case.conversion.surroundings import direction_words
from fragfield.hazard.certainty import margin_metres, rounded_metres
from fragfield.hazard.verdict import criterion_words, part_text
from fragfield.numbers import SPACE, number
from fragfield.report.blocks import Paragraph, Table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from fragfield.report.blocks import Block
    from fragfield.report.reading.run_files import RunFiles
    from fragfield.results.site import ExposedSite


_GRAVEST = ("not met", "not determined", "not shown", "met")
_MOST_SITES = 8
"""Sites that the first page shows."""


def exposed_entries(run: RunFiles) -> Sequence[ExposedSite]:
    """The entries `exposed` of summary.json; none where the case has no exposed sites."""
    return run.summary.exposed or ()


def verdict_table(run: RunFiles) -> Iterator[Block]:
    """What the safety engineer decides on, one line a site."""
    entries = exposed_entries(run)
    if not entries:
        return
    lines = [
        (
            entry["name"],
            f"{rounded_metres(entry['distance'])}{SPACE}m, "
            + direction_words(entry["azimuth_deg"], entry["bearing_deg"], whole=True),
            entry["verdict"],
            criterion_words(entry),
            part_text(entry),
        )
        for entry in sorted(entries, key=lambda one: _GRAVEST.index(one["verdict"]))[:_MOST_SITES]
    ]
    head = ("Exposed site", "Nearest edge", "Verdict", "Criterion", "Part of it")
    left = len(entries) - len(lines)
    note = (
        "Part: upper bound (95 %) of the expected value over the site's limit. “Not shown”: the expected value meets "
        "the criterion, its bound does not."
        + (f" {number(left)} more sites are in the annex, none of a graver verdict." if left > 0 else "")
    )
    yield Table("Exposed sites", head, tuple(lines), note)


def exposed_tables(run: RunFiles) -> Iterator[Block]:
    """All numbers of every site, and how walls were judged."""
    entries = exposed_entries(run)
    if not entries:
        return
    lines = [
        (
            f"{entry['name']} ({entry['kind']})",
            _bounded(entry["density_normal"], 55.7),
            _bounded(entry["density_ground"], 55.7),
            _bounded(entry["expected_hits"]),
            _bounded(entry["probability"]),
            margin_metres(entry["margin"]),
            _few(entry["largest_energy"]),
            number(entry["places"]),
        )
        for entry in entries
    ]
    head = ("Exposed site", "Density normal to the path, per 55.7 m²", "On the ground, per 55.7 m²", "Expected hits", "Probability of one or more", "Margin by density (m)", "Largest energy (J)", "Places")  # fmt: skip  # noqa: E501
    sheltered = "; ".join(f"{entry['name']}: {entry['no_margin']}" for entry in entries if entry["no_margin"])
    note = (
        f"Expected value and, after it, its upper bound (95 %), over {number(entries[0]['realisations'])} "
        "realisations, along the computed paths: barricades, terrain and obstacles shield. Of a site in the open the "
        "worst place of the size of a person or a vehicle counts; where all azimuths are alike, densities are those "
        "over all azimuths. Hits on people and vehicles: assuming that all are present; on a building: on its walls "
        "and roof. Margin: from the nearest edge to the line of the expected density (its bound by direction), "
        "negative inside." + (f" Without a margin: {sheltered}." if sheltered else "")
    )
    yield Table("Exposed sites, all numbers", head, tuple(lines), note)
    yield from _walls(entries)


def _walls(entries: Sequence[ExposedSite]) -> Iterator[Block]:
    judged = [entry for entry in entries if entry["not_stopped"]]
    if not judged:
        return
    lines = [
        (
            entry["name"],
            _bounded(entry["expected_hits"]),
            _bounded(entry["not_stopped"]),
            _bounded(entry["not_stopped"]["probability"]),
        )
        for entry in judged
    ]
    head = ("Building", "Hazardous hits", "Of those not shown to be stopped", "Probability of one or more of these")
    yield Table("Walls and roofs", head, tuple(lines))
    sources = sorted({source for entry in judged for source in entry["barrier"].values()})
    yield Paragraph(
        "Stopped or not, for protection alone: impact taken as normal to the wall, the fragment as a compact cylinder "
        f"with the sharpest nose. By {'; '.join(sources)}. What lies outside a relation's range counts as not stopped."
    )


def _bounded(value: Mapping[str, float | None] | None, scale: float = 1.0) -> str:
    if not value or value["expected"] is None or value["upper"] is None:
        return "–"
    return f"{_few(scale * value['expected'])};{SPACE}{_few(scale * value['upper'])}"


def _few(value: float | None) -> str:
    """Two digits, however small."""
    if value is None:
        return "–"
    return "0" if value <= 0.0 else number(float(f"{value:.2g}"), 2)


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
