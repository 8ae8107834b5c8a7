"""Fragments as arena tests report them: numbers, masses and speeds by polar zone and mass group of one round.

A polar zone lies between two angles from the nose; 90 degrees is abreast. Fragments at rest count there. The file
(Z-data) is CSV with one line a zone and mass group, empty ones left out; zones without any fragment have one line of
group 0 with number 0, so that every zone tested is in the file. Numbers are per round and may be fractions: means
over tests or realisations.

Table and file hold what such tests hold, and no more. Fragments made from them are spread: within a zone directions
are even over the sphere; within a group masses follow a law N(> m) ~ exp(-c m^law) between its edges, whose c gives the
group's mean mass (law = 1/2 is that of Mott); speeds spread evenly to both sides of the mean, as far as the largest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.arguments import number_of_parts, real_array, require_number
from flight.errors import InputError
from flight.files.text_tables import column_names, import_hint, in_columns_of, read_columns, write_columns
from flight.fragments import Fragments
from flight.shape import DEFAULT_SHAPE_FACTOR
from fragfield_base.arrays import group_outside

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]


COLUMNS = (
    "zone_from_deg", "zone_to_deg", "mass_from_kg", "mass_to_kg", "number", "mean_mass_kg", "mean_speed_m_s",
    "max_speed_m_s",
)  # fmt: skip
LIGHTEST = 1e-5  # kg: lower edge of the lightest group
LIGHTEST_MEAN = 1e-6  # kg: a file whose fragments are lighter on average is refused
PER_OCTAVE = 2  # mass groups
DUST = 1e-9  # kg: none is lighter
MOTT = 0.5  # power of the mass in the law within a group


@dataclass(frozen=True, eq=False, repr=False)
class ArenaTable:
    """Fragments of one round by polar zone and mass group.

    Attributes
    ----------
    zones : (z + 1,) float64
        Edges of the polar zones in degrees from the nose, rising from 0 to 180.
    zone : (k,) int64
        Zone of every row.
    mass_from, mass_to : (k,) float64
        Edges of its mass group (kg); 0 to infinity where none is known.
    number : (k,) float64
        Fragments of one round.
    mass, speed : (k,) float64
        Mean mass (kg) and mean speed, by mass (m/s), at launch.
    max_speed : (k,) float64
        Largest speed (m/s).
    """

    zones: Array
    zone: NDArray[np.int64]
    mass_from: Array
    mass_to: Array
    number: Array
    mass: Array
    speed: Array
    max_speed: Array

    def __post_init__(self) -> None:
        edges = self.zones
        if len(edges) < 2 or abs(edges[0]) > 1e-9 or abs(edges[-1] - 180.0) > 1e-9 or (np.diff(edges) <= 0.0).any():
            raise InputError("arena: zones must rise from 0 to 180 degrees without a gap")
        for name in ("number", "mass", "speed", "max_speed"):
            values = getattr(self, name)
            bad = ~(np.isfinite(values) & (values >= 0.0))
            if bad.any():
                raise InputError(
                    f"arena: {name} of row {int(np.argmax(bad)) + 1} is {values[bad][0]}, needed: 0 or more"
                )
        # A speed may be zero: of what a burst that was cut short has not reached.
        empty = (self.number > 0.0) & ~(self.mass > 0.0)
        if empty.any():
            raise InputError(f"arena: row {int(np.argmax(empty)) + 1} has fragments without mass")
        self._check_groups()

    def _check_groups(self) -> None:
        """Refuse a mean mass that no fragment of its group can have: a slip of a unit or of a column."""
        low, high = self.mass_from, self.mass_to
        bad = ~(np.isfinite(low) & (low >= 0.0) & (high >= low))
        if bad.any():
            first = int(np.argmax(bad))
            raise InputError(
                f"arena: the group of mass of row {first + 1} runs from {low[first]:g} to {high[first]:g} kg; allowed: "
                "from 0 or more upwards, to inf where it has no upper end"
            )
        row = group_outside(self.number, self.number * self.mass, low, high)
        if row is not None:
            raise InputError(
                f"arena: the mean mass of row {row + 1} is {self.mass[row]:g} kg, outside its own group of mass; "
                f"allowed: {low[row]:g} to {high[row]:g} kg (0 to inf where no group is known)"
            )

    def __repr__(self) -> str:
        number, mass = self.number.sum(), self.total_mass
        return f"<flight.ArenaTable: {number:.4g} fragments of {mass:.4g} kg in {len(self.zones) - 1} zones>"

    @property
    def total_mass(self) -> float:
        """Mass of all fragments of the round (kg)."""
        return float((self.number * self.mass).sum())

    def scaled(self, factor: float) -> ArenaTable:
        """The same masses, directions and speeds with `factor` times as many fragments."""
        require_number("arena", "factor on the numbers", factor, "", above=0.0)
        return self if factor == 1.0 else replace(self, number=self.number * factor)

    @classmethod
    def of(
        cls, realisations: Sequence[Fragments], axes: ArrayLike = ((0.0, 0.0, 1.0),), *, width: float = 5.0
    ) -> ArenaTable:
        """Mean over realisations and rounds.

        Parameters
        ----------
        realisations : sequence of Fragments
            Of one arrangement; `round` counts its rounds.
        axes : (r, 3)
            From base to nose of every round; one stands for all.
        width : float
            Of a zone (degrees), a whole fraction of 180.
        """
        number_of_parts("arena", "width of the zones", width, 180.0)
        if not realisations or not any(len(one) for one in realisations):
            raise InputError("arena: no fragment to put into a table")
        together = Fragments.concatenate(list(realisations))
        rounds = int(together.round.max()) + 1
        along = np.asarray(axes, dtype=np.float64).reshape(-1, 3)
        along = along / np.linalg.norm(along, axis=1, keepdims=True)
        if len(along) not in (1, rounds) and len(along) < rounds:
            raise InputError(f"arena: {len(along)} axes for {rounds} rounds")
        mine = along[np.minimum(together.round, len(along) - 1)]
        speed = np.linalg.norm(together.velocity, axis=1)
        cosine = np.clip((together.velocity * mine).sum(axis=1) / np.maximum(speed, 1e-300), -1.0, 1.0)
        polar = np.degrees(np.arccos(cosine))
        return cls.of_pieces(together.mass, polar, speed, len(realisations) * rounds, width=width)

    @classmethod
    def of_pieces(
        cls, mass: ArrayLike, polar: ArrayLike, speed: ArrayLike, rounds: float = 1.0, *, width: float = 5.0
    ) -> ArenaTable:
        """Mean of one round from pieces one by one.

        Parameters
        ----------
        mass, polar, speed : (n,)
            Mass (kg), angle from the nose (degrees, 0 to 180) and speed at launch (m/s).
        rounds : float
            That all pieces together are of; a part of one where a part of the azimuth was caught.
        width : float
            Of a zone (degrees), a whole fraction of 180.
        """
        count = number_of_parts("arena", "width of the zones", width, 180.0)
        mass, speed = np.asarray(mass, dtype=np.float64), np.asarray(speed, dtype=np.float64)
        zone = np.minimum((np.asarray(polar, dtype=np.float64) / width).astype(np.int64), count - 1)
        group = np.maximum(0, np.floor(PER_OCTAVE * np.log2(mass / LIGHTEST)).astype(np.int64) + 1)
        key, inverse = np.unique(zone * 10_000 + group, return_inverse=True)
        numbers, total, mean, largest = _sums(inverse, len(key), np.ones_like(mass), mass, speed, speed)
        groups = key % 10_000
        low = np.where(groups > 0, LIGHTEST * 2.0 ** ((groups - 1) / PER_OCTAVE), 0.0)
        high = LIGHTEST * 2.0 ** (groups / PER_OCTAVE)
        rows = (key // 10_000, low, high, numbers / rounds, total / numbers, mean, largest)
        return cls.of_rows(np.arange(count + 1) * width, *rows)

    @classmethod
    def of_rows(cls, zones: Array, zone: NDArray[np.int64], *columns: Array) -> ArenaTable:
        """Of columns from mass_from on; zones without rows get an empty one, numbers are those that the file prints."""
        missing = np.setdiff1d(np.arange(len(zones) - 1), zone)
        zone = np.concatenate([zone, missing])
        order = np.argsort(zone, kind="stable")
        printed = [
            np.array([float(f"{value:.10g}") for value in np.concatenate([column, np.zeros(len(missing))])[order]])
            for column in columns
        ]
        return cls(zones, zone[order], *printed)

    def by_zone(self, energy: float = 79.0) -> dict[str, Array]:
        """By zone (z,): from_deg, to_deg, number, mass (kg), mean_speed by mass, max_speed (m/s), hazardous.

        `hazardous` are those with a kinetic energy of `energy` (J) or more at launch.
        """
        size = len(self.zones) - 1
        sums = _sums(self.zone, size, self.number, self.number * self.mass, self.speed, self.max_speed)
        dangerous = self.number * (0.5 * self.mass * self.speed**2 >= energy)
        return {
            "from_deg": self.zones[:-1],
            "to_deg": self.zones[1:],
            **dict(zip(("number", "mass", "mean_speed", "max_speed"), sums, strict=True)),
            "hazardous": np.bincount(self.zone, weights=dangerous, minlength=size).astype(np.float64),
        }

    def merged(self) -> ArenaTable:
        """The table with its zones joined in pairs: what a test with zones twice as wide would have reported."""
        zones = np.append(self.zones[:-1:2], self.zones[-1])
        zone = self.zone // 2
        key, inverse = np.unique(np.column_stack([zone, self.mass_from, self.mass_to]), axis=0, return_inverse=True)
        number, mass, speed, largest = _sums(
            inverse.ravel(), len(key), self.number, self.number * self.mass, self.speed, self.max_speed
        )
        mean = mass / np.maximum(number, 1e-300)
        return ArenaTable(zones, key[:, 0].astype(np.int64), key[:, 1], key[:, 2], number, mean, speed, largest)

    def realisation(
        self, seed: int, number: int = 0, *, position: ArrayLike = (0.0, 0.0, 1.0), axis: ArrayLike = (0.0, 0.0, 1.0),
        shape_factor: float = DEFAULT_SHAPE_FACTOR, round_number: int = 0, law: float = MOTT,
    ) -> Fragments:  # fmt: skip
        """Fragments of one round, at random within their zones and groups; fractions of a number at random.

        Parameters
        ----------
        seed, number : int
            Of the case, and of the realisation.
        position, axis : (3,)
            Where they start (m), and the direction from base to nose.
        shape_factor : float
            k in the presented area (kg/m3).
        round_number : int
            Number of the round.
        law : float
            Power of the mass in the law within a group.
        """
        generator = np.random.default_rng(np.random.SeedSequence((seed, number, round_number, 0x41524E41)))
        whole = np.floor(self.number)
        drawn = (whole + (generator.random(len(whole)) < self.number - whole)).astype(np.int64)
        row = np.repeat(np.arange(len(drawn)), drawn)
        if not row.size:
            raise InputError("arena: the table holds no fragment in this realisation")
        edges = np.cos(np.radians(self.zones))
        low, high = edges[self.zone[row] + 1], edges[self.zone[row]]
        cosine = low + (high - low) * generator.random(row.size)
        turn = 2.0 * np.pi * generator.random(row.size)
        sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
        require_number("arena", "shape_factor", shape_factor, "kg/m3")
        place = real_array("arena", "position", position, "m")
        along = real_array("arena", "axis", axis, "", (3,))
        if not along.any():
            raise InputError("arena: axis is [0, 0, 0], needed: a direction")
        along = along / np.linalg.norm(along)
        first = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
        first = first / np.linalg.norm(first)
        second = np.cross(along, first)
        way = cosine[:, None] * along + sine[:, None] * (
            np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second
        )  # fmt: skip
        mass = _within_groups(self, law, row, generator.random(row.size))
        beyond = np.clip(self.max_speed - self.speed, 0.0, self.speed)[row]
        speed = self.speed[row] + beyond * (generator.random(row.size) + generator.random(row.size) - 1.0)
        return Fragments(mass, tuple(place), speed[:, None] * way, shape_factor, round_number)

    def write(self, path: Path) -> Path:
        """Write the file."""
        columns: list[NDArray[Any]] = [
            self.zones[self.zone], self.zones[self.zone + 1], self.mass_from, self.mass_to, self.number, self.mass,
            self.speed, self.max_speed,
        ]  # fmt: skip
        return write_columns(path, dict(zip(COLUMNS, columns, strict=True)))

    @classmethod
    def read(cls, path: Path) -> ArenaTable:
        """Read what `write` wrote, or a test's own file with these columns; `max_speed_m_s` may be missing.

        Raises
        ------
        InputError
            A column is missing (any unit of its dimension will do), zones leave a gap or overlap, or a value is not
            possible, such as a mean mass outside its own group of mass; the message names the file.
        """
        table = in_columns_of(path, read_columns(path, "arena"), COLUMNS)
        missing = [name for name in COLUMNS[:-1] if name not in table]
        if missing:
            raise InputError(
                f"{path}: column {', '.join(missing)} missing; found {', '.join(table)}; needed: {', '.join(COLUMNS)}"
                f"{import_hint(path, 'arena')}"
            )
        starts, ends = table["zone_from_deg"], table["zone_to_deg"]
        zones = np.unique(np.round(np.concatenate([starts, ends]), 9))
        zone = np.searchsorted(zones, np.round(starts, 9))
        beyond = np.round(ends, 9) != zones[np.minimum(zone + 1, len(zones) - 1)]
        if beyond.any():
            row = int(np.argmax(beyond)) + 1
            raise InputError(f"{path}: the zone of row {row} overlaps another; zones must follow each other")
        covered = np.setdiff1d(np.arange(len(zones) - 1), zone)
        if covered.size:
            raise InputError(
                f"{path}: nothing from {zones[covered[0]]:g} to {zones[covered[0] + 1]:g} degrees; a zone without "
                "fragments needs a row with number 0"
            )
        speed = table["mean_speed_m_s"]
        number = float(table["number"].sum())
        mean = float((table["number"] * table["mean_mass_kg"]).sum()) / number if number > 0.0 else LIGHTEST_MEAN
        if 0.0 < mean < LIGHTEST_MEAN:
            raise InputError(
                f"{path}: mean_mass_kg: the mean of all fragments is {mean:.3g} kg; allowed: at least "
                f"{LIGHTEST_MEAN:g} kg (1 mg), lighter ones are not fragments that a test collects (is it in kg?)"
            )
        try:
            return cls(
                zones, zone.astype(np.int64), table["mass_from_kg"], table["mass_to_kg"], table["number"],
                table["mean_mass_kg"], speed, table.get("max_speed_m_s", speed),
            )  # fmt: skip
        except InputError as error:
            raise InputError(f"{path}: {error}") from None


def _sums(
    row: NDArray[np.intp], size: int, number: Array, mass: Array, speed: Array, max_speed: Array
) -> tuple[Array, Array, Array, Array]:
    """Numbers, masses (kg), mean speeds by mass and largest speeds (size,) of what goes into each row."""
    numbers, masses, moments = (
        np.bincount(row, weights=one, minlength=size).astype(np.float64) for one in (number, mass, mass * speed)
    )
    largest = np.zeros(size)
    np.maximum.at(largest, row, max_speed)
    return numbers, masses, moments / np.maximum(masses, 1e-300), largest


@lru_cache(maxsize=8)
def _steepness(table: ArenaTable, law: float) -> tuple[Array, Array, Array]:
    """Edges a and b of every group in x = m^law, and u of the density exp(-u (x - a) / (b - a)) with its mean mass."""
    heaviest = np.maximum(table.total_mass, table.mass)
    low = np.minimum(table.mass_from, table.mass)
    high = np.maximum(np.minimum(table.mass_to, heaviest), table.mass)
    a, b = low**law, high**law
    x, w = np.polynomial.legendre.leggauss(48)
    lower, upper = np.full(len(low), -5.0), np.full(len(low), 30.0)  # of asinh u
    for _ in range(60):
        middle = 0.5 * (lower + upper)
        u = np.sinh(middle)[:, None]
        reach = np.minimum(1.0, 40.0 / np.maximum(u, 1e-300))  # beyond it nothing is left of a steep law
        y = np.where(u > 0.0, reach, 1.0) * 0.5 * (x + 1.0)
        weight = w * np.exp(-u * (y - np.where(u < 0.0, 1.0, 0.0)))
        mass = (a[:, None] + (b - a)[:, None] * y) ** (1.0 / law)
        heavy = (weight * mass).sum(axis=1) > table.mass * weight.sum(axis=1)
        lower, upper = np.where(heavy, middle, lower), np.where(heavy, upper, middle)
    return a, b, np.sinh(0.5 * (lower + upper))


def _within_groups(table: ArenaTable, law: float, row: NDArray[np.int64], quantile: Array) -> Array:
    """Masses (kg) at quantiles of the law within the groups of the rows."""
    a, b, u = (one[row] for one in _steepness(table, law))
    steep = np.where(np.abs(u) > 1e-6, u, 1e-6)
    y = -np.log1p(quantile * np.expm1(-steep)) / steep
    return np.maximum((a + (b - a) * y) ** (1.0 / law), DUST)


def is_arena_file(path: Path) -> bool:
    """Whether a file's first line that is no comment names the columns of an arena table."""
    if path.suffix.lower() != ".csv" or not path.is_file():
        return False
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        head = next((line for line in file if line.strip() and not line.startswith("#")), "")
    try:
        return "zone_from_deg" in column_names(path, head)[0]
    except InputError:
        return False  # whoever reads it says what is wrong
