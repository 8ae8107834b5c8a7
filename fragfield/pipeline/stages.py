"""The stages, each from its input files to its output files and its part of summary.json."""

from __future__ import annotations

import ctypes
import logging
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

import flight
from flight import Fragments, hazard
from flight.files.ensemble import read_fragment_ensemble, write_ensemble, write_fragment_ensemble
from fragfield.case.checks.expected_masses import recovered_warning
from fragfield.case.conversion.rounds import burst_rounds
from fragfield.case.conversion.surroundings import bearing_of
from fragfield.case.problem import burst_geometry, burst_settings, hazard_criteria
from fragfield.checking.case_warnings import expected_end
from fragfield.files.provenance import provenance_of
from fragfield.files.run_directory import Stage
from fragfield.hazard.recommended import hazard_of, recommended_of
from fragfield.hazard.rules import rules_of
from fragfield.hazard.site_map import write_contours
from fragfield.hazard.to_apply import distance_to_apply, official_part
from fragfield.pipeline.arena import arena_realisation, read_arena, table_width, write_arena
from fragfield.pipeline.attitudes import flown_attitude, fly_all
from fragfield.pipeline.convergence import convergence_of
from fragfield.pipeline.ensemble import break_up_all
from fragfield.pipeline.job import Job
from fragfield.pipeline.single_round import single_round
from fragfield.results.break_up import BreakUp
from fragfield.results.burst import Burst
from fragfield.results.flight import Flight
from fragfield.results.site import Obstacle, Witness
from fragfield.results.summary import Summary, Warned
from fragfield.results.words import certainty
from fragfield.terminal.logs import LOGGERS, concerns_the_user, words_of

_log = logging.getLogger(__name__)
_ARENA_MAX = -8  # glibc's M_ARENA_MAX


def perform(job: Job, stage: Stage) -> None:
    """Run one stage, with its time in the log; its parts and what the packages warned of go into the summary."""
    _log.info("%s: begins", stage.name)
    job.reporter.stage(stage.name)
    started = time.perf_counter()
    with suppress(AttributeError):  # of glibc: else threads have a heap each, and keep what they free
        ctypes.CDLL(None).mallopt(_ARENA_MAX, 1)
    with heard(stage.name) as records:
        made = _STAGE_FUNCTIONS[stage.name](job, stage)
    with suppress(AttributeError):  # of glibc: what is free goes back, before the next stage takes its own
        ctypes.CDLL(None).malloc_trim(0)
    if job.team.first:
        job.note(stage, made, records.found)
    _log.info("%s: done in %.1f s", stage.name, time.perf_counter() - started)


def burst(job: Job, _: Stage) -> Summary:
    """Detonation and acceleration of the casings: burst.xdmf, burst_snapshot.h5. Collective over the team's ranks."""
    from burst_fenicsx import simulate

    settings, choice, rounds = burst_settings(job.case), burst_geometry(job.case), burst_rounds(job.case)
    job.reporter.expected_end = expected_end(settings, rounds)
    alone = settings.geometry != "3d"  # a second's work: of one rank, while the others wait
    part: Burst | None = None
    if job.team.first:
        _log.info("burst.geometry: %s", choice.words)
    if job.team.first or not alone:
        result = simulate(
            rounds,
            settings,
            job.target.path,
            comm=job.team.alone if alone else job.team.comm,
            provenance=provenance_of(job.case),
            on_progress=job.reporter.burst,
            resume=job.options.resume,
            series=not job.options.lean,
        )
        part = Burst.of_stage({**result.summary, "geometry_reason": choice.reason})
    if alone:
        job.team.broadcast()
    return Summary(burst=part)


def break_up(job: Job, stage: Stage) -> Summary:
    """Casings become fragments: fragments.h5, its CSV copy, and those of further realisations."""
    result, further = break_up_all(job, job.needed(stage))
    provenance = provenance_of(job.case)
    if further:
        write_fragment_ensemble(further, job.target.file("ensemble_fragments.h5"), provenance)
    for name in ("fragments.csv", "fragments.h5"):
        result.fragments.write(job.target.file(name), provenance)
    write_arena(job.case, [result.fragments, *further], job.target.file("arena.csv"))
    return Summary(break_up=BreakUp.of_stage({**result.summary, "realisations": 1 + len(further)}))


def fly(job: Job, stage: Stage) -> Summary:
    """Fragments fly to the ground through the witness surfaces: landing.h5, hits.h5, ensemble.h5, CSV."""
    began = time.perf_counter()
    realisations = _realisations(job, stage)
    flown = fly_all(job, realisations)
    seconds = time.perf_counter() - began
    assert flown.first is not None  # a run flies realisations
    provenance = provenance_of(job.case)
    files = ThreadPoolExecutor(1, "files")  # the disk takes its time
    writing = [
        files.submit(flown.first.write, job.target.path, provenance),
        files.submit(write_ensemble, flown.hazard, flown.witnesses, job.target.path, provenance),
    ]
    files.shutdown(wait=False)
    criteria, width = hazard_criteria(job.case), 360.0 / job.case.hazard.sectors
    surfaces: list[Witness] = []
    for surface, table in zip(flown.first.witnesses, job.case.witness, strict=True):
        hits = flown.first.hits_on(surface.name)
        by_azimuth = hazard.by_azimuth(hits, criteria, sector_width=width)
        kind = {"name": surface.name, "kind": table.kind}
        surfaces.append(Witness.of_stage({**kind, "hits": len(hits), "by_azimuth": by_azimuth}))
    summary = {**flown.first.summary, **flown.hazard.summary(), "wall_seconds": seconds}
    found = read_arena(job.options.fragments, job.case)
    if job.options.fragments is not None:
        summary["fragments_file"] = job.options.fragments.name
    if found:
        summary["recovered"] = found[1]
    headline = {
        **flown.hazard.headline,
        "not_integrated_because": flown.not_integrated_because,
        "more_realisations": flown.more,
        "ricochet": job.case.flight.ground.ricochet,
        "attitude": flown_attitude(job, flown),
    }
    if found and headline["determined"] and not job.options.lean:
        headline["table_width"] = table_width(job, found[0], flown.flights)
    headline["bearing_deg"] = bearing_of(job.case, headline.get("direction_deg"))
    found_hazard = hazard_of(headline)
    if words := certainty(found_hazard):
        _log.warning("%s", words, extra={"code": "certainty"})
    obstacles = tuple(Obstacle.of_stage(entry) for entry in flown.first.by_face(criteria.energy))
    rules = rules_of(job.case, single_round(job, realisations))
    official = official_part(job.case)
    convergence = convergence_of(job, flown, found_hazard)
    found_hazard = recommended_of(found_hazard, convergence)
    write_contours(job.case, flown.hazard, job.target, provenance, flown.exposed, found_hazard.recommended)
    for one in writing:
        one.result()
    return Summary(
        flight=Flight.of_stage(summary),
        witness=tuple(surfaces),
        obstacle=obstacles,
        hazard=found_hazard,
        exposed=tuple(flown.exposed),
        rules=rules,
        official=official,
        distance_to_apply=distance_to_apply(found_hazard, official, rules.rules),
        convergence=convergence,
    )


def _realisations(job: Job, stage: Stage) -> Sequence[Fragments]:
    """The fragments of all realisations; of fragments from another source there is one set."""
    found = read_arena(job.options.fragments, job.case)
    if found is not None:
        arena, recovered = found
        if words := recovered_warning(recovered):
            _log.warning("%s", words, extra={"code": "arena_mass"})
        fragments = arena_realisation(arena, job.case, 0)
        arena.write(job.target.file("arena.csv"))
    else:
        fragments = flight.Fragments.read(job.options.fragments or job.needed(stage))
    others = job.source.file("ensemble_fragments.h5")
    further: Sequence[Fragments] = ()
    if job.options.fragments is None and others.is_file():
        further = read_fragment_ensemble(others)
    if job.options.fragments is not None or job.source.path != job.target.path:
        provenance = provenance_of(job.case)
        for name in ("fragments.h5", "fragments.csv"):
            fragments.write(job.target.file(name), provenance)
        if further:
            write_fragment_ensemble(further, job.target.file("ensemble_fragments.h5"), provenance)
    return WithFirst(fragments, further)


@dataclass(frozen=True)
class WithFirst(Sequence["Fragments"]):
    """The first realisation and the others, which may lie in a file."""

    first: Fragments
    others: Sequence[Fragments]

    def __len__(self) -> int:
        """Number of realisations."""
        return 1 + len(self.others)

    def __getitem__(self, number: Any) -> Any:  # noqa: ANN401 - a number here; slices have no use
        """One realisation by its number."""
        if not 0 <= number < len(self):
            raise IndexError(number)
        return self.others[number - 1] if number else self.first


def report(job: Job, stage: Stage) -> Summary:
    """The report of whatever the run directory holds: report.html."""
    from fragfield.report import write_report

    write_report(job.source.path, job.target.file(stage.result))
    return Summary()


_STAGE_FUNCTIONS: dict[str, Callable[[Job, Stage], Summary]] = {
    "burst": burst,
    "break-up": break_up,
    "fly": fly,
    "report": report,
}


class _Records(logging.Handler):
    """Keeps every warning of our own once."""

    def __init__(self, stage: str) -> None:
        super().__init__(logging.WARNING)
        self.stage = stage
        self.found: list[Warned] = []
        self.addFilter(concerns_the_user)

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a record: `code` and the words are those given with it, the severity is its level."""
        entry = Warned.read(
            {
                "stage": self.stage,
                "code": getattr(record, "code", "other"),
                "severity": record.levelname.lower(),
                "text": words_of(record),
            }
        )
        if entry not in self.found:
            self.found.append(entry)


@contextmanager
def heard(stage: str) -> Iterator[_Records]:
    """What the packages warn of meanwhile."""
    records = _Records(stage)
    for name in LOGGERS:
        logging.getLogger(name).addHandler(records)
    try:
        yield records
    finally:
        for name in LOGGERS:
            logging.getLogger(name).removeHandler(records)
