"""Checks of the table [uncertainty], and the numbers of its distributions in SI."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from fragfield.case.faults import Fault, choice_faults
from fragfield.case.keys import unit_of_key
from fragfield.case.schema import CaseTable, UncertainInputTable
from fragfield_base.errors import show
from fragfield_base.inputs import NotAllowedError, Quantity

_PARAMETERS = ("low", "high", "mode", "mean", "standard_deviation", "median", "factor", "values", "weights")
_POSITIVE = ("standard_deviation", "median")


def check_uncertainty(case: CaseTable) -> Iterator[Fault]:
    """Faults of the table, as `key: found ...; allowed: ...`."""
    if case.uncertainty is None:
        return
    seen: dict[str, str] = {}
    names: dict[str, str] = {}
    for number, entry in enumerate(case.uncertainty.input, start=1):
        where = f"uncertainty.input[{number}]"
        if entry.name in names:
            yield Fault(
                f"{where}.name", f"found {show(entry.name)} again, as {names[entry.name]}; allowed: a name of its own"
            )
        names[entry.name] = where
        faults = list(_check_keys(where, entry))
        yield from faults
        for key in entry.keys:
            if key in seen:
                yield Fault(f"{where}.keys", f"{key} is varied by {seen[key]} already; allowed: one input for a key")
            seen[key] = where
        if not faults and not list(choice_faults(entry)):
            yield from _check_numbers(where, entry)


def _check_keys(where: str, entry: UncertainInputTable) -> Iterator[Fault]:
    units = []
    for place, key in enumerate(entry.keys, start=1):
        try:
            unit = unit_of_key(key, CaseTable)
        except ValueError as error:
            yield Fault(f"{where}.keys[{place}]", f"{show(key)}: {error}")
            continue
        units.append(unit)
        if unit is None and (entry.distribution != "discrete" or entry.applies != "value"):
            yield Fault(
                f"{where}.keys[{place}]",
                f'{show(key)} is not a number; allowed with it: distribution = "discrete" and applies = "value"',
            )
    if len(units) == len(entry.keys) and len(set(units)) > 1 and entry.applies != "factor":
        yield Fault(f"{where}.keys", 'keys of different units; allowed: keys of one unit, or applies = "factor"')


def _check_numbers(where: str, entry: UncertainInputTable) -> Iterator[Fault]:
    try:
        found = parameters_of(entry)
    except ValueError as error:
        (fault,) = error.args
        yield Fault(f"{where}.{fault.key}", fault.words)
        return
    low, high = found.get("low"), found.get("high")
    if low is not None and high is not None and not low < high:
        yield Fault(f"{where}.high", f"found {show(entry.high)}; allowed: above low, {show(entry.low)}")
        return
    for name in ("mode", "mean", "median"):
        value = found.get(name)
        if value is None:
            continue
        if (low is not None and value < low) or (high is not None and value > high):
            yield Fault(f"{where}.{name}", f"found {show(getattr(entry, name))}; allowed: between low and high")
    factors = [found[name] for name in ("low", "mode", "mean", "median") if found.get(name) is not None]
    factors += [value for value in found.get("values") or [] if isinstance(value, float)]
    if entry.applies == "factor" and min(factors, default=1.0) <= 0.0:
        yield Fault(where, 'applies = "factor" can be zero or less; allowed: positive factors, cut off by low')
    if entry.distribution == "normal" and entry.applies == "factor" and low is None:
        yield Fault(f"{where}.low", 'missing; a factor with distribution = "normal" must be cut off above zero by low')
    if entry.distribution == "discrete":
        yield from _check_discrete(where, entry)


def _check_discrete(where: str, entry: UncertainInputTable) -> Iterator[Fault]:
    values, weights = entry.values or [], entry.weights
    if len(values) < 2:
        yield Fault(f"{where}.values", f"found {len(values)}; allowed: two or more")
    if weights is None:
        return
    if len(weights) != len(values):
        yield Fault(f"{where}.weights", f"found {len(weights)} for {len(values)} values; allowed: one for each")
    elif not (all(math.isfinite(weight) and weight >= 0.0 for weight in weights) and sum(weights) > 0.0):
        yield Fault(f"{where}.weights", f"found {show(weights)}; allowed: numbers of zero or more, not all zero")


def parameters_of(entry: UncertainInputTable) -> dict[str, Any]:
    """The distribution's numbers in the SI unit of its keys, or as pure factors.

    Raises ValueError: one has no unit, or one of another dimension; the text begins with the name of the parameter.
    """
    unit = "" if entry.applies == "factor" else unit_of_key(entry.keys[0], CaseTable)
    found: dict[str, Any] = {}
    for name in _PARAMETERS:
        value = getattr(entry, name)
        if value is None:
            continue
        if name == "values":
            found[name] = [_number(f"values[{i}]", one, unit, words=True) for i, one in enumerate(value, start=1)]
        elif name in ("factor", "weights"):
            found[name] = value
        else:
            found[name] = _number(name, value, unit)
        if name in _POSITIVE and not found[name] > 0.0:
            raise ValueError(Fault(name, f"found {show(value)}; allowed: above zero"))
    return found


def _number(name: str, value: object, unit: str | None, *, words: bool = False) -> float | str | bool:
    if unit is None or (words and isinstance(value, bool)):
        assert isinstance(value, (str, bool, float, int))
        return value
    if not unit:
        if isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value):
            return float(value)
        if words and isinstance(value, str):
            return value
        raise ValueError(Fault(name, f"found {show(value)}; allowed: a number without unit"))
    if words and isinstance(value, str) and not any(sign.isdigit() for sign in value):
        return value
    try:
        return Quantity(unit, f"1 {unit}").parse(value)
    except NotAllowedError as error:
        raise ValueError(Fault(name, str(error))) from None
