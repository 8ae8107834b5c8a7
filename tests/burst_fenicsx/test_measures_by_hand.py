"""Speeds and radii by round and station, by hand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

from burst_fenicsx.problem import Part
from burst_fenicsx.records.measures import Measures

pytestmark = pytest.mark.dolfinx


def measured():
    """Two rounds of 0.4 and 0.2 m with four bins each; nodes of the second move outward, cells at given speeds."""
    station = np.array([0.05, 0.15, 0.15, 0.4, 0.01, 0.12, 0.12, 0.19])  # the fourth lies at the very end
    part = np.full(8, Part.CASING)
    part[1] = Part.CHARGE
    speed = np.array([10.0, 999.0, 20.0, 30.0, 40.0, 50.0, 80.0, 60.0])
    start = np.zeros((6, 3))
    start[:, 0] = 0.1
    moved = np.array([[0, 0, 5], [1, 0, 0], [2, 0, 0], [4, 9, 0], [6, 0, 9], [0, 0, 0]]) * 1e-3
    weight = np.array([1.0, 1.0, 1.0, 1.0, 0.5, 1.0])
    whole = SimpleNamespace(
        part=part, station=station, round=np.repeat([0, 1], 4), lengths=(0.4, 0.2), node_weight=weight
    )
    mesh = SimpleNamespace(comm=MPI.COMM_SELF, node=np.arange(6), owned_nodes=6, all_cells=np.asarray)
    velocity = speed[:, None] * np.array([0.6, 0.0, 0.8])
    state = SimpleNamespace(
        mesh=mesh, start=start, nodes=SimpleNamespace(position=start + moved),
        cell_mass=np.array([1.0, 9.0, 2.0, 3.0, 1.0, 3.0, 1.0, 5.0]), cell_velocities=lambda: velocity,
    )  # fmt: skip
    surfaces = SimpleNamespace(
        bin_round=np.repeat([0, 1], 4), bin_station=np.tile([0.125, 0.375, 0.625, 0.875], 2),
        casing_bin=np.array([0, 0, 1, 4, 4, -1]), outward=np.tile([1.0, 0.0, 0.0], (6, 1)), radius=np.full(6, 0.1),
    )  # fmt: skip
    return Measures(state, surfaces, whole, multiplicity=np.array([1.0, 2.0]))


def test_speeds_of_a_round_are_means_by_mass_of_the_cells_in_each_bin():
    first, second = measured().rounds()
    np.testing.assert_allclose(first.mean_speed, [10.0, 20.0, 0.0, 30.0], rtol=1e-9)
    np.testing.assert_allclose(first.max_speed, [10.0, 20.0, 0.0, 30.0], rtol=1e-12)
    np.testing.assert_allclose(second.mean_speed, [40.0, 0.0, (3.0 * 50.0 + 80.0) / 4.0, 60.0], rtol=1e-9)
    np.testing.assert_allclose(second.max_speed, [40.0, 0.0, 80.0, 60.0], rtol=1e-12)
    # Masses are those of whole rounds, of which the second is half; cells in the order of their speed.
    np.testing.assert_allclose(first.casing_mass, [1.0, 2.0, 0.0, 3.0], rtol=1e-9)
    np.testing.assert_allclose(second.casing_mass, [2.0, 0.0, 8.0, 10.0], rtol=1e-9)
    np.testing.assert_allclose(second.speed, [40.0, 50.0, 60.0, 80.0], rtol=1e-12)
    np.testing.assert_allclose(second.mass, [2.0, 6.0, 10.0, 2.0], rtol=1e-12)
    np.testing.assert_allclose(second.station, [0.125, 0.375, 0.625, 0.875])
    assert second.outer_diameter[0] == pytest.approx(0.2 + 14e-3 / 1.5, rel=1e-9)


def test_radii_are_means_by_weight_of_the_nodes_in_each_bin():
    radii = measured().outer_radii()
    expected = [0.1 + 0.5e-3, 0.1 + 2e-3, np.nan, np.nan, 0.1 + (4.0 + 0.5 * 6.0) / 1.5 * 1e-3, np.nan, np.nan, np.nan]
    np.testing.assert_allclose(radii, expected, rtol=1e-9)
    assert Measures.outer_diameter(radii) == pytest.approx(2.0 * expected[4], rel=1e-9)
