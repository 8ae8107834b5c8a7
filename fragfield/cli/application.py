"""The command line application, and what is done before each command."""

from __future__ import annotations

from typing import Annotated

import typer

import fragfield
from fragfield.pipeline.parallel import launched_rank

__all__ = ["app"]

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
