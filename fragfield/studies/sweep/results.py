"""Results of a sweep: sweep.json, sweep.csv, and a table on the terminal."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError
from fragfield.hazard.certainty import whole_metres
from fragfield.hazard.recommended import not_included_words
from fragfield.quantities import column_of, shown
from fragfield.results.hazard import Recommended
from fragfield.studies.sweep.plan import labels_of
from fragfield_base.writing import csv_table, write_text

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path


DONE, KEPT, FAILED, WAITING = "done", "kept", "failed", "waiting"
"""States of a run: computed now, kept from before, ended with an error, not yet begun."""


def results_of(summary: Mapping[str, Any]) -> dict[str, Any]:
    """What a sweep lists of a summary, by name in SI, see `fragfield.quantities`; None for what was not computed.

    Beside these `not_included`, parts that the recommended distance does not include, and `wall_seconds` of burst and
    flight together.
    """
    times = [one for part in ("burst", "flight") if (one := (summary.get(part) or {}).get("wall_seconds")) is not None]
    return {
        **{one.name: one.of(summary) for one in shown("sweep")},
        "not_included": _not_included(summary.get("hazard")),
        "wall_seconds": sum(times) if times else None,
    }


def _not_included(hazard: Mapping[str, Any] | None) -> str:
    """In words; empty where nothing is known of the parts."""
    if not hazard or "parts" not in hazard:
        return ""
    names = ("recommended", "parts", "not_included")
    return not_included_words(Recommended.read({name: hazard[name] for name in names}))


def write_tables(found: Mapping[str, Any], folder: Path) -> None:
    """Write sweep.json and sweep.csv, one row a run; raises InputError where they cannot be written."""
    write_text(folder / "sweep.json", json.dumps(found, indent=1, allow_nan=False) + "\n", InputError)
    units = {one.name: one.unit for one in shown("sweep")}
    results = [column_of(name, units.get(name, "")) for name in results_of({})]
    table = [["run", *found["keys"], "state", "exit_code", *results, "message"]]
    for row in found["runs"]:
        values = [row["name"], *(row["values"][key] for key in found["keys"]), row["state"], row["exit_code"]]
        table.append([*values, *row["results"].values(), row["message"]])
    write_text(folder / "sweep.csv", csv_table(table), InputError)


def print_sweep(found: Mapping[str, Any]) -> None:
    """Print one line a run, and why runs failed."""
    from rich.table import Table
    from rich.text import Text

    from fragfield.terminal.show import plain_console

    console = plain_console(wide=200)
    table = Table(box=None, pad_edge=False)
    for label in labels_of(found["keys"]).values():
        table.add_column(Text(label), no_wrap=True)
    distances = found["stage"] == "run"
    table.add_column("", no_wrap=True)
    if distances:
        for head in ("recommended\ndistance m", "expected m", "single\nevents m", "throw m"):
            table.add_column(head, justify="right")
    for head in ("mean\nm/s", "99 % of\nmass m/s", "largest\nm/s", "ledger\n%", "lost\ncells"):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("time s", justify="right")
    for row in found["runs"]:
        results = row["results"]
        cells = [Text(str(row["values"][key])) for key in found["keys"]]
        cells += [
            Text(row["state"]),
            *map(Text, _distances(results) if distances else []),
            *map(Text, _numbers(results)),
        ]
        table.add_row(*cells, _number(results["wall_seconds"]))
    console.print(table)
    if distances:
        console.print("expected ± standard error; single events 5 to 95 % and largest throw are no distances to keep")
        for words in dict.fromkeys(row["results"]["not_included"] for row in found["runs"]):
            if words:
                console.print(f"the recommended distances do not include {words}")
    for row in found["runs"]:
        if row["state"] == FAILED:
            console.print(f"{row['name']} failed (exit code {row['exit_code']}): {row['message']}")
    console.print(f"written to {found['directory']}")


def _numbers(results: Mapping[str, Any]) -> list[str]:
    error = results["energy_error"]
    return [
        _number(results["mean_initial_speed"]),
        _number(results["speed_99"]),
        _number(results["max_initial_speed"]),
        "-" if error is None else f"{100.0 * error:.2f}",
        _number(results["lost_cells"]),
    ]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.0f}"


def _distances(results: Mapping[str, Any]) -> list[str]:
    if results["determined"] is False:
        return ["not determined", "-", "-", _number(results["largest_throw"])]
    distance, error = _number(results["expected_distance"]), results["expected_distance_standard_error"]
    low, high = _number(results["single_event_low"]), _number(results["single_event_high"])
    return [
        whole_metres(results["recommended_distance"], "-"),
        distance if error is None else f"{distance} ± {error:.1f}",
        "-" if low == "-" else f"{low} to {high}",
        _number(results["largest_throw"]),
    ]
