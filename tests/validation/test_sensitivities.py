"""What moves the hazardous fragment distance: grid index, bars, bootstrap, and the study on made-up bursts."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from validation.__main__ import main
from validation.grid import grid_index
from validation.runs import ROOT, STOPPED, StudyError, changed_case
from validation.sensitivities import check, figure, study, variations
from validation.sensitivities.responses import Response

CASE = ROOT / variations.REFERENCE["case"]


@pytest.mark.parametrize("order", [0.7, 1.0, 2.0])
def test_the_index_of_an_exact_power_holds_its_error(order):
    """F(h) = 100 - 0.3 h^p: the index is 1.25 times the true error of the finest size."""
    sizes = (6.0, 4.5, 3.375)
    found = grid_index(sizes, [100.0 - 0.3 * size**order for size in sizes])
    assert found.kind == "monotone"
    assert found.order == pytest.approx(order, abs=1e-6)
    assert found.limit == pytest.approx(100.0, abs=1e-6)
    finest = 100.0 - 0.3 * 3.375**order
    assert found.index == pytest.approx(1.25 * (100.0 - finest) / finest, rel=1e-6)


def test_sizes_count_by_their_ratios_only():
    values = (90.0, 95.0, 97.0)
    assert grid_index((6.0, 4.5, 3.375), values).index == pytest.approx(grid_index((16.0, 12.0, 9.0), values).index)


def test_an_order_above_that_of_the_scheme_is_not_used():
    """F(h) = 100 - h^5/100 looks converged; the index keeps to order 2: 1.25 (f1 - f2)/f1/(r^2 - 1)."""
    sizes = (4.0, 2.0, 1.0)
    f3, f2, f1 = (100.0 - 0.01 * size**5 for size in sizes)
    found = grid_index(sizes, (f3, f2, f1))
    assert found.order == pytest.approx(5.0, abs=1e-6)
    assert found.limit == pytest.approx(f1 + (f1 - f2) / 3.0)
    assert found.index == pytest.approx(1.25 * (f1 - f2) / f1 / 3.0)


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        ((10.0, 12.0, 11.0), "oscillatory"),
        ((10.0, 10.1, 12.0), "not converging"),
        ((10.0, 12.0, 12.0), "not converging"),
    ],
)
def test_without_an_order_the_range_is_what_is_stated(values, kind):
    found = grid_index((4.0, 2.0, 1.0), values)
    assert (found.kind, found.order, found.limit) == (kind, None, None)
    assert found.index == pytest.approx(3.0 * 2.0 / values[-1] / 3.0)


ALL = [one for parameter in variations.parameters() for one in parameter.variations]


@pytest.mark.parametrize("variation", ALL, ids=lambda one: one.name)
def test_a_variation_changes_its_parameter_alone(variation):
    base = tomllib.loads(changed_case(CASE, variations.base().all_changes))
    changed = tomllib.loads(changed_case(CASE, variation.all_changes))
    found = set(_differing(base, changed))
    assert found == {key.replace(".*.", ".0.") for key in variation.changes}
    assert bool(found) is (variation.parameter != "cell_size")
    assert (variation.size != variations.base().size) is (variation.parameter == "cell_size")


def _differing(one, other, path=""):
    if isinstance(one, dict):
        for key in one:
            yield from _differing(one[key], other[key], f"{path}.{key}" if path else key)
    elif isinstance(one, list) and len(one) == len(other):
        for number, (first, second) in enumerate(zip(one, other, strict=True)):
            yield from _differing(first, second, f"{path}.{number}")
    elif one != other:
        yield path


@pytest.mark.parametrize("name", [name for name in variations.REFERENCE["parameters"] if name != "cell_size"])
def test_the_base_has_the_values_that_the_reference_says(name):
    changes = variations._CHANGES[name](variations.REFERENCE["parameters"][name]["base"])
    assert changed_case(CASE, changes) == changed_case(CASE, {})


def test_heat_and_hourglass_are_multiples_of_the_cases_own():
    heat = next(one for one in ALL if one.name == "sensitivities_heat_0_9")
    document = tomllib.loads(changed_case(CASE, heat.all_changes))
    assert float(document["round"][0]["explosive"]["heat_of_detonation"].split()[0]) == pytest.approx(0.9 * 4.52e6)
    double = next(one for one in ALL if one.name == "sensitivities_hourglass_2")
    document = tomllib.loads(changed_case(CASE, double.all_changes))
    assert document["burst"]["hourglass"] == {
        "charge_viscous": 0.2, "casing_viscous": 0.06, "casing_stiffness": 0.06,
    }  # fmt: skip


def test_names_of_runs_differ_and_a_given_size_is_that_of_all():
    every = [variations.base(), *ALL]
    assert len({one.name for one in every}) == len(every)
    given = variations.parameters(size="10 mm")
    assert "cell_size" not in {one.name for one in given}
    assert {one.size for parameter in given for one in parameter.variations} == {"10 mm"}


def _response(variation, distance=70.0, speed=980.0, error=1.0, cells=40000):
    draws = distance + error * np.linspace(-1.0, 1.0, 11)
    return Response(variation, speed, 1350.0, np.array([2200, 2220]), distance, draws, cells)


def _answers(name, changes):
    parameter = next(one for one in variations.parameters() if one.name == name)
    responses = [_response(one, 70.0 + change) for one, change in zip(parameter.variations, changes, strict=True)]
    return check.Answers(parameter, BASE, tuple(responses))


BASE = _response(variations.base())


def test_the_longest_bar_comes_first_and_holds_the_base():
    found = [
        _answers("softening", (0.5, -0.5)),
        _answers("heat", (-4.0, -2.0, 2.0, 3.0)),
        _answers("leakage", (1, 5, 6)),
    ]
    empty = check.Answers(variations.parameters()[2], BASE, ())
    bars = check.tornado([*found, empty])
    assert [bar.words.split()[0] for bar in bars] == ["heat", "leakage", "softening"]
    assert [bar.swing for bar in bars] == pytest.approx([7.0, 6.0, 1.0])
    assert (bars[0].low_value, bars[0].high_value) == ("0.9", "1.1")
    assert (bars[1].low, bars[1].low_value, bars[1].low_error) == (0.0, "1.75", 0.0)  # the base is its least


def test_common_random_numbers_make_differences_sharper_than_values():
    other = _response(variations.base(), 72.0)
    assert BASE.error > 0.5
    assert other.change(BASE) == pytest.approx(2.0)
    assert other.error_of_change(BASE) == pytest.approx(0.0, abs=1e-12)


def test_quadrature_and_hourglass_are_judged_and_the_rest_informs():
    hourglass = next(one for one in ALL if one.name == "sensitivities_hourglass_2")
    rows = check.rows_of(_response(hourglass, speed=980.0 * 1.011), BASE)
    assert [row.passed for row in rows] == [False, None, None, None]
    assert check.rows_of(_response(hourglass, speed=980.0 * 0.991), BASE)[0].passed is True
    leakage = check.rows_of(_response(ALL[0], 75.0), BASE)
    assert {row.passed for row in leakage} == {None}
    assert leakage[-1].quantity.startswith("leakage radius 1.6: hazardous fragment distance (standard error ")
    assert leakage[-1].error == pytest.approx(5.0 / 70.0)


@pytest.mark.parametrize(("slope", "passed"), [(5.0, True), (40.0, False)])
def test_the_grid_index_of_the_mean_speed_is_judged(slope, passed):
    sizes = (6.0, 4.5, 3.375)
    family = [
        _response(variations.base(size=f"{size} mm"), speed=1000.0 - slope * size, cells=round(1e7 / size**3))
        for size in sizes
    ]
    rows = check.grid_rows(family)
    assert rows[0].quantity == "grid convergence index: mean initial speed at 3.375 mm"
    assert rows[0].passed is passed
    assert "monotone, order 1" in rows[0].source
    assert rows[1].reference == pytest.approx(1000.0, rel=1e-3)
    others = [row for row in rows if row.quantity.startswith("grid") and row is not rows[0]]
    assert [row.passed for row in others] == [None, None, None]
    assert all("not converging" in row.source for row in others)  # they do not change at all


def test_the_grid_index_needs_its_whole_family():
    cells = next(one for one in variations.parameters() if one.name == "cell_size")
    answers = check.Answers(cells, BASE, tuple(_response(one) for one in cells.variations))
    assert [one.variation.size for one in study._family([answers], BASE)] == ["6 mm", "4.5 mm", "3.375 mm"]
    short = check.Answers(cells, BASE, tuple(one for one in answers.responses if one.variation.size != "4.5 mm"))
    assert study._family([short], BASE) == []


class MadeUpRuns:
    """Runs that are remembered, not made."""

    def __init__(self, folder, stops=()):
        self.folder, self.made, self.stops = folder, [], stops

    def run(self, name, case, size, changes=None, *, stage="run", geometry="3d"):
        """Remember what is asked for; some stop."""
        assert (case, stage) == (variations.REFERENCE["case"], "burst")
        self.made.append((name, size, dict(changes)))
        if name in self.stops:
            raise StudyError("stopped", STOPPED)
        return Path(name)


def _summary(folder):
    error = 0.02 if "softening" in folder.name else 0.004
    return {
        "burst": {
            "energy_error_at_outputs": error, "contact_error_at_end": 0.001, "lost_cells": 0, "cell_size": 6e-3,
            "acceleration_complete": 1.7e-4,
            "end_time": 2e-4, "cells": 40000,
        }
    }  # fmt: skip


def _touched(path):
    path.touch()
    return path


def _run(monkeypatch, tmp_path, arguments, stops=()):
    fake = MadeUpRuns(tmp_path, stops)
    cells = {"8 mm": 18000, "6 mm": 42000, "4.5 mm": 99000, "3.375 mm": 235000}

    def respond(folder, variation, burst, realisations, threads):
        assert realisations == variations.REFERENCE["quick_realisations" if "--quick" in arguments else "realisations"]
        moved = 4.0 - variation.value if variation.parameter == "prefactor" else 0.0
        return _response(variation, 70.0 + moved, cells=cells.get(variation.size, 5000))

    monkeypatch.setattr(study, "draw", lambda answers, ends, path: _touched(path))
    monkeypatch.setattr(study, "draw_tornado", lambda bars, base, path: _touched(path))
    monkeypatch.setattr(study, "summary_of", _summary)
    monkeypatch.setattr(study, "respond", respond)
    monkeypatch.setattr("validation.__main__.Runs", lambda *_, **__: fake)
    return main(["sensitivities", "--json", *arguments]), fake


def test_a_burst_that_stops_or_is_open_is_reported_and_the_others_go_on(monkeypatch, tmp_path, capsys):
    code, fake = _run(monkeypatch, tmp_path, [], stops=("sensitivities_quadrature_8",))
    rows = json.loads(capsys.readouterr().out)
    assert code == 1
    missed = [row["quantity"] for row in rows if row["passed"] is False]
    assert missed[0] == "points of a casing's cell 8: bursts that stopped"
    assert missed[1:] == [f"softening limits {value}: energy error at the outputs" for value in ("0.25", "1")]
    assert not any("softening" in row["quantity"] for row in rows if "speed" in row["quantity"])
    names = [name for name, *_ in fake.made]
    assert len(names) == len(set(names))  # every burst once
    assert not any("prefactor" in name for name in names)  # needs none
    assert all(changes["burst.stop"] == "time" for *_, changes in fake.made)
    made = sorted(path.name for path in tmp_path.glob("*.png"))
    drawn = ("cell_size", "heat", "hourglass", "leakage", "prefactor", "tornado")
    assert made == [f"sensitivities_{name}.png" for name in drawn]
    table = (tmp_path / "sensitivities.md").read_text(encoding="utf-8")
    assert "| Mott's factor 6 | 980 | 1350 | 2210 | 68.0 ± 0.7 | -2.0 ± 0.0 |" in table


def test_a_base_that_stops_ends_the_study_with_its_code(monkeypatch, tmp_path, capsys):
    code, _ = _run(monkeypatch, tmp_path, [], stops=("sensitivities_base",))
    assert code == STOPPED
    assert capsys.readouterr().err == "validation: sensitivities: stopped; no row was computed before it\n"


def test_the_quick_study_is_a_few_coarse_bursts(monkeypatch, tmp_path, capsys):
    code, fake = _run(monkeypatch, tmp_path, ["--quick"])
    rows = json.loads(capsys.readouterr().out)
    assert code == 0
    assert len(fake.made) <= 4
    assert {size for _, size, _ in fake.made} == {"12 mm"}
    assert not any("grid convergence" in row["quantity"] for row in rows)


def test_axes_are_shared_so_that_what_is_flat_looks_flat():
    flat, steep = _answers("hourglass", (0.0, 0.0)), _answers("softening", (7.0, -14.0))
    ends = figure.scales([flat, steep])
    assert ends["distance"][0] < 0.8
    assert ends["distance"][1] > 1.1
    low, high = ends["mean_speed"]  # all alike: a narrow axis about them, not none
    assert 0.98 < low < 1.0 < high < 1.02


def test_both_kinds_of_figures_are_drawn(tmp_path):
    answers = _answers("leakage", (-1.0, 2.0, 3.0))
    drawn = [
        figure.draw(answers, figure.scales([answers]), tmp_path / "leakage.png"),
        figure.draw_tornado(check.tornado([answers]), BASE, tmp_path / "tornado.png"),
    ]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in drawn)


@pytest.mark.slow
@pytest.mark.dolfinx
def test_the_quick_study_on_real_bursts(tmp_path, capsys):
    assert main(["sensitivities", "--quick", "--json", "--out", str(tmp_path)]) == 0
    rows = {row["quantity"].split(" (")[0]: row for row in json.loads(capsys.readouterr().out)}
    assert rows["heat of detonation over 4.52 MJ/kg 0.9: mean initial speed"]["error"] < 0.0
    assert rows["leakage radius 2.1: mean initial speed"]["error"] > 0.0
    assert rows["Mott's factor 2: mean initial speed"]["error"] == 0.0
    assert rows["Mott's factor 2: fragments"]["error"] == pytest.approx(1.0, abs=0.05)
    assert rows["Mott's factor 2: hazardous fragment distance"]["error"] > 0.0
