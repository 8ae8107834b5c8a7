"""Nothing burns ahead of the front: noise in a finely meshed charge, in both geometries; landau's own front."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.problem import IgnitionPoint, Part
from tests.burst_fenicsx.axisymmetric.meridians import hold, rectangle, ring_burst, whole_steps
from tests.burst_fenicsx.bodies import QUIET
from tests.burst_fenicsx.boxes import TNT, box, burst, run_until

pytestmark = pytest.mark.dolfinx

SPEED = TNT.detonation_velocity
INITIATION = (IgnitionPoint(station=0.0),)


def noisy(solver):
    """Give every node a velocity at random, which compresses unreacted cells by some parts in a thousand."""
    velocity = solver.fields.nodes.velocity
    axes = [0, 2] if velocity.shape[1] == 3 and np.ptp(solver.fields.start[:, 1]) == 0.0 else [0, 1, 2]
    velocity[:, axes] = np.random.default_rng(5).normal(0.0, 20.0, (len(velocity), len(axes)))
    velocity[solver.fields.start[:, 0] == 0.0, 0] = 0.0
    return solver


def ahead(solver):
    """Burnt fractions of the cells that no front is near."""
    charge, cells = solver.fields.charge, solver.fields.mesh.cells
    return charge.burn_fraction[:cells][solver.time < np.minimum(charge.ignition_time, charge.compression_from)[:cells]]


def test_noise_burns_nothing_ahead_of_the_front_in_the_meridian():
    """A charge in cells of 1 mm with noise, its front half-way: exactly zero ahead. Allowed earlier, it burns."""
    settings = replace(QUIET, cell_size=1e-3)
    mesh = rectangle((6, 60), (0.0, 6e-3), 0.06, Part.CHARGE)
    solver = noisy(ring_burst(mesh, settings, ignition=INITIATION))
    run_until(solver, 0.03 / SPEED)
    far = ahead(solver)
    assert len(far) > 100
    assert far.max() == 0.0
    assert (solver.fields.charge.burn_fraction == 1.0).sum() > 100
    careless = noisy(ring_burst(mesh, settings, ignition=INITIATION))
    near = careless.fields.charge.compression_from.copy()
    careless.fields.charge.compression_from[:] = 0.0
    run_until(careless, 0.03 / SPEED)
    careless.fields.charge.compression_from[:] = near
    assert (ahead(careless) > 1e-3).mean() > 0.3


def test_noise_burns_nothing_ahead_of_the_front_in_hexahedra():
    solver = noisy(
        burst(box((3, 3, 30), (9e-3, 9e-3, 0.09), Part.CHARGE), replace(QUIET, cell_size=3e-3), ignition=INITIATION)
    )
    run_until(solver, 0.04 / SPEED)
    far = ahead(solver)
    assert len(far) > 80
    assert far.max() == 0.0
    assert (solver.fields.charge.burn_fraction == 1.0).sum() > 50


@pytest.mark.parametrize(("products", "fastest"), [("landau", np.sqrt(32.0 / 27.0)), ("landau_cj", 1.0)])
def test_the_front_runs_ahead_by_no_more_than_the_products_own_speed(products, fastest):
    """Landau's own front is faster than D by sqrt(32/27), that of landau_cj is D; three cells more are allowed.

    A charge in a rigid tube; the front is where a cell is half burnt. It falls behind the timed one nowhere.
    """
    cell, length = 2e-3, 0.24
    settings = whole_steps(QUIET, cell_size=cell, products=products)
    solver = ring_burst(rectangle((3, 120), (0.0, 3 * cell), length, Part.CHARGE), settings, ignition=INITIATION)
    start = solver.fields.start
    hold(solver, np.stack([start[:, 0] > 2.9 * cell, start[:, 2] > length - 1e-9], axis=1))
    depth = length - start[solver.fields.mesh.dofmap, 2].mean(axis=1)
    for share in (0.3, 0.5, 0.75):
        run_until(solver, share * length / SPEED)
        half = solver.fields.charge.burn_fraction[: solver.fields.mesh.cells] > 0.5
        front = depth[half].max()
        assert front < fastest * SPEED * solver.time + 3.0 * cell, (share, front)
        assert front > SPEED * solver.time - 3.0 * cell, (share, front)
    if products == "landau":
        assert solver.fields.products[0].front_speed == pytest.approx(fastest * SPEED, rel=1e-12)
