"""One run of the command in the meridian, to the report: each stage, the choice of the geometry, the convergence."""

from __future__ import annotations

import json

import pytest

from tests.fragfield.plain_reports import leave_out_figures
from tests.fragfield.short_run import RINGS, invoke
from tests.fragfield.test_burst_geometry import FREE

pytestmark = pytest.mark.dolfinx


@pytest.fixture(scope="module")
def meridian_run(tmp_path_factory):
    """The run's folder and its summary; the report without its pictures and figures."""
    folder = tmp_path_factory.mktemp("meridian")
    case, out = folder / "case.toml", folder / "run"
    case.write_text(RINGS)
    with pytest.MonkeyPatch.context() as patch:
        leave_out_figures(patch)
        done = invoke("run", case, "--out", out, "--json")
    assert done.exit_code in (0, 3), done.stderr  # 3: a distance that so short a burst does not determine
    return out, json.loads((out / "summary.json").read_text())


def test_a_run_in_the_meridian_goes_through_to_the_report(meridian_run):
    """Burst, break-up, flight, report, with the choice and its reason in summary and report."""
    folder, summary = meridian_run
    assert summary["burst"]["geometry"] == "axisymmetric"
    assert summary["burst"]["geometry_reason"] == FREE
    assert summary["break_up"]["fragments"] > 0
    assert "axisymmetric" in (folder / "report.html").read_text()
    assert (folder / "burst_revolved.xdmf").is_file()


def test_a_run_by_the_command_has_its_convergence(meridian_run):
    summary = meridian_run[1]
    found, burst = summary["convergence"], summary["burst"]
    at = found["sizes"].index(burst["cell_size"])
    assert max(found["sizes"]) == pytest.approx(2.0 * burst["cell_size"])
    assert found["cells"][at] == burst["cells"]
    assert found["cells"] == sorted(found["cells"], reverse=True)
    for name in ("mean_initial_speed", "max_initial_speed", "outer_diameter"):
        assert found["quantities"][name]["values"][at] == burst[name]
    assert found["quantities"]["speed_99"]["values"][at] == burst["speed_quantiles"]["99"]
    assert burst["mean_initial_speed"] < burst["speed_quantiles"]["90"] < burst["speed_quantiles"]["99"]
    assert burst["speed_quantiles"]["99"] <= burst["max_initial_speed"]
