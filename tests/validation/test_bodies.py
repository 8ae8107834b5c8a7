"""Checks of the products and of the solid: closed forms, what they refuse, and one real quick run."""

from __future__ import annotations

import json
from dataclasses import replace

import numba
import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from validation.__main__ import main
from validation.products import study as products
from validation.products.energies import energy_given, progressive_share
from validation.rows import Rows
from validation.solid import study as solid
from validation.solid.elastic_tube import QuarterTube, elastic_tube, static_tube
from validation.solid.impact import Impact, final_length
from validation.solid.softening import in_shear, in_tension

pytestmark = pytest.mark.dolfinx


@pytest.fixture(autouse=True)
def _one_thread():
    """Bodies of a few cells are slower on several."""
    threads = numba.get_num_threads()
    numba.set_num_threads(1)
    yield
    numba.set_num_threads(threads)


@pytest.mark.parametrize("explosive", products.EXPLOSIVES)
@pytest.mark.parametrize("model", products.MODELS)
def test_the_quadrature_sees_an_isentrope_that_does_not_close(explosive, model):
    law, charge = products.model_of(explosive, model)
    assert energy_given(law, charge, model) == pytest.approx(law.energy, rel=1e-8)
    if model == "jwl":
        off = replace(law, constants=replace(law.constants, A=1.01 * law.constants.A), cj_volume=law.cj_volume)
        # Whatever its constants, JWL gives back its own energy.
        assert energy_given(off, charge, model) == pytest.approx(law.energy, rel=1e-6)
    else:
        off = replace(law, knee_pressure=1.01 * law.knee_pressure)
        assert abs(energy_given(off, charge, model) / law.energy - 1.0) > 1e-3


def test_a_charge_initiated_progressively_is_held_against_its_own_theory():
    """`landau` 1 + 5/432 D^2/Q, the others 1."""
    _, charge = products.model_of("tnt", "landau")
    assert progressive_share(charge, "landau") == pytest.approx(1.1233, abs=1e-4)
    assert progressive_share(charge, "landau_cj") == progressive_share(charge, "jwl") == 1.0


def test_all_laws_close():
    rows = Rows("products")
    products.check_laws(rows)
    assert rows.sound
    assert len([row for row in rows if "energy given" in row.quantity]) == 6
    assert {"explosive:comp_b", "products:jwl"} <= {subject for row in rows for subject in row.subjects}


@pytest.fixture(scope="module")
def coarse_tube():
    """Four cells through the wall."""
    return elastic_tube(solid.REFERENCE["tube"], 4)


def test_the_elastic_tube_is_lames(coarse_tube):
    values, tube = solid.REFERENCE["tube"], coarse_tube
    assert tube.inner_moved == pytest.approx(solid.lame_moved(values, 1.0), rel=2e-3)
    assert tube.hoop == pytest.approx([solid.lame_hoop(values, float(r)) for r in tube.radius], rel=5e-3)
    # In equilibrium the hoop stress carries the pressure: the integral of it over the wall is p a.
    exact = np.linspace(1.0, 2.0, 2001)
    mean = np.mean([solid.lame_hoop(values, float(r)) for r in exact])
    assert mean == pytest.approx(values["pressure"], rel=1e-3)


def rows_of(check, *arguments):
    rows = Rows("solid")
    check(rows, *arguments)
    return rows


def test_the_static_solve_converges_to_lame_and_the_damped_run_meets_it(coarse_tube):
    values = solid.REFERENCE["tube"]
    rows = rows_of(solid.check_static, coarse_tube, static_tube(values, 2))
    assert [row.passed for row in rows[2:]] == [True, True], rows
    load = QuarterTube(values, 4, "full").load
    assert load.sum(axis=0)[:2] == pytest.approx(2 * [values["pressure"] * values["inner_radius"] * 0.25], rel=1e-12)


def test_the_rod_is_judged_by_what_is_conserved_and_compared_in_its_length():
    assert final_length(solid.REFERENCE["impact"]) == pytest.approx(19.93e-3, abs=1e-5)
    good = Impact(20e-3, momentum_error=1e-14, energy_error=0.002, moving=0.001)
    assert [row.passed for row in rows_of(solid.check_impact, "rod", good, 19.93e-3)] == [True, True, True, None]
    for change, passed in (
        ({"momentum_error": 1e-6}, [False, True, True, None]),
        ({"energy_error": -0.02}, [True, False, True]),  # nothing is read of a rod like these
        ({"moving": 0.02}, [True, True, False]),
    ):
        rows = rows_of(solid.check_impact, "rod", replace(good, **change), 19.93e-3)
        assert [row.passed for row in rows] == passed


@pytest.mark.parametrize("strained", [in_shear, in_tension])
def test_strength_falls_to_zero_with_an_error_of_first_order(strained):
    errors = [strained({**solid.REFERENCE["softening"], "steps": steps}).largest_error for steps in (100, 200, 400)]
    rate = -np.polyfit(np.log([100, 200, 400]), np.log(errors), 1)[0]
    assert rate == pytest.approx(1.0, abs=0.2), f"rate {rate:.2f}, errors {errors}"


@pytest.mark.slow
def test_products_and_solid_run_quickly(tmp_path, capsys):
    """The only miss is the energy of the rod with 12 cells across; see docs/limits.md."""
    code = main(["products", "solid", "--quick", "--json", "--threads", "1", "--out", str(tmp_path)])
    rows = json.loads(capsys.readouterr().out)
    assert [row["quantity"] for row in rows if row["passed"] is False] == ["impact, 12 cells across: energy error"]
    assert code == 1
