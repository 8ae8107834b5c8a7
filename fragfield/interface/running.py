"""`fragfield.run`: the whole chain or one stage, into a run directory."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError, nearest
from fragfield.interface.case import Case, case_of
from fragfield.interface.kinds import CaseOrRun, Count, File, Folder, Follow, Settings
from fragfield_base.ambient import check_variables
from fragfield_base.cores import let_threads_sleep
from fragfield_base.paths import absolute

if TYPE_CHECKING:
    from fragfield.interface.results import Run
    from fragfield.pipeline.job import RunOptions


def run(
    case: CaseOrRun,
    *,
    out: Folder | None = None,
    fragments: File | None = None,
    set: Settings = (),  # noqa: A002 - as `--set`
    threads: Count | None = None,
    resume: bool = False,
    overwrite: bool = False,
    progress: Follow = True,
    only: str | None = None,
) -> Run:
    """Compute a case: burst, break-up, flight and report, or one of them.

    Parameters
    ----------
    case : Case or path
        A case file, or the directory of a run.
    out : path, optional
        Run directory; default runs/NAME, or the run itself. A case made in Python needs one.
    fragments : path, optional
        Fly these fragments (.h5, .csv, or an arena table), not the run's. In Python with `only="fly"`.
    set : sequence of str, or mapping
        Replaces a value of the case, by its dotted key; repeatable. In Python see `Case.from_toml`.
    threads : int, optional
        Threads of each rank; default all cores.
    resume : bool
        Continue an interrupted run of the same case.
    overwrite : bool
        Replace another case's run in DIR.
    progress : bool or callable
        True: a line on stderr where that is a terminal. A callable is given a `fragfield.Progress` now and then.
    only : "burst", "break-up", "fly" or "report", optional
        One stage alone, from the files of the stages before it.

    Returns
    -------
    Run
        The run directory. Under mpirun the stages use all ranks and every rank gets the directory.

    Raises
    ------
    InputError
        The case or the directory is at fault; nothing was computed, or a stage refused its input.
    NumericalStop
        The burst left its bounds; a checkpoint and the log stay.
    OSError, MemoryError
        The machine's limits.

    Notes
    -----
    A distance that is not determined is no error here: all files are written. `run.hazard.determined` says so,
    and `run.hazard.recommended` raises `NotDeterminedError`.
    """
    from fragfield.files.run_directory import STAGES

    if only is not None and only not in STAGES:
        raise InputError(f"only: found {only!r}{nearest(str(only), STAGES)}; allowed: {', '.join(STAGES)}")
    if fragments is not None and only != "fly":
        raise InputError('fragments: found without only="fly"; allowed: only together with it')
    options = options_of(
        case, out=out, set=set, fragments=fragments, threads=threads, resume=resume,
        overwrite=overwrite, progress=progress, burst=only in (None, "burst"),
    )  # fmt: skip
    from fragfield.interface.results import Run
    from fragfield.pipeline.chain import run_chain

    run_chain(options, only)
    return Run(options.directory.path)


def options_of(
    case: CaseOrRun,
    *,
    out: Folder | None = None,
    set: Settings = (),  # noqa: A002 - as `--set`
    fragments: File | None = None,
    progress: Follow = True,
    burst: bool = True,
    **options: Any,
) -> RunOptions:
    """What the pipeline is asked for, by the arguments of `run`. A file is read later, by the first rank alone."""
    check_variables(InputError)
    let_threads_sleep()
    if options.get("threads") is not None:
        limit_threads(options["threads"])
    from fragfield.case.checks.consistency import check_case
    from fragfield.case.faults import CaseFaults
    from fragfield.pipeline.job import RunOptions

    made = None
    if isinstance(case, Case):
        found = case_of(case, set=set)
        set, made = (), found.values  # noqa: A001
        if burst and (faults := check_case(made)):
            raise CaseFaults("case", faults)
        if out is None:
            if found.path is None:
                raise InputError('out: missing; a case made in Python needs a run directory, such as out="runs/first"')
            out = absolute(f"runs/{found.path.stem}", InputError)
        case = out
    return RunOptions(
        absolute(case, InputError),
        None if out is None else absolute(out, InputError),
        fragments=None if fragments is None else absolute(fragments, InputError),
        settings=set,
        made=made,
        quiet=progress is False,
        follow=progress if callable(progress) else None,
        **options,
    )


def limit_threads(number: object) -> None:
    """Numba and OpenMP read their number of threads when they are first imported, which is later than this.

    A caller in the same process may have imported Numba: it then only takes fewer threads than it has started.
    """
    if not isinstance(number, int) or number < 1:
        raise InputError(f"threads: found {number!r}; allowed: a whole number of 1 or more")
    if (numba := sys.modules.get("numba")) is not None:
        numba.set_num_threads(min(number, numba.config.NUMBA_NUM_THREADS))
        return
    os.environ["NUMBA_NUM_THREADS"] = str(number)
    os.environ["OMP_NUM_THREADS"] = str(number)
