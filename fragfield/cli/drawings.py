"""The command that turns drawings and maps of others into tables of a case."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

import fragfield
from fragfield.cli.application import Json, Quiet, app, file_path
from fragfield.cli.guard import give, guarded


@app.command()
def convert(
    file: Annotated[
        Path,
        typer.Argument(
            parser=file_path,
            metavar="FILE",
            help="Drawing (.dxf), table of diameters, or map (.geojson, .kml, .kmz).",
        ),
    ],
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="How it is read: a key of round.contour or site.places."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", parser=file_path, metavar="FILE", help="File to write (.toml); default: show it."),
    ] = None,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Turn a drawing into the file of a profile, or a map of places into tables [[exposed]] and [[obstacle]].

    A map needs where the site is: --set latitude="51.5 deg" --set longitude="7 deg" --set bearing="90 deg".
    """
    with guarded(json=json, quiet=quiet):
        found = fragfield.convert(file, set=settings or ())
        written = None if out is None else str(found.write(out))
        plain = {"kind": found.kind, "written": written, "notes": found.notes, "tables": found.tables}
        give(plain | {"text": found.to_toml()}, json=json, show=_show)


def _show(found: dict[str, Any]) -> None:
    if not found["written"]:
        typer.echo(found["text"], nl=False)
        return
    for note in found["notes"]:
        typer.echo(note)
    typer.echo(f"written to {found['written']}")
