"""The commands: for each the public function behind it, and what is given of its result.

A study is a command by its file in `fragfield/studies`: the head of the file is its help.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from fragfield.cli.declare import Call, Command, Given
from fragfield.cli.guard import print_paths
from fragfield.errors import EXIT_DONE, EXIT_NUMERICAL, InputError
from fragfield.interface.kinds import CaseOrRun, File, Kind, PathName, RunFolder
from fragfield.pipeline.parallel import launched_rank
from fragfield_base.paths import absolute, shown

if TYPE_CHECKING:
    from fragfield.importing.table import ImportedTable
    from fragfield.interface.checking import CheckResult, Converted
    from fragfield.interface.results import Run

COMMANDS: dict[str, Command] = {}
GROUPS = {
    "A case and its result": ("new", "check", "run", "report", "view", "tables", "info", "app"),
    "Files of others": ("convert", "import"),
    "Studies of many runs": ("sweep", "limit", "uncertainty"),
    "Stages of a run": ("burst", "break-up", "fly"),
    "This machine": ("warm-up", "help"),
}
"""Commands in the order of their use; others follow in the group of a case or of the studies."""

Function = TypeVar("Function", bound=Callable[..., Given | None])


def command(target: str | None = None, leave_out: str = "", **fixed: object) -> Callable[[Function], Function]:
    """Declare what a command gives of the result of a function; its name and words are those of the declaration."""

    def declare(function: Function) -> Function:
        name = function.__name__.rstrip("_").replace("_", "-")
        head = (function.__doc__ or "").partition("Parameters\n")[0]
        words = "\n\n".join(" ".join(part.split()) for part in head.strip().split("\n\n"))
        COMMANDS[name] = Command(name, words, target, function, tuple(leave_out.split()), fixed)
        return function

    return declare


_RUN = "fragfield.interface.running:run"


@command()
def new(
    call: Call,
    name: Annotated[PathName, Kind(Path, "NAME")],
    *,
    round_: Annotated[str, Kind(str, "PROFILE", "--round")] = "m107",
    explosive: str = "tnt",
    casing: str | None = None,
    stack: Annotated[str | None, Kind(str, "ARRANGEMENT")] = None,
    lying: bool = False,
) -> Given:
    """Write a commented case file to start from.

    Parameters
    ----------
    name : path
        The file to write: NAME.toml.
    round_ : str
        Built-in contour of the round.
    explosive : str
        Built-in explosive, by any of its names.
    casing : str
        Built-in casing material; default: the round's.
    stack : str
        Arrangement of copies: row, triangle, pallet.
    lying : bool
        The round lies on the ground, its axis along y.
    """
    from fragfield.case.new_case import write_new_case

    del call
    written = write_new_case(absolute(name, InputError), round_, explosive, casing=casing, stack=stack, lying=lying)
    return Given({"case": [str(written)]}, print_paths)


@command("fragfield.interface.checking:check")
def check(call: Call, done: CheckResult, *, drawing: File | None = None, resolved: bool = False) -> Given:
    """Read a case, print its masses, speeds, mesh and cost, and warn of what may be wrong.

    With --fragments, whether that file fits the case, as `fly` will take it; such a case needs no burst.

    Parameters
    ----------
    drawing : path
        Write a dimensioned drawing of each different round: .svg.
    resolved : bool
        Print the case as well, with every default, in everyday units.
    """
    from fragfield.checking.show import print_check
    from fragfield.results.part import to_json, with_texts
    from fragfield.terminal.logs import visible

    del call
    drawn = [] if drawing is None else [str(path) for path in done.draw(drawing)]

    def show(_: dict[str, Any]) -> None:
        found = with_texts(done.found, lambda text: str(visible(shown(text))))
        print_check(found, done.case.values if resolved else None, drawings=shown(drawn))

    return Given(to_json(done.found) | ({"drawings": drawn} if drawn else {}), show)


@command(_RUN, "only fragments")
def run(call: Call, done: Run) -> Given | None:
    """Run the whole chain: burst, break-up, flight, report."""
    from fragfield.terminal.progress import duration

    if not call.quiet and launched_rank() == 0:
        typer.echo(f"fragfield: done in {duration(time.monotonic() - call.began)}", err=True)
    return _summary(done, flown=True, warnings=done.warnings)


@command(_RUN, "fragments", only="burst")
def burst(call: Call, done: Run) -> Given | None:
    """Compute the detonation and the acceleration of the casings."""
    del call
    return _summary(done)


@command(_RUN, "fragments resume overwrite", only="break-up")
def break_up(call: Call, done: Run) -> Given | None:
    """Break the casings of a computed burst into fragments."""
    del call
    return _summary(done)


@command(_RUN, "resume overwrite", only="fly")
def fly(call: Call, done: Run) -> Given | None:
    """Fly the fragments of a run, or of a file, to the ground."""
    del call
    return _summary(done, flown=True)


@command(_RUN, "set fragments threads resume overwrite", only="report")
def report(call: Call, done: Run) -> Given | None:
    """Write the report of a run, report.html."""
    del call
    return _summary(done)


def _summary(done: Run, *, flown: bool = False, warnings: Sequence[str] = ()) -> Given | None:
    """The summary of a run, on the first rank; one that was flown and has no distance ends with code 3."""
    from fragfield.results.part import to_json
    from fragfield.terminal.show import plain_console, print_summary

    if launched_rank() > 0:
        return None
    summary = done.summary
    undetermined = flown and summary.hazard is not None and not summary.hazard.determined

    def show(_: dict[str, Any]) -> None:
        print_summary(summary, str(done.path))
        for words in warnings:
            plain_console().print(words)

    found = {"directory": str(done.path), **to_json(summary)}
    return Given(found, show, EXIT_NUMERICAL if undetermined else EXIT_DONE)


@command("fragfield.interface.checking:convert")
def convert(call: Call, done: Converted, *, out: File | None = None) -> Given:
    """Turn a drawing into the file of a profile, or a map of places into tables [[exposed]] and [[obstacle]].

    A map needs where the site is: --set latitude="51.5 deg" --set longitude="7 deg" --set bearing="90 deg".

    Parameters
    ----------
    out : path
        File to write (.toml); default: show it.
    """
    del call
    written = None if out is None else str(done.write(out))

    def show(found: dict[str, Any]) -> None:
        if written is None:
            typer.echo(found["text"], nl=False)
            return
        for line in (*found["notes"], f"written to {found['written']}"):
            typer.echo(line)

    found = {"kind": done.kind, "written": written, "notes": done.notes, "tables": done.tables}
    return Given(found | {"text": done.to_toml()}, show)


@command("fragfield.importing.table:import_table")
def import_(call: Call, done: ImportedTable, *, out: File | None = None) -> Given:
    """Read a table of a test as it is, show what was found in it, and write it as a case reads it.

    Parameters
    ----------
    out : path
        File for the case; default: show only what was found.
    """
    del call
    written = None if out is None else str(done.write(out))

    def show(found: dict[str, Any]) -> None:
        typer.echo(found["text"])
        typer.echo(f"written to {found['written']}" if found["written"] else "nothing written; --out FILE writes it")

    found = {
        "kind": done.kind, "file": str(done.source), "written": written,
        "found": [one._asdict() for one in done.guesses], "left_out": done.dropped, "summary": done.summary,
    }  # fmt: skip
    return Given(found | {"text": str(done)}, show)


@command()
def view(call: Call, run: CaseOrRun) -> Given:
    """Write pictures of a run, the burst at two times and the fragments; ParaView opens its .xdmf files.

    Parameters
    ----------
    run : path
        A case file, or the directory of a run.
    """
    from fragfield.interface.running import options_of
    from fragfield.view import view_run

    del call
    written = view_run(options_of(run).source.path)
    return Given({"pictures": [str(path) for path in written]}, print_paths)


@command()
def tables(call: Call, run: RunFolder, *, out: File | None = None) -> Given:
    """Write the results in numbers and all tables of a run into one workbook.

    Parameters
    ----------
    run : path
        The directory of a run.
    out : path
        Workbook to write (.xlsx); default: NAME_tables.xlsx here.
    """
    from fragfield.interface.results import open as open_run

    del call
    done = open_run(run)
    written = done.write_tables(out or f"{done.path.resolve().name}_tables.xlsx")
    return Given({"workbook": [str(written)]}, print_paths)


@command()
def info(call: Call, path: Annotated[PathName, Kind(Path, "RUN_OR_FILE")]) -> Given:
    """Say what a run directory or an HDF5 file holds and where it comes from.

    Parameters
    ----------
    path : path
        The directory of a run, or one of its files.
    """
    from fragfield.files.provenance import describe
    from fragfield.terminal.show import print_info

    del call
    return Given(describe(absolute(path, InputError)), print_info)


@command("fragfield.studies.warm_up:warm_up")
def warm_up(call: Call, found: dict[str, Any]) -> Given:
    """Compile the kernels, so that the first run does not have to: by two tiny runs, which leave no files.

    What is compiled already is not compiled again. Exit code 3 if one of the runs failed.
    """
    del call

    def show(found: dict[str, Any]) -> None:
        where = found["cache"] or "nowhere, since no folder is safe"
        typer.echo(f"kernels compiled in {found['seconds']:.0f} s, kept in {where}")
        for message in found["failures"]:
            typer.echo(f"a run failed: {message}")

    return Given(found, show, EXIT_NUMERICAL if found["failures"] else EXIT_DONE)


def _of_study(call: Call, study: Any) -> Given:  # noqa: ANN401 - a `Study`, not loaded for it
    del call
    from fragfield.results.part import to_json

    return Given(to_json(study.found), lambda _: study.print(), study.exit_code)


def studies() -> Iterator[Command]:
    """The commands of the studies, from the heads of their files."""
    for entry in sorted(resources.files("fragfield.studies").iterdir(), key=lambda one: one.name):
        file = entry / "study.py" if entry.is_dir() else entry
        text = file.read_text(encoding="utf-8") if file.is_file() else ""
        name = entry.name.removesuffix(".py")
        if f"\nrun_{name} = maker(" in text:
            module = f"fragfield.studies.{name}{'.study' if entry.is_dir() else ''}"
            help_text = text.split('"""')[1].strip()
            yield Command(name, help_text, f"{module}:run_{name}", _of_study)


STUDIES = {one.name: one for one in studies()}
COMMANDS |= STUDIES
