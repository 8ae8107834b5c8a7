"""Plan of a study: inputs, sample points, and the case of every sample, checked before anything runs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragfield.case import CaseTable, changed_document, plain
from fragfield.case.load import case_from_document
from fragfield.case.problem import burst_geometry
from fragfield.case.schema import UncertaintyTable
from fragfield.errors import InputError
from fragfield.results.part import to_json
from fragfield.studies.uncertainty.inputs import UncertainInput, inputs_of

_EDGE = 1e-12  # normal distributions have no quantile at 0 and 1
_SEEDS = 2**32
_ENDS = (1e-3, 0.5, 1.0 - 1e-3)  # probabilities at which a case must be sound before anything runs
_TOLERANCE = 0.15  # of a sample at least: weighted fragments are fewer than for the distance of a run
_LEFT_OUT = ("uncertainty", "witness", "stack")


def latin_hypercube(dimensions: int, samples: int, seed: int) -> NDArray[np.float64]:
    """Points (n, d): every input has one point in each n-th of its probability (McKay, Beckman and Conover 1979)."""
    generator = np.random.RandomState(seed % _SEEDS)
    edges = np.arange(samples + 1) * (1.0 / samples)
    points = generator.uniform(edges[:-1, None], edges[1:, None], size=(samples, dimensions))
    for column in points.T:
        generator.shuffle(column)
    return np.clip(points, _EDGE, 1.0 - _EDGE)


def shared_bursts(
    in_burst: NDArray[np.bool_], samples: int, bursts: int, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points (n, d) of which groups share the coordinates of the burst's inputs, and each point's burst (n,).

    Coordinates of burst inputs are a Latin hypercube of so many points; the others one of n points. Bursts are dealt
    out evenly and at random.
    """
    points = np.empty((samples, len(in_burst)))
    rng = np.random.default_rng(np.random.SeedSequence([seed, 1]))
    burst = rng.permutation(np.arange(samples) % bursts)
    if in_burst.any():
        points[:, in_burst] = latin_hypercube(int(in_burst.sum()), bursts, seed)[burst]
    if not in_burst.all():
        points[:, ~in_burst] = latin_hypercube(int((~in_burst).sum()), samples, seed + 1)
    return points, burst


@dataclass(frozen=True, eq=False)
class Plan:
    """The samples of uncertain inputs."""

    case: CaseTable
    """Resolved, with every input as the case file has it."""
    inputs: tuple[UncertainInput, ...]
    """d of them."""
    seed: int
    """Of the points, and of every sample's random numbers."""
    realisations: int
    """Realisations of the break-up in each sample."""
    points: NDArray[np.float64]
    """(n, d) float64: in the unit cube."""
    burst: NDArray[np.int64] | None
    """(n,) int64 or None: which of the shared bursts a sample uses; None where each has a burst of its own."""
    geometry: str
    """Why bursts are shared or not, in words."""
    _document: dict[str, Any]

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.points)

    @property
    def bursts(self) -> int:
        """Number of shared bursts; 0 where each sample has its own."""
        return 0 if self.burst is None else int(self.burst.max()) + 1

    @cached_property
    def draws(self) -> list[tuple[Any, ...]]:
        """Values of the inputs by sample, in their order."""
        values = (one.distribution.drawn(self.points[:, i]) for i, one in enumerate(self.inputs))
        return list(zip(*values, strict=True))

    def document(self, number: int) -> dict[str, Any]:
        """The resolved case of a sample, as tables."""
        document = _changed(self._document, self.inputs, self.draws[number])
        document["title"] = f"{self.case.title}: sample {number}"
        # the same whichever worker makes the sample and when
        state = np.random.SeedSequence([self.seed, number]).generate_state(1, np.uint64)
        document["seed"] = int(state[0] >> np.uint64(1))
        return document

    def burst_document(self, number: int) -> dict[str, Any]:
        """The resolved case of a shared burst, as tables."""
        assert self.burst is not None
        sample = int(np.flatnonzero(self.burst == number)[0])
        inputs = [entry for entry in self.inputs if entry.in_burst]
        draws = [draw for entry, draw in zip(self.inputs, self.draws[sample], strict=True) if entry.in_burst]
        document = _changed(self._document, inputs, draws)
        document["title"] = f"{self.case.title}: burst {number}"
        return document

    def identity(self) -> dict[str, Any]:
        """What must be the same for a study to go on: case, inputs, points and seeds."""
        case = json.dumps(self._document, sort_keys=True)
        return {
            "case": hashlib.sha256(case.encode()).hexdigest(),
            "inputs": [
                {key: value for key, value in to_json(entry.described()).items() if key != "source"}
                for entry in self.inputs
            ],
            "samples": self.samples,
            "bursts": self.bursts,
            "seed": self.seed,
            "realisations": self.realisations,
            "points": hashlib.sha256(np.ascontiguousarray(np.round(self.points, 12)).tobytes()).hexdigest(),
        }  # fmt: skip


def plan_samples(case: CaseTable, *, samples: int | None = None, seed: int | None = None) -> Plan:
    """Plan the samples of a resolved case; what is left out comes from its table [uncertainty].

    Raises InputError: there is no input, one makes a case that cannot be computed, or there are too few samples or
    bursts.
    """
    table = case.uncertainty or UncertaintyTable()
    if case.burst is None or not case.round:
        raise InputError("uncertainty: the case has no burst; needed: tables [burst] and [[round]]")
    inputs = tuple(inputs_of(case))
    seed = case.seed if seed is None else seed
    number = samples or table.samples
    document = _bare(case, table)
    axisymmetric, words = _check_ends(case, document, inputs)
    burst: NDArray[np.int64] | None = None
    if not axisymmetric:
        points, burst = shared_bursts(_in_burst(inputs), number, _bursts(table, inputs, number), seed)
    else:
        points = latin_hypercube(len(inputs), number, seed)
    return Plan(case, inputs, seed, table.realisations, points, burst, words, document)


def _bare(case: CaseTable, table: UncertaintyTable) -> dict[str, Any]:
    document = {key: value for key, value in plain(case, units=True).items() if key not in _LEFT_OUT}
    document["break_up"] = {**document["break_up"], "realisations": table.realisations}
    tolerance = max(case.hazard.tolerance, _TOLERANCE)
    document["hazard"] |= {"max_realisations": table.realisations, "tolerance": tolerance}
    document["flight"] = {**document["flight"], "trajectories": 0}
    # The case as it stands was checked against its drawing; a sample may have other densities.
    document["round"] = [{key: entry[key] for key in entry if key != "expected"} for entry in document["round"]]
    output = {**document["burst"].get("output", {}), "interval": document["burst"]["time_limit"]}
    document["burst"] = {**document["burst"], "convergence": "off", "output": output}
    return document


def _changed(document: dict[str, Any], inputs: Any, draws: Sequence[Any]) -> dict[str, Any]:  # noqa: ANN401 - of inputs
    changes: dict[str, Any] = {}
    for entry, draw in zip(inputs, draws, strict=True):
        changes |= entry.changes(draw)
    return changed_document(document, changes, source="uncertainty", folder=Path())


def _in_burst(inputs: tuple[UncertainInput, ...]) -> NDArray[np.bool_]:
    return np.array([entry.in_burst for entry in inputs])


def _bursts(table: UncertaintyTable, inputs: tuple[UncertainInput, ...], samples: int) -> int:
    own = int(_in_burst(inputs).sum())
    if own == 0:
        return 1
    fewest = own + 2
    found = table.bursts or 2 * own + 2
    if found < fewest:
        raise InputError(
            f"uncertainty.bursts: found {found}; allowed with {own} uncertain inputs of the burst: at least {fewest}"
        )
    if samples < 2 * found:
        raise InputError(
            f"uncertainty.samples: found {samples} for {found} bursts; allowed: at least {2 * found}, two for each"
        )
    return found


def _check_ends(case: CaseTable, document: dict[str, Any], inputs: tuple[UncertainInput, ...]) -> tuple[bool, str]:
    """Whether every burst is axisymmetric, and why; the cases at the ends of every input must be sound."""
    choice = burst_geometry(case)
    found = choice.geometry == "axisymmetric"
    what = "every sample has its own axisymmetric burst" if found else "the burst is in three dimensions"
    words = f"{what}: {choice.reason}"
    for entry in inputs:
        for u in _ENDS:
            draw = entry.distribution.drawn([u])[0]
            ended = case_of(document, entry, draw)
            if found and burst_geometry(ended).geometry != "axisymmetric":
                found = False
                words = f"with {entry.name} = {draw} the burst is in three dimensions"
    return found, words


def case_of(document: dict[str, Any], entry: UncertainInput, draw: Any) -> CaseTable:  # noqa: ANN401 - a number or a word
    """The resolved case with one input changed; raises InputError that names the input."""
    where = f'uncertainty input "{entry.name}" at {draw}'
    try:
        return case_from_document(_changed(document, (entry,), [draw]), source=where, folder=Path())
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith(where) else f"{where}: {text}") from None
