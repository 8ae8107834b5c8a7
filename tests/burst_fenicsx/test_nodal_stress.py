"""Stress projected to the nodes: linear fields, sums, parts that are not mixed, the series that has it if asked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.meshing.placement import frame
from burst_fenicsx.problem import ContactSettings, Part
from burst_fenicsx.records.gather import nodal_stress
from burst_fenicsx.run_burst import simulate
from burst_fenicsx.simulation import Simulation
from tests.burst_fenicsx.boxes import boundary_nodes, box, burst, distorted_box
from tests.burst_fenicsx.tubes import SETTINGS, tube
from tests.datasets import datasets

pytestmark = pytest.mark.dolfinx

SHARED = ContactSettings(charge_casing="shared", surfaces=False)
SLOPE = np.random.default_rng(5).normal(size=(3, 6)) * 1e11  # Pa/m


def at_nodes(state, stress):
    """Stress (cells, 6) of a burst on one rank at its nodes; eroded cells have no weight."""
    mesh = state.mesh
    weight = np.where(state.eroded, 0.0, state.volumes())
    return nodal_stress(mesh.dofmap, len(mesh.node), stress, weight, mesh.part != Part.CHARGE)


def projected(mesh, change=None):
    """Nodes (m), stress there by the projection of a linear field at the cells' centres, and the field itself."""
    state = burst(mesh).fields
    if change is not None:
        change(state)
    centre = state.start[state.mesh.dofmap].mean(axis=1)
    found = at_nodes(state, 1e9 + centre @ SLOPE)
    return state, found, 1e9 + state.start @ SLOPE


def test_a_linear_stress_is_reproduced_inside():
    """At the surface the projection has that of the cells there, half a cell away."""
    mesh = box((4, 5, 6), (0.02, 0.03, 0.04))
    state, found, exact = projected(mesh)
    surface = boundary_nodes(mesh)[state.mesh.node]
    np.testing.assert_allclose(found[~surface], exact[~surface], rtol=0.0, atol=1e-12 * np.abs(exact).max())
    inward = np.clip(
        state.start, 0.5 * (h := np.array([0.005, 0.006, 0.04 / 6])), np.array([0.02, 0.03, 0.04]) - 0.5 * h
    )
    np.testing.assert_allclose(found, 1e9 + inward @ SLOPE, rtol=0.0, atol=1e-12 * np.abs(exact).max())


def test_the_integral_over_distorted_cells_is_kept():
    state, found, _ = projected(distorted_box(4, 5e-3))
    volume, centre = state.volumes(), state.start[state.mesh.dofmap].mean(axis=1)
    share = np.bincount(state.mesh.dofmap.ravel(), np.repeat(volume / 8.0, 8), minlength=len(found))
    np.testing.assert_allclose(share @ found, volume @ (1e9 + centre @ SLOPE), rtol=1e-12)


def test_metal_and_charge_are_not_mixed_and_eroded_cells_do_not_count():
    mesh = box((3, 1, 1), (0.03, 0.01, 0.01))
    mesh = replace(mesh, part=np.array([Part.CASING, Part.CASING, Part.CHARGE], dtype=np.int32))
    state = burst(mesh).fields
    stress = np.outer([1e9, 3e9, 7e9], np.ones(6))
    column = np.rint(state.start[:, 0] / 0.01).astype(int)
    found = at_nodes(state, stress)
    np.testing.assert_allclose(found, np.array([1e9, 2e9, 3e9, 7e9])[column][:, None] * np.ones(6), rtol=1e-12)
    flags = np.zeros(3, dtype=np.int8)
    flags[1] = 1
    state.solid.eroded[:] = state.blocks.by_slot(flags)
    stress[1] = np.nan
    found = at_nodes(state, stress)
    np.testing.assert_allclose(found, np.array([1e9, 1e9, 7e9, 7e9])[column][:, None] * np.ones(6), rtol=1e-12)
    state.solid.eroded[:] = 1
    assert (at_nodes(state, stress) == 0.0).all()


def last_state(folder):
    """Fields of the last state of the series."""
    return datasets(max((folder / "burst").iterdir()))


@pytest.mark.parametrize("asked", [True, False])
def test_the_series_has_it_where_it_is_asked_for(tmp_path, asked):
    settings = replace(SETTINGS, contact=SHARED, nodal_stress=asked)
    simulate([tube()], settings, tmp_path, comm=MPI.COMM_SELF)
    found = last_state(tmp_path)
    assert ("point/nodal_stress" in found) == asked
    if asked:
        cell, point = found["cell/stress"], found["point/nodal_stress"]
        assert point.shape[1] == 9
        assert np.abs(point).max() > 0.5 * np.abs(cell).max() > 0.0
        rounding = 1e-6 * np.abs(cell).max()
        assert (point.min(axis=0) >= cell.min(axis=0) - rounding).all()
        assert (point.max(axis=0) <= cell.max(axis=0) + rounding).all()


def test_mirrored_rounds_have_mirrored_stresses(tmp_path):
    """Two tubes of which a quarter each is computed, against both in full."""
    rounds = [tube(name="left"), tube(name="right", position=(0.4, 0.0, 0.0))]
    found = {}
    for symmetry in ("off", "auto"):
        settings = replace(SETTINGS, end_time=10e-6, symmetry=symmetry, nodal_stress=True)
        run = Simulation(rounds, settings, tmp_path / symmetry, MPI.COMM_SELF, {})
        (tmp_path / symmetry).mkdir()
        run.run()
        state = last_state(tmp_path / symmetry)
        place, stress = state["position"], state["point/nodal_stress"]
        # Nodes in a cut have the cells of one side.
        away = (np.abs(place[:, 1]) > 1e-3) & (np.abs(place[:, 0] - 0.2) < 0.199) & (place[:, 0] > 1e-9)
        order = np.lexsort(np.round(place[away], 6).T)
        found[symmetry] = place[away][order], stress[away][order]
    assert run.completion.trivial is False
    np.testing.assert_allclose(found["auto"][0], found["off"][0], atol=1e-8)
    np.testing.assert_allclose(found["auto"][1], found["off"][1], atol=1e-4 * np.abs(found["off"][1]).max())


def test_stresses_of_a_meridian_turn_with_its_axis(tmp_path):
    axis, states = (2.0, -1.0, 2.0), {}
    for name, along in (("upright", (0.0, 0.0, 1.0)), ("tilted", axis)):
        settings = replace(SETTINGS, geometry="axisymmetric", cell_size=14e-3, nodal_stress=True)
        (tmp_path / name).mkdir()
        burst = Simulation([tube(axis=along)], settings, tmp_path / name, MPI.COMM_SELF, {})
        burst.run()
        burst.finish()
        revolved = datasets(tmp_path / name / "burst_revolved" / "0000.h5")["cell/stress"]
        states[name] = last_state(tmp_path / name) | {"revolved": revolved}
    own = np.eye(3)  # burst.xdmf shows the meridian in a plane of its own
    for name, turn in (("cell/stress", own), ("point/nodal_stress", own), ("revolved", frame(axis).T)):
        upright, tilted = (states[run][name].reshape(-1, 3, 3) for run in ("upright", "tilted"))
        assert np.abs(tilted).max() > 5e8  # Pa: of the metal
        assert turn is own or np.abs(tilted - upright).max() > 5e8
        np.testing.assert_allclose(tilted, turn @ upright @ turn.T, rtol=0.0, atol=1e-6 * np.abs(upright).max())
