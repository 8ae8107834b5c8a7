"""Numbers, laws, mesh quality and warnings of the report, each against a value known beforehand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from fragfield.report.findings import findings
from fragfield.report.landings import landings
from fragfield.report.laws import number_above, segment_laws
from fragfield.report.mesh_quality import aspect_ratio, scaled_jacobian
from fragfield.report.quantities import UNKNOWN, from_case, number, row, si_value
from fragfield.report.run_files import RunFiles

UNIT_CUBE = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=float
)
ONE_CELL = np.arange(8)[None, :]


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
    ("value", "unit", "shown", "si"),
    [
        (0.155, "m", "155 mm", "0.1550 m"), (7.62, "m", "7.620 m", "7.620 m"), (1.2e-4, "s", "120.0 µs", "0.0001200 s"),
        (0.0149, "kg", "14.90 g", "0.01490 kg"), (0.0031, "%", "0.3100 %", "0.003100"), (79.0, "J", "79 J", "79 J"),
        (math.pi / 2, "rad", "90°", "1.571 rad"), (310e6, "byte", "310 MB", "3.100 × 10⁸ B"), (17, "", "17", ""),
    ],
)  # fmt: skip
def test_practical_values_stand_beside_si(value, unit, shown, si):
    found = row("x", value, unit)
    plain = str.maketrans({"\u00a0": " ", "\u202f": " "})
    assert (found.value.translate(plain), found.si.translate(plain)) == (shown, si)


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        ("0.006 m", "6 mm"), ("4520000.0 J/kg", "4.52 MJ/kg"), ("155 mm shell", "155 mm shell"), ("mott", "mott"),
        (True, "yes"), (0.75, "0.75"), (["0.0 m", "0.1085 m"], "0 m, 108.5 mm"), ([[0, 1], [2, 3]], "(0, 1), (2, 3)"),
        (2, "2"), ("1.225 kg/m^3", "1.225 kg/m³"),
    ],
)  # fmt: skip
def test_values_of_the_case_are_read(value, shown):
    assert from_case("x", value).value.replace("\u00a0", " ") == shown


def test_si_value_of_a_resolved_case():
    assert si_value("79.0 J", 1.0) == 79.0
    assert si_value(None, 5.0) == 5.0


def test_scaled_jacobian_of_known_cells():
    """1 for a box however long, sin(angle) for a sheared one, negative when a corner is pushed through."""
    angle = math.radians(30)
    sheared = UNIT_CUBE @ np.array([[1, 0, 0], [math.cos(angle), math.sin(angle), 0], [0, 0, 1]])
    folded = UNIT_CUBE.copy()
    folded[6] = (0.2, 0.2, 0.2)
    assert scaled_jacobian(UNIT_CUBE * (1, 2, 5), ONE_CELL)[0] == pytest.approx(1.0)
    assert scaled_jacobian(sheared, ONE_CELL)[0] == pytest.approx(math.sin(angle))
    assert scaled_jacobian(folded, ONE_CELL)[0] < 0
    assert aspect_ratio(UNIT_CUBE * (1, 2, 5), ONE_CELL)[0] == pytest.approx(5.0)


def test_law_of_a_mixture():
    """Its parts share the number: at m = mu of both, N0 (a + b)/e with the shares a, b that sum to one."""
    parts = [
        {"dimension": 2, "mu": 0.007, "mass_fraction": 0.75},
        {"dimension": 3, "mu": 0.007, "mass_fraction": 0.25},
    ]
    run = RunFiles(Path("x"), summary={"break_up": {"rounds": [{"segments": [{"n0": 400, "mu": 1, "parts": parts}]}]}})
    (law,) = segment_laws(run)
    assert number_above(law, np.array([0.0, 0.007])) == pytest.approx([400.0, 400.0 / math.e])
    two, three = (400 * share for share in (0.75, 0.25))
    expected = two * math.exp(-2.0) + three * math.exp(-(4.0 ** (1 / 3)))
    assert number_above(law, np.array([0.028])) == pytest.approx([expected])


def reported(part: str, log: str = "", witness: list | None = None, **values: object) -> list[tuple[str, str]]:
    """Findings of a run of which only a part of the summary and the log are known."""
    summary: dict = {part: values}
    if witness is not None:
        summary["witness"] = witness
    run = RunFiles(Path("x"), case={"burst": {"cell_size": "0.006 m"}}, summary=summary, log=log)
    return [(item.weight, item.text) for item in findings(run)]


def hazard(**changes) -> dict:
    """The part "hazard" of a run whose distance is known to 1.5 %."""
    return {
        "distance": 100.0, "upper": 102.5, "standard_error": 1.5, "realisations": 40, "determined": True, "reason": "",
        "tolerance": 0.02, "converged": True, "max_bias": 0.0, "more_realisations": True, **changes,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("part", "values", "weight", "words"),
    [
        ("burst", {"energy_error": 0.003}, "good", "closes within 0.300 %"),
        ("burst", {"energy_error": 0.03}, "warning", "1 % is the aim"),
        ("burst", {"energy_error": 0.06}, "stop", "not computed correctly"),
        ("burst", {"energy_error": math.nan}, "stop", "not computed correctly"),
        ("burst", {"products_balance": 1.22}, "warning", "more than the charges hold"),
        ("burst", {"products_balance": 0.97}, "good", "97 % of the charges' heat"),
        ("burst", {"lost_cells": 3, "cells": 1000}, "warning", "3 of 1,000 cells were lost (0.3 %)"),
        ("burst", {"lost_cells": 30, "cells": 1000}, "stop", "30 of 1,000 cells were lost"),
        ("burst", {"lost_cells": 0, "cells": 1000}, "good", "No cell was lost"),
        ("burst", {"max_penetration": 6e-4}, "warning", "overlap by up to 10.0 % of a cell"),
        ("burst", {"acceleration_complete": None, "kinetic_energy_growth": 0.04}, "warning", "grew by 4 %"),
        ("burst", {"momentum_error": 1e-6}, "warning", "momentum drifts by 1.0e-06"),
        ("break_up", {"mass_error": -0.08}, "warning", "8 % less mass"),
        ("hazard", hazard(), "good", "40 realisations fix the hazard distance to 2 % (standard error)"),
        ("hazard", hazard(max_bias=2.0), "note", "may bias the hazard distance by up to 2 % either way"),
        (
            "hazard",
            hazard(converged=False, standard_error=3.0),
            "warning",
            "40 realisations fix the hazard distance to 3 % (standard error), not to 2 %; set hazard.max_realisations",
        ),
        (
            "hazard",
            hazard(converged=False, standard_error=3.0, more_realisations=False),
            "warning",
            "no more realisations can be made without the burst's snapshot",
        ),
        (
            "hazard",
            hazard(converged=False, standard_error=None, more_realisations=False),
            "warning",
            "One realisation was flown; of fragments from elsewhere there is one set, and no more can be made",
        ),
        (
            "hazard",
            hazard(converged=False, max_bias=4.0),
            "warning",
            "fix the hazard distance to 4 % (bound of the bias of taking the worst direction), not to 2 %",
        ),
        (
            "hazard",
            hazard(determined=False, converged=False, distance=None, reason="there are no fragments"),
            "stop",
            "The hazard distance is not determined: there are no fragments",
        ),
        ("flight", {"fragments": 10}, "stop", "an earlier version, which had no estimate of the hazard distance"),
        (
            "flight",
            {"fragments": 10, "above_drag_table": 4, "drag": "sphere"},
            "warning",
            "4 of 10 fragments flew faster",
        ),
        ("flight", {"fragments": 10, "landed": 9}, "note", "1 of 10 fragments did not land"),
    ],
)
def test_findings_follow_the_summary(part, values, weight, words):
    assert any(found == weight and words in text for found, text in reported(part, **values)), reported(part, **values)


def test_gravest_finding_comes_first():
    weights = [
        weight for weight, _ in reported("burst", energy_error=0.06, products_balance=1.3, lost_cells=0, cells=5)
    ]
    order = [["stop", "warning", "note", "good"].index(weight) for weight in weights]
    assert order == sorted(order)
    assert weights[0] == "stop"


def test_warnings_of_the_log_are_reported_once():
    line = "2026-01-01 10:00:00,000 WARNING burst_fenicsx.meshing: the wall is thin\n"
    flight = "2026-01-01 10:00:00,000 WARNING py.warnings: /x/y.py:12: FlightWarning: drag sphere: 3 of 9 fragments flew above Mach 5\n"  # noqa: E501
    info = "2026-01-01 10:00:00,000 INFO    fragfield.stages: burst: begins\n"
    texts = [text for _, text in reported("burst", log=line + line + flight + info) if "run.log" in text]
    assert texts == ["The wall is thin (from run.log)"]


def test_directions_that_follow_the_cells_are_distinguished_from_random_scatter():
    random = np.random.default_rng(3)

    def ring(hits: np.ndarray) -> list[dict[str, object]]:
        return [{"name": "ring", "by_azimuth": [{"hits": int(value)} for value in hits]}]

    scatter = random.poisson(30, 72)
    focus = random.poisson(30 + 100 * np.exp(-(((np.arange(72) * 5 - 90) / 20.0) ** 2)))
    striped = np.where(np.arange(72) % 3 == 0, 90, 0)
    assert not any("may follow the cells" in text for _, text in reported("flight", witness=ring(scatter)))
    assert not any("may follow the cells" in text for _, text in reported("flight", witness=ring(focus)))
    assert any("may follow the cells" in text for _, text in reported("flight", witness=ring(striped)))


@pytest.mark.parametrize(("contrast", "warned"), [(0.15, False), (0.4, True), (0.8, True)])
def test_stripes_count_from_six_times_the_variance_of_counts(contrast, warned):
    """Alternately n (1 + c) and n (1 - c): the mean square of 2 n c over 1.5 n is 8 n c^2 / 3, 6 of 40 at 0.237."""
    hits = 40.0 * (1.0 + contrast * (-1.0) ** np.arange(72))
    rows = [{"name": "ring", "by_azimuth": [{"hits": float(value)} for value in hits]}]
    found = [text for _, text in reported("flight", witness=rows) if "may follow the cells" in text]
    assert bool(found) == warned
    if warned:
        assert f"{math.sqrt(8.0 * 40.0 * contrast**2 / 3.0):.1f} times" in found[0]


def test_the_map_of_landings_has_north_of_the_site_where_y_is():
    """Azimuth counts from +x counter-clockwise; distance from the origin; what did not land is left out."""
    from flight.result import LANDING, Status

    rows = np.zeros(4, dtype=LANDING)
    rows["azimuth"], rows["distance"] = [0.0, 90.0, 210.0, 45.0], [100.0, 50.0, 20.0, 10.0]
    rows["status"], rows["energy"] = Status.LANDED, [100.0, 10.0, 79.0, 200.0]
    rows["status"][3] = Status.TIME_OUT
    run = RunFiles(Path("x"), case={"hazard": {"energy": "79.0 J"}}, summary={}, landing=rows)
    found = landings(run)
    assert found.x == pytest.approx([100.0, 0.0, -20.0 * math.sqrt(0.75)], abs=1e-9)
    assert found.y == pytest.approx([0.0, 50.0, -10.0], abs=1e-9)
    assert found.hazardous.tolist() == [True, False, True]
