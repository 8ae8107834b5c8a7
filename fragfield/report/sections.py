"""The sections of the report in their order, from a run's files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.hazard.certainty import WHICH_NUMBER, basis_words, whole_metres
from fragfield.report.blocks import (
    Beside,
    Block,
    Card,
    Cards,
    Findings,
    Paragraph,
    Points,
    Section,
    Signatures,
    Text,
)
from fragfield.report.figures import burst as burst_figures
from fragfield.report.figures import fragments as fragment_figures
from fragfield.report.figures import hazard as hazard_figures
from fragfield.report.figures import site as site_figure
from fragfield.report.findings import statements
from fragfield.report.findings.findings import findings
from fragfield.report.findings.validation_status import read_record, validation_blocks
from fragfield.report.quantities import SPACE, number
from fragfield.report.reading.landings import landings
from fragfield.report.tables import zones as zone_blocks
from fragfield.report.tables.convergence import convergence_figure, convergence_tables
from fragfield.report.tables.distances import density_table, distance_table, sector_table, stack_rule_table
from fragfield.report.tables.exposed_sites import exposed_tables, verdict_table
from fragfield.report.tables.ignition import ignition_table
from fragfield.report.tables.inputs import input_tables
from fragfield.report.tables.obstacles import obstacle_tables
from fragfield.report.tables.plane_section import CAUTION, section_blocks
from fragfield.report.tables.profile import profile_section
from fragfield.report.tables.rounds import (
    arrangement_table,
    broken_rounds_table,
    contact_rows,
    round_table,
    segment_table,
)
from fragfield.report.tables.rules import rule_tables
from fragfield.report.tables.shock_exposure import exposure_table
from fragfield.report.tables.stages import (
    azimuth_tables,
    break_up_rows,
    burst_rows,
    flight_rows,
    hazard_rows,
    ledger_table,
    mesh_rows,
    provenance_rows,
)
from fragfield.report.tables.uncertainty import signed_card, uncertainty_section
from fragfield.report.tables.zones import zone_table

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.figure import Figure

    from fragfield.case.tables.document import DocumentTable
    from fragfield.report.blocks import Finding, Illustration
    from fragfield.report.reading.run_files import RunFiles

    Draw = Callable[[str, str, str, Callable[[RunFiles, bool], Figure | None]], list[Illustration]]
    Picture = Callable[[str, str, str], list[Block]]

__all__ = ["sections"]


def sections(run: RunFiles, draw: Draw, picture: Picture) -> list[Section]:
    """All sections in order.

    Parameters
    ----------
    run : RunFiles
        The run.
    draw : callable
        Makes a figure from its name, title, caption and drawing function; an empty list where there is no data.
    picture : callable
        Makes one of the off-screen pictures from its name, title and caption, alike.
    """
    found = tuple(findings(run))
    return [
        _summary(run, found),
        Section("warnings", "Warnings and checks", [Findings(found)]),
        *(_of_burst(run, draw, picture) if "burst" in run.stages else []),
        _break_up(run, draw, picture),
        _flight(run, draw),
        _hazard(run, draw),
        *([_convergence(run, draw)] if "burst" in run.stages else []),
        *uncertainty_section(run, draw),
        Section(
            "tables", "Tables by azimuth", _stage(run, "flight", lambda: [*azimuth_tables(run), *sector_table(run)])
        ),
        _validation(run),
        _provenance(run),
        _use(),
        _signatures(run),
        _inputs(run),
        *profile_section(run),
    ]


def _of_burst(run: RunFiles, draw: Draw, picture: Picture) -> list[Section]:
    """What only a run with a burst of its own has."""
    found = [
        Section("mesh", "Mesh and its quality", _stage(run, "burst", lambda: [mesh_rows(run)])),
        _ledger(run, draw),
        _burst(run, draw, picture),
    ]
    arrangement: list[Block] = [*arrangement_table(run)]
    return [Section("arrangement", "Arrangement of the rounds", arrangement), *found] if arrangement else found


def _inputs(run: RunFiles) -> Section:
    """The annex: every input that took part, and the case's own text."""
    blocks: list[Block] = []
    if run.case is not None:
        note = "Keys that take no part in this run (those of other choices) stand in case.toml alone."
        blocks += [Paragraph(note), *input_tables(run), Text("case.toml, as resolved", run.case_text)]
    else:
        blocks.append(Paragraph("This directory holds no case."))
    return Section("inputs", "Annex: inputs as resolved", blocks)


def _stage(run: RunFiles, stage: str, blocks: Callable[[], list[Block]]) -> list[Block]:
    """The blocks of a stage, or the word that it has not been run."""
    if stage in run.missing:
        return [Paragraph(f"Not computed: the stage “{stage}” has not been run in this directory.")]
    return blocks()


def _summary(run: RunFiles, all_findings: Sequence[Finding]) -> Section:
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
        ("Largest initial speed", "max_initial_speed", "largest mean of a cell; grows as cells get smaller"),
    ):
        value = (burst.get("speed_quantiles") or {}).get("99") if name == "speed_99" else burst.get(name)
        if isinstance(value, (int, float)):
            cards.append(Card(label, number(round(value)), "m/s", note))
    blocks: list[Block] = [
        Paragraph(_sentence(run)),
        *([Paragraph(CAUTION)] if run.is_section else []),
        Cards(tuple(cards)),
        *_caution(*graver),
    ]
    if "flight" not in run.missing:
        blocks += [
            *verdict_table(run),
            Paragraph(statements.summary_terms(run)),
            Paragraph(WHICH_NUMBER),
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
    """The hazard distance first, then what it must not be mistaken for."""
    hazard = run.part("hazard")
    if not hazard:
        return [Card("Hazard distance", "–", "", "not computed")]
    if not hazard["determined"]:
        return [Card("Hazard distance", "not determined", "", hazard["reason"])]
    number_of = f"{number(hazard['realisations'])} realisation{'s' if hazard['realisations'] > 1 else ''}"
    where = basis_words(hazard)
    if hazard["upper"] is None:
        cards = [_distance("Hazard distance", hazard["distance"], f"no upper bound: {number_of}; {where}")]
    else:
        error = f"standard error {hazard['standard_error']:.2g}{SPACE}m, {number_of}"
        cards = [
            _distance("Hazard distance, upper bound (95 %)", hazard["upper"], f"the distance to apply; {where}"),
            _distance("Distance of the expected density", hazard["distance"], error),
        ]
    single = hazard["single_event"]
    span = f"{whole_metres(single['low'])}{SPACE}–{SPACE}{whole_metres(single['high'])}"
    return [
        *cards,
        *signed_card(run),
        Card("Single events, 5 to 95 %", span, "m", "no hazard distance: what one event's own density reaches"),
        _distance("Largest throw", hazard["largest_throw"], "no hazard distance: the farthest single fragment"),
    ]


def _distance(label: str, value: object, note: str) -> Card:
    if not isinstance(value, (int, float)):
        return Card(label, "–", "", "not computed")
    return Card(label, whole_metres(value), "m", note)


def _sentence(run: RunFiles) -> str:
    kinds: dict[str, list[str]] = {}
    for item in run.rounds:
        casing, charge = (number(float(item.attributes[f"{part}_mass"]), 3) for part in ("casing", "charge"))
        what = f"{charge} kg {item.attributes['explosive']} in {casing} kg of casing"
        kinds.setdefault(what, []).append(item.name)
    if run.fragments_file is not None:
        return f"Computed for the fragments of {run.fragments_file}; no burst was computed."
    if not kinds:
        return "The burst is not part of this directory; the rounds are described in the annex."
    many = "one round" if len(run.rounds) == 1 else f"{len(run.rounds)} rounds"
    listed = "; ".join(f"{_names(names)} ({what}{' each' if len(names) > 1 else ''})" for what, names in kinds.items())
    images = sum(bool(item.get("mirror_of")) for item in run.part("break_up").get("rounds") or [])
    behind = f" With {number(images)} more behind planes of symmetry." if images else ""
    return f"Computed for {many}: {listed}.{behind}"


def _names(names: list[str]) -> str:
    """Names of rounds, the middle ones of many left out."""
    return ", ".join(names) if len(names) <= 4 else f"{names[0]} … {names[-1]} ({len(names)} rounds)"


def _ledger(run: RunFiles, draw: Draw) -> Section:
    blocks: Callable[[], list[Block]] = lambda: [  # noqa: E731
        *draw(
            "energy_ledger", "Energy ledger over time",
            "Work of the products and where it went; below, what the sum leaves open.", burst_figures.energy_ledger,
        ),
        *ledger_table(run),
    ]  # fmt: skip
    return Section("ledger", "Energy ledger", _stage(run, "burst", blocks))


def _burst(run: RunFiles, draw: Draw, picture: Picture) -> Section:
    blocks: Callable[[], list[Block]] = lambda: [  # noqa: E731
        *burst_rows(run),
        *section_blocks(run),
        *picture(
            "picture_of_burst", "Section of the burst",
            "Section through the axis, looked at along +y, coloured by speed: light is fast, dark is slow. The thin "
            "line bounds the casing.",
        ),
        *draw(
            "speed_along_round", "Speed along the round",
            "Casing speed at the end of the burst against the station from the nose, as a fraction of the length: "
            "mean by mass, and largest cell, of each axial bin. Dotted lines part the segments.",
            burst_figures.speed_along_round,
        ),
        *draw(
            "casing_over_time", "Casing over time",
            "Mean speed of the casing by mass, and the largest over the stations of the azimuthal mean outer diameter. "
            "A dotted upright marks the time at which acceleration is complete.",
            burst_figures.casing_over_time,
        ),
        *contact_rows(run),
        *ignition_table(run),
        *exposure_table(run),
        *round_table(run),
    ]  # fmt: skip
    return Section("burst", "Burst", _stage(run, "burst", blocks))


def _break_up(run: RunFiles, draw: Draw, picture: Picture) -> Section:
    own = run.fragments_file is None
    blocks: Callable[[], list[Block]] = lambda: [  # noqa: E731
        *break_up_rows(run),
        *broken_rounds_table(run),
        *draw(
            "number_by_mass", "Number of fragments by mass",
            "Number of fragments heavier than m against the root of m (upper figures; lower figures: m)"
            + (": law (lines) and sample (circles), in total and by segment." if own else ", first realisation."),
            fragment_figures.number_by_mass,
        ),
        *draw(
            "directions", "Directions of the mass",
            "Share of the first round's mass by direction of flight at the end of the burst: fragments of the first "
            "realisation (bars) and the velocity field of the casing that they were made from (line).",
            fragment_figures.directions,
        ),
        *draw(
            "polar_zones", "Fragments by polar zone",
            "Numbers and speeds of one round's fragments at launch by angle from the nose, as arena tests report them.",
            zone_blocks.zone_figure,
        ),
        *zone_table(run),
        *picture(
            "picture_of_fragments", "Fragment cloud",
            f"Fragments 100 µs after {'the end of the burst' if own else 'launch'}, drag neglected, coloured by "
            "initial speed. Spheres stand for the mass, not to scale; shapes are not known.",
        ),
        *segment_table(run),
    ]  # fmt: skip
    return Section("break-up", "Break-up" if own else "Fragments", _stage(run, "break-up", blocks))


def _flight(run: RunFiles, draw: Draw) -> Section:
    blocks: Callable[[], list[Block]] = lambda: [  # noqa: E731
        *flight_rows(run),
        *obstacle_tables(run),
        *draw(
            "by_azimuth", "Number and speed by azimuth",
            "Fragments that cross the witness surface, by the azimuth of the crossing: number, and initial speed.",
            fragment_figures.by_azimuth,
        ),
        *draw(
            "polar_by_sector", "Number and speed around the rounds",
            "The same over all realisations: median and band of 5 to 95 % by sector, azimuth counted from +x "
            "counter-clockwise, seen from above.",
            hazard_figures.polar_by_sector,
        ),
        *draw(
            "landing_map", "Landing points",
            "Where the fragments of the first realisation touch the ground; dark: hazardous. Seen from above, y "
            "upwards. The line of hazard is the upper bound of the hazard distance by direction.",
            hazard_figures.landing_map,
        ),
    ]  # fmt: skip
    return Section("flight", "Flight", _stage(run, "flight", blocks))


def beside_map(run: RunFiles) -> list[Block]:
    """The map with pan and zoom, beside the page, where there is something to show."""
    if site_figure.site_shapes(run) is None:
        return []
    return [Beside("map.html", "The map with pan and zoom; it needs no network")]


def _hazard(run: RunFiles, draw: Draw) -> Section:
    blocks: Callable[[], list[Block]] = lambda: [  # noqa: E731
        *distance_table(run),
        *stack_rule_table(run),
        *exposed_tables(run),
        *draw(
            "exposed_places", "Exposed places against their criteria",
            "Expected value (dot) and upper bound (95 %, bar) over what the place may meet; to the left of the "
            "line the criterion is met.",
            site_figure.exposed_figure,
        ),
        *draw(
            "site_map", "Map of the site",
            "Hazard distance by direction, exposed places by their verdict, barricades and buildings, and lines of "
            "equal height, in the site's frame.",
            site_figure.site_figure,
        ),
        *beside_map(run),
        *rule_tables(run),
        *hazard_rows(run),
        *draw(
            "density_curve", "Density by distance",
            "Expected number of hazardous fragments per acceptable area, by area of ground and normal to the paths, "
            "over all azimuths or in the worst direction, with 5 to 95 % of the bootstrap: the certainty of the mean, "
            "not the scatter of single events. The uprights mark the hazard distance and its upper bound.",
            hazard_figures.density_curve,
        ),
        *draw(
            "hit_probability", "Probability of a hit on a person",
            "Probability that a hazardous fragment hits a person who stands at that distance, at a random azimuth: "
            "mean of the realisations and band of single events.",
            hazard_figures.hit_probability,
        ),
        *draw(
            "distance_by_azimuth", "Distances by azimuth",
            "Hazard distance by direction, as its upper bound and by the expected density; and, no hazard distance, "
            "the farthest fragment of each sector: median and band of single events.",
            hazard_figures.distance_by_azimuth,
        ),
    ]  # fmt: skip
    return Section("hazard", "Hazard", _stage(run, "flight", blocks))


def _convergence(run: RunFiles, draw: Draw) -> Section:
    blocks: Callable[[], list[Block]] = lambda: [  # noqa: E731
        *convergence_tables(run),
        *draw(
            "grid_convergence", "Values by cell size",
            "Each value over that of this run (upright), with its statistical error; open circles at zero: "
            "limits, where an order was observed.",
            convergence_figure,
        ),
    ]  # fmt: skip
    return Section("convergence", "Grid convergence", _stage(run, "flight", blocks))


def _validation(run: RunFiles) -> Section:
    version, revision = (run.provenance.get(key, "") for key in ("program_version", "revision"))
    blocks = list(validation_blocks(read_record(), version, revision))
    return Section("validation", "Validation of this version", blocks)


def _provenance(run: RunFiles) -> Section:
    blocks: list[Block] = [*provenance_rows(run)]
    return Section("provenance", "Provenance", blocks)


def _use() -> Section:
    return Section(
        "use",
        "What this result may be used for",
        [
            Paragraph("It may be used for", kind="heading"),
            Points(statements.MAY_BE_USED_FOR),
            Paragraph("It must not be used for", kind="heading"),
            Points(statements.MUST_NOT_BE_USED_FOR),
        ],
    )


def _signatures(run: RunFiles) -> Section:
    document = run.document
    changes = [*_changes(document)]
    return Section(
        "signatures",
        "Signatures",
        [
            Paragraph(
                "By signing, the reviewer confirms to have read the warnings, the limits and the inputs (annex)."
            ),
            Signatures(
                ("Computed by", "Reviewed by", "Approved by"),
                (document.prepared_by, document.reviewed_by, document.approved_by),
            ),
            *changes,
        ],
    )


def _changes(document: DocumentTable) -> list[Block]:
    if not document.changes:
        return []
    head = f"Changes of revision {document.revision}" if document.revision else "Changes of this revision"
    return [Paragraph(head, kind="heading"), Points(tuple(document.changes))]
