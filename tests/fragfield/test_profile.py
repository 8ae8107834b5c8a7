"""`burst --profile`: the parts of the stepping add up to it, change nothing, and stand in the report's annex."""

from __future__ import annotations

import json
import re

import pytest

from tests.datasets import same_data
from tests.fragfield.short_run import RINGS, SHORT, invoke

pytestmark = pytest.mark.dolfinx


@pytest.fixture(scope="module", params=["3d", "axisymmetric"])
def timed(request, tmp_path_factory):
    """The same burst with and without a profile; what the terminal got, and both run directories."""
    folder = tmp_path_factory.mktemp("profile")
    case = folder / "tube.toml"
    case.write_text(SHORT if request.param == "3d" else RINGS)
    done = invoke("burst", case, "--out", folder / "timed", "--profile")
    assert done.exit_code == 0, done.stderr
    assert invoke("burst", case, "--out", folder / "plain").exit_code == 0
    return request.param, done.stdout, folder / "timed", folder / "plain"


def burst_of(folder):
    return json.loads((folder / "summary.json").read_text())["burst"]


def test_the_parts_add_up_to_the_stepping(timed):
    geometry, _, folder, _ = timed
    burst = burst_of(folder)
    profile = {part["part"]: part for part in burst["profile"]}
    assert sum(part["seconds"] for part in profile.values()) == pytest.approx(burst["stepping_seconds"])
    assert sum(part["share"] for part in profile.values()) == pytest.approx(1.0)
    assert all(part["seconds"] > -1e-6 for part in profile.values())
    assert profile["macro steps, without the other parts"]["calls"] == burst["steps"]
    assert profile["files: states written"]["calls"] == 4  # at 0, 4, 8 and 12 us
    seconds = [part["seconds"] for part in burst["profile"]]
    assert seconds == sorted(seconds, reverse=True)
    assert ("contact: charge on casing" in profile) == (geometry == "3d")


def test_a_profile_changes_no_result(timed):
    _, _, folder, plain = timed
    assert same_data(folder / "burst", plain / "burst") > 10  # fields of all states
    assert "profile" not in burst_of(plain)


def test_terminal_and_annex_show_the_parts(timed, quick_report):
    _, printed, folder, plain = timed
    assert re.search(r"time of the stepping\n.*\n(.+\n)*element forces and motion +\d+\.\d\d +\d+\.\d +\d+", printed)
    for run, there in ((folder, True), (plain, False)):
        assert invoke("report", run).exit_code == 0
        page = (run / "report.html").read_text()
        assert ("Time of the burst by part" in page) == there
        assert ("files: states written" in page) == there


def test_only_the_burst_has_a_profile(tmp_path):
    case = tmp_path / "tube.toml"
    case.write_text(SHORT)
    refused = invoke("fly", case, "--profile")
    assert refused.exit_code == 2
    assert "--profile" in refused.stderr
