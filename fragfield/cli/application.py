"""The command line application, and what is done before each command."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import fragfield
from fragfield.errors import InputError
from fragfield.pipeline.parallel import launched_commands, launched_rank
from fragfield_base.paths import absolute

app = typer.Typer(
    name="fragfield",
    help="Hazard distances of the fragments of cased charges, for explosives safety: burst, break-up, flight, report.",
    no_args_is_help=True,
    rich_markup_mode="markdown",  # paragraphs fill the width, and what stands in brackets is shown
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

_COLLECTIVE = ("run", "burst", "break-up", "fly")
"""Commands that compute on all ranks of an MPI launch."""


def file_path(text: str) -> Path:
    """A file or folder as it was typed, absolute; one that cannot be is refused once it is used."""
    try:
        return absolute(text, InputError)
    except InputError:
        if not text:
            raise
        return Path(text)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"fragfield {fragfield.__version__}")
        raise typer.Exit


@app.callback()
def _common(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", "-V", callback=_show_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    del version
    if context.invoked_subcommand in _COLLECTIVE:
        return
    if launched_commands() > 1:
        raise InputError(
            f"{context.invoked_subcommand}: found {launched_commands()} different commands in one MPI launch, of which "
            "only that of rank 0 would be done; allowed: one launch each"
        )
    if launched_rank() > 0:
        raise typer.Exit  # the first rank does it alone


@app.command("help")
def help_(
    command: Annotated[str | None, typer.Argument(metavar="COMMAND", help="Of which command; default all.")] = None,
) -> None:
    """Print what --help prints, of a command or of all."""
    app([*([command] if command else []), "--help"], prog_name=app.info.name)


CaseOrRun = Annotated[
    Path, typer.Argument(parser=file_path, metavar="CASE_OR_RUN", help="A case file, or the directory of a run.")
]
Out = Annotated[
    Path | None,
    typer.Option("--out", parser=file_path, metavar="DIR", help="Run directory; default runs/NAME, or the run itself."),
]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Replaces a value of the case, by its dotted key; repeatable."),
]
Threads = Annotated[int | None, typer.Option("--threads", min=1, metavar="N", help="Threads of each rank.")]
Resume = Annotated[bool, typer.Option("--resume", help="Continue an interrupted run of the same case.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace another case's run in DIR.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress and no warnings; the result alone.")]
Json = Annotated[bool, typer.Option("--json", help="One JSON object on stdout, and nothing else.")]
ProgressFile = Annotated[
    Path | None,
    typer.Option(
        "--progress-file",
        parser=file_path,
        metavar="FILE",
        help="Keep the progress there as JSON, for another program.",
    ),
]
Resolved = Annotated[
    bool, typer.Option("--resolved", help="Print the case as well, with every default, in everyday units.")
]
Drawing = Annotated[
    Path | None,
    typer.Option(
        "--drawing",
        parser=file_path,
        metavar="FILE",
        help="Write a dimensioned drawing of each different round: .svg.",
    ),
]
FragmentsFile = Annotated[
    Path | None,
    typer.Option(
        "--fragments",
        parser=file_path,
        metavar="FILE",
        help="Fly these fragments (.h5, .csv, or an arena table), not the run's.",
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option("--scheduler", metavar="ADDRESS", help="Run on the workers of this dask scheduler: tcp://node1:8786."),
]
