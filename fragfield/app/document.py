"""A case file that is being edited: its text with comments, and what is wrong in it."""

from __future__ import annotations

import copy
import re
import tomllib
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import tomlkit
from tomlkit.exceptions import TOMLKitError

from fragfield.app.workspace import Job
from fragfield.case import CaseTable
from fragfield.case.faults import CaseFaults, Fault
from fragfield.case.load import case_from_document
from fragfield.case.write import tables_to_toml, toml_value
from fragfield.errors import InputError
from fragfield_base import errors
from fragfield_base.reading import read_text
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from fragfield.app.workspace import Workspace

    Steps = Sequence[str | int]


_MOST = 1 << 22


def steps_of(key: str) -> tuple[str | int, ...]:
    """Steps of a key as messages write it: `round[2].casing` is ("round", 1, "casing")."""
    steps: list[str | int] = []
    for part in key.split("."):
        name, _, number = part.partition("[")
        steps.append(name)
        if number:
            steps.append(int(number.rstrip("]")) - 1)
    return tuple(steps)


@dataclass
class CaseDocument:
    """One case file, and its text with the changes that are not saved; `version` counts them."""

    space: Workspace
    name: str
    version: int = 0
    _text: str = ""
    _saved: str = ""
    _read_text: str | None = None
    _read_tables: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.path = self.space.inside(self.name)
        self._saved = self._text = self._read()
        self._checked: tuple[int, CaseTable | None, list[Fault]] | None = None

    def _read(self) -> str:
        if not self.path.is_file():
            raise InputError(f"{self.name}: no such case file")
        return read_text(self.path, InputError, most=_MOST)

    @property
    def text(self) -> str:
        """With what is not saved."""
        return self._text

    @property
    def is_draft(self) -> bool:
        """Whether something is not saved."""
        return self._text != self._saved

    @property
    def changed_on_disk(self) -> bool:
        """Whether another program has written the file since it was read."""
        with suppress(InputError):
            return self._read() != self._saved
        return True

    @property
    def tables(self) -> dict[str, Any]:
        """The tables as the file has them; empty where the text is not TOML."""
        return copy.deepcopy(self._parsed())

    def _parsed(self) -> dict[str, Any]:
        """The tables, read once for each text; they are not to be changed."""
        if self._read_text != self._text:
            self._read_text, self._read_tables = self._text, {}
            with suppress(ValueError, RecursionError):
                self._read_tables = tomllib.loads(self._text)
        return self._read_tables

    def get(self, path: Steps, default: Any = None) -> Any:  # noqa: ANN401 - any value of a table
        """The value at a place, `default` where there is none."""
        found: Any = self._parsed()
        step: Any
        for step in path:
            if (isinstance(found, dict) and step in found) or (
                isinstance(found, list) and isinstance(step, int) and 0 <= step < len(found)
            ):
                found = found[step]
            else:
                return default
        return found

    def set(self, path: Steps, value: object) -> None:
        """Put a value at a place, None to remove it; tables on the way are made, comments stay."""
        if not path or (self.get(path) == value and type(self.get(path)) is type(value)):
            return
        wanted = self.tables
        _put(wanted, path, value)
        self.replace(_with_comments(self._text, path, value, wanted))

    def replace(self, text: str) -> None:
        """Take another text for the whole."""
        if len(text) > _MOST:
            raise InputError(f"{self.name}: found {len(text)} characters; allowed: at most {_MOST}")
        if text == self._text:
            return
        self._text, self.version = text, self.version + 1

    def save(self) -> None:
        """Write the text into the file; raises InputError where another program has written it since it was read."""
        if self.changed_on_disk:
            raise InputError(
                f"{self.name}: another program has changed the file since it was read; read it again and "
                "repeat the change"
            )
        write_text(self.path, self._text, InputError)
        self._saved, self.version = self._text, self.version + 1

    def reload(self) -> None:
        """Take the file as it stands on disk."""
        self._saved = self._text = self._read()
        self.version += 1

    def resolved(self) -> CaseTable | None:
        """The case as the command line resolves it; None where it has faults."""
        return self._check()[0]

    def faults(self) -> list[Fault]:
        """What the command line would refuse, in its own words."""
        return self._check()[1]

    def _check(self) -> tuple[CaseTable | None, list[Fault]]:
        if self._checked is None or self._checked[0] != self.version:
            version = self.version
            self._checked = (version, *_judged(self._text, self.path))
        return self._checked[1:]


def _judged(text: str, path: Path) -> tuple[CaseTable | None, list[Fault]]:
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        return None, [Fault("", f"{path.name}: not valid TOML: {error}")]
    tables.setdefault("title", path.stem)
    try:
        return case_from_document(tables, source=path.name, folder=path.parent), []
    except CaseFaults as refused:
        return None, refused.faults
    except errors.InputError as error:  # of a file that the case names
        return None, [Fault("", str(error))]


def _put(node: Any, path: Steps, value: object, *, kept: bool = False) -> None:  # noqa: ANN401 - tables and lists
    """Put a value into plain tables; with `kept` into those of tomlkit, new ones as a file has them with heads."""
    *way, last = path
    for step, following in zip(way, path[1:], strict=True):
        there = int(step) < len(node) if isinstance(node, list) else step in node
        if not there:
            if value is None:
                return
            listed = isinstance(following, int)
            plain: Any = [] if listed else {}
            empty = plain if not kept else tomlkit.aot() if listed else tomlkit.table()
            if isinstance(node, list):
                node.append(empty)
            else:
                node[step] = empty
        node = node[step]
        if not isinstance(node, (dict, list)):
            raise InputError(f"{step}: holds a value, it has no {following}")
    if value is None:
        if isinstance(node, list):
            del node[int(last)]
        else:
            node.pop(last, None)
    elif isinstance(node, list) and last == len(node):
        node.append(_as_item(value) if isinstance(node, tomlkit.items.AoT) else value)
    else:
        node[last] = _as_item(value) if kept else value


def _with_comments(text: str, path: Steps, value: object, wanted: dict[str, Any]) -> str:
    """The text with a value changed: by as little as possible, so that comments stay.

    What tomlkit makes is read again: where it is not what was meant, all tables are written again.
    """
    made = _uncommented(text, path, value)
    with suppress(ValueError):
        if made and tomllib.loads(made) == wanted:
            return made
    with suppress(TOMLKitError, ValueError, TypeError, KeyError, IndexError, AttributeError):
        document = tomlkit.parse(text)
        _put(document, path, value, kept=True)
        made = document.as_string()
        if tomllib.loads(made) == wanted:
            return made
    return tables_to_toml(wanted)


def _uncommented(text: str, path: Steps, value: object) -> str:
    """The text with the line `#key = default` of a table taken for the value, as a user would; empty without one."""
    table = [step for step in path[:-1] if isinstance(step, str)]
    number = next((step for step in path[:-1] if isinstance(step, int)), None)
    if value is None or isinstance(value, dict) or len(path[:-1]) > len(table) + (number is not None):
        return ""
    name = re.escape(".".join(table))
    head = rf"^\[{name}\]" if number is None else rf"^\[\[{name}\]\]"
    heads = list(re.finditer(head, text, re.MULTILINE)) if table else []
    if table and len(heads) <= (number or 0):
        return ""
    start = heads[number or 0].end() if table else 0
    end = following.start() if (following := re.compile(r"^\[", re.MULTILINE).search(text, start)) else len(text)
    line = re.compile(rf"^#{re.escape(str(path[-1]))} = .*$", re.MULTILINE).search(text, start, end)
    return "" if line is None else f"{text[: line.start()]}{path[-1]} = {toml_value(value)}{text[line.end() :]}"


def _as_item(value: object) -> Any:  # noqa: ANN401 - tomlkit's item
    if not isinstance(value, dict):
        return value
    table = tomlkit.table()
    for key, entry in value.items():
        table[key] = _as_item(entry) if isinstance(entry, dict) else entry
    return table


class Session:
    """State of the application that is in no file: unsaved changes, and the run that is computed."""

    def __init__(self, space: Workspace) -> None:
        self.space = space
        self.job: Job | None = None
        """The run that is computed, or was computed last."""
        self._open: dict[str, CaseDocument] = {}

    def compute(self, title: str, run: str, commands: Sequence[Sequence[str]]) -> None:
        """Start commands that write into a run directory; raises InputError while another run is computed."""
        if self.job is not None and self.job.is_live:
            raise InputError(f"{self.job.run}: is being computed; one run at a time: wait for its end, or cancel it")
        self.job = Job(self.space, title, run, commands)

    def open(self, name: str) -> CaseDocument:
        """The case of that name, the same for all pages; raises InputError where it cannot be read."""
        path = self.space.inside(name)
        key = self.space.name_of(path)
        if key not in self._open:
            self._open[key] = CaseDocument(self.space, key)
        elif not self._open[key].is_draft and self._open[key].changed_on_disk:
            self._open[key].reload()
        return self._open[key]
