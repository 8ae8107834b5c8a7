"""Folders, case files and tables of the studies that compute many runs."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError
from fragfield.interface.case import Case
from fragfield.interface.tables import Table
from fragfield_base.paths import absolute

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping, Sequence

__all__ = ["setting_of", "study_folder", "table_of_rows", "written_case"]


def study_folder(
    case: Case | str | os.PathLike[str], out: str | os.PathLike[str] | None, what: str
) -> tuple[Path, Path]:
    """The folder of the results, and where a case made in Python is written."""
    if out is None:
        path = case.path if isinstance(case, Case) else absolute(case, InputError)
        if path is None:
            raise InputError(f'out: missing; a case made in Python needs a folder, such as out="runs/first_{what}"')
        out = Path("runs") / f"{path.resolve().stem}_{what}"
    folder = absolute(out, InputError)
    return folder, folder.with_name(f"{folder.name}.toml")


def written_case(case: Case | str | os.PathLike[str], file: Path) -> Path:
    """The file of a case; one made in Python is written."""
    if not isinstance(case, Case):
        return absolute(case, InputError)
    file.parent.mkdir(parents=True, exist_ok=True)
    case.write(file)
    return file


def setting_of(key: str, values: Sequence[Any]) -> str:
    """Values of a key as the command line takes them."""
    from fragfield.case.write import toml_value

    if isinstance(values, str) or not hasattr(values, "__iter__"):
        raise InputError(f"{key}: found {values!r}; needed: a list of its values, such as [{values!r}]")
    return f"{key}={','.join(toml_value(value) for value in values)}"


def table_of_rows(name: str, rows: Sequence[Mapping[str, Any]]) -> Table:
    """Rows of texts and numbers as columns; numbers that are not there are NaN."""
    import numpy as np

    keys = list(dict.fromkeys(key for row in rows for key in row))
    columns = {}
    for key in keys:
        values = [row.get(key) for row in rows]
        known = [value for value in values if value is not None]
        numbers = bool(known) and all(isinstance(value, (int, float)) for value in known)
        columns[key] = np.array(
            [math.nan if value is None else value for value in values]
            if numbers
            else ["" if value is None else str(value) for value in values]
        )
    return Table(name, columns)
