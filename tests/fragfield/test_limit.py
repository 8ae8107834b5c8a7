"""The largest number of rounds: plan, criteria, bisection, what is said where the distance does not rise."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import pytest

import fragfield
from fragfield.files.run_directory import RunDirectory
from fragfield.hazard.contents import with_images
from fragfield.hazard.recommended import recommended_of
from fragfield.hazard.to_apply import distance_to_apply
from fragfield.results.convergence import Convergence
from fragfield.results.hazard import Hazard
from fragfield.results.rules import Official, Rule, Rules
from fragfield.results.site import ExposedSite
from fragfield.results.summary import Summary
from fragfield.studies.limit import LimitRow, judge, limit_of
from fragfield.studies.workers import Outcome
from tests.fragfield.example_results import example
from tests.fragfield.run_tasks import in_threads
from tests.fragfield.short_run import invoke

ROW = """title = "row"
[burst]
cell_size = "14 mm"
geometry = "3d"
end_time = "12 us"
energy_tolerance = 1.0
output = { interval = "4 us" }
[[round]]
name = "tube"
profile = "tube"
explosive = "tnt"
casing = "steel_paper"
position = ["0 m", "0 m", "1 m"]
[stack]
arrangement = "row"
count = 2
gap = "20 mm"
[break_up]
realisations = 4
[hazard]
max_realisations = 4
"""
SITE = '[[exposed]]\nname = "gate"\nkind = "person"\nposition = ["100 m", "0 m"]\n'


@pytest.fixture
def case_file(tmp_path) -> Path:
    path = tmp_path / "row.toml"
    path.write_text(ROW, encoding="utf-8")
    return path


@pytest.fixture
def computed(monkeypatch):
    """Runs that give a distance by their number of rounds, in place of a computation; their numbers are listed."""
    law = {
        "distance": lambda rounds: 50.0 * rounds ** (1.0 / 3.0),
        "met": lambda rounds: True,
        "code": lambda rounds: 0,
    }
    made: list[int] = []

    def call(task):
        rounds = len(with_images(task.case))
        made.append(rounds)
        if code := law["code"](rounds):
            return Outcome(code, "cell 7 is lost")
        distance = law["distance"](rounds)
        hazard = {"determined": distance is not None, "reason": "airborne", "expected": distance, "upper": distance,
                  "standard_error": 1.0}  # fmt: skip
        not_computed = Convergence(reason="no grid convergence: not computed for the runs of a sweep")
        hazard = recommended_of(example(Hazard, **hazard), not_computed)
        sites = [{"name": one.name, "verdict": "met" if law["met"](rounds) else "not met"} for one in task.case.exposed]
        summary = Summary(
            hazard=hazard,
            exposed=tuple(example(ExposedSite, **one) for one in sites),
            rules=example(Rules, contents={"explosive": 5.0 * rounds}),
            distance_to_apply=distance_to_apply(hazard, None, []),
        )
        RunDirectory(task.directory).write_results(summary)
        return Outcome(0, "" if distance is not None else "airborne", task.results(summary))

    in_threads(monkeypatch, call)
    return made, law


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("stack.count", "needed: KEY=LOW..HIGH or KEY=VALUE,VALUE"),
        ("stack.count=3..3", "needed: a range that rises"),
        ("stack.count=5..2", "needed: a range that rises"),
        ("stack.count=1..2.5", "needed: whole numbers"),
        ("stack.count=1..201", "201 values; allowed: at most 200"),
        ("stack.count=3", "a single value; needed: two or more"),
        ("stack.count=3,2", "needed: values whose number of rounds rises"),
        ("stack.gap=20 mm,30 mm", "needed: values whose number of rounds rises"),
        ("stack.cuont=1..3", "stack.cuont"),
    ],
)
def test_faults_of_the_values_are_refused_before_anything_runs(case_file, computed, setting, message):
    done = invoke("limit", case_file, setting, "--distance", "90 m", "--out", case_file.parent / "runs")
    assert done.exit_code == 2
    assert message in done.stderr.replace("\n", " ")
    assert computed[0] == []


@pytest.mark.parametrize(
    ("distance", "message"),
    [(None, "nothing to meet"), ("300", "--distance: found"), ("0 m", "--distance: found"), ("3 kg", "--distance: f")],
)
def test_there_must_be_something_to_meet(case_file, computed, distance, message):
    given = [] if distance is None else ["--distance", distance]
    done = invoke("limit", case_file, "stack.count=1..4", *given, "--out", case_file.parent / "runs")
    assert done.exit_code == 2
    assert message in done.stderr
    assert computed[0] == []


@pytest.mark.parametrize(
    ("limit", "expected"),
    [(50.0 * 5 ** (1 / 3), 5), (50.0 * 5 ** (1 / 3) - 1e-6, 4), (50.0, 1)],
)
def test_bisection_finds_the_largest_number_in_few_runs(case_file, computed, limit, expected):
    made, law = computed
    found = fragfield.run_limit(
        case_file, {"stack.count": range(1, 21)}, distance=f"{limit!r} m", out=case_file.parent / "runs", progress=False
    )
    assert found.rounds == expected
    assert law["distance"](expected) <= limit < law["distance"](expected + 1)
    assert found.explosive == 5.0 * expected
    assert len(made) == len(set(made)) <= 2 + math.ceil(math.log2(19))
    assert (min(made), max(made)) == (1, 20)
    assert found.found.first_not_met.rounds == expected + 1
    assert found.table["rounds"].tolist() == sorted(made)
    assert str(found).startswith(f"limit: {expected} round")


def test_all_met_and_none_met_are_said(case_file, computed):
    folder = case_file.parent / "runs"
    everything = fragfield.run_limit(case_file, "stack.count=1..4", distance="1 km", out=folder, progress=False)
    assert everything.rounds == 4
    assert computed[0] == [1, 4] or computed[0] == [4, 1]
    assert "The largest number asked for, 4, meets the criteria; more may do so too." in everything.remarks
    assert any(
        "taken to meet the criteria since a larger number does: 2, 3 rounds" in one for one in everything.remarks
    )
    nothing = fragfield.run_limit(
        case_file, "stack.count=1..4", distance="10 m", out=folder, resume=True, progress=False
    )
    assert (nothing.rounds, nothing.explosive) == (0, 0.0)
    assert "Not even the smallest number, 1, meets the criteria." in nothing.remarks
    assert len(computed[0]) == 2  # both kept


def test_exposed_sites_bound_the_number_too(case_file, computed):
    case_file.write_text(ROW + SITE, encoding="utf-8")
    computed[1]["met"] = lambda rounds: rounds <= 3
    done = invoke("limit", case_file, "stack.count=1..8", "--out", case_file.parent / "runs", "--quiet", "--json")
    assert done.exit_code == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["limit"]["rounds"] == 3
    assert found["criteria"] == "the criterion of every exposed site is met"
    row = next(one for one in found["runs"] if one["rounds"] == 4)
    assert row["not_met"] == ["gate"]
    assert row["reasons"] == ["gate: not met"]


def test_resumed_search_computes_nothing_twice_and_writes_its_table(case_file, computed):
    made, _ = computed
    folder = case_file.parent / "runs"
    arguments = ("limit", case_file, "stack.count=1..20", "--distance", "90 m", "--out", folder)
    assert invoke(*arguments).exit_code == 0
    first = list(made)
    again = invoke(*arguments, "--resume")
    assert again.exit_code == 0, again.stderr
    assert made == first
    assert (
        "limit: 5 rounds (stack.count = 5, net explosive quantity 25 kg), so that the distance to apply for "
        "storage and handling is at most" in (again.stdout)
    )
    with (folder / "limit.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["rounds"]) for row in rows] == sorted(first)
    assert {row["met"] for row in rows} == {"True", "False"}
    assert json.loads((folder / "limit.json").read_text(encoding="utf-8"))["limit"]["rounds"] == 5


@pytest.mark.parametrize("kind", ["fails", "not determined"])
def test_a_run_that_fails_or_has_no_distance_counts_as_not_met(case_file, computed, kind):
    _, law = computed
    if kind == "fails":
        law["code"] = lambda rounds: 3 if rounds >= 4 else 0
    else:
        law["distance"] = lambda rounds: None if rounds >= 4 else 60.0
    done = invoke(
        "limit", case_file, "stack.count=1..8", "--distance", "1 km", "--out", case_file.parent / "runs", "-q", "--json"
    )
    assert done.exit_code == 3
    found = json.loads(done.stdout)
    assert found["limit"]["rounds"] == 3
    reason = "the run failed: cell 7 is lost" if kind == "fails" else "the distance is not determined"
    assert found["runs"][-1]["reasons"] == [reason]


def test_a_distance_that_falls_is_said_and_every_number_shows_what_bisection_misses(case_file, computed):
    computed[1]["distance"] = lambda rounds: 100.0 if rounds == 3 else 50.0 + rounds
    folder = case_file.parent / "runs"
    halved = fragfield.run_limit(case_file, "stack.count=1..8", distance="90 m", out=folder, progress=False)
    assert halved.rounds == 8
    assert any("taken to meet" in one and "2, 3, 4" in one for one in halved.remarks)
    every = fragfield.run_limit(
        case_file, "stack.count=1..8", distance="90 m", every=True, out=folder, resume=True, progress=False
    )
    assert every.rounds == 2
    assert sorted(computed[0]) == list(range(1, 9))
    assert (
        "Not monotonic: 4 rounds have a recommended distance of 54 m, 3 have 100 m (beyond the statistical error)."
        in every.remarks
    )
    assert any("Not monotonic: 4 rounds meet the criteria, 3 do not" in one for one in every.remarks)
    assert not any("taken to meet" in one for one in every.remarks)


def row(rounds: int, distance: float) -> LimitRow:
    found = LimitRow(str(rounds), "d", "", {"k": rounds}, rounds=rounds, met=True, recommended=distance)
    found.standard_error = 1.0
    return found


@pytest.mark.parametrize(("drop", "words"), [(0.0, None), (2.8, "within"), (2.9, "beyond")])
def test_a_fall_is_judged_by_two_standard_errors_of_the_difference(drop, words):
    found = limit_of([row(1, 80.0), row(2, 80.0 - drop)], asked=[1, 2])[2]  # 2 sqrt(2) = 2.83
    said = [one for one in found if one.startswith("Not monotonic")]
    assert len(said) == (words is not None)
    if words:
        assert f"({words} the statistical error)" in said[0]


@pytest.mark.parametrize(
    ("official", "rules", "reasons"),
    [
        (90.0, [], []),
        (90.1, [], ["91 m by the official hazardous fragment distance"]),
        (None, [("unknown item", 381.0, None)], ["381 m by the rule “unknown item” (fragments)"]),
        (None, [("by mass", None, 91.0)], ["91 m by the formula of “by mass”, which does not apply because too much"]),
        (None, [("by mass", None, 89.0)], []),
    ],
)
def test_official_distance_and_rules_must_not_exceed_the_given_one_either(official, rules, reasons):
    hazard = example(Hazard, determined=True, recommended=50.0, standard_error=1.0, largest_throw=99.0)
    part = official and example(Official, hazardous_fragment_distance=official, covers=True)
    entries = [
        example(
            Rule,
            name=name,
            use="siting",
            hazard="fragments",
            distance=distance,
            outside=outside,
            reason="" if distance else "too much",
            missing=True,
        )
        for name, distance, outside in rules
    ]
    summary = Summary(hazard=hazard, distance_to_apply=distance_to_apply(hazard, part, entries))
    found = row(1, 0.0)
    judge(found, summary, 90.0, exposed=False)
    assert (found.reasons, found.met) == (reasons, not reasons)


@pytest.mark.slow
def test_limit_of_a_computed_row(case_file):
    done = invoke(
        "limit", case_file, "stack.count=1..3", "--distance", "400 m", "--all", "--out", case_file.parent / "runs"
    )
    assert done.exit_code == 0, done.stderr
    found = json.loads((case_file.parent / "runs" / "limit.json").read_text(encoding="utf-8"))
    charge = found["runs"][0]["explosive"]
    assert [one["explosive"] for one in found["runs"]] == pytest.approx([charge, 2.0 * charge, 3.0 * charge])
    for one in found["runs"]:
        summary = RunDirectory(Path(one["directory"])).summary()
        assert one["recommended"] == summary["hazard"]["recommended"]
        assert one["to_apply"] == summary["distance_to_apply"]["siting"]["distance"]
        assert one["met"] == (one["to_apply"] <= 400.0)
    assert found["limit"] is not None
