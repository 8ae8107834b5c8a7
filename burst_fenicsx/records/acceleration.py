"""What the casings' kinetic energies tend to, and with it the end of the burst."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse.csgraph import connected_components

from burst_fenicsx.kernels.constants import ASYMPTOTE_GROWTH, STEADY_ASYMPTOTE
from fragfield_base.elementary import power

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.materials.products import Products
    from burst_fenicsx.problem import Leakage


_FEWEST_ENTRIES = 4  # of which a line is taken


class Acceleration:
    """Kinetic energy of the casings beside the mean radii of their charges, and its asymptote.

    Thin products have P ~ v^-gamma with v ~ r^2, and vent by (r_cr / r)^beta (Eq. 7): their power P r dr/dt gives

        K(r) = K_inf - C r^-n,    n = 2 (gamma - 1) + beta

    K_inf is the intercept of the line of least squares of K over r^-n, taken while r grows by `ASYMPTOTE_GROWTH`. The
    slope of ln K over ln r would give the same on that branch, but that of the middle of the window: 1 % more.

    Rounds that have touched form a group, in which contact hands on what the gas of any does: no round of it has an
    asymptote of its own, only their sum has. There K and r^-n are those of the group, each round's r^-n by what its gas
    would do beyond its initial radius, E r_0^n, and every K is taken over it: the intercepts add up to the group's.

    Parameters
    ----------
    products : of each round. leakage : of all.
    left : fraction of a group's kinetic energy that may still be to come at the end.
    energies : (rounds,) J, chemical energies of the charges. radii : (rounds,) m, mean initial ones.

    Attributes
    ----------
    rows : entry after entry: time (s), kinetic energies (rounds) in J, mean radii (rounds) in m.
    asymptotes : entry after entry: K_inf (rounds) in J, NaN where there is none yet, and of rounds not initiated.
    excess : entry after entry, 1 where the burst ends: the largest, over the groups of rounds that have been initiated,
        of what is left over `left` and of the change of K_inf over `STEADY_ASYMPTOTE` of it.
    touched : (rounds, rounds), which rounds have touched each other so far.
    """

    def __init__(
        self, products: Sequence[Products], leakage: Leakage, left: float, energies: np.ndarray, radii: np.ndarray
    ) -> None:
        beta = leakage.beta if leakage.enabled else 0.0
        self._exponents = np.array([2.0 * (item.dilute_exponent - 1.0) + beta for item in products])
        self._weights = energies * power(radii, self._exponents)
        self._left = left
        self.rows: list[np.ndarray] = []
        self.asymptotes: list[np.ndarray] = []
        self.excess: list[float] = []
        self.touched = np.eye(len(products), dtype=bool)

    def record(self, time: float, energies: np.ndarray, radii: np.ndarray, initiated: np.ndarray) -> None:
        """Take the casings' kinetic energies (rounds,) in J and mean radii (rounds,) in m at a time (s).

        Rounds that nothing has `initiated` (rounds,) have no asymptote and are not waited for.
        """
        self.rows.append(np.concatenate([[time], energies, radii]))
        count = len(energies)
        rows, asymptote, excess = np.array(self.rows), np.full(count, np.nan), np.full(count, np.inf)
        among = np.flatnonzero(initiated)
        groups, group = len(among), np.zeros(len(among), dtype=np.int32)
        if groups > 1:
            groups, group = connected_components(self.touched[np.ix_(among, among)], directed=False)
        for members in (among[group == index] for index in range(groups)):
            energy, weight = rows[:, 1 + members], self._weights[members] / self._weights[members].sum()
            radius = rows[:, 1 + count + members]
            window = _since_growth(radius @ weight)
            if window < 0 or len(rows) - window < _FEWEST_ENTRIES or not energy[-1].sum() > 0.0:
                continue
            thinning = power(radius[window:], -self._exponents[members]) @ weight
            offset = thinning - thinning.mean()
            slope = (offset @ energy[window:]) / (offset @ offset)
            asymptote[members] = energy[window:].mean(axis=0) - slope * thinning.mean()
            of_group = asymptote[members].sum()
            before = [row[members].sum() for row in self.asymptotes[window:]]
            change = np.ptp([*before, of_group]) / of_group  # NaN before there are enough
            left = of_group / energy[-1].sum() - 1.0
            if np.isfinite(change):
                excess[members] = max(abs(left) / self._left, abs(change) / STEADY_ASYMPTOTE)
        self.asymptotes.append(asymptote)
        self.excess.append(float(excess[initiated].max(initial=0.0)) if initiated.any() else np.inf)

    def end(self) -> float:
        """Time (s) at which the burst is over, by the last two entries: their own, or one to come; infinite if none."""
        if self.excess and self.excess[-1] <= 1.0:
            return float(self.rows[-1][0])
        before, last = self.excess[-2:] if len(self.excess) > 1 else (np.inf, np.inf)
        if not last < before < np.inf:
            return np.inf
        times = self.rows[-2][0], self.rows[-1][0]
        return float(times[1] + (last - 1.0) / (before - last) * (times[1] - times[0]))

    def left(self) -> np.ndarray:
        """Fraction of its kinetic energy that each casing would still gain (rounds,), K_inf / K - 1; or NaN."""
        count = len(self._exponents)
        with np.errstate(divide="ignore", invalid="ignore"):  # of a casing at rest
            return np.asarray(self.asymptotes[-1] / self.rows[-1][1 : 1 + count] - 1.0)

    def array(self) -> np.ndarray:
        """All entries for a checkpoint (entries, 2 + 3 rounds): rows, asymptotes, excess."""
        return np.column_stack([self.rows, self.asymptotes, self.excess])

    def restore(self, entries: np.ndarray, touched: np.ndarray) -> None:
        """Go on from what `array` gave, and `touched`."""
        count = len(self._exponents)
        rows, asymptotes, excess = np.split(entries, [1 + 2 * count, 1 + 3 * count], axis=1)
        self.rows, self.asymptotes, self.excess = list(rows), list(asymptotes), excess[:, 0].tolist()
        self.touched[:] = touched


def _since_growth(radius: np.ndarray) -> int:
    """First entry since which the last radius has grown by `ASYMPTOTE_GROWTH`; -1 before."""
    smaller = np.flatnonzero(radius * ASYMPTOTE_GROWTH < radius[-1])
    return int(smaller[-1]) if len(smaller) else -1
