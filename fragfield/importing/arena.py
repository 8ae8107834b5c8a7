"""Arena tables in the layouts that tests have them in, as a `flight.ArenaTable`.

One row a piece; one row a zone; one row a zone and group of mass; zones by groups, with the groups in the names of the
columns. Angles count from the nose.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flight.arena import ArenaTable
from flight.errors import InputError as FlightInputError
from fragfield.errors import InputError
from fragfield.importing.columns import Columns, columns_by_name
from fragfield.importing.matrix import Matrix, matrix_of
from fragfield.importing.sheet import Guess, QuestionError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from fragfield.importing.layout import Layout

    Array = NDArray[np.float64]


_SNAP = 0.02  # degrees by which rounded radians may miss 180
WANTED = (
    "zone_from", "zone_to", "zone", "mass_from", "mass_to", "mass_group", "number", "mean_mass", "total_mass", "mass",
    "mean_speed", "max_speed",
)  # fmt: skip


@dataclass(frozen=True)
class ArenaOptions:
    """What an arena table does not say of itself."""

    rounds: float = 1.0
    """That its numbers are of together; a part of one where a part of the azimuth was caught."""
    width: float = 5.0
    """Of the zones that pieces are put into (degrees)."""
    from_base: bool = False
    """Angles count from the base, not from the nose."""
    empty_zones: bool = False
    """Zones without a row hold no fragment."""
    zone_angle: str | None = None
    """What a single angle of a zone is: "from", "centre" or "to"."""


def arena_table(
    layout: Layout, chosen: Mapping[str, str], units: Mapping[str, str], options: ArenaOptions
) -> tuple[ArenaTable, list[Guess], list[str]]:
    """Table of one round, what was concluded, and what was dropped.

    Raises InputError: a quantity is missing, or the table cannot be flown; `QuestionError` where something has two
    meanings.
    """
    matrix = matrix_of(layout, units)
    names = columns_by_name(layout, [one for one in WANTED if matrix is None or not one.startswith("mass_")], chosen)
    columns = Columns(
        layout, {name: at for name, at in names.items() if matrix is None or at not in matrix.at}, units, chosen
    )
    path = layout.sheet.path
    guesses = list(layout.guesses)
    try:
        if matrix is None and "number" not in columns and "zone" in columns and "mass" in columns:
            table = _of_pieces(columns, options)
            guesses.append(Guess("layout", "one row a piece", "an angle and a mass, but no count"))
        else:
            table, words = _of_zones(columns, matrix, options)
            guesses += words
    except FlightInputError as error:
        raise InputError(f"{path}: {error}{_hint(str(error))}") from None
    guesses += columns.guesses
    guesses.append(Guess("angles", "from the base" if options.from_base else "from the nose", "--from-base turns them"))
    guesses.append(Guess("numbers", f"of {options.rounds:g} round{'' if options.rounds == 1 else 's'}", "--rounds"))
    used = set() if matrix is None else {layout.names[at] for at in matrix.at}
    dropped = [*layout.dropped, *(f"column {one!r}" for one in columns.unused() if one not in used)]
    return table, guesses, dropped


def _hint(text: str) -> str:
    return "; --empty-zones takes zones without a row for empty" if "zones must rise from 0 to 180" in text else ""


def _of_pieces(columns: Columns, options: ArenaOptions) -> ArenaTable:
    columns.require("zone", "mass", "mean_speed")
    polar, mass, speed = columns.whole("zone", "deg"), columns.whole("mass"), columns.whole("mean_speed")
    bad = (polar < 0.0) | (polar > 180.0)
    if bad.any():
        row = columns.layout.rows[int(np.argmax(bad))]
        raise InputError(f"{columns.place(row, 'zone')}: {polar[bad][0]:g} degrees; allowed: 0 to 180 from the nose")
    light = ~(mass > 0.0)
    if light.any():
        row = columns.layout.rows[int(np.argmax(light))]
        raise InputError(f"{columns.place(row, 'mass')}: a piece of {mass[light][0]:g} kg; needed: above zero")
    if options.from_base:
        polar = 180.0 - polar
    return ArenaTable.of_pieces(mass, polar, speed, options.rounds, width=options.width)


def _of_zones(columns: Columns, matrix: Matrix | None, options: ArenaOptions) -> tuple[ArenaTable, list[Guess]]:
    """Rows of zones, with or without groups of mass, or with these in the columns."""
    start, end, guesses = _zones(columns, options)
    columns.require("mean_speed")
    speed = _carried(columns, "mean_speed", start)
    largest = _carried(columns, "max_speed", start) if "max_speed" in columns else speed
    if matrix is None:
        columns.require("number")
        number = np.nan_to_num(columns.values("number"))
        columns.refuse_sum(number)
        low, high, words = _groups(columns, number)
        mean, more = _mean_mass(columns, number, low, high)
        guesses += [*words, *more]
    else:
        start, end, speed, largest = (np.repeat(one, len(matrix.at)) for one in (start, end, speed, largest))
        number, low, high, mean = matrix.numbers.ravel(), *(np.tile(one, len(columns)) for one in matrix.groups)
        guesses += matrix.guesses
    held = number > 0.0
    if matrix is None:
        columns.refuse_empty("mean_speed", speed, held)
    elif (np.isnan(speed) & held).any():
        raise InputError(f"{columns.layout.sheet.path}: mean_speed: empty in a zone with fragments")
    if (number < 0.0).any():
        raise InputError(f"{columns.layout.sheet.path}: number: found {number.min():g}; needed: 0 or more")
    if options.from_base:
        start, end = 180.0 - end, 180.0 - start
    zones, zone = _edges(columns, start, end, options)
    keep = held if held.any() else np.ones(len(held), dtype=bool)
    rows = [
        np.nan_to_num(one, posinf=math.inf)[keep] for one in (low, high, number / options.rounds, mean, speed, largest)
    ]
    rows[-1] = np.maximum(rows[-1], rows[-2])
    return ArenaTable.of_rows(zones, zone[keep], *rows), guesses


def _zones(columns: Columns, options: ArenaOptions) -> tuple[Array, Array, list[Guess]]:
    """Edges of the zone of every row (degrees); an empty cell is of the zone above, as merged cells are."""
    path = columns.layout.sheet.path
    if "zone_from" in columns:
        columns.require("zone_to")
        columns.same_unit("zone_from", "zone_to")
        return _down(columns.values("zone_from", "deg")), _down(columns.values("zone_to", "deg")), []
    if "zone" not in columns:
        columns.require("zone_from", "zone_to")
    ranges = columns.intervals("zone", "deg")
    if any(ranges):
        cells = columns.cells("zone")
        for row, cell, one in zip(columns.layout.rows, cells, ranges, strict=True):
            if one is None and cell != "":
                raise InputError(f"{columns.place(row, 'zone')}: {cell!r} is not a zone; allowed: from and to, as 5-10")
        start = np.array([math.nan if one is None else one.low for one in ranges])
        end = np.array([math.nan if one is None else one.high for one in ranges])
        return _down(start), _down(end), []
    angles = _down(columns.values("zone", "deg"))
    each = np.unique(angles)
    if len(each) > 1 and each[0] in (0.0, 1.0) and each[-1] < 100.0 and (np.diff(each) == 1.0).all():
        raise InputError(
            f"{path}: zone: found {each[0]:g}, {each[1]:g}, ... {each[-1]:g}, numbers of zones as it seems, not angles;"
            " needed: their edges, in two columns or as ranges such as 5-10"
        )
    edges, reason = _edges_of_angles(angles, options.zone_angle)
    if edges is None:
        raise QuestionError(f"{path}: zone: one angle a zone, {reason}", "zone-angle", ("from", "centre", "to"))
    at = np.searchsorted(np.unique(angles), angles)
    return edges[at], edges[at + 1], [Guess("zones", f"{len(edges) - 1}", reason)]


def _down(values: Array) -> Array:
    """Values, empty ones as those above them."""
    last = np.maximum.accumulate(np.where(np.isnan(values), 0, np.arange(len(values))))
    return values[last]


def _carried(columns: Columns, name: str, zone: Array) -> Array:
    """Values of rows, empty ones as those above them in the same zone."""
    values = columns.values(name)
    filled = _down(values)
    same = np.concatenate([[False], zone[1:] == zone[:-1]])
    found = values.copy()
    for at in np.flatnonzero(np.isnan(values) & same):
        found[at] = found[at - 1]
    return np.where(np.isnan(values) & ~same, math.nan, np.where(np.isnan(values), found, filled))


def _edges_of_angles(angles: Array, what: str | None) -> tuple[Array | None, str]:
    """Edges of zones that have one angle each; None where it may be their beginning, centre or end."""
    each = np.unique(angles[~np.isnan(angles)])
    if len(each) < 2:
        return None, "of which there are fewer than two"
    width = np.diff(each)
    even = bool(np.abs(width - width[0]).max() < 1e-6 * width[0])
    if what is None and even and abs(each[0] - width[0] / 2) < 1e-6 and abs(each[-1] - 180.0 + width[0] / 2) < 1e-6:
        what = "centre"
    if what is None and even and each[0] == 0.0 and each[-1] == 180.0:
        what = "centre"
    if what == "from":
        return np.append(each, 180.0), "each begins its zone"
    if what == "to":
        return np.insert(each, 0, 0.0), "each ends its zone"
    if what == "centre":
        middle = np.round((each[1:] + each[:-1]) / 2.0, 9)
        return np.concatenate([[0.0], middle, [180.0]]), "the angles are the centres of zones from 0 to 180"
    return None, f"{each[0]:g}, {each[1]:g}, ... {each[-1]:g}"


def _groups(columns: Columns, number: Array) -> tuple[Array, Array, list[Guess]]:
    if "mass_from" in columns and "mass_to" in columns:
        high = columns.values("mass_to")
        return columns.values("mass_from"), np.where(np.isnan(high), math.inf, high), []
    if "mass_group" in columns:
        ranges = columns.intervals("mass_group", "kg")
        if any(ranges):
            low = np.array([0.0 if one is None else one.low for one in ranges])
            high = np.array([math.inf if one is None else one.high for one in ranges])
            return low, high, []
    return (
        np.zeros(len(number)),
        np.full(len(number), math.inf),
        [Guess("groups of mass", "none", "no columns of them")],
    )


def _mean_mass(columns: Columns, number: Array, low: Array, high: Array) -> tuple[Array, list[Guess]]:
    """Mean mass of every row; a column "mass" is the mean or the total, which its group shows or the caller says."""
    held = number > 0.0
    if "mean_mass" in columns:
        mean = columns.values("mean_mass")
        columns.refuse_empty("mean_mass", mean, held)
        return mean, []
    if "total_mass" in columns:
        total = columns.values("total_mass")
        columns.refuse_empty("total_mass", total, held)
        return np.divide(total, number, out=np.zeros(len(total)), where=held), []
    if "mass" not in columns:
        columns.require("mean_mass")
    mass = columns.values("mass")
    columns.refuse_empty("mass", mass, held)
    each = np.divide(mass, number, out=np.zeros(len(mass)), where=held)
    fits = [bool(((low <= one * (1 + 1e-9)) & (one <= high * (1 + 1e-9)))[held].all()) for one in (mass, each)]
    same = bool((number[held] == 1.0).all())
    if fits == [True, False] or (same and fits[0]):
        return mass, [Guess("mass", "mean of a fragment", "it lies in its group of mass")]
    if fits == [False, True]:
        return each, [Guess("mass", "of all fragments of the row", "divided by their number it lies in its group")]
    title = columns.layout.names[columns.index["mass"]] or str(columns.index["mass"] + 1)
    raise QuestionError(
        f"{columns.layout.sheet.path}: mass ({title!r}) is that of one fragment, or of all of the row", "column",
        [f'mean_mass="{title}"', f'total_mass="{title}"'],
    )  # fmt: skip


def _edges(columns: Columns, start: Array, end: Array, options: ArenaOptions) -> tuple[Array, NDArray[np.int64]]:
    """Edges of all zones, and the zone of every row; without rows, zones are refused or empty."""
    start, end = (np.where(np.abs(one - 180.0) < _SNAP, 180.0, one) for one in (start, end))
    bad = ~((start >= 0.0) & (end <= 180.0) & (start < end))
    path = columns.layout.sheet.path
    if bad.any():
        row = columns.layout.rows[int(np.argmax(bad)) * len(columns) // len(bad)]
        raise InputError(
            f"{columns.layout.sheet.place(row.line)}: a zone from {start[bad][0]:g} to {end[bad][0]:g} degrees; "
            "allowed: rising, from 0 to 180"
        )
    zones = np.unique(np.round(np.concatenate([start, end]), 9))
    zone = np.searchsorted(zones, np.round(start, 9))
    over = np.round(end, 9) != zones[zone + 1]
    if over.any():
        raise InputError(f"{path}: the zone from {start[over][0]:g} to {end[over][0]:g} degrees overlaps another")
    gaps = [(zones[at], zones[at + 1]) for at in np.setdiff1d(np.arange(len(zones) - 1), zone)]
    gaps += [(0.0, zones[0])] if zones[0] > 0.0 else []
    gaps += [(zones[-1], 180.0)] if zones[-1] < 180.0 else []
    if gaps and not options.empty_zones:
        words = ", ".join(f"{low:g} to {high:g}" for low, high in sorted(gaps)[:4])
        raise QuestionError(
            f"{path}: no row for {words} degrees{' and more' if len(gaps) > 4 else ''}: nothing fell there, which "
            "--empty-zones says, or it was not measured, which cannot be flown", "empty-zones",
        )  # fmt: skip
    whole = np.unique(np.concatenate([zones, [0.0, 180.0]]))
    return whole, np.searchsorted(whole, np.round(start, 9)).astype(np.int64)
