"""From the burst casing to fragments: law, sampling, placing, velocity, and the hand-over to the flight."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from operator import index
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fragfield_base.cores import cores
from transition.casing import RingCasing, casing_of
from transition.cells.points import POINTS_PER_FRAGMENT, MaterialPoints, lightest_that_matters
from transition.draws import Draws
from transition.errors import InputError
from transition.law.samplers import Graded, Quantile, Sampler
from transition.law.segment_law import outside_of, segment_laws
from transition.law.segments import CasingSegment, casing_segments
from transition.placement.directions import compare_directions
from transition.placement.isometry import Attitude, Isometry, draw_attitude, rotation
from transition.placement.mirroring import Image, images
from transition.placement.placing import CURVE_DRAWS, Clusters, Sheet, place
from transition.placement.scatter import scattered
from transition.results import BreakUpResult, BrokenRound, SegmentResult, ledger, summarised
from transition.settings import MOST_FRAGMENTS, BreakUpSettings
from transition.snapshot import Snapshot

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from flight.fragments import Fragments
    from transition.cells.points import PointSource
    from transition.intensity import Intensity
    from transition.placement.directions import Directions, Shares
    from transition.results import CasingSums
    from transition.weighted import Casings, Runs, WeightedFragments


@dataclass(frozen=True, eq=False)
class _Part:
    result: SegmentResult
    points: MaterialPoints
    clusters: Clusters
    angles: NDArray[np.float64] | None  # (n, 2), deviation of each fragment's direction (rad); None: without scatter


_WEIGHTED = 0x5EED  # seed of the curves of weighted fragments


class BreakUp:
    """A burst casing made ready to be broken up any number of times.

    Reading, cutting and laws are the same for all realisations and are done once.

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
    laws : tuple of SegmentLaw
        By segment.
    fit : CountFit or None
        How the mean masses were fitted to the pieces of a test.

    Raises
    ------
    InputError
        The snapshot or the settings cannot be used; the message says why.
    """

    def __init__(self, snapshot: Snapshot | str | Path, settings: BreakUpSettings | None = None) -> None:
        self.snapshot = snapshot if isinstance(snapshot, Snapshot) else Snapshot.read(snapshot)
        self.settings = settings if settings is not None else BreakUpSettings()
        self.segments = casing_segments(self.snapshot, self.settings.segments)
        self._casing = casing_of(self.snapshot)
        mass = self.snapshot.mass[self.snapshot.casing]
        masses = [float(mass[s.cells].sum()) for s in self.segments]
        self.laws, self.fit = segment_laws(self.segments, masses, self.snapshot.rounds, self.settings)
        self._outside = outside_of(self.snapshot.rounds, self.settings)
        self._sheets = [
            Sheet.of(self._casing.before(segment), 1.0 if segment.is_end else law.radius / segment.data.outer_radius)
            for law, segment in zip(self.laws, self.segments, strict=True)
        ]
        self._images = images(self.snapshot.planes, self.snapshot.source)
        self.rounds = tuple(_rounds(self.snapshot, self._images))
        self._turned = self.settings.random_roll and len(self.rounds) == 1
        self._foot = np.mean([self._base(broken) for broken in self.rounds], axis=0)
        self._cell_shares: dict[int, Shares] = {}
        self._sums: dict[int, CasingSums] = {}

    @cached_property
    def _sources(self) -> tuple[PointSource, ...]:
        return self._casing.sources(self.segments, [lightest_that_matters(law.law) for law in self.laws])

    def realisation(self, seed: int, number: int = 0) -> BreakUpResult:
        """Break the casing up once.

        Every quantity drawn for a segment or its image in a realisation has a random stream of its own
        (`transition.draws`), so that no result depends on which others are computed, in which order, or on which rank.
        So have turns and tilts.

        Parameters
        ----------
        seed : int
            Seed of the ensemble, 0 or above.
        number : int
            Which realisation of the ensemble.
        """
        parts, attitude = list(self._parts(seed, number)), self._attitude(seed, number)
        results = tuple(part.result for part in parts)
        fragments = self._fragments(results, [self._placed(part) for part in parts], attitude)
        found = sorted({result.round for result in results})
        sums = [self._casing_sums(one, attitude) for one in found]
        handed_over = ledger(fragments, sum(sums[1:], sums[0]))
        directions = {one: self._directions(one, fragments, attitude) for one in found}
        return BreakUpResult(
            fragments, results, MaterialPoints.concatenate([part.points for part in parts]),
            Clusters.concatenate([(part.clusters, len(part.points)) for part in parts]), directions, handed_over,
            summarised(self.rounds, results, directions, handed_over, self.settings, self._outside, self.fit),
        )  # fmt: skip

    def fragments(self, seed: int, number: int = 0) -> Fragments:
        """The fragments of `realisation(seed, number)` alone, without ledgers and directions: for large ensembles."""
        results, placed = [], []
        for part in self._parts(seed, number):
            results.append(part.result)
            placed.append(self._placed(part))
        return self._fragments(results, placed, self._attitude(seed, number))

    def many(self, seed: int, numbers: Sequence[int], threads: int | None = None) -> list[Fragments]:
        """`fragments` of many realisations, on threads (default: all cores); the result does not depend on them."""
        with ThreadPoolExecutor(threads or cores()) as pool:
            return list(pool.map(lambda number: self.fragments(seed, number), numbers))

    def intensity(self, *, sample: bool = False, directions: bool = False) -> Intensity | None:
        """Expected fragments by mass, place and velocity, of which realisations are samples; None of hexahedra.

        `sample`: for a sample of a study; `directions`: as numbers in single directions need it, not over all azimuths.
        What the sampler's closing on the mass makes of a segment of a few pieces is not in it, nor is the tilt.
        """
        from transition.intensity import CURVES, END_CURVES, POINTS, SAMPLE_CURVES, SAMPLE_POINTS, Intensity

        if not isinstance(self._casing, RingCasing):
            return None
        curves, points = (SAMPLE_CURVES, SAMPLE_POINTS) if sample else (CURVES, POINTS)
        lightest = POINTS_PER_FRAGMENT * sum(law.mass for law in self.laws) / points
        sources = self._casing.sources(self.segments, [lightest] * len(self.segments))
        numbers = [range(END_CURVES if directions and one.is_end else curves) for one in self.segments]
        runs = self._runs(numbers, sources, keep=sample)
        base, axis = self._base(self.rounds[0]), self._axis()
        x, y, z = (float(value) for value in axis)
        place = (float(base[0]), float(base[1]), float(base[2]))
        settings = self.settings
        return Intensity(runs, axis, base, (x, y, z), place, settings.direction_scatter, float(settings.shape_factor))

    def weighted(self, number: int, points: int) -> WeightedFragments:
        """So many fragments (a power of two) that stand for all by the expected intensity: no seed is in them.

        `number`, from 0 upwards, is that of one of many sets which are independent of each other; see
        `transition.weighted`. What the sampler's closing on the mass makes of a segment of a few pieces is not in them.
        """
        from transition.weighted import unit_points

        return self.casings(number).at(unit_points(number, points))

    def casings(self, number: int) -> Casings:
        """What makes the fragments of such a set, in any attitude and of any number."""
        from transition.weighted import Casings

        self._check_number()
        runs = self._runs([[number]] * len(self.segments), self._sources)
        names, first = tuple(broken.name for broken in self.rounds), self.rounds[0]
        axis = self._axis() if self._turned else None
        return Casings(runs, self._images, axis, self._base(first), self._foot, names, self.settings)

    def _runs(
        self, curves: Sequence[Iterable[int]], sources: Sequence[PointSource], *, keep: bool = False
    ) -> tuple[Runs, ...]:
        """Runs of each segment along the curves of its numbers over points of its source; no seed is in them."""
        from transition.weighted import Runs

        runs = []
        for segment, law, source, sheet, numbers in zip(
            self.segments, self.laws, sources, self._sheets, curves, strict=True
        ):
            made = []
            for number in numbers:
                draws = Draws(_WEIGHTED, number, (segment.round, segment.index))
                points = source.draw(draws.generator("points"))
                order = sheet.kept_order if keep else sheet.order
                made.append((points, order(points.reference, draws.uniform("curve", CURVE_DRAWS))))
            runs.append(Runs.along(segment, law, self._sampler(segment), made, self.settings))
        return tuple(runs)

    def _axis(self) -> NDArray[np.float64]:
        """Unit axis of the first round (3,)."""
        axis = np.asarray(self.rounds[0].axis)
        return axis / np.linalg.norm(axis)

    def _base(self, broken: BrokenRound) -> NDArray[np.float64]:
        position = np.asarray(self.snapshot.rounds[broken.computed].position)
        return position if broken.image is None else broken.image.place(position)

    def _attitude(self, seed: int, number: int) -> Attitude:
        seed, number = _whole("seed", seed), _whole("realisation", number)
        return draw_attitude(seed, number, turned=self._turned, tilt=self.settings.tilt)

    def _motion(self, number: int, attitude: Attitude) -> Isometry | None:
        """How the fragments of round `number` of `rounds` are moved from where the casing has them."""
        motion, tilting = self._upright_motion(number, attitude), attitude.tilting
        return motion if tilting is None else tilting.about(self._foot).after(motion)

    def _upright_motion(self, number: int, attitude: Attitude) -> Isometry | None:
        """The same without the tilt."""
        broken = self.rounds[number]
        if attitude.turn is None:
            return broken.image
        return rotation(broken.axis, self.snapshot.rounds[broken.computed].position, attitude.turn)

    @property
    def number(self) -> float:
        """Expected number of fragments by Mott's law."""
        return float(sum(law.n0 for law in self.laws)) * (len(self._images) + 1)

    @property
    def axisymmetric(self) -> bool:
        """Whether the casing is of rings."""
        return isinstance(self._casing, RingCasing)

    def _check_number(self) -> None:
        """Refuse a law that would make dust of the casings: it would fill the memory before it says so."""
        expected = self.number
        if not expected <= MOST_FRAGMENTS:
            means = ", ".join(f"{law.law.mean:.3g} kg" for law in self.laws[:3])
            raise InputError(
                f"{self.snapshot.source}: the casings would break into {expected:.3g} fragments (mean masses {means}); "
                f"at most {MOST_FRAGMENTS:.0e} are computed: check mean_mass, prefactor and fracture_energy"
            )

    def _parts(self, seed: int, number: int) -> Iterator[_Part]:
        self._check_number()
        seed, number = _whole("seed", seed), _whole("realisation", number)
        prepared = list(zip(self.segments, self.laws, self._sources, self._sheets, strict=True))
        for copy, (segment, law, source, sheet) in product(range(len(self._images) + 1), prepared):
            draws = Draws(seed, number, (segment.round, segment.index, copy))
            try:
                mass = self._sampler(segment).draw(law.law, law.mass, draws)
            except InputError as error:
                name = self.snapshot.rounds[segment.round].name
                raise InputError(f"round {name!r}, segment {segment.data.name!r}: {error}") from None
            points = source.draw(draws.generator("points"))
            along = sheet.order(points.reference, draws.uniform("curve", CURVE_DRAWS))
            clusters = place(mass, along, points.mass, draws)
            scatter = self.settings.direction_scatter
            angles = scatter * draws.normal("scatter", clusters.mass.size, 2) if scatter > 0.0 else None
            own = copy * len(self.snapshot.rounds) + segment.round
            yield _Part(SegmentResult(own, segment, law, mass), points, clusters, angles)

    def _sampler(self, segment: CasingSegment) -> Sampler:
        if self.settings.sampler == "graded" and not segment.is_end:
            return Graded(self.settings.graded_m0, self.settings.graded_dm)
        return Quantile()

    def _placed(self, part: _Part) -> tuple[NDArray[np.float64], ...]:
        """Masses (n,), positions and velocities (n, 3) of a segment's fragments, where the casing has them."""
        points, clusters = part.points, part.clusters
        if self.settings.velocity == "mean":
            position, velocity = clusters.means(points)
        else:
            position, velocity = points.position[clusters.chosen], points.velocity[clusters.chosen]
        if part.angles is not None:
            velocity = scattered(clusters.mass, velocity, part.angles)
        return clusters.mass, position, velocity

    def _fragments(
        self, results: Sequence[SegmentResult], placed: Sequence[tuple[NDArray[np.float64], ...]], attitude: Attitude
    ) -> Fragments:
        from flight.fragments import Fragments

        mass, position, velocity = (np.concatenate(arrays) for arrays in zip(*placed, strict=True))
        counts = [result.mass.size for result in results]
        of_round = np.repeat([r.round for r in results], counts).astype(np.int32)
        of_segment = np.repeat([r.segment.index for r in results], counts).astype(np.int32)
        for number in range(len(self.rounds)):
            motion = self._motion(number, attitude)
            if motion is not None:
                mine = of_round == number
                position[mine], velocity[mine] = motion.place(position[mine]), motion.vector(velocity[mine])
        shape = np.full(mass.size, float(self.settings.shape_factor))
        names = tuple(broken.name for broken in self.rounds)
        return Fragments(mass, position, velocity, shape, of_round, of_segment, names)

    def _casing_sums(self, number: int, attitude: Attitude) -> CasingSums:
        """Of the casing of round `number` of `rounds`, as it is moved."""
        computed, motion = self.rounds[number].computed, self._motion(number, attitude)
        if computed not in self._sums:
            self._sums[computed] = self._casing.sums(computed)
        return self._sums[computed] if motion is None else self._sums[computed].moved(motion)

    def _directions(self, number: int, fragments: Fragments, attitude: Attitude) -> Directions:
        """Directions about the round's own axis, the tilt taken back."""
        broken, motion = self.rounds[number], self._upright_motion(number, attitude)
        shares = self._cell_shares.get(number)
        if shares is None:
            shares = self._casing.shares(broken.computed, broken.axis, motion)
            if attitude.turn is None:
                self._cell_shares[number] = shares
        mine, tilting = fragments.select(fragments.round == number), attitude.tilting
        velocity = mine.velocity if tilting is None else mine.velocity @ tilting.matrix
        return compare_directions(mine.mass, velocity, shares, broken.axis)


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
