"""The chain burst, break-up, flight, report on a run directory: all of it, one stage, or resumed."""

from __future__ import annotations

import logging
import sys
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from fragfield.case.changes import load_set_case
from fragfield.case.checks.bounds import outside_soft
from fragfield.errors import EXIT_FAULT, InputError, exit_code_of, message_of
from fragfield.files.run_directory import STAGES, RunDirectory
from fragfield.pipeline.arena import read_arena
from fragfield.pipeline.job import Job
from fragfield.pipeline.parallel import Team
from fragfield.pipeline.stages import perform
from fragfield.terminal.logs import logged
from fragfield.terminal.progress import ProgressReporter
from fragfield.terminal.visible_text import visible

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Any

    from fragfield.case import Case
    from fragfield.files.run_directory import Stage
    from fragfield.terminal.progress import Progress

__all__ = ["Request", "run_chain", "run_stage"]

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Request:
    """What the command line or a Python program asks for.

    Attributes
    ----------
    target : Path
        A case file or a run directory.
    out : Path, optional
        Run directory to write; left out: the run directory given, or runs/NAME for NAME.toml.
    cell_size : str, optional
        Replaces `burst.cell_size`.
    threads : int, optional
        Threads of a rank.
    resume, overwrite : bool
        See `RunDirectory.claim`.
    quiet : bool
        No progress.
    fragments : Path, optional
        Fragments from another source, for the stage `fly`.
    settings : tuple of str
        KEY=VALUE that replace values of the case.
    lean : bool
        Numbers alone, for a sweep: no report, no files for visualisation, no other cell sizes.
    profile : bool
        Time the parts of the burst.
    made : Case, optional
        The resolved case, instead of a file's; `target` is then its run directory, and a stage's case is this one.
    follow : callable, optional
        Called with the progress, on rank 0.
    """

    target: Path
    out: Path | None = None
    cell_size: str | None = None
    threads: int | None = None
    resume: bool = False
    overwrite: bool = False
    quiet: bool = False
    fragments: Path | None = None
    settings: tuple[str, ...] = ()
    lean: bool = False
    profile: bool = False
    made: Case | None = None
    follow: Callable[[Progress], object] | None = None

    def case(self, *, burst: bool = True) -> Case:
        """The resolved case of the file, or of the run directory; raises InputError."""
        if self.made is not None:
            return self.made
        if self.target.is_dir():
            stored = RunDirectory(self.target)
            stored.stored_case()  # says what is missing, in the words of a run directory
            return self._loaded(stored.case_file, burst=burst)
        return self._loaded(self.target, burst=burst)

    def _loaded(self, path: Path, *, burst: bool) -> Case:
        return load_set_case(path, self.settings, cell_size=self.cell_size, burst=burst)

    @property
    def directory(self) -> RunDirectory:
        """Where the run is written."""
        if self.out is not None:
            return RunDirectory(self.out)
        return RunDirectory(self.target if self.target.is_dir() else Path("runs") / self.target.stem)

    @property
    def source(self) -> RunDirectory:
        """Where a stage finds the files of earlier stages."""
        return RunDirectory(self.target) if self.target.is_dir() else self.directory


def run_chain(request: Request) -> dict[str, Any]:
    """Run every stage, or with `resume` those that are missing.

    Parameters
    ----------
    request : Request
        What to run.

    Returns
    -------
    dict
        summary.json; empty on ranks other than 0.

    Raises
    ------
    InputError, NumericalStop
        As the stages raise them; what was written stays.
    """
    team = Team.join()
    with ExitStack() as held:
        case, directory = _prepared(request, team, held)
        return _run_all(request, team, case, directory)


def _run_all(request: Request, team: Team, case: Case, directory: RunDirectory) -> dict[str, Any]:
    stages = list(STAGES.values())
    done = team.broadcast(_done(directory, stages) if team.first and request.resume else 0)
    with _working(request, team, directory, fresh=not request.resume) as reporter:
        _warn_of_values(case, team)
        job = Job(
            case, directory, directory, team, reporter, request.threads, resume=request.resume, lean=request.lean,
            profile=request.profile,
        )  # fmt: skip
        if done:
            _log.info("resumed after %s", stages[done - 1].name)
        with _together(team):
            for stage in stages[done:-1]:
                perform(job, stage)
        if not team.first:
            if code := team.wait():
                sys.exit(code)
            return {}
        with _releasing(team):
            if not request.lean:
                perform(job, stages[-1])
            return directory.summary()


def run_stage(request: Request, name: str) -> dict[str, Any]:
    """Run one stage from the files of the stages before it; as `run_chain` otherwise. The report is of one rank."""
    stage = STAGES[name]
    team = Team() if name == "report" else Team.join()
    with ExitStack() as held:
        case, directory = _prepared(request, team, held, stage)
        return _run_one(request, team, case, directory, stage)


def _run_one(request: Request, team: Team, case: Case, directory: RunDirectory, stage: Stage) -> dict[str, Any]:
    name = stage.name
    source = directory if name == "burst" else request.source
    with _working(request, team, directory, fresh=name == "burst" and not request.resume) as reporter:
        if name != "report":
            _warn_of_values(case, team)
        job = Job(
            case, source, directory, team, reporter, request.threads, request.fragments, request.resume, request.lean,
            request.profile,
        )  # fmt: skip
        with _together(team):
            perform(job, stage)
        return directory.summary() if team.first else {}


def _warn_of_values(case: Case, team: Team) -> None:
    """Say in the log which values of the case are unusual; the report asks the case itself."""
    for words in outside_soft(case) if team.first else ():
        _log.warning("%s", words)


def _enter(request: Request, stage: Stage, held: ExitStack) -> Case:
    """Read the case and make the directory ready for one stage after the burst."""
    case, directory, source = request.case(burst=False), request.directory, request.source
    if request.fragments is None:
        _check_inputs(case, source, stage)
    else:
        if directory.complete(STAGES["break-up"]):
            raise InputError(f"{directory.path}: holds fragments of its own break-up; fly others with another --out")
        read_arena(request.fragments, case)  # refuses one that does not fit the case, before the directory is made
    if stage.name == "report":
        directory.make()
    else:
        directory.make()
        held.enter_context(directory.locked())
        directory.enter(case, stage)
    return case


def _check_inputs(case: Case, source: RunDirectory, stage: Stage) -> None:
    if stage.needs and not source.file(stage.needs).is_file():
        maker = next(one.name for one in STAGES.values() if one.result == stage.needs)
        raise InputError(f"{source.file(stage.needs)}: no such file; run `fragfield {maker}` first")
    if source.exists:
        source.check_upstream(case, stage)


def _prepared(
    request: Request, team: Team, held: ExitStack, stage: Stage = STAGES["burst"]
) -> tuple[Case, RunDirectory]:
    """Read the case, lock and claim the directory on rank 0; its error ends every rank with the same exit code.

    For one `stage`, or for the whole run, from its first. The lock is `held`; a report, which only adds
    its page, takes none.
    """
    if not team.first:
        received: tuple[Case | None, int] = team.broadcast()
        if received[0] is None:
            sys.exit(received[1])
        return received[0], request.directory
    try:
        if stage.name == "burst":
            case = request.case()
            request.directory.make()
            held.enter_context(request.directory.locked())
            request.directory.claim(case, resume=request.resume, overwrite=request.overwrite)
        else:
            case = _enter(request, stage, held)
    except BaseException as error:
        team.broadcast((None, exit_code_of(error)))
        raise
    team.broadcast((case, 0))
    return case, request.directory


def _done(directory: RunDirectory, stages: list[Stage]) -> int:
    """Number of stages that are complete; the report is always made again."""
    count = 0
    while count < len(stages) - 1 and directory.complete(stages[count]):
        count += 1
    return count


@contextmanager
def _working(request: Request, team: Team, directory: RunDirectory, *, fresh: bool) -> Iterator[ProgressReporter]:
    with ExitStack() as stack:
        if team.first and directory.path.is_dir():
            stack.enter_context(logged(directory.log_file, fresh=fresh))
        try:
            yield stack.enter_context(_reporter(request, team))
        except Exception as error:
            _log.info("ended: %s", error)  # the command line says it on stderr; the log keeps it
            if exit_code_of(error) == EXIT_FAULT and team.first:
                _log.info("traceback", exc_info=error)
                error.fragfield_log = directory.log_file  # type: ignore[attr-defined]
            raise
        except KeyboardInterrupt:
            _log.info("interrupted")
            raise


def _reporter(request: Request, team: Team) -> ProgressReporter:
    return ProgressReporter(enabled=team.first and not request.quiet, follow=request.follow if team.first else None)


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
