"""From the burst casing to fragments: law, sampling, placing, velocity and what is handed over."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from operator import index
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from transition.adjacency import face_neighbours
from transition.directions import Directions, Shares, cell_shares, compare_directions
from transition.errors import InputError
from transition.laws import SegmentLaw, outside_of, segment_law
from transition.ledger import CasingSums, Ledger, casing_sums, ledger
from transition.mirroring import Image, images
from transition.placing import Patches, cell_middles, cell_sides, join, patch_means, place, point_positions
from transition.samplers import Draw, Graded, Quantile, Sampler
from transition.segments import CasingSegment, casing_segments
from transition.settings import BreakUpSettings
from transition.snapshot import Snapshot
from transition.summary import summarised

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from flight.fragments import Fragments
    from transition.dolfinx_field import VelocityField

__all__ = ["BreakUp", "BreakUpResult", "BrokenRound", "SegmentResult", "break_up", "realisations"]


@dataclass(frozen=True, eq=False)
class BrokenRound:
    """A round whose casing breaks up: one of those computed, or an image of one behind planes of symmetry.

    Attributes
    ----------
    name : str
        Its own, or that of the image.
    computed : int
        Number of the computed round.
    image : Image or None
        Where it is mirrored; None for a computed round.
    mirror_of : str or None
        Name of the computed round that it is an image of; None for a computed round.
    axis : tuple of float
        Direction from the base to the nose.
    """

    name: str
    computed: int
    image: Image | None
    mirror_of: str | None
    axis: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class SegmentResult:
    """A segment, its law, and the fragments drawn from it."""

    round: int  # of `BreakUp.rounds`: another than the segment's own where that is mirrored
    segment: CasingSegment
    law: SegmentLaw
    draw: Draw
    fragments: int  # placed
    contiguous: int  # fragments whose patch hangs together


@dataclass(frozen=True, eq=False)
class BreakUpResult:
    """One realisation of the break-up.

    Attributes
    ----------
    fragments : flight.fragments.Fragments
        By round, segment and order of placing; computed rounds first, then their images.
    segments : tuple of SegmentResult
        Law and draw of every segment, of computed rounds and images.
    patches : Patches
        Which casing cells (places in `Snapshot.casing`) each fragment covers; images cover them once more.
    directions : tuple of (int, Directions)
        Directions by mass of each round that has fragments.
    ledger : Ledger
        Mass, momentum and energy handed over.
    ledgers : tuple of (int, Ledger)
        The same of each round that has fragments.
    summary : dict
        The "break_up" part of summary.json; SI units.
    """

    fragments: Fragments
    segments: tuple[SegmentResult, ...]
    patches: Patches
    directions: tuple[tuple[int, Directions], ...]
    ledger: Ledger
    ledgers: tuple[tuple[int, Ledger], ...]
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

    Attributes
    ----------
    rounds : tuple of BrokenRound
        The computed rounds, then the images of all of them at one plane after the other.

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
        self._outside = outside_of(self.snapshot.rounds, self.settings)
        self._sides = cell_sides(self._corners)
        self._neighbours = self._local_neighbours()
        self._images = images(self.snapshot.planes, self.snapshot.source)
        self.rounds = tuple(_rounds(self.snapshot, self._images))
        self._cell_shares: dict[int, Shares] = {}
        self._sums: dict[int, CasingSums] = {}
        self._middles: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None  # of velocity and place
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
        depend on which others are computed, in which order, or on which rank; so has every image.

        Parameters
        ----------
        seed : int
            Seed of the ensemble, 0 or above.
        number : int
            Which realisation of the ensemble.
        """
        results, patches = self._drawn(seed, number)
        return self._result(results, patches, self._handed_over(results, patches))

    def fragments(self, seed: int, number: int = 0) -> Fragments:
        """The fragments of `realisation(seed, number)` alone, without ledgers and directions: for large ensembles."""
        return self._handed_over(*self._drawn(seed, number))

    def many(self, seed: int, numbers: Sequence[int], threads: int | None = None) -> list[Fragments]:
        """`fragments` of many realisations, on threads (default: all cores); the result does not depend on them."""
        # dolfinx evaluates for one thread at a time
        workers = 1 if self.settings.velocity == "interpolation" else threads or os.cpu_count() or 1
        with ThreadPoolExecutor(workers) as pool:
            return list(pool.map(lambda number: self.fragments(seed, number), numbers))

    def _drawn(self, seed: int, number: int) -> tuple[tuple[SegmentResult, ...], Patches]:
        entropy, number = _whole("seed", seed), _whole("realisation", number)
        results, parts = [], []
        # Children of a segment's stream end in 0 and 1; images count from 2 and so keep clear of them.
        for copy in range(len(self._images) + 1):
            for segment, law, neighbours in zip(self.segments, self.laws, self._neighbours, strict=True):
                key = (number, segment.round, segment.index, *((copy + 1,) if copy else ()))
                stream = np.random.SeedSequence(entropy, spawn_key=key)
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
                own = copy * len(self.snapshot.rounds) + segment.round
                contiguous = int(patches.contiguous.sum())
                results.append(SegmentResult(own, segment, law, draw, patches.mass.size, contiguous))
        return tuple(results), join(parts)

    def _sampler(self, segment: CasingSegment) -> Sampler:
        if self.settings.sampler == "graded" and not segment.is_end:
            return Graded(self.settings.graded_m0, self.settings.graded_dm)
        return Quantile()

    def _handed_over(self, results: tuple[SegmentResult, ...], patches: Patches) -> Fragments:
        from flight.fragments import Fragments

        if self.settings.velocity == "interpolation":
            if self._field is None:
                from transition.dolfinx_field import VelocityField

                self._field = VelocityField(self.snapshot)
            velocity = self._field.at(patches.seed, patches.point)
            position = point_positions(patches, self._corners)
        else:
            if self._middles is None:
                self._middles = cell_middles(self._node_velocity), cell_middles(self._corners)
            velocity = patch_means(patches, self._node_velocity, self._middles[0])
            position = patch_means(patches, self._corners, self._middles[1])
        counts = [result.fragments for result in results]
        of_round = np.repeat([r.round for r in results], counts).astype(np.int32)
        of_segment = np.repeat([r.segment.index for r in results], counts).astype(np.int32)
        computed = len(self.snapshot.rounds)
        for copy, image in enumerate(self._images, start=1):
            mine = of_round // computed == copy
            position[mine], velocity[mine] = image.place(position[mine]), image.vector(velocity[mine])
        shape = np.full(patches.mass.size, float(self.settings.shape_factor))
        names = tuple(broken.name for broken in self.rounds)
        return Fragments(patches.mass, position, velocity, shape, of_round, of_segment, names)

    def _result(self, results: tuple[SegmentResult, ...], patches: Patches, fragments: Fragments) -> BreakUpResult:
        whole = self._casing_sums(None)
        for image in self._images:
            whole += self._casing_sums(None).mirrored(image)
        handed_over = ledger(fragments.mass, fragments.velocity, whole)
        numbers = sorted({result.round for result in results})
        ledgers = {number: self._ledger(number, fragments) for number in numbers}
        directions = {number: self._directions(number, fragments) for number in numbers}
        summary = summarised(
            self.rounds, results, ledgers, directions, handed_over, patches, self.settings, self._outside
        )
        return BreakUpResult(
            fragments, results, patches, tuple(directions.items()), handed_over, tuple(ledgers.items()), summary
        )

    def _casing_sums(self, computed: int | None) -> CasingSums:
        """Sums over the casing of a computed round, or of all of them."""
        key = -1 if computed is None else computed
        if key not in self._sums:
            own = slice(None) if computed is None else self.snapshot.round[self.snapshot.casing] == computed
            self._sums[key] = casing_sums(self._mass[own], self._node_velocity[own])
        return self._sums[key]

    def _ledger(self, number: int, fragments: Fragments) -> Ledger:
        broken = self.rounds[number]
        sums = self._casing_sums(broken.computed)
        mine = fragments.round == number
        return ledger(
            fragments.mass[mine], fragments.velocity[mine], sums.mirrored(broken.image) if broken.image else sums
        )

    def _directions(self, number: int, fragments: Fragments) -> Directions:
        broken = self.rounds[number]
        if number not in self._cell_shares:
            own = self.snapshot.round[self.snapshot.casing] == broken.computed
            velocity = self._node_velocity[own]
            if broken.image:
                velocity = broken.image.vector(velocity)
            self._cell_shares[number] = cell_shares(self._mass[own], velocity, broken.axis)
        mine = fragments.round == number
        shares = self._cell_shares[number]
        return compare_directions(fragments.mass[mine], fragments.velocity[mine], shares, broken.axis)


def _rounds(snapshot: Snapshot, mirrored: tuple[Image, ...]) -> Iterator[BrokenRound]:
    for number, data in enumerate(snapshot.rounds):
        yield BrokenRound(data.name, number, None, None, data.axis)
    for image in mirrored:
        for number, data in enumerate(snapshot.rounds):
            x, y, z = (float(value) for value in image.vector(np.asarray(data.axis)))
            yield BrokenRound(image.name_of(data.name), number, image, data.name, (x, y, z))


def _whole(name: str, value: object) -> int:
    try:
        number = index(value)  # type: ignore[arg-type]
    except TypeError:
        number = -1
    if number < 0:
        raise InputError(f"break_up {name}: found {value!r}; a whole number from 0 upwards is needed")
    return number


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
