"""The solid alone: waves, static and plastic tubes, an impact and a softening cell, against closed forms."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from validation.runs import reference_beside

if TYPE_CHECKING:
    from validation.rows import Rows
    from validation.runs import Runs
    from validation.solid.bar import Bar
    from validation.solid.elastic_tube import ElasticTube, StaticTube
    from validation.solid.impact import Impact
    from validation.solid.softening import Softening
    from validation.solid.tube import PlasticTube

__all__ = ["REFERENCE", "lame_hoop", "lame_moved", "study"]

REFERENCE = reference_beside(__file__)
ALLOWED = REFERENCE["allowed"]


def study(_: Runs, rows: Rows) -> None:
    """Compute the bodies in this process, on one thread: bodies of a few cells are slower on several."""
    import numba

    threads = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        _compute(rows)
    finally:
        numba.set_num_threads(threads)


def _compute(rows: Rows) -> None:
    from validation.solid.bar import bar_on_wall
    from validation.solid.elastic_tube import elastic_tube, static_tube
    from validation.solid.impact import final_length, impact
    from validation.solid.softening import in_shear, in_tension
    from validation.solid.tube import plastic_tube

    cells = "quick_cells" if rows.quick else "cells"
    check_bar(rows, bar_on_wall(REFERENCE["bar"], REFERENCE["bar"][cells]))
    values = REFERENCE["tube"]
    elastic, plastic = elastic_tube(values, values[cells]), plastic_tube(values, values[cells])
    check_tube(rows, elastic, plastic)
    check_static(rows, elastic, static_tube(values, values[cells] // 2))
    values = REFERENCE["impact"]
    for core in values["core_cells"]:
        label = f"impact, {2 * core} cells across"
        check_impact(rows, label, impact(values, core, local=False), final_length(values))
        # What cells that are flattened beside long steps cost: between their own steps nodes move uniformly.
        rows.trend(f"{label}: energy error with local time stepping", impact(values, core).energy_error, None,
                   "conservation of energy")  # fmt: skip
    for label, strained in (("shear", in_shear), ("tension", in_tension)):
        check_softening(rows, f"softening in {label}", strained(REFERENCE["softening"]))


def check_bar(rows: Rows, bar: Bar) -> None:
    """Energy, speed of the wave, stress behind it, velocity with which the bar leaves the wall."""
    source, allowed = REFERENCE["bar"]["source"], ALLOWED["bar"]
    rows.bound("bar: energy error", abs(bar.energy_error), (0.0, ALLOWED["energy"]), "conservation of energy")
    rows.verify("bar: speed of the wave", bar.found_speed, bar.speed, allowed, source, "m/s")
    rows.verify("bar: stress behind it", bar.found_plateau / 1e6, bar.plateau / 1e6, allowed, source, "MPa")
    rows.verify("bar: velocity of the rebound", bar.velocity, bar.exact_velocity, allowed, source, "m/s")


def lame_moved(values: dict[str, Any], radius: float) -> float:
    """Radial displacement (m) of an elastic tube in plane strain under inner pressure, at a radius (m)."""
    a, b, nu = values["inner_radius"], values["outer_radius"], values["poisson_ratio"]
    scale = (1.0 + nu) * values["pressure"] * a**2 / (values["elastic_modulus"] * (b**2 - a**2))
    return float(scale * ((1.0 - 2.0 * nu) * radius + b**2 / radius))


def lame_hoop(values: dict[str, Any], radius: float) -> float:
    """Hoop stress (Pa) of the same tube."""
    a, b = values["inner_radius"], values["outer_radius"]
    return float(values["pressure"] * a**2 / (b**2 - a**2) * (1.0 + b**2 / radius**2))


def check_tube(rows: Rows, elastic: ElasticTube, plastic: PlasticTube) -> None:
    """Displacements and hoop stress of the elastic tube, pressure of the plastic one."""
    values, allowed = REFERENCE["tube"], ALLOWED["tube"]
    source = values["elastic_source"]
    inner, outer = (1e9 * lame_moved(values, values[f"{side}_radius"]) for side in ("inner", "outer"))
    rows.verify("tube: inner displacement", 1e9 * elastic.inner_moved, inner, allowed, source, "nm")
    rows.verify("tube: outer displacement", 1e9 * elastic.outer_moved, outer, allowed, source, "nm")
    innermost = lame_hoop(values, float(elastic.radius[0])) / 1e3
    rows.verify("tube: hoop stress of the innermost cell", float(elastic.hoop[0]) / 1e3, innermost, allowed, source,
                "kPa")  # fmt: skip
    rows.bound("tube: part of the wall that flows", float(plastic.yielded), (1.0, 1.0), values["plastic_source"])
    rows.verify("tube: plastic pressure over 2 tau_c ln(b/a)", plastic.ratio, 1.0, allowed, values["plastic_source"])


def check_static(rows: Rows, elastic: ElasticTube, coarse: StaticTube) -> None:
    """The static solve by PETSc against Lame, its order with `coarse` of cells twice as large; the damped run."""
    values = REFERENCE["tube"]
    fine, source = elastic.static, values["elastic_source"]
    exact, outer = (lame_moved(values, values[f"{side}_radius"]) for side in ("inner", "outer"))
    order = float(np.log2(abs(coarse.inner_moved - exact) / abs(fine.inner_moved - exact)))
    rows.verify("tube by PETSc: inner displacement", 1e9 * fine.inner_moved, 1e9 * exact, ALLOWED["tube"], source, "nm")
    rows.verify("tube by PETSc: outer displacement", 1e9 * fine.outer_moved, 1e9 * outer, ALLOWED["tube"], source, "nm")
    low, high = ALLOWED["tube_order"]
    rows.bound("tube by PETSc: order of convergence", order, (low, high), source)
    rows.bound("tube: damped run with 2x2x2 points beside PETSc, largest difference of a node", elastic.difference,
               (0.0, ALLOWED["tube_difference"]), values["static_source"])  # fmt: skip


def check_impact(rows: Rows, label: str, impact: Impact, expected_length: float) -> None:
    """Momentum and energy of the rod; only where it is closed and at rest, its length (m) beside a fitted formula."""
    rows.bound(f"{label}: momentum less the anvil's impulse", abs(impact.momentum_error), (0.0, ALLOWED["momentum"]),
               "conservation of momentum")  # fmt: skip
    closed = rows.bound(f"{label}: energy error", abs(impact.energy_error), (0.0, ALLOWED["energy"]),
                        "conservation of energy")  # fmt: skip
    source = REFERENCE["impact"]["source"]
    rest = rows.bound(f"{label}: kinetic energy left", impact.moving, (0.0, ALLOWED["moving"]), source)
    if closed.passed and rest.passed:
        rows.compare(f"{label}: final length", 1e3 * impact.length, 1e3 * expected_length, source, "mm")


def check_softening(rows: Rows, label: str, cell: Softening) -> None:
    """Stress over strain, plastic work, and the pressure that a cell without strength still carries."""
    source, allowed = REFERENCE["softening"]["source"], ALLOWED["softening"]
    rows.bound(f"{label}: largest error over the strength", cell.largest_error, (0.0, allowed), source)
    rows.bound(f"{label}: strength left at the end", cell.left, (0.0, ALLOWED["left"]), source)
    rows.verify(f"{label}: plastic work", cell.dissipated / 1e6, cell.exact_dissipated / 1e6, allowed, source, "MJ/m3")
    rows.verify(f"{label}: pressure when squeezed after", cell.pressure / 1e9, cell.exact_pressure / 1e9, allowed,
                "K times the volumetric strain", "GPa")  # fmt: skip
