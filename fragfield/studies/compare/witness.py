"""Means over realisations with their errors, ratios of two, and hits on one witness surface divided by sector."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray


_COLUMNS = (
    "hits",
    "hazardous_hits",
    "max_initial_speed",
    "mean_initial_speed",
    "mean_initial_speed_by_number",
)
"""What is compared: numbers, and initial speeds (m/s), the largest, the mean by mass and the mean by number."""
_NUMBERS = ("hits", "hazardous_hits")
_USUAL = 15.0  # degrees


@dataclass(frozen=True, eq=False)
class Estimates:
    """Values (k,) with their standard errors (k,); NaN where there is no value, or no error to be known."""

    value: NDArray[np.float64]
    error: NDArray[np.float64]

    @classmethod
    def single(cls, value: float | None, error: float | None) -> Estimates:
        """One value; None for what is not known."""
        return cls(*(np.array([np.nan if one is None else one]) for one in (value, error)))

    def over(self, other: Estimates) -> Estimates:
        """Ratios to independent estimates, the errors taken to first order; NaN over zero."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(other.value != 0.0, self.value / other.value, np.nan)
            return Estimates(ratio, np.hypot(self.error, ratio * other.error) / np.abs(other.value))


def estimate(each: NDArray[np.float64]) -> Estimates:
    """Mean over the realisations and its standard error.

    `each` (n, k): one row a realisation; NaN where a realisation says nothing, which then does not count.
    """
    known = ~np.isnan(each)
    number = known.sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(known, each, 0.0).sum(axis=0) / number
        variance = (np.where(known, each - mean, 0.0) ** 2).sum(axis=0) / (number - 1)
        error = np.where(number > 1, np.sqrt(variance / number), np.nan)
    return Estimates(mean, error)


def compared(run: Estimates, reference: Estimates) -> list[dict[str, float | None]]:
    """One row a value: run, reference and ratio, each with its standard error; None where there is none."""
    ratio = run.over(reference)
    columns = {
        name: np.broadcast_to(values, ratio.value.shape)
        for key, found in (("run", run), ("reference", reference), ("ratio", ratio))
        for name, values in ((key, found.value), (f"{key}_error", found.error))
    }
    return [
        {name: None if math.isnan(values[i]) else float(values[i]) for name, values in columns.items()}
        for i in range(ratio.value.size)
    ]


def sectors_together(sectors: int, width: float | None) -> int:
    """How many of the runs' sectors make one of the comparison, an odd number so that centres stay centres.

    `sectors`: of the runs; `width`: asked for (degrees); None: 15 degrees where that is possible, else the runs' own.
    Raises InputError: the width is no odd multiple of the runs' own, or no whole fraction of the circle.
    """
    allowed = {together * 360.0 / sectors: together for together in range(1, sectors + 1, 2) if sectors % together == 0}
    if width is None:
        return allowed.get(_USUAL, 1)
    near = [together for own, together in allowed.items() if abs(own - width) < 1e-6 * own]
    if not near:
        known = ", ".join(f"{own:g}" for own in allowed)
        raise InputError(f"--sector: found {width:g}; allowed: {known} degrees, odd multiples of the runs' sectors")
    return near[0]


def compare_hits(
    run: NDArray[Any], reference: NDArray[Any], together: int, *, all_round: bool = False
) -> dict[str, Any]:
    """Ratios of the hits on a surface.

    Parameters
    ----------
    run, reference : (n, s) and (m, s) arrays of flight.hazard.density.sectors.SECTOR_HITS
        Hits by realisation and sector.
    together : int
        Sectors that make one of the comparison.
    all_round : bool
        Divide by the reference's mean over all azimuths: for a round that is alike all round, with less scatter.

    Returns
    -------
    dict
        "total" over all azimuths, and "by_azimuth", one row a sector with `azimuth_deg` and, for each of `_COLUMNS`, a
        table as `compared` has it. A sector's speeds are means over the realisations that hit it.
    """
    sectors = run.shape[1]
    total = _rows(_values(_grouped(run, sectors)), _values(_grouped(reference, sectors)))[0]
    mine, other = _values(_grouped(run, together)), _values(_grouped(reference, together))
    if all_round:
        other = {name: _mean_over_sectors(values) for name, values in other.items()}
    width = 360.0 / sectors * together
    rows = [{"azimuth_deg": index * width, **row} for index, row in enumerate(_rows(mine, other))]
    return {"total": total, "sector_width_deg": width, "by_azimuth": rows}


def _rows(run: dict[str, NDArray[np.float64]], reference: dict[str, NDArray[np.float64]]) -> list[dict[str, Any]]:
    columns = {name: compared(estimate(run[name]), estimate(reference[name])) for name in _COLUMNS}
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _grouped(table: NDArray[Any], together: int) -> NDArray[Any]:
    """Neighbouring sectors (n, s / together, together); the middle one of the first group is the first sector."""
    turned = np.roll(table, together // 2, axis=1)
    return turned.reshape(len(table), -1, together)


def _values(group: NDArray[Any]) -> dict[str, NDArray[np.float64]]:
    """Every quantity by realisation and sector (n, k); speeds are NaN where nothing hit."""
    hits = group["hits"].sum(axis=2)
    mass = group["mass"].sum(axis=2)
    momentum = (group["mass"] * group["mean_initial_speed"]).sum(axis=2)
    by_number = (group["hits"] * group["mean_initial_speed_by_number"]).sum(axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        return {
            **{name: group[name].sum(axis=2).astype(np.float64) for name in _NUMBERS},
            "max_initial_speed": np.where(hits > 0, group["max_initial_speed"].max(axis=2), np.nan),
            "mean_initial_speed": np.where(mass > 0.0, momentum / mass, np.nan),
            "mean_initial_speed_by_number": np.where(by_number > 0.0, by_number / hits, np.nan),
        }


def _mean_over_sectors(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean of every realisation over its sectors (n, 1)."""
    known = ~np.isnan(values)
    with np.errstate(invalid="ignore"):
        mean = np.where(known, values, 0.0).sum(axis=1) / known.sum(axis=1)
    return np.asarray(mean[:, None])
