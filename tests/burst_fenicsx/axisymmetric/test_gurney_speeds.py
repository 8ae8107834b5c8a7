"""Every explosive with data for the burst accelerates the middle of a steel tube to Gurney's speed of its file."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.geometry import profile_from_table
from burst_fenicsx.materials.library import burst_explosive_names, load_casing, load_explosive
from burst_fenicsx.problem import BurstSettings, IgnitionPoint, Round
from burst_fenicsx.run_burst import simulate
from fragfield_base.substances import substance

pytestmark = pytest.mark.dolfinx

BORE, LENGTH, RATIO = 40.0, 480.0, 0.4  # radius and length (mm), charge over casing by mass
STEEL = load_casing("steel_1045")
SETTINGS = BurstSettings(cell_size=8e-3, products="jwl", geometry="axisymmetric")


def speed_of_the_middle(explosive, folder, casing=STEEL):
    """Mean speed (m/s) of the wall from 40 to 75 % of the length, of a tube initiated at one end."""
    outer = BORE * sqrt(1.0 + explosive.density / (casing.density * RATIO))
    table = {
        "unit": "mm",
        "outer": {"points": [[0, outer], [LENGTH, outer]]},
        "cavity": {"points": [[0, BORE], [LENGTH, BORE]]},
        "charge": {"front": 0},
        "source": "a tube six bores long",
    }
    profile = profile_from_table(table, where="tube")
    item = Round("tube", explosive, casing, profile, ignition=(IgnitionPoint(station=0.0),))
    result = simulate([item], SETTINGS, folder, series=False)
    assert result.summary["acceleration_complete"] is not None
    assert result.summary["lost_cells"] == 0
    along, at = result.rounds[0], 1e3 * result.rounds[0].station / LENGTH
    middle = (at > 0.4) & (at < 0.75) & (along.casing_mass > 0.0)
    return float(np.average(along.mean_speed[middle], weights=along.casing_mass[middle]))


@pytest.mark.parametrize("name", burst_explosive_names())
def test_wall_speed_is_gurneys_within_a_band(name, tmp_path):
    """Printed Gurney velocities from 4 % below the burst's to 14 %.

    They are of other densities, some of tests of 1943, and of products that have expanded sevenfold, where these speeds
    hold all that would still come: 1 to 2 %. Where the file has none, Eq. 24 stands for it.
    """
    explosive, printed = load_explosive(name), substance("explosive", name).value("gurney", "gurney")
    velocity = sum(printed) / 2.0 if printed else 520.0 + 0.28 * explosive.detonation_velocity
    ratio = speed_of_the_middle(explosive, tmp_path) / (velocity / sqrt(1.0 / RATIO + 0.5))
    assert 0.96 < ratio < 1.14, f"{name}: {ratio:.3f}"


@pytest.mark.parametrize(("name", "low", "high"), [("anfo", 500.0, 2000.0), ("comp_c4", 1800.0, 3500.0)])
def test_wall_speed_hardly_depends_on_the_sound_speed_that_is_an_estimate(name, low, high, tmp_path):
    explosive = load_explosive(name)
    assert substance("explosive", name).groups["unreacted"].grade == "estimate"
    speeds = []
    for sound in (low, explosive.sound_speed, high):
        (folder := tmp_path / f"{sound:g}").mkdir()
        speeds.append(speed_of_the_middle(replace(explosive, sound_speed=sound), folder))
    assert max(speeds) / min(speeds) - 1.0 < 3e-3
