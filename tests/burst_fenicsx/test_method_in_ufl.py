"""The method stated in UFL (docs/theory/method_in_ufl.py) and the solver move the same tube alike."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from docs.theory import method_in_ufl as demo

pytestmark = pytest.mark.dolfinx


def test_plain_forms_and_the_solver_move_a_tube_alike():
    moved, positions, velocities = demo.differences()
    assert moved > 0.1 * 0.026  # of the outer radius
    assert positions < 1e-10
    assert velocities < 1e-10


@pytest.mark.parametrize(
    "name", ["shear_strength", "tensile_strength", "shear_softening_strain", "tensile_softening_strain"]
)
def test_every_property_of_the_steel_matters_in_that_tube(name, monkeypatch):
    """A thousandth more moves a node by far more than the two ways differ."""
    mesh = demo.tube()
    position, _ = demo.by_solver(mesh)
    monkeypatch.setattr(demo, "STEEL", replace(demo.STEEL, **{name: 1.001 * getattr(demo.STEEL, name)}))
    other, _ = demo.by_solver(mesh)
    assert np.abs(other - position).max() > 1e-7 * np.abs(position - mesh.nodes).max()
