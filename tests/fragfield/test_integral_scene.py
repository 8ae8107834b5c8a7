"""Which scenes have an integral of the expected density, and that a run of one has no random number in its distance."""

from __future__ import annotations

import pytest

from fragfield.case import load_case
from fragfield.pipeline.integral import why_not_integrated
from tests.fragfield.short_run import ROOT

ROUND = ROOT / "cases" / "grenade_155_tnt.toml"


@pytest.mark.parametrize("attitude", ["upright", "lying", "45 deg", "any"])
def test_single_rounds_are_integrated(attitude):
    assert why_not_integrated(load_case(ROUND, (f"round.0.attitude={attitude}",))) == ""


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("flight.wind.speed=0.1 m/s", "wind"),
        ("break_up.tilt=1 deg", "break_up.tilt"),
        ("break_up.direction_scatter=0.5 deg", "scatter by less than 1 degree"),
        ("flight.gravity=0 m/s^2", "no gravity"),
        ({"flight.origin": ["2 m", "0 m"]}, "flight.origin"),
        ("flight.time_limit=60 s", "flight.time_limit"),
        ("burst.geometry=3d", "3d"),
    ],
)
def test_what_breaks_the_scene_is_named(change, words):
    settings = change if isinstance(change, dict) else (change,)
    assert words in why_not_integrated(load_case(ROUND, settings))


def test_several_rounds_and_fragments_of_a_file_are_flown():
    assert "several rounds" in why_not_integrated(load_case(ROOT / "cases" / "m107_pair.toml"))
    assert "another source" in why_not_integrated(load_case(ROUND), given=True)
