"""Mean masses fitted to the fragments that a test counted: one scale for all segments of a round.

The segments' mean masses keep the ratios r_s that a law gives them (Eq. 21); the scale k common to all is that of
largest likelihood. With the segments' masses M_s and Mott's law S of mean 1 the expected number heavier than m is

    N(m) = sum over s of M_s / (k r_s) S(m / (k r_s)),   k r_s at most M_s,

and the pieces of the group from a to b are a share p = (N(a) - N(b)) / (N(lowest) - N(highest)) of those in the table's
range. Given their total, the numbers n are multinomial:

    ln L(k) = sum over groups of n ln p(k).

So neither the number of lost pieces nor the casing's mass plays a part in k, as long as losses do not depend on the
mass within the range; the mass that the table holds is compared with the casing's afterwards. The standard error of
ln k is (-d2 ln L / d(ln k)2)^(-1/2). Where Pearson's chi-square rejects the law at the 5 % level, it is multiplied by
sqrt(chi-square / degrees of freedom) (McCullagh and Nelder, Generalized Linear Models, 1989, section 4.5).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from transition.errors import InputError
from transition.law.mott import MottLaw

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from transition.law.fragment_counts import FragmentCounts

    Array = NDArray[np.float64]


MAX_MASS = 1.1
"""Mass of a table's pieces over that of the casings above which they are not of this round; see `mass_margin`."""
MIN_COMPLETENESS = 0.5
"""Mass of a table's pieces over that which the law has in the same range of masses: below, too much was lost."""
_REJECTED = 0.05  # of probability, below which the scatter is more than that of counts
_FEWEST_EXPECTED = 5.0  # pieces in a group of the chi-square
_LIGHTEST = 1e-9  # kg: mean mass at which the search begins
_STEP = 1e-3  # of ln k, for the curvature
_LARGE = 1e6  # kg: a casing that limits no mean mass


@dataclass(frozen=True)
class SegmentMasses:
    """What the fit takes of the segments."""

    relative: tuple[float, ...]
    """Mean masses by the law (kg), of which the ratios count; infinite: the segment stays whole."""
    masses: tuple[float, ...]
    """Masses of the segments (kg)."""
    rounds: int = 1
    """Rounds that they belong to, all alike."""


@dataclass(frozen=True)
class CountFit:
    """Scale of the mean masses by a test, and how well it is known. SI units."""

    counts: FragmentCounts
    """What was counted."""
    scale: float
    """k: factor on the mean masses that were given."""
    mean: float
    """Mean mass of all pieces of the round, the uncounted light ones included (kg)."""
    curvature_error: float
    standard_error: float
    """Standard error of ln k from the likelihood's curvature; the same with the scatter of a law that does not fit."""
    expected: tuple[float, ...]
    """Pieces expected in each group; their sum is that counted."""
    chi_square: float
    """Pearson's, over groups joined until 5 pieces or more are expected in each."""
    degrees: int
    """Its degrees of freedom: groups joined less two; 0: nothing is left to judge the law by."""
    recovered: float | None
    """Mass of the pieces over that of the casings; where they were not weighed, with the law's mean in every group.
    None: the casings are not known."""
    in_range: float
    """Mass fraction that the law has in the table's range of masses."""

    @property
    def factor(self) -> float:
        """Geometric standard deviation of the mean mass."""
        return math.exp(self.standard_error)

    @property
    def completeness(self) -> float | None:
        """Mass of the pieces over that which the law has in the table's range of masses."""
        return None if self.recovered is None else self.recovered / self.in_range

    @property
    def mass_margin(self) -> float:
        """Factor within which the mass of the pieces is known: two standard errors, 1 where they were weighed."""
        return 1.0 if self.counts.mass is not None else math.exp(2.0 * self.standard_error)

    @property
    def probability(self) -> float | None:
        """Probability of a larger chi-square if the law holds; None without degrees of freedom."""
        return _exceeded(self.degrees, self.chi_square)

    @property
    def label(self) -> str:
        """Where the mean mass comes from, in words."""
        return (
            f"fitted to {self.counts.source}, {self.counts.label}, standard error {100.0 * self.standard_error:.2g} %"
        )

    def summary(self) -> dict[str, Any]:
        """The part `test` of `break_up.mean_mass` in summary.json."""
        counts = self.counts
        return {
            "source": counts.source,
            "pieces": counts.pieces,
            "rounds": counts.rounds,
            "what": counts.label,
            "scale": self.scale,
            "mean": self.mean,
            "standard_error": self.standard_error,
            "curvature_error": self.curvature_error,
            "chi_square": self.chi_square,
            "degrees_of_freedom": self.degrees,
            "probability": self.probability,
            "recovered_fraction": self.recovered,
            "fraction_in_range": self.in_range,
            "mass_margin": self.mass_margin,
            "edges": list(counts.edges),
            "number": list(counts.number),
            "expected": list(self.expected),
        }


def expected_numbers(ends: Array, scale: float, relative: Array, masses: Array, law: MottLaw) -> Array:
    """Pieces that the segments of one round have in each group.

    `ends` (g + 1,): edges of the groups (kg); the last may be infinite; `scale`: k; `relative`, `masses` (s,): mean
    masses at k = 1 and masses of the segments (kg); infinite means are of segments that stay whole; `law`: with the
    mean 1.
    """
    mean = np.minimum(scale * relative, masses)
    above = (masses / mean * law.survival(ends[:, None] / mean)).sum(axis=1)
    return above[:-1] - above[1:]


def fit_counts(
    counts: FragmentCounts,
    dimension: Literal[2, 3, "mixed"] = 2,
    mixed_fraction: float = 0.5,
    segments: SegmentMasses | None = None,
) -> CountFit:
    """Fit the scale of largest likelihood.

    `counts`: pieces counted in a test; `dimension`, `mixed_fraction`: of Mott's law, as in `BreakUpSettings`;
    `segments`: of the round; None: one law for all pieces, whose mean (kg) is the scale. Raises InputError: the counts
    determine no scale, hold more than `MAX_MASS` times the casings' mass, or less than `MIN_COMPLETENESS` of what the
    law has in their range.
    """
    law, ends = MottLaw.from_mean(1.0, dimension, mixed_fraction), counts.ends
    known = segments or SegmentMasses((1.0,), (_LARGE,))
    means, metal = np.asarray(known.relative, dtype=np.float64), np.asarray(known.masses, dtype=np.float64)
    counted, whole = np.asarray(counts.number, dtype=np.float64), float(metal.sum())

    def expected_share(logarithm: float) -> Array:
        found = np.maximum(expected_numbers(ends, math.exp(logarithm), means, metal, law), 1e-300)
        return np.asarray(found / found.sum())

    def likelihood(logarithm: float) -> float:
        return float(counted @ np.log(expected_share(logarithm)))

    best = _largest(likelihood, means, whole, counts.source)
    curvature = (likelihood(best + _STEP) - 2.0 * likelihood(best) + likelihood(best - _STEP)) / _STEP**2
    if not curvature < 0.0:
        raise InputError(_undetermined(counts.source))
    error = (-curvature) ** -0.5
    expected = counted.sum() * expected_share(best)
    chi_square, degrees = _chi_square(counted, expected)
    probability = _exceeded(degrees, chi_square)
    rejected = probability is not None and probability < _REJECTED
    scaled = np.minimum(math.exp(best) * means, metal)
    above = (metal * law.mass_fraction_above(ends[:, None] / scaled)).sum(axis=1)
    numbers = np.maximum(expected_numbers(ends, math.exp(best), means, metal, law), 1e-300)
    mass = (above[:-1] - above[1:]) / numbers * counted if counts.mass is None else np.asarray(counts.mass)
    fit = CountFit(
        counts=counts,
        scale=math.exp(best),
        mean=whole / float((metal / scaled).sum()),
        curvature_error=error,
        standard_error=error * (math.sqrt(chi_square / degrees) if rejected else 1.0),
        expected=tuple(expected.tolist()),
        chi_square=chi_square,
        degrees=degrees,
        recovered=None if segments is None else float(mass.sum()) * known.rounds / (counts.rounds * whole),
        in_range=float(above[0] - above[-1]) / whole,
    )
    if segments is not None:
        _check_mass(fit, whole / known.rounds)
    return fit


def _largest(likelihood: Any, means: Array, whole: float, source: str) -> float:  # noqa: ANN401 - a function
    """Ln k at the largest likelihood: the best of a search over all mean masses, refined."""
    finite = means[np.isfinite(means)]
    if not finite.size:
        raise InputError(f"{source}: the law gives no segment a mean mass; nothing breaks up")
    middle = math.log(float(np.median(finite)))
    tried = np.arange(math.log(_LIGHTEST) - middle, math.log(whole) - middle, 0.1)
    values = np.array([likelihood(one) for one in tried])
    place = int(np.argmax(values))
    if not 0 < place < len(tried) - 1:
        raise InputError(_undetermined(source))
    from scipy.optimize import minimize_scalar

    found = minimize_scalar(
        lambda one: -likelihood(one), bounds=(tried[place - 1], tried[place + 1]), method="bounded",
        options={"xatol": 1e-10},
    )  # fmt: skip
    return float(found.x)


def _exceeded(degrees: int, chi_square: float) -> float | None:
    """Probability of a larger chi-square than this; None without degrees of freedom."""
    from scipy.special import gammaincc

    return float(gammaincc(0.5 * degrees, 0.5 * chi_square)) if degrees else None


def _undetermined(source: str) -> str:
    return (
        f"{source}: these counts determine no mean mass: Mott's law fits them best with pieces of any size; pieces in "
        "several groups of mass are needed, fewer in each heavier one"
    )


def _chi_square(counted: Array, expected: Array) -> tuple[float, int]:
    """Pearson's chi-square and its degrees of freedom; groups are joined from the heaviest on."""
    joined: list[list[float]] = []
    waiting = [0.0, 0.0]
    for number, mean in zip(counted[::-1], expected[::-1], strict=True):
        waiting = [waiting[0] + float(number), waiting[1] + float(mean)]
        if waiting[1] >= _FEWEST_EXPECTED:
            joined.append(waiting)
            waiting = [0.0, 0.0]
    if joined:
        joined[-1] = [joined[-1][0] + waiting[0], joined[-1][1] + waiting[1]]
    return sum((number - mean) ** 2 / mean for number, mean in joined), max(len(joined) - 2, 0)


def _check_mass(fit: CountFit, casing: float) -> None:
    counts = fit.counts
    assert fit.recovered is not None
    assert fit.completeness is not None
    of = "its round" if counts.rounds == 1.0 else f"its {counts.rounds:g} rounds"
    held = f"{counts.source}: {counts.label} hold {fit.recovered:.0%} of the mass of {of} ({casing:.4g} kg each)"
    if fit.recovered > MAX_MASS * fit.mass_margin:
        raise InputError(
            f"{held}; allowed: at most {MAX_MASS:.0%}. Pieces of another round, of several rounds (give their number "
            'in a line "# rounds = 4" of the file) or of the fuze?'
        )
    if fit.completeness < MIN_COMPLETENESS / fit.mass_margin:
        raise InputError(
            f"{held}, where the law has {fit.in_range:.0%} in this range of masses; allowed: at least "
            f"{MIN_COMPLETENESS:.0%} of that. Where so much is lost, the losses decide the mean mass: give it as a "
            "number, or, if a part of the azimuth was caught, that part of a round in a line "
            '"# rounds = 0.25" of the file'
        )
