"""Air at rest: density and speed of sound over height."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple, Protocol

import numpy as np

from flight.arguments import require_number
from flight.scene.tables import hermite_pieces
from fragfield_base.bounds import Bounds, OnlyWith
from fragfield_base.inputs import Length, Quantity, Speed

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


EARTH_RADIUS = 6_356_766.0  # m; of the geopotential altitude, US Standard Atmosphere 1976, section 1.2.5
STANDARD_GRAVITY = 9.80665  # m/s2; the same section
GAS_CONSTANT = 8314.32 / 28.9644  # J/(kg K); the 1976 value of R* over the molar mass
RATIO_OF_HEATS = 1.4
LAYER_BASE = np.array([0.0, 11e3, 20e3, 32e3, 47e3, 51e3, 71e3, 84.852e3])  # geopotential m, table 4
LAYER_LAPSE = np.array([-6.5e-3, 0.0, 1.0e-3, 2.8e-3, 0.0, -2.8e-3, -2.0e-3])  # K per geopotential m
SEA_LEVEL_TEMPERATURE = 288.15  # K
SEA_LEVEL_PRESSURE = 101_325.0  # Pa
TABLE_BOTTOM, TABLE_TOP, TABLE_STEP = -5000.0, 84_800.0, 100.0  # geopotential m; layer bases fall on entries


class AirTable(NamedTuple):
    """What the kernels read: cubics of equal width in geopotential height, constant beyond the ends."""

    bottom: float
    step: float
    """Geopotential altitude of the first entry and width of a piece (m)."""
    pieces: NDArray[np.float64]
    """(n, 8) float64: coefficients of the density (kg/m3) and of one over the speed of sound (s/m), in powers of the
    height above the piece's lower end."""
    site_altitude: float
    """Altitude of z = 0 above sea level (m)."""


class Air(Protocol):
    """Anything that gives density and sound speed at a height z (m) of the world, and their table."""

    def density(self, height: ArrayLike) -> NDArray[np.float64]:
        """Density (kg/m3) at heights z (m)."""
        ...

    def sound_speed(self, height: ArrayLike) -> NDArray[np.float64]:
        """Speed of sound (m/s) at heights z (m)."""
        ...

    def table(self) -> AirTable:
        """Return the table that the kernels read."""
        ...


@dataclass(frozen=True)
class ConstantAir:
    """Air of one density (kg/m3) and one speed of sound (m/s) at every height; density 0 is a vacuum."""

    density_everywhere: float = 1.225
    sound_speed_everywhere: float = 340.294

    def __post_init__(self) -> None:
        require_number("air", "density_everywhere", self.density_everywhere, "kg/m3", low=0.0)
        require_number("air", "sound_speed_everywhere", self.sound_speed_everywhere, "m/s", above=0.0)

    def density(self, height: ArrayLike) -> NDArray[np.float64]:
        """Density (kg/m3) at heights z (m)."""
        return np.full(np.shape(height), self.density_everywhere)

    def sound_speed(self, height: ArrayLike) -> NDArray[np.float64]:
        """Speed of sound (m/s) at heights z (m)."""
        return np.full(np.shape(height), self.sound_speed_everywhere)

    def table(self) -> AirTable:
        """Return the table that the kernels read: one constant piece."""
        piece = [self.density_everywhere, 0.0, 0.0, 0.0, 1.0 / self.sound_speed_everywhere, 0.0, 0.0, 0.0]
        return AirTable(0.0, 1.0, np.array([piece]), 0.0)


VACUUM = ConstantAir(0.0)


@dataclass(frozen=True)
class StandardAtmosphere:
    """US Standard Atmosphere 1976 (NOAA-S/T 76-1562), from 5 km below the sea to 84.8 km, constant beyond.

    `site_altitude` is the altitude of z = 0 above sea level (m). `temperature_offset` (K) is added to the temperature
    at every height; pressures stay those of the standard.
    """

    site_altitude: float = 0.0
    temperature_offset: float = 0.0

    def __post_init__(self) -> None:
        require_number("air", "site_altitude", self.site_altitude, "m", low=-5000.0, high=84_000.0)
        require_number("air", "temperature_offset", self.temperature_offset, "K", low=-80.0, high=80.0)

    def density(self, height: ArrayLike) -> NDArray[np.float64]:
        """Density (kg/m3) at heights z (m)."""
        temperature, pressure, _ = self._state(self._geopotential(height))
        return np.asarray(pressure / (GAS_CONSTANT * temperature))

    def sound_speed(self, height: ArrayLike) -> NDArray[np.float64]:
        """Speed of sound (m/s) at heights z (m)."""
        temperature, _, _ = self._state(self._geopotential(height))
        return np.asarray(np.sqrt(RATIO_OF_HEATS * GAS_CONSTANT * temperature))

    def temperature(self, height: ArrayLike) -> NDArray[np.float64]:
        """Temperature (K) at heights z (m)."""
        return self._state(self._geopotential(height))[0]

    def pressure(self, height: ArrayLike) -> NDArray[np.float64]:
        """Pressure (Pa) at heights z (m)."""
        return self._state(self._geopotential(height))[1]

    def table(self) -> AirTable:
        """Return the table that the kernels read; its error is below 1e-9 of the value."""
        return _standard_table(self)

    def _table(self) -> AirTable:
        entries = np.arange(TABLE_BOTTOM, TABLE_TOP + 0.5 * TABLE_STEP, TABLE_STEP)
        columns = []
        middle = 0.5 * (entries[:-1] + entries[1:])
        layer = self._layer(middle)  # of each piece, so that kinks between layers stay sharp
        for quantity in (self._density_and_slope, self._slowness_and_slope):
            value = quantity(entries, self._layer(entries))[0]
            after = np.append(quantity(entries[:-1], layer)[1], 0.0)
            before = np.insert(quantity(entries[1:], layer)[1], 0, 0.0)
            columns.append(hermite_pieces(entries, value, after, before))
        return AirTable(TABLE_BOTTOM, TABLE_STEP, np.ascontiguousarray(np.hstack(columns)), self.site_altitude)

    def _geopotential(self, height: ArrayLike) -> NDArray[np.float64]:
        altitude = np.asarray(height, dtype=np.float64) + self.site_altitude
        return np.clip(EARTH_RADIUS * altitude / (EARTH_RADIUS + altitude), TABLE_BOTTOM, TABLE_TOP)

    @staticmethod
    def _layer(geopotential: NDArray[np.float64]) -> NDArray[np.intp]:
        return np.clip(np.searchsorted(LAYER_BASE, geopotential, side="right") - 1, 0, LAYER_LAPSE.size - 1)

    def _state(
        self, geopotential: NDArray[np.float64], layer: NDArray[np.intp] | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Temperature (K), pressure (Pa) and lapse (K/m), equations 23 and 33 of the standard."""
        index = self._layer(geopotential) if layer is None else layer
        base_temperature, base_pressure = _layer_bases()
        lapse, rise = LAYER_LAPSE[index], geopotential - LAYER_BASE[index]
        temperature = base_temperature[index] + lapse * rise
        isothermal = lapse == 0.0
        exponent = STANDARD_GRAVITY / GAS_CONSTANT
        power = (base_temperature[index] / temperature) ** (exponent / np.where(isothermal, 1.0, lapse))
        decay = np.exp(-exponent * rise / base_temperature[index])
        pressure = np.asarray(base_pressure[index] * np.where(isothermal, decay, power))
        return temperature + self.temperature_offset, pressure, lapse

    def _density_and_slope(
        self, geopotential: NDArray[np.float64], layer: NDArray[np.intp]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        temperature, pressure, lapse = self._state(geopotential, layer)
        density = pressure / (GAS_CONSTANT * temperature)
        fall = STANDARD_GRAVITY / (GAS_CONSTANT * (temperature - self.temperature_offset))  # of the pressure
        return density, np.asarray(-density * (fall + lapse / temperature))

    def _slowness_and_slope(
        self, geopotential: NDArray[np.float64], layer: NDArray[np.intp]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        temperature, _, lapse = self._state(geopotential, layer)
        slowness = 1.0 / np.sqrt(RATIO_OF_HEATS * GAS_CONSTANT * temperature)
        return slowness, -0.5 * slowness * lapse / temperature


@lru_cache(maxsize=8)
def _standard_table(air: StandardAtmosphere) -> AirTable:
    return air._table()


@lru_cache(maxsize=1)
def _layer_bases() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    temperature, pressure = [SEA_LEVEL_TEMPERATURE], [SEA_LEVEL_PRESSURE]
    for thickness, lapse in zip(np.diff(LAYER_BASE)[:-1], LAYER_LAPSE[:-1], strict=True):
        start, end = temperature[-1], temperature[-1] + lapse * thickness
        factor = (
            (start / end) ** (STANDARD_GRAVITY / (GAS_CONSTANT * lapse))
            if lapse
            else math.exp(-STANDARD_GRAVITY * thickness / (GAS_CONSTANT * start))
        )
        temperature.append(end)
        pressure.append(pressure[-1] * factor)
    return np.array(temperature), np.array(pressure)


@dataclass(frozen=True)
class AirLaw:
    """The air that fragments fly through, as a case says it."""

    model: Literal["standard", "constant"] = "standard"
    """The US Standard Atmosphere 1976, or one density everywhere."""
    altitude: Annotated[
        Length | None,
        Bounds(-500.0, 8e4, "the atmosphere is tabulated up to 84.9 km", usual=(-500.0, 6000.0)),
        OnlyWith("model", ("standard",)),
    ] = None
    """Altitude of z = 0 above sea level, for model = "standard"; left out: the map's height of z = 0, else 0."""
    temperature_offset: Annotated[
        float,
        Quantity("K", "0 K"),
        Bounds(-80.0, 80.0, "no air near the ground is that far from 15 degrees Celsius", usual=(-45.0, 35.0)),
        OnlyWith("model", ("standard",)),
    ] = 0.0
    """Added to the temperature of the standard atmosphere (15 degrees Celsius at sea level), whose pressure stays."""
    density: Annotated[
        float | None,
        Quantity("kg/m^3", "1.225 kg/m^3", minimum=0.0),
        Bounds(0.0, 1000.0, "denser than water", usual=(0.0, 2.0)),
        OnlyWith("model", ("constant",), refused=True, needed=("constant",)),
    ] = None
    """For model = "constant"; 0 is a vacuum."""
    sound_speed: Annotated[
        Speed, Bounds(10.0, 1e4, "speeds of sound of gases", usual=(250.0, 400.0)), OnlyWith("model", ("constant",))
    ] = ConstantAir.sound_speed_everywhere
    """For model = "constant"."""

    def air(self) -> Air:
        """The air."""
        if self.model == "constant":
            return ConstantAir(self.density or 0.0, self.sound_speed)
        return StandardAtmosphere(self.altitude or 0.0, self.temperature_offset)
