"""Physical bounds of every number of a case, with reasons: hard bounds refuse a value, soft ones warn.

A key has the bounds of its own in `KEYS`, else those of its unit in `UNITS`, else those of a pure number. Hard bounds
are wide: beyond them the number is a slip of the pen or of a unit, or the program cannot compute it. Soft bounds are
what is usual; what lies outside is computed and said in log, `check` and report.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pydantic import BaseModel

from fragfield.case.messages import marks_of
from fragfield.case.units.compound import Vector
from fragfield.case.units.quantities import Quantity

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pydantic.fields import FieldInfo

    from fragfield.case.schema import Case

__all__ = ["COUNTS", "KEYS", "UNITS", "Bounds", "bounds_of", "outside_hard", "outside_soft", "quantities_of"]


@dataclass(frozen=True)
class Bounds:
    """What is possible (`low` to `high`) and what is usual (`usual`), in SI, with the reason."""

    low: float
    high: float
    why: str
    usual: tuple[float, float] | None = None


_FAR = "no fragment flies as far as 100 km"
_NO_PURE = Bounds(-1e9, 1e9, "larger pure numbers have no meaning here")

UNITS: dict[str, Bounds] = {
    "m": Bounds(-1e5, 1e5, _FAR),
    "m^2": Bounds(0.0, 1e4, "areas here are those of persons and fragments"),
    "m^3": Bounds(0.0, 1e6, "volumes here are those of rounds and buildings"),
    "s": Bounds(0.0, 1e5, "no flight lasts a day"),
    "kg": Bounds(0.0, 1e5, "no round weighs more than 100 t"),
    "m/s": Bounds(-2e4, 2e4, "twice the speed of any detonation front"),
    "m/s^2": Bounds(0.0, 100.0, "ten times the Earth's gravity"),
    "kg/m^3": Bounds(0.0, 2.5e4, "nothing is denser than osmium, 22 600 kg/m^3"),
    "kg/m^2": Bounds(0.0, 1e6, "masses per area of walls and covers"),
    "Pa": Bounds(-1e13, 1e13, "no pressure here exceeds 10 TPa"),
    "J": Bounds(0.0, 1e12, "no fragment carries the energy of 200 t of TNT"),
    "J/kg": Bounds(0.0, 1e8, "ten times the heat of any explosive"),
    "J/m^2": Bounds(0.0, 1e9, "energies of fracture per area lie far below"),
    "J/m^3": Bounds(0.0, 1e12, "ten times the energy of any explosive"),
    "1/m^2": Bounds(0.0, 1e6, "one fragment on a square millimetre"),
    "rad": Bounds(-100.0, 100.0, "sixteen turns"),
    "K": Bounds(0.0, 1e4, "hotter than any air"),
    "W": Bounds(0.0, 1e12, "powers here are small"),
    "N": Bounds(0.0, 1e12, "forces here are small"),
    "1/s": Bounds(0.0, 1e9, "faster than a step"),
}
"""By the SI unit of a quantity; every unit of the schema stands here."""

_LENGTH_OF_BODY = "obstacles, panels and buildings are smaller than 10 km and larger than 1 mm"

KEYS: dict[str, Bounds] = {
    "burst.cell_size": Bounds(1e-4, 0.5, "cells below 0.1 mm need years, above 0.5 m no casing has one", (5e-4, 0.02)),
    "burst.end_time": Bounds(1e-9, 1e-2, "a burst is over within milliseconds", (1e-5, 1e-3)),
    "burst.time_limit": Bounds(1e-9, 0.1, "a burst is over within milliseconds"),
    "burst.acceleration_window": Bounds(1e-9, 1e-2, "a burst is over within milliseconds"),
    "burst.time_step.fixed": Bounds(1e-12, 1e-5, "no cell is stable with steps above 10 us", (1e-10, 1e-7)),
    "burst.leakage.radius_ratio": Bounds(1.0, 20.0, "no casing holds the products that long"),
    "burst.leakage.beta": Bounds(0.0, 100.0, "above, the products are gone at once"),
    "burst.leakage.parts": Bounds(1, 10_000, "more parts than a charge has cells along its axis", (1, 500)),
    "burst.viscosity.linear": Bounds(0.0, 10.0, "more damping than a shock has steepness", (0.0, 1.0)),
    "burst.viscosity.quadratic": Bounds(0.0, 20.0, "more damping than a shock has steepness", (0.0, 4.0)),
    "burst.hourglass.charge_viscous": Bounds(0.0, 1.0, "above 1 the control is unstable", (0.0, 0.3)),
    "burst.hourglass.casing_viscous": Bounds(0.0, 1.0, "above 1 the control is unstable", (0.0, 0.3)),
    "burst.hourglass.casing_stiffness": Bounds(0.0, 1.0, "above 1 the control is stiffer than the metal", (0.0, 0.3)),
    "burst.contact.cohesion": Bounds(0.0, 1e12, "stronger than any solid", (0.0, 1e9)),
    "burst.contact.tensile_strength": Bounds(0.0, 1e12, "stronger than any solid", (0.0, 1e9)),
    "burst.output.interval": Bounds(1e-9, 0.1, "shorter than a step, or longer than any burst", (1e-7, 1e-3)),
    "burst.damping": Bounds(0.0, 1e7, "nothing would move", (0.0, 1e5)),
    "break_up.mean_mass": Bounds(1e-7, 1e3, "casings break into grams, not into dust or tons", (1e-5, 1.0)),
    "break_up.mean_mass_factor": Bounds(1.0, 1e3, "a factor of uncertainty"),
    "break_up.prefactor": Bounds(1e-3, 1e4, "C of Eq. 21 is 4 in SI, and 381.5 as printed", (1.0, 20.0)),
    "break_up.fracture_energy": Bounds(1.0, 1e8, "metals have 1e3 to 1e6 J/m^2", (1e3, 1e6)),
    "break_up.critical_strain": Bounds(1e-3, 10.0, "casings rupture at strains near 1", (0.1, 1.5)),
    "break_up.fracture_stress": Bounds(1e5, 1e12, "stresses at fracture of solids", (1e8, 3e9)),
    "break_up.fracture_gamma": Bounds(1e-2, 1e5, "Mott found 67 for steel", (10.0, 300.0)),
    "break_up.graded_m0": Bounds(0.0, 100.0, "a grade of mass, not a round's"),
    "break_up.graded_dm": Bounds(1e-7, 100.0, "narrower grades would be more than there are fragments", (1e-6, 0.1)),
    "break_up.tilt": Bounds(0.0, 0.5, "what leans farther falls over", (0.0, 0.1)),
    "break_up.explosive_constant": Bounds(1e-4, 1e4, "published constants lie near 1"),
    "flight.air.altitude": Bounds(-500.0, 80e3, "the atmosphere is tabulated up to 84.9 km", (-500.0, 6000.0)),
    "flight.air.density": Bounds(0.0, 1e3, "denser than water", (0.0, 2.0)),
    "flight.air.sound_speed": Bounds(10.0, 1e4, "speeds of sound of gases", (250.0, 400.0)),
    "flight.wind.speed": Bounds(0.0, 200.0, "no wind at the ground is faster", (0.0, 40.0)),
    "flight.wind.speeds": Bounds(0.0, 200.0, "no wind up to 20 km is faster", (0.0, 100.0)),
    "flight.wind.reference_height": Bounds(0.01, 1e4, "heights of anemometers"),
    "flight.gravity": Bounds(0.0, 100.0, "ten times the Earth's", (0.0, 9.9)),
    "flight.drag": Bounds(0.0, 100.0, "coefficients of bodies lie below 3", (0.0, 3.0)),
    "flight.drag_factor": Bounds(1e-3, 1e3, "factors on a measured coefficient", (0.5, 2.0)),
    "flight.shape_factor": Bounds(50.0, 1e5, "a steel cube has 5200, thin plates some hundred", (1000.0, 6000.0)),
    "flight.shape.ratios": Bounds(1e-3, 1e3, "ratios of edges, not of atoms", (0.1, 50.0)),
    "flight.shape.density": Bounds(100.0, 2.5e4, "densities of casings", (1000.0, 2e4)),
    "flight.collisions.density": Bounds(100.0, 2.5e4, "densities of casings", (1000.0, 2e4)),
    "flight.collisions.distance": Bounds(1e-3, 200.0, "beyond it fragments are too far apart to meet", (0.1, 50.0)),
    "flight.integrator.step": Bounds(1e-8, 1.0, "a fragment stops within seconds", (1e-6, 0.01)),
    "flight.time_limit": Bounds(1e-6, 1e5, "no flight lasts a day"),
    "flight.trajectories": Bounds(0, 100_000, "ParaView shows no more"),
    "flight.ground.site": Bounds(-1e8, 1e8, "eastings and northings of any grid on Earth"),
    "flight.ground.datum": Bounds(-1.2e4, 1e4, "heights on Earth"),
    "flight.ground.height": Bounds(-1e4, 1e4, "heights on Earth"),
    "flight.ground.friction": Bounds(0.0, 100.0, "coefficients of friction lie below 2", (0.0, 2.0)),
    "witness.radius": Bounds(1e-3, 1e5, _FAR),
    "witness.width": Bounds(1e-3, 1e4, _LENGTH_OF_BODY),
    "witness.height": Bounds(1e-3, 1e4, _LENGTH_OF_BODY),
    "obstacle.height": Bounds(1e-3, 1e4, _LENGTH_OF_BODY),
    "obstacle.thickness": Bounds(1e-3, 1e3, _LENGTH_OF_BODY),
    "obstacle.crest_width": Bounds(1e-3, 1e3, _LENGTH_OF_BODY),
    "obstacle.slope": Bounds(0.0, 1e3, "flatter than any bank"),
    "obstacle.length": Bounds(1e-3, 1e4, _LENGTH_OF_BODY),
    "obstacle.width": Bounds(1e-3, 1e4, _LENGTH_OF_BODY),
    "hazard.energy": Bounds(1e-3, 1e8, "79 J injures; a car at full speed has 1 MJ", (1.0, 1e5)),
    "hazard.density": Bounds(1e-9, 1e4, "acceptable densities lie near one on 56 m^2", (1e-4, 1.0)),
    "hazard.sectors": Bounds(1, 3600, "sectors narrower than 0.1 degree hold no fragments"),
    "hazard.distance_cell": Bounds(0.01, 1e4, "cells below 1 cm hold no fragments", (0.5, 100.0)),
    "hazard.person_area": Bounds(1e-3, 100.0, "areas of persons", (0.1, 2.0)),
    "hazard.person_height": Bounds(0.0, 10.0, "heights of persons", (0.0, 2.5)),
    "hazard.kernel": Bounds(1e-3, 3.2, "narrower than any jet holds fragments", (0.02, 3.2)),
    "hazard.stack_rule.side": Bounds(0, 1e6, "rounds of a stack"),
    "hazard.stack_rule.top": Bounds(0, 1e6, "rounds of a stack"),
    "round.explosive.density": Bounds(100.0, 5000.0, "densities of explosives", (700.0, 2100.0)),
    "round.explosive.detonation_velocity": Bounds(500.0, 1.2e4, "detonation fronts", (2000.0, 1e4)),
    "round.explosive.heat_of_detonation": Bounds(1e5, 3e7, "heats of explosives", (1e6, 1e7)),
    "round.explosive.sound_speed": Bounds(50.0, 1e4, "speeds of sound of explosives", (500.0, 5000.0)),
    "round.explosive.hugoniot_slope": Bounds(1.0, 5.0, "published fits have 1.4 to 2.2", (1.2, 2.6)),
    "round.explosive.shear_modulus": Bounds(1e4, 1e12, "moduli of solids", (1e7, 2e10)),
    "round.explosive.shear_strength": Bounds(0.0, 1e11, "strengths of solids", (0.0, 1e9)),
    "round.explosive.jwl.A": Bounds(1e8, 1e13, "published A are 100 to 1200 GPa", (1e10, 3e12)),
    "round.explosive.jwl.B": Bounds(-1e12, 1e12, "published B are -10 to 40 GPa", (-3e10, 1e11)),
    "round.explosive.jwl.R1": Bounds(0.5, 50.0, "published R1 are 3.5 to 7.5", (3.0, 15.0)),
    "round.explosive.jwl.R2": Bounds(0.05, 20.0, "published R2 are 0.6 to 2", (0.3, 3.0)),
    "round.explosive.jwl.omega": Bounds(0.01, 3.0, "published omega are 0.2 to 0.6", (0.1, 1.0)),
    "round.explosive.jwl.E0": Bounds(1e7, 1e11, "published E0 are 2 to 15 GJ/m^3", (1e9, 2e10)),
    "round.casing.density": Bounds(100.0, 2.5e4, "densities of metals", (1500.0, 2e4)),
    "round.casing.elastic_modulus": Bounds(1e6, 5e12, "moduli of solids", (1e9, 6e11)),
    "round.casing.shear_strength": Bounds(1e4, 1e11, "strengths of solids", (1e7, 3e9)),
    "round.casing.tensile_strength": Bounds(1e4, 1e11, "strengths of solids", (1e7, 1e10)),
    "round.casing.poisson_ratio": Bounds(-0.99, 0.499, "cells lock at 0.5", (0.0, 0.45)),
    "round.casing.shear_softening_strain": Bounds(1e-4, 1e3, "strains at rupture", (0.01, 10.0)),
    "round.casing.tensile_softening_strain": Bounds(1e-4, 1e3, "strains at rupture", (0.01, 10.0)),
    "round.casing.softening_length": Bounds(1e-6, 1.0, "lengths of cells", (1e-4, 0.03)),
    "round.ignition.delay": Bounds(0.0, 0.1, "a burst is over within milliseconds"),
    "round.ignition.station": Bounds(-100.0, 100.0, "no round is 100 m long"),
    "round.ignition.offset": Bounds(-100.0, 100.0, "no round is 100 m wide"),
    "round.initiation.pressure": Bounds(1e5, 1e12, "shocks that initiate have 0.5 to 50 GPa", (1e8, 5e10)),
    "round.initiation.duration": Bounds(0.0, 1e-3, "shocks last microseconds", (0.0, 2e-5)),
    "round.axis": Bounds(-1e6, 1e6, "a direction"),
    "plane.normal": Bounds(-1e6, 1e6, "a direction"),
    "witness.normal": Bounds(-1e6, 1e6, "a direction"),
    "witness.up": Bounds(-1e6, 1e6, "a direction"),
    "stack.gap": Bounds(0.0, 1e3, "farther apart rounds are no stack", (0.0, 10.0)),
    "stack.layer_gap": Bounds(0.0, 1e3, "farther apart rounds are no stack", (0.0, 10.0)),
    "stack.count": Bounds(1, 10_000, "a stack of more rounds is not computed whole"),
    "stack.counts": Bounds(1, 10_000, "a stack of more rounds is not computed whole"),
    "stack.delays": Bounds(0.0, 0.1, "a burst is over within milliseconds"),
    "uncertainty.samples": Bounds(8, 1_000_000, "more samples than any machine runs"),
    "seed": Bounds(0, 2.0**63, "a whole number of 63 bits"),
}
"""By key, without the numbers of list entries."""

COUNTS: dict[str, tuple[int, str]] = {
    "round": (10_000, "more rounds are not computed whole"),
    "round.ignition": (200, "more points than a charge has places"),
    "plane": (100, "every cell meets every plane"),
    "obstacle": (1000, "every fragment meets every obstacle"),
    "witness": (1000, "every fragment meets every surface"),
    "witness.corners": (1000, "corners of a panel"),
    "break_up.segments": (1000, "segments of a casing"),
    "flight.wind.heights": (10_000, "heights of a sounding"),
    "stack.delays": (10_000, "one for each round"),
    "uncertainty.input": (200, "more inputs than samples can distinguish"),
}
"""Entries that a list may have."""

_TEXT = 500
_DIRECTIONS = ("round.axis", "plane.normal", "witness.normal", "witness.up")
_SHORTEST = 1e-6
_NUMBER = re.compile(r"\[\d+\]")


def quantities_of(table: BaseModel, above: str = "") -> Iterator[tuple[str, object, FieldInfo | None]]:
    """Every value of a case that is no table, with its key (entries counted from 1) and its field."""
    for name, field in type(table).model_fields.items():
        path = f"{above}.{name}" if above else name
        yield from _values(path, getattr(table, name), field)


def _values(path: str, value: object, field: FieldInfo) -> Iterator[tuple[str, object, FieldInfo | None]]:
    if isinstance(value, BaseModel):
        yield from quantities_of(value, path)
    elif isinstance(value, dict):
        return  # a profile, which `burst_fenicsx.geometry` reads
    elif isinstance(value, (list, tuple)) and any(isinstance(entry, BaseModel) for entry in value):
        yield path, len(value), None
        for number, entry in enumerate(value, start=1):
            yield from _values(f"{path}[{number}]", entry, field)
    elif value is not None:
        yield path, value, field


def bounds_of(path: str, field: FieldInfo) -> Bounds | None:
    """Bounds of a key; None where it is not numeric."""
    key = _NUMBER.sub("", path)
    if key in KEYS:
        return KEYS[key]
    for mark in marks_of(field):
        if isinstance(mark, Quantity):
            return UNITS[mark.symbol]
        if isinstance(mark, Vector):
            return UNITS[mark.component.symbol] if mark.component is not None else _NO_PURE
    return _NO_PURE


def outside_hard(case: Case) -> Iterator[str]:
    """Faults: numbers, lists and texts that are impossible, as `key: found ...; allowed: ...`."""
    for path, value, field in quantities_of(case):
        key = _NUMBER.sub("", path)
        entries = value if field is None else len(value) if isinstance(value, (list, tuple)) else 0
        if key in COUNTS and isinstance(entries, int) and entries > COUNTS[key][0]:
            most, why = COUNTS[key]
            yield f"{path}: found {entries} entries; allowed: at most {most} ({why})"
            continue
        if field is None:
            continue
        if isinstance(value, str):
            if len(value) > _TEXT and key not in _LONG_TEXTS:
                yield f"{path}: found a text of {len(value)} characters; allowed: at most {_TEXT}"
            continue
        if (bounds := bounds_of(path, field)) is None:
            continue
        for number in _numbers(value):
            if not bounds.low <= number <= bounds.high:
                yield f"{path}: found {_shown(number, field)}; allowed: {_range(bounds, field)} ({bounds.why})"
                break
        if key in _DIRECTIONS and 0.0 < math.hypot(*_numbers(value)) < _SHORTEST:
            yield f"{path}: found {list(_numbers(value))}; allowed: a direction, at least {_SHORTEST:g} long"


def outside_soft(case: Case) -> Iterator[str]:
    """Warnings: numbers that are unusual, each with what is usual and why."""
    seen = set()
    for path, value, field in quantities_of(case):
        if field is None or isinstance(value, str):
            continue
        bounds = bounds_of(path, field)
        if bounds is None or bounds.usual is None:
            continue
        low, high = bounds.usual
        for number in _numbers(value):
            if not low <= number <= high:
                usual = f"{low:g} to {_shown(high, field)}"
                text = f"{_NUMBER.sub('', path)} = {_shown(number, field)}: unusual; usual: {usual} ({bounds.why})"
                if text not in seen:
                    seen.add(text)
                    yield text
                break


_LONG_TEXTS = (
    "round.explosive.source", "round.casing.source", "round.mesh", "flight.drag", "flight.ground.map",
    "uncertainty.input.source",
)  # fmt: skip


def _numbers(value: object) -> tuple[float, ...]:
    if isinstance(value, (list, tuple)):
        return tuple(float(entry) for entry in value if isinstance(entry, (int, float)))
    return (float(value),) if isinstance(value, (int, float)) and not isinstance(value, bool) else ()


def _unit(field: FieldInfo) -> str:
    for mark in marks_of(field):
        if isinstance(mark, Quantity):
            return f" {mark.symbol}"
        if isinstance(mark, Vector) and mark.component is not None:
            return f" {mark.component.symbol}"
    return ""


def _shown(number: float, field: FieldInfo) -> str:
    return f"{number:g}{_unit(field)}"


def _range(bounds: Bounds, field: FieldInfo) -> str:
    return f"{bounds.low:g} to {_shown(bounds.high, field)}"
