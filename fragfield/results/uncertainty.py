"""uncertainty.json: what uncertain inputs do to the distance; SI."""

from __future__ import annotations

from typing import Any

from fragfield.results.hazard import Recommended
from fragfield.results.part import Part, out
from fragfield.results.rules import DistanceToApply


class SampledInput(Part):
    """An uncertain input: keys, distribution in numbers and in words, source."""

    name: str
    keys: tuple[str, ...]
    applies: str
    distribution: str
    parameters: dict[str, Any]
    unit: str
    words: str
    source: str
    judgement: bool
    is_default: bool


class Design(Part):
    """The samples: seed, shared bursts (0 where each has its own) and why, realisations of each."""

    samples: int
    seed: int
    bursts: int
    realisations: int
    geometry: str


class States(Part):
    """Numbers of samples by state, the first messages, and why there is no result."""

    done: int
    failed: int
    not_determined: int
    missing: int
    messages: tuple[str, ...]
    reason: str | None = None


class Spread(Part):
    """Quantiles of a result as the inputs alone spread it."""

    low: float = out("5 %")
    median: float = out("Median")
    high: float = out("95 %")
    low_standard_error: float = out("For the number of samples, by the bootstrap")
    median_standard_error: float = out("The same")
    high_standard_error: float = out("The same")
    mean: float = out("Mean")
    standard_deviation: float = out("Of the inputs' spread")
    statistical_error: float = out(
        "Standard deviation that the statistical errors of the samples add; taken out of the above"
    )
    resolved: bool = out(
        "Whether the inputs' variance exceeds that of the statistical errors; where not, nothing is taken out and the "
        "quantiles are too wide"
    )
    samples: int = out("How many")


class Curve(Part):
    """Quantiles of a result by their level."""

    level: tuple[float, ...]
    value: tuple[float, ...]


class Estimator(Part):
    """The regression of the ranks: part of their variance that it explains (R^2), samples; or why there is none."""

    reason: str | None = None
    explained: float | None = None
    samples: int | None = None


class Share(Part):
    """Share of an input in the variance of the ranks, with standard error and 95 % interval."""

    name: str
    share: float
    share_standard_error: float
    share_low: float
    share_high: float


class Bar(Part):
    """Mean result with an input at 5 and 95 % of its probability, by a regression of the values themselves.

    Of a discrete input the smallest and the largest over its steps.
    """

    name: str
    low: float
    high: float


class SampledQuantity(Part):
    """What the samples say of one result; shares and tornado are empty where there is no estimator."""

    spread: Spread
    curve: Curve
    estimator: Estimator
    shares: tuple[Share, ...] = out("By input", default=())
    tornado: tuple[Bar, ...] = out("By input", default=())


class SampledSiteQuantity(SampledQuantity):
    """The same of an exposed site, with the value of the run itself."""

    nominal: float | None = out("Null where the run has none")


class SampledSite(Part):
    """An exposed site; a quantity of which too few samples know a value is null."""

    name: str
    density: SampledSiteQuantity | None = out("Density of hazardous fragments", "1/m2")
    hits: SampledSiteQuantity | None = out("Expected hits")
    probability: SampledSiteQuantity | None = out("Probability of a hit")


class StudyCost(Part):
    """What the samples took."""

    samples_made_now: int
    wall_seconds: float
    workers: int


class UncertaintyResult(Part):
    """What the samples say."""

    exit_code: int
    program_version: str
    title: str
    inputs: tuple[SampledInput, ...]
    design: Design
    states: States
    nominal: dict[str, Any] = out("Of the run itself what is kept of each sample")
    distance: SampledQuantity | None = out("Expected distance; null where too few samples have one", "m")
    exposed: tuple[SampledSite, ...]
    hazard: Recommended | None = out("The recommended distance of the run with this study")
    distance_to_apply: DistanceToApply | None = out("As in summary.json, with it", default=None)
    directory: str | None = None
    nominal_run: str | None = None
    cost: StudyCost | None = None
