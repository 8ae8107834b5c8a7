"""Exposure of a waiting charge to shock: closed form of an impact, pulses, floor, verdicts, restart."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.materials.library import load_explosive
from burst_fenicsx.problem import Part, Round, ShockInitiation
from burst_fenicsx.records.exposure import COLUMNS, Exposure, ShockExposures, verdict
from tests.burst_fenicsx import test_initiation as bar
from tests.burst_fenicsx.boxes import TNT

pytestmark = pytest.mark.dolfinx
FLOOR = 0.5e9


def waiting(floor=FLOOR):
    return Round("bar", TNT, bar.ELASTIC, initiation=ShockInitiation(np.inf, floor=floor))


def exposed(finer=1, floor=FLOOR, share=1.8):
    """A flyer strikes a buffer on a charge: closed form, and the exposure after a share of its pulse has entered."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bar, "CELL", bar.CELL / finer)
        for name in ("FLYER", "BUFFER", "CHARGE"):
            patch.setattr(bar, name, getattr(bar, name) * finer)
        expected = bar.impact()
        solver = bar.struck(1e30, settings=replace(bar.SETTINGS, cell_size=bar.CELL))
    exposures = ShockExposures([waiting(floor)], solver.fields)
    end = expected.arrival + share * expected.length
    while solver.time < end * (1.0 - 1e-12):
        solver.step(end)
        exposures.update(solver.time, solver.time_step)
    return expected, exposures


def test_the_energy_of_an_impact_converges_to_p_u_tau():
    """Energy and p^2 tau against the closed form: ramps of some cells lower them, in proportion to the cell size."""
    errors = []
    for finer in (1, 2):
        expected, exposures = exposed(finer)
        (found,) = exposures.found()
        # The closed form is the axial stress; of it the unreacted charge bears 4/3 of its shear strength as deviator.
        pressure = expected.pressure - 4.0 / 3.0 * TNT.shear_strength
        speed = TNT.shock_speed(pressure)
        square = pressure**2 * expected.length
        energy = square / (TNT.density * speed)
        errors.append((1.0 - found.energy / energy, 1.0 - found.pulse_pressure**2 * found.held_time / square))
        assert found.peak_pressure == pytest.approx(expected.pressure, rel=0.05)
        # A front over four cells must pass in a third of the pulse.
        assert 4.0 * found.resolved_cell / speed == pytest.approx(found.held_time / 3.0, rel=0.03)
    coarse, fine = np.array(errors)
    assert (fine > 0.0).all()
    assert (fine < 0.65 * coarse).all(), errors  # of first order: a half
    assert (fine < 0.04).all(), errors


def test_a_floor_above_the_pressure_leaves_nothing_but_the_peak():
    expected, exposures = exposed(floor=2.0 * bar.impact().pressure, share=0.5)
    (found,) = exposures.found()
    assert found.energy == found.held_time == found.resolved_cell == 0.0
    assert found.peak_pressure > 0.9 * expected.pressure


def pulses(pressures, step=1e-7, floor=1e9, ignition=np.inf):
    """Values of one cell after steps at these pressures (Pa)."""
    item = replace(waiting(floor), explosive=replace(TNT, density=1e3, sound_speed=4e3, hugoniot_slope=0.0))
    charge = SimpleNamespace(pressure=np.zeros(1), ignition_time=np.array([ignition]))
    mesh = SimpleNamespace(round=np.zeros(1, dtype=int), part=np.array([Part.CHARGE]))
    exposures = ShockExposures([item], SimpleNamespace(mesh=mesh, charge=charge))
    for k, pressure in enumerate(pressures, start=1):
        charge.pressure[:] = pressure
        exposures.update(k * step, step)
    return dict(zip(COLUMNS, exposures.values[0], strict=True))


def test_pulses_are_not_added_and_the_strongest_counts():
    """Three and then two steps at 2 GPa with a gap: the energy is that of three; a weaker, longer pulse may win."""
    one = 4e18 * 1e-7 / 4e6  # J/m2 a step
    found = pulses([2e9, 2e9, 2e9, 0.0, 2e9, 2e9])
    assert found["energy"] == pytest.approx(3.0 * one)
    assert found["time"] == pytest.approx(3e-7)
    assert found["pulse_energy"] == pytest.approx(2.0 * one)
    longer = pulses([2e9, 0.0, *[1.5e9] * 4])
    assert longer["energy"] == pytest.approx(4.0 * one * 1.5**2 / 2.0**2)
    assert longer["impulse"] == pytest.approx(4.0 * 1.5e9 * 1e-7)
    assert longer["peak"] == 2e9


def test_what_a_front_has_reached_does_not_count():
    assert pulses([2e9] * 5, ignition=2.5e-7)["energy"] == pytest.approx(2.0 * 4e18 * 1e-7 / 4e6)


@pytest.mark.parametrize(("energy", "expected"), [(1.0e6, "below"), (1.6e6, "within"), (2.0e6, "above")])
def test_verdicts_against_the_published_range(energy, expected):
    exposure = Exposure(4e9, energy, 3e9, 2e-6, (0.0, 0.0, 0.0), 1e-5, 1e9, 2e-3)
    critical = load_explosive("comp_b").critical_energy
    found = verdict(exposure, critical, 1e-3)
    assert found["verdict"] == expected
    assert found["ratio"] == pytest.approx([energy / 1.38e6, energy / 1.84e6])
    assert found["resolved"]
    assert not verdict(exposure, critical, 3e-3)["resolved"]
    assert verdict(exposure, None, 1e-3)["verdict"] == "no critical energy"


def test_built_in_explosives_have_published_energies_with_their_source():
    """34 and 100 cal/cm2 for pressed and cast TNT, 33 and 44 for Composition B-3 and B."""
    cal = 4.184e4  # J/m2
    for name, low, high in (("tnt", 34, 100), ("comp_b", 33, 44)):
        found = load_explosive(name)
        assert found.critical_energy == pytest.approx((low * cal, high * cal), rel=0.01)
        assert "not checked" in found.critical_energy_source
