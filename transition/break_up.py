"""From the burst casing to fragments: law, sampling, placing, velocity and what is handed over."""

from __future__ import annotations

from dataclasses import dataclass
from operator import index
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from transition.adjacency import face_neighbours
from transition.directions import Directions, Shares, cell_shares, compare_directions
from transition.errors import InputError
from transition.laws import SegmentLaw, segment_law
from transition.ledger import Ledger, ledger
from transition.placing import Patches, cell_sides, join, patch_means, place, point_positions
from transition.samplers import Draw, Graded, Quantile, Sampler
from transition.segments import CasingSegment, casing_segments
from transition.settings import BreakUpSettings
from transition.snapshot import Snapshot

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from flight.fragments import Fragments
    from transition.dolfinx_field import VelocityField

__all__ = ["BreakUp", "BreakUpResult", "SegmentResult", "break_up", "realisations"]


@dataclass(frozen=True, eq=False)
class SegmentResult:
    """A segment, its law, and the fragments drawn from it."""

    segment: CasingSegment
    law: SegmentLaw
    draw: Draw
    contiguous: int  # fragments whose patch hangs together


@dataclass(frozen=True, eq=False)
class BreakUpResult:
    """One realisation of the break-up.

    Attributes
    ----------
    fragments : flight.fragments.Fragments
        By round, segment and order of placing.
    segments : tuple of SegmentResult
        Law and draw of every segment.
    patches : Patches
        Which casing cells (places in `Snapshot.casing`) each fragment covers.
    directions : tuple of (int, Directions)
        Directions by mass of each round that has fragments.
    ledger : Ledger
        Mass, momentum and energy handed over.
    summary : dict
        The "break_up" part of summary.json; SI units.
    """

    fragments: Fragments
    segments: tuple[SegmentResult, ...]
    patches: Patches
    directions: tuple[tuple[int, Directions], ...]
    ledger: Ledger
    summary: dict[str, Any]


class BreakUp:
    """A burst casing made ready to be broken up any number of times.

    Reading, cutting, neighbours and laws do not depend on chance and are done once.

    Parameters
    ----------
    snapshot : Snapshot or path
        End of the burst stage, or its file burst_snapshot.h5.
    settings : BreakUpSettings
        Choices of the break-up.

    Raises
    ------
    InputError
        The snapshot or the settings cannot be used; the message says why.
    """

    def __init__(self, snapshot: Snapshot | str | Path, settings: BreakUpSettings | None = None) -> None:
        self.snapshot = snapshot if isinstance(snapshot, Snapshot) else Snapshot.read(snapshot)
        self.settings = settings if settings is not None else BreakUpSettings()
        self.segments = casing_segments(self.snapshot, self.settings.segments)
        casing = self.snapshot.casing
        self._cells = self.snapshot.cells[casing]
        self._mass = self.snapshot.mass[casing]
        self._corners = self.snapshot.position[self._cells]
        self._node_velocity = self.snapshot.velocity[self._cells]
        self.laws = tuple(
            segment_law(s, float(self._mass[s.cells].sum()), self.snapshot.rounds[s.round], self.settings)
            for s in self.segments
        )
        self._sides = cell_sides(self._corners)
        self._neighbours = self._local_neighbours()
        self._cell_shares: dict[int, Shares] = {}
        self._field: VelocityField | None = None

    def _local_neighbours(self) -> list[NDArray[np.int64]]:
        """Face neighbours within each segment, in the numbers of its own cells."""
        group, local = np.empty((2, len(self._cells)), dtype=np.int64)
        group[:], local[:] = -1, -1
        for number, segment in enumerate(self.segments):
            group[segment.cells] = number
            local[segment.cells] = np.arange(segment.cells.size)
        neighbours = face_neighbours(self._cells, group)
        return [np.where(neighbours[s.cells] >= 0, local[neighbours[s.cells]], -1) for s in self.segments]

    def realisation(self, seed: int, number: int = 0) -> BreakUpResult:
        """Break the casing up once.

        Every (realisation, round, segment) has a stream of chance of its own, so that the result of one does not
        depend on which others are computed, in which order, or on which rank.

        Parameters
        ----------
        seed : int
            Seed of the ensemble, 0 or above.
        number : int
            Which realisation of the ensemble.
        """
        entropy, number = _whole("seed", seed), _whole("realisation", number)
        results, parts = [], []
        for segment, law, neighbours in zip(self.segments, self.laws, self._neighbours, strict=True):
            stream = np.random.SeedSequence(entropy, spawn_key=(number, segment.round, segment.index))
            drawing, placing = (np.random.default_rng(child) for child in stream.spawn(2))
            try:
                draw = self._sampler(segment).draw(law.law, law.mass, drawing)
            except InputError as error:
                name = self.snapshot.rounds[segment.round].name
                raise InputError(f"round {name!r}, segment {segment.data.name!r}: {error}") from None
            cell_mass, sides = self._mass[segment.cells], self._sides[segment.cells]
            take_all = draw.method != "graded"
            patches = place(draw.mass, cell_mass, neighbours, placing, take_all=take_all, sides=sides)
            parts.append((patches, segment.cells))
            results.append(SegmentResult(segment, law, draw, int(patches.contiguous.sum())))
        return self._result(tuple(results), parts)

    def _sampler(self, segment: CasingSegment) -> Sampler:
        if self.settings.sampler == "graded" and not segment.is_end:
            return Graded(self.settings.graded_m0, self.settings.graded_dm)
        return Quantile()

    def _result(
        self, results: tuple[SegmentResult, ...], parts: list[tuple[Patches, NDArray[np.int64]]]
    ) -> BreakUpResult:
        from flight.fragments import Fragments

        patches = join(parts)
        if self.settings.velocity == "interpolation":
            if self._field is None:
                from transition.dolfinx_field import VelocityField

                self._field = VelocityField(self.snapshot)
            velocity = self._field.at(patches.seed, patches.point)
            position = point_positions(patches, self._corners)
        else:
            velocity = patch_means(patches, self._node_velocity)
            position = patch_means(patches, self._corners)
        counts = [part.mass.size for part, _ in parts]
        of_round = np.repeat([r.segment.round for r in results], counts).astype(np.int32)
        of_segment = np.repeat([r.segment.index for r in results], counts).astype(np.int32)
        shape = np.full(patches.mass.size, float(self.settings.shape_factor))
        fragments = Fragments(patches.mass, position, velocity, shape, of_round, of_segment)
        handed_over = ledger(patches.mass, velocity, self._mass, self._node_velocity)
        directions = tuple(
            (number, self._directions(number, fragments)) for number in sorted({r.segment.round for r in results})
        )
        summary = self._summary(results, counts, handed_over, dict(directions), patches)
        return BreakUpResult(fragments, results, patches, directions, handed_over, summary)

    def _directions(self, number: int, fragments: Fragments) -> Directions:
        axis = self.snapshot.rounds[number].axis
        if number not in self._cell_shares:
            own = self.snapshot.round[self.snapshot.casing] == number
            self._cell_shares[number] = cell_shares(self._mass[own], self._node_velocity[own], axis)
        mine = fragments.round == number
        return compare_directions(fragments.mass[mine], fragments.velocity[mine], self._cell_shares[number], axis)

    def _summary(
        self,
        results: tuple[SegmentResult, ...],
        counts: list[int],
        handed_over: Ledger,
        directions: dict[int, Directions],
        patches: Patches,
    ) -> dict[str, Any]:
        rounds = []
        for number, found in directions.items():
            mine = [(r, n) for r, n in zip(results, counts, strict=True) if r.segment.round == number]
            rounds.append(
                {
                    "name": self.snapshot.rounds[number].name,
                    "fragments": sum(n for _, n in mine),
                    "mass": float(sum(r.draw.mass.sum() for r, _ in mine)),
                    "polar_difference": found.polar_difference,
                    "azimuth_difference": found.azimuth_difference,
                    "segments": [_segment_summary(r, n) for r, n in mine],
                }
            )
        return {
            "fragments": int(patches.mass.size),
            "mass": handed_over.mass,
            "mass_error": handed_over.mass_error,
            "momentum_error": handed_over.momentum_error,
            "energy_error": handed_over.energy_error,
            "casing_energy": handed_over.casing_energy,
            "energy_lost": handed_over.casing_energy - handed_over.energy,
            "contiguous_fraction": float(patches.contiguous.mean()),
            "contiguous_mass_fraction": float(patches.mass[patches.contiguous].sum() / patches.mass.sum()),
            "sampler": self.settings.sampler,
            "velocity": self.settings.velocity,
            "rounds": rounds,
        }


def _whole(name: str, value: object) -> int:
    try:
        number = index(value)  # type: ignore[arg-type]
    except TypeError:
        number = -1
    if number < 0:
        raise InputError(f"break_up {name}: found {value!r}; a whole number from 0 upwards is needed")
    return number


def _segment_summary(result: SegmentResult, fragments: int) -> dict[str, Any]:
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
        "fragments": fragments,
        "mass": float(result.draw.mass.sum()),
        "mass_deficit": result.draw.deficit,
        "casing_mass": law.mass,
        "heaviest": float(result.draw.mass.max()),
        "v0": law.v0,
        "speed": data.speed,
        "rupture": law.rupture,
        "rupture_radius": law.radius,
        "rupture_wall": law.wall,
        "method": result.draw.method,
        "closure": result.draw.closure,
        "contiguous": result.contiguous,
    }


def break_up(
    snapshot: Snapshot | str | Path, settings: BreakUpSettings | None = None, seed: int = 0, realisation: int = 0
) -> BreakUpResult:
    """Break a burst casing up into fragments, once.

    Parameters
    ----------
    snapshot : Snapshot or path
        End of the burst stage, or its file burst_snapshot.h5.
    settings : BreakUpSettings or None
        Choices of the break-up; None: the defaults.
    seed : int
        Seed, 0 or above.
    realisation : int
        Which realisation of the ensemble of this seed.

    Raises
    ------
    InputError
        On a snapshot or settings that cannot be used; the message says why.
    """
    return BreakUp(snapshot, settings).realisation(seed, realisation)


def realisations(
    snapshot: Snapshot | str | Path, settings: BreakUpSettings | None = None, seed: int = 0, count: int = 1
) -> Iterator[BreakUpResult]:
    """Yield `count` realisations from one burst; number k is `break_up(..., realisation=k)`."""
    if count < 1:
        raise InputError(f"realisations: found {count}; at least 1 is needed")
    prepared = BreakUp(snapshot, settings)
    for number in range(count):
        yield prepared.realisation(seed, number)
