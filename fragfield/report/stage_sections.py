"""The sections of the stages: ledger, burst, break-up, flight, hazard, grid convergence."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.report.blocks import (
    Beside,
    Block,
    Paragraph,
    Section,
)
from fragfield.report.figures import burst as burst_figures
from fragfield.report.figures import fragments as fragment_figures
from fragfield.report.figures import hazard as hazard_figures
from fragfield.report.figures import site as site_figure
from fragfield.report.tables import zones as zone_blocks
from fragfield.report.tables.attitudes import attitude_figure
from fragfield.report.tables.convergence import convergence_figure, convergence_tables
from fragfield.report.tables.counted import counted_table
from fragfield.report.tables.distances import distance_table
from fragfield.report.tables.exposed_sites import exposed_tables
from fragfield.report.tables.ignition import ignition_table
from fragfield.report.tables.obstacles import obstacle_tables
from fragfield.report.tables.rounds import (
    broken_rounds_table,
    contact_rows,
    round_table,
    segment_table,
)
from fragfield.report.tables.rules import rule_tables
from fragfield.report.tables.shock_exposure import exposure_table
from fragfield.report.tables.stages import (
    break_up_rows,
    burst_rows,
    flight_rows,
    hazard_rows,
    ledger_table,
)
from fragfield.report.tables.zones import zone_table

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from fragfield.report.blocks import Illustration
    from fragfield.report.reading.run_files import RunFiles

    Draw = Callable[[str, str, str, Callable[[RunFiles, bool], Figure | None]], list[Illustration]]
    Picture = Callable[[str, str, str], list[Block]]

__all__ = [
    "blocks_of_stage",
    "break_up_section",
    "burst_section",
    "convergence_section",
    "flight_section",
    "hazard_section",
    "ledger_section",
]


def blocks_of_stage(run: RunFiles, stage: str, blocks: Callable[[], list[Block]]) -> list[Block]:
    """The blocks of a stage, or the word that it has not been run."""
    if stage in run.missing:
        return [Paragraph(f"Not computed: the stage “{stage}” has not been run in this directory.")]
    return blocks()


def ledger_section(run: RunFiles, draw: Draw) -> Section:
    """Energy ledger of the burst."""
    blocks: Callable[[], list[Block]] = lambda: [  # noqa: E731
        *draw(
            "energy_ledger", "Energy ledger over time",
            "Work of the products and how it is distributed; below, the imbalance of the sum.",
            burst_figures.energy_ledger,
        ),
        *ledger_table(run),
    ]  # fmt: skip
    return Section("ledger", "Energy ledger", blocks_of_stage(run, "burst", blocks))


def burst_section(run: RunFiles, draw: Draw, picture: Picture) -> Section:
    """Results of the burst."""
    blocks: Callable[[], list[Block]] = lambda: [  # noqa: E731
        *burst_rows(run),
        *picture(
            "picture_of_burst", "Section of the burst",
            "Section through the axis, viewed along +y, coloured by speed: light is fast, dark is slow. The thin "
            "line is the outline of the casing.",
        ),
        *draw(
            "speed_along_round", "Speed along the round",
            "Casing speed at the end of the burst against the station from the nose, as a fraction of the length: "
            "mean by mass, and largest cell, of each axial bin. Dotted lines separate the segments.",
            burst_figures.speed_along_round,
        ),
        *draw(
            "casing_over_time", "Casing over time",
            "Mean speed of the casing by mass, and the largest over the stations of the azimuthal mean outer diameter. "
            "A dotted vertical line marks the time at which acceleration is complete.",
            burst_figures.casing_over_time,
        ),
        *contact_rows(run),
        *ignition_table(run),
        *exposure_table(run),
        *round_table(run),
    ]  # fmt: skip
    return Section("burst", "Burst", blocks_of_stage(run, "burst", blocks))


def break_up_section(run: RunFiles, draw: Draw, picture: Picture) -> Section:
    """Break-up: fragments by mass, segment and direction."""
    own = run.fragments_file is None
    blocks: Callable[[], list[Block]] = lambda: [  # noqa: E731
        *break_up_rows(run),
        *broken_rounds_table(run),
        *counted_table(run),
        *draw(
            "number_by_mass", "Number of fragments by mass",
            "Number of fragments heavier than m against the root of m (upper figures; lower figures: m)"
            + (": law (lines) and sample (circles), in total and by segment." if own else ", first realisation."),
            fragment_figures.number_by_mass,
        ),
        *draw(
            "directions", "Directions of the mass",
            "Share of the first round's mass by direction of flight at the end of the burst: fragments of the first "
            "realisation (bars) and the velocity field of the casing from which they were made (line).",
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
    return Section("break-up", "Break-up" if own else "Fragments", blocks_of_stage(run, "break-up", blocks))


def flight_section(run: RunFiles, draw: Draw) -> Section:
    """Flight: numbers, landings, witness surfaces."""
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
            "Landing points of the fragments of the first realisation; dark: hazardous. Seen from above, y "
            "upwards. The hazard line is the upper bound of the hazard distance by direction.",
            hazard_figures.landing_map,
        ),
    ]  # fmt: skip
    return Section("flight", "Flight", blocks_of_stage(run, "flight", blocks))


def beside_map(run: RunFiles) -> list[Block]:
    """The map with pan and zoom, beside the page, where there is something to show."""
    if site_figure.site_shapes(run) is None:
        return []
    return [Beside("map.html", "The map with pan and zoom; no network needed")]


def hazard_section(run: RunFiles, draw: Draw) -> Section:
    """Hazard: distances, map, densities, exposed sites."""
    blocks: Callable[[], list[Block]] = lambda: [  # noqa: E731
        *distance_table(run),
        *draw(
            "attitude_curve", "Hazard distance by attitude",
            "Hazard distance by the inclination of the rounds from upright, each in its worst direction; of an "
            "arrangement that is not axisymmetric the worst roll of each inclination.",
            attitude_figure,
        ),
        *exposed_tables(run),
        *draw(
            "exposed_sites", "Exposed sites against their criteria",
            "Expected value (dot) and upper bound (95 %, bar) over the site's limit; left of the "
            "line the criterion is met.",
            site_figure.exposed_figure,
        ),
        *draw(
            "site_map", "Map of the site",
            "Hazard distance by direction, exposed sites by their verdict, barricades and buildings, and lines of "
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
            "not the scatter of single events. The vertical lines mark the hazard distance and its upper bound.",
            hazard_figures.density_curve,
        ),
        *draw(
            "hit_probability", "Probability of a hit on a person",
            "Probability that a hazardous fragment hits a person standing at that distance, at a random azimuth: "
            "mean of the realisations and band of single events.",
            hazard_figures.hit_probability,
        ),
        *draw(
            "distance_by_azimuth", "Distances by azimuth",
            "Hazard distance by direction, as its upper bound and by the expected density; and, not a hazard distance, "
            "the farthest fragment of each sector: median and band of single events.",
            hazard_figures.distance_by_azimuth,
        ),
    ]  # fmt: skip
    return Section("hazard", "Hazard", blocks_of_stage(run, "flight", blocks))


def convergence_section(run: RunFiles, draw: Draw) -> Section:
    """Grid convergence of the results."""
    blocks: Callable[[], list[Block]] = lambda: [  # noqa: E731
        *convergence_tables(run),
        *draw(
            "grid_convergence", "Values by cell size",
            "Each value divided by that of this run (vertical line), with its statistical error; open circles at zero: "
            "limits, where an order was observed.",
            convergence_figure,
        ),
    ]  # fmt: skip
    return Section("convergence", "Grid convergence", blocks_of_stage(run, "flight", blocks))
