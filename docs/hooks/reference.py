"""Pages made from the program: case file, commands, summary.json, built-in names, public names of a package."""

from __future__ import annotations

import importlib
import inspect
import math
import re
import tomllib
from itertools import groupby
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin

from pydantic import BaseModel
from typer.main import get_command

from burst_fenicsx.data import DATA_DIRECTORY
from fragfield.case import CaseTable
from fragfield.case.keys import Key, keys_of, kind_of
from fragfield.cli import app
from fragfield.quantities import QUANTITIES
from fragfield.results.summary import described
from fragfield.studies.study import Study

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

__all__ = ["api_reference", "built_in_profiles", "case_reference", "cell", "command_reference", "rows"]
__all__ += ["summary_reference"]

Schema = dict[str, Any]
_SECTIONS = ("Parameters", "Attributes", "Returns", "Yields", "Raises", "Notes", "Examples")
_LIMITS = {"gt": "greater than", "ge": "at least", "lt": "less than", "le": "at most"}
_TYPES = {int: "a whole number", float: "a number", str: "text", bool: "`true` or `false`"}


def cell(text: str) -> str:
    """A text for a table: one line, no bar splits it; angle brackets and dollars outside of code are shown."""
    parts = " ".join(text.split()).split("`")
    plain = [part if i % 2 else part.replace("<", "&lt;").replace("$", "&#36;") for i, part in enumerate(parts)]
    return "`".join(plain).replace("|", "\\|")


def rows(head: str, body: Iterable[Iterable[str]]) -> str:
    """A table in Markdown; `head` has its titles between commas."""
    titles = head.split(", ")
    lines = [f"| {' | '.join(titles)} |", f"|{'---|' * len(titles)}"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in body)])


# --- case file ----------------------------------------------------------------------------------------------


def case_reference() -> str:
    """Every table of the case file, as Markdown."""
    parts = [_table(CaseTable, "", "Top level"), *_tables(CaseTable)]
    return "\n\n".join(parts)


def _tables(above: type[BaseModel], path: str = "") -> Iterator[str]:
    """The tables that the keys of another may hold, each before those within it."""
    for key in keys_of(above, path):
        for table in key.tables:
            kind = kind_of(table) if len(key.tables) > 1 else ""
            brackets = f"[[{key.path}]]" if key.listed else f"[{key.path}]"
            yield _table(table, key.path, f'{brackets} with kind = "{kind}"' if kind else brackets)
            yield from _tables(table, key.path)


def _table(table: type[BaseModel], path: str, title: str) -> str:
    words = cell(inspect.getdoc(table) or "") if path else "Keys that stand before the first table."
    body = [
        (f"`{key.name}`", cell("; ".join([_allowed(key), *([key.bounds.words(key.unit)] if key.bounds else [])])),
         "needed" if key.needed else cell(_default(key)), cell(key.meaning or f"See `{key.path}`."))
        for key in keys_of(table, path)
        if path or not key.tables
    ]  # fmt: skip
    return f"{'###' if '.' in path else '##'} {title}\n\n{words}\n\n{rows('key, value, default, meaning', body)}"


def _allowed(key: Key) -> str:
    """What a value may be, in words."""
    if key.parsed is not None:
        words = re.sub(r' with its unit as a string, for example ("[^"]*")', r", for example `\1`", key.allowed)
    else:
        limits = [f"{words} {getattr(mark, name):g}" for mark in key.marks for name, words in _LIMITS.items()
                  if getattr(mark, name, math.inf) < 1e9]  # fmt: skip
        limited = f", {' and '.join(limits)}" if limits else ""
        words = " or ".join(
            f"`{'`, `'.join(map(_toml, get_args(part)))}`" if get_origin(part) is Literal
            else _TYPES.get(part, "a table") + (limited if part in (int, float) else "")
            for part in key.types
        )  # fmt: skip
    return f"a list, each {words}" if key.listed else words


def _default(key: Key) -> str:
    value, unit = key.default, key.unit
    if value is None or isinstance(value, BaseModel):
        return "-"
    if isinstance(value, (list, tuple)):
        return f"`[{', '.join(_with_unit(item, unit) for item in value)}]`"
    return f"`{_with_unit(value, unit)}`"


def _with_unit(value: Any, unit: str) -> str:  # noqa: ANN401 - whatever a key holds
    """A default as the file would write it; angles in degrees, densities of hazard as one over an area."""
    if isinstance(value, (str, bool)) or not unit:
        return _toml(value)
    if unit == "rad":
        return f'"{math.degrees(value):.6g} deg"'
    return f'"1 / ({1.0 / value:.6g} m^2)"' if unit == "1/m^2" else f'"{value:.6g} {unit}"'


def _toml(value: Any) -> str:  # noqa: ANN401 - whatever a key holds
    if isinstance(value, bool):
        return "true" if value else "false"
    return f'"{value}"' if isinstance(value, str) else f"{value:.6g}"


def built_in_profiles() -> str:
    """Built-in profiles with their sources, as Markdown."""
    body = []
    for path in sorted((DATA_DIRECTORY / "profiles").glob("*.toml")):
        values = tomllib.loads(path.read_text(encoding="utf-8"))
        body.append((f"`{path.stem}`", cell(values.get("title", "")), cell(values.get("source", ""))))
    return rows("name, what, source", body)


# --- summary.json -------------------------------------------------------------------------------------------


def summary_reference() -> str:
    """A table of all values of each part of summary.json, from the catalogue of output quantities, as Markdown."""
    parts = []
    for part, values in groupby(QUANTITIES.values(), key=lambda one: one.path.rpartition(".")[0].partition(".")[0]):
        name = part.removesuffix("[]")
        head = f"### {name}\n\n{described(name)}\n\n" if name else ""
        body = [
            (f"`{one.path.removeprefix(f'{part}.')}`", one.unit,
             cell(". ".join(words for words in (one.label, one.note) if words)))
            for one in values
        ]  # fmt: skip
        parts.append(f"{head}{rows('key, unit, meaning', body)}")
    return "\n\n".join(parts)


# --- command line -------------------------------------------------------------------------------------------


def command_reference() -> str:
    """Every subcommand with its arguments and options, as Markdown."""
    commands: dict[str, Any] = get_command(app).commands  # type: ignore[attr-defined]
    parts = []
    for name, command in commands.items():
        body = [(f"`{_spelling(entry)}`", getattr(entry, "help", "") or "") for entry in command.params]
        parts.append(f"## {name}\n\n{command.help or ''}\n\n{rows('argument, meaning', body)}")
    return "\n\n".join(parts)


def _spelling(parameter: Any) -> str:  # noqa: ANN401 - click's
    if parameter.param_type_name == "argument":
        return parameter.metavar or parameter.name.upper()
    names = ", ".join(sorted((*parameter.opts, *parameter.secondary_opts), key=len))
    return names + ("" if parameter.is_flag else f" {parameter.metavar or parameter.type.name.upper()}")


# --- public names -------------------------------------------------------------------------------------------


def api_reference(package: str) -> str:
    """Every name of `package.__all__` that has a docstring of its own, as Markdown, in alphabetical order."""
    module = importlib.import_module(package)
    found = [(name, getattr(module, name)) for name in sorted(module.__all__, key=str.lower)]
    shown = [(name, one) for name, one in found if callable(one) and inspect.getdoc(one)]
    return "\n\n".join(part for name, one in shown for part in _entries(name, one))


def _entries(name: str, found: Any) -> Iterator[str]:  # noqa: ANN401 - whatever a package has
    yield _documented(f"## {name}", name, found)
    if inspect.isclass(found) and not issubclass(found, BaseException):
        for member, value in vars(found).items():
            if issubclass(found, Study) and hasattr(Study, member):
                continue  # what the base asks of a study
            plain = getattr(found, member) if isinstance(value, (classmethod, staticmethod)) else value
            if not member.startswith("_") and (callable(plain) or isinstance(plain, property)) and plain.__doc__:
                yield _documented(f"### {name}.{member}", member, plain)


def _documented(title: str, name: str, found: Any) -> str:  # noqa: ANN401 - whatever a package has
    """Title, signature and numpydoc docstring: sections of names as tables, the others as they stand."""
    parts = [title]
    if callable(found):
        parts.append(f"```python\n{'class ' if inspect.isclass(found) else ''}{name}{_signature(found)}\n```")
    pattern = rf"^({'|'.join(_SECTIONS)})\n-{{3,}}\n"
    head, *rest = re.split(pattern, inspect.getdoc(found) or "", flags=re.MULTILINE)
    parts.append(_prose(head))
    left_out: tuple[str, ...] = ()
    if inspect.isclass(found) and issubclass(found, Study):
        left_out = ("Parameters", "Raises")  # which stand at its function
    elif hasattr(found, "__wrapped__"):
        left_out = ("Attributes",)
    for section, body in zip(rest[::2], rest[1::2], strict=True):
        if section in left_out:
            continue
        entries = re.findall(r"^(\S.*)\n?((?:(?: +.*)?\n?)*)", body.strip("\n"), re.MULTILINE)
        if section == "Examples":
            text = f"```python\n{body.strip()}\n```"
        elif section == "Notes":
            text = _prose(body)
        else:
            text = rows("name, meaning", [(_named(entry), cell(words)) for entry, words in entries])
        parts.append(f"**{section}**\n\n{text}")
    return "\n\n".join(parts)


def _named(entry: str) -> str:
    name, colon, kind = entry.partition(" : ")
    return f"`{name}`" + (f"<br>{cell(kind)}" if colon else "")


def _prose(body: str) -> str:
    return "\n".join(cell(line).replace("\\|", "|") for line in inspect.cleandoc(body).splitlines())


def _signature(found: Any) -> str:  # noqa: ANN401 - whatever a package has
    """The signature as the source writes it, one parameter a line where it is long."""
    try:
        text = re.sub(r"(?<=[:>] )'([^']*)'", r"\1", str(inspect.signature(found)))
    except (TypeError, ValueError):
        return ""
    if len(text) <= 80:
        return text
    inside, _, back = text[1:].rpartition(")")
    return "(\n    " + re.sub(r", (?=\*{0,2}\w+[:=,]|\*|/)", ",\n    ", inside) + f",\n){back}"
