"""The ring of a quadrilateral: volumes, masses, mean gradients, forces against UFL, hourglass control, rotation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

import dolfinx.fem
import ufl

from burst_fenicsx import compat
from burst_fenicsx.axisymmetric.mesh import folded, nodal_volumes, ring_volumes
from burst_fenicsx.kernels.axisymmetric.quadrilateral import ring_integrals
from burst_fenicsx.kernels.lanes import LANES
from burst_fenicsx.problem import Part
from tests.burst_fenicsx.axisymmetric.meridians import random_meridian, rectangle, ring_burst, stressed
from tests.burst_fenicsx.boxes import CONTROLLED, ELASTIC, carried, matrices, rotation_matrix

pytestmark = pytest.mark.dolfinx


def hourglass_forces(solver):
    """Stored hourglass forces, (cells, 3)."""
    slots = solver.fields.solid.hourglass.reshape(-1, 3, LANES).transpose(0, 2, 1).reshape(-1, 3)
    return solver.fields.blocks.by_cell(slots)


def boundary(mesh, solver):
    """Whether each local node lies on the outer boundary of a square meridian (the axis left out)."""
    count = round(len(mesh.cells) ** 0.5)
    number = np.arange((count + 1) ** 2).reshape(count + 1, count + 1)
    on = np.zeros(number.size, dtype=bool)
    on[np.concatenate([number[-1], number[:, 0], number[:, -1]])] = True
    return on[solver.fields.mesh.node]


def corners(mesh):
    return [(tuple(mesh.nodes[cell, 0]), tuple(mesh.nodes[cell, 2])) for cell in mesh.cells]


@pytest.mark.parametrize("inner", [0.0, 0.03])
def test_volume_and_its_derivatives_are_exact(inner):
    """Volume by Pappus from the centroids of two triangles; dV/dr = br + A, dV/dz = bz.

    V is at most quadratic in one coordinate of one node, so that central differences over any distance are exact.
    """
    mesh = random_meridian(4, 5e-3, inner)
    derivatives = np.empty((len(mesh.cells), 4, 2))
    for k, coordinate in enumerate((0, 2)):
        for corner in range(4):
            ends = []
            for sign in (1.0, -1.0):
                apart = mesh.nodes[mesh.cells].copy()
                apart[:, corner, coordinate] += sign * 1e-3
                ends.append(ring_volumes(apart.reshape(-1, 3), np.arange(4 * len(apart)).reshape(-1, 4)))
            derivatives[:, corner, k] = (ends[0] - ends[1]) / 2e-3
    for cell, (r, z) in enumerate(corners(mesh)):
        exact = 0.0
        for a, b, c in ((0, 1, 2), (0, 2, 3)):
            area = 0.5 * ((r[b] - r[a]) * (z[c] - z[a]) - (r[c] - r[a]) * (z[b] - z[a]))
            exact += 2.0 * np.pi * area * (r[a] + r[b] + r[c]) / 3.0
        br, bz, across, volume, _ = ring_integrals(r, z)
        assert volume == pytest.approx(exact, rel=1e-12)
        assert mesh.volumes[cell] == pytest.approx(exact, rel=1e-12)
        size = np.abs(derivatives[cell]).max()
        np.testing.assert_allclose(np.add(br, across), derivatives[cell, :, 0], atol=1e-11 * size)
        np.testing.assert_allclose(bz, derivatives[cell, :, 1], atol=1e-11 * size)
        assert abs(sum(bz)) < 1e-14 * size  # axial forces of a cell add up to nothing


def test_a_quadrilateral_is_folded_where_the_edges_at_a_corner_turn_backward():
    random = np.random.default_rng(4)
    counts = np.zeros(4, dtype=int)
    for _ in range(200):
        corner = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) + random.uniform(-0.6, 0.6, (4, 2)) + [2.0, 0.0]
        onward, back = np.roll(corner, -1, axis=0) - corner, np.roll(corner, 1, axis=0) - corner
        products = onward[:, 0] * back[:, 1] - onward[:, 1] * back[:, 0]
        nodes = np.column_stack([corner[:, 0], np.zeros(4), corner[:, 1]])
        assert folded(nodes, np.arange(4)[None])[0] == (products.min() <= 0.0)
        counts[products.argmin()] += products.min() < 0.0
    assert (counts > 2).all()


def test_nodal_masses_at_the_axis_are_a_sixth_and_a_third():
    """The integral of N r over a rectangle from r = 0 to h; away from the axis nearly a quarter."""
    mesh = rectangle((3, 1), (0.0, 3e-3), 1e-3)
    share = nodal_volumes(mesh.nodes, mesh.cells) / mesh.volumes[:, None]
    np.testing.assert_allclose(share[0], [1 / 6, 1 / 3, 1 / 3, 1 / 6], rtol=1e-12)
    np.testing.assert_allclose(share[2], np.array([7, 8, 8, 7]) / 30, rtol=1e-12)
    solver = ring_burst(mesh)
    volume = np.pi * 3e-3**2 * 1e-3
    assert solver.fields.mass.sum() == pytest.approx(ELASTIC.density * volume, rel=1e-12)
    at_axis = solver.fields.start[:, 0] == 0.0
    assert solver.fields.mass[at_axis].sum() == pytest.approx(ELASTIC.density * np.pi * 1e-3**3 / 3.0, rel=1e-12)


@pytest.mark.parametrize("inner", [0.0, 0.03])
@pytest.mark.parametrize("part", [Part.CASING, Part.CHARGE])
def test_forces_equal_ufls_on_the_ring(part, inner):
    """-2 pi int (s : grad v + s_tt v_r / r) r dA with constant stress in every cell, 2 x 2 Gauss, which is exact."""
    solver = ring_burst(random_meridian(4, 5e-3, inner, part))
    state, stress = solver.fields, stressed(solver, part)
    domain = state.mesh.domain
    space = compat.vector_space(domain)
    test, radius = ufl.TestFunction(space), ufl.SpatialCoordinate(domain)[0]
    slope = ufl.grad(test)
    work = stress[0] * slope[0, 0] + stress[2] * slope[2, 2] + stress[5] * (slope[0, 2] + slope[2, 0])
    form = -2.0 * np.pi * (radius * work + stress[1] * test[0]) * ufl.dx(metadata={"quadrature_degree": 3})
    exact = np.array(dolfinx.fem.assemble_vector(dolfinx.fem.form(form)).array).reshape(-1, 3)
    exact[state.start[:, 0] == 0.0, 0] = 0.0  # nodes on the axis do not move radially
    assert np.abs(solver.fields.nodes.force - exact).max() < 1e-12 * np.abs(exact).max()
    assert np.abs(exact).max() > 1e3


def test_patch_of_distorted_rings_takes_a_uniform_stretch_exactly():
    """R and z stretched: the same exact stress in every ring, no force on inner nodes, those of the axis included."""
    mesh = random_meridian(5, 5e-3)
    solver = ring_burst(mesh, CONTROLLED)
    stretch = np.array([1.03, 1.0, 0.98])
    carried(solver, lambda start: start * stretch, step=1e-7)
    e_r, e_z = 2.0 * 0.03 / 2.03, -2.0 * 0.02 / 1.98
    shear = 0.5 * ELASTIC.elastic_modulus / 1.3
    lame = 2.0 * shear * 0.3 / 0.4
    trace = 2.0 * e_r + e_z
    exact = np.diag([lame * trace + 2.0 * shear * e for e in (e_r, e_r, e_z)])
    stress = matrices(solver.fields.solid.stress[: solver.fields.mesh.cells, 0])
    assert np.abs(stress - exact).max() < 1e-12 * np.abs(exact).max()
    force = solver.fields.nodes.force
    assert np.abs(force[~boundary(mesh, solver)]).max() < 1e-12 * np.abs(force).max()
    assert np.abs(hourglass_forces(solver)).max() < 1e-12 * np.abs(force).max()


def test_linear_fields_excite_no_hourglass():
    """Any linear field of (r, z), shear and rotation included; a hourglass velocity does."""
    field = np.array([[0.03, 0.0, -0.02], [0.0, 0.0, 0.0], [0.04, 0.0, 0.01]])
    mesh = random_meridian(4, 5e-3, 0.03)
    solver = ring_burst(mesh, CONTROLLED)
    carried(solver, lambda start: start @ (np.eye(3) + field).T + [0.001, 0.0, 0.002], step=1e-7)
    force = np.abs(solver.fields.nodes.force).max()
    assert np.abs(hourglass_forces(solver)).max() < 1e-12 * force
    carried(
        solver, lambda start: start + 1e-5 * np.random.default_rng(1).normal(size=start.shape) * [1, 0, 1], step=1e-7
    )
    assert np.abs(hourglass_forces(solver)).max() > 1e-6 * force


def test_rotation_about_the_circumference_turns_the_stress():
    """By 90 degrees in 1,000 steps: R s R^T, and the stored hourglass forces turn with the cells.

    The steel is next to rigidity-free, since such a motion of a ring stretches its circumference.
    """
    soft = replace(ELASTIC, elastic_modulus=1e-6)
    solver = ring_burst(random_meridian(3, 5e-3, 0.1), CONTROLLED, casing=soft)
    state = solver.fields.solid
    random = np.random.default_rng(3)
    state.stress[:] = random.normal(size=state.stress.shape) * 1e9
    state.stress[..., 3:5] = 0.0
    rows = state.hourglass.reshape(-1, 3, LANES)
    rows[:, [0, 2]] = random.normal(size=rows[:, [0, 2]].shape) * 1e3
    before = matrices(state.stress[: solver.fields.mesh.cells, 0].copy())
    stored = hourglass_forces(solver).copy()
    centre, steps = np.array([0.11, 0.0, 0.0]), 1000
    for k in range(1, steps + 1):
        turn = rotation_matrix((0.0, 1.0, 0.0), 0.5 * np.pi * k / steps)
        carried(solver, lambda start, f=turn: (start - centre) @ f.T + centre, step=1e-3)
    after = matrices(state.stress[: solver.fields.mesh.cells, 0])
    exact = turn @ before @ turn.T
    assert np.abs(after - exact).max() < 1e-10 * np.abs(exact).max()
    np.testing.assert_allclose(hourglass_forces(solver), stored @ turn.T, atol=1e-10 * np.abs(stored).max())
    assert abs(solver.fields.nodes.force[:, 2].sum()) < 1e-12 * np.abs(solver.fields.nodes.force).sum()
