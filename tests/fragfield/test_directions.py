"""Which directions of a case differ: basis of the hazard distance, and mirror planes of the arrangement."""

from __future__ import annotations

from pathlib import Path

import pytest

from fragfield.case.changes import load_case
from fragfield.case.conversion.turned import hazard_basis, mirror_planes

CASES = Path(__file__).parents[2] / "cases"
SINGLE, PAIR = CASES / "m107_tnt.toml", CASES / "m107_pair.toml"


@pytest.mark.parametrize(
    ("settings", "basis"),
    [
        ([], "all_azimuths"),
        (["flight.wind.speed=5 m/s"], "worst_direction"),
        (["flight.origin=['1 m', '0 m']"], "worst_direction"),
        (["round.0.attitude=lying"], "worst_direction"),
        (["round.0.ignition=[{station='nose', offset=['0 mm', '5 mm']}]"], "worst_direction"),
    ],
)
def test_the_basis_of_a_single_round(settings, basis):
    assert hazard_basis(load_case(SINGLE, settings)) == basis


@pytest.mark.parametrize(
    ("name", "settings", "planes"),
    [
        ("m107_pair", [], (0.0, 90.0)),
        ("m107_pair_mirrored", [], (0.0, 90.0)),
        ("m107_row4", [], (0.0, 90.0)),
        ("m107_pair", ["flight.wind.speed=5 m/s"], ()),
        ("m107_pair", ["flight.origin=['1 m', '0 m']"], (0.0,)),
        ("m107_pair", ["stack.delays=['0 us', '3 us']"], (0.0,)),
        ("m107_pair", ["round.0.ignition=[{station='nose', offset=['0 mm', '5 mm']}]"], ()),
        ("m107_tnt", ["round.0.attitude=lying"], (0.0,)),
        ("m107_tnt", ["round.0.attitude=lying", "round.0.position=['0 m', '1 m', '1 m']"], ()),
    ],
)
def test_mirror_planes_of_arrangements(name, settings, planes):
    case = load_case(CASES / f"{name}.toml", settings)
    assert mirror_planes(case) == planes
    assert hazard_basis(case) == "worst_direction"


def test_a_wall_that_is_not_mirrored_breaks_the_symmetry():
    wall = "plane=[{name='wall', kind='wall', point=['0 m', '1 m', '0 m'], normal=[0, -1, 0]}]"
    assert mirror_planes(load_case(PAIR, [wall])) == (90.0,)
    ground = "plane=[{name='floor', kind='ground'}]"
    assert mirror_planes(load_case(PAIR, [ground])) == (0.0, 90.0)
