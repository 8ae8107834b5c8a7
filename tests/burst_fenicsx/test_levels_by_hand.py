"""Levels of local steps and the grid of forces, by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

from burst_fenicsx.mechanics.fields import make_fields
from burst_fenicsx.mechanics.subcycling import Subcycling
from burst_fenicsx.meshing.distributed import distribute
from burst_fenicsx.problem import Part, Round
from tests.burst_fenicsx.boxes import BARE, COMP_B, STEEL, TNT, box, no_leakage, plain_inputs

pytestmark = pytest.mark.dolfinx

SOFT = replace(STEEL, elastic_modulus=1e9)


@pytest.mark.parametrize("contact_level", [0, 2, 4])
def test_nodes_that_may_touch_step_no_longer_than_contact(contact_level):
    """Of four nodes two may touch; they move in the order of their levels."""
    level, calls = np.array([0, 1, 3], dtype=np.int8), []
    nodes = SimpleNamespace(
        finest=np.zeros(4, dtype=np.int8), velocity=np.arange(12.0).reshape(4, 3), mean=np.zeros((4, 3))
    )
    fields = SimpleNamespace(
        nodes=nodes, inverse_mass=np.array([1.0, 2.0, 3.0, 4.0]), regroup=lambda *found: calls.append(found)
    )
    cycles = SimpleNamespace(
        _looked_at=level, _fields=fields, _touched=np.array([True, False, True, False]), contact_level=contact_level,
        _finest=np.array([0, 1, 3, 2], dtype=np.int8), _coarsest=np.array([0, 1, 1, 2], dtype=np.int8),
        _comm=MPI.COMM_SELF,
    )  # fmt: skip
    Subcycling.set_levels(cycles, level)
    expected = [max(contact_level, 0), 1, max(contact_level, 3), 2]
    assert nodes.finest.tolist() == expected
    assert cycles.highest == max(3, contact_level)
    order = sorted(range(4), key=lambda n: -expected[n])
    assert cycles.motion[0].tolist() == order
    assert cycles.motion[1].tolist() == [expected[n] for n in order]
    assert cycles.motion[2].tolist() == [int([0, 1, 1, 2][n] < expected[n]) for n in order]
    assert cycles.motion[3].tolist() == [n + 1.0 for n in order]
    assert cycles.moving.tolist() == [sum(e >= k for e in expected) for k in range(cycles.highest + 1)]
    assert cycles.cell_steps == 1 + 2 + 8
    np.testing.assert_array_equal(nodes.mean, nodes.velocity)
    assert calls == [(level, cycles.highest)]


def test_forces_are_rounded_for_the_strongest_of_all_rounds():
    """The order of the rounds and a weaker one beside the strongest change nothing."""
    mesh = box((1, 1, 2), (0.01, 0.01, 0.02), Part.CHARGE)
    mesh = replace(mesh, round=np.array([0, 1], dtype=np.int32), lengths=(0.02, 0.02))
    weak = replace(TNT, detonation_velocity=0.3 * TNT.detonation_velocity)
    found = []
    for explosives in ((COMP_B, weak), (weak, COMP_B), (COMP_B, COMP_B), (weak, weak)):
        distributed = distribute(MPI.COMM_SELF, mesh)
        rounds = [Round(name, explosive, SOFT) for name, explosive in zip("ab", explosives, strict=True)]
        inputs = plain_inputs(distributed, mesh, no_leakage(BARE, MPI.COMM_SELF))
        found.append(make_fields(distributed, rounds, BARE, **inputs).nodes.rounding)
    assert found[0] == found[1] == found[2]
    assert found[3] < found[0]
