"""The catalogue of output quantities: complete, read by every view, one entry for a new output."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from docs.hooks.reference import summary_reference
from fragfield.quantities import QUANTITIES, quantity, schema, shown
from fragfield.report import read_run
from fragfield.report.tables.stages import quantity_rows
from fragfield.studies.compare import compare_runs
from fragfield.studies.sweep.results import results_of
from fragfield.terminal.show import summary_text


def faults(value: object, entry: dict, path: str = "") -> list[str]:
    """Where a summary is not as the schema says: keys unknown or missing, another type."""
    if "$ref" in entry:
        entry = schema()["$defs"][entry["$ref"].rpartition("/")[2]]
    if "anyOf" in entry:
        return [] if any(not faults(value, one, path) for one in entry["anyOf"]) else [f"{path}: {value!r}"]
    kinds = {"object": dict, "array": list, "string": str, "boolean": bool, "null": type(None), "integer": int}
    named = entry.get("type", [])
    allowed = tuple(kinds.get(one, (int, float)) for one in ([named] if isinstance(named, str) else named))
    flat = tuple(kind for one in allowed for kind in (one if isinstance(one, tuple) else (one,)))
    if flat and (not isinstance(value, flat) or (isinstance(value, bool) and bool not in flat)):
        return [f"{path}: {value!r}"]
    found = []
    if isinstance(value, dict):
        known, others = entry.get("properties", {}), entry.get("additionalProperties", True)
        found += [f"{path}.{key} is missing" for key in entry.get("required", ()) if key not in value]
        for key, one in value.items():
            if key not in known and others is False:
                found.append(f"{path}.{key} is unknown")
            of_one = known.get(key, others if isinstance(others, dict) else {})
            found += faults(one, of_one, f"{path}.{key}")
    if isinstance(value, list):
        found += [fault for one in value for fault in faults(one, entry.get("items", {}), f"{path}[]")]
    return found


def test_a_run_has_what_the_schema_says_and_nothing_else(whole_run):
    summary = json.loads((whole_run[0] / "summary.json").read_text())
    assert faults(summary, schema()) == []
    assert faults({**summary, "speed": 1.0}, schema()) == [".speed is unknown"]
    del summary["burst"]["cells"]
    assert faults(summary, schema()) == [".burst.cells is missing"]


def test_names_of_a_view_are_different_and_units_are_known():
    for view in ("sweep", "convergence", "uncertainty"):
        names = [one.name for one in shown(view)]
        assert len(names) == len(set(names))
    units = "m m2 m/s s kg kg/m3 kg.m2/s J J/m2 Pa rad deg 1/m2 1/s 1/sr byte".replace(".", " ").split()
    assert {one.unit for one in QUANTITIES.values()} <= {"", "kg m2/s", *units}
    assert all(one.label for one in QUANTITIES.values())


def test_an_unknown_path_is_refused_with_the_nearest():
    with pytest.raises(KeyError, match=r"burst.mean_initial_sped: no such value of summary.json.*mean_initial_speed"):
        quantity("burst.mean_initial_sped")


def test_distances_are_rounded_up_where_they_are_to_be_kept():
    assert quantity("hazard.recommended").row(81.2).value == "82\u00a0m"
    assert quantity("hazard.largest_throw").row(81.2).value == "81\u00a0m"


def test_a_new_output_is_one_entry(reported_pair, monkeypatch):
    """Its computation puts it into the summary; the views list it from its entry."""
    views = ("terminal", "report", "sweep", "compare", "convergence")
    new = replace(
        quantity("burst.casing_mass"), path="burst.melt_mass", name="melt_mass", label="Mass of melt", views=views
    )
    monkeypatch.setitem(QUANTITIES, new.path, new)
    run = read_run(reported_pair)
    run.summary["burst"]["melt_mass"] = 0.0123
    assert "mass of melt" in summary_text(run.summary)
    (table,) = quantity_rows(run, "Burst", "burst")
    assert [(row.value, row.si) for row in table.rows if row.name == "Mass of melt"] == [
        ("12.30\u00a0g", "0.01230\u00a0kg")
    ]
    assert results_of(run.summary)["melt_mass"] == 0.0123
    assert "| `melt_mass` | kg | Mass of melt |" in summary_reference()
    assert new in shown("convergence")
    assert compare_runs(reported_pair, reported_pair)["casing"]  # of runs that lack it, nothing is said
