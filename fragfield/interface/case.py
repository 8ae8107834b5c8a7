"""A case in Python: from a file or from tables, with the same checks and messages."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.case.changes import changed_document, plain_tables, read_settings, set_document
from fragfield.case.load import case_from_document, read_document
from fragfield.case.write import plain, to_toml
from fragfield.errors import InputError
from fragfield.files.run_directory import RunDirectory
from fragfield_base.paths import absolute
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fragfield.case.schema import CaseTable as Resolved


_SOURCE = "case"  # what messages call a case that is of no file


class Case:
    """Everything that a run depends on: read, checked and resolved.

    Parameters
    ----------
    tables : mapping, optional
        Tables as the case file has them, with the same keys: values with a dimension are texts with their unit, such as
        `{"burst": {"cell_size": "6 mm"}}`, or quantities of pint. Lists of tables stand for `[[round]]`, NumPy's arrays
        for lists.
    folder : path
        Folder to which the names of files in the case are relative.
    **more
        Further tables: `Case(title="Mine", burst={"cell_size": "6 mm"}, round=[...])`.

    Raises
    ------
    InputError
        Any fault; the message names the key, what was found and what is allowed, as `fragfield check` does.

    Attributes
    ----------
    values : fragfield.case.CaseTable
        The resolved case with every default, numbers in SI: `case.values.hazard.energy` is 79.0 (J).
    """

    values: Resolved

    def __init__(
        self, tables: Mapping[str, Any] | None = None, /, *, folder: str | os.PathLike[str] = ".", **more: Any
    ) -> None:
        given = {} if tables is None else tables
        if not isinstance(given, Mapping):
            raise InputError(f"{_SOURCE}: found a {type(given).__name__}; needed: a mapping of tables, or keywords")
        if twice := sorted(set(given) & set(more)):
            raise InputError(f"{_SOURCE}: {twice[0]} is given twice, in the tables and as a keyword; give it once")
        self._fill(plain_tables({**given, **more}), _SOURCE, absolute(folder, InputError), None)

    @classmethod
    def from_toml(
        cls,
        path: str | os.PathLike[str],
        *,
        set: Sequence[str] | Mapping[str, Any] = (),  # noqa: A002 - as `--set`
        burst: bool = True,
    ) -> Case:
        """Read, check and resolve a case file.

        Parameters
        ----------
        path : path
            The file; names of files in it are relative to its folder.
        set : sequence of str, or mapping
            Values that replace those of the file, as `--set`: `["burst.cell_size=8 mm"]`, or
            `{"burst.cell_size": "8 mm"}`.
        burst : bool
            Whether the case must describe a burst; a flight of given fragments needs none.

        Raises
        ------
        InputError
            No such file, no TOML, or any fault in it; the message names file and key.
        """
        where = absolute(path, InputError)
        document, source = set_document(where, set)
        made = cls.__new__(cls)
        made._fill(document, source, where.parent, where, burst=burst)
        return made

    @classmethod
    def of_run(cls, directory: RunDirectory) -> Case:
        """The case that a run directory holds, as it was resolved; raises InputError where there is none."""
        made = cls.__new__(cls)
        made.values = directory.stored_case()
        made._document, made._source, made._folder = read_document(directory.case_file), _SOURCE, directory.path
        made._path, made._needs_burst = None, made.values.burst is not None
        return made

    def _fill(
        self, document: dict[str, Any], source: str, folder: Path, path: Path | None, *, burst: bool | None = None
    ) -> None:
        needs_burst = ("burst" in document or "round" in document) if burst is None else burst
        self.values = case_from_document(document, source=source, folder=folder, burst=needs_burst)
        self._document, self._source, self._folder, self._path = document, source, folder, path
        self._needs_burst = needs_burst

    @property
    def title(self) -> str:
        """Title for reports."""
        return self.values.title

    @property
    def path(self) -> Path | None:
        """File from which it was read; None for one made in Python."""
        return self._path

    def changed(self, changes: Mapping[str, Any] | Sequence[str]) -> Case:
        """The same case with some values replaced.

        Parameters
        ----------
        changes : mapping, or sequence of str
            By dotted key, as `set` of `from_toml`: `{"burst.cell_size": "8 mm", "round[1].explosive": "tnt"}`.

        Raises
        ------
        InputError
            As `from_toml`.
        """
        values = read_settings(changes)
        source = f"{self._source} with {', '.join(f'{key} = {value}' for key, value in values.items())}"
        document = changed_document(self._document, values, source=source, folder=self._folder)
        made = type(self).__new__(type(self))
        made._fill(document, source, self._folder, self._path, burst=self._needs_burst)
        return made

    def tables(self) -> dict[str, Any]:
        """The resolved case as nested dicts and lists with units, as the case file has them."""
        return plain(self.values, units=True)

    def to_toml(self) -> str:
        """The resolved case as the text of a case file."""
        return to_toml(self.values)

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the resolved case as a case file; raises InputError where it cannot be written."""
        return write_text(absolute(path, InputError), self.to_toml(), InputError)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Case) and self.values == other.values

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<fragfield.Case {self.title!r}: {_rounds(self.values)}>"


def case_of(
    target: Case | str | os.PathLike[str],
    *,
    set: Sequence[str] | Mapping[str, Any] = (),  # noqa: A002 - as `--set`
    burst: bool = True,
) -> Case:
    """The case meant by a Case, the path of a case file, or that of a run directory, with some values replaced.

    A file must describe a burst unless `burst` is False; a Case is as it was made.
    """
    if isinstance(target, Case):
        changes = read_settings(set)
        return target.changed(changes) if changes else target
    path = absolute(target, InputError)
    if path.is_dir():
        stored = RunDirectory(path)
        stored.stored_case()  # says what is missing, in the words of a run directory
        path = stored.case_file
    return Case.from_toml(path, set=set, burst=burst)


def _rounds(case: Resolved) -> str:
    kinds = Counter(
        (
            entry.profile.get("name", "own profile") if isinstance(entry.profile, dict) else "mesh",
            getattr(entry.explosive, "name", entry.explosive),
            getattr(entry.casing, "name", entry.casing),
        )
        for entry in case.round
    )
    words = [f"{number} x {shape} of {explosive} in {casing}" for (shape, explosive, casing), number in kinds.items()]
    return ", ".join(words) or "no rounds"
