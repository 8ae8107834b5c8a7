"""The resolved case as tables: practical values with SI beside them, of the keys that take part in the run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from fragfield.case.checks.bounds import active_tables
from fragfield.case.conversion.surroundings import bearing_of, direction_words
from fragfield.numbers import Row, of_case
from fragfield.report.blocks import Rows
from fragfield.report.tables.rounds import POSITION_KEYS, alike

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.case import CaseTable
    from fragfield.report.reading.run_files import RunFiles


_DIRECTIONS = ("towards", "directions", "azimuth")


def input_tables(run: RunFiles) -> Iterator[Rows]:
    """One table for each part of the resolved case; keys that take no part in the run are left out.

    Directions are azimuths, or with a site bearings, as in all of the report.
    """
    if run.case is None:
        return
    case = active_tables(run.case, own_fragments=run.fragments_file is None)
    own = {key: value for key, value in case.items() if not _is_table(value)}
    if own:
        yield Rows("Case", tuple(_flat("", own)))
    for key, value in case.items():
        if isinstance(value, dict):
            yield Rows(_words(key).capitalize(), tuple(_flat("", _directed(run.case, value))))
        elif key == "round" and len(value) > 1:
            yield from _rounds(value)
        elif _is_table(value):
            for index, entry in enumerate(value, start=1):
                name = f"“{entry['name']}”" if entry.get("name") else str(index)
                yield Rows(f"{_words(key).capitalize()} {name}", tuple(_flat("", _directed(run.case, entry))))


def _directed(case: CaseTable, table: Any) -> Any:  # noqa: ANN401 - any value of a table
    """A table with its horizontal directions in words."""

    def words(value: Any) -> str:  # noqa: ANN401 - one angle, or several
        if isinstance(value, list):
            return ", ".join(map(words, value))
        turn = math.degrees(value.value)
        return direction_words(turn, bearing_of(case, turn))

    if not isinstance(table, dict):
        return table
    return {key: words(value) if key in _DIRECTIONS else _directed(case, value) for key, value in table.items()}


def _rounds(rounds: list[dict[str, Any]]) -> Iterator[Rows]:
    """Rounds of one kind once; what distinguishes them stands in the table of the arrangement."""
    for group in alike(rounds):
        names = [f"“{entry.get('name', '')}”" for entry in group]
        listed = ", ".join(names) if len(names) <= 4 else f"{names[0]} … {names[-1]}, {len(names)} alike"
        kind = {key: value for key, value in group[0].items() if key not in POSITION_KEYS}
        yield Rows(f"Round {listed}" if len(names) == 1 else f"Rounds {listed}", tuple(_flat("", kind)))


def _flat(prefix: str, table: dict[str, Any]) -> Iterator[Row]:
    """Rows of a table and of the tables in it; an entry of a list of tables is one row."""
    nested = []
    for key, value in table.items():
        name = f"{prefix}{_words(key)}"
        if _is_table(value):
            nested.append((name, value))
        elif key != "notes":  # pages of text, kept in case.toml
            yield of_case(name, value)
    for name, value in nested:
        if isinstance(value, dict):
            yield from _flat(f"{name} · ", value)
            continue
        for index, entry in enumerate(value, start=1):
            rows = list(_flat("", entry))
            text = "; ".join(f"{one.name} {one.value}" for one in rows)
            yield Row(f"{name} {index}" if len(value) > 1 else name, text)


def _is_table(value: object) -> bool:
    return isinstance(value, dict) or (isinstance(value, list) and bool(value) and isinstance(value[0], dict))


def _words(key: str) -> str:
    return key.replace("_", " ")
