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
        The case, its run directory and the ranks.
    given : sequence of Fragments
        The first realisations, on rank 0; on the others nothing. Collective.
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
        # A list is sent to the other ranks, of an ensemble in a file its place: each rank reads what it flies.
        self._given = job.team.broadcast(given if job.team.first else None)
        self.count = len(self._given)
        self._prepared = prepared
        snapshot = job.source.file("burst_snapshot.h5")
        self._snapshot = job.team.broadcast(snapshot if job.options.fragments is None and snapshot.is_file() else None)
        found = read_arena(job.options.fragments, job.case) if job.team.first else None
        self.arena = job.team.broadcast(None if found is None else found[0])

    @property
    def more(self) -> bool:
        """Whether any number can be made."""
        return self._prepared is not None or self._snapshot is not None or self.arena is not None

    def __getitem__(self, number: int) -> Fragments:
        """The fragments of one; any rank and thread may ask for its own once `prepare` has been called on all ranks."""
        if number < self.count:
            return self._given[number]
        if self.arena is not None:
            return arena_realisation(self.arena, self.job.case, number)
        assert self._prepared is not None  # `prepare` comes first
        return self._prepared.fragments(self.job.case.seed, number)

    def solve(self) -> tuple[Solved | None, str, str]:
        """The expected density without realisations, on rank 0; by what method it is had, and why not by another one.

        Methods are "integral", "weighted_fragments" and "realisations". Collective.
        """
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
            return WeightedFlights(job.case, self._prepared, job.team, job.cores).solve(), method, reason
        intensity = self._prepared.intensity() if job.team.first else None
        solved = (
            None if intensity is None else Integrand(job.case, intensity, job.cores, job.sample).solve(job.attitude)
        )
        return solved, method, ""

    def prepare(self) -> None:
        """Read the snapshot on every rank, once. Collective."""
        if self._prepared is not None or self._snapshot is None:
            return
        import transition
        from fragfield.case.conversion.stages import break_up_settings

        team = self.job.team
        snapshot = team.broadcast(transition.Snapshot.read(self._snapshot) if team.first else None)
        assert snapshot is not None
        self._prepared = transition.BreakUp(snapshot, break_up_settings(self.job.case))
