"""Sectors of rounds: equal cost, every layer on every rank, whole rounds where there are enough."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("numba")

from burst_fenicsx.meshing import merge, mesh_round
from burst_fenicsx.meshing.distributed import partition
from burst_fenicsx.problem import Part
from tests.burst_fenicsx.tubes import tube

LYING = tube(name="lying", position=(0.5, 0.1, 0.3), axis=(1.0, 2.0, -0.5))


@pytest.fixture(scope="module")
def pair():
    rounds = [tube(), LYING]
    return merge([mesh_round(item, 12e-3, index) for index, item in enumerate(rounds)]), rounds


def costs(mesh, owner, ranks):
    return np.bincount(owner, weights=np.where(mesh.part == Part.CHARGE, 0.8, 1.0), minlength=ranks)


@pytest.mark.parametrize("ranks", [1, 2, 3, 4, 7, 16, 100, 1000])
def test_costs_are_equal_to_a_cell(pair, ranks):
    mesh, rounds = pair
    owner = partition(mesh, rounds, ranks)
    assert owner.dtype == np.int32
    found = costs(mesh, owner, ranks)
    assert np.abs(found - found.mean()).max() <= 1.0


def test_two_ranks_have_a_round_each(pair):
    mesh, rounds = pair
    assert np.array_equal(partition(mesh, rounds, 2), mesh.round)


@pytest.mark.parametrize("ranks", [4, 6, 10])
def test_every_rank_has_its_share_of_every_layer(pair, ranks):
    """Upright and lying: in each layer of a round its ranks have as many cells of each part, to two rows of them."""
    mesh, rounds = pair
    owner = partition(mesh, rounds, ranks)
    per_round = ranks // 2
    for index in range(2):
        for station in np.unique(mesh.station[mesh.round == index]):
            layer = (mesh.round == index) & (mesh.station == station)
            assert set(owner[layer]) == set(range(index * per_round, (index + 1) * per_round))
            for part in (Part.CASING, Part.CHARGE):
                cells = np.bincount(owner[layer & (mesh.part == part)] - index * per_round, minlength=per_round)
                assert np.ptp(cells) <= 8


def test_it_does_not_depend_on_where_a_round_stands():
    alone = mesh_round(tube(), 12e-3, 0)
    turned = mesh_round(LYING, 12e-3, 0)
    assert np.array_equal(partition(alone, [tube()], 5), partition(turned, [LYING], 5))
