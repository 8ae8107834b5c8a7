"""Built-in profiles, explosives and casings (TOML with sources), and the checked reading of files of that form."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from math import isfinite
from pathlib import Path
from typing import Any

from burst_fenicsx.errors import InputError
from fragfield_base import errors
from fragfield_base.reading import read_text

__all__ = ["DATA_DIRECTORY", "LENGTH_UNITS", "Table", "nearest_name", "read_toml"]

DATA_DIRECTORY = Path(__file__).parent
_MOST_BYTES = 1 << 26
_MOST_SHOWN = 200
LENGTH_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}


def nearest_name(name: str, allowed: Iterable[str]) -> str:
    """Return a clause for a message: the nearest allowed name, if one is near, and all that are allowed."""
    known = sorted(allowed)
    close = errors.nearest_name(name, known)
    hint = f"did you mean '{close}'? " if close is not None else ""
    return f"{hint}allowed: {', '.join(known)}"


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file.

    Raises
    ------
    InputError
        The file is missing, or is not TOML; the message names the file and the place.
    """
    try:
        return tomllib.loads(read_text(path, InputError, most=_MOST_BYTES))
    except RecursionError:
        raise InputError(f"{path}: not a TOML file for this program: nested too deep") from None
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"{path}: not a TOML file ({error})") from error


def _as_float(value: float) -> float:
    """A number of a file; one of more digits than a float holds is infinite."""
    try:
        return float(value)
    except OverflowError:
        return float("inf")


class Table:
    """A TOML table whose values are taken by name and type; faults are reported with file and key.

    Parameters
    ----------
    values : the table.
    where : file and table, as it shall stand at the start of a message.
    allowed : every key that the table may have.

    Raises
    ------
    InputError
        The table has a key that is not allowed.
    """

    def __init__(self, values: object, where: str, allowed: Iterable[str]) -> None:
        if not isinstance(values, Mapping):
            raise InputError(f"{where}: found {values!r}, a table is expected")
        self.values = values
        self.where = where
        names = set(allowed)
        for key in values:
            if key not in names:
                raise InputError(f"{where}: unknown key '{key}'; {nearest_name(str(key), names)}")

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def fault(self, key: str, expected: str) -> InputError:
        """Return the error for the value of `key`, or for its absence."""
        if key not in self.values:
            return InputError(f"{self.where}: key '{key}' is missing; {expected}")
        try:
            found = repr(self.values[key])
        except (ValueError, RecursionError):  # an integer of thousands of digits
            found = "something too large to print"
        found = found if len(found) <= _MOST_SHOWN else f"{found[:_MOST_SHOWN]}..."
        return InputError(f"{self.where}: {key} = {found}; {expected}")

    def text(self, key: str, default: str | None = None, choices: Iterable[str] | None = None) -> str:
        """Return a string, one of `choices` if given."""
        value = self.values.get(key, default)
        if not isinstance(value, str):
            raise self.fault(key, "a text is expected")
        if choices is not None:
            names = list(choices)
            if value not in names:
                raise self.fault(key, nearest_name(value, names))
        return value

    def number(
        self,
        key: str,
        default: float | None = None,
        *,
        above: float | None = None,
        below: float | None = None,
        at_least: float | None = None,
        unit: str = "",
    ) -> float:
        """Return a finite number within the open bounds `above`, `below` and the closed bound `at_least`."""
        bounds = [f"above {above:g}"] if above is not None else []
        bounds += [f"at least {at_least:g}"] if at_least is not None else []
        bounds += [f"below {below:g}"] if below is not None else []
        expected = " ".join(["a number", " and ".join(bounds), f"({unit})" if unit else "", "is expected"])
        expected = " ".join(expected.split())
        value = self.values.get(key, default)
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.fault(key, expected)
        number = _as_float(value)
        if number != number or abs(number) == float("inf"):
            raise self.fault(key, expected)
        if (above is not None and number <= above) or (below is not None and number >= below):
            raise self.fault(key, expected)
        if at_least is not None and number < at_least:
            raise self.fault(key, expected)
        return number

    def numbers(self, key: str, length: int | None = None) -> list[float]:
        """Return a list of finite numbers."""
        expected = f"a list of {length} numbers is expected" if length is not None else "a list of numbers is expected"
        value = self.values.get(key)
        if not isinstance(value, list) or (length is not None and len(value) != length):
            raise self.fault(key, expected)
        for entry in value:
            if isinstance(entry, bool) or not isinstance(entry, (int, float)) or not isfinite(_as_float(entry)):
                raise self.fault(key, expected)
        return [_as_float(entry) for entry in value]

    def table(self, key: str, allowed: Iterable[str]) -> Table:
        """Return a table within this table."""
        if key not in self.values:
            raise self.fault(key, f"a table [{key}] is expected")
        return Table(self.values[key], f"{self.where} [{key}]", allowed)
