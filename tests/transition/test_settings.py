"""Messages of the settings, and the ends of what they take."""

from __future__ import annotations

import math
from dataclasses import fields

import pytest

from transition import BreakUpSettings, InputError


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"dimension": 4}, r"break_up.dimension: found 4; allowed: 2, 3, 'mixed'"),
        ({"sampler": "quantil"}, r"break_up.sampler: found 'quantil'; did you mean 'quantile'\? \(allowed: quantile,"),
        ({"velocity": "maen"}, r"break_up.velocity: found 'maen'; did you mean 'mean'"),
        ({"velocity": "patch"}, r"break_up.velocity: 'patch' is now called 'mean'"),
        ({"random_roll": 1}, r"break_up.random_roll: found 1 \(allowed: True, False\)"),
        ({"velocity_source": 3}, r"break_up.velocity_source: found 3 \(allowed: burst, gurney\)"),
        ({"mean_mass": "mot"}, r"break_up.mean_mass: found 'mot'; did you mean 'mott'.* or a mass in kg"),
        ({"mean_mass": -1.0}, r"break_up.mean_mass: found -1; a number above zero is needed \(kg\)"),
        ({"mean_mass": None}, r"break_up.mean_mass: found None; a number is needed"),
        ({"prefactor": "book"}, r"break_up.prefactor: found 'book'; allowed: a number or 'paper'"),
        ({"prefactor": 0.0}, r"break_up.prefactor: found 0; a number above zero"),
        ({"fracture_energy": float("inf")}, r"break_up.fracture_energy: found inf; .* \(J/m2\)"),
        ({"critical_strain": -0.1}, r"break_up.critical_strain: found -0.1; allowed: 0 to 5"),
        ({"mixed_fraction": 1.5}, r"break_up.mixed_fraction: found 1.5; allowed: 0 to 1"),
        ({"graded_m0": -1e-4}, r"break_up.graded_m0: found -0.0001; allowed: 0 to inf"),
        ({"graded_dm": float("nan")}, r"break_up.graded_dm: found nan; a number is needed"),
        ({"shape_factor": 0}, r"break_up.shape_factor: found 0; .* \(kg/m3\)"),
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
        ("critical_strain", 0.0, 5.0),
        ("tilt", 0.0, 0.5),
        ("graded_m0", 0.0, 1e300),
        ("mean_mass_factor", 1.0, 1e300),
        *((name, 5e-324, 1e300) for name in (
            "mean_mass", "prefactor", "fracture_energy", "fracture_stress", "fracture_gamma", "graded_dm",
            "shape_factor", "explosive_constant",
        )),
    ],
)  # fmt: skip
def test_numbers_are_taken_up_to_their_limits(name, lowest, highest):
    for value in (lowest, highest):
        assert getattr(BreakUpSettings(**{name: value}), name) == value
    beyond = math.nextafter(highest, math.inf) if highest < 1e300 else math.inf
    for value in (math.nextafter(lowest, -math.inf), beyond, math.nan, True, [1.0], -1.0):
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
