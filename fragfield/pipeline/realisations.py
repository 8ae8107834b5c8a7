"""The realisations of the break-up, made as the flight asks for them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.pipeline.arena import arena_realisation, read_arena

if TYPE_CHECKING:
    from collections.abc import Sequence

    from flight import Fragments
    from fragfield.pipeline.integral import Solved
    from fragfield.pipeline.job import Job
    from transition import BreakUp


class Realisations:
    """The realisations of a run, by number.

    Parameters
    ----------
    job : Job
        The case and its run directory.
    given : sequence of Fragments
        The first realisations.
    prepared : BreakUp, optional
        What makes more of them; left out: the snapshot in the run directory, where there is one.

    Attributes
    ----------
    count : int
        Number of those given.
    arena : ArenaTable or None
        Table of an arena test, where that is flown.
    """

    def __init__(self, job: Job, given: Sequence[Fragments], prepared: BreakUp | None = None) -> None:
        self.job = job
        self._given = given
        self.count = len(self._given)
        self._prepared = prepared
        snapshot = job.source.file("burst_snapshot.h5")
        self._snapshot = snapshot if job.options.fragments is None and snapshot.is_file() else None
        found = read_arena(job.options.fragments, job.case)
        self.arena = None if found is None else found[0]

    @property
    def more(self) -> bool:
        """Whether any number can be made."""
        return self._prepared is not None or self._snapshot is not None or self.arena is not None

    def __getitem__(self, number: int) -> Fragments:
        """The fragments of one; any thread may ask for its own once `prepare` has been called."""
        if number < self.count:
            return self._given[number]
        if self.arena is not None:
            return arena_realisation(self.arena, self.job.case, number)
        assert self._prepared is not None  # `prepare` comes first
        return self._prepared.fragments(self.job.case.seed, number)

    def solve(self) -> tuple[Solved | None, str, str]:
        """The expected density without realisations; by what method it is had, and why not by another one.

        Methods are "integral", "weighted_fragments" and "realisations".
        """
        from fragfield.case.problem import hazard_directions
        from fragfield.pipeline.integral import Integrand, why_not_integrated
        from fragfield.pipeline.weighted import WeightedFlights, why_not_weighted

        job = self.job
        rings = self._prepared is not None and self._prepared.axisymmetric
        reason = why_not_integrated(job.case, given=job.options.fragments is not None, rings=rings)
        method = "integral" if not reason else "weighted_fragments"
        if not reason and self._prepared is None and self._snapshot is None:
            reason = "the burst's snapshot is not at hand"
        if self._prepared is None and self._snapshot is None:
            method = "realisations"
        elif reason and (other := why_not_weighted(job.case)):
            method, reason = "realisations", other
        if method == "realisations":
            return None, method, reason
        self.prepare()
        assert self._prepared is not None
        if method == "weighted_fragments":
            return WeightedFlights(job.case, self._prepared, job.cores).solve(job.attitude), method, reason
        directions = hazard_directions(job.case)[0] != "all_azimuths"
        intensity = self._prepared.intensity(sample=job.sample, directions=directions and not job.sample)
        solved = (
            None if intensity is None else Integrand(job.case, intensity, job.cores, job.sample).solve(job.attitude)
        )
        return solved, method, ""

    def prepare(self) -> None:
        """Read the snapshot, once."""
        if self._prepared is not None or self._snapshot is None:
            return
        import transition
        from fragfield.case.problem import break_up_settings

        snapshot = transition.Snapshot.read(self._snapshot)
        self._prepared = transition.BreakUp(snapshot, break_up_settings(self.job.case))
