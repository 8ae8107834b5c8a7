"""Check of the M107 over cell sizes, on made-up snapshots and summaries."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

from tests.burst_fenicsx.boxes import ring_sector
from validation.m107_convergence.check import WallProfile, check_distances, check_wall, wall_profile
from validation.runs import StudyError

INNER, OUTER = 0.055, 0.075


def snapshot(path, layers, axial):
    """A quarter of a wall along z with the axial speed `axial(depth)` (m/s); stations count down from 1 m."""
    mesh = ring_sector(INNER, OUTER, 0.5 * np.pi, 1.0, (layers, 8, 40))
    depth = np.hypot(mesh.nodes[:, 0], mesh.nodes[:, 1]) - INNER
    with h5py.File(path, "w") as file:
        file["nodes/reference"] = mesh.nodes
        file["nodes/velocity"] = np.stack([0 * depth, 0 * depth, axial(depth)], axis=1)
        file["cells/nodes"], file["cells/station"] = mesh.cells, mesh.station
        file["cells/part"], file["cells/mass"] = np.zeros(len(mesh.cells), int), np.ones(len(mesh.cells))
    return path


@pytest.mark.parametrize("layers", [2, 5])
def test_the_profile_is_that_of_the_velocity_field(tmp_path, layers):
    """A linear field comes back at the layers' centres, whatever their number."""
    found = wall_profile(snapshot(tmp_path / "snapshot.h5", layers, lambda depth: -70.0 - 2000.0 * depth))
    assert len(found.depth) == layers
    # Chords lie inside the arcs: eight cells a quarter take 0.5 % off a radius.
    assert found.depth == pytest.approx((np.arange(layers) + 0.5) * (OUTER - INNER) / layers, abs=0.005 * OUTER)
    assert found.speed == pytest.approx(-70.0 - 2000.0 * (np.arange(layers) + 0.5) * (OUTER - INNER) / layers, abs=1e-9)
    assert found.at(0.01) == pytest.approx(-90.0, abs=1.0)


def test_a_jump_and_a_spread_fail_their_rows():
    """The innermost layer 50 m/s off fails the jump, and the depth near it fails between sizes."""
    smooth = WallProfile(np.array([3e-3, 9e-3, 15e-3]), np.array([-80.0, -95.0, -110.0]))
    jumps = WallProfile(np.array([3e-3, 9e-3, 15e-3]), np.array([-45.0, -95.0, -110.0]))
    assert all(row.passed for row in check_wall({"6 mm": smooth, "3 mm": smooth}))
    assert [row.passed for row in check_wall({"6 mm": smooth, "3 mm": jumps})] == [False, False, True, True]


def test_distances_are_compared_with_the_finest():
    """Allowed by size: 6 % at 6 mm, 3 % at 4 mm; the two finest within two standard errors."""

    def hazard(distance, error=1.0):
        return {"expected": distance, "upper": distance + 2.0, "standard_error": error}

    rows = check_distances("TNT", {"6 mm": hazard(74.0), "4 mm": hazard(71.5), "3 mm": hazard(70.0)})
    assert [row.passed for row in rows] == [True, None, True, None, None, None, True]
    rows = check_distances("TNT", {"6 mm": hazard(75.0), "4 mm": hazard(73.0), "3 mm": hazard(70.0)})
    assert [row.passed for row in rows if row.passed is not None] == [False, False, False]


def test_a_file_that_is_no_snapshot_is_named(tmp_path):
    """The study ends with the file in its message."""
    with pytest.raises(StudyError, match=r"none\.h5: no snapshot of a burst"):
        wall_profile(tmp_path / "none.h5")
