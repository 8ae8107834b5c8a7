"""The uncertain inputs of a case: its own, and the default set for built-in rounds."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fragfield.case.checks.uncertain_inputs import parameters_of
from fragfield.case.conversion.rounds import profile_of
from fragfield.case.keys import unit_of_key
from fragfield.case.problem import break_up_settings
from fragfield.case.schema import CaseTable, UncertainInputTable
from fragfield.case.tables.round import RoundTable
from fragfield.errors import InputError
from fragfield.results.uncertainty import SampledInput
from fragfield_base.inputs import with_unit
from transition.law.mean_mass import explosive_constant

_BURST = ("burst", "round", "plane", "stack")


_DIGITS = 12  # of a sampled value: what a case file, a table and a hash can repeat on every machine


@dataclass(frozen=True)
class Distribution:
    """A distribution in one dimension."""

    kind: str
    """"uniform", "normal", "lognormal", "triangular" or "discrete"."""
    low: Any = None
    high: Any = None
    """Ends; of "normal" and "lognormal" where they are cut off, without a heap of probability there, if at all."""
    mode: Any = None
    mean: Any = None
    standard_deviation: Any = None
    median: Any = None
    factor: Any = None
    """Geometric standard deviation of "lognormal"."""
    values: Sequence[Any] = ()
    weights: Sequence[float] | None = None
    """Of "discrete"; all alike where there are none."""

    @property
    def is_continuous(self) -> bool:
        """Whether values are numbers of a continuum."""
        return self.kind != "discrete"

    def quantile(self, u: ArrayLike) -> NDArray[np.float64]:
        """Values (n,) at probabilities u in (0, 1); of a discrete distribution the positions in `values`."""
        from scipy import stats

        if self.kind == "discrete":
            return np.searchsorted(self.edges()[1:-1], u, side="right").astype(np.float64)
        in_log = self.kind == "lognormal"
        low, high = (-np.inf if self.low is None else self.low), (np.inf if self.high is None else self.high)
        if self.kind == "uniform":
            return np.asarray(stats.uniform(low, high - low).ppf(u))
        if self.kind == "triangular":
            return np.asarray(stats.triang((self.mode - low) / (high - low), low, high - low).ppf(u))
        centre, spread = self.mean, self.standard_deviation
        if in_log:
            centre, spread = np.log(self.median), np.log(self.factor)
            low, high = (np.log(end) if end > 0.0 else -np.inf for end in (low, high))
        values = stats.truncnorm((low - centre) / spread, (high - centre) / spread, centre, spread).ppf(u)
        return np.asarray(np.exp(values) if in_log else values)

    def drawn(self, u: ArrayLike) -> list[Any]:
        """As `quantile`, as Python's own numbers of twelve digits, or the entries of a discrete distribution."""
        if self.kind == "discrete":
            return [self.values[int(place)] for place in self.quantile(u)]
        return [float(f"{value:.{_DIGITS}g}") for value in self.quantile(u)]

    def edges(self) -> NDArray[np.float64]:
        """Probabilities (k + 1,) between the values of a discrete distribution, from 0 to 1."""
        shares = np.ones(len(self.values)) if self.weights is None else np.asarray(self.weights, dtype=np.float64)
        return np.concatenate([[0.0], np.cumsum(shares) / shares.sum()])

    def words(self) -> str:
        """The distribution in words, numbers as they are used."""
        if self.kind == "uniform":
            return f"uniform, {self.low:.5g} to {self.high:.5g}"
        if self.kind == "triangular":
            return f"triangular, {self.low:.5g}, {self.mode:.5g}, {self.high:.5g}"
        if self.kind == "discrete":
            shares = zip(self.values, np.diff(self.edges()), strict=True)
            return ", ".join(f"{value} ({100 * share:.3g} %)" for value, share in shares)
        cut = [f"{word} {end:.5g}" for end, word in ((self.low, "from"), (self.high, "to")) if end is not None]
        within = f", cut off {' '.join(cut)}" if cut else ""
        if self.kind == "normal":
            return f"normal, {self.mean:.5g} ± {self.standard_deviation:.5g}{within}"
        return f"lognormal, {self.median:.5g} within a factor of {self.factor:.4g} (68 %){within}"


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
            parameters={
                key: value
                for key, value in vars(self.distribution).items()
                if key != "kind" and value not in (None, ())
            },
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
        entry.name, tuple(entry.keys), entry.applies, Distribution(entry.distribution, **parameters_of(entry)), unit,
        entry.source, entry.judgement, is_default,
    )  # fmt: skip


_LINEAR = {"mott": "break_up.prefactor", "mott_1947": "break_up.fracture_stress"}
"""Keys in which the mean mass of a law is linear, see transition.law.mean_mass."""
_SHARE = 0.1  # of the charge's length within which the ignition may lie
_NEAR = 1e-6  # m


@cache
def _data() -> dict[str, Any]:
    text = (resources.files("fragfield") / "data" / "uncertain_inputs.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def _entry(kind: str, keys: list[str], table: dict[str, Any] | None = None, **more: Any) -> UncertainInputTable:
    values = {**(_data()[kind] if table is None else table), "keys": keys, **more}
    return UncertainInputTable.model_validate(values)


def default_inputs(case: CaseTable) -> Iterator[UncertainInputTable]:
    """Entries of the default set that apply to a resolved case; rounds that are alike share one draw."""
    if case.burst is not None and case.round:
        yield from _burst(case)
    yield from _mean_mass(case)
    yield _entry("drag", ["flight.drag_factor"])
    if case.flight.air.model == "standard":
        yield _entry("air_temperature", ["flight.air.temperature_offset"])
    yield from _base_height(case)
    if case.flight.shape.model != "box":
        yield _entry("presented_area", ["flight.shape_factor"])
    if case.flight.ground.ricochet != "none":
        yield _entry("ricochet_angle", ["flight.ground.critical_angle_factor"])
        yield _entry("ricochet_speed", ["flight.ground.speed_kept_factor"])
        yield _entry("ricochet_departure", ["flight.ground.departure_factor"])
        yield _entry("ricochet_roughness", ["flight.ground.roughness_factor"])
    if case.round:
        yield _entry("direction_scatter", ["break_up.direction_scatter"])


def _base_height(case: CaseTable) -> Iterator[UncertainInputTable]:
    """The height of the rounds, as that of flat ground below them: the burst stays."""
    if not case.round or case.flight.ground.map is not None or any(plane.kind != "symmetry" for plane in case.plane):
        return
    above = min(entry.position[2] for entry in case.round) - case.flight.ground.height
    highest = min(float(_data()["base_height"]["high"].split()[0]), max(above, 0.0))
    yield _entry("base_height", ["flight.ground.height"], high=f"{highest:.4g} m")


def _burst(case: CaseTable) -> Iterator[UncertainInputTable]:
    assert case.burst is not None
    if case.burst.leakage.enabled:
        yield _entry("leakage", ["burst.leakage.radius_ratio"])
    heat, key = ("energy", "jwl.E0") if case.burst.products == "jwl" else ("heat", "heat_of_detonation")
    for words, numbers in _alike(case, "explosive"):
        keys = [f"round.{number}.explosive.{key}" for number in numbers]
        yield _entry(heat, keys, name=_data()[heat]["name"] + words)
    for words, numbers in _alike(case, "casing"):
        casing: Any = case.round[numbers[0]].casing
        strains = [
            f"round.{number}.casing.{key}"
            for number in numbers
            for key in ("shear_softening_strain", "tensile_softening_strain")
            if getattr(casing, key) != "none"
        ]
        if strains:
            yield _entry("softening", strains, name="softening" + words)
        strengths = [
            f"round.{number}.casing.{key}" for number in numbers for key in ("shear_strength", "tensile_strength")
        ]
        table = _data()["yield"].get(casing.name, _data()["yield"]["other"])
        yield _entry("yield", strengths, table, name="yield strength" + words)
    for words, numbers, longest in _ignited_at_nose(case):
        keys = [f"round.{number}.ignition.0.station" for number in numbers]
        yield _entry("ignition", keys, name="ignition place" + words, low="0 m", high=f"{longest:.4g} m")


def _alike(case: CaseTable, part: str) -> list[tuple[str, list[int]]]:
    """Numbers of the rounds (from 0) by the name of their explosive or casing; words to distinguish several."""
    groups: dict[str, list[int]] = {}
    for number, entry in enumerate(case.round):
        groups.setdefault(getattr(entry, part).name, []).append(number)
    return [(f" of {name}" if len(groups) > 1 else "", numbers) for name, numbers in groups.items()]


def _ignited_at_nose(case: CaseTable) -> list[tuple[str, list[int], float]]:
    """Rounds ignited by one point at the nose end of the charge, on its axis, by the length (m) it may move."""
    groups: dict[float, list[int]] = {}
    for number, entry in enumerate(case.round):
        length = _movable(entry)
        if length > 0.0:
            groups.setdefault(length, []).append(number)
    return [
        (f" within {length:.3g} m" if len(groups) > 1 else "", numbers, length) for length, numbers in groups.items()
    ]


def _movable(entry: RoundTable) -> float:
    points = entry.ignition or []
    if len(points) != 1 or not isinstance(entry.profile, dict) or points[0].offset != (0.0, 0.0):
        return 0.0
    profile = profile_of(entry)
    at_nose = abs(float(points[0].station) - profile.charge_front) < _NEAR
    return _SHARE * (profile.charge_end - profile.charge_front) if at_nose else 0.0


def _mean_mass(case: CaseTable) -> Iterator[UncertainInputTable]:
    """The mean mass by the key in which it is linear; a law without one, or a mean that is given, by its own key."""
    law = case.break_up.mean_mass
    if case.break_up.mean_mass_is_file:
        factor, label = break_up_settings(case).factor
        assert factor is not None
        name = "mean_mass_fitted" if case.break_up.mean_mass_factor is None else "mean_mass"
        table = dict(_data()[name])
        table["source"] = table["source"].replace("{label}", label)
        yield _entry("mean_mass", ["break_up.counts.scale"], table, factor=max(factor, 1.001))
        return
    if isinstance(law, str) and law in _LINEAR:
        key = _LINEAR[law]
        if getattr(case.break_up, key.rpartition(".")[2]) == "paper":
            return
    elif isinstance(law, str):
        names = {entry.explosive.name for entry in case.round if not isinstance(entry.explosive, str)}
        if case.break_up.explosive_constant is not None:
            yield _with_factor(case, "break_up.explosive_constant", 0.5)
        elif len(names) == 1:
            constant = explosive_constant(names.pop(), None)
            entry = _with_factor(case, "break_up.explosive_constant", 0.5)
            low, high = (constant * float(end) for end in (entry.low or 0.5, entry.high or 2.0))
            values = {"applies": "value", "median": constant, "low": low, "high": high}
            yield entry.model_copy(update=values)
        return
    else:
        key = "break_up.mean_mass"
    yield _with_factor(case, key, 1.0)


def _with_factor(case: CaseTable, key: str, power: float) -> UncertainInputTable:
    """The mean mass's entry with its factor to a power, for a key of which the mean mass is another power."""
    factor, _ = break_up_settings(case).factor
    if factor is None:
        table = _data()["mean_mass_judged"]
        factor = table["factor"]
    else:
        table = _data()["mean_mass"]
    factor = max(factor, 1.001)  # 1: measured, next to no spread
    ends = {name: table[name] ** power for name in ("low", "high")}
    return _entry("mean_mass", [key], table, factor=factor**power, **ends)
