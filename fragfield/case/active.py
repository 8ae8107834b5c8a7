"""Keys of a resolved case that apply to a run: the others keep their defaults and change nothing.

A key that only one choice reads says so itself (`fragfield_base.inputs.OnlyWith`); here is what other tables decide.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.case.checks.bounds import not_read
from fragfield.case.write import measured

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.case.schema import CaseTable

__all__ = ["active_tables"]

_EMPTY: tuple[object, ...] = (None, "", [], {})


def active_tables(case: CaseTable, *, own_fragments: bool = True) -> dict[str, Any]:
    """The tables of a resolved case for the report (`fragfield.case.write.measured`), without keys that take no part.

    Of a run that flew fragments from a file (not `own_fragments`) burst, rounds and break-up took no part. Empty lists,
    texts and tables are left out too.
    """
    left_out = set(_inactive(case, own_fragments=own_fragments))
    tables = {key: _without(key, value, left_out) for key, value in measured(case).items()}
    return {key: value for key, value in tables.items() if value not in _EMPTY}


def _inactive(case: CaseTable, *, own_fragments: bool) -> Iterator[str]:
    """Dotted keys, entries of lists counted from 1."""
    flight = case.flight
    yield from not_read(case)
    if flight.wind.model != "profile" and flight.wind.speed == 0.0:
        yield "flight.wind"
    if flight.shape.model == "box":
        yield "flight.shape_factor"
    if not own_fragments or (len(case.round) < 2 and not any(plane.kind == "symmetry" for plane in case.plane)):
        yield "hazard.stack_rule"
        if own_fragments:
            yield "flight.collisions"
    if not own_fragments:
        yield from ("burst", "round", "plane", "stack", "break_up")
    if case.burst is not None and case.burst.damping == 0.0:
        yield "burst.damping"
    if case.break_up.tilt == 0.0:
        yield "break_up.tilt"
    yield "break_up.counts"  # the report shows them beside the law
    yield "uncertainty"  # of the study, whose page lists its inputs
    for number, entry in enumerate(case.round, start=1):
        if case.burst is not None and case.burst.products != "jwl":
            yield f"round[{number}].explosive.jwl"
        if entry.initiation is None:
            yield from (f"round[{number}].explosive.{key}" for key in ("critical_energy", "critical_energy_source"))
    for number, site in enumerate(case.exposed, start=1):
        if getattr(site, "number", None) == 1.0:
            yield f"exposed[{number}].number"


def _without(path: str, value: Any, left_out: set[str]) -> Any:  # noqa: ANN401 - any value of a table
    """A value without the keys in it that are left out; None where it is one of them."""
    if path in left_out:
        return None
    if isinstance(value, dict):
        kept = {key: _without(f"{path}.{key}", entry, left_out) for key, entry in value.items()}
        empty = (None,) if "[" in path else _EMPTY  # entries of lists show what they lack
        return {key: entry for key, entry in kept.items() if entry not in empty}
    if isinstance(value, list):
        return [_without(f"{path}[{number}]", entry, left_out) for number, entry in enumerate(value, start=1)]
    return value
