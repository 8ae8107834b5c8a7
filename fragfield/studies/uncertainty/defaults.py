"""The default set of uncertain inputs: entries that apply to a case, and their keys."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from functools import cache
from importlib import resources
from typing import Any

from fragfield.case import CaseTable
from fragfield.case.conversion.rounds import profile_of
from fragfield.case.problem import break_up_settings
from fragfield.case.schema import UncertainInputTable
from fragfield.case.tables.round import RoundTable

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
        from transition.law.mean_mass import explosive_constant

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
