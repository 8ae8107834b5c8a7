"""Tables of the burst: initiation of each round, shock loading of those that wait, time by part."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.case.tables.round import ExplosiveTable
from fragfield.hazard.verdict import exposed_rounds
from fragfield.numbers import number
from fragfield.report.blocks import Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.report.reading.run_files import RunFiles
    from fragfield.results.burst import Exposure


_BY = {"point": "own point", "delay": "own point, delayed", "shock": "shock"}
_NOTE = (
    "Positions are those at rest. Shock: the first cell of the charge whose pressure stayed above that of "
    "`initiation` for the given "
    "time. A point that a detonation front reached before its delay initiated nothing and is left out."
)


def _ignition(run: RunFiles) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Name of each round and what initiated it, in order of time."""
    for entry in run.part("burst").get("rounds") or []:
        if entry.get("ignition") is not None:
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


_EXPOSURE_NOTE = (
    "Strongest pulse: that of the most energy per area, the integral of p²/(ρ₀U) while a cell's pressure stays above "
    "the floor (Walker and Wasley 1969), in the unreacted charge, as the constant pressure and the time that have the "
    "same integrals of p and p². Published energies depend on how the charge was made. Largest cells: those that "
    "resolve the pulse."
)


def exposure_table(run: RunFiles) -> Iterator[Table]:
    """A line for each round without ignition points."""
    lines = [_exposure_line(name, found, initiated) for name, found, initiated in exposed_rounds(run.burst_rounds)]
    if lines:
        head = (
            "Round", "Initiated", "Largest pressure (GPa)", "Strongest pulse (GPa)", "Held (µs)", "Energy (MJ/m²)",
            "Published critical (MJ/m²)", "Verdict", "Largest cells (mm)",
        )  # fmt: skip
        charges = [entry.explosive for entry in run.case.round] if run.case is not None else []
        sources = {one.critical_energy_source for one in charges if isinstance(one, ExplosiveTable)} - {""}
        yield Table(
            "Shock loading of rounds without ignition points",
            head,
            tuple(lines),
            " ".join([_EXPOSURE_NOTE, *sorted(sources)]),
        )


def _exposure_line(name: str, found: Exposure, initiated: bool) -> tuple[str, ...]:
    critical = found.critical_energy
    limits = " to ".join(number(value / 1e6, 3) for value in critical) if critical else "–"
    return (
        name,
        "yes" if initiated else "no",
        number(found.peak_pressure / 1e9, 3),
        number(found.pulse_pressure / 1e9, 3),
        number(found.held_time * 1e6, 3),
        number(found.energy / 1e6, 3),
        limits,
        found.verdict + ("" if found.resolved else ", cells too coarse"),
        number(found.resolved_cell * 1e3, 2),
    )
