"""Quadrilaterals with the weight one: areas and their derivatives, forces against UFL, patch test, momentum."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("dolfinx")

import dolfinx.fem
import ufl

from burst_fenicsx import compat
from burst_fenicsx.axisymmetric.rings import areas, nodal_areas
from burst_fenicsx.kernels.axisymmetric.quadrilateral import plane_integrals
from burst_fenicsx.kernels.axisymmetric.slide_line import add_line_forces
from burst_fenicsx.kernels.contact.slide_law import SlideLaw
from burst_fenicsx.meshing.split import split_charges
from burst_fenicsx.problem import Part
from tests.burst_fenicsx.axisymmetric.meridians import random_meridian, stressed
from tests.burst_fenicsx.axisymmetric.test_quadrilateral import boundary, corners, hourglass_forces
from tests.burst_fenicsx.boxes import CONTROLLED, ELASTIC, carried, matrices
from tests.burst_fenicsx.plane_section.sections import section_burst, section_of
from tests.burst_fenicsx.plane_section.test_plane_mesh import tube_section

pytestmark = pytest.mark.dolfinx

LEFT = (-0.05, 0.01)  # m: coordinates of both signs, which a radius could not have


def test_the_area_and_its_derivatives_are_exact():
    """dV/dx = bx, dV/dy = by, A = 0; V is linear in each coordinate, so that central differences are exact."""
    mesh = section_of(random_meridian(4, 5e-3), LEFT)
    every = np.arange(4 * len(mesh.cells)).reshape(-1, 4)
    for cell, (x, y) in enumerate(corners(mesh)):
        bx, by, across, volume, area = plane_integrals(x, y)
        assert across == (0.0, 0.0, 0.0, 0.0)
        assert volume == area == pytest.approx(mesh.volumes[cell], rel=1e-12)
        for k, exact in enumerate((bx, by)):
            for corner in range(4):
                ends = []
                for sign in (1.0, -1.0):
                    apart = mesh.nodes[mesh.cells].copy()
                    apart[:, corner, 2 * k] += sign * 1e-3
                    ends.append(areas(apart.reshape(-1, 3), every)[cell])
                assert exact[corner] == pytest.approx((ends[0] - ends[1]) / 2e-3, abs=1e-15)
        assert sum(bx) == sum(by) == 0.0  # forces of a cell add up to nothing


def test_nodal_masses_of_a_rectangle_are_quarters():
    mesh = section_of(random_meridian(1, 1e-3, share=0.0))
    share = nodal_areas(mesh.nodes, mesh.cells)
    assert share.sum() == pytest.approx(mesh.volumes.sum(), rel=1e-14)
    solver = section_burst(mesh)
    assert solver.fields.mass.sum() == pytest.approx(ELASTIC.density * mesh.volumes.sum(), rel=1e-12)


@pytest.mark.parametrize("part", [Part.CASING, Part.CHARGE])
def test_forces_equal_ufls_in_plane_strain(part):
    """-int s : grad v dA with constant stress in every cell, 2 x 2 Gauss, which is exact."""
    solver = section_burst(section_of(random_meridian(4, 5e-3, part=part), LEFT))
    state, stress = solver.fields, stressed(solver, part)
    space = compat.vector_space(state.mesh.domain)
    slope = ufl.grad(ufl.TestFunction(space))
    work = stress[0] * slope[0, 0] + stress[2] * slope[2, 2] + stress[5] * (slope[0, 2] + slope[2, 0])
    form = -work * ufl.dx(metadata={"quadrature_degree": 3})
    exact = np.array(dolfinx.fem.assemble_vector(dolfinx.fem.form(form)).array).reshape(-1, 3)
    assert np.abs(solver.resultant - exact).max() < 1e-12 * np.abs(exact).max()
    assert np.abs(solver.resultant.sum(axis=0)).max() < 1e-12 * np.abs(exact).sum()
    assert np.abs(exact).max() > 1e3


def test_patch_of_distorted_cells_takes_a_uniform_stretch_exactly():
    """The stress of plane strain in every cell, through the section as well; no force on inner nodes."""
    mesh = section_of(random_meridian(5, 5e-3), LEFT)
    solver = section_burst(mesh, CONTROLLED)
    carried(solver, lambda start: start * [1.03, 1.0, 0.98], step=1e-7)
    e_x, e_y = 2.0 * 0.03 / 2.03, -2.0 * 0.02 / 1.98
    shear = 0.5 * ELASTIC.elastic_modulus / 1.3
    lame = 2.0 * shear * 0.3 / 0.4
    exact = np.diag([lame * (e_x + e_y) + 2.0 * shear * e for e in (e_x, 0.0, e_y)])
    stress = matrices(solver.fields.solid.stress[: solver.fields.mesh.cells, 0])
    assert np.abs(stress - exact).max() < 1e-12 * np.abs(exact).max()
    inner = ~boundary(mesh, solver) & (solver.fields.start[:, 0] > LEFT[0] + 1e-4)
    assert inner.sum() == 16
    force = solver.resultant
    assert np.abs(force[inner]).max() < 1e-12 * np.abs(force).max()
    assert np.abs(hourglass_forces(solver)).max() < 1e-12 * np.abs(force).max()


def test_gas_loads_the_closed_line_of_a_bore_evenly():
    """Of an even pressure each node of the bore gets its edges' halves, wherever the charge has turned to."""
    mesh = split_charges(tube_section(5e-3))
    solver = section_burst(mesh)
    interface, fields = solver.contact.interface, solver.fields
    line, position = interface.line, fields.nodes.position
    assert (line.neighbour >= 0).all()  # no end
    centre = position[np.unique(line.edges)].mean(axis=0)
    charge = np.setdiff1d(line.nodes, line.edges)
    turn = np.radians(3.0)
    c, s = np.cos(turn), np.sin(turn)
    away = position[charge] - centre
    position[charge] = centre + away @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    fields.charge.burn_fraction[:] = 1.0
    fields.charge.pressure[:] = 2e9
    own, force = np.zeros_like(fields.nodes.force), np.zeros_like(fields.nodes.force)
    add_line_forces(
        SlideLaw(1e4, 1e-7, 0.0, 0.0, 0.0), 1.0, line, interface.contacts, fields.charge,
        fields.solid.eroded, fields.rings.slot, position, fields.mass, own, force,
    )  # fmt: skip
    exact = np.zeros_like(position)
    for a, b in line.edges:
        along = position[b] - position[a]
        for node in (a, b):
            exact[node] += 0.5 * 2e9 * np.array([-along[2], 0.0, along[0]])
    bore = np.unique(line.edges)
    assert np.abs(force[bore] - exact[bore]).max() < 0.02 * np.abs(exact).max()
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).sum()
