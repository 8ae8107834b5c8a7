"""The sections of the stages: rounds, hazard, fragments, speeds, grid convergence, and their annexes."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from fragfield.case.conversion.surroundings import bearing_of, direction_words
from fragfield.report.blocks import Beside, Block, Columns, Group, Paragraph, Section
from fragfield.report.figures import arrangement as arrangement_figures
from fragfield.report.figures import burst as burst_figures
from fragfield.report.figures import fragments as fragment_figures
from fragfield.report.figures import hazard as hazard_figures
from fragfield.report.figures import round_drawing
from fragfield.report.figures import site as site_figure
from fragfield.report.figures.zones import zone_figure
from fragfield.report.tables.attitudes import attitude_figure
from fragfield.report.tables.convergence import convergence_figure, convergence_notes, convergence_tables
from fragfield.report.tables.counted import counted_table
from fragfield.report.tables.distances import distance_table
from fragfield.report.tables.exposed_sites import exposed_tables, obstacle_tables
from fragfield.report.tables.ignition import exposure_table, ignition_table
from fragfield.report.tables.rounds import (
    arrangement_table,
    broken_rounds_table,
    contact_rows,
    round_table,
    segment_table,
)
from fragfield.report.tables.rules import rule_tables
from fragfield.report.tables.stages import (
    alike_around,
    break_up_rows,
    flight_rows,
    mesh_rows,
    quantity_rows,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from matplotlib.figure import Figure

    from fragfield.report.blocks import Illustration
    from fragfield.report.reading.run_files import RunFiles

    Draw = Callable[[str, str, str, Callable[[RunFiles], Figure | None]], list[Illustration]]
    Picture = Callable[[str, str, str], list[Block]]


_MOST_DRAWN = 3
"""Different rounds that are drawn."""


def _blocks_of_stage(run: RunFiles, stage: str, blocks: Callable[[], list[Block]]) -> list[Block]:
    """The blocks of a stage, or the word that it has not been run."""
    if stage in run.missing:
        return [Paragraph(f"Not computed: the stage “{stage}” has not been run in this directory.")]
    return blocks()


def rounds_section(run: RunFiles, draw: Draw) -> Section:
    """Dimensioned drawings of the different rounds, and how they stand."""
    blocks: list[Block] = []
    different = round_drawing.drawn_rounds(run.case) if run.case is not None else []
    for number, item in enumerate(different[:_MOST_DRAWN]):
        blocks += draw(
            f"drawing_{number + 1}", f"Drawing of {item.name}",
            "Section along the axis, nose up: casing (lines), charge (dots), fuze (crosses); dotted: segments of the "
            "break-up. Cross in a circle: centre of mass.",
            partial(round_drawing.round_drawing, number=number),
        )  # fmt: skip
    blocks += draw(
        "arrangement", "Plan and elevation of the rounds",
        "Outlines of the rounds where they stand; dashed: images behind planes of symmetry, which burst as well.",
        arrangement_figures.arrangement_figure,
    )  # fmt: skip
    return Section("rounds", "Rounds", blocks)


def hazard_section(run: RunFiles, draw: Draw) -> Section:
    """Distances, density in the direction that decides, and the site."""
    blocks: Callable[[], list[Block]] = lambda: [  # noqa: E731
        *distance_table(run),
        *draw(
            "density_curve", "Density by distance",
            "Expected number of hazardous fragments per acceptable area, over all azimuths where they are alike, else "
            "in the direction that decides. Shaded: 5 to 95 % of the bootstrap, the certainty of the mean, not the "
            "scatter of single events.",
            hazard_figures.density_curve,
        ),
        *(_landing_map(draw) if site_figure.site_shapes(run) is None else []),
        *draw(
            "attitude_curve", "Distance by attitude",
            "Distance by the inclination of the rounds from upright, each in its worst direction; of an arrangement "
            "that is not axisymmetric the worst roll of each inclination.",
            attitude_figure,
        ),
        *draw(
            "exposed_sites", "Exposed sites against their criteria",
            "Expected value (dot) and upper bound (95 %, bar) over the site's limit; left of the "
            "line the criterion is met.",
            site_figure.exposed_figure,
        ),
        *_site_plan(run, draw),
    ]  # fmt: skip
    return Section("hazard", "Distances and site", _blocks_of_stage(run, "flight", blocks))


def _landing_map(draw: Draw) -> list[Illustration]:
    return draw(
        "landing_map", "Landing points",
        "Landing points of the fragments of the first realisation, seen from above, y upwards.",
        hazard_figures.landing_map,
    )  # fmt: skip


def _site_plan(run: RunFiles, draw: Draw) -> list[Block]:
    """The map, here and with pan and zoom beside the page, where there is something to show."""
    if site_figure.site_shapes(run) is None:
        return []
    return [
        Paragraph("Site plan", kind="heading"),
        *draw(
            "site_map", "Map of the site",
            "Distance by direction, exposed sites by their verdict, barricades and buildings, and lines of "
            "equal height, in the site's frame.",
            site_figure.site_figure,
        ),
        Beside("map.html", "The map with pan and zoom; no network needed"),
    ]  # fmt: skip


def fragments_section(run: RunFiles, draw: Draw, picture: Picture) -> Section:
    """Fragments by mass and direction."""
    own = run.fragments_file is None
    blocks: Callable[[], list[Block]] = lambda: [  # noqa: E731
        *draw(
            "number_by_mass", "Number of fragments by mass",
            "Number of fragments heavier than m against the root of m (upper figures; lower figures: m)"
            + (": law (lines) and sample (circles), in total and by segment." if own else ", first realisation."),
            fragment_figures.number_by_mass,
        ),
        *draw(
            "polar_zones", "Fragments by polar zone",
            "Numbers and speeds of one round's fragments at launch by angle from the nose, as arena tests report them.",
            zone_figure,
        ),
        *draw(
            "directions", "Directions of the mass",
            "Share of the first round's mass by direction of flight at the end of the burst: fragments of the first "
            "realisation (bars) and the velocity field of the casing from which they were made (line).",
            fragment_figures.directions,
        ),
        *picture(
            "picture_of_fragments", "Fragment cloud",
            f"Fragments 100 µs after {'the end of the burst' if own else 'launch'}, drag neglected, coloured by "
            "initial speed. Spheres stand for the mass, not to scale; shapes are not known.",
        ),
        *counted_table(run),
    ]  # fmt: skip
    return Section("fragments", "Fragments", _blocks_of_stage(run, "break-up", blocks))


def speeds_section(run: RunFiles, draw: Draw, picture: Picture) -> Section:
    """Speeds of the casing."""
    blocks: Callable[[], list[Block]] = lambda: [  # noqa: E731
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
        *picture(
            "picture_of_burst", "Section of the burst",
            "Section through the axis, viewed along +y, coloured by speed: light is fast, dark is slow. The thin "
            "line is the outline of the casing.",
        ),
        *draw(
            "energy_ledger", "Energy ledger over time",
            "Work of the products and how it is distributed; below, the imbalance of the sum.",
            burst_figures.energy_ledger,
        ),
    ]  # fmt: skip
    return Section("speeds", "Burst and speeds", _blocks_of_stage(run, "burst", blocks))


def convergence_section(run: RunFiles, draw: Draw) -> Section:
    """Grid convergence of the results."""
    blocks: Callable[[], list[Block]] = lambda: [  # noqa: E731
        *convergence_tables(run),
        *([Columns((
            *draw(
                "grid_convergence", "Values by cell size",
                "Each value divided by that of this run (vertical line), with its statistical error; open circles at "
                "zero: limits, where an order was observed.",
                convergence_figure,
            ),
            Group(convergence_notes()),
        ))] if "sizes" in run.part("convergence") else []),
    ]  # fmt: skip
    return Section("convergence", "Grid convergence", _blocks_of_stage(run, "flight", blocks))


def annexes_of_stages(run: RunFiles, draw: Draw) -> list[Section]:
    """Details of every stage, in tables; none of a stage that has not been run."""
    found = [
        Section("distances", "Rules and exposed sites", [*rule_tables(run), *exposed_tables(run)], annex=True),
        Section("flight", "Flight", list(_flight(run, draw)), annex=True),
        Section("break-up", "Break-up", list(_break_up(run)), annex=True),
        Section("burst", "Burst", list(_burst(run)), annex=True),
    ]
    return [section for section in found if section.blocks]


def _of_x(run: RunFiles) -> str:
    bearing = None if run.case is None else bearing_of(run.case, 0.0)
    return "" if bearing is None else f"; +x points to {direction_words(0.0, bearing)}"


def _flight(run: RunFiles, draw: Draw) -> Iterator[Block]:
    if not run.part("flight"):
        return
    yield from flight_rows(run)
    yield from obstacle_tables(run)
    if "flight" not in run.missing and not alike_around(run):
        yield from draw(
            "polar_by_sector", "Number and speed around the rounds",
            "Fragments that cross the witness surface over all realisations: median and band of 5 to 95 % by sector, "
            f"in degrees from +x counter-clockwise, seen from above{_of_x(run)}.",
            hazard_figures.polar_by_sector,
        )  # fmt: skip
    if site_figure.site_shapes(run) is not None:
        yield from _landing_map(draw)


def _break_up(run: RunFiles) -> Iterator[Block]:
    if "break-up" in run.missing or not run.fragments:
        return
    yield from break_up_rows(run)
    yield from broken_rounds_table(run)
    yield from segment_table(run)


def _burst(run: RunFiles) -> Iterator[Block]:
    if "burst" not in run.stages or "burst" in run.missing:
        return
    yield from arrangement_table(run)
    yield from quantity_rows(run, "Burst", "burst", "burst.speed_quantiles")
    yield mesh_rows(run)
    yield from contact_rows(run)
    yield from ignition_table(run)
    yield from exposure_table(run)
    yield from round_table(run)
