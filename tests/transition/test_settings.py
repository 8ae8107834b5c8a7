"""Messages of the settings, and the ends of what they take."""

from __future__ import annotations

import math
from dataclasses import fields

import pytest

from transition import BreakUpSettings, InputError


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"dimension": 4}, r"break_up.dimension: found 4 \(allowed: 2, 3, mixed\)"),
        ({"sampler": "quantil"}, r"break_up.sampler: found 'quantil'; did you mean 'quantile'\? \(allowed: quantile,"),
        ({"velocity": "maen"}, r"break_up.velocity: found 'maen'; did you mean 'mean'"),
        ({"random_roll": 1}, r"break_up.random_roll: found 1 \(allowed: True, False\)"),
        ({"velocity_source": 3}, r"break_up.velocity_source: found 3 \(allowed: burst, gurney\)"),
        ({"mean_mass": "mot"}, r"break_up.mean_mass: found 'mot'; did you mean 'mott'.* or a number"),
        ({"mean_mass": "mott_1946"}, r"break_up.mean_mass: found 'mott_1946'; did you mean 'mott_1947'"),
        ({"mean_mass": -1.0}, r"break_up.mean_mass: found -1; allowed: 1e-06 to 1000 kg"),
        ({"mean_mass": None}, r"break_up.mean_mass: found None; a number is needed"),
        ({"prefactor": "book"}, r"break_up.prefactor: found 'book' \(allowed: paper\) or a number"),
        ({"prefactor": 0.0}, r"break_up.prefactor: found 0; allowed: 0.001 to 10000"),
        ({"fracture_energy": float("inf")}, r"break_up.fracture_energy: found inf; allowed: 1 to 1e\+08 J/m\^2"),
        ({"critical_strain": -0.1}, r"break_up.critical_strain: found -0.1; allowed: 0.001 to 5"),
        ({"mixed_fraction": 1.5}, r"break_up.mixed_fraction: found 1.5; allowed: 0 to 1"),
        ({"graded_m0": -1e-4}, r"break_up.graded_m0: found -0.0001; allowed: 0 to 100 kg"),
        ({"graded_dm": float("nan")}, r"break_up.graded_dm: found nan; a number is needed"),
        ({"shape_factor": 0}, r"break_up.shape_factor: found 0; allowed: 50 to 100000 kg/m\^3"),
        ({"mean_mass_factor": "1.6"}, r"break_up.mean_mass_factor: found '1.6'; a number is needed"),
        ({"fracture_stress": 0.0}, r"break_up.fracture_stress: found 0; allowed: 100000 to 1e\+12 Pa"),
        ({"explosive_constant": -3.0}, r"break_up.explosive_constant: found -3; "),
        ({"segments": (0.2, 0.1)}, r"break_up.segments: found \[0.2, 0.1\]; stations must rise"),
        ({"segments": (0.0, 0.1)}, r"break_up.segments: found \[0.0, 0.1\]; every station lies above zero"),
        ({"segments": {"a": ("x",)}}, r"break_up.segments.a: found \('x',\); stations in m"),
    ],
)
def test_refused(given, message):
    with pytest.raises(InputError, match=message):
        BreakUpSettings(**given)


def test_accepted():
    """What is given is kept as it is, the rest is the default."""
    given = {"dimension": "mixed", "mean_mass": 0.01, "prefactor": "paper", "sampler": "graded"}
    given["segments"] = {"a": (0.1, 0.2)}
    settings, usual = BreakUpSettings(**given), BreakUpSettings()
    for field in fields(BreakUpSettings):
        expected = given.get(field.name, getattr(usual, field.name))
        assert getattr(settings, field.name) == expected, field.name
        assert field.name not in given or expected != getattr(usual, field.name)


@pytest.mark.parametrize(
    ("name", "lowest", "highest"),
    [
        ("mixed_fraction", 0.0, 1.0),
        ("critical_strain", 1e-3, 5.0),
        ("tilt", 0.0, 0.5),
        ("graded_m0", 0.0, 100.0),
        ("graded_dm", 1e-7, 100.0),
        ("mean_mass_factor", 1.0, 1e3),
        ("mean_mass", 1e-6, 1e3),
        ("prefactor", 1e-3, 1e4),
        ("fracture_energy", 1.0, 1e8),
        ("fracture_stress", 1e5, 1e12),
        ("fracture_gamma", 1e-2, 1e5),
        ("shape_factor", 50.0, 1e5),
        ("explosive_constant", 1e-4, 1e4),
    ],
)
def test_numbers_are_taken_up_to_their_limits(name, lowest, highest):
    for value in (lowest, highest):
        assert getattr(BreakUpSettings(**{name: value}), name) == value
    for value in (
        math.nextafter(lowest, -math.inf),
        math.nextafter(highest, math.inf),
        math.inf,
        math.nan,
        True,
        [1.0],
        -1.0,
    ):
        with pytest.raises(InputError, match=f"break_up.{name}: found "):
            BreakUpSettings(**{name: value})


@pytest.mark.parametrize("stations", [(0.1,), (0.1, 0.2), ()])
def test_stations_that_rise_are_taken(stations):
    assert BreakUpSettings(segments=stations).segments == stations
    assert BreakUpSettings(segments={"a": stations}).segments == {"a": stations}


@pytest.mark.parametrize("stations", [(0.1, 0.1), (0.1, math.inf), (math.nan,), (-0.1,), (0.0,), 0.3])
def test_stations_that_do_not_rise_are_refused(stations):
    for segments in (stations, {"a": stations}):
        with pytest.raises(InputError, match=r"break_up\.segments"):
            BreakUpSettings(segments=segments)


def test_whether_a_choice_is_right_goes_by_its_kind_too():
    """1 is not True, and True is neither 2 nor 3."""
    for given in ({"random_roll": 0}, {"random_roll": "True"}, {"dimension": True}, {"dimension": "2"}):
        with pytest.raises(InputError, match=f"break_up.{next(iter(given))}: found "):
            BreakUpSettings(**given)
    assert [BreakUpSettings(dimension=value).dimension for value in (2, 3, "mixed")] == [2, 3, "mixed"]
    assert [BreakUpSettings(random_roll=value).random_roll for value in (True, False)] == [True, False]
