"""One cell's plastic work, softening in tension and hourglass damping, by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from burst_fenicsx.problem import Hourglass, Part, Viscosity
from tests.burst_fenicsx.boxes import BARE, ELASTIC, STEEL, TNT, box, burst, distorted_box
from tests.burst_fenicsx.test_cells_by_hand import EDGE, SHEAR, cube
from tests.burst_fenicsx.test_elements import QUADRATURES, moved
from tests.burst_fenicsx.test_parts_by_hand import hourglass_vectors

pytestmark = pytest.mark.dolfinx


@pytest.mark.parametrize("quadrature", QUADRATURES)
def test_tension_softens_by_the_edge_of_a_cube_of_equal_volume(quadrature):
    """Half of the strength is left at half of the limit strain, which is twice as large in cells of half the length."""
    limit, length = 0.4, 8e-3
    weak = replace(STEEL, shear_softening_strain=None, tensile_softening_strain=limit, softening_length=length)
    for size in ((4e-3, 4e-3, 4e-3), (2e-3, 4e-3, 8e-3), (8e-3, 8e-3, 8e-3)):
        scale = np.cbrt(np.prod(size)) / length
        for share in (0.25, 0.5, 0.999):
            solver = burst(box((1, 1, 1), size), replace(BARE, quadrature=quadrature), casing=weak)
            solid = solver.fields.solid
            solid.volume_strain[:] = share * limit / scale
            moved(solver, lambda start: start * 1.02, 1e-8)
            left = (1.0 - share) * weak.tensile_strength
            np.testing.assert_allclose(solid.stress[..., :3], left, rtol=1e-9)


@pytest.mark.parametrize("quadrature", QUADRATURES)
def test_plastic_work_in_shear_is_the_strength_times_the_plastic_strain(quadrature):
    """Without softening: tau (gamma - tau / G) a volume, however many steps it takes."""
    weak = replace(ELASTIC, shear_strength=400e6)
    solver = burst(box((1, 1, 1), (EDGE,) * 3), replace(BARE, quadrature=quadrature), casing=weak)
    for strain in np.linspace(0.002, 0.02, 10):
        moved(solver, lambda start, s=strain: start + s * start[:, [2, 0, 1]] * [1.0, 0.0, 0.0], 1e-8)
    expected = weak.shear_strength * (0.02 - weak.shear_strength / SHEAR) * EDGE**3
    assert solver.ledger.sums[0] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("part", [Part.CASING, Part.CHARGE])
@pytest.mark.parametrize("last", [1.0, 0.1, 0.0])
@pytest.mark.parametrize("mode", range(4))
def test_hourglass_damping_takes_away_a_rate_at_most_as_a_whole(part, last, mode):
    """However large its coefficient: the rate of each mode of a distorted cell is not turned round in the next step.

    The step before it was as long, shorter, or none, where forces are found again without a step.
    """
    step = 1e-12
    hourglass = Hourglass(charge_viscous=1e9, casing_viscous=1e9, casing_stiffness=0.0)
    mesh = distorted_box(1, EDGE, part, share=0.0)
    solver = burst(mesh, replace(BARE, hourglass=hourglass, burn="time"), explosive=replace(TNT, shear_strength=0.0))
    state, own = solver.fields, solver.fields.mesh.dofmap[0]
    state.grid = state.grid._replace(longest=step)
    vectors, _, _ = hourglass_vectors(state.start[own])
    state.nodes.velocity[own] = np.outer(vectors[mode], [3.0, -2.0, 1.0])
    before = vectors @ state.nodes.velocity[own]
    solver.add_forces(last * step)
    after = before + vectors @ (state.nodes.force[own] / state.mass[own][:, None]) * step
    left = (after * before).sum(axis=1) / (before * before).sum(axis=1)
    assert left[mode] > -1e-9
    assert left[mode] < 0.9


@pytest.mark.parametrize("part", [Part.CASING, Part.CHARGE])
def test_the_work_of_hourglass_damping_is_accumulated_as_such(part):
    """A cube bent in one mode at constant speed, which strains nothing: force times way, and nothing else."""
    hourglass = Hourglass(charge_viscous=0.1, casing_viscous=0.1, casing_stiffness=0.0)
    settings = replace(BARE, hourglass=hourglass, burn="time", viscosity=Viscosity(linear=0.1, quadratic=1.5))
    solver = cube(part, settings, explosive=replace(TNT, shear_strength=0.0))
    state, step, way = solver.fields, 1e-9, 1e-9
    vectors, _, _ = hourglass_vectors(state.start[state.mesh.dofmap[0]])
    bent = np.zeros((8, 3))
    bent[state.mesh.dofmap[0]] = np.outer(vectors[1], [way, 0.0, 0.0])
    moved(solver, lambda start: start + bent, step)
    work = -float((state.nodes.force * bent).sum())
    assert work > 0.0
    assert solver.ledger.sums[2] == pytest.approx(work, rel=1e-3)
    assert np.abs(solver.ledger.sums[:2]).max() < 1e-3 * work
