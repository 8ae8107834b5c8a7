"""Keys of a resolved case that apply to a run: the others keep their defaults and change nothing.

A key that only one choice reads says so itself (`fragfield_base.inputs.OnlyWith`); here is what other tables decide.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.case.checks.bounds import not_read

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from fragfield.case.schema import Case

__all__ = ["active_tables"]

Tables = dict[str, Any]


def active_tables(case: Case, tables: Mapping[str, Any], *, own_fragments: bool = True) -> Tables:
    """The tables of a case without keys that take no part in its run.

    Parameters
    ----------
    case : Case
        Resolved.
    tables : mapping
        The same case as nested dicts, in whatever form of its values (`fragfield.case.write`).
    own_fragments : bool
        False where the run flew fragments from a file: burst, rounds and break-up took no part then.

    Returns
    -------
    dict
        A copy. Empty lists, texts and tables are left out too.
    """
    left_out = set(_inactive(case, own_fragments=own_fragments))
    found = _without((), tables, left_out)
    for entry, table in zip(found.get("round", ()), case.round, strict=False):
        _drop(entry, _inactive_of_round(case, table.initiation is not None))
    for entry in found.get("exposed", ()):
        if entry.get("number") == 1.0:
            del entry["number"]
    return found


def _inactive(case: Case, *, own_fragments: bool) -> Iterator[str]:
    """Dotted keys, without those of rounds."""
    flight = case.flight
    yield from (key for key, _ in not_read(case))
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


def _inactive_of_round(case: Case, waits: bool) -> tuple[str, ...]:
    assert case.burst is not None  # a case with rounds that take part has a burst
    keys = [] if case.burst.products == "jwl" else ["explosive.jwl"]
    if not waits:
        keys += ["explosive.critical_energy", "explosive.critical_energy_source"]
    return tuple(keys)


def _without(path: tuple[str, ...], tables: Mapping[str, Any], left_out: set[str]) -> Tables:
    found: Tables = {}
    for key, value in tables.items():
        place = (*path, key)
        if ".".join(place) in left_out or value in ("", [], {}):
            continue
        if isinstance(value, dict):
            inner = _without(place, value, left_out)
            if inner:
                found[key] = inner
        elif isinstance(value, list):
            found[key] = [dict(one) if isinstance(one, dict) else one for one in value]
        else:
            found[key] = value
    return found


def _drop(entry: Tables, keys: tuple[str, ...]) -> None:
    """Take dotted keys out of a copy of a table, copying the tables on the way."""
    for key in keys:
        *way, last = key.split(".")
        table: Any = entry
        for step in way:
            if not isinstance(table.get(step), dict):
                break
            table[step] = dict(table[step])
            table = table[step]
        else:
            table.pop(last, None)
