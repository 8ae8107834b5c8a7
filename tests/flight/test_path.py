"""Paths as functions of time, where a fragment is a danger, the figure; and arguments that are not what is needed."""

from __future__ import annotations

import builtins

import numpy as np
import pytest

import flight
from flight.hazard import Criteria

PAIR = flight.Fragments(mass=[0.01, 0.3], position=(0.0, 0.0, 1.0), velocity=[(900.0, 0.0, 120.0), (400.0, 100.0, 1.0)])


@pytest.fixture(scope="module")
def flown() -> flight.FlightResult:
    return flight.fly(PAIR, threads=1)


def test_a_path_at_any_time_is_the_flight_that_ends_then(flown):
    """A flight with that time limit is stepped by itself: position to 1e-4 m, velocity to 1e-4 of the speed."""
    for number in (0, 1):
        path, landed = flown.path(number), float(flown.landing["time"][number])
        for share in (0.07, 0.31, 0.64, 0.98):
            end = flight.fly(PAIR.select([number]), time_limit=share * landed, threads=1).landing[0]
            assert end["status"] == flight.Status.TIME_OUT
            position, velocity = path(share * landed)
            assert position == pytest.approx(end["position"], abs=1e-4)
            assert np.linalg.norm(velocity - end["velocity"]) < 1e-4 * end["speed"]


def test_a_path_goes_on_to_the_last_landing(flown):
    path, row = flown.path(1), flown.landing[1]
    assert row["ricochets"] > 2
    assert (path.start, path.end) == (0.0, row["last_time"])
    assert path(path.end)[0] == pytest.approx(row["last_position"], abs=1e-9)
    times = np.linspace(0.0, path.end, 500)
    assert path(times)[0].shape == (500, 3)
    assert path(times)[0][:, 2].min() > -1e-9, "never below the ground"
    before, after = path(row["time"] - 1e-9)[1], path(row["time"] + 1e-9)[1]
    assert before[2] < 0.0 < after[2], "the velocity changes at a ricochet"


def test_a_path_in_contact_is_that_of_all_its_legs():
    """Two that meet head on: position goes on, the velocity changes at the contact."""
    pair = flight.Fragments(0.05, [(-1.0, 0.0, 5.0), (1.0, 0.001, 5.0)], [(300.0, 0.0, 0.0), (-300.0, 0.0, 0.0)])
    result = flight.fly(pair, contact=flight.Contact(), threads=1)
    (contact,) = result.contacts
    path = result.path(0)
    assert path(contact["time"] - 1e-9)[1] == pytest.approx(contact["first_before"], rel=1e-4, abs=0.1)
    assert path(contact["time"] + 1e-9)[1] == pytest.approx(contact["first_after"], rel=1e-4, abs=0.1)
    assert path(contact["time"])[0] == pytest.approx(contact["first_position"], abs=1e-4)


def test_danger_space_is_what_the_distance_counts():
    """The lengths near the ground of one fragment, as `fluence` counts them for hazard distances."""
    criteria = Criteria()
    for number in (0, 1):
        one = PAIR.select([number])
        result = flight.fly(one, fluence=criteria.fluence_grid(flight.hazard.PolarGrid.of()), threads=1)
        spaces = result.path(0).danger_space()
        assert spaces["length"].sum() == pytest.approx(result.fluence.lengths.sum(), rel=2e-3)
        assert (spaces["end"] > spaces["start"]).all()


def test_danger_space_of_a_straight_line():
    """From 3 m down at 1 in 100: below 1.8 m from 120 m to the ground at 300 m; not at all with too little energy."""
    line = flight.Fragments(0.01, (0.0, 0.0, 3.0), (500.0, 0.0, -5.0))
    path = flight.fly(line, air="vacuum", gravity=0.0, ricochet=None, threads=1).path(0)
    (space,) = path.danger_space()
    assert space["start"] == pytest.approx(120.0, rel=1e-9)
    assert space["end"] == pytest.approx(300.0, rel=1e-9)
    assert space["length"] == pytest.approx(180.0 * np.hypot(1.0, 0.01), rel=1e-9)
    assert not len(path.danger_space(energy=1300.0))


def test_danger_space_follows_the_ground():
    """Level above a slope that rises 1 in 50: within 1.8 m of it from 10 m before the impact's height."""
    east = np.arange(-100.0, 301.0, 10.0)
    ground = flight.HeightMap(np.tile(0.02 * east, (41, 1)), step=10.0, corner=(-100.0, -200.0))
    level = flight.Fragments(0.01, (0.0, 0.0, 3.0), (500.0, 0.0, 0.0))
    path = flight.fly(level, ground=ground, air="vacuum", gravity=0.0, ricochet=None, threads=1).path(0)
    (space,) = path.danger_space()
    assert [space["start"], space["end"]] == pytest.approx([60.0, 150.0], abs=1e-3)


def test_the_figure_shows_the_paths_that_are_asked_for(flown, tmp_path):
    pytest.importorskip("matplotlib").use("Agg")
    figure = flown.plot([1])
    side, plan = figure.axes
    assert len(side.lines) == 1
    path = flown.path(0)
    heights = path(np.linspace(path.start, path.end, 400))[0][:, 2]
    assert max(line.get_ydata().max() for line in flown.plot().axes[0].lines) == pytest.approx(heights.max(), rel=1e-3)
    landed = next(line for line in plan.lines if "first impact" in line.get_label())
    assert landed.get_xdata() == pytest.approx(flown.landed["position"][:, 0])


def test_a_figure_without_matplotlib_says_what_to_install(flown, monkeypatch):
    plain = builtins.__import__

    def without(name, *rest, **named):
        if name.startswith("matplotlib"):
            raise ImportError(name)
        return plain(name, *rest, **named)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(flight.InputError, match="plot needs matplotlib, which is not installed: pip install matplotli"):
        flown.plot()


def test_one_witness_and_one_obstacle_stand_for_themselves():
    ring = flight.Cylinder(radius=5.0, name="ring")
    wall = flight.Wall(start=(50.0, -100.0), end=(50.0, 100.0), height=5.0, ricochet=None)
    result = flight.fly(PAIR, witnesses=ring, obstacles=wall, threads=1)
    assert len(result.hits_on("ring")) == 2
    assert len(result.obstacle_hits) == 1


PANEL = flight.Panel((10.0, 0.0, 1.0), (1.0, 0.0, 0.0), 2.0, 2.0)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"wind": 5.0}, r"fly: wind is 5.0; allowed: flight.Wind, such as flight.Wind.constant\(5.0, towards_deg"),
        ({"witnesses": [PANEL, "ring"]}, "fly: witnesses: found 'ring'; allowed: flight.Cylinder"),
        ({"obstacles": PANEL}, "fly: obstacles: found Panel.*; allowed: flight.Wall, Barricade or Building"),
        ({"contact": True}, "fly: contact is True; allowed: flight.Contact or None"),
        ({"fluence": 1.8}, "fly: fluence is 1.8; allowed: flight.fluence.FluenceGrid or None"),
        ({"weights": 2.0}, "fly: weights is 2.0; allowed: flight.fluence.Weights or None"),
        ({"air": [1.2]}, r"air is \[1.2\]; allowed: a name, a density, flight.ConstantAir or StandardAtmosphere"),
        ({"ground": "hills.asc"}, "fly: ground is the text 'hills.asc'; needed: metres as a number"),
        ({"seed": "one"}, "fly: seed is the text 'one'; needed: a plain number"),
    ],
)
def test_an_argument_of_another_kind_is_refused_with_what_is_allowed(arguments, words):
    with pytest.raises(flight.InputError, match=words):
        flight.fly(PAIR, **arguments)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda one: one.path(2), "path: fragment is 2, allowed: whole numbers from 0 to 1"),
        (lambda one: one.path(0.5), "path: fragment is 0.5, allowed: whole numbers"),
        (lambda one: one.path(0)(-0.1), "path: time is -0.1 s, allowed: 0 to "),
        (lambda one: one.path(0)("1 s"), "path: time is the text '1 s'; needed: seconds as numbers"),
        (lambda one: one.path(0).danger_space(height=0.0), "danger_space: height is 0.0 m, needed: above zero"),
        (lambda one: flight.fly(PAIR, ground=None, time_limit=0.5).path(0).danger_space(), "flown without ground"),
        (lambda one: flight.fly(3.0), "fly: fragments is 3.0; allowed: flight.Fragments"),
        (
            lambda one: flight.range_table(0.1, 100.0, [45.0, 95.0]),
            "range_table: elevation is 95 degrees, allowed: -90",
        ),
        (lambda one: flight.range_table(0.1, 100.0, 45.0, height="1 m"), "range_table: height is the text '1 m'"),
        (
            lambda one: flight.range_table(1e7, 100.0, 45.0),
            "mass of fragment 0 is 10000000.0; needed: from 1e-15 to 1e",
        ),
        (
            lambda one: flight.range_table(0.1, 1e5, 45.0),
            "velocity of fragment 0 is .*; needed: from -50000 to 50000 m/",
        ),
    ],
)
def test_paths_and_tables_are_refused_in_words(flown, call, words):
    with pytest.raises(flight.InputError, match=words):
        call(flown)


def test_bounds_of_masses_and_speeds_are_those_of_files(tmp_path):
    """An array and a file of the same values are refused with the same words."""
    for mass, speed in ((1e7, 100.0), (0.01, 1e5)):
        with pytest.raises(flight.InputError) as of_array:
            flight.Fragments(mass, (0.0, 0.0, 1.0), (speed, 0.0, 0.0))
        path = tmp_path / "one.csv"
        path.write_text(f"mass_kg,vx_m_s,vy_m_s,vz_m_s,z_m\n{mass},{speed},0,0,1\n")
        with pytest.raises(flight.InputError) as of_file:
            flight.Fragments.read(path)
        assert str(of_file.value).endswith(str(of_array.value))


def test_ranges_are_those_of_flights_with_the_same_ricochet():
    """One default everywhere, and none of it matters before the first impact."""
    table = flight.range_table([0.01, 0.1], 800.0, [2.0, 20.0], threads=1)
    still = flight.range_table([0.01, 0.1], 800.0, [2.0, 20.0], ricochet="none", threads=1)
    assert (table == still).all()
    assert flight.fly(PAIR, threads=1).summary["ricochets"] > 0
