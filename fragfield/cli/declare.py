"""Commands from public functions: a command's arguments, options and their words are those of the function.

A positional parameter without a default is an argument, any other an option. What each means is read in the numpydoc
section "Parameters", without the sentences on Python; its name and metavar come from its kind
(`fragfield.interface.kinds`). A command adds `--quiet` and `--json`, and where the function follows progress,
`--progress-file`. The options are read in the function's file; its module is loaded once the command is called.
"""

from __future__ import annotations

import ast
import inspect
import re
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, get_args

import typer
from typer.core import TyperCommand

from fragfield.cli.guard import give, guarded
from fragfield.errors import InputError
from fragfield.interface import kinds
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
        module, _, function = (self.target or "").partition(":")
        declared = _options(module, function) if module else ()
        options = {one.name: one for one in declared if one.name not in {*self.leave_out, *self.fixed}}
        follows = options.pop("progress", None)
        own = {one.name: one for one in _options(self.give.__module__, self.give.__name__)}
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
                results = [getattr(import_module(module), function)(**given, **self.fixed)] if module else []
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


@dataclass
class _Declared:
    """Parameters as a file declares them, in their order: type and default by name, and docstrings, its own last."""

    types: dict[str, ast.expr]
    defaults: dict[str, Any]
    texts: list[str]


def _declared(module: str, name: str) -> _Declared:
    """The parameters of a function, of a dataclass with its bases, or of the class that `maker` makes a function of."""
    spec = find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    body = ast.parse(Path(spec.origin).read_text(encoding="utf-8")).body
    homes = {alias.name: one.module for one in body if isinstance(one, ast.ImportFrom) for alias in one.names}
    for one in body:
        if isinstance(one, ast.Assign) and isinstance(one.value, ast.Call) and ast.unparse(one.targets[0]) == name:
            return _declared(module, ast.unparse(one.value.args[0]))
    node = next(one for one in body if isinstance(one, (ast.FunctionDef, ast.ClassDef)) and one.name == name)
    made = _Declared({}, {}, [])
    if isinstance(node, ast.FunctionDef):
        of = node.args
        made.types = {one.arg: one.annotation for one in (*of.args, *of.kwonlyargs) if one.annotation}
        last = of.args[len(of.args) - len(of.defaults) :]
        values = [*zip(last, of.defaults, strict=True), *zip(of.kwonlyargs, of.kw_defaults, strict=True)]
        made.defaults = {one.arg: ast.literal_eval(value) for one, value in values if value}
    for base in node.bases if isinstance(node, ast.ClassDef) else ():
        if (home := homes.get(ast.unparse(base)) or "").startswith("fragfield."):
            made = _declared(home, ast.unparse(base))
    for one in node.body if isinstance(node, ast.ClassDef) else ():
        if not isinstance(one, ast.AnnAssign) or ast.unparse(one.annotation).startswith(("ClassVar", "KW_ONLY")):
            continue
        field_name, value = ast.unparse(one.target), one.value
        made.types[field_name] = one.annotation
        if isinstance(value, ast.Call):  # field(...)
            asked = {mark.arg: ast.unparse(mark.value) for mark in value.keywords}
            if asked.get("init") == "False":
                made.types.pop(field_name)
            value = next((mark.value for mark in value.keywords if mark.arg == "default"), None)
        if value is not None:
            made.defaults[field_name] = ast.literal_eval(value)
    made.texts.append(ast.get_docstring(node) or "")
    return made


def _options(module: str, name: str) -> Iterator[_Option]:
    """The parameters of a function."""
    found, words = _declared(module, name), dict[str, str]()
    for text in found.texts:
        section = _SECTION.search(text)
        for names, entry in _ENTRY.findall(f"{section[1]}\n") if section else ():
            meaning = _OF_PYTHON.sub("", " ".join(entry.split())).strip(" ;")
            meaning = meaning.replace("_STUDY", f"_{name.removeprefix('run_')}")
            meaning += "" if meaning.endswith(".") or not meaning else "."
            words |= {one.strip(): meaning for one in names.split(",")}
    known = vars(kinds) | {"Any": Any, "Annotated": Annotated, "Mapping": Mapping, "Path": Path}
    for one, kind in found.types.items():
        if one in _OF_A_GIVER:
            continue
        hint = eval(ast.unparse(kind), known)
        yield _Option(one, _kind(hint, one), found.defaults.get(one, inspect.Parameter.empty), words.get(one, ""))


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
