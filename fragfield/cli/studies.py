"""Commands that compute many runs of one case, and the one that compiles for all of them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

import fragfield
from fragfield.cli.application import CaseOrRun, Json, Quiet, Scheduler, Settings, app, file_path
from fragfield.cli.guard import give, guarded
from fragfield.errors import EXIT_NUMERICAL

Varied = Annotated[Path, typer.Argument(parser=file_path, metavar="CASE", help="The case file that is varied.")]
RunThreads = Annotated[
    int | None, typer.Option("--threads", min=1, metavar="N", help="Threads of each run; default 1.")
]
Jobs = Annotated[
    int | None, typer.Option("--jobs", min=1, metavar="N", help="Runs at the same time; default all cores.")
]
ResumeRuns = Annotated[bool, typer.Option("--resume", help="Keep finished runs, continue the others.")]
OverwriteRuns = Annotated[bool, typer.Option("--overwrite", help="Replace runs of another case in DIR.")]


@app.command()
def sweep(
    case: Varied,
    values: Annotated[
        list[str], typer.Argument(metavar="KEY=VALUE,...", help='Values of a key: burst.cell_size="8 mm,6 mm".')
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", parser=file_path, metavar="DIR", help="Folder for the runs; default runs/NAME_sweep."),
    ] = None,
    stage: Annotated[str, typer.Option("--stage", metavar="run|burst", help="The whole chain, or the burst.")] = "run",
    threads: RunThreads = None,
    jobs: Jobs = None,
    resume: ResumeRuns = False,
    overwrite: OverwriteRuns = False,
    scheduler: Scheduler = None,
    keep_runs: Annotated[bool, typer.Option("--keep-runs", help="Keep a run directory of every run.")] = False,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Run a case for every combination of values, side by side, into one table.

    Of runs with an axisymmetric burst only the rows are kept, without --keep-runs. Others have run directories, as far
    as the flight, without report, pictures and files for ParaView; `fragfield run CASE --out DIR --resume` adds the
    report to one of them.

    A run that fails is recorded in the table and the others go on. Exit code 0 if all runs are done, 3 if one failed, 2
    if a key or a value is not allowed: then nothing runs.
    """
    with guarded(json=json, quiet=quiet):
        from fragfield.studies.sweep import print_sweep

        found = fragfield.run_sweep(
            case, values, out=out, stage=stage, threads=threads, jobs=jobs, resume=resume, overwrite=overwrite,
            scheduler=scheduler, keep_runs=keep_runs, progress=not quiet,
        ).found  # fmt: skip
        give(found, json=json, show=print_sweep)
    raise typer.Exit(found["exit_code"])


@app.command()
def limit(
    case: Varied,
    values: Annotated[
        str,
        typer.Argument(
            metavar="KEY=LOW..HIGH", help="Values of a key by which the number of rounds rises: stack.count=1..20."
        ),
    ],
    distance: Annotated[
        str | None,
        typer.Option("--distance", metavar="LENGTH", help='Distance that is not to be exceeded, such as "300 m".'),
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="Compute every number of rounds, not by bisection.")] = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", parser=file_path, metavar="DIR", help="Folder for the runs; default runs/NAME_limit."),
    ] = None,
    threads: RunThreads = None,
    jobs: Jobs = None,
    resume: ResumeRuns = False,
    overwrite: OverwriteRuns = False,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Find the largest number of rounds for which a case still meets its criteria.

    Every exposed site must meet its criterion, and with --distance the computed and the official distance must not
    exceed it. The smallest and the largest number are computed first, then the interval is halved; each run has a
    folder of its own.

    Exit code 3 where a run failed or has no distance, which counts as not met; 2 if a key or a value is not allowed:
    then nothing runs.
    """
    with guarded(json=json, quiet=quiet):
        from fragfield.studies.limit import print_limit

        found = fragfield.run_limit(
            case, values, distance=distance, every=every, out=out, threads=threads, jobs=jobs, resume=resume,
            overwrite=overwrite, progress=not quiet,
        ).found  # fmt: skip
        give(found, json=json, show=print_limit)
    raise typer.Exit(found["exit_code"])


@app.command()
def uncertainty(
    case: CaseOrRun,
    samples: Annotated[
        int | None,
        typer.Option("--samples", min=8, metavar="N", help="Number of samples; default uncertainty.samples."),
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", min=0, metavar="N", help="Of points and samples; default the case's.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", parser=file_path, metavar="DIR", help="Folder for the study; default runs/NAME_uncertainty."
        ),
    ] = None,
    settings: Settings = None,
    jobs: Annotated[
        int | None, typer.Option("--jobs", min=1, metavar="N", help="Samples at the same time; default all cores.")
    ] = None,
    scheduler: Scheduler = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue the study in DIR; nothing is computed twice.")
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
    with guarded(json=json, quiet=quiet):
        from fragfield.studies.uncertainty.results import print_study

        found = fragfield.run_uncertainty(
            case, out=out, samples=samples, seed=seed, set=settings or (),
            jobs=jobs, scheduler=scheduler, resume=resume, overwrite=overwrite, progress=not quiet,
        ).found  # fmt: skip
        give(found, json=json, show=print_study)
    raise typer.Exit(found["exit_code"])


@app.command("warm-up")
def warm_up(quiet: Quiet = False, json: Json = False) -> None:
    """Compile the kernels, so that the first run does not have to: by two tiny runs, which leave no files.

    What is compiled already is not compiled again. Exit code 3 if one of the runs failed.
    """
    with guarded(json=json, quiet=quiet):
        from fragfield.studies.warm_up import warm_up as made

        found = made()
        give(found, json=json, show=_print_warm_up)
    if found["failures"]:
        raise typer.Exit(EXIT_NUMERICAL)


def _print_warm_up(found: dict[str, Any]) -> None:
    where = found["cache"] or "nowhere, since no folder is safe"
    typer.echo(f"kernels compiled in {found['seconds']:.0f} s, kept in {where}")
    for message in found["failures"]:
        typer.echo(f"a run failed: {message}")
