"""Tables made from the program's own lists: rules, kinds of ricochet, tables of a run, default uncertain inputs."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from docs.hooks.reference import cell, rows
from flight.scene.ricochet import KINDS
from fragfield.hazard.rules import LEFT_OUT, rules_for
from fragfield.interface.tables import TABLES
from fragfield.results.rules import Contents

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["published_rules", "ricochet_kinds", "run_tables", "uncertain_inputs"]


def published_rules() -> str:
    """Every rule with its formula, range and source; below, those left out and why."""
    two_rounds = Contents(
        explosive=1.0,
        tnt=1.0,
        all_up=10.0,
        largest_round=5.0,
        rounds=2,
        in_a_row=True,
        clearance=1.0,
        charge_diameter=0.1,
    )
    body = [[cell(one.name), one.hazard, cell(one.formula), cell(one.range), cell(one.source)]
            for one in rules_for(two_rounds)]  # fmt: skip
    left_out = "\n".join(f"- {words}" for words in LEFT_OUT)
    return f"{rows('rule, against, formula, range, source', body)}\n\nLeft out:\n\n{left_out}"


def ricochet_kinds() -> str:
    """Nominal law of every kind of ground, with its standing."""
    body = []
    for name, law in KINDS.items():
        numbers = (law.critical_angle, law.speed_kept, law.departure, law.roughness)
        body.append([f"`{name}`", *(f"{value:g}" for value in numbers), cell(law.source)])
    return rows("kind, $a_c$ (degrees), $k$, $r$, $q$ (degrees), standing", body)


def run_tables() -> str:
    """Every table of a run."""
    return rows("table, what", [(f"`{name}`", cell(what)) for name, (_, what) in TABLES.items()])


def uncertain_inputs() -> str:
    """The default uncertain inputs with distribution and source."""
    text = (files("fragfield") / "data" / "uncertain_inputs.toml").read_text(encoding="utf-8")
    body = [[cell(name), cell(_distribution(entry)), cell(entry["source"].replace("{label}", "counted fragments"))]
            for name, entry in _entries(tomllib.loads(text))]  # fmt: skip
    return rows("input, distribution, source", body)


def _entries(values: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Name and entry of every input; those of `yield` by casing."""
    for key, entry in values.items():
        if "distribution" in entry:
            yield entry["name"], entry
        else:
            yield from ((f"{key} strength of {name}", one) for name, one in entry.items())


def _distribution(entry: dict[str, Any]) -> str:
    keys = ("low", "mean", "mode", "median", "standard_deviation", "factor", "high")
    numbers = ", ".join(f"{key.replace('_', ' ')} {entry[key]}" for key in keys if key in entry)
    how = {"factor": "factor", "shift": "shift"}.get(entry.get("applies", ""), "")
    return ", ".join(filter(None, [how, entry["distribution"], numbers]))
