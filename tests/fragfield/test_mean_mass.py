"""How well the mean fragment mass is known: what the case says of it, `check`, and the report's findings."""

from __future__ import annotations

from pathlib import Path

import pytest

from fragfield.case import load_case, load_changed_case
from fragfield.case.conversion.stages import break_up_settings
from fragfield.case.tables.break_up import BreakUpTable
from fragfield.checking.check import check_report
from fragfield.errors import InputError
from fragfield.report.findings.findings import findings
from fragfield.report.reading.run_files import RunFiles
from transition import BreakUpSettings

CASES = Path(__file__).parents[2] / "cases"
CYLINDER = CASES.parent / "validation" / "copper_cylinder" / "case.toml"
PART = {"law": "mott", "factor": 1.6, "factor_source": "validation/mean_mass", "outside_data": []}


def stated(**changes) -> list[tuple[str, str]]:
    run = RunFiles(Path("x"), summary={"break_up": {"mean_mass": {**PART, **changes}}})
    return [(item.weight, item.text) for item in findings(run) if "mean" in item.text]


def test_defaults_of_the_case_are_those_of_the_break_up():
    table, settings = BreakUpTable(), BreakUpSettings()
    for name in ("mean_mass", "mean_mass_factor", "fracture_stress", "fracture_gamma"):
        assert getattr(table, name) == getattr(settings, name), name


def test_the_case_reaches_the_law_of_1947():
    changes = {"break_up.mean_mass": "mott_1947", "break_up.mean_mass_factor": 1.3,
               "break_up.fracture_stress": "700 MPa", "break_up.fracture_gamma": 50.0}  # fmt: skip
    settings = break_up_settings(load_changed_case(CASES / "m107_tnt.toml", changes))
    assert (settings.mean_mass, settings.mean_mass_factor) == ("mott_1947", 1.3)
    assert (settings.fracture_stress, settings.fracture_gamma) == (700e6, 50.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"break_up.mean_mass_factor": 0.5}, "break_up.mean_mass_factor: found 0.5"),
        ({"break_up.fracture_stress": "0 MPa"}, "break_up.fracture_stress: found"),
    ],
)
def test_what_contradicts_or_has_no_meaning_is_refused(changes, message):
    with pytest.raises(InputError) as caught:
        load_changed_case(CASES / "m107_tnt.toml", changes)
    assert message in str(caught.value)


def test_check_warns_where_no_data_are_near():
    near = check_report(load_case(CASES / "m107_tnt.toml"))["warnings"]
    assert not any("published mean masses" in line for line in near)
    (warning,) = (line for line in check_report(load_case(CYLINDER))["warnings"] if "published mean masses" in line)
    assert warning.startswith(
        "round[1] (cylinder): no published mean masses of fragments are close: outer diameter 30.6 mm"
    )
    assert "casing of 8960 kg/m3 (data: steel). No published scatter covers it: measure the mean mass" in warning


def test_check_does_not_warn_where_the_mean_mass_is_given():
    case = load_changed_case(CYLINDER, {"break_up.mean_mass": "3 g"})
    assert not any("published mean masses" in line for line in check_report(case)["warnings"])


def test_runs_of_earlier_versions_state_nothing():
    run = RunFiles(Path("x"), summary={"break_up": {"mass_error": 0.0}})
    assert not any("mean" in item.text for item in findings(run))
