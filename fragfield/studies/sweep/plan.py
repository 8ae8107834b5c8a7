"""Plan of a sweep: every combination of the values as a resolved case, checked before anything runs."""

from __future__ import annotations

import hashlib
import itertools
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fragfield.case import differences, load_changed_case
from fragfield.case.changes import read_value
from fragfield.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from fragfield.case import CaseTable


_EXAMPLE = 'burst.cell_size="8 mm,6 mm"'
_OPENING, _CLOSING, _QUOTES = "[{(", "]})", "\"'"
_LONGEST_NAME = 100  # characters; a file's name may have 255 bytes
_NOT_IN_NAMES = re.compile(r"[^A-Za-z0-9.+-]+")


@dataclass(frozen=True)
class PlannedRun:
    """One run of a sweep: the name of its directory, its values by dotted key, and its case, resolved."""

    name: str
    values: dict[str, Any]
    case: CaseTable


@dataclass(frozen=True)
class SweepPlan:
    """The runs of a sweep of one case file, in the order of the values, the last key changing first."""

    case_file: Path
    keys: tuple[str, ...]
    runs: tuple[PlannedRun, ...]


def plan_sweep(case_file: Path, settings: Sequence[str]) -> SweepPlan:
    """Read the values and resolve the case of every combination.

    Parameters
    ----------
    case_file : Path
        The case that is varied.
    settings : sequence of str
        KEY=VALUE[,VALUE...] with dotted keys, see `fragfield.case.changed_document`. Commas within quotes or brackets
        part nothing. Numbers, lists, true and false are read as in a case file, all else is a string.

    Raises
    ------
    InputError
        A setting cannot be read, the schema knows no such key or allows no such value, or two runs would be alike.
    """
    values = _values(settings)
    labels = labels_of(list(values))
    runs: list[PlannedRun] = []
    for chosen in itertools.product(*values.values()):
        changes = dict(zip(values, chosen, strict=True))
        name = _name({labels[key]: value for key, value in changes.items()})
        planned = PlannedRun(name, changes, load_changed_case(case_file, changes))
        _refuse_twin(planned, runs)
        runs.append(planned)
    return SweepPlan(case_file, tuple(values), tuple(runs))


def _values(settings: Sequence[str]) -> dict[str, list[Any]]:
    """Values by dotted key."""
    found: dict[str, list[Any]] = {}
    for setting in settings:
        key, equals, text = (part.strip() for part in setting.partition("="))
        parts = _split(text)
        if not (key and equals) or not all(parts):
            raise InputError(f"found {setting!r}; needed: KEY=VALUE[,VALUE...], for example {_EXAMPLE}")
        if key in found:
            raise InputError(f"{key} is given twice; needed: one list of its values, for example {_EXAMPLE}")
        found[key] = [read_value(part) for part in parts]
    if not found:
        raise InputError(f"no values to sweep over; needed: KEY=VALUE[,VALUE...], for example {_EXAMPLE}")
    return found


def _split(text: str) -> list[str]:
    """Parts of a text between the commas that stand in no quotes and no brackets."""
    parts, depth, quote = [""], 0, ""
    for letter in text:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in _QUOTES:
            quote = letter
        elif letter in _OPENING:
            depth += 1
        elif letter in _CLOSING:
            depth -= 1
        elif letter == "," and depth == 0:
            parts.append("")
            continue
        parts[-1] += letter
    return [part.strip() for part in parts]


def labels_of(keys: Sequence[str]) -> dict[str, str]:
    """Short words for the keys: their last steps where these distinguish them."""
    last = [key.rpartition(".")[2] for key in keys]
    return dict(zip(keys, keys if len(set(last)) < len(keys) else last, strict=True))


def _name(values: Mapping[str, Any]) -> str:
    """Name of a run's directory, the same for the same values in any sweep."""
    name = "_".join(_NOT_IN_NAMES.sub("_", f"{label} {value}").strip("_.") for label, value in values.items())
    if len(name) <= _LONGEST_NAME:
        return name
    return f"{name[:_LONGEST_NAME]}_{hashlib.sha256(name.encode()).hexdigest()[:8]}"


def _refuse_twin(planned: PlannedRun, runs: Sequence[PlannedRun]) -> None:
    for other in runs:
        if other.name == planned.name or not differences(other.case, planned.case):
            raise InputError(
                f"the runs {_in_words(other.values)} and {_in_words(planned.values)} are alike; give every value once"
            )


def _in_words(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{key} = {value}" for key, value in values.items())
