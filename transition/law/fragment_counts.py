"""Fragments of a test counted by mass: groups of mass that follow each other, and how many pieces lie in each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fragfield_base.arrays import group_outside
from transition.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray


FEWEST = 20
"""Pieces below which no mean mass is fitted: its standard error would be 45 % or more."""


@dataclass(frozen=True)
class FragmentCounts:
    """Pieces counted in a test, by groups of mass. SI units.

    Attributes
    ----------
    source : str
        Name of the file, for messages.
    edges : tuple of float
        Rising edges of the groups (kg), the lightest from 0 upwards; pieces lighter than it were not counted. As many
        as there are groups: the last group has no upper end; one more: pieces heavier than the last edge were not
        counted either.
    number : tuple of float
        Pieces of each group, of all rounds together.
    rounds : float
        Rounds that these pieces come from; below 1 where only a part of one round's fragments was caught.
    mass : tuple of float or None
        Mass of the pieces of each group (kg), where they were weighed.
    scale : float
        Factor on the mean masses that are fitted, for studies of their uncertainty.

    Raises
    ------
    InputError
        On groups that do not rise, numbers that are no counts, or fewer than `FEWEST` pieces or two groups with pieces.
    """

    source: str
    edges: tuple[float, ...]
    number: tuple[float, ...]
    rounds: float = 1.0
    mass: tuple[float, ...] | None = None
    scale: float = 1.0

    def __post_init__(self) -> None:
        where = f"{self.source}: fragments by mass"
        edges, number = np.asarray(self.edges, dtype=float), np.asarray(self.number, dtype=float)
        if len(edges) - len(number) not in (0, 1) or not len(number):
            raise InputError(f"{where}: {len(edges)} edges for {len(number)} groups; allowed: as many, or one more")
        if not (np.isfinite(edges).all() and edges[0] >= 0.0 and (np.diff(edges) > 0.0).all()):
            raise InputError(f"{where}: masses must rise from group to group, from 0 or more upwards")
        _counts(where, "number", number)
        if self.mass is not None:
            self._check_masses(where)
        for name, value in (("rounds", self.rounds), ("scale", self.scale)):
            if not 0.0 < value < math.inf:
                raise InputError(f"{where}: {name} is {value:g}; a number above zero is needed")
        if number.sum() < FEWEST:
            raise InputError(f"{where}: {number.sum():g} pieces; at least {FEWEST} are needed to fit a mean mass")
        if (number > 0.0).sum() < 2:
            raise InputError(f"{where}: all pieces lie in one group of mass; pieces in two groups or more are needed")

    def _check_masses(self, where: str) -> None:
        mass, number, ends = np.asarray(self.mass, dtype=float), np.asarray(self.number), self.ends
        if mass.shape != number.shape:
            raise InputError(f"{where}: {len(mass)} masses for {len(number)} groups")
        _counts(where, "mass", mass)
        group = group_outside(number, mass, ends[:-1], ends[1:])
        if group is not None:
            raise InputError(
                f"{where}: {number[group]:g} pieces of {ends[group]:g} to {ends[group + 1]:g} kg weigh "
                f"{mass[group]:g} kg together; allowed: {number[group] * ends[group]:g} to "
                f"{number[group] * ends[group + 1]:g} kg"
            )

    @property
    def ends(self) -> NDArray[np.float64]:
        """Edges of all groups (kg), infinite where the last group is open."""
        edges = np.asarray(self.edges, dtype=np.float64)
        return edges if len(edges) > len(self.number) else np.append(edges, np.inf)

    @property
    def pieces(self) -> float:
        """Number of all pieces."""
        return float(sum(self.number))

    @property
    def label(self) -> str:
        """What was counted, in words."""
        ends = self.ends
        lightest = f"above {1e3 * ends[0]:.3g} g" if ends[0] > 0.0 else "of any mass"
        if math.isfinite(ends[-1]):
            lightest = f"of {1e3 * ends[0]:.3g} to {1e3 * ends[-1]:.3g} g"
        return f"{self.pieces:.10g} pieces {lightest}"


def _counts(where: str, name: str, values: NDArray[np.float64]) -> None:
    bad = ~(np.isfinite(values) & (values >= 0.0))
    if bad.any():
        group = int(np.argmax(bad))
        raise InputError(f"{where}: {name} of group {group + 1} is {values[group]:g}; needed: 0 or more")
