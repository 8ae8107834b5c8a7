"""Numbers, laws, mesh quality and warnings of the report, each against a value known beforehand."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pint
import pytest

import fragfield
from docs.hooks.reference import summary_reference
from fragfield.case import CaseTable
from fragfield.interface.results import Run
from fragfield.numbers import _LADDERS, UNKNOWN, number, with_unit
from fragfield.quantities import QUANTITIES, numbers_of, quantity, shown
from fragfield.report.assemble import code_words
from fragfield.report.figures.burst import number_above
from fragfield.report.findings import findings
from fragfield.results.summary import Summary
from fragfield.results.words import margin_metres, metres, metres_and_error, whole_metres
from fragfield.studies.sweep import results_of
from fragfield.terminal.show import summary_text
from tests.fragfield.example_results import example
from tests.fragfield.synthetic_run import run_of

UNITS = pint.UnitRegistry()


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1234567.0, "1.235 × 10⁶"), (2e-13, "2.000 × 10⁻¹³"), (1085.04, "1,085"), (0.33062, "0.3306"), (0.0, "0"),
        (-7.44, "−7.440"), (12, "12"), (3600, "3,600"), (None, UNKNOWN), (math.nan, UNKNOWN),
    ],
)  # fmt: skip
def test_numbers_keep_four_digits(value, text):
    assert number(value).replace("\u202f", " ") == text


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [
        (0.155, "m", "155 mm"), (7.62, "m", "7.620 m"), (1.2e-4, "s", "120.0 µs"), (80.0, "s", "80 s"),
        (0.0149, "kg", "14.90 g"), (0.0031, "%", "0.3100 %"), (79.0, "m/s", "79 m/s"), (17, "", "17"),
    ],
)  # fmt: skip
def test_values_are_shown_in_practical_units(value, unit, shown):
    assert with_unit(value, unit).translate(str.maketrans({"\u00a0": " ", "\u202f": " "})) == shown


@pytest.mark.parametrize("si", _LADDERS)
def test_practical_units_are_those_that_they_are_called(si):
    for power in range(-9, 13):
        text = with_unit(1.5 * 10.0**power, si)
        if "×" not in text:
            value, unit = re.fullmatch(r"([\d.,]+)\s?(\D.*)", text).groups()
            found = float(value.replace(",", "")) * UNITS(unit.replace("°", "degree"))
            assert found.to(si).magnitude == pytest.approx(1.5 * 10.0**power, rel=5e-3), text


def test_backticks_become_code_and_nothing_else_becomes_markup():
    assert code_words("set `hazard.tolerance` <b>") == "set <code>hazard.tolerance</code> &lt;b&gt;"
    assert code_words("one ` alone") == "one ` alone"


@pytest.mark.parametrize(
    ("value", "text"), [(333.2, "334"), (334.0, "334"), (334.0 + 1e-12, "334"), (1234.1, "1,235"), (None, "–")]
)
def test_a_distance_is_rounded_up_everywhere(value, text):
    assert whole_metres(value) == text
    if value is not None:
        assert metres(value) == f"{text} m"
        assert metres_and_error(value, 1.94) == f"{value:,.1f} ± 1.9"


@pytest.mark.parametrize(("value", "text"), [(12.9, "+12"), (-0.1, "−1"), (-12.2, "−13"), (None, "–")])
def test_a_margin_is_rounded_down(value, text):
    assert margin_metres(value) == text


def test_law_of_a_mixture():
    """Its parts share the number: at m = mu of both, N0 (a + b)/e with the shares a, b that sum to one."""
    parts = [
        {"dimension": 2, "mu": 0.007, "mass_fraction": 0.75},
        {"dimension": 3, "mu": 0.007, "mass_fraction": 0.25},
    ]
    rounds = {"rounds": [{"segments": [{"n0": 400, "mu": 1, "parts": parts}]}]}
    run = run_of(summary=example(Summary, break_up=rounds))
    law = run.summary.break_up.rounds[0].segments[0]
    assert number_above(law, np.array([0.0, 0.007])) == pytest.approx([400.0, 400.0 / math.e])
    two, three = (400 * share for share in (0.75, 0.25))
    expected = two * math.exp(-2.0) + three * math.exp(-(4.0 ** (1 / 3)))
    assert number_above(law, np.array([0.028])) == pytest.approx([expected])


def reported(part: str, witness: list | None = None, records: list | None = None, **values: object) -> list:
    """Weight and text of the findings of a run of which only a part of the summary is known."""
    summary = example(Summary, **{part: values}, findings=records or [], witness=witness)
    run = run_of(values=CaseTable.model_validate({"burst": {"cell_size": "6 mm"}}), summary=summary)
    return [(item.weight, item.text) for item in findings(run)]


def hazard(**changes) -> dict:
    """The part "hazard" of a run whose distance is known to 1.5 %."""
    return {
        "expected": 100.0, "upper": 102.5, "standard_error": 1.5, "realisations": 40, "determined": True, "reason": "",
        "tolerance": 0.02, "converged": True, "max_bias": 0.0, "more_realisations": True,
        "method": "realisations", **changes,
    }  # fmt: skip


def made_by_contact(at_end: float, largest: float, gain: float) -> dict:
    """The part "burst" of a run whose contact has made energy (J, or lost it): fractions of the work."""
    return {"contact_error": largest, "contact_error_at_end": at_end, "contact": {"gain": gain}}


@pytest.mark.parametrize(
    ("part", "values", "weight", "words"),
    [
        ("burst", {"energy_error": 0.003}, "good", "closes within 0.300 %"),
        ("burst", {"energy_error": 0.03}, "warning", "1 % is the aim"),
        ("burst", {"energy_error": 0.06}, "stop", "not computed correctly"),
        ("burst", made_by_contact(0.004, 0.0099, 1.0), "good", "made 0.40 % of the products' work at the end"),
        ("burst", made_by_contact(0.004, 0.0099, -1.0), "good", "lost 0.40 % of the products' work at the end"),
        ("burst", made_by_contact(0.004, 0.0101, 1.0), "note", "at most 1.0 % of the work done until then"),
        ("burst", made_by_contact(0.011, 0.03, 1.0), "warning", "made 1.1 % of the products' work at the end"),
        ("burst", made_by_contact(0.011, 0.051, 1.0), "stop", "above 5 % the burst is not computed correctly"),
        ("burst", {"products_balance": 1.22}, "warning", "more than the charges hold"),
        ("burst", {"products_balance": 0.97}, "good", "97 % of the charges' heat"),
        ("burst", {"lost_cells": 3, "symmetry": {"all_cells": 1000}}, "warning", "3 of 1,000 cells were lost (0.3 %)"),
        ("burst", {"lost_cells": 1, "symmetry": {"all_cells": 1000}}, "warning", "1 of 1,000 cells was lost (0.1 %)"),
        ("burst", {"lost_cells": 30, "symmetry": {"all_cells": 1000}}, "stop", "30 of 1,000 cells were lost"),
        ("burst", {"lost_cells": 0, "symmetry": {"all_cells": 1000}}, "good", "No cell was lost"),
        ("burst", {"contact": {"max_collision_penetration": 6e-4}}, "warning", "overlap by up to 10.0 % of a cell"),
        ("burst", {"acceleration_complete": None, "acceleration_left": 0.14}, "warning",
         "14 % of its kinetic energy would still come"),
        ("burst", {"momentum_error": 1e-6}, "warning", "momentum drifts by 1.0e-06"),
        ("break_up", {"mass_error": -0.08}, "warning", "8 % less mass"),
        ("hazard", hazard(), "good",
         "40 realisations fix the expected distance to 1.5 % (standard error; `hazard.tolerance` asks for 2 %)"),
        ("hazard", hazard(max_bias=2.0), "note", "makes the expected distance 2 % too large, which is taken off it"),
        ("hazard", hazard(converged=False, standard_error=3.0), "warning",
         "40 realisations fix the expected distance to 3 % (standard error), not to 2 %; set hazard.max_"),
        ("hazard", hazard(converged=False, standard_error=3.0, more_realisations=False), "warning",
         "no more realisations can be made without the burst's snapshot"),
        ("hazard", hazard(converged=False, standard_error=None, more_realisations=False), "warning",
         "There is one set of fragments from another source"),
        ("hazard", hazard(converged=False, max_bias=4.0), "warning",
         "fix the expected distance to 4 % (taken off for taking the worst direction), not to 2 %"),
        ("hazard", hazard(determined=False, converged=False, reason="there are no fragments"), "stop",
         "The distance is not determined: there are no fragments"),
        ("flight", {"fragments": 10, "above_drag_table": 4, "drag": "sphere"}, "warning",
         "4 of 10 fragments were faster"),
        ("flight", {"fragments": 10, "landed": 9}, "note", "1 of 10 fragments did not land"),
        ("flight", {"fragments": 10, "landed": 6, "status": {"stopped": {"fragments": 3}}}, "note",
         "1 of 10 fragments did not land"),
        ("flight", {"fragments": 10, "landed": 7, "status": {"stopped": {"fragments": 3}}}, "note",
         "3 of 10 fragments were stopped by obstacles"),
    ],
)  # fmt: skip
def test_findings_follow_the_summary(part, values, weight, words):
    assert any(found == weight and words in text for found, text in reported(part, **values)), reported(part, **values)


@pytest.mark.parametrize("name", ["energy_error", "contact_error"])
def test_a_ledger_without_a_number_stops(name):
    summary = example(Summary, burst={})
    summary = replace(summary, burst=replace(summary.burst, **{name: math.nan}))
    found = [item.text for item in findings(run_of(summary=summary)) if item.weight == "stop"]
    assert any("the burst is not computed correctly" in text for text in found)


def test_gravest_finding_comes_first():
    weights = [weight for weight, _ in reported("burst", energy_error=0.06, products_balance=1.3, lost_cells=0)]
    order = [["stop", "warning", "note", "good"].index(weight) for weight in weights]
    assert order == sorted(order)
    assert weights[0] == "stop"


def test_recorded_warnings_are_reported_but_for_those_judged_from_numbers():
    wall = {"stage": "burst", "code": "other", "severity": "warning", "text": "the wall is thin"}
    drag = {
        "stage": "fly",
        "code": "drag_table",
        "severity": "warning",
        "text": "drag sphere: 3 of 9 flew above Mach 5",
    }
    texts = [text for weight, text in reported("burst", records=[wall, {**wall, "stage": "fly"}, drag])]
    assert texts.count("The wall is thin.") == 1
    assert not any("Mach" in text for text in texts)


def test_directions_that_follow_the_cells_are_distinguished_from_random_scatter():
    random = np.random.default_rng(3)

    def ring(hits: np.ndarray) -> list[dict[str, object]]:
        return [{"name": "ring", "by_azimuth": [{"hits": int(value)} for value in hits]}]

    scatter = random.poisson(30, 72)
    focus = random.poisson(30 + 100 * np.exp(-(((np.arange(72) * 5 - 90) / 20.0) ** 2)))
    striped = np.where(np.arange(72) % 3 == 0, 90, 0)
    assert not any("may be affected by the mesh" in text for _, text in reported("flight", witness=ring(scatter)))
    assert not any("may be affected by the mesh" in text for _, text in reported("flight", witness=ring(focus)))
    assert any("may be affected by the mesh" in text for _, text in reported("flight", witness=ring(striped)))


@pytest.mark.parametrize(("contrast", "warned"), [(0.15, False), (0.4, True), (0.8, True)])
def test_stripes_count_from_six_times_the_variance_of_counts(contrast, warned):
    """Alternately n (1 + c) and n (1 - c): the mean square of 2 n c over 1.5 n is 8 n c^2 / 3, 6 of 40 at 0.237."""
    hits = 40.0 * (1.0 + contrast * (-1.0) ** np.arange(72))
    rows = [{"name": "ring", "by_azimuth": [{"hits": round(float(value))} for value in hits]}]
    found = [text for _, text in reported("flight", witness=rows) if "may be affected by the mesh" in text]
    assert bool(found) == warned
    if warned:
        assert f"{math.sqrt(8.0 * 40.0 * contrast**2 / 3.0):.1f} times" in found[0]


# --- The catalogue of output quantities: complete, read by every view, one entry for a new output


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
    assert quantity("hazard.recommended").words(81.2) == "82\u00a0m"
    assert quantity("hazard.largest_throw").words(81.2) == "81\u00a0m"


def test_a_view_lists_an_output_by_its_mark_alone(reported_pair, monkeypatch):
    views = ("terminal", "sweep", "compare", "convergence")
    new = replace(quantity("burst.min_edge"), label="Shortest edge of all", views=views)
    monkeypatch.setitem(QUANTITIES, new.path, new)
    run = Run(reported_pair)
    value = run.summary.burst.min_edge
    assert "shortest edge of all" in summary_text(run.summary)
    assert ("burst", "shortest edge of all", new.words(value)) in [*numbers_of(run.summary)]
    assert results_of(run.summary)["min_edge"] == value
    assert "| `min_edge` | m | Shortest edge of all |" in summary_reference()
    assert new in shown("convergence")
    assert len(fragfield.compare_runs(reported_pair, reported_pair))
