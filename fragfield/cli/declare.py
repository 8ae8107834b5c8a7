"""Commands from public functions: a command's arguments, options and their words are those of the function.

A positional parameter without a default is an argument, any other an option. What each means is read in the numpydoc
section "Parameters", without the sentences on Python; its name and metavar come from its kind
(`fragfield.interface.kinds`). A command adds `--quiet` and `--json`, and where the function follows progress,
`--progress-file`. The function's module is loaded once the command is called.
"""

from __future__ import annotations

import inspect
import re
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, get_args, get_type_hints

import typer
from typer.core import TyperCommand

from fragfield.cli.guard import give, guarded
from fragfield.errors import InputError
from fragfield.interface.kinds import Kind
from fragfield_base.paths import absolute

_SECTION = re.compile(r"^Parameters\n-+\n(.*?)(?=^\w[^\n]*\n-+\n|\Z)", re.DOTALL | re.MULTILINE)
_ENTRY = re.compile(r"^([\w, ]+?) ?(?::[^\n]*)?\n((?:[ ]+[^\n]*\n?|\n)+)", re.MULTILINE)
_OF_PYTHON = re.compile(r"(?:^|(?<=[.;])) *[^.;]*\b(?:Python|pint)\b(?:[^.`]|`[^`]*`|\.(?=\w))*[.;]?")
_OF_A_GIVER = ("call", "done", "found", "study")
"""What it is called with."""
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
        module, _, name = (self.target or "").partition(":")
        function = getattr(import_module(module), name) if module else None
        declared = _options(function) if function else ()
        options = {one.name: one for one in declared if one.name not in {*self.leave_out, *self.fixed}}
        follows = options.pop("progress", None)
        own = {one.name: one for one in _options(self.give)}
        parameters = [one.parameter for one in (*options.values(), *own.values())]
        if follows is not None and follows.kind.option:
            words = "Keep the progress there as JSON, for another program."
            parameters.append(_Option("progress_file", follows.kind, None, words).parameter)
        parameters += [_keyword("quiet", bool, False, _QUIET), _keyword("json", bool, False, _JSON)]
        parameters.sort(key=lambda one: one.default is not inspect.Parameter.empty)

        def call(**given: Any) -> None:
            made = Call(given.pop("quiet"), given.pop("json"))
            file = given.pop("progress_file", None)
            given = {name: value for name, value in given.items() if value is not None}
            if follows is not None:
                given["progress"] = not made.quiet if file is None else _into_file(file)
            of_command = {name: given.pop(name) for name in own if name in given}
            with guarded(json=made.json, quiet=made.quiet):
                for name in given:
                    if name in options and options[name].kind.read is dict:
                        given[name] = _pairs(options[name].kind.option, given[name])
                results = [function(**given, **self.fixed)] if function else []
                printed = self.give(made, *results, **of_command)
                if printed is not None:
                    give(printed.found, json=made.json, show=printed.show)
            if printed is not None and printed.exit_code:
                raise typer.Exit(printed.exit_code)

        call.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        call.__annotations__ = {one.name: one.annotation for one in parameters}
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


def _pairs(option: str, texts: list[str]) -> dict[str, str]:
    pairs = {}
    for text in texts:
        name, mark, value = text.partition("=")
        if not mark or not value.strip():
            raise InputError(f"{option} {text}: found no value; allowed: QUANTITY=VALUE, as {option} mass=...")
        pairs[name.strip()] = value.strip().strip('"')
    return pairs


def _into_file(file: Path) -> Callable[[Any], None]:
    from fragfield.terminal.progress import into_file

    return into_file(file)


def _kind(hint: Any, name: str) -> Kind:  # noqa: ANN401 - a type
    """The kind among the marks of a type, within `| None` as well; else that of a plain type."""
    for one in (hint, *get_args(hint)):
        found = [mark for mark in getattr(one, "__metadata__", ()) if isinstance(mark, Kind)]
        if found:
            return found[0]
    return Kind(next(one for one in (bool, str, float) if one in (hint, *get_args(hint))), name.upper())


def _options(function: Callable[..., Any]) -> Iterator[_Option]:
    """The parameters of a function, or of the class that `maker` makes it of."""
    home = getattr(function, "__wrapped__", function)
    texts, words = [inspect.getdoc(one) for one in reversed(getattr(home, "__mro__", (home,)))], dict[str, str]()
    for section in (_SECTION.search(text or "") for text in texts):
        for names, entry in _ENTRY.findall(f"{section[1]}\n") if section else ():
            meaning = _OF_PYTHON.sub("", " ".join(entry.split())).strip(" ;")
            meaning = meaning.replace("_STUDY", f"_{function.__name__.removeprefix('run_')}")
            meaning += "" if meaning.endswith(".") or not meaning else "."
            words |= {one.strip(): meaning for one in names.split(",")}
    hints = get_type_hints(home, include_extras=True) if isinstance(home, type) else {}
    for name, one in inspect.signature(function).parameters.items():
        if name not in _OF_A_GIVER:
            hint = hints.get(name) or eval(one.annotation, function.__globals__)
            yield _Option(name, _kind(hint, name), one.default, words.get(name, ""))


@dataclass
class _Option:
    name: str
    kind: Kind
    default: Any
    words: str

    @property
    def parameter(self) -> inspect.Parameter:
        """As an argument or an option of typer."""
        kind, default = self.kind, self.default
        more: dict[str, Any] = {"help": self.words or None}
        if kind.read is not bool:
            more["metavar"] = kind.metavar
        if kind.read is Path:
            more["parser"] = file_path
        if kind.minimum is not None:
            more["min"] = kind.minimum
        read: Any = list[str] if kind.read in (list, dict) else kind.read
        if default is inspect.Parameter.empty:
            return _keyword(self.name, read, default, typer.Argument(**more))
        option = typer.Option(kind.option or f"--{self.name.rstrip('_').replace('_', '-')}", **more)
        if default is None or default == ():  # an option that may be repeated is None where it is not given
            return _keyword(self.name, read | None, None, option)
        return _keyword(self.name, read, default, option)


def _keyword(name: str, kind: Any, default: Any, mark: Any) -> inspect.Parameter:  # noqa: ANN401 - typer's
    annotated = Annotated[kind, mark]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=annotated, default=default)
