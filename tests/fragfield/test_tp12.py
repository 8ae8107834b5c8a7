"""TP-12 beside a run: rounds counted from their places, the single round of a case, both distances in the outputs."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import transition
from fragfield.case import load_case
from fragfield.case.problem import break_up_settings
from fragfield.files.run_directory import RunDirectory
from fragfield.hazard.rules import BEAM, STACK, rules_of, stack_counts, tp12_part, tp12_rules
from fragfield.pipeline.job import Job, RunOptions
from fragfield.pipeline.parallel import Team
from fragfield.pipeline.single_round import REALISATIONS, SingleRound, single_round, single_round_case
from fragfield.terminal.progress import ProgressReporter
from tests.fragfield.plain_reports import leave_out_figures, plain_report
from tests.fragfield.short_run import invoke

BURST = """seed = 1
[burst]
cell_size = "12 mm"
end_time = "60 us"
energy_tolerance = 1.0
convergence = "off"
[break_up]
realisations = 2
[hazard]
max_realisations = 2
{hazard}
"""
TUBE = """[[round]]
name = "{name}"
profile = "tube"
explosive = "tnt"
casing = "steel_paper"
position = ["{x} m", "0 m", "1 m"]
{more}
"""


def grid(*numbers: int, step: float = 0.17) -> np.ndarray:
    return step * np.stack(np.meshgrid(*(np.arange(n) for n in numbers), indexing="ij"), axis=-1).reshape(-1, 3)


@pytest.mark.parametrize(
    ("places", "side", "top"),
    [
        (grid(1, 1, 1), 1, 1),
        (grid(2, 1, 1), 2, 2),
        (grid(4, 1, 1), 4, 4),
        (grid(2, 4, 1), 4, 8),
        (grid(2, 4, 3), 12, 8),
        (grid(2, 2, 2) * [1.0, 1.0, 4.0], 4, 4),
    ],
)
def test_rounds_are_counted_from_their_places(places, side, top):
    assert stack_counts(places) == (side, top)
    assert stack_counts(places + np.array([10.0, -3.0, 1.0])) == (side, top)


def case_of(tmp_path, *rounds: str, hazard: str = "", tail: str = ""):
    file = tmp_path / "case.toml"
    file.write_text(BURST.replace("{hazard}", hazard) + "".join(rounds) + tail, encoding="utf-8")
    return load_case(file)


def tube(name: str, x: float, more: str = "") -> str:
    return TUBE.format(name=name, x=x, more=more)


def test_the_single_round_of_equal_rounds_is_one_of_them_alone(tmp_path):
    late = 'ignition = [{ station = "nose", delay = "20 us" }]'
    waits = 'ignition = []\n[round.initiation]\npressure = "5 GPa"'
    case = case_of(tmp_path, tube("a", 0.0, late), tube("b", 0.3, "axis = [0, 0, -1]"), tube("c", 0.6, waits))
    alone, reason = single_round_case(case)
    assert reason == ""
    (one,) = alone.round
    assert (one.position, one.axis, one.initiation) == ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), None)
    assert [point.delay for point in one.ignition] == [0.0]
    assert one.profile == case.round[0].profile
    assert alone.burst.cell_size == case.burst.cell_size


@pytest.mark.parametrize(
    ("rounds", "reason"),
    [
        ([tube("a", 0.0), tube("b", 0.3).replace('"tnt"', '"comp_b"')], "differ in contents or casing"),
        ([tube("a", 0.0), tube("b", 0.3, 'ignition = [{ station = "base" }]')], "initiated at different points"),
        ([tube("a", 0.0, 'ignition = [{ offset = ["5 mm", "0 mm"] }]')] * 1, "initiated off its axis"),
    ],
)
def test_rounds_that_differ_have_no_single_round(tmp_path, rounds, reason):
    alone, found = single_round_case(case_of(tmp_path, *rounds))
    assert alone is None
    assert reason in found


def test_without_a_single_round_the_rules_say_why(tmp_path):
    case = case_of(tmp_path, tube("a", 0.0), tube("b", 0.3).replace('"tnt"', '"comp_b"'))
    found = rules_of(case, SingleRound(None, "no single round: the rounds differ in contents or casing"))
    beam, stack = found.rules[:2]
    assert (beam.name, stack.name) == (BEAM, STACK)
    for rule in (beam, stack):
        assert rule.distance is None
        assert "the rounds differ" in rule.inputs
        assert "the rounds differ" in rule.reason


@pytest.mark.parametrize(
    ("table", "number"),
    [("", 0.9 * 2 + 0.1 * 2), ('cover = "earth"\n', 0.7 * 2 + 0.1 * 2), ("side = 12\ntop = 8\n", 0.9 * 12 + 0.1 * 8)],
)
def test_the_case_says_how_the_rule_counts(tmp_path, table, number):
    case = case_of(
        tmp_path,
        tube("a", 0.0),
        tube("b", 0.3),
        tail=f"[hazard.stack_rule]\n{table}",
    )
    part = tp12_part(case, single())
    assert part.stack.effective_number == pytest.approx(number)
    (beam, stack) = tp12_rules(case, part)
    assert f"N_E = {number:.3g} of" in stack.inputs
    assert stack.distance == part.stack.distance > beam.distance
    alone = case.model_copy(update={"round": case.round[:1]})
    assert [rule.name for rule in tp12_rules(alone, tp12_part(alone, single()))] == [BEAM]


def single() -> SingleRound:
    """A round whose fragments leave about 94 degrees from its nose."""
    from fragfield.hazard.tp12 import PolarField

    generator = np.random.default_rng(1)
    number = 30_000
    mass = 0.005 * np.log(generator.random(number)) ** 2
    return SingleRound(PolarField(generator.normal(94.0, 5.0, number), mass, np.full(number, 1100.0), 12), "a test")


@pytest.mark.parametrize(
    ("key", "value", "longer"),
    [
        ("energy", "40 J", True),
        ("energy", "200 J", False),
        ("density", "1 / (30 m^2)", False),
        ("density", "1 / (200 m^2)", True),
    ],
)
def test_both_distances_use_the_criteria_of_the_case(tmp_path, key, value, longer):
    rounds = (tube("a", 0.0), tube("b", 0.3))
    usual = tp12_part(case_of(tmp_path, *rounds), single())
    other = tp12_part(case_of(tmp_path, *rounds, hazard=f'{key} = "{value}"'), single())
    for name in ("beam", "stack"):
        assert (getattr(other, name).distance > getattr(usual, name).distance) == longer


def test_drag_and_air_of_the_case_count(tmp_path):
    rounds = (tube("a", 0.0), tube("b", 0.3))
    usual = tp12_part(case_of(tmp_path, *rounds), single())
    thin = tp12_part(
        case_of(tmp_path, *rounds, tail='[flight]\nair = { model = "standard", altitude = "3000 m" }\n'), single()
    )
    assert thin.beam.distance > usual.beam.distance
    assert thin.stack.distance > usual.stack.distance
    smooth = tp12_part(case_of(tmp_path, *rounds, tail="[flight]\ndrag = 0.6\n"), single())
    assert smooth.beam.distance > usual.beam.distance
    assert smooth.stack == usual.stack  # the paper's own C_D


@pytest.mark.dolfinx
def test_the_single_round_is_that_of_the_runs_own_realisations_unless_they_are_tilted(tmp_path):
    path, folder = tmp_path / "case.toml", RunDirectory(tmp_path / "run")
    path.write_text(BURST.format(hazard="") + tube("a", 0.0), encoding="utf-8")
    assert invoke("burst", path, "--out", folder.path).exit_code in (0, 3)
    job = Job(load_case(path), folder, folder, Team(), ProgressReporter(enabled=False), RunOptions(path))
    broken = transition.BreakUp(folder.file("burst_snapshot.h5"), break_up_settings(job.case))
    own, others = (broken.many(seed, range(REALISATIONS)) for seed in (job.case.seed, 99))
    tilted = job.case.break_up.model_copy(update={"tilt": 0.2})
    tilted_job = replace(job, case=job.case.model_copy(update={"break_up": tilted}))

    def speeds(job, realisations):
        return single_round(job, realisations).field.speed

    again = speeds(job, own[:-1])  # too few
    assert np.array_equal(speeds(job, own), again)
    assert not np.array_equal(speeds(job, others), again)
    assert np.array_equal(speeds(tilted_job, others), again)


@pytest.mark.dolfinx
def test_single_lying_and_stacked_rounds_have_the_same_beam(tmp_path, monkeypatch):
    """The single round's own burst, lying or upright, and the burst beside a pair's give one beam distance."""
    leave_out_figures(monkeypatch)
    cases = {
        "upright": tube("a", 0.0),
        "lying": tube("a", 0.0, "axis = [1, 0, 0]"),
        "pair": tube("a", 0.0) + tube("b", 0.3),
    }
    parts = {}
    for name, rounds in cases.items():
        (tmp_path / f"{name}.toml").write_text(BURST.format(hazard="") + rounds, encoding="utf-8")
        done = invoke("run", tmp_path / f"{name}.toml", "--out", tmp_path / name)
        assert done.exit_code in (0, 3), done.stderr
        parts[name] = json.loads((tmp_path / name / "summary.json").read_text())["rules"]["tp12"]
        assert "TP-12: beam of the single round" in done.stdout
        assert ("TP-12: rule for stacks" in done.stdout) == (name == "pair")
    assert parts["upright"]["single_round"] == "this run's burst"
    assert "alone, burst in its meridian with cells of 12 mm" in parts["pair"]["single_round"]
    assert parts["upright"]["beam"]["distance"] > 10.0
    for name in ("lying", "pair"):
        # Fragments are placed at random in the frame of the world: eight seeds of this case spread by 0.9 %, and the
        # bound is three standard deviations of a difference of two.
        assert parts[name]["beam"]["distance"] == pytest.approx(parts["upright"]["beam"]["distance"], rel=0.038), name
    assert parts["pair"]["stack"]["distance"] > parts["pair"]["beam"]["distance"]
    assert parts["upright"]["stack"] is None
    table = plain_report(tmp_path / "pair").tables["Distances by rules, compared with the computed one"]
    assert [row[0] for row in table[2:4]] == [BEAM, STACK]
    metres = [math.ceil(parts["pair"][name]["distance"]) for name in ("beam", "stack")]
    assert [row[2] for row in table[2:4]] == [f"{one}" for one in metres]
