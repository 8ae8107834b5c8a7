"""Contents of the site map: distances by direction, exposed sites, obstacles, rounds and lines of terrain.

One list of shapes in metres of the site's frame is behind the report's figure, the page with pan and zoom, and the
files for geographic programs, so that all of them hold the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flight import HeightMap
from flight.hazard.ensemble import EnsembleHazard
from fragfield.case import CaseTable
from fragfield.case.conversion.exposed_sites import outline_of
from fragfield.case.conversion.surroundings import ground_of, site_of
from fragfield.files.run_directory import RunDirectory
from fragfield.hazard.contents import image_names, with_images
from fragfield.hazard.contours import Contour, outline, smooth_outline, write_geojson, write_kml
from fragfield.hazard.verdict import criterion_words, part_of_criterion
from fragfield.places.site import Site, longitude_of
from fragfield.results.site import ExposedSite
from fragfield.results.words import metres

Array = NDArray[np.float64]


KINDS = {
    "recommended": "recommended distance",
    "hazard_upper": "expected density, upper bound (95 %) by direction",
    "hazard": "expected density by direction",
    "max_throw": "farthest fragment by sector",
    "exposed": "exposed site",
    "obstacle": "barricade, wall or building",
    "round": "round",
    "terrain": "height of the ground",
}
"""Kinds of shapes, in words."""
FOLDERS = {
    "round": "rounds",
    "exposed": "exposed sites",
    "recommended": "recommended distance",
    "obstacle": "obstacles",
    "terrain": "contours of the ground",
    **dict.fromkeys(("hazard_upper", "hazard", "max_throw"), "distances by direction"),
}
"""Folder of a KML file by kind of shape."""
COLORS = {
    "recommended": "#7a1f10", "obstacle": "#6b4e16", "round": "#1d2733", "terrain": "#9a8a6f",
    "hazard_upper": "#b3361e", "hazard": "#b3361e", "max_throw": "#16365c",
}  # fmt: skip
_STATISTICS = {
    "hazard_upper": ("expected_density", "upper"), "hazard": ("expected_density", "expected"),
    "max_throw": ("max_throw", "pooled"),
}  # fmt: skip
"""Quantity and statistic of distances by direction in geographic files."""


@dataclass(frozen=True)
class VerdictStyle:
    """How an exposed site is drawn by its verdict: distinguished in grey by hatching, marker and line."""

    color: str
    """"#rrggbb"."""
    hatch: str
    """As matplotlib names it: none, "xx" crossed, "//" oblique or ".." dotted."""
    marker: str
    """The same of markers: "o" circle, "X" cross, "^" triangle, "s" square."""
    width: float
    """Of the outline (pixels)."""
    opacity: float
    """Of the fill."""


VERDICTS = {
    "met": VerdictStyle("#2b6b46", "", "o", 1.5, 0.15),
    "not met": VerdictStyle("#a3301a", "xx", "X", 4.0, 0.55),
    "not shown": VerdictStyle("#9a5b00", "//", "^", 2.5, 0.35),
    "not determined": VerdictStyle("#5d6670", "..", "s", 2.5, 0.35),
}
"""By verdict."""
REACH = 1.25  # of what is to be seen, up to which lines of terrain are drawn
LEVELS = 9


@dataclass(frozen=True, eq=False)
class Shape:
    """A line or an area on the map."""

    kind: str
    """One of `KINDS`."""
    name: str
    """Its name."""
    points: Array
    """(k, 2) float64: in the site's frame (m); one point alone is a position."""
    closed: bool = True
    """Whether the last point joins the first."""
    properties: dict[str, Any] = field(default_factory=dict)
    """What else is known of it."""
    label: tuple[float, float] | None = None
    """(2,) floats, optional: where its name stands (m); left out: above it."""

    @property
    def centre(self) -> Array:
        """Position of its name and marker (2,), in m."""
        return np.asarray(self.label or self.points.mean(axis=0), dtype=np.float64)


def shapes_of(
    case: CaseTable, found: EnsembleHazard, exposed: Sequence[ExposedSite], recommended: float | None
) -> list[Shape]:
    """All shapes of a resolved case and its flights: terrain first, so that it is drawn below the rest.

    `exposed` are the sites with their verdicts, `recommended` is the recommended distance (m).
    """
    shapes = [*_distances(case, found), *_recommended(case, recommended)]
    shapes += [
        Shape("obstacle", one.name, outline_of(one), properties={"obstacle": one.kind, "height_m": one.height})
        for one in case.obstacle
    ]
    shapes += map(_exposed, exposed)
    if case.round:
        images = zip(image_names(case), with_images(case), strict=True)
        shapes += [Shape("round", name, position[None, :2]) for name, position in images]
    ground = ground_of(case)
    if isinstance(ground, float):
        return shapes
    return [*terrain_lines(ground, extent_of(shapes)), *shapes]


def extent_of(shapes: Sequence[Shape]) -> tuple[Array, Array]:
    """Lower left and upper right corner (m) of what is to be seen: the farthest fragment counts for nothing there."""
    seen = [shape.points for shape in shapes if shape.kind not in ("max_throw", "terrain")]
    positions = np.concatenate([*seen, [[-10.0, -10.0], [10.0, 10.0]]])
    return positions.min(axis=0), positions.max(axis=0)


def to_contours(shapes: Sequence[Shape], site: Site, origin: tuple[float, float]) -> list[Contour]:
    """Shapes as lines on the Earth, for GeoJSON and KML."""
    made = []
    for shape in shapes:
        away = shape.points - np.asarray(origin)
        turn = np.degrees(np.arctan2(away[:, 1], away[:, 0]))
        ring = site.coordinates(turn, np.hypot(away[:, 0], away[:, 1]))
        if shape.closed and len(ring) > 1:
            ring = np.concatenate([ring, ring[:1]])
        quantity, statistic = _STATISTICS.get(shape.kind, (shape.kind, None))
        properties = {"name": shape.name, "quantity": quantity, "what": KINDS[shape.kind], **shape.properties}
        if statistic is not None:
            properties["statistic"] = statistic
        look: dict[str, Any] = {"folder": FOLDERS[shape.kind]}
        if shape.kind == "exposed":
            verdict = shape.properties["verdict"]
            style, centre = VERDICTS[verdict], shape.centre - np.asarray(origin)
            ((x, y),) = site.coordinates(np.degrees(np.arctan2(centre[1], centre[0])), np.hypot(*centre)).tolist()
            look |= {"color": style.color, "width": style.width, "opacity": style.opacity,
                     "label": f"{shape.name}: {verdict}", "label_at": (longitude_of(x), y)}  # fmt: skip
        else:
            look["color"] = COLORS[shape.kind]
        made.append(Contour(ring, properties, shape.closed, **look))
    order = list(FOLDERS.values())
    return sorted(made, key=lambda one: order.index(one.folder))


def _distances(case: CaseTable, found: EnsembleHazard) -> Iterator[Shape]:
    expected, origin = found.expected, np.asarray(case.flight.origin)
    rows: list[tuple[str, Array]] = [("max_throw", found.by_sector["max_throw"].pooled)]
    if not found.undetermined:
        rows += [("hazard", expected.by_direction), ("hazard_upper", expected.upper_by_direction)]
    for kind, reach in rows:
        if np.isfinite(reach).all() and reach.max(initial=0.0) > 0.0:
            turn, distance = outline(reach) if kind == "max_throw" else smooth_outline(reach, expected.kernel)
            turn = np.radians(turn)
            points = origin + distance[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
            properties = {"largest_m": round(float(reach.max()), 3), "realisations": found.realisations}
            if kind != "max_throw":
                properties |= {
                    "realisations": expected.realisations, "converged": expected.uncertainty <= found.tolerance,
                }  # fmt: skip
            yield Shape(kind, KINDS[kind], points, properties=properties)


def _recommended(case: CaseTable, distance: float | None) -> Iterator[Shape]:
    if distance is None:
        return
    turn = np.radians(np.arange(360.0))
    points = np.asarray(case.flight.origin) + distance * np.column_stack([np.cos(turn), np.sin(turn)])
    name = f"{KINDS['recommended']}, {metres(distance)}"
    yield Shape("recommended", name, points, properties={"distance_m": round(distance, 3)})


def _exposed(site: ExposedSite) -> Shape:
    hits, probability = site.expected_hits, site.probability
    of_hits = (None, None) if hits is None else (hits.expected, hits.upper)
    of_a_hit = (None, None) if probability is None else (probability.expected, probability.upper)
    properties = {
        "place": site.kind,
        "verdict": site.verdict,
        "criterion": criterion_words(site),
        "part_of_criterion": _rounded(part_of_criterion(site)),
        "distance_m": _rounded(site.distance),
        "azimuth_deg": _rounded(site.azimuth_deg),
        "bearing_deg": _rounded(site.bearing_deg),
        "margin_m": _rounded(site.margin),
        "no_margin": site.no_margin,
        "expected_hits": _rounded(of_hits[0]),
        "expected_hits_upper": _rounded(of_hits[1]),
        "probability_of_a_hit": _rounded(of_a_hit[0]),
        "probability_of_a_hit_upper": _rounded(of_a_hit[1]),
        "largest_energy_J": _rounded(site.largest_energy),
    }
    label = site.place if site.kind == "road" else None
    return Shape("exposed", site.name, np.array(site.outline), properties=properties, label=label)


def _rounded(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.4g}")


def terrain_lines(ground: HeightMap, extent: tuple[Array, Array]) -> Iterator[Shape]:
    """Lines of equal height, at round heights, around what is to be seen."""
    from contourpy import contour_generator
    from matplotlib.ticker import MaxNLocator

    centre, half = 0.5 * (extent[0] + extent[1]), 0.5 * REACH * (extent[1] - extent[0])
    (west, south), (east, north) = ground.corner, ground.end
    rows, columns = ground.heights.shape
    x, y = np.linspace(west, east, columns), np.linspace(south, north, rows)
    half = half + ground.step  # up to the nodes just beyond
    here_x = (x >= (centre - half)[0]) & (x <= (centre + half)[0])
    here_y = (y >= (centre - half)[1]) & (y <= (centre + half)[1])
    if here_x.sum() < 2 or here_y.sum() < 2:
        return
    heights = ground.heights[np.ix_(here_y, here_x)]
    lines = contour_generator(x[here_x], y[here_y], heights)
    for level in MaxNLocator(nbins=LEVELS).tick_values(float(heights.min()), float(heights.max())):
        for line in lines.lines(float(level)):
            points = np.asarray(line)
            if len(points) > 2:
                yield Shape("terrain", f"{level:g} m", points, closed=False, properties={"height_m": float(level)})


def write_contours(
    case: CaseTable, found: EnsembleHazard, target: RunDirectory, provenance: Mapping[str, str],
    exposed: Sequence[ExposedSite], recommended: float | None,
) -> None:  # fmt: skip
    """Write contours.geojson and contours.kml into the run directory, or nothing without a table [site].

    They hold the recommended distance, distances by direction, exposed sites with their results, obstacles, rounds and
    lines of terrain.
    """
    site = site_of(case)
    if site is None:
        return

    shapes = shapes_of(case, found, exposed, recommended)
    contours = to_contours(shapes, site, case.flight.origin)
    write_geojson(contours, site, target.file("contours.geojson"), provenance)
    write_kml(contours, site, target.file("contours.kml"), provenance)
