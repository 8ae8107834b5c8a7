"""Commands from public functions: a command's arguments, options and their words are those of the function.

A positional parameter without a default is an argument, any other an option. What each means is read in the numpydoc
section "Parameters", without the sentences on Python; its name and metavar come from its kind
(`fragfield.interface.kinds`). A command adds `--quiet` and `--json`, and where the function follows progress,
`--progress-file`. The modules of functions are loaded for the command that is called alone.
"""

from __future__ import annotations

import inspect
import re
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, get_args

import typer
from typer.core import TyperCommand

from fragfield.cli.guard import give, guarded
from fragfield.errors import InputError
from fragfield.interface.kinds import Kind
from fragfield_base.paths import absolute

_SECTION = re.compile(r"^Parameters\n-+\n(.*?)(?=^\w[^\n]*\n-+\n|\Z)", re.DOTALL | re.MULTILINE)
_ENTRY = re.compile(r"^([\w, ]+?) ?(?::[^\n]*)?\n((?:[ ]+[^\n]*\n?|\n)+)", re.MULTILINE)
_OF_PYTHON = re.compile(r"(?:^|(?<=[.;])) *[^.;]*\b(?:Python|pint)\b(?:[^.`]|`[^`]*`|\.(?=\w))*[.;]?")
_QUIET = typer.Option("--quiet", "-q", help="No progress and no warnings; the result alone.")
_JSON = typer.Option("--json", help="One JSON object on stdout, and nothing else.")


@dataclass
class Call:
    """A call of a command."""

    quiet: bool
    json: bool
    began: float = field(default_factory=time.monotonic)


@dataclass
class Given:
    """What a command gives."""

    found: dict[str, Any]
    """As `--json` prints it."""
    show: Callable[[dict[str, Any]], None]
    """Prints it as text."""
    exit_code: int = 0


@dataclass
class Command:
    """A command."""

    name: str
    help: str
    target: str | None
    """The public function, as "module:name"; None: there is none."""
    give: Callable[..., Given | None]
    """What is given of the `Call` and of the function's result; its other parameters are the command's own."""
    leave_out: tuple[str, ...] = ()
    """Parameters of the function that are no options."""
    fixed: Mapping[str, Any] = field(default_factory=dict)
    """Their values where these are not the defaults."""

    def build(self) -> TyperCommand:
        """The command with its options."""
        target = None
        if self.target is not None:
            module, _, name = self.target.partition(":")
            target = getattr(import_module(module), name)
        left_out = {*self.leave_out, *self.fixed}
        of_target = {one.name: one for one in _parameters(target) if one.name not in left_out} if target else {}
        own = {one.name: one for one in _parameters(self.give, skip=2 if target else 1)}
        follows = of_target.pop("progress", None)
        parameters = [*of_target.values(), *own.values()]
        if follows is not None and _kind(follows.annotation) is not None:
            words = "Keep the progress there as JSON, for another program."
            file = typer.Option("--progress-file", parser=file_path, metavar="FILE", help=words)
            parameters.append(_option("progress_file", Path | None, None, file))
        parameters += [_option("quiet", bool, False, _QUIET), _option("json", bool, False, _JSON)]

        def call(**given: Any) -> None:
            made = Call(given.pop("quiet"), given.pop("json"))
            file = given.pop("progress_file", None)
            if follows is not None:
                given["progress"] = not made.quiet if file is None else _into_file(file)
            given = {name: value for name, value in given.items() if value is not None}
            of_command = {name: given.pop(name) for name in own if name in given}
            with guarded(json=made.json, quiet=made.quiet):
                results = [] if target is None else [target(**given, **self.fixed)]
                printed = self.give(made, *results, **of_command)
                if printed is not None:
                    give(printed.found, json=made.json, show=printed.show)
            if printed is not None and printed.exit_code:
                raise typer.Exit(printed.exit_code)

        order = sorted(parameters, key=lambda one: one.default is not inspect.Parameter.empty)
        call.__signature__ = inspect.Signature(order)  # type: ignore[attr-defined]
        call.__annotations__ = {one.name: one.annotation for one in order}
        alone = typer.Typer(add_completion=False, rich_markup_mode="markdown", pretty_exceptions_enable=False)
        alone.command(self.name, help=self.help)(call)
        made = typer.main.get_command(alone)
        assert isinstance(made, TyperCommand)
        return made


class LazyCommand(TyperCommand):
    """A command whose options are known once they are asked for."""

    def __init__(self, command: Command) -> None:
        self._command = command
        self._built: TyperCommand | None = None
        super().__init__(name=command.name, help=command.help, rich_markup_mode="markdown")

    def _whole(self) -> TyperCommand:
        if self._built is None:
            self._built = self._command.build()
        return self._built

    @property
    def params(self) -> Any:  # noqa: ANN401 - click's
        """Arguments and options."""
        return self._whole().params

    @params.setter
    def params(self, value: object) -> None:
        del value

    @property
    def callback(self) -> Any:  # noqa: ANN401 - click's
        """What is done."""
        return self._whole().callback

    @callback.setter
    def callback(self, value: object) -> None:
        del value


def file_path(text: str) -> Path:
    """A file or folder as it was typed, absolute; one that cannot be is refused once it is used."""
    try:
        return absolute(text, InputError)
    except InputError:
        if not text:
            raise
        return Path(text)


def _into_file(file: Path) -> Callable[[Any], None]:
    from fragfield.terminal.progress import into_file

    return into_file(file)


def _kind(annotation: Any) -> Kind | None:  # noqa: ANN401 - a type
    """The kind among the marks of a type, within `| None` as well."""
    found = [mark for mark in getattr(annotation, "__metadata__", ()) if isinstance(mark, Kind)]
    return found[0] if found else next(filter(None, map(_kind, get_args(annotation))), None)


def words_of(target: Any) -> dict[str, str]:  # noqa: ANN401 - a function or a class
    """What each parameter means, by the docstring of a function, or those of a class and its bases."""
    found: dict[str, str] = {}
    study = getattr(target, "name", "")
    for one in reversed(getattr(target, "__mro__", (target,))):
        section = _SECTION.search(inspect.cleandoc(one.__doc__ or ""))
        for names, text in _ENTRY.findall(f"{section[1]}\n") if section else ():
            words = _OF_PYTHON.sub("", " ".join(text.split())).strip(" ;").replace("_STUDY", f"_{study}")
            words += "" if words.endswith(".") or not words else "."
            found |= {name.strip(): words for name in names.split(",")}
    return found


def _hint(source: Any, name: str) -> Any:  # noqa: ANN401 - a type
    """The type of a parameter, by the function, or by the class or the base that declares it."""
    owner = next(one for one in getattr(source, "__mro__", (source,)) if name in one.__annotations__)
    return eval(owner.__annotations__[name], vars(sys.modules[owner.__module__]))


def _parameters(target: Any, skip: int = 0) -> Iterator[inspect.Parameter]:  # noqa: ANN401 - a function
    """The parameters of a function as arguments and options of a command."""
    source = inspect.unwrap(target)
    words = words_of(source)
    for one in list(inspect.signature(target).parameters.values())[skip:]:
        hint, default, text = _hint(source, one.name), one.default, words.get(one.name, "")
        kind = _kind(hint) or Kind(bool if hint is bool else str, "")
        if one.name == "progress":
            yield one.replace(annotation=hint)  # becomes `--quiet`
            continue
        more: dict[str, Any] = {"help": text or None, "metavar": kind.metavar or None}
        if kind.read is Path:
            more["parser"] = file_path
        if kind.minimum is not None:
            more |= {"min": kind.minimum, "max": kind.maximum}
        read: Any = list[str] if kind.read is list else kind.read
        if default is inspect.Parameter.empty:
            argument = Annotated[read, typer.Argument(**more)]
            yield inspect.Parameter(one.name, inspect.Parameter.KEYWORD_ONLY, annotation=argument)
            continue
        if kind.read is bool:
            del more["metavar"]
        option = typer.Option(kind.option or f"--{one.name.rstrip('_').replace('_', '-')}", **more)
        empty = default in (None, ())  # an option that may be repeated is None where it is not given
        yield _option(one.name, read | None if empty else read, None if empty else default, option)


def _option(name: str, kind: Any, default: Any, option: Any) -> inspect.Parameter:  # noqa: ANN401 - typer's
    return inspect.Parameter(
        name, inspect.Parameter.KEYWORD_ONLY, annotation=Annotated[kind, option], default=default
    )  # fmt: skip
