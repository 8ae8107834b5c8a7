"""The "break_up" part of summary.json: SI units; the names are a contract."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from transition.law.count_fit import CountFit
    from transition.ledger import BreakUpLedger
    from transition.placement.directions import Directions
    from transition.placement.isometry import Attitude
    from transition.results import BrokenRound, SegmentResult
    from transition.settings import BreakUpSettings


def summarised(
    rounds: Sequence[BrokenRound],
    results: Sequence[SegmentResult],
    ledgers: Mapping[int, BreakUpLedger],
    directions: Mapping[int, Directions],
    handed_over: BreakUpLedger,
    settings: BreakUpSettings,
    outside: Mapping[str, Sequence[str]],
    attitude: Attitude,
    fit: CountFit | None = None,
) -> dict[str, Any]:
    """Numbers of one realisation.

    Parameters
    ----------
    rounds : sequence of BrokenRound
        Computed rounds, then mirrored ones.
    results : sequence of SegmentResult
        Segments of all of them.
    ledgers, directions : mappings from a round's number
        For the rounds that have fragments.
    handed_over : BreakUpLedger
        Of all rounds together.
    settings : BreakUpSettings
        Choices of the break-up.
    outside : mapping from a round's name
        In which respects no published data on mean masses are near it.
    attitude : Attitude
        How all fragments were turned about the round's axis, and tilted.
    fit : CountFit or None
        Of the mean masses to the pieces of a test.
    """
    return {
        "fragments": sum(r.fragments for r in results),
        "points": sum(r.points for r in results),
        "mass": handed_over.mass,
        "mass_error": handed_over.mass_error,
        "momentum_error": handed_over.momentum_error,
        "energy_error": handed_over.energy_error,
        "casing_energy": handed_over.casing_energy,
        "energy_lost": handed_over.casing_energy - handed_over.energy,
        "sampler": settings.sampler,
        "velocity": settings.velocity,
        "mean_mass": _mean_mass(settings, fit, outside),
        "direction_scatter": settings.direction_scatter,
        "turn": attitude.turn,
        "tilt": list(attitude.tilt),
        "tilt_deviation": settings.tilt,
        "rounds": [
            _round_summary(rounds[number], [r for r in results if r.round == number], ledgers[number], found)
            for number, found in directions.items()
        ],
    }


def _mean_mass(settings: BreakUpSettings, fit: CountFit | None, outside: Mapping[str, Sequence[str]]) -> dict[str, Any]:
    if fit is None:
        factor, source = settings.factor
    elif settings.mean_mass_factor is None:
        factor, source = fit.factor, fit.label
    else:
        factor, source = settings.mean_mass_factor, "input"
    law = settings.mean_mass if isinstance(settings.mean_mass, str) else "given"
    return {
        "law": law if fit is None else "fitted",
        "factor": factor,
        "factor_source": source,
        "outside_data": [{"round": name, "text": text} for name, texts in outside.items() for text in texts],
        **({} if fit is None else {"test": fit.summary()}),
    }


def _round_summary(
    broken: BrokenRound, results: Sequence[SegmentResult], handed_over: BreakUpLedger, directions: Directions
) -> dict[str, Any]:
    return {
        "name": broken.name,
        "mirror_of": broken.mirror_of,
        "fragments": sum(r.fragments for r in results),
        "mass": float(sum(r.draw.mass.sum() for r in results)),
        "mass_error": handed_over.mass_error,
        "momentum_error": handed_over.momentum_error,
        "energy_error": handed_over.energy_error,
        "polar_difference": directions.polar_difference,
        "azimuth_difference": directions.azimuth_difference,
        "directions": {
            "polar_deg": directions.polar.tolist(),
            "polar_fragments": directions.polar_fragments.tolist(),
            "polar_cells": directions.polar_cells.tolist(),
            "azimuth_deg": directions.azimuth.tolist(),
            "azimuth_fragments": directions.azimuth_fragments.tolist(),
            "azimuth_cells": directions.azimuth_cells.tolist(),
        },
        "segments": [_segment_summary(r) for r in results],
    }


def _segment_summary(result: SegmentResult) -> dict[str, Any]:
    data, law = result.segment.data, result.law
    return {
        "name": data.name,
        "kind": data.kind,
        "start": data.start,
        "end": data.end,
        "mean_mass": law.law.mean,
        "mu": law.law.parts[0].mu,
        "n0": law.n0,
        "parts": [{"dimension": p.dimension, "mu": p.mu, "mass_fraction": p.weight} for p in law.law.parts],
        "fragments": result.fragments,
        "mass": float(result.draw.mass.sum()),
        "mass_deficit": result.draw.deficit,
        "casing_mass": law.mass,
        "heaviest": float(result.draw.mass.max()),
        "v0": law.v0,
        "speed": data.speed,
        "rupture": law.rupture,
        "rupture_radius": law.radius,
        "rupture_wall": law.wall,
        "strain_rate": law.rate,
        "method": result.draw.method,
        "closure": result.draw.closure,
        "points": result.points,
        "resolved": result.resolved,
    }
