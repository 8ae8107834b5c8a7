"""Attitude in the case: axes from words and angles, what is refused, how an arrangement turns."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from flight import Fragments
from fragfield.case import load_case, plain
from fragfield.case.conversion.attitude import attitude_of, attitude_words, axis_of
from fragfield.case.conversion.rounds import placed
from fragfield.case.conversion.turned import Arrangement
from fragfield.case.load import case_from_document
from fragfield.case.write import to_toml
from fragfield.errors import InputError
from fragfield.pipeline.attitudes import coarse_attitudes
from tests.fragfield.case_documents import a_round, changed, write_case
from tests.fragfield.short_run import invoke

UP_1M = ["0 m", "0 m", "1 m"]
PAIR = {"stack": {"arrangement": "row", "count": 2, "gap": "20 mm"}}


def _case(changes=None, **tables):
    entry = a_round(**{"position": UP_1M, **(changes or {})})
    return case_from_document(changed(round=[entry], **tables), source="case", folder=Path())


def _refused(words, changes=None, **tables):
    with pytest.raises(InputError) as caught:
        _case(changes, **tables)
    for part in words:
        assert part in str(caught.value)


@pytest.mark.parametrize(
    ("given", "axis"),
    [
        ({}, (0, 0, 1)),
        ({"attitude": "upright"}, (0, 0, 1)),
        ({"attitude": "lying"}, (1, 0, 0)),
        ({"attitude": "lying", "azimuth": "90 deg"}, (0, 1, 0)),
        ({"attitude": "0 deg", "azimuth": "90 deg"}, (0, 0, 1)),
        ({"attitude": "180 deg"}, (0, 0, -1)),
        ({"attitude": "90 deg", "azimuth": "180 deg"}, (-1, 0, 0)),
        ({"attitude": "30 deg"}, (0.5, 0, math.sqrt(0.75))),
        ({"attitude": "60 deg", "azimuth": "-90 deg"}, (0, -math.sqrt(0.75), 0.5)),
    ],
)
def test_an_attitude_becomes_an_axis(given, axis):
    """And nothing else stays of it: the resolved case has one fact. Right angles are exact."""
    (entry,) = _case(given).round
    assert entry.axis == pytest.approx(axis, abs=1e-14)
    assert all(found == want for found, want in zip(entry.axis, axis, strict=True) if want in (0, 1, -1))
    assert entry.attitude is None
    assert entry.azimuth is None
    assert not {"attitude", "azimuth"} & set(plain(_case(given))["round"][0])


@pytest.mark.parametrize(
    ("given", "kind", "words"),
    [
        ({}, "upright", "upright, nose up; base 1 m over the ground"),
        ({"attitude": "180 deg"}, "inclined", "upright, nose down; base 1 m over the ground"),
        ({"attitude": "lying", "azimuth": "90 deg"}, "lying", "lying, nose to azimuth 90°; base 1 m over the ground"),
        (
            {"attitude": "30 deg", "azimuth": "45 deg"},
            "inclined",
            "inclined by 30 deg from upright, nose to azimuth 45°; base 1 m over the ground",
        ),
        ({"attitude": "any"}, "any", "mixed attitudes, the distance is that of the worst; base as placed 1 m over"),
    ],
)
def test_the_attitude_in_words(given, kind, words):
    part = attitude_of(_case(given))
    assert part.kind == kind
    assert attitude_words(part).startswith(words)


def test_rounds_that_stand_and_lie_are_named():
    lying = {**a_round(name="b", attitude="lying"), "position": ["1 m", "0 m", "0.5 m"]}
    entry = {**a_round(), "position": UP_1M}
    case = case_from_document(changed(round=[entry, lying]), source="case", folder=Path())
    part = attitude_of(case)
    assert part.kind == "several"
    assert part.words == "a upright, nose up; b lying, nose to azimuth 0°"
    assert part.base_height == pytest.approx(0.5)


def test_a_stack_has_the_attitude_of_its_round():
    lying = _case({"attitude": "lying", "azimuth": "90 deg"}, **PAIR)
    assert [entry.axis for entry in lying.round] == [(0.0, 1.0, 0.0)] * 2
    mixed = _case({"attitude": "any"}, **PAIR)
    assert [entry.attitude for entry in mixed.round] == ["any"] * 2
    assert [entry.axis for entry in mixed.round] == [(0.0, 0.0, 1.0)] * 2


def test_a_resolved_case_of_mixed_attitudes_is_read_again(tmp_path):
    case = _case({"attitude": "any"})
    again = load_case(write_case(tmp_path, to_toml(case)))
    assert plain(again)["round"] == plain(case)["round"]


def test_distances_of_any_are_counted_from_the_rounds():
    _refused(
        ["flight.origin: found 2 m from the centre of the rounds", "at most 0.5 m"],
        {"attitude": "any"},
        flight={"origin": ["2 m", "0 m"]},
    )
    assert _case({"attitude": "any"}, flight={"origin": ["0.4 m", "0 m"]}).round[0].attitude == "any"


def test_the_check_says_the_attitude_and_what_any_costs(tmp_path):
    text = (
        '[burst]\ncell_size = "14 mm"\n[[round]]\nname = "a"\nprofile = "tube"\nexplosive = "tnt"\ncasing = "copper"\n'
    )
    path = write_case(tmp_path, text + 'attitude = "any"\n')
    done = invoke("check", path)
    assert done.exit_code == 0, done.stderr
    assert "attitude: mixed attitudes, the distance is that of the worst; base as placed 0 m over" in done.stdout
    assert "the flight is computed in 13 attitudes" in done.stdout
    done = invoke(
        "check", path, "--set", "round.0.attitude=lying", "--set", "round.0.position=['0 m','0 m','1 m']", "--json"
    )
    assert done.exit_code == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["arrangement"]["attitude"]["words"] == "lying, nose to azimuth 0°"
    assert "attitudes" not in found["expected"]


# How an arrangement turns.


def test_the_centre_of_the_casings():
    """Of a tube half of its length up, of a pair midway, of a pair by symmetry as of a pair."""
    one = Arrangement(_case({"attitude": "any"}))
    length = float(np.ptp(placed(one.case.round[0]).reach((0, 0, 1))))
    assert one.centre == pytest.approx([0.0, 0.0, 1.0 + 0.5 * length], abs=1e-4 * length)
    pair = Arrangement(_case({"attitude": "any"}, **PAIR))
    assert pair.centre == pytest.approx(one.centre, abs=1e-12)
    mirror = {"name": "half", "kind": "symmetry", "normal": [1, 0, 0], "point": ["0 m", "0 m", "0 m"]}
    half = Arrangement(_case({"attitude": "any", "position": ["100 mm", "0 m", "1 m"]}, plane=[mirror]))
    assert half.centre == pytest.approx(one.centre, abs=1e-12)


@pytest.mark.parametrize("inclination", [0.0, 37.0, 90.0, 180.0])
def test_turning_keeps_speeds_energies_and_momentum(inclination):
    """And the distances of all fragments from each other; the momentum's size, not its direction."""
    random = np.random.default_rng(4)
    mass = random.uniform(0.001, 0.1, 50)
    before = Fragments(mass, random.normal(size=(50, 3)), 900.0 * random.normal(size=(50, 3)))
    turned = Arrangement(_case({"attitude": "any"}, **PAIR)).turned(inclination, 40.0)
    after = turned.fragments(before)
    speed = [np.linalg.norm(one.velocity, axis=1) for one in (before, after)]
    np.testing.assert_allclose(speed[1], speed[0], rtol=1e-12)
    np.testing.assert_allclose(0.5 * after.mass * speed[1] ** 2, 0.5 * before.mass * speed[0] ** 2, rtol=1e-12)
    momentum = [np.linalg.norm(one.mass @ one.velocity) for one in (before, after)]
    assert momentum[1] == pytest.approx(momentum[0], rel=1e-12)
    apart = [np.linalg.norm(one.position[:, None] - one.position, axis=-1) for one in (before, after)]
    np.testing.assert_allclose(apart[1], apart[0], atol=1e-12)
    np.testing.assert_array_equal(after.shape_factor, before.shape_factor)
    np.testing.assert_allclose(turned.matrix @ turned.matrix.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(turned.matrix) == pytest.approx(1.0)


def test_the_nose_goes_down_to_plus_x():
    arrangement = Arrangement(_case({"attitude": "any"}))
    for inclination in (0.0, 30.0, 90.0, 180.0):
        (entry,) = arrangement.turned(inclination).case.round
        assert entry.axis == pytest.approx(axis_of(math.radians(inclination), 0.0), abs=1e-12)


@pytest.mark.parametrize("height", ["0 m", "1 m"])
@pytest.mark.parametrize("tables", [{}, PAIR], ids=["single", "pair"])
def test_the_centre_keeps_its_height_unless_a_casing_would_be_in_the_ground(height, tables):
    """A metre up nothing is lifted; from the ground a turned casing is lifted until it touches it."""
    arrangement = Arrangement(_case({"attitude": "any", "position": ["0 m", "0 m", height]}, **tables))
    for inclination in (0.0, 20.0, 90.0, 160.0, 180.0):
        turned = arrangement.turned(inclination, 30.0)
        centre = turned.matrix @ arrangement.centre + turned.shift
        lowest = min(placed(entry).reach((0.0, 0.0, 1.0))[0] for entry in turned.case.round)
        assert centre[:2] == pytest.approx(arrangement.centre[:2], abs=1e-12)
        lift = centre[2] - arrangement.centre[2]
        if height == "1 m":
            assert lift == pytest.approx(0.0, abs=1e-12)
            assert lowest > 0.5
        else:
            assert lift >= -1e-12
            assert lowest == pytest.approx(0.0, abs=1e-6) if lift > 1e-6 else lowest > -1e-6
    if height == "0 m":
        assert arrangement.turned(160.0, 30.0).shift[2] > 0.0


def test_a_round_behind_a_plane_of_symmetry_is_lifted_too():
    """The image's lowest point counts: a pair inclined along its row, by one round and its image as by two."""
    half = {"attitude": "any", "position": ["100 mm", "0 m", "0 m"]}
    mirror = {"name": "half", "kind": "symmetry", "normal": [1, 0, 0], "point": ["0 m", "0 m", "0 m"]}
    by_symmetry = Arrangement(_case(half, plane=[mirror]))
    other = {**a_round(name="b"), **half, "position": ["-100 mm", "0 m", "0 m"]}
    both = case_from_document(changed(round=[a_round(**half), other]), source="case", folder=Path())
    for inclination in (50.0, 90.0, 130.0):
        np.testing.assert_allclose(
            by_symmetry.turned(inclination).shift, Arrangement(both).turned(inclination).shift, atol=1e-9
        )


def test_a_roll_of_one_round_of_revolution_changes_nothing():
    arrangement = Arrangement(_case({"attitude": "any"}))
    assert arrangement.even
    assert coarse_attitudes(arrangement) == [(15.0 * step, 0.0) for step in range(13)]


def test_rolls_that_are_mirror_images_are_flown_once():
    """A pair has two mirror planes: rolls of 0 to 90 degrees; rounds of different fill have one."""
    pair = Arrangement(_case({"attitude": "any"}, **PAIR))
    assert not pair.even
    assert [pair.roll(angle) for angle in (0, 30, 90, 120, 180, 210, 330)] == [0, 30, 90, 60, 0, 30, 30]
    attitudes = coarse_attitudes(pair)
    assert len(attitudes) == 2 + 11 * 4
    assert {roll for inclination, roll in attitudes if inclination in (0.0, 180.0)} == {0.0}
    entries = [a_round(name=name, explosive=fill, attitude="any", position=[place, "0 m", "1 m"])
               for name, fill, place in (("a", "tnt", "-0.2 m"), ("b", "comp_b", "0.2 m"))]  # fmt: skip
    unlike = Arrangement(case_from_document(changed(round=entries), source="case", folder=Path()))
    assert [unlike.roll(angle) for angle in (30, 150, 210, 330)] == [30, 150, 150, 30]


@pytest.mark.parametrize("roll", [0.0, 30.0, 200.0])
def test_rolls_that_count_as_one_are_mirror_images(roll):
    """The rounds of one lie where those of the other do, mirrored at the vertical plane of the nose."""
    pair = Arrangement(_case({"attitude": "any"}, **PAIR))
    places = []
    for one in (roll, pair.roll(roll)):
        turned = pair.turned(70.0, one).case.round
        places.append(sorted([*entry.position, *entry.axis] for entry in turned))
    flipped = sorted([x, -y, z, ax, -ay, az] for x, y, z, ax, ay, az in places[1])
    same = [np.allclose(sorted(places[0]), other, atol=1e-9) for other in (places[1], flipped)]
    assert any(same)
