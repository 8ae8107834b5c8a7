"""Commands that check and compute a case, whole or by stages; each calls the Python interface once."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import typer

import fragfield
from fragfield.cli.application import (
    CaseOrRun,
    Drawing,
    FragmentsFile,
    Json,
    Out,
    Overwrite,
    ProgressFile,
    Quiet,
    Resolved,
    Resume,
    Settings,
    Threads,
    app,
)
from fragfield.cli.guard import give, guarded
from fragfield.errors import EXIT_NUMERICAL
from fragfield.pipeline.parallel import launched_rank
from fragfield.results.part import to_json

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from fragfield.interface.results import Run
    from fragfield.terminal.progress import Progress


@app.command()
def check(
    case: CaseOrRun,
    settings: Settings = None,
    fragments: FragmentsFile = None,
    drawing: Drawing = None,
    resolved: Resolved = False,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Read a case, print its masses, speeds, mesh and cost, and warn of what may be wrong.

    With --fragments, whether that file fits the case, as `fly` will take it; such a case needs no burst.
    """
    with guarded(json=json, quiet=quiet):
        from fragfield.checking.show import print_check

        done = fragfield.check(case, set=settings or (), fragments=fragments)
        shown = done.case.values if resolved else None
        drawn = {"drawings": [str(path) for path in done.draw(drawing)]} if drawing is not None else {}
        give(done.found | drawn, json=json, show=lambda found: print_check(found, shown))


@app.command()
def run(
    case: CaseOrRun,
    out: Out = None,
    settings: Settings = None,
    threads: Threads = None,
    resume: Resume = False,
    overwrite: Overwrite = False,
    progress_file: ProgressFile = None,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Run the whole chain: burst, break-up, flight, report."""
    began = time.monotonic()
    with guarded(json=json, quiet=quiet):
        done = fragfield.run(
            case, out=out, set=settings or (), threads=threads, resume=resume,
            overwrite=overwrite, progress=_progress(progress_file, quiet=quiet),
        )  # fmt: skip
        if not quiet and launched_rank() == 0:
            from fragfield.terminal.progress import duration

            typer.echo(f"fragfield: done in {duration(time.monotonic() - began)}", err=True)
        _give_summary(done, json=json, flown=True, warnings=True)


@app.command()
def burst(
    case: CaseOrRun,
    out: Out = None,
    settings: Settings = None,
    threads: Threads = None,
    resume: Resume = False,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Compute the detonation and the acceleration of the casings."""
    with guarded(json=json, quiet=quiet):
        done = fragfield.run(
            case, out=out, set=settings or (), threads=threads, resume=resume,
            overwrite=overwrite, progress=not quiet, only="burst",
        )  # fmt: skip
        _give_summary(done, json=json, flown=False)


@app.command("break-up")
def break_up(
    case: CaseOrRun,
    out: Out = None,
    settings: Settings = None,
    threads: Threads = None,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Break the casings of a computed burst into fragments."""
    with guarded(json=json, quiet=quiet):
        done = fragfield.run(case, out=out, set=settings or (), threads=threads, progress=not quiet, only="break-up")
        _give_summary(done, json=json, flown=False)


@app.command()
def fly(
    case: CaseOrRun,
    out: Out = None,
    fragments: FragmentsFile = None,
    settings: Settings = None,
    threads: Threads = None,
    progress_file: ProgressFile = None,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Fly the fragments of a run, or of a file, to the ground."""
    with guarded(json=json, quiet=quiet):
        done = fragfield.run(
            case, out=out, fragments=fragments, set=settings or (), threads=threads, only="fly",
            progress=_progress(progress_file, quiet=quiet),
        )  # fmt: skip
        _give_summary(done, json=json, flown=True)


@app.command()
def report(
    case: CaseOrRun, out: Out = None, progress_file: ProgressFile = None, quiet: Quiet = False, json: Json = False
) -> None:
    """Write the report of a run, report.html."""
    with guarded(json=json, quiet=quiet):
        done = fragfield.run(case, out=out, progress=_progress(progress_file, quiet=quiet), only="report")
        _give_summary(done, json=json, flown=False)


def _progress(file: Path | None, *, quiet: bool) -> bool | Callable[[Progress], None]:
    """What follows the progress of a run: a line on a terminal, or a file."""
    if file is None:
        return not quiet
    from fragfield.terminal.progress import into_file

    return into_file(file)


def _give_summary(done: Run, *, json: bool, flown: bool, warnings: bool = False) -> None:
    """Print the summary of a run, with its `warnings`; one that was `flown` and has no distance ends with code 3."""
    from fragfield.terminal.show import plain_console, print_summary

    def show(_: Mapping[str, Any]) -> None:
        print_summary(done.summary, str(done.path))
        for words in done.warnings if warnings else ():
            plain_console().print(words)

    if launched_rank() == 0:
        give({"directory": str(done.path), **to_json(done.summary)}, json=json, show=show)
        hazard = done.summary.hazard
        if flown and hazard is not None and not hazard.determined:
            raise typer.Exit(EXIT_NUMERICAL)
