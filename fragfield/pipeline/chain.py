"""The chain burst, break-up, flight, report on a run directory: all of it, one stage, or resumed."""

from __future__ import annotations

import importlib
import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from importlib.util import find_spec

import flight
from flight.files.ensemble import read_fragment_ensemble
from fragfield.case import CaseTable
from fragfield.case.checks.estimates import given_fragments
from fragfield.case.faults import outside_soft
from fragfield.errors import EXIT_FAULT, InputError, exit_code_of, message_of
from fragfield.files.run_directory import STAGES, RunDirectory, Stage
from fragfield.pipeline.arena import read_arena
from fragfield.pipeline.job import Job, RunOptions
from fragfield.pipeline.kernels import compiled_beside
from fragfield.pipeline.parallel import Team
from fragfield.pipeline.stages import perform
from fragfield.terminal.logs import logged, visible
from fragfield.terminal.progress import ProgressReporter
from fragfield_base.hdf5_files import check_sound
from fragfield_base.writing import locked

_log = logging.getLogger(__name__)


def run_chain(options: RunOptions, only: str | None = None) -> None:
    """Run every stage, or with `resume` those that are missing; or `only` one, from the files of those before it.

    All ranks of a launch compute the burst; what follows is of rank 0, while the others wait for its exit code.

    Raises
    ------
    InputError, NumericalStop
        As the stages raise them; what was written stays.
    """
    team = Team() if only == "report" else Team.join()
    from_burst = only in (None, "burst")
    with ExitStack() as held:
        case, directory = _prepared(options, team, held, STAGES[only or "burst"])
        reporter = held.enter_context(_working(options, team, directory, fresh=from_burst and not options.resume))
        if only != "report":
            _warn_of_values(case, team)
        job = Job(case, directory if from_burst else options.source, directory, team, reporter, options)
        stages = _waiting(job) if only is None else [STAGES[only]]
        flight_compiled: Callable[[], object] = _do_nothing
        if team.size == 1 and stages[0].name == "burst" and len(stages) > 1 and not options.lean:
            flight_compiled = held.enter_context(compiled_beside(case, quiet=options.quiet))
        with _together(team):
            if stages[0].name == "burst":
                perform(job, stages.pop(0))
            else:
                _load_together(job)
        if not team.first:
            if code := team.wait():
                sys.exit(code)
            return
        with _releasing(team):
            job = replace(job, team=team.of_one)
            for stage in stages:
                if stage.name == "fly":
                    flight_compiled()
                if stage.name != "report" or not options.lean:
                    perform(job, stage)


def _do_nothing() -> None:
    pass


def _load_together(job: Job) -> None:
    """Load dolfinx on all ranks at once: its start is collective, and later rank 0 computes bursts alone."""
    if job.team.size > 1 and job.options.fragments is None and job.case.burst is not None:
        importlib.import_module("burst_fenicsx.run_burst")


def _waiting(job: Job) -> list[Stage]:
    """The stages that are not complete; the report is always made again."""
    stages = list(STAGES.values())
    done = 0
    while job.team.first and job.options.resume and done < len(stages) - 1 and job.target.complete(stages[done]):
        done += 1
    done = job.team.broadcast(done)
    if done:
        _log.info("resumed after %s", stages[done - 1].name)
    return stages[done:]


def _warn_of_values(case: CaseTable, team: Team) -> None:
    """Say in the log which values of the case are unusual; the report asks the case itself."""
    for words in outside_soft(case) if team.first else ():
        _log.warning("%s", words)


def _enter(options: RunOptions, stage: Stage, held: ExitStack) -> CaseTable:
    """Read the case and make the directory ready for one stage after the burst."""
    case, directory, source = options.case(burst=False), options.directory, options.source
    if options.fragments is None:
        _check_inputs(case, source, stage)
    else:
        if directory.complete(STAGES["break-up"]):
            raise InputError(f"{directory.path}: holds fragments of its own break-up; fly others with another --out")
        # refuse what does not fit the case, before anything is removed
        if read_arena(options.fragments, case) is None:
            for words in given_fragments(case, options.fragments):
                _log.warning("%s", words)
    directory.make()
    if stage.name != "report":
        held.enter_context(locked(directory.path, InputError))
        directory.enter(case, stage)
    elif directory.path == source.path and source.exists:
        stored = source.stored_case()
        if (stored.title, stored.document) != (case.title, case.document):  # which the report takes from there
            directory.write_case(case)
    return case


def _check_inputs(case: CaseTable, source: RunDirectory, stage: Stage) -> None:
    if stage.needs and not source.file(stage.needs).is_file():
        maker = next(one.name for one in STAGES.values() if one.result == stage.needs)
        raise InputError(f"{source.file(stage.needs)}: no such file; run `fragfield {maker}` first")
    if source.exists:
        source.check_upstream(case, stage)
    if stage.needs:
        _read_inputs(source, stage)


def _read_inputs(source: RunDirectory, stage: Stage) -> None:
    """Read the files that a stage needs, and refuse a damaged one, before anything is removed."""
    import transition

    {"break-up": transition.Snapshot.read, "fly": flight.Fragments.read}[stage.name](source.file(stage.needs))
    if stage.name == "fly" and (others := source.file("ensemble_fragments.h5")).is_file():
        read_fragment_ensemble(others)
    if stage.name == "fly" and (burst := source.file("burst_snapshot.h5")).is_file():  # of its single round
        check_sound(burst, InputError)


def _prepared(options: RunOptions, team: Team, held: ExitStack, stage: Stage) -> tuple[CaseTable, RunDirectory]:
    """Read the case, lock and claim the directory on rank 0; its error ends every rank with the same exit code.

    For one `stage`, or for the whole run, from its first. The lock is `held`; a report, which only adds
    its page, takes none.
    """
    if not team.first:
        received: tuple[CaseTable | None, int] = team.broadcast()
        if received[0] is None:
            sys.exit(received[1])
        return received[0], options.directory
    try:
        if stage.name == "burst":
            case = options.case()
            _check_dolfinx()
            options.directory.make()
            held.enter_context(locked(options.directory.path, InputError))
            options.directory.claim(case, resume=options.resume, overwrite=options.overwrite)
        else:
            case = _enter(options, stage, held)
    except BaseException as error:
        team.broadcast((None, exit_code_of(error)))
        raise
    team.broadcast((case, 0))
    return case, options.directory


def _check_dolfinx() -> None:
    if missing := [name for name in ("dolfinx", "mpi4py", "h5py") if find_spec(name) is None]:
        raise InputError(
            f"a burst needs dolfinx: found no {' and no '.join(missing)} in {sys.prefix}; needed: on Linux with x86-64 "
            "and Python 3.12 or newer: pip install 'fragfield[dolfinx]'; on Debian 12 or 13: sh setup.sh; elsewhere "
            "conda (environment.yml); `fragfield fly --fragments` needs none"
        )


@contextmanager
def _working(options: RunOptions, team: Team, directory: RunDirectory, *, fresh: bool) -> Iterator[ProgressReporter]:
    with ExitStack() as stack:
        if team.first and directory.path.is_dir():
            stack.enter_context(logged(directory.log_file, fresh=fresh))
        try:
            yield stack.enter_context(_reporter(options, team))
        except Exception as error:
            _log.info("ended: %s", error)  # the command line says it on stderr; the log keeps it
            if exit_code_of(error) == EXIT_FAULT and team.first:
                _log.info("traceback", exc_info=error)
                error.fragfield_log = directory.log_file  # type: ignore[attr-defined]
            raise
        except KeyboardInterrupt:
            _log.info("interrupted")
            raise


def _reporter(options: RunOptions, team: Team) -> ProgressReporter:
    return ProgressReporter(enabled=team.first and not options.quiet, follow=options.follow if team.first else None)


@contextmanager
def _together(team: Team) -> Iterator[None]:
    """Collective work: an error on one rank ends them all, reported once."""
    try:
        yield
    except BaseException as error:
        if team.size == 1:
            raise
        team.give_others_time()
        code = exit_code_of(error)
        where = "" if team.first else f"rank {team.rank}: "
        if code == EXIT_FAULT:
            _log.info("%sfault of the program", where, exc_info=error)
        sys.stderr.write(f"fragfield: {where}{visible(message_of(error))}\n")
        sys.stderr.flush()
        team.abort(code)
        raise


@contextmanager
def _releasing(team: Team) -> Iterator[None]:
    """Work of rank 0 alone: the others wait, and leave with its exit code."""
    try:
        yield
    except BaseException as error:
        team.release(exit_code_of(error))
        raise
    team.release(0)
