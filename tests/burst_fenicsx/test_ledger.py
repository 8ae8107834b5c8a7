"""Entries of the ledger by hand: every sum in its place, the errors, and what stops the run."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.errors import NumericalStop
from burst_fenicsx.kernels.constants import MIN_CONTACT_WORK, MIN_WORK
from tests.burst_fenicsx.boxes import ELASTIC, box, burst

pytestmark = pytest.mark.dolfinx

EDGE = 4e-3


@pytest.mark.parametrize("min_work", [1.0, 1e4])
def test_an_entry_of_the_ledger_has_every_sum_in_its_place(min_work):
    """Stored: kinetic, plastic, viscous, hourglass, contact, damping; supplied: products, external work, contact."""
    solver = burst(box((1, 1, 1), (EDGE,) * 3), min_work=min_work)
    solver.fields.nodes.velocity[:] = [3.0, 0.0, 4.0]
    ledger, mass = solver.ledger, ELASTIC.density * EDGE**3
    ledger.sums[:] = [1.0, 2.0, 4.0, 800.0, 16.0]
    ledger.external_work, ledger.damping, ledger.energy_tolerance = 32.0, 64.0, np.inf
    contact = SimpleNamespace(energy=128.0, gain=256.0, impulse=np.zeros(3))
    now = solver.fields, 5e-6, 0.0, 0.155, contact
    entry = ledger.record(*now)
    kinetic = 0.5 * mass * 25.0
    assert (entry.kinetic, entry.kinetic_casing) == pytest.approx((kinetic, kinetic), rel=1e-12)
    found = (entry.plastic, entry.viscous, entry.hourglass, entry.products_work, entry.products_viscous)
    assert found == (1.0, 2.0, 4.0, 800.0, 16.0)
    assert (entry.external_work, entry.damping, entry.contact, entry.strain) == (32.0, 64.0, 128.0, 0.0)
    assert (entry.contact_gain, entry.products_energy_left) == (256.0, 0.0)
    assert (entry.time, entry.time_step, entry.outer_diameter) == (5e-6, 0.0, 0.155)
    assert entry.mean_casing_speed == pytest.approx(5.0)
    opened = 832.0 + 256.0 - (kinetic + 1.0 + 2.0 + 4.0 + 128.0 + 64.0)
    assert entry.energy_error == pytest.approx(opened / max(832.0, min_work), rel=1e-12)
    assert entry.contact_error == pytest.approx(256.0 / max(832.0, 10.0 * min_work), rel=1e-12)
    assert ledger.columns()["plastic"].tolist() == [1.0]
    ledger.energy_tolerance = 0.9999 * entry.energy_error
    message = r"the energy ledger is open by (\S+) % of the work done \(allowed (\S+) %\).* 832 J"
    with pytest.raises(NumericalStop, match=message) as stop:
        ledger.record(*now)
    found, allowed = map(float, re.search(message, str(stop.value)).groups())
    assert allowed < found == pytest.approx(100.0 * entry.energy_error, rel=1e-5)
    ledger.energy_tolerance = 1.1 * entry.energy_error
    ledger.record(*now)
    # An error stops a run once it is above the tolerance of a twentieth of the charge's energy too.
    ledger.energy_tolerance = 0.5 * min(entry.energy_error, entry.contact_error)
    for wrong in sorted((opened, 256.0)):
        ledger.chemical_energies = np.array([20.0 * 0.999 * wrong / ledger.energy_tolerance])
        with pytest.raises(NumericalStop):
            ledger.record(*now)
    ledger.chemical_energies = np.array([20.0 * 1.001 * max(opened, 256.0) / ledger.energy_tolerance, 0.0])
    assert ledger.record(*now).energy_error == entry.energy_error
    for place in range(4):  # the products' own viscous heat is part of their work
        before, ledger.sums[place] = ledger.sums[place], np.nan
        with pytest.raises(NumericalStop):
            ledger.record(*now)
        ledger.sums[place] = before
    assert (MIN_WORK, MIN_CONTACT_WORK) == (1e-3, 10.0)  # as docs/theory/steps.md has it
