"""Keys in which two cases differ."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from fragfield.case.write import plain
from fragfield_base.inputs import show

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from fragfield.case.schema import CaseTable

__all__ = ["differences", "document_differences"]

_WORDS_ONLY = ("title", "notes", "source")  # change nothing that is computed
_NOT_COMPUTED = ("document.", "uncertainty.", "uncertainty[")  # tables that no run depends on


def _flat(value: object, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, entry in value.items():
            yield from _flat(entry, f"{path}.{key}" if path else key)
    elif isinstance(value, list) and any(isinstance(entry, dict) for entry in value):
        for i, entry in enumerate(value, start=1):
            yield from _flat(entry, f"{path}[{i}]")
    else:
        yield path, value


def differences(stored: CaseTable, now: CaseTable, within: Sequence[str] | None = None) -> list[str]:
    """Lines `key: stored 0.006 m, now 0.008 m`, one per key in which two resolved cases differ.

    Titles, notes and sources do not count. `within`: only keys that are one of these or lie in one of these tables.
    """
    return document_differences(plain(stored, units=True), plain(now, units=True), within)


def document_differences(
    stored: Mapping[str, Any],
    now: Mapping[str, Any],
    within: Sequence[str] | None = None,
    *,
    words: tuple[str, str] = ("stored", "now"),
    tolerance: float = 0.0,
) -> list[str]:
    """As `differences`, of two resolved cases as tables with units.

    `words` name the two cases; values with the same unit whose numbers agree to the relative `tolerance` do not count.
    """
    before, after = (dict(_flat(document)) for document in (stored, now))
    lines = []
    for key in dict.fromkeys([*before, *after]):
        words_only = key.rpartition(".")[2] in _WORDS_ONLY or key.startswith(_NOT_COMPUTED)
        if words_only or not (within is None or any(_lies_in(key, table) for table in within)):
            continue
        if not _agree(before.get(key), after.get(key), tolerance):
            lines.append(f"{key}: {words[0]} {_shown(before, key)}, {words[1]} {_shown(after, key)}")
    return lines


def _agree(one: object, other: object, tolerance: float) -> bool:
    if one == other or tolerance == 0.0 or not (isinstance(one, str) and isinstance(other, str)):
        return one == other
    (number, _, unit), (other_number, _, other_unit) = one.partition(" "), other.partition(" ")
    try:
        return unit == other_unit and math.isclose(float(number), float(other_number), rel_tol=tolerance)
    except ValueError:
        return False


def _lies_in(key: str, table: str) -> bool:
    return key == table or key.startswith((f"{table}.", f"{table}["))


def _shown(flat: dict[str, Any], key: str) -> str:
    return show(flat[key]) if key in flat else "nothing"
