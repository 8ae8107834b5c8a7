"""Table of the initiation of each round: time, position, cause."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.numbers import number
from fragfield.report.blocks import Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.report.reading.run_files import RunFiles

__all__ = ["ignition_table", "initiated_by_shock", "never_initiated"]

_BY = {"point": "own point", "delay": "own point, delayed", "shock": "shock"}
_NOTE = (
    "Positions are those at rest. Shock: the first cell of the charge whose pressure stayed above that of "
    "`initiation` for the given "
    "time. A point that a detonation front reached before its delay initiated nothing and is left out."
)


def _ignition(run: RunFiles) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Name of each round and what initiated it, in order of time; runs of older versions have none."""
    for entry in run.part("burst").get("rounds") or []:
        if isinstance(entry.get("ignition"), list):
            yield str(entry.get("name")), entry["ignition"]


def never_initiated(run: RunFiles) -> list[str]:
    """Names of the rounds that nothing initiated."""
    return [name for name, found in _ignition(run) if not found]


def initiated_by_shock(run: RunFiles) -> list[tuple[str, float]]:
    """Names of the rounds that a shock initiated before any point of their own, with the time (s)."""
    return [(name, float(found[0]["time"])) for name, found in _ignition(run) if found and found[0]["by"] == "shock"]


def ignition_table(run: RunFiles) -> Iterator[Table]:
    """When, where and by what each round was initiated; one line for each place from which it burnt."""
    lines = []
    for name, found in _ignition(run):
        lines += [_line(name, one) for one in found] or [(name, "never initiated", "–", "–", "–", "–", "–")]
    if lines:
        head = ("Round", "Initiated by", "At (µs)", "x (mm)", "y (mm)", "z (mm)", "From the nose (mm)")
        yield Table("Ignition of the rounds", head, tuple(lines), _NOTE)


def _line(name: str, one: dict[str, Any]) -> tuple[str, ...]:
    by = _BY.get(str(one["by"]), str(one["by"]))
    lengths = (number(round(1e3 * float(value), 1), 4) for value in (*one["place"], one["station"]))
    return (name, by, number(1e6 * float(one["time"]), 4), *lengths)
