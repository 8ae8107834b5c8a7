"""The burst's part of summary.json; the names of its entries are a contract."""

from __future__ import annotations

import resource
import time as clock
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numba
import numpy as np

from burst_fenicsx.files.snapshot import RoundRecord
from burst_fenicsx.kernels.constants import CHECK_INTERVAL, GURNEY_VOLUME
from burst_fenicsx.materials.products.landau import LandauProducts
from burst_fenicsx.mechanics.detonation import ignition_times, place_ignition
from burst_fenicsx.meshing.placement import frame
from burst_fenicsx.problem import Part
from burst_fenicsx.records.exposure import verdict
from burst_fenicsx.records.measures import speed_quantiles, speeds_and_bound
from fragfield_base.burst_snapshot import SegmentRecord

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.assembled import AssembledBurst
    from burst_fenicsx.mechanics.initiation import Source
    from burst_fenicsx.problem import Round
    from burst_fenicsx.records.exposure import Exposure
    from burst_fenicsx.records.measures import RoundMeasures


@dataclass
class Clocks:
    """Wall-clock times of a run (s): its start, what came before the first step, the stepping, the last progress."""

    start: float = field(default_factory=clock.perf_counter)
    first_step: float = 0.0
    stepping: float = 0.0
    last_progress: float = 0.0


def burst_summary(
    run: AssembledBurst,
    along: Sequence[RoundMeasures],
    charge_masses: Sequence[float],
    clocks: Clocks,
    first_cell_step: int,
    acceleration_complete: float | None,
) -> dict[str, Any]:
    """Summarise a finished run; collective.

    Parameters
    ----------
    run : the run.
    along : speeds and diameters along each round of the whole arrangement.
    charge_masses : of each of these rounds (kg).
    clocks, first_cell_step : times of the run, and the steps of cells before it went on from a checkpoint.
    acceleration_complete : when it was (s).
    """
    solver, last = run.solver, run.ledger.entries[-1]
    distortion = run.measures.distortion()
    cell_steps = run.comm.allreduce(solver.cell_steps)
    done = max(cell_steps - run.comm.allreduce(first_cell_step), 1)
    casing = np.array([item.casing_mass.sum() for item in along])
    means = np.array([item.mean for item in along])
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    left, energies_now = run.acceleration.left(), run.ledger.kinetic_casings * run.part.multiplicity
    known = np.isfinite(left)
    contact = _of_all_images(run.contact.summary(), run.part.images)
    whole, source = run.part.whole, run.part.source
    shocks = run.completion.of_rounds(run.initiation.sources) if run.initiation is not None else [None] * len(whole)
    balances, energies = run.ledger.products_balances(run.fields), run.ledger.chemical_energies
    exposures = run.completion.of_rounds(run.exposures.found())
    return {
        "geometry": run.geometry.name,
        "cells": len(run.mesh.cells),
        "nodes": len(run.mesh.nodes),
        "symmetry": {**run.part.summary(), "all_cells": len(run.completion.cells)},
        "ranks": run.comm.size,
        "threads": numba.get_num_threads(),
        "steps": solver.steps,
        "cell_steps": cell_steps,
        "end_time": solver.time,
        "wall_seconds": clock.perf_counter() - clocks.start,
        "start_seconds": clocks.first_step,
        "stepping_seconds": clocks.stepping,
        "seconds_per_cell_step": clocks.stepping / done,
        "peak_memory_bytes": int(run.comm.allreduce(memory)),
        "casing_mass": float(casing.sum()),
        "charge_mass": float(sum(charge_masses)),
        "mean_initial_speed": float((means * casing).sum() / casing.sum()),
        "mean_speed_at_end": last.mean_casing_speed,
        "max_initial_speed": max(item.largest for item in along),
        "speed_quantiles": speed_quantiles(along),
        **speeds_and_bound(run.fields, run.part.images),
        "outer_diameter": last.outer_diameter,
        "lost_cells": distortion.lost,
        "folded_cells": distortion.folded,
        "folded_casing_mass": distortion.folded_casing_mass,
        "released_cells": distortion.released,
        "released_casing_mass": distortion.released_casing_mass,
        "passed_through": run.interpenetration.summary(),
        "energy_error": max(entry.energy_error for entry in run.ledger.entries),
        "energy_error_at_checks": _error_at_checks(run),
        "energy_error_at_end": last.energy_error,
        "contact_error": max(entry.contact_error for entry in run.ledger.entries),
        "contact_error_at_end": last.contact_error,
        "momentum_error": last.momentum_error,
        "max_penetration": contact["max_penetration"],
        "contact": contact,
        "products_balance": float(balances @ energies / energies.sum()),
        "acceleration_complete": acceleration_complete,
        "acceleration_left": float(np.average(left[known], weights=energies_now[known])) if known.any() else None,
        "products": run.settings.products,
        "quadrature": run.settings.quadrature,
        "cell_size": run.settings.cell_size,
        "min_scaled_jacobian": run.quality.min_scaled_jacobian,
        "max_aspect_ratio": run.quality.max_aspect_ratio,
        "min_edge": run.quality.min_edge,
        "rounds": [
            {
                "name": item.name,
                "casing_mass": float(measure.casing_mass.sum()),
                "charge_mass": float(charge),
                "mean_initial_speed": measure.mean,
                "acceleration_left": float(left[source[index]]) if known[source[index]] else None,
                "max_initial_speed": measure.largest,
                "speed_quantiles": speed_quantiles([measure]),
                "outer_diameter": float(np.nanmax(measure.outer_diameter)),
                "fastest_station": measure.fastest,
                "length": run.mesh.lengths[source[index]],
                "products_balance": float(balances[source[index]]),
                "ignition": ignitions(item, run.mesh.lengths[source[index]], shocks[index], solver.time),
                **_exposure(exposures[index], item, run.settings.cell_size),
            }
            for index, (item, measure, charge) in enumerate(zip(whole, along, charge_masses, strict=True))
        ],
    }


def _exposure(found: Exposure | None, item: Round, cell_size: float) -> dict[str, Any]:
    return {} if found is None else {"exposure": verdict(found, item.explosive.critical_energy, cell_size)}


def _of_all_images(contact: dict[str, Any], images: int) -> dict[str, Any]:
    """Contact's summary with counts and energies of the whole arrangement, `images` times the computed part."""
    extensive = ("bonded", "touching", "off_surface", "spring_energy", "friction_heat", "work", "gain")
    return {**contact, **{name: images * contact[name] for name in extensive}}


def _error_at_checks(run: AssembledBurst) -> float:
    """Largest error of the ledger at multiples of `CHECK_INTERVAL`; while the first cells burn it is larger."""
    entries = run.ledger.entries
    times = np.array([entry.time for entry in entries])
    checks = np.arange(CHECK_INTERVAL, times[-1], CHECK_INTERVAL)
    nearest = {int(np.argmin(np.abs(times - check))) for check in (*checks, times[-1])}
    return max(entries[row].energy_error for row in nearest)


def ignitions(item: Round, length: float, shock: Source | None, end: float) -> list[dict[str, Any]]:
    """What initiated a round by the end of the burst, in order of time; empty where nothing did.

    Entries of summary.json: `by` ("point" or "delay", an ignition point of its own at time zero or later; "shock", the
    first cell initiated by one), `time` (s), `place` where the charge lay at rest (m), and its `station` along the axis
    from the nose end (m). A point that a front reaches before its delay is over initiates nothing and is left out.

    Parameters
    ----------
    item : the round. length : of it (m).
    shock : the first cell that a shock initiated, None where none did.
    end : of the burst (s).
    """
    positions, times = place_ignition(item, length)
    kinds = ["delay" if time > 0.0 else "point" for time in times]
    if shock is not None:
        positions, times = np.vstack([positions, shock.place]), np.append(times, shock.time)
        kinds.append("shock")
    reached = ignition_times(positions, positions, times, item.explosive.detonation_velocity)
    axis, base = frame(item.axis)[2], np.asarray(item.position, dtype=float)
    entries = [
        {"by": kind, "time": float(time), "place": place.tolist(), "station": float(length - (place - base) @ axis)}
        for kind, time, place, first in zip(kinds, times, positions, reached, strict=True)
        if time <= min(first, end)
    ]
    return sorted(entries, key=lambda entry: float(entry["time"]))


def round_records(run: AssembledBurst, masses: Sequence[np.ndarray], speeds: Sequence[np.ndarray]) -> list[RoundRecord]:
    """Describe every computed round of a finished run, cut ones as whole.

    `masses` (kg) and `speeds` (m/s) are those of the casing's segments, round by round.
    """
    mesh = run.mesh
    volume = mesh.volumes * run.part.multiplicity[mesh.round]
    records = []
    for index, item in enumerate(run.rounds):
        own = mesh.round == index
        totals = {part: float(volume[own & (mesh.part == part)].sum()) for part in Part}
        segments = []
        for number, segment in enumerate(mesh.segments[index]):
            inside = own & (mesh.station >= segment.start) & (mesh.station < segment.end)
            by_part = {part: float(volume[inside & (mesh.part == part)].sum()) for part in Part}
            length = segment.end - segment.start
            whole = sum(by_part.values())
            inner = np.sqrt((whole - by_part[Part.CASING]) / (np.pi * length))
            outer = np.sqrt(whole / (np.pi * length))
            segments.append(
                SegmentRecord(
                    name=segment.name,
                    kind=segment.kind,
                    start=segment.start,
                    end=segment.end,
                    outer_radius=float(outer),
                    wall_thickness=float(outer - inner),
                    charge_radius=float(np.sqrt(by_part[Part.CHARGE] / (np.pi * length))),
                    casing_mass=float(masses[index][number]),
                    charge_mass=by_part[Part.CHARGE] * item.explosive.density,
                    speed=float(speeds[index][number]),
                )
            )
        products = run.fields.products[index]
        explosive = item.explosive
        if isinstance(products, LandauProducts):
            gurney = products.gurney_velocity(GURNEY_VOLUME)
        else:
            # Eq. 24 in SI: km/s and m/s in the paper's 0.52 + 2.8e-4 D.
            gurney = 520.0 + 0.28 * explosive.detonation_velocity
        records.append(
            RoundRecord(
                name=item.name,
                length=mesh.lengths[index],
                casing_density=item.casing.density,
                casing_yield=2.0 * item.casing.shear_strength,  # Tresca
                casing_mass=totals[Part.CASING] * item.casing.density,
                charge_mass=totals[Part.CHARGE] * explosive.density,
                fuze_mass=totals[Part.FUZE] * run.fuze_density[index],
                explosive=explosive.name,
                explosive_density=explosive.density,
                detonation_velocity=explosive.detonation_velocity,
                gurney_velocity=gurney,
                position=tuple(item.position),
                axis=tuple(item.axis),
                segments=tuple(segments),
            )
        )
    return records
