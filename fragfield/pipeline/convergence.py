"""Grid convergence of a run's own results: the burst repeated with the cell sizes of `burst.convergence`.

After the flight the burst, the break-up and the flight are computed with other cell sizes, which the case alone
decides: the same inputs give the same numbers however busy the machine is. What they give stands in summary.json as
`convergence`; `fragfield.pipeline.grid_convergence` has the arithmetic. These computations leave no files.
"""

from __future__ import annotations

import logging
import math
import time
from dataclasses import dataclass, replace

from fragfield.case import CaseTable
from fragfield.errors import EXIT_FAULT, exit_code_of, message_of
from fragfield.hazard.recommended import hazard_of
from fragfield.pipeline.beside import burst_beside, flown_beside, silent
from fragfield.pipeline.flown import FlownEnsemble
from fragfield.pipeline.grid_convergence import grid_convergence
from fragfield.pipeline.job import Job
from fragfield.quantities import shown
from fragfield.results.burst import Burst
from fragfield.results.convergence import ConvergedQuantity, Convergence
from fragfield.results.hazard import Hazard

OF_A_SWEEP = "no grid convergence: not computed for the runs of a sweep"

_ROOT = math.sqrt(2.0)
_FACTORS = {"off": (), "quick": (2.0,), "standard": (_ROOT, 2.0), "final": (1.0 / _ROOT, _ROOT, 2.0)}
_FACTORS_3D = (_ROOT, 2.0)  # a quarter and a sixteenth of the burst's cost; a finer one costs four times as much
_MOST = 32  # realisations with another size: beyond, its flights cost more than those of the run itself

COMMON = 1e-6
"""Standard error of an integral where it is compared with the same points and other cells."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Result:
    """What one size gave: its cells, and its quantities with their standard errors."""

    size: float
    cells: int
    realisations: int
    values: dict[str, float | None]
    errors: dict[str, float | None]


def convergence_of(job: Job, flown: FlownEnsemble, hazard: Hazard) -> Convergence:
    """Grid convergence of a run whose burst and flight are complete.

    Parameters
    ----------
    job : Job
        The run.
    flown, hazard : FlownEnsemble, Hazard
        Its flight, and what that gave.
    """
    burst = job.source.results().burst if job.options.fragments is None else None
    if (reason := _why_none(job, burst)) or burst is None:
        return Convergence(reason=reason)
    own = _own_result(burst, flown, hazard)
    job = replace(job, attitude=flown.attitude)  # of mixed attitudes the worst one, with other cells too
    began = time.perf_counter()
    words: list[str] = []
    assert job.case.burst is not None  # a run with a burst
    dimensions = 2 if burst.geometry == "axisymmetric" else 3
    factors = _FACTORS[job.case.burst.convergence] if dimensions == 2 else _FACTORS_3D
    number = min(own.realisations, _MOST)
    others = [_computed(job, with_cells(job.case, factor * own.size, number, burst.geometry), words)
              for factor in reversed(factors)]  # fmt: skip
    results = sorted([own, *(one for one in others if one is not None)], key=lambda one: one.size)
    quantities = {one.name: _quantity(one.name, results, own, dimensions) for one in shown("convergence")}
    spent = time.perf_counter() - began
    _log.info("convergence: %d cell sizes in %.1f s more", len(results), spent)
    return Convergence(
        sizes=tuple(one.size for one in results),
        cells=tuple(one.cells for one in results),
        representative_sizes=tuple(_representative(one, own, dimensions) for one in results),
        realisations=tuple(one.realisations for one in results),
        quantities={name: found for name, found in quantities.items() if found is not None},
        seconds=spent,
        reason="; ".join(words),
    )


def with_cells(case: CaseTable, size: float, realisations: int, geometry: str) -> CaseTable:
    """The case with cells of another size (m) and so many realisations, without what the quantities do not need."""
    assert case.burst is not None
    output = case.burst.output.model_copy(update={"interval": case.burst.time_limit})
    burst = case.burst.model_copy(
        update={"cell_size": size, "convergence": "off", "geometry": geometry, "output": output}
    )
    hazard = {"max_realisations": realisations}
    return case.model_copy(
        update={
            "burst": burst,
            "witness": [],
            "exposed": [],
            "site": None,
            "break_up": case.break_up.model_copy(update={"realisations": realisations}),
            "flight": case.flight.model_copy(update={"trajectories": 0}),
            "hazard": case.hazard.model_copy(update=hazard),
        }
    )


def _why_none(job: Job, burst: Burst | None) -> str:
    """Why the run has no convergence of its own; empty where it has."""
    if job.options.fragments is not None:
        return "no grid convergence: the fragments are from another source"
    if burst is None or job.case.burst is None:
        return "no grid convergence: the burst is not part of this run"
    if job.options.lean:
        return OF_A_SWEEP
    asked = job.case.burst.convergence
    if asked == "off":
        return 'no grid convergence: burst.convergence = "off"'
    if burst.geometry != "axisymmetric" and asked != "final":
        return (
            'no grid convergence: a burst in three dimensions has it with burst.convergence = "final" alone, and this '
            f'run has "{asked}"'
        )
    return ""


def _own_result(burst: Burst, flown: FlownEnsemble, hazard: Hazard) -> _Result:
    """The quantities of a burst and its flight."""
    hazardous, of_count = flown.hazard.hazardous
    parts = {
        "burst": burst,
        "hazard": hazard if hazard.determined else {},
        "flight": {"hazardous_fragments": hazardous},
    }
    values = {one.name: one.of(parts) for one in shown("convergence")}
    errors = {
        "hazardous_fragments": of_count,
        "expected_distance": hazard.standard_error if hazard.determined else None,
    }
    if hazard.method == "integral":
        # The same points with every size: their errors are common. What the burst scatters shows about the line.
        errors = dict.fromkeys(errors, COMMON)
    return _Result(burst.cell_size, burst.cells, hazard.realisations, values, errors)


def _computed(job: Job, case: CaseTable, words: list[str]) -> _Result | None:
    """The quantities of a case with other cells; None where they cannot be computed, and `words` says why."""
    assert case.burst is not None  # of `with_cells`
    size = f"{1e3 * case.burst.cell_size:.3g} mm"
    try:
        with silent():
            burst, snapshot = burst_beside(case, job.team)
            flown = flown_beside(case, snapshot, job.cores, job.attitude)[0]
    except Exception as error:
        if exit_code_of(error) == EXIT_FAULT:
            raise
        words.append(f"{size} could not be computed: {message_of(error)}")
        return None
    hazard = hazard_of(flown.hazard.headline)
    if not hazard.determined:
        words.append(f"{size} gave no distance: {hazard.reason}")
    return _own_result(burst, flown, hazard)


def _representative(one: _Result, own: _Result, dimensions: int) -> float:
    """Cell size (m) by the number of cells: meshes have whole numbers of layers (ASME V&V 20, 2-4.1)."""
    return float(own.size * (own.cells / one.cells) ** (1.0 / dimensions))


def _quantity(name: str, results: list[_Result], own: _Result, dimensions: int) -> ConvergedQuantity | None:
    """Convergence of one quantity; None where the run itself has no value of it."""
    if own.values[name] is None:
        return None
    values, errors = ([getattr(one, what).get(name) for one in results] for what in ("values", "errors"))
    statistical = name in own.errors
    known = [i for i, value in enumerate(values) if value is not None and (not statistical or errors[i] is not None)]
    if not known:
        known = [i for i, value in enumerate(values) if value is not None]
        statistical = False
    sizes = [_representative(results[i], own, dimensions) for i in known]
    distinct = [k for k, size in enumerate(sizes) if all(abs(size - other) > 0.02 * size for other in sizes[:k])]
    found = grid_convergence(
        [sizes[k] for k in distinct],
        [values[known[k]] for k in distinct],
        [errors[known[k]] for k in distinct] if statistical else None,
        at=own.size,
    )
    return ConvergedQuantity(
        values=tuple(values), standard_errors=tuple(errors) if name in own.errors else None, **vars(found)
    )
