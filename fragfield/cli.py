"""The command line: results on stdout, progress and messages on stderr, exit codes 0, 2, 3, 4 and 130.

Nothing heavy is imported here: each subcommand imports what it needs, so `fragfield fly` works without dolfinx.
"""

from __future__ import annotations

import os
import signal
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import fragfield
from fragfield.errors import EXIT_FAULT, EXIT_INTERRUPTED, EXIT_NUMERICAL, exit_code_of, interrupt, message_of
from fragfield.parallel import launched_rank

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from fragfield.pipeline import Request

__all__ = ["app", "main"]

app = typer.Typer(
    name="fragfield",
    help="Hazard distances of the fragments of cased charges, for explosives safety: burst, break-up, flight, report.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

_COLLECTIVE = ("run", "burst", "break-up", "fly")
"""Commands that compute on all ranks of an MPI launch."""

CaseOrRun = Annotated[Path, typer.Argument(metavar="CASE_OR_RUN", help="A case file, or the directory of a run.")]
Out = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Run directory; default runs/NAME, or the run itself.")
]
CellSize = Annotated[
    str | None, typer.Option("--cell-size", metavar='"6 mm"', help="Replaces burst.cell_size; with its unit.")
]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Replaces a value of the case, by its dotted key; repeatable."),
]
Threads = Annotated[int | None, typer.Option("--threads", min=1, metavar="N", help="Threads of each rank.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on with what is missing of the same case.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace another case's run in DIR.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress, no warnings, no result text.")]
Json = Annotated[bool, typer.Option("--json", help="One JSON object on stdout, nothing else there.")]
FragmentsFile = Annotated[
    Path | None,
    typer.Option(
        "--fragments", metavar="FILE", help="Fly these fragments (.h5, .csv, or an arena table), not the run's."
    ),
]
Window = Annotated[
    bool | None,
    typer.Option("--window/--pictures", help="Open a window, or write pictures and films; default: as possible."),
]

Scheduler = Annotated[
    str | None,
    typer.Option("--scheduler", metavar="ADDRESS", help="Run on the workers of this dask scheduler: tcp://node1:8786."),
]
Html = Annotated[
    bool, typer.Option("--html", help="Write interactive 3-D pages, view_burst.html and view_fragments.html.")
]


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"fragfield {fragfield.__version__}")
        raise typer.Exit


@app.callback()
def _common(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    del version
    if launched_rank() > 0 and context.invoked_subcommand not in _COLLECTIVE:
        raise typer.Exit  # the first rank does it alone


@app.command()
def check(
    case: CaseOrRun,
    cell_size: CellSize = None,
    settings: Settings = None,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Read a case, print it resolved in SI with derived quantities, and warn of what may be wrong."""
    with _guarded(json=json, quiet=quiet):
        from fragfield.check import check_report
        from fragfield.show import print_check

        resolved = _request(case, cell_size=cell_size, settings=settings).case()
        _give(check_report(resolved), json=json, quiet=quiet, show=lambda found: print_check(found, resolved))


@app.command()
def run(
    case: CaseOrRun,
    out: Out = None,
    cell_size: CellSize = None,
    settings: Settings = None,
    threads: Threads = None,
    resume: Resume = False,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Run the whole chain: burst, break-up, flight, report."""
    with _guarded(json=json, quiet=quiet):
        request = _request(case, out, cell_size, threads, resume, overwrite, quiet, settings=settings)
        from fragfield.pipeline import run_chain

        _give_summary(run_chain(request), request, json=json, flown=True)


@app.command()
def burst(
    case: CaseOrRun,
    out: Out = None,
    cell_size: CellSize = None,
    settings: Settings = None,
    threads: Threads = None,
    resume: Resume = False,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Compute the detonation and the acceleration of the casings."""
    with _guarded(json=json, quiet=quiet):
        request = _request(case, out, cell_size, threads, resume, overwrite, quiet, settings=settings)
        _run_stage("burst", request, json=json)


@app.command("break-up")
def break_up(
    case: CaseOrRun, out: Out = None, threads: Threads = None, quiet: Quiet = False, json: Json = False
) -> None:
    """Break the casings of a computed burst into fragments."""
    with _guarded(json=json, quiet=quiet):
        _run_stage("break-up", _request(case, out, threads=threads, quiet=quiet), json=json)


@app.command()
def fly(
    case: CaseOrRun,
    out: Out = None,
    fragments: FragmentsFile = None,
    threads: Threads = None,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Fly the fragments of a run, or of a file, to the ground."""
    with _guarded(json=json, quiet=quiet):
        _run_stage("fly", _request(case, out, threads=threads, quiet=quiet, fragments=fragments), json=json)


@app.command()
def report(case: CaseOrRun, out: Out = None, quiet: Quiet = False, json: Json = False) -> None:
    """Write the report of a run, report.html."""
    with _guarded(json=json, quiet=quiet):
        _run_stage("report", _request(case, out, quiet=quiet), json=json)


@app.command()
def view(case: CaseOrRun, window: Window = None, html: Html = False, quiet: Quiet = False, json: Json = False) -> None:
    """Look at a run: in a window where there is a display, else as pictures and films; or as 3-D pages."""
    with _guarded(json=json, quiet=quiet):
        from fragfield.view import view_run

        written = view_run(_request(case).source.path, window=window, html=html)
        _give(
            {"pages" if html else "pictures": [str(path) for path in written]},
            json=json,
            quiet=quiet,
            show=_print_paths,
        )


@app.command()
def info(
    path: Annotated[Path, typer.Argument(metavar="RUN_OR_FILE", help="The directory of a run, or one of its files.")],
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Say what a run directory or an HDF5 file holds and where it comes from."""
    with _guarded(json=json, quiet=quiet):
        from fragfield.info import describe
        from fragfield.show import print_info

        _give(describe(path), json=json, quiet=quiet, show=print_info)


@app.command()
def new(
    name: Annotated[Path, typer.Argument(metavar="NAME", help="The file to write: NAME.toml.")],
    round_: Annotated[str, typer.Option("--round", metavar="PROFILE", help="Built-in contour of the round.")] = "m107",
    explosive: Annotated[str, typer.Option("--explosive", metavar="NAME", help="Built-in explosive.")] = "tnt",
    casing: Annotated[
        str | None, typer.Option("--casing", metavar="NAME", help="Built-in casing material; default: the round's.")
    ] = None,
    stack: Annotated[
        str | None, typer.Option("--stack", metavar="ARRANGEMENT", help="Copies of the round: row, triangle, pallet.")
    ] = None,
    every_key: Annotated[
        bool, typer.Option("--all", help="Every key of the case file, not only the usual ones.")
    ] = False,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Write a commented case file to start from."""
    with _guarded(json=json, quiet=quiet):
        from fragfield.new_case import write_new_case

        written = write_new_case(name, round_, explosive, casing=casing, stack=stack, every_key=every_key)
        _give({"case": [str(written)]}, json=json, quiet=quiet, show=_print_paths)


@app.command()
def compare(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Directory of a run, such as a pair's.")],
    reference: Annotated[Path, typer.Argument(metavar="RUN", help="The run it is divided by, such as the single's.")],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Write tables (CSV, JSON) and a picture there.")
    ] = None,
    sector: Annotated[
        float | None,
        typer.Option("--sector", metavar="DEGREES", help="Width of the sectors; default 15, or as the runs have them."),
    ] = None,
    all_round: Annotated[
        bool, typer.Option("--all-round", help="Divide by the reference's mean over all azimuths.")
    ] = False,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Divide one run by another: witness surfaces by azimuth, hazards by distance, casing speeds."""
    with _guarded(json=json, quiet=quiet):
        from fragfield.compare import compare_runs, print_comparison, write_comparison

        found = compare_runs(run, reference, sector=sector, all_round=all_round)
        if out is not None:
            write_comparison(found, out)
        _give(found, json=json, quiet=quiet, show=print_comparison)


@app.command()
def sweep(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="The case file that is varied.")],
    values: Annotated[
        list[str], typer.Argument(metavar="KEY=VALUE,...", help='Values of a key: burst.cell_size="8 mm,6 mm".')
    ],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Holds the runs; default runs/NAME_sweep.")
    ] = None,
    stage: Annotated[str, typer.Option("--stage", metavar="run|burst", help="The whole chain, or the burst.")] = "run",
    threads: Annotated[
        int | None, typer.Option("--threads", min=1, metavar="N", help="Threads of each run; default 1.")
    ] = None,
    jobs: Annotated[
        int | None, typer.Option("--jobs", min=1, metavar="N", help="Runs side by side; default all cores.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Keep finished runs, go on with begun ones.")] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace runs of another case in DIR.")] = False,
    scheduler: Scheduler = None,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Run a case for every combination of values, side by side, into one table.

    Runs go as far as the flight and write no report, pictures and files for ParaView; `fragfield run CASE --out DIR
    --resume` adds the report to one of them.

    A run that fails is recorded in the table and the others go on. Exit code 0 if all runs are done, 3 if one failed, 2
    if a key or a value is not allowed: then nothing runs.
    """
    with _guarded(json=json, quiet=quiet):
        from fragfield.sweep import SweepOptions, plan_sweep, print_sweep, run_sweep

        folder = out or Path("runs") / f"{case.stem}_sweep"
        options = SweepOptions(folder, stage, threads, resume, overwrite, quiet, jobs, scheduler)
        found = run_sweep(plan_sweep(case, values), options)
        _give(found, json=json, quiet=quiet, show=print_sweep)
    raise typer.Exit(found["exit_code"])


@app.command()
def uncertainty(
    case: CaseOrRun,
    samples: Annotated[
        int | None,
        typer.Option("--samples", min=8, metavar="N", help="Number of samples; default uncertainty.samples."),
    ] = None,
    method: Annotated[
        str | None, typer.Option("--method", metavar="latin_hypercube|sobol", help="Replaces uncertainty.method.")
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", min=0, metavar="N", help="Of points and samples; default the case's.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Holds the study; default runs/NAME_uncertainty.")
    ] = None,
    cell_size: CellSize = None,
    settings: Settings = None,
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, metavar="N", help="Samples side by side; default all cores.")
    ] = None,
    scheduler: Scheduler = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the study in DIR; nothing is made twice.")
    ] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the study in DIR.")] = False,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Sample the uncertain inputs of a case: distribution of the distance, share of each input, one budget.

    The inputs are those of the table [uncertainty] and of the default set. Given the directory of a run, that run is
    the nominal one, and its report gains a section; else the case is run first.

    Exit code 3 where a sample failed or has no distance; they are counted and left out.
    """
    with _guarded(json=json, quiet=quiet):
        from fragfield.uncertainty import StudyOptions, run_study
        from fragfield.uncertainty.show import print_study

        folder = out or Path("runs") / f"{case.resolve().stem}_uncertainty"
        options = StudyOptions(folder, samples, method, seed, workers, scheduler, resume, overwrite, quiet)
        found = run_study(_request(case, cell_size=cell_size, settings=settings, quiet=quiet), options)
        _give(found, json=json, quiet=quiet, show=print_study)
    raise typer.Exit(found["exit_code"])


def main() -> None:
    """Entry point of the command `fragfield`."""
    # A batch system ends a job by SIGTERM: treated like Ctrl-C, the burst leaves a checkpoint.
    # While it steps or writes a file, `fragfield_base.interruption` defers both to where they do no harm.
    signal.signal(signal.SIGTERM, interrupt)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not ignored, as in the background
        signal.signal(signal.SIGINT, interrupt)
    try:
        try:
            app()
        finally:
            sys.stdout.flush()
    except KeyboardInterrupt:  # before or after the guarded part
        sys.exit(EXIT_INTERRUPTED)
    except OSError as error:  # standard output: on a full disk, or `fragfield info RUN | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if not isinstance(error, BrokenPipeError):
            sys.stderr.write(f"fragfield: standard output: {error.strerror or error}\n")
        sys.exit(exit_code_of(error))
    finally:
        # All is done: what comes while libraries and Python itself are closed has nothing to interrupt any more.
        for number in (signal.SIGTERM, signal.SIGINT):
            if signal.getsignal(number) is interrupt:
                signal.signal(number, signal.SIG_IGN)


def _request(
    case: Path,
    out: Path | None = None,
    cell_size: str | None = None,
    threads: int | None = None,
    resume: bool = False,
    overwrite: bool = False,
    quiet: bool = False,
    fragments: Path | None = None,
    settings: list[str] | None = None,
) -> Request:
    if threads is not None:
        _limit_threads(threads)
    from fragfield.pipeline import Request

    return Request(case, out, cell_size, threads, resume, overwrite, quiet, fragments, tuple(settings or ()))


def _limit_threads(number: int) -> None:
    """Numba and OpenMP read their number of threads when they are first imported, which is later than this.

    A caller in the same process may have imported Numba: it then only takes fewer threads than it has started.
    """
    if (numba := sys.modules.get("numba")) is not None:
        numba.set_num_threads(min(number, numba.config.NUMBA_NUM_THREADS))
        return
    os.environ["NUMBA_NUM_THREADS"] = str(number)
    os.environ["OMP_NUM_THREADS"] = str(number)


def _run_stage(name: str, request: Request, *, json: bool) -> None:
    from fragfield.pipeline import run_stage

    _give_summary(run_stage(request, name), request, json=json, flown=name == "fly")


def _give_summary(summary: dict[str, Any], request: Request, *, json: bool, flown: bool) -> None:
    """Print a summary; what was `flown` and has no hazard distance ends with the exit code for that."""
    from fragfield.show import print_summary

    if launched_rank() == 0:
        from fragfield.certainty import is_determined

        summary = {"directory": str(request.directory.path), **summary}
        _give(summary, json=json, quiet=request.quiet, show=print_summary)
        if flown and not is_determined(summary):
            raise typer.Exit(EXIT_NUMERICAL)


def _print_paths(found: dict[str, Any]) -> None:
    for paths in found.values():
        for path in paths:
            typer.echo(path)


def _give(found: dict[str, Any], *, json: bool, quiet: bool, show: Callable[[dict[str, Any]], None]) -> None:
    """Print a result: as one JSON object, or for people."""
    if json:
        from json import dumps

        typer.echo(dumps(found, allow_nan=False))
    elif not quiet:
        show(found)


@contextmanager
def _guarded(*, json: bool, quiet: bool) -> Iterator[None]:
    """End every error with one message and its exit code; the traceback of one of the program goes to a log."""
    from fragfield.logs import to_stderr

    try:
        with to_stderr(quiet=quiet or launched_rank() > 0):
            yield
    except KeyboardInterrupt as error:
        _print_message(message_of(error), json=json)
        raise typer.Exit(EXIT_INTERRUPTED) from error
    except (typer.Exit, BrokenPipeError):
        raise
    except Exception as error:  # noqa: BLE001 - the last guard: nothing passes it
        code, message = exit_code_of(error), message_of(error)
        if code == EXIT_FAULT:
            message += f"; please report it with {_log_of(error)}"
        _print_message(message, json=json, code=code)
        raise typer.Exit(code) from None


def _log_of(error: Exception) -> str:
    """Where the traceback of a fault can be read: the run's log, else a file of its own."""
    import tempfile
    import traceback

    if (log := getattr(error, "fragfield_log", None)) is not None:
        return str(log)
    try:
        descriptor, name = tempfile.mkstemp(prefix="fragfield-fault-", suffix=".log")  # readable by its owner alone
        with os.fdopen(descriptor, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(f"{' '.join(sys.argv)}\n")
            traceback.print_exception(error, file=file)
    except OSError:
        return "what you did (its traceback could not be written)"
    return name


def _print_message(message: str, *, json: bool, code: int = EXIT_INTERRUPTED) -> None:
    if launched_rank() > 0:
        return
    typer.echo(f"fragfield: {message}", err=True)
    if json:
        from json import dumps

        typer.echo(dumps({"error": {"message": message, "exit_code": code}}))
    sys.stdout.flush()
