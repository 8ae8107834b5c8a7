"""Rows of the solid: each body's sound rows first; where they fail, its comparison is void."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from validation.files import reference_beside
from validation.rows import Row, compare, within

if TYPE_CHECKING:
    from validation.solid.bar import Bar
    from validation.solid.elastic_tube import ElasticTube, StaticTube
    from validation.solid.impact import Impact
    from validation.solid.softening import Softening
    from validation.solid.tube import PlasticTube

__all__ = [
    "NAME",
    "REFERENCE",
    "check_bar",
    "check_impact",
    "check_softening",
    "check_static",
    "check_tube",
    "lame_hoop",
    "lame_moved",
]

NAME = "solid"
REFERENCE = reference_beside(__file__)
_OWN = "own bound"


def _closed(label: str, error: float) -> Row:
    return within(NAME, f"{label}: energy error", abs(error), 0.0, REFERENCE["sound"]["energy_error"], _OWN)


def check_bar(bar: Bar) -> list[Row]:
    """Speed of the wave, stress behind it, velocity with which the bar leaves the wall."""
    closed = _closed("bar", bar.energy_error)
    if not closed.passed:
        return [closed]
    allowed, source = REFERENCE["allowed"]["bar"], REFERENCE["bar"]["source"]
    return [
        closed,
        compare(NAME, "bar: speed of the wave", bar.found_speed, bar.speed, allowed, source, "m/s"),
        compare(NAME, "bar: stress behind it", bar.found_plateau / 1e6, bar.plateau / 1e6, allowed, source, "MPa"),
        compare(NAME, "bar: velocity of the rebound", bar.velocity, bar.exact_velocity, allowed, source, "m/s"),
    ]


def lame_moved(values: dict[str, Any], radius: float) -> float:
    """Radial displacement (m) of an elastic tube in plane strain under inner pressure, at a radius (m)."""
    a, b, nu = values["inner_radius"], values["outer_radius"], values["poisson_ratio"]
    scale = (1.0 + nu) * values["pressure"] * a**2 / (values["elastic_modulus"] * (b**2 - a**2))
    return float(scale * ((1.0 - 2.0 * nu) * radius + b**2 / radius))


def lame_hoop(values: dict[str, Any], radius: float) -> float:
    """Hoop stress (Pa) of the same tube."""
    a, b = values["inner_radius"], values["outer_radius"]
    return float(values["pressure"] * a**2 / (b**2 - a**2) * (1.0 + b**2 / radius**2))


def check_tube(elastic: ElasticTube, plastic: PlasticTube) -> list[Row]:
    """Displacements and hoop stress of the elastic tube, pressure of the plastic one."""
    values, allowed = REFERENCE["tube"], REFERENCE["allowed"]["tube"]
    source = values["elastic_source"]
    rows = []
    for words, radius, moved in (
        ("inner", values["inner_radius"], elastic.inner_moved),
        ("outer", values["outer_radius"], elastic.outer_moved),
    ):
        wanted = 1e9 * lame_moved(values, radius)
        rows.append(compare(NAME, f"tube: {words} displacement", 1e9 * moved, wanted, allowed, source, "nm"))
    innermost = lame_hoop(values, float(elastic.radius[0])) / 1e3
    quantity = "tube: hoop stress of the innermost cell"
    rows.append(compare(NAME, quantity, float(elastic.hoop[0]) / 1e3, innermost, allowed, source, "kPa"))
    flows = within(NAME, "tube: whole wall flows", float(plastic.yielded), 1.0, 1.0, _OWN)
    rows.append(flows)
    if flows.passed:
        quantity = "tube: plastic pressure over 2 tau_c ln(b/a)"
        rows.append(compare(NAME, quantity, plastic.ratio, 1.0, allowed, values["plastic_source"]))
    return rows


def check_static(elastic: ElasticTube, coarse: StaticTube) -> list[Row]:
    """The static solve by PETSc against Lame, its order with `coarse` of cells twice as large; the damped run."""
    values, allowed = REFERENCE["tube"], REFERENCE["allowed"]
    fine, source = elastic.static, values["elastic_source"]
    exact = lame_moved(values, values["inner_radius"])
    order = float(np.log2(abs(coarse.inner_moved - exact) / abs(fine.inner_moved - exact)))
    outer, ours = lame_moved(values, values["outer_radius"]), fine.outer_moved
    quantity = "tube: damped run with 2x2x2 points, largest difference of a node"
    return [
        compare(
            NAME,
            "tube by PETSc: inner displacement",
            1e9 * fine.inner_moved,
            1e9 * exact,
            allowed["tube"],
            source,
            "nm",
        ),
        compare(NAME, "tube by PETSc: outer displacement", 1e9 * ours, 1e9 * outer, allowed["tube"], source, "nm"),
        within(NAME, "tube by PETSc: order of convergence", order, *allowed["tube_order"], source),
        within(NAME, quantity, elastic.difference, 0.0, allowed["tube_difference"], values["static_source"]),
    ]


def check_impact(label: str, impact: Impact, expected_length: float) -> list[Row]:
    """Momentum, energy and length of the rod; `expected_length` in m."""
    allowed = REFERENCE["allowed"]
    sound = [
        _closed(label, impact.energy_error),
        within(NAME, f"{label}: kinetic energy left", impact.moving, 0.0, 0.01, _OWN),
    ]
    momentum = within(
        NAME, f"{label}: momentum less the anvil's impulse", abs(impact.momentum_error), 0.0, allowed["momentum"],
        "conservation of momentum",
    )  # fmt: skip
    if not all(row.passed for row in sound):
        return [*sound, momentum]
    source = REFERENCE["impact"]["source"]
    ours, wanted = 1e3 * impact.length, 1e3 * expected_length
    length = compare(NAME, f"{label}: final length", ours, wanted, allowed["impact_length"], source, "mm")
    return [*sound, momentum, length]


def check_softening(label: str, cell: Softening) -> list[Row]:
    """Stress over strain, strength left, plastic work, and the pressure that a cell without strength still carries."""
    values, allowed = REFERENCE["softening"], REFERENCE["allowed"]["softening"]
    source = values["source"]
    return [
        within(NAME, f"{label}: largest error over the strength", cell.largest_error, 0.0, allowed, source),
        within(NAME, f"{label}: strength left at the end", cell.left, 0.0, 1e-9, source),
        compare(
            NAME, f"{label}: plastic work", cell.dissipated / 1e6, cell.exact_dissipated / 1e6, allowed, source, "MJ/m3"
        ),
        compare(
            NAME, f"{label}: pressure when squeezed after", cell.pressure / 1e9, cell.exact_pressure / 1e9, allowed,
            "K times the volumetric strain", "GPa",
        ),
    ]  # fmt: skip
