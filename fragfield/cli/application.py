"""The command line application, and what is done before each command."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

import fragfield
from fragfield.cli.commands import COMMANDS, GROUPS, STUDIES
from fragfield.cli.declare import LazyCommand, file_path
from fragfield.cli.guard import guarded, to_stdout
from fragfield.pipeline.parallel import launched_rank

_COLLECTIVE = ("run", "burst", "break-up", "fly")
"""Commands that compute on all ranks of an MPI launch."""


class _Commands(TyperGroup):
    """All commands, in the order of their groups."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        known = {**self.commands, **{name: LazyCommand(one) for name, one in COMMANDS.items()}}
        named = {name: group for group, names in GROUPS.items() for name in names}
        order = [*named, *(name for name in known if name not in named)]
        self.commands = {name: known[name] for name in order}
        for name, one in self.commands.items():
            group = "Studies of many runs" if name in STUDIES else "A case and its result"
            one.rich_help_panel = named.get(name, group)  # type: ignore[attr-defined]

    def list_commands(self, ctx: typer.Context) -> list[str]:  # type: ignore[override]
        """In the order of their use."""
        del ctx
        return list(self.commands)


app = typer.Typer(
    name="fragfield",
    cls=_Commands,
    help="Hazard distances of the fragments of cased charges, for explosives safety: burst, break-up, flight, report.",
    no_args_is_help=True,
    rich_markup_mode="markdown",  # paragraphs fill the width, and what stands in brackets is shown
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


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
    if context.invoked_subcommand not in _COLLECTIVE and launched_rank() > 0:
        raise typer.Exit  # the first rank does it alone


@app.command("help")
def help_(
    command: Annotated[str | None, typer.Argument(metavar="COMMAND", help="Of which command; default all.")] = None,
) -> None:
    """Print what --help prints, of a command or of all."""
    app([*([command] if command else []), "--help"], prog_name=app.info.name)


@app.command("app")
def open_pages(
    case: Annotated[
        Path | None,
        typer.Argument(
            parser=file_path, metavar="[CASE | RUN]", help="A case file, a run, or a folder; default: this one."
        ),
    ] = None,
    port: Annotated[int, typer.Option("--port", min=0, max=65535, metavar="N", help="Default: a free one.")] = 0,
    host: Annotated[
        str, typer.Option("--host", metavar="ADDRESS", help="Address to listen at; in a container 0.0.0.0.")
    ] = "127.0.0.1",
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the default browser.")] = True,
) -> None:
    """Work on a case in the browser: draw the round, arrange the site, run, read the result; all on this machine."""
    with guarded(json=False, quiet=False):
        from fragfield.app.server import serve

        serve(case or Path.cwd(), announce=_announce, host=host, port=port, browser=browser)


def _announce(words: str) -> None:
    """Print the address at once: the command goes on."""
    with to_stdout():
        typer.echo(words)
