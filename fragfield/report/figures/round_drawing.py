"""Dimensioned drawing of a round: section along the axis, nose up, with lengths, diameters, walls and masses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import InputError
from fragfield.numbers import number
from fragfield.report.figures.drawing import COLUMN, GREY, INK, blank_figure, plain_name
from fragfield_base.substances import substance_title

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from burst_fenicsx.geometry import Profile
    from burst_fenicsx.problem import Round
    from fragfield.case import CaseTable
    from fragfield.report.reading.run_files import RunFiles


_HEIGHT = 4.1  # inches of the round at most
_LEFT, _RIGHT = 1.35, 1.0  # inches beside it for dimensions
_FOOT, _HEAD = 1.2, 0.45  # inches below and above it
_SAMPLES = 400  # stations of a contour
_LINE, _TWO_LINES = 0.125, 0.28  # inches that a line of text needs, and two
_MOST_WALLS = 7


@dataclass(frozen=True)
class _Sheet:
    """The drawing's axes, in inches: the axis of the round at `middle`, its base at `base`, `scale` inches a metre."""

    axes: Axes
    middle: float
    base: float
    scale: float
    length: float

    def height(self, station: float) -> float:
        """Height on the sheet of a station (m from the nose)."""
        return self.base + self.scale * (self.length - station)

    def text(self, x: float, y: float, words: str, **style: Any) -> None:
        """Words at a place."""
        self.axes.text(x, y, plain_name(words), **{"fontsize": 7, "ha": "center", "va": "center", **style})

    def dimension(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """A dimension line with an arrow at both ends."""
        style = {"arrowstyle": "<|-|>", "color": INK, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 5}
        self.axes.annotate("", end, start, arrowprops=style)

    def extension(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """A thin line from the round to a dimension."""
        self.axes.plot(*zip(start, end, strict=True), color=GREY, linewidth=0.4)


def drawn_rounds(case: CaseTable) -> list[Round]:
    """The rounds of a resolved case that differ in more than place and ignition."""
    from fragfield.case.conversion.rounds import burst_rounds, first_alike

    rounds = burst_rounds(case) if case.round else []
    return [rounds[index] for index in dict.fromkeys(first_alike(case))] if rounds else []


def expected_masses(case: CaseTable) -> list[dict[str, float]]:
    """Masses (kg) of casing and charge that the drawings of `drawn_rounds` give, as far as the case has them."""
    from fragfield.case.conversion.rounds import first_alike

    tables = [case.round[index].expected for index in dict.fromkeys(first_alike(case))] if case.round else []
    return [{} if table is None else {key: mass for key, mass in table if mass is not None} for table in tables]


def round_drawing(run: RunFiles, number: int) -> Figure | None:
    """The drawing of a run's different round of that number; None where there is none, or it has no contour."""
    rounds = drawn_rounds(run.case) if run.case is not None else []
    if run.case is None or number >= len(rounds) or rounds[number].profile is None:
        return None
    return draw_round(rounds[number], expected_masses(run.case)[number])


def draw_round(item: Round, expected: Mapping[str, float] | None = None) -> Figure:
    """The drawing of a round with a profile, with the masses (kg) that its own drawing gives as `expected`.

    Raises InputError: the round is a mesh of hexahedra, which has no contour.
    """
    profile = item.profile
    if profile is None:
        raise InputError(f'round "{item.name}": found mesh = "{item.mesh_file}"; allowed for a drawing: a profile')
    scale = min(_HEIGHT / profile.length, (COLUMN - _LEFT - _RIGHT) / (2.0 * profile.max_radius))
    height = scale * profile.length + _FOOT + _HEAD
    figure = blank_figure(COLUMN, height)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, COLUMN), ylim=(0.0, height))
    axes.set_axis_off()
    middle = _LEFT + 0.5 * (COLUMN - _LEFT - _RIGHT)
    sheet = _Sheet(axes, middle, _FOOT, scale, profile.length)
    _draw_parts(sheet, profile)
    _draw_lengths(sheet, profile)
    _draw_diameters(sheet, profile)
    _draw_walls(sheet, item)
    _write_masses(sheet, item, expected or {})
    return figure


def _draw_parts(sheet: _Sheet, profile: Profile) -> None:
    """Casing, charge and fuze in section, each with a hatch of its own, and the axis."""
    outer, cavity = profile.outer, profile.cavity
    front, end = profile.charge_front, profile.charge_end
    _fill(sheet, outer.stations[0], outer.stations[-1], outer, facecolor="#d3d8de", hatch="/////", zorder=1)
    if profile.fuze is not None:
        inert = profile.fuze.fill == "inert"
        _fill(sheet, cavity.start, front, cavity, facecolor="#f6ead2" if inert else "white",
              hatch="xxxx" if inert else "", zorder=2)  # fmt: skip
    _fill(sheet, front, end, cavity, facecolor="#e9edf2", hatch="....", zorder=2)
    top, foot = sheet.height(0.0), sheet.base
    sheet.axes.plot([sheet.middle] * 2, [foot - 0.1, top + 0.1], color=INK, linewidth=0.6, linestyle="-.", zorder=3)
    white = {"facecolor": "white", "edgecolor": "none", "pad": 0.6}
    sheet.text(sheet.middle, sheet.height(0.75 * front + 0.25 * end), "charge", bbox=white, zorder=4)
    if profile.fuze is not None and (front - cavity.start) * sheet.scale > _LINE:
        words = "fuze" if profile.fuze.fill == "inert" else "void"
        sheet.text(sheet.middle, sheet.height(0.5 * (cavity.start + front)), words, bbox=white, zorder=4)


def _fill(sheet: _Sheet, start: float, end: float, contour: Any, **style: Any) -> None:  # noqa: ANN401 - a Contour
    stations = np.unique(np.clip([*np.linspace(start, end, _SAMPLES), *contour.stations], start, end))
    radius = sheet.scale * contour.radius(stations)
    height = [sheet.height(station) for station in stations]
    across = np.concatenate([sheet.middle - radius, (sheet.middle + radius)[::-1]])
    sheet.axes.fill(across, [*height, *height[::-1]], edgecolor=INK, linewidth=0.7, **style)


def _draw_lengths(sheet: _Sheet, profile: Profile) -> None:
    """Left of the round: charge and fuze, the segments of the break-up with their lengths, and the whole length."""
    edge = sheet.middle - sheet.scale * profile.max_radius
    inner, chain, whole = edge - 0.18, edge - 0.42, 0.12
    parts = [(profile.charge_front, profile.charge_end)]
    if profile.fuze is not None:
        parts.append((profile.cavity.start, profile.charge_front))
    for start, end in parts:
        sheet.dimension((inner, sheet.height(start)), (inner, sheet.height(end)))
        if sheet.scale * (end - start) > 0.3:
            sheet.text(inner - 0.07, sheet.height(0.5 * (start + end)), _mm(end - start), rotation=90, fontsize=6.5)
    for station in {profile.charge_front, profile.charge_end, *(profile.cavity.start for _ in parts[1:])}:
        radius = sheet.scale * float(profile.section(station).outer_radius)
        sheet.extension((sheet.middle - radius, sheet.height(station)), (inner - 0.03, sheet.height(station)))
    for segment in profile.segments:
        sheet.dimension((chain, sheet.height(segment.start)), (chain, sheet.height(segment.end)))
        sheet.axes.plot(
            [chain - 0.04, sheet.middle + sheet.scale * profile.max_radius], [sheet.height(segment.end)] * 2,
            color=GREY, linewidth=0.5, linestyle=":", zorder=3,
        )  # fmt: skip
    middles = [sheet.height(0.5 * (one.start + one.end)) for one in profile.segments]
    for segment, wanted, y in zip(profile.segments, middles, _spread(middles, _TWO_LINES), strict=True):
        sheet.extension((chain, wanted), (chain - 0.08, y))
        sheet.text(chain - 0.1, y, f"{segment.name}\n{_mm(segment.end - segment.start)}", ha="right", fontsize=6.5,
                   linespacing=1.05)  # fmt: skip
    sheet.dimension((whole, sheet.height(0.0)), (whole, sheet.base))
    for y in (sheet.height(0.0), sheet.base):
        sheet.extension((whole - 0.05, y), (sheet.middle, y))
    sheet.text(whole - 0.07, sheet.height(0.5 * profile.length), f"length {_mm(profile.length)}", rotation=90)


def _draw_diameters(sheet: _Sheet, profile: Profile) -> None:
    """Above and below the round: nose and base, largest of the casing and of the charge."""
    at = np.linspace(0.0, profile.length, 10 * _SAMPLES + 1)
    section = profile.section(at)
    widest, charge = int(np.argmax(section.outer_radius)), int(np.argmax(section.charge_radius))
    ends = (float(section.outer_radius[0]), float(section.outer_radius[-1]))
    lines = [
        (float(section.charge_radius[charge]), float(at[charge]), sheet.base - 0.16, "charge "),
        (float(section.outer_radius[widest]), float(at[widest]), sheet.base - 0.34, ""),
    ]
    if ends[0] > 0.0 and ends[0] < lines[1][0] * (1.0 - 1e-9):
        lines.append((ends[0], 0.0, sheet.height(0.0) + 0.16, ""))
    for radius, station, y, words in lines:
        reach = sheet.scale * radius
        for side in (-1.0, 1.0):
            sheet.extension((sheet.middle + side * reach, sheet.height(station)), (sheet.middle + side * reach, y))
        sheet.dimension((sheet.middle - reach, y), (sheet.middle + reach, y))
        sheet.text(sheet.middle + reach + 0.06, y, f"{words}⌀ {_mm(2.0 * radius)}", ha="left", fontsize=6.5)
    if 0.0 < ends[1] < lines[1][0] * (1.0 - 1e-9):
        sheet.text(sheet.middle - sheet.scale * lines[1][0] - 0.08, sheet.base - 0.16, f"base ⌀ {_mm(2.0 * ends[1])}",
                   ha="right", fontsize=6.5)  # fmt: skip


def _draw_walls(sheet: _Sheet, item: Round) -> None:
    """Right of the round: wall thickness at the middles of the walls' segments, three at least; centre of mass."""
    profile = item.profile
    assert profile is not None
    stations = _wall_stations(profile)
    section = profile.section(np.array(stations))
    centre = centre_of_mass(item)
    labels = [(at, f"wall {_mm(float(wall))}\nat {_mm(at)}") for at, wall in zip(stations, section.wall, strict=True)]
    labels = sorted([*labels, (centre, f"centre of\nmass {_mm(centre)}")])
    heights = [sheet.height(at) for at, _ in labels]
    start = sheet.middle + sheet.scale * profile.max_radius + 0.1
    for (at, words), wanted, y in zip(labels, heights, _spread(heights, _TWO_LINES), strict=True):
        if at == centre and words.startswith("centre"):
            sheet.axes.plot(
                sheet.middle, wanted, marker="o", markersize=7, color="white", markeredgecolor=INK, zorder=5
            )
            sheet.axes.plot(sheet.middle, wanted, marker="+", markersize=7, color=INK, zorder=6)
            first = sheet.middle
        else:
            index = stations.index(at)
            inner, first = (sheet.middle + sheet.scale * float(one[index])
                            for one in (section.inner_radius, section.outer_radius))  # fmt: skip
            sheet.axes.plot([inner, first], [wanted] * 2, color=INK, linewidth=1.0, marker="|", markersize=5, zorder=5)
        sheet.axes.plot([first, start, start + 0.1], [wanted, wanted, y], color=INK, linewidth=0.5, zorder=4)
        sheet.text(start + 0.13, y, words, ha="left", fontsize=6.5, linespacing=1.05)


def _wall_stations(profile: Profile) -> list[float]:
    """Stations of the cavity at which the wall is given: middles of the walls' segments, three to seven in all."""
    low, high = profile.cavity.start, profile.cavity.end
    middles = [0.5 * (one.start + one.end) for one in profile.segments if one.kind == "wall"]
    stations = [at for at in middles if low < at < high]
    if len(stations) < 3:
        stations = np.linspace(low, high, 5)[1:-1].tolist()
    step = -(-len(stations) // _MOST_WALLS)
    return [float(at) for at in stations[::step]]


def _write_masses(sheet: _Sheet, item: Round, expected: Mapping[str, float]) -> None:
    """Below the drawing: masses, what they differ from those expected by, and in what units it is."""
    profile = item.profile
    assert profile is not None
    mass = round_masses(item)
    fuze = f", fuze {number(mass['fuze'], 3)} kg" if mass["fuze"] else ""
    whole, ratio = number(sum(mass.values()), 4), number(mass["charge"] / mass["casing"], 3)
    known = [
        f"{key} {number(value, 4)} kg ({round(100.0 * (mass[key] / value - 1.0), 2) + 0.0:+.2f} %)"
        for key, value in expected.items()
    ]
    lines = (
        f"casing {number(mass['casing'], 4)} kg ({item.casing.name}), charge {number(mass['charge'], 4)} kg",
        f"({substance_title(item.explosive.name)}){fuze}; whole {whole} kg, charge / casing {ratio}",
        *([f"By its drawing: {', '.join(known)}"] if known else []),
        "Lengths in mm, stations from the nose.",
    )
    for place, line in enumerate(lines):
        sheet.text(0.5 * COLUMN, sheet.base - 0.56 - 1.15 * _LINE * place, line, fontsize=6.5)


def round_masses(item: Round) -> dict[str, float]:
    """Masses of casing, charge and fuze of a round with a profile (kg)."""
    assert item.profile is not None
    return {
        "casing": item.profile.casing_volume * item.casing.density,
        "charge": item.profile.charge_volume * item.explosive.density,
        "fuze": item.profile.fuze_mass,
    }


def centre_of_mass(item: Round) -> float:
    """Station (m from the nose) of the centre of mass of a round with a profile, its fuze evenly in its cavity."""
    profile = item.profile
    assert profile is not None
    corners = [*profile.outer.stations, *profile.cavity.stations, profile.charge_front]
    edges = np.unique([*np.linspace(0.0, profile.length, 201), *corners])
    # Gauss points of each interval: areas are polynomials, or nearly so, between corners.
    nodes, weights = np.polynomial.legendre.leggauss(8)
    half = 0.5 * np.diff(edges)[:, None]
    stations = 0.5 * (edges[1:] + edges[:-1])[:, None] + half * nodes
    section = profile.section(stations)
    charge, inner = section.charge_radius**2, section.inner_radius**2
    casing = item.casing.density * (section.outer_radius**2 - inner)
    line_mass = half * weights * (casing + item.explosive.density * charge + profile.fuze_density * (inner - charge))
    return float((line_mass * stations).sum() / line_mass.sum())


def _spread(wanted: Sequence[float], room: float) -> list[float]:
    """Heights as near to the wanted ones, which fall, as `room` between two of them allows."""
    values: NDArray[np.float64] = np.asarray(wanted, dtype=float) + room * np.arange(len(wanted))
    # With the room taken out, heights may not rise: the nearest such sequence is found by pooling neighbours.
    groups: list[tuple[float, int]] = []
    for value in values.tolist():
        groups.append((value, 1))
        while len(groups) > 1 and groups[-2][0] < groups[-1][0]:
            (high, many), (low, few) = groups[-2:]
            groups[-2:] = [((high * many + low * few) / (many + few), many + few)]
    return [value - room * place for place, value in enumerate(_repeated(groups))]


def _repeated(groups: Sequence[tuple[float, int]]) -> Iterator[float]:
    for value, count in groups:
        yield from [value] * count


def _mm(length: float) -> str:
    """A length in millimetres: to a tenth, whole where it is."""
    return f"{1e3 * length:.1f}".removesuffix(".0")
