"""What moves the hazardous fragment distance: grid index, bars, bootstrap, and the study on made-up bursts."""

from __future__ import annotations

import json
import tomllib

import numpy as np
import pytest

from validation.__main__ import main
from validation.grid import grid_index
from validation.runs import ROOT, changed_case
from validation.sensitivities import check, variations
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


def _response(variation, distance=70.0, speed=980.0, error=1.0, cells=40000):
    draws = distance + error * np.linspace(-1.0, 1.0, 11)
    return Response(variation, speed, 1350.0, np.array([2200, 2220]), distance, draws, cells)


BASE = _response(variations.base())


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
