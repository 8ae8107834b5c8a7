"""Commands for tables: those of tests in, those of a run out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import fragfield
from fragfield.cli.application import Json, Quiet, app, file_path
from fragfield.cli.guard import give, guarded, print_paths

if TYPE_CHECKING:
    from collections.abc import Sequence


@app.command(name="import")
def import_(
    file: Annotated[
        Path,
        typer.Argument(parser=file_path, metavar="FILE", help="Table of a test: CSV, XLSX, ODS."),
    ],
    kind: Annotated[
        str | None,
        typer.Option("--kind", metavar="KIND", help="arena or pit; default: as its columns show."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", parser=file_path, metavar="FILE", help="File for the case; default: show only what was found."
        ),
    ] = None,
    column: Annotated[
        list[str] | None,
        typer.Option(
            "--column",
            metavar="QUANTITY=NAME",
            help='Column of a quantity by name or number; repeatable: mass="Weight (g)".',
        ),
    ] = None,
    unit: Annotated[
        list[str] | None,
        typer.Option(
            "--unit",
            metavar="QUANTITY=UNIT",
            help="Unit of a quantity, or of all masses, speeds, angles; repeatable: mass=g.",
        ),
    ] = None,
    encoding: Annotated[
        str | None,
        typer.Option("--encoding", metavar="NAME", help="Of a text: utf-8, cp1252, mac_roman ..."),
    ] = None,
    separator: Annotated[
        str | None,
        typer.Option("--separator", metavar="NAME", help="Between cells: comma, semicolon, tab, bar."),
    ] = None,
    decimal: Annotated[
        str | None,
        typer.Option("--decimal", metavar="SIGN", help="Of the numbers of a text: point or comma."),
    ] = None,
    sheet: Annotated[
        str | None,
        typer.Option("--sheet", metavar="NAME", help="Sheet of a workbook, by name or number."),
    ] = None,
    rows: Annotated[
        str | None,
        typer.Option("--rows", metavar="LINES", help="Lines of the table with its names: 3:18 or 3:18,22:30."),
    ] = None,
    rounds: Annotated[
        float | None,
        typer.Option(
            "--rounds", metavar="N", help="Rounds that the numbers are of together; 0.25: a quarter of the azimuth."
        ),
    ] = None,
    zone_width: Annotated[
        float,
        typer.Option("--zone-width", metavar="DEGREES", help="Of the zones that single pieces are put into."),
    ] = 5.0,
    zone_angle: Annotated[
        str | None,
        typer.Option("--zone-angle", metavar="WHAT", help="What the one angle of a zone is: from, centre or to."),
    ] = None,
    from_base: Annotated[
        bool,
        typer.Option("--from-base", help="Angles of an arena table count from the base, not the nose."),
    ] = False,
    empty_zones: Annotated[bool, typer.Option("--empty-zones", help="Zones without a row hold no fragment.")] = False,
    case: Annotated[
        Path | None,
        typer.Option("--case", parser=file_path, metavar="CASE", help="Compare the mass with the casing of this case."),
    ] = None,
    casing_mass: Annotated[
        str | None,
        typer.Option("--casing-mass", metavar='"12.1 kg"', help="Compare the mass with that of the casing."),
    ] = None,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Read a table of a test as it is, show what was found in it, and write it as a case reads it."""
    with guarded(json=json, quiet=quiet):
        found = fragfield.import_table(
            file, kind, columns=_pairs("column", column), units=_pairs("unit", unit), encoding=encoding,
            separator=separator, decimal=decimal, sheet=sheet, rows=rows, number_of_rounds=rounds,
            zone_width=zone_width, zone_angle=zone_angle, from_base=from_base, empty_zones=empty_zones, case=case,
            casing_mass=casing_mass,
        )  # fmt: skip
        written = None if out is None else str(found.write(out))
        plain = {
            "kind": found.kind, "file": str(file), "written": written,
            "found": [one._asdict() for one in found.guesses], "left_out": found.dropped, "summary": found.summary,
        }  # fmt: skip
        give(plain | {"text": str(found)}, json=json, show=_show)


def _pairs(option: str, texts: Sequence[str] | None) -> dict[str, str]:
    pairs = {}
    for text in texts or ():
        name, mark, value = text.partition("=")
        if not mark or not value.strip():
            raise fragfield.InputError(
                f"--{option} {text}: found no value; allowed: QUANTITY=VALUE, as --{option} mass=..."
            )
        pairs[name.strip()] = value.strip().strip('"')
    return pairs


def _show(found: dict[str, Any]) -> None:
    typer.echo(found["text"])
    if found["written"]:
        typer.echo(f"written to {found['written']}")
    else:
        typer.echo("nothing written; --out FILE writes it")


@app.command()
def tables(
    run: Annotated[Path, typer.Argument(parser=file_path, metavar="RUN", help="The directory of a run.")],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", parser=file_path, metavar="FILE", help="Workbook to write (.xlsx); default: NAME_tables.xlsx here."
        ),
    ] = None,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Write all tables of a run into one workbook, the first sheet of which says what they are."""
    with guarded(json=json, quiet=quiet):
        found = fragfield.open(run)
        written = found.write_tables(out or f"{found.path.resolve().name}_tables.xlsx")
        give({"workbook": [str(written)]}, json=json, show=print_paths)
