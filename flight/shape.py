"""Shape factors k (kg/m3) in the presented area A = (m/k)^(2/3) of a fragment: known values, and models that draw them.

For a convex body that tumbles without preference the mean presented area is a quarter of its surface
(Cauchy 1832), so k = m / (S/4)^(3/2) depends on the shape and the density only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.arguments import real_array, require_number
from flight.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray


FORGED_STEEL_SHELL = 2600.0  # kg/m3; DDESB Technical Paper 12 (1975)
NATURAL_FRAGMENTS_MEAN = 2370.0  # kg/m3; mean over natural fragments
HEAVY_PIECES_OF_STACKS = 4740.0  # kg/m3; chunky pieces from stacks
BOX_5_2_1_STEEL = 3147.0  # kg/m3; tumbling 5:2:1 box of 7800 kg/m3, A = 8.5 (m/(10 rho))^(2/3)
DEFAULT_SHAPE_FACTOR = FORGED_STEEL_SHELL


def box_shape_factor(density: float, length: float, width: float, height: float) -> float:
    """Shape factor (kg/m3) of a tumbling rectangular box of a density (kg/m3); only the ratios of the edges matter."""
    for name, value in (("length", length), ("width", width), ("height", height)):
        require_number("shape", name, value, "m")
    require_number("shape", "density", density, "kg/m3")
    quarter_surface = 0.5 * (length * width + width * height + height * length)
    return density * length * width * height / quarter_surface**1.5


@dataclass(frozen=True)
class Mean:
    """One shape factor for all (kg/m3): the fixed mean area."""

    shape_factor: float = DEFAULT_SHAPE_FACTOR

    def __post_init__(self) -> None:
        require_number("shape", "shape factor of the mean", self.shape_factor, "kg/m3", above=0.0)

    def factors(self, kinds: NDArray[np.int64], seed: int) -> NDArray[np.float64]:  # noqa: ARG002 - nothing is drawn
        """Shape factors (n,) in kg/m3 of fragments of `kinds` (n, 2): round and segment."""
        return np.full(len(kinds), float(self.shape_factor))


@dataclass(frozen=True)
class Lognormal:
    """A shape factor for each fragment, lognormal about a median (kg/m3).

    `spread` is the standard deviation of ln k. There is no published law of the spread that we know of: a value is an
    assumption of the user, 0.2 for instance puts two of three fragments within 20 % of the median.
    """

    spread: float
    median: float = NATURAL_FRAGMENTS_MEAN

    def __post_init__(self) -> None:
        require_number("shape", "median of the lognormal", self.median, "kg/m3", above=0.0)
        require_number("shape", "spread of the lognormal", self.spread, "", low=0.0, high=2.0)

    def factors(self, kinds: NDArray[np.int64], seed: int) -> NDArray[np.float64]:
        """Shape factors (n,) in kg/m3 of fragments of `kinds` (n, 2): round and segment.

        Drawn by the rows of each segment: a row more changes no other segment.
        """
        normal = np.empty(len(kinds))
        different, kind = np.unique(kinds, axis=0, return_inverse=True)
        for number, key in enumerate(different + 1):  # -1: unknown
            stream = np.random.SeedSequence(seed, spawn_key=(_STREAM, *map(int, key)))
            rows = np.flatnonzero(kind.ravel() == number)
            normal[rows] = np.random.Generator(np.random.Philox(stream)).standard_normal(rows.size)
        return self.median * np.exp(self.spread * normal)


@dataclass(frozen=True)
class Box:
    """Fragments as tumbling rectangular boxes: the mean area, a quarter of the surface."""

    ratios: tuple[float, float, float] = (5.0, 2.0, 1.0)
    """(3,) floats: of the edges; 5:2:1 is the box of Wang et al."""
    density: float = 7800.0
    """Of the casing's material (kg/m3)."""

    def __post_init__(self) -> None:
        if not (real_array("shape", "ratios of the box", self.ratios, "", (3,)) > 0.0).all():
            raise InputError(f"shape: ratios of the box are {self.ratios}, needed: three finite numbers above zero")
        require_number("shape", "density of the box", self.density, "kg/m3", above=0.0)

    def factors(self, kinds: NDArray[np.int64], seed: int) -> NDArray[np.float64]:  # noqa: ARG002 - nothing is drawn
        """Shape factors (n,) in kg/m3 of fragments of `kinds` (n, 2): round and segment."""
        return np.full(len(kinds), box_shape_factor(self.density, *self.ratios))


Shape = Mean | Lognormal | Box


def describe(shape: Shape | None, factors: NDArray[np.float64]) -> dict[str, Any]:
    """What the summary says of the presented areas: model, and the shape `factors` (n,) in kg/m3 that were flown."""
    known: dict[str, Any] = {"model": "as given"} if shape is None else {"model": type(shape).__name__.lower()}
    if isinstance(shape, Box):
        known |= {"ratios": list(shape.ratios)}
    if isinstance(shape, Lognormal):
        known |= {"spread": shape.spread}
    low, middle, high = np.percentile(factors, (5.0, 50.0, 95.0)) if len(factors) else (0.0, 0.0, 0.0)
    return {
        **known, "shape_factor_5_percent": float(low), "shape_factor_median": float(middle),
        "shape_factor_95_percent": float(high),
    }  # fmt: skip


_STREAM = 0x5AFE  # distinguishes this stream from others of the same seed
