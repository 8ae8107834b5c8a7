"""Commands that show and compare results, and write a new case."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fragfield.cli.application import CaseOrRun, Json, Quiet, app, file_path
from fragfield.cli.guard import give, guarded, print_paths
from fragfield.cli.streams import to_stdout
from fragfield.errors import InputError
from fragfield_base.paths import absolute, start_folder


@app.command()
def view(
    run: CaseOrRun,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Write pictures of a run, the burst at two times and the fragments; ParaView opens its .xdmf files."""
    with guarded(json=json, quiet=quiet):
        from fragfield.interface.running import options_of
        from fragfield.view import view_run

        written = view_run(options_of(run).source.path)
        give({"pictures": [str(path) for path in written]}, json=json, show=print_paths)


@app.command()
def info(
    path: Annotated[
        Path,
        typer.Argument(parser=file_path, metavar="RUN_OR_FILE", help="The directory of a run, or one of its files."),
    ],
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Say what a run directory or an HDF5 file holds and where it comes from."""
    with guarded(json=json, quiet=quiet):
        from fragfield.files.provenance import describe
        from fragfield.terminal.show import print_info

        give(describe(absolute(path, InputError)), json=json, show=print_info)


@app.command()
def new(
    name: Annotated[Path, typer.Argument(parser=file_path, metavar="NAME", help="The file to write: NAME.toml.")],
    round_: Annotated[str, typer.Option("--round", metavar="PROFILE", help="Built-in contour of the round.")] = "m107",
    explosive: Annotated[
        str, typer.Option("--explosive", metavar="NAME", help="Built-in explosive, by any of its names.")
    ] = "tnt",
    casing: Annotated[
        str | None, typer.Option("--casing", metavar="NAME", help="Built-in casing material; default: the round's.")
    ] = None,
    stack: Annotated[
        str | None, typer.Option("--stack", metavar="ARRANGEMENT", help="Arrangement of copies: row, triangle, pallet.")
    ] = None,
    lying: Annotated[bool, typer.Option("--lying", help="The round lies on the ground, its axis along y.")] = False,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Write a commented case file to start from."""
    with guarded(json=json, quiet=quiet):
        from fragfield.case.new_case import write_new_case

        written = write_new_case(absolute(name, InputError), round_, explosive, casing=casing, stack=stack, lying=lying)
        give({"case": [str(written)]}, json=json, show=print_paths)


@app.command()
def compare(
    run: Annotated[
        Path, typer.Argument(parser=file_path, metavar="RUN", help="Directory of a run, such as that of a pair.")
    ],
    reference: Annotated[
        Path, typer.Argument(parser=file_path, metavar="RUN", help="The reference run, such as the single round's.")
    ],
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Divide the results of one run by those of another, after the inputs in which they differ."""
    with guarded(json=json, quiet=quiet):
        from fragfield.studies.ratios import inputs_that_differ, print_ratios, ratios

        folders = [absolute(folder, InputError) for folder in (run, reference)]
        found = {"differences": inputs_that_differ(*folders), "ratios": ratios(*folders)}
        give(found, json=json, show=print_ratios)


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

        start = case or start_folder(InputError)
        serve(start, announce=_announce, host=host, port=port, browser=browser)


def _announce(words: str) -> None:
    """Print the address at once: the command goes on."""
    with to_stdout():
        typer.echo(words)
