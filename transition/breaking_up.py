"""From the burst casing to fragments: law, sampling, placing, velocity, and the hand-over to the flight."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from itertools import product
from operator import index
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fragfield_base.cores import cores
from transition.casing import casing_of
from transition.draws import Draws
from transition.errors import InputError
from transition.law.mott import Graded, Quantile, Sampler
from transition.law.segments import CasingSegment, casing_segments, outside_of, segment_laws
from transition.motion import Attitude, Image, Isometry, draw_attitude, images, rotation, scattered
from transition.placing import CURVE_DRAWS, Sheet, place
from transition.points import POINTS_PER_FRAGMENT, lightest_that_matters
from transition.results import BreakUpResult, BrokenRound, SegmentResult, compare_directions, ledger, summarised
from transition.settings import MOST_FRAGMENTS, BreakUpSettings
from transition.snapshot import Snapshot

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from flight.fragments import Fragments
    from transition.intensity import Intensity
    from transition.points import PointSource
    from transition.results import Directions, Shares
    from transition.weighted import Casings, Runs, WeightedFragments

    Array = NDArray[np.float64]


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

    @cached_property
    def _sources(self) -> tuple[PointSource, ...]:
        return self._casing.sources(self.segments, [lightest_that_matters(law.law) for law in self.laws])

    @property
    def number(self) -> float:
        """Expected number of fragments by Mott's law."""
        return float(sum(law.n0 for law in self.laws)) * (len(self._images) + 1)

    @property
    def axisymmetric(self) -> bool:
        """Whether the casing is of rings."""
        return self.snapshot.is_axisymmetric

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
        results = tuple(result for result, _, _ in parts)
        motions = list(self._motions(attitude))
        fragments = self._fragments(parts, motions)
        found = sorted({result.round for result in results})
        sums = [self._casing.sums(self.rounds[one].computed).moved(motions[one][1]) for one in found]
        handed_over = ledger(fragments, sum(sums[1:], sums[0]))
        directions = {one: self._directions(one, fragments, attitude, motions[one][0]) for one in found}
        summary = summarised(self.rounds, results, directions, handed_over, self.settings, self._outside, self.fit)
        return BreakUpResult(fragments, results, directions, handed_over, summary)

    def fragments(self, seed: int, number: int = 0) -> Fragments:
        """The fragments of `realisation(seed, number)` alone, without ledgers and directions: for large ensembles."""
        return self._fragments(self._parts(seed, number), list(self._motions(self._attitude(seed, number))))

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

        if not self.axisymmetric:
            return None
        curves, points = (SAMPLE_CURVES, SAMPLE_POINTS) if sample else (CURVES, POINTS)
        lightest = POINTS_PER_FRAGMENT * sum(law.mass for law in self.laws) / points
        sources = self._casing.sources(self.segments, [lightest] * len(self.segments))
        numbers = [range(END_CURVES if directions and one.is_end else curves) for one in self.segments]
        runs = self._runs(numbers, sources, keep=sample)
        axis, base, settings = self._axis, self._base(self.rounds[0]), self.settings
        return Intensity(
            runs, axis, base, axis.tolist(), base.tolist(), settings.direction_scatter, float(settings.shape_factor)
        )

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
        names, axis = tuple(broken.name for broken in self.rounds), self._axis if self._turned else None
        return Casings(runs, self._images, axis, self._base(self.rounds[0]), self._foot, names, self.settings)

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

    @property
    def _axis(self) -> Array:
        """Unit axis of the first round (3,)."""
        axis = np.asarray(self.rounds[0].axis)
        return axis / np.linalg.norm(axis)

    def _base(self, broken: BrokenRound) -> Array:
        position = np.asarray(self.snapshot.rounds[broken.computed].position)
        return position if broken.image is None else broken.image.place(position)

    def _attitude(self, seed: int, number: int) -> Attitude:
        seed, number = _whole("seed", seed), _whole("realisation", number)
        return draw_attitude(seed, number, turned=self._turned, tilt=self.settings.tilt)

    def _motions(self, attitude: Attitude) -> Iterator[tuple[Isometry | None, Isometry | None]]:
        """How the fragments of each round are moved from where the casing has them: without the tilt, and with it."""
        tilting = attitude.tilting
        for broken in self.rounds:
            upright: Isometry | None = broken.image
            if attitude.turn is not None:
                upright = rotation(broken.axis, self.snapshot.rounds[broken.computed].position, attitude.turn)
            yield upright, upright if tilting is None else tilting.about(self._foot).after(upright)

    def _check_number(self) -> None:
        """Refuse a law that would make dust of the casings: it would fill the memory before it says so."""
        expected = self.number
        if not expected <= MOST_FRAGMENTS:
            means = ", ".join(f"{law.law.mean:.3g} kg" for law in self.laws[:3])
            raise InputError(
                f"{self.snapshot.source}: the casings would break into {expected:.3g} fragments (mean masses {means}); "
                f"at most {MOST_FRAGMENTS:.0e} are computed: check mean_mass, prefactor and fracture_energy"
            )

    def _parts(self, seed: int, number: int) -> Iterator[tuple[SegmentResult, Array, Array]]:
        """Segments, with positions and velocities of their fragments where the casing has them."""
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
            if self.settings.velocity == "mean":
                position, velocity = clusters.means(points)
            else:
                position, velocity = points.position[clusters.chosen], points.velocity[clusters.chosen]
            scatter = self.settings.direction_scatter
            if scatter > 0.0:
                velocity = scattered(mass, velocity, scatter * draws.normal("scatter", mass.size, 2))
            own = copy * len(self.snapshot.rounds) + segment.round
            yield SegmentResult(own, segment, law, mass, points, clusters), position, velocity

    def _sampler(self, segment: CasingSegment) -> Sampler:
        if self.settings.sampler == "graded" and not segment.is_end:
            return Graded(self.settings.graded_m0, self.settings.graded_dm)
        return Quantile()

    def _fragments(
        self,
        parts: Iterable[tuple[SegmentResult, Array, Array]],
        motions: Sequence[tuple[Isometry | None, Isometry | None]],
    ) -> Fragments:
        """Fragments of all segments, moved."""
        from flight.fragments import Fragments

        # The points of the segments are needed no more.
        rows = [(one.round, one.segment.index, one.mass, *states) for one, *states in parts]
        rounds, segments, *arrays = zip(*rows, strict=True)
        mass, position, velocity = (np.concatenate(one) for one in arrays)
        counts = [one.size for one in arrays[0]]
        of_round, of_segment = (np.repeat(one, counts).astype(np.int32) for one in (rounds, segments))
        for number, (_, motion) in enumerate(motions):
            if motion is not None:
                mine = of_round == number
                position[mine], velocity[mine] = motion.place(position[mine]), motion.vector(velocity[mine])
        shape = np.full(mass.size, float(self.settings.shape_factor))
        names = tuple(broken.name for broken in self.rounds)
        return Fragments(mass, position, velocity, shape, of_round, of_segment, names)

    def _directions(
        self, number: int, fragments: Fragments, attitude: Attitude, upright: Isometry | None
    ) -> Directions:
        """Directions about the round's own axis, the tilt taken back."""
        broken, shares = self.rounds[number], self._cell_shares.get(number)
        if shares is None:
            shares = self._casing.shares(broken.computed, broken.axis, upright)
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
