"""Speeds by station and their quantiles over the mass; distorted cells."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.meshing import merge
from burst_fenicsx.problem import Part
from burst_fenicsx.records.measures import Distortion, Measures, RoundMeasures, speed_quantiles
from tests.burst_fenicsx.bodies import bodies, moved
from tests.burst_fenicsx.boxes import burst, distorted_box, grid
from tests.burst_fenicsx.test_erosion import drawn

pytestmark = pytest.mark.dolfinx


def measured(speed, mass):
    nothing = np.zeros(0)
    return RoundMeasures(nothing, nothing, nothing, nothing, nothing, np.asarray(speed), np.asarray(mass))


def test_quantiles_of_speed_are_those_of_the_mass():
    """A mass that grows evenly with the speed: the speed itself, whatever the whole mass and however it is shared."""
    speed = np.linspace(0.0, 1000.0, 2001)[1::2]  # of cells of 1 m/s, at their middles
    for whole in (0.02, 7.0):
        mass = np.full(1000, whole / 1000)
        both = [measured(speed[:300], mass[:300]), measured(speed[300:], mass[300:])]
        for rounds in ([measured(speed, mass)], both, both[::-1]):
            found = speed_quantiles(rounds)
            assert found == {"90": pytest.approx(900.0, abs=0.01), "99": pytest.approx(990.0, abs=0.01)}
    # Three quarters of the mass at 100 m/s, the rest at 500: on the line between the middles of both, 0.375 and 0.875.
    assert speed_quantiles([measured([500.0, 100.0], [0.5, 1.5])])["90"] == 500.0
    assert speed_quantiles([measured([500.0, 100.0], [0.1, 0.9])])["90"] == pytest.approx(100.0 + 400.0 * 0.45 / 0.5)
    assert speed_quantiles([measured([], [])]) == {"90": 0.0, "99": 0.0}


def no_bins(mesh, bins=0):
    """Surfaces of a mesh none of whose nodes is in one of the bins of its two rounds."""
    nowhere = np.full(len(mesh.nodes), -1, dtype=np.int32)
    outward, radius = np.zeros_like(mesh.nodes), np.zeros(len(mesh.nodes))
    bin_round, place = np.repeat([0, 1], bins), np.tile((np.arange(bins) + 0.5) / max(bins, 1), 2)
    return SimpleNamespace(
        casing_bin=nowhere, outward=outward, radius=radius, bin_round=bin_round, bin_station=place
    )  # fmt: skip


def test_speeds_of_a_round_are_means_by_mass_of_the_cells_in_each_bin():
    """Two bars with cells of very different mass, two to a bin; the second is half of a round with its image."""
    uneven = 0.02 * np.array([0, 2, 5, 6, 10, 14, 15, 17, 20])
    bar = grid((1, 1, 8), lambda p: np.column_stack([0.01 * p[:, :2], uneven[np.rint(8 * p[:, 2]).astype(int)]]))
    rounds = [bar, moved(bar, (1.0, 0.0, 0.0), 1)]
    solver, mesh = bodies(rounds, [(0.0, 0.0, 0.0)] * 2), merge([replace(one, segments=((),)) for one in rounds])
    state = solver.fields
    random = np.random.default_rng(6)
    state.nodes.velocity[:] = random.uniform(100.0, 900.0, (len(mesh.nodes), 1)) * [0.6, 0.0, 0.8]
    speed, cell_mass = np.empty((2, len(mesh.cells)))
    speed[state.mesh.cell] = np.linalg.norm(state.nodes.velocity[state.mesh.dofmap].mean(axis=1), axis=1)
    cell_mass[state.mesh.cell] = state.cell_mass
    first, second = Measures(state, no_bins(mesh, 4), mesh, multiplicity=np.array([1.0, 2.0])).rounds()
    station = 0.4 - mesh.nodes[mesh.cells].mean(axis=1)[:, 2]
    for index, (found, times) in enumerate(((first, 1.0), (second, 2.0))):
        for k in range(4):
            own = np.flatnonzero((mesh.round == index) & (station // 0.1 == k))
            mass = cell_mass[own]
            assert len(own) == 2
            assert mass.max() > 1.1 * mass.min()
            assert found.casing_mass[k] == pytest.approx(times * mass.sum(), rel=1e-12)
            assert found.mean_speed[k] == pytest.approx(np.average(speed[own], weights=mass), rel=1e-12)
            assert found.max_speed[k] == pytest.approx(speed[own].max(), rel=1e-12)
        whole = np.flatnonzero(mesh.round == index)
        whole = whole[np.argsort(speed[whole])]
        np.testing.assert_allclose(found.speed, speed[whole], rtol=1e-12)
        np.testing.assert_allclose(found.mass, times * cell_mass[whole], rtol=1e-12)
        assert found.mean == pytest.approx(np.average(speed[whole], weights=cell_mass[whole]), rel=1e-12)
        assert found.largest == pytest.approx(speed[whole].max(), rel=1e-12)


def test_distorted_cells_are_counted_once_for_every_image():
    """A folded cell that is then eroded; a lost one, which is folded as well; of a charge they weigh nothing."""
    solver, cell = drawn()
    state = solver.fields
    given = grid((3, 3, 3), lambda p: p * 9e-3)
    count = Measures(state, no_bins(given), given, images=4).distortion
    folded = int(state.folded().sum())
    mass = 4.0 * state.cell_mass[state.folded()].sum()
    assert count() == Distortion(0, 4 * folded, pytest.approx(mass, rel=1e-12), 0.0, 0)
    solver.erode_metal()
    eroded = 4.0 * state.cell_mass[cell]
    assert count() == Distortion(0, 4 * folded - 4, pytest.approx(mass - eroded, rel=1e-12), pytest.approx(eroded), 4)
    for part, weight in ((Part.CASING, 1.0), (Part.CHARGE, 0.0)):
        given = distorted_box(1, 1e-3, part)
        state = burst(given).fields
        state.nodes.position[:, 2] *= -1.0
        found = Measures(state, no_bins(given), given, images=4).distortion()
        assert found == Distortion(4, 4, pytest.approx(4.0 * weight * state.cell_mass[0]))
