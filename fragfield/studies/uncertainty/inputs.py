"""The uncertain inputs of a case: its own, and the default set for built-in rounds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fragfield.case.checks.uncertain_inputs import parameters_of
from fragfield.case.keys import unit_of_key
from fragfield.case.schema import CaseTable, UncertainInputTable
from fragfield.errors import InputError
from fragfield.results.uncertainty import SampledInput
from fragfield.studies.uncertainty.defaults import default_inputs
from fragfield_base.inputs import with_unit

_BURST = ("burst", "round", "plane", "stack")


_DIGITS = 12  # of a sampled value: what a case file, a table and a hash can repeat on every machine


@dataclass(frozen=True)
class Distribution:
    """A distribution in one dimension."""

    kind: str
    """"uniform", "normal", "lognormal", "triangular" or "discrete"."""
    parameters: Mapping[str, Any]
    """uniform: `low`, `high`; normal: `mean`, `standard_deviation`; lognormal: `median`, `factor`, the geometric
    standard deviation; triangular: `low`, `mode`, `high`; normal and lognormal are cut off at `low` and `high` where
    these are given, without a heap of probability there; discrete: `values`, `weights` (all alike where they are
    None)."""

    @property
    def is_continuous(self) -> bool:
        """Whether values are numbers of a continuum."""
        return self.kind != "discrete"

    def quantile(self, u: ArrayLike) -> NDArray[np.float64]:
        """Values (n,) at probabilities u in (0, 1); of a discrete distribution the positions in `values`."""
        from scipy import stats

        p = self.parameters
        if self.kind == "discrete":
            return np.searchsorted(self.edges()[1:-1], u, side="right").astype(np.float64)
        if self.kind == "uniform":
            return np.asarray(stats.uniform(p["low"], p["high"] - p["low"]).ppf(u))
        if self.kind == "triangular":
            width = p["high"] - p["low"]
            return np.asarray(stats.triang((p["mode"] - p["low"]) / width, p["low"], width).ppf(u))
        in_log = self.kind == "lognormal"
        centre, spread = (np.log(p["median"]), np.log(p["factor"])) if in_log else (p["mean"], p["standard_deviation"])
        ends = []
        for name, end in (("low", -np.inf), ("high", np.inf)):
            cut = p.get(name)
            if cut is not None and not (in_log and cut <= 0.0):
                end = ((np.log(cut) if in_log else cut) - centre) / spread
            ends.append(end)
        values = stats.truncnorm(*ends, centre, spread).ppf(u)
        return np.asarray(np.exp(values) if in_log else values)

    def values(self, u: ArrayLike) -> list[Any]:
        """As `quantile`, as Python's own numbers of twelve digits, or the entries of a discrete distribution."""
        if self.kind == "discrete":
            return [self.parameters["values"][int(place)] for place in self.quantile(u)]
        return [float(f"{value:.{_DIGITS}g}") for value in self.quantile(u)]

    def edges(self) -> NDArray[np.float64]:
        """Probabilities (k + 1,) between the values of a discrete distribution, from 0 to 1."""
        weights = self.parameters.get("weights")
        shares = np.ones(len(self.parameters["values"])) if weights is None else np.asarray(weights, dtype=np.float64)
        return np.concatenate([[0.0], np.cumsum(shares) / shares.sum()])

    def words(self) -> str:
        """The distribution in words, numbers as they are used."""
        p = self.parameters
        if self.kind == "uniform":
            return f"uniform, {p['low']:.5g} to {p['high']:.5g}"
        if self.kind == "triangular":
            return f"triangular, {p['low']:.5g}, {p['mode']:.5g}, {p['high']:.5g}"
        if self.kind == "discrete":
            shares = np.diff(self.edges())
            return ", ".join(f"{value} ({100 * share:.3g} %)" for value, share in zip(p["values"], shares, strict=True))
        cut = [f"{word} {p[name]:.5g}" for name, word in (("low", "from"), ("high", "to")) if p.get(name) is not None]
        within = f", cut off {' '.join(cut)}" if cut else ""
        if self.kind == "normal":
            return f"normal, {p['mean']:.5g} ± {p['standard_deviation']:.5g}{within}"
        return f"lognormal, {p['median']:.5g} within a factor of {p['factor']:.4g} (68 %){within}"


@dataclass(frozen=True)
class UncertainInput:
    """An uncertain input, ready to be sampled."""

    name: str
    """For tables and figures."""
    keys: tuple[str, ...]
    """Dotted keys of the resolved case; all get the same draw."""
    applies: str
    """"value", "factor" or "shift": what the draw is to a key."""
    distribution: Distribution
    """In `unit`."""
    unit: str
    """SI unit of the draw; empty for pure numbers, factors and words."""
    source: str
    """Where the distribution comes from."""
    judgement: bool
    """Whether it is a judgement."""
    is_default: bool
    """Whether it comes from the default set."""

    @property
    def in_burst(self) -> bool:
        """Whether the burst depends on it; what does not is sampled over the break-up and the flight alone."""
        return any(key.partition(".")[0] in _BURST for key in self.keys)

    def changes(self, draw: Any) -> dict[str, Any]:  # noqa: ANN401 - a number or a word
        """Changes of a resolved case for one draw, as `fragfield.case.changed_document` takes them."""
        if self.applies == "value":
            written = with_unit(draw, self.unit) if self.unit and not isinstance(draw, str) else draw
            return dict.fromkeys(self.keys, written)

        def moved(old: object) -> object:
            return _moved(old, float(draw), factor=self.applies == "factor")

        return dict.fromkeys(self.keys, moved)

    def described(self) -> SampledInput:
        """As uncertainty.json has it."""
        return SampledInput(
            name=self.name,
            keys=self.keys,
            applies=self.applies,
            distribution=self.distribution.kind,
            parameters=dict(self.distribution.parameters),
            unit=self.unit,
            words=self.distribution.words() + (f" {self.unit}" if self.unit else ""),
            source=self.source,
            judgement=self.judgement,
            is_default=self.is_default,
        )


def _moved(old: object, draw: float, *, factor: bool) -> object:
    """A value of a resolved case, a number or a text "number unit", times a factor or with a shift added."""
    if isinstance(old, str):
        number, _, unit = old.partition(" ")
        return f"{_moved(float(number), draw, factor=factor)!r} {unit}"
    if isinstance(old, bool) or not isinstance(old, (int, float)):
        raise InputError(f"holds {old!r}, which is not a number: no factor and no shift applies to it")
    return float(old) * draw if factor else float(old) + draw


def inputs_of(case: CaseTable) -> list[UncertainInput]:
    """The uncertain inputs of a resolved case: its own first, then those of the default set that it does not replace.

    Raises InputError: there are none.
    """
    table = case.uncertainty
    own = [_input(entry, is_default=False) for entry in table.input] if table is not None else []
    names = {entry.name for entry in own}
    keys = {key for entry in own for key in entry.keys}
    found = list(own)
    if table is None or table.defaults:
        found.extend(
            _input(entry, is_default=True)
            for entry in default_inputs(case)
            if entry.name not in names and not keys.intersection(entry.keys)
        )
    if not found:
        raise InputError(
            "uncertainty: found no input; allowed: tables [[uncertainty.input]], or defaults = true for the default set"
        )
    return found


def _input(entry: UncertainInputTable, *, is_default: bool) -> UncertainInput:
    unit = "" if entry.applies == "factor" else unit_of_key(entry.keys[0], CaseTable) or ""
    return UncertainInput(
        entry.name, tuple(entry.keys), entry.applies, Distribution(entry.distribution, parameters_of(entry)), unit,
        entry.source, entry.judgement, is_default,
    )  # fmt: skip
