"""Results of a limit: limit.json, limit.csv, and a table on the terminal."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError
from fragfield.hazard.certainty import whole_metres
from fragfield_base.writing import csv_table, write_text

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path


_COLUMNS = {
    "rounds": "rounds",
    "explosive": "net_explosive_quantity_kg",
    "recommended": "recommended_m",
    "standard_error": "standard_error_m",
    "to_apply": "to_apply_m",
    "met": "met",
    "state": "state",
    "exit_code": "exit_code",
}


def write_limit(found: Mapping[str, Any], folder: Path) -> None:
    """Write limit.json and limit.csv, one row a run computed; raises InputError where they cannot be written."""
    write_text(folder / "limit.json", json.dumps(found, indent=1, allow_nan=False) + "\n", InputError)
    rows = [["run", found["key"], *_COLUMNS.values(), "reasons"]]
    for row in found["runs"]:
        value = str(row["values"][found["key"]])
        rows.append([row["name"], value, *(row[key] for key in _COLUMNS), "; ".join(row["reasons"])])
    write_text(folder / "limit.csv", csv_table(rows), InputError)


def limit_words(found: Mapping[str, Any]) -> str:
    """The limit in one sentence."""
    limit = found["limit"]
    if limit is None:
        return f"limit: none, so that {found['criteria']}"
    quantity = "" if limit["explosive"] is None else f", net explosive quantity {limit['explosive']:.3g} kg"
    rounds = f"{limit['rounds']} round{'' if limit['rounds'] == 1 else 's'}"
    return f"limit: {rounds} ({found['key']} = {limit['value']}{quantity}), so that {found['criteria']}"


def print_limit(found: Mapping[str, Any]) -> None:
    """Print one line a run computed, the limit, and what is to be known of it."""
    from rich.table import Table
    from rich.text import Text

    from fragfield.terminal.show import plain_console

    console = plain_console(wide=200)
    table = Table(box=None, pad_edge=False)
    for head in (found["key"], "rounds", "net explosive kg", "recommended m", "to apply m", "", "criteria", ""):
        table.add_column(Text(head), justify="right" if head not in ("", "criteria") else "left", no_wrap=True)
    for row in found["runs"]:
        explosive = "-" if row["explosive"] is None else f"{row['explosive']:.4g}"
        distances = (whole_metres(row[key], "-") for key in ("recommended", "to_apply"))
        cells = [str(row["values"][found["key"]]), str(row["rounds"]), explosive, *distances, row["state"]]
        cells += ["met" if row["met"] else "not met", "; ".join(row["reasons"])]
        table.add_row(*map(Text, cells))
    console.print(table)
    console.print("recommended: the computed distance; to apply: for storage and handling, by whatever is largest")
    for words in dict.fromkeys(row["results"]["not_included"] for row in found["runs"]):
        if words:
            console.print(f"the recommended distances do not include {words}")
    console.print(limit_words(found))
    for words in found["words"]:
        console.print(words)
    console.print(f"written to {found['directory']}")
