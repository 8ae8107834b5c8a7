"""Table of shock loading of rounds without ignition points, against published critical energies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.case.tables.round import ExplosiveTable
from fragfield.hazard.shock_exposure import exposed_rounds
from fragfield.numbers import number
from fragfield.report.blocks import Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.report.reading.run_files import RunFiles

__all__ = ["exposure_table"]

_NOTE = (
    "Strongest pulse: that of the most energy per area, the integral of p²/(ρ₀U) while a cell's pressure stays above "
    "the floor (Walker and Wasley 1969), in the unreacted charge, as the constant pressure and the time that have the "
    "same integrals of p and p². Published energies depend on how the charge was made. Largest cells: those that "
    "resolve the pulse."
)


def exposure_table(run: RunFiles) -> Iterator[Table]:
    """A line for each round without ignition points."""
    lines = [_line(name, found, initiated) for name, found, initiated in exposed_rounds(run.part("burst"))]
    if lines:
        head = (
            "Round", "Initiated", "Largest pressure (GPa)", "Strongest pulse (GPa)", "Held (µs)", "Energy (MJ/m²)",
            "Published critical (MJ/m²)", "Verdict", "Largest cells (mm)",
        )  # fmt: skip
        charges = [entry.explosive for entry in run.case.round] if run.case is not None else []
        sources = {one.critical_energy_source for one in charges if isinstance(one, ExplosiveTable)} - {""}
        yield Table(
            "Shock loading of rounds without ignition points", head, tuple(lines), " ".join([_NOTE, *sorted(sources)])
        )


def _line(name: str, found: dict[str, Any], initiated: bool) -> tuple[str, ...]:
    critical = found["critical_energy"]
    limits = " to ".join(number(value / 1e6, 3) for value in critical) if critical else "–"
    return (
        name,
        "yes" if initiated else "no",
        number(found["peak_pressure"] / 1e9, 3),
        number(found["pulse_pressure"] / 1e9, 3),
        number(found["held_time"] * 1e6, 3),
        number(found["energy"] / 1e6, 3),
        limits,
        found["verdict"] + ("" if found["resolved"] else ", cells too coarse"),
        number(found["resolved_cell"] * 1e3, 2),
    )
