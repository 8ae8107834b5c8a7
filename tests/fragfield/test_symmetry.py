"""Which cases are axisymmetric, and which have the same hazard at every azimuth."""

from __future__ import annotations

from pathlib import Path

import pytest

from fragfield.case import load_case, load_changed_case
from fragfield.case.conversion.turned import all_azimuths_alike, is_axisymmetric
from fragfield.case.problem import break_up_settings

CASES = Path(__file__).parents[2] / "cases"


def test_ready_cases() -> None:
    """Single rounds are axisymmetric, stacks are not."""
    found = {
        name: is_axisymmetric(load_case(CASES / f"{name}.toml")) for name in ("m107_tnt", "m107_pair", "m107_row4")
    }
    assert found == {"m107_tnt": True, "m107_pair": False, "m107_row4": False}


@pytest.mark.parametrize(
    ("changes", "axisymmetric", "alike"),
    [
        ({}, True, True),
        ({"round.0.attitude": "180 deg"}, True, True),
        ({"round.0.attitude": "lying"}, True, False),
        ({"round.0.ignition": [{"station": "nose", "offset": ["1 mm", "0 mm"]}]}, False, False),
    ],
)
def test_what_breaks_the_symmetry(changes: dict[str, object], axisymmetric: bool, alike: bool) -> None:
    """A lying round keeps its own axis but not the azimuths; ignition beside the axis breaks both."""
    case = load_changed_case(CASES / "m107_tnt.toml", changes)
    assert (is_axisymmetric(case), all_azimuths_alike(case)) == (axisymmetric, alike)
    assert break_up_settings(case).random_roll is axisymmetric
