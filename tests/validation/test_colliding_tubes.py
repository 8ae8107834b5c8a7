"""Checks of the colliding tubes on made-up snapshots."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

from validation.colliding_tubes.check import REFERENCE, Metal, check, check_pair, middle_of, reference_shares
from validation.runs import StudyError

SIZE = 5e-3


def metal(within_ten, within_twenty, mean=222.0):
    """A thousand cells: shares within 10 and 20 degrees of either side, the rest straight away from the plane."""
    count = 1000
    near, next_ones = round(within_ten * count), round((within_twenty - within_ten) * count)
    degrees = np.concatenate([np.full(near, 5.0), np.full(next_ones, 15.0), np.full(count - near - next_ones, 80.0)])
    side = np.where(np.arange(count) % 2, 1.0, -1.0)
    azimuth = np.radians(degrees)
    velocity = np.stack([np.sin(azimuth), side * np.cos(azimuth), np.full(count, 0.1)], axis=1)
    velocity *= mean / velocity[:, 0].mean()
    return Metal(np.ones(count), velocity)


def burst(beyond=0.0, inside=0.0, size=SIZE):
    passed = {"beyond_planes": beyond, "in_other_rounds": inside}
    return {"cell_size": size, "casing_mass": 20.0, "passed_through": passed}


def verdicts(rows):
    return {row.quantity.split(": ")[1]: row.passed for row in rows}


def test_the_references_shares_pass():
    assert reference_shares(SIZE) == [0.278, 0.567]
    assert reference_shares(3.5e-3) == reference_shares(3.75e-3) == [0.290, 0.565]
    rows = check("5 mm", metal(0.278, 0.567), burst())
    assert all(row.passed for row in rows)
    assert [row.unit for row in rows[1:]] == ["%", "%", "m/s"]
    assert rows[1].ours == pytest.approx(27.8)
    assert rows[1].tolerance * rows[1].reference == pytest.approx(3.0)
    assert rows[2].tolerance * rows[2].reference == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("found", "missed"),
    [
        (metal(0.309, 0.567), "mass within 10 degrees"),
        (metal(0.278, 0.546), "mass within 20 degrees"),
        (metal(0.278, 0.567, mean=219.0), "mean velocity away from the plane"),
    ],
)
def test_a_share_off_by_more_than_its_points_or_a_slow_tube_is_missed(found, missed):
    reported = verdicts(check("5 mm", found, burst()))
    assert [name for name, passed in reported.items() if not passed] == [missed]


def test_metal_behind_the_plane_voids_the_comparison():
    reported = verdicts(check("5 mm", metal(0.278, 0.567), burst(beyond=0.03)))
    assert reported == {"mass behind the plane at the end": False}


def test_the_pair_is_held_against_the_mirrored_tube():
    one, other = metal(0.27, 0.55), metal(0.29, 0.56)
    assert all(row.passed for row in check_pair("two", [one, other], metal(0.278, 0.556), burst()))
    reported = verdicts(check_pair("two", [one, metal(0.2, 0.56)], metal(0.278, 0.556), burst(inside=0.04)))
    assert [name for name, passed in reported.items() if not passed] == [
        "mass within the neighbour at the end",
        "mass within 10 degrees",
    ]


def test_the_counted_metal_is_the_middle_of_the_casing_and_x_leads_away_from_the_plane(tmp_path):
    """Cells of casing, stations inside and out, a charge; of two tubes, each with x towards its own side."""
    path = tmp_path / "burst_snapshot.h5"
    stations = np.array([0.05, 0.15, 0.15, 0.19, 0.15])
    with h5py.File(path, "w") as file:
        file["nodes/reference"] = np.array([[1.0, 0, 0], [-1.0, 0, 0]])
        file["nodes/velocity"] = np.array([[100.0, 50, 0], [-300.0, 50, 0]])
        file["cells/nodes"] = np.array([[0] * 8, [0] * 8, [0] * 8, [1] * 8, [1] * 8])
        file["cells/part"] = np.array([0, 0, 1, 0, 1])
        file["cells/station"] = stations
        file["cells/mass"] = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
        file["cells/round"] = np.array([0, 0, 0, 1, 1])
    first, second = middle_of(path)
    assert (first.mass.tolist(), second.mass.tolist()) == ([2.0], [8.0])
    assert (first.mean_velocity, second.mean_velocity) == (100.0, 300.0)
    with pytest.raises(StudyError, match="no snapshot of a burst"):
        middle_of(tmp_path / "none.h5")
    assert REFERENCE["stations"] == [0.1, 0.2]
