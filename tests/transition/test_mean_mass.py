"""Laws of the mean fragment mass: units, similarity, closed forms, and where no published data are near."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.transition.synthetic import Tube
from transition import BreakUp, BreakUpSettings
from transition.law.mean_mass import (
    ASPECT_RATIO,
    FACTOR_SOURCE,
    FACTORS,
    equivalent_cylinder,
    explosive_constant,
    gurney_sarmousakis,
    mott_1947,
    mott_linfoot,
    outside_data,
)

STEEL, TNT = (7850.0, 448e6), ("tnt", 1630.0)
KG, M, S = 1e3, 1e3, 1e6  # grams, millimetres, microseconds in one kg, m, s

LAWS = {
    "mott": (lambda *a: mott_linfoot(4.0, *a), {"density": (7850.0, KG / M**3), "radius": (0.135, M),
             "energy": (14.7e4, KG / S**2), "wall": (0.0103, M), "speed": (1067.0, M / S)}),
    "mott_1947": (lambda rho, stress, *a: mott_1947(rho, stress, 67.0, *a), {"density": (7850.0, KG / M**3),
                  "stress": (804e6, KG / M / S**2), "wall": (0.0103, M), "rate": (7900.0, 1.0 / S)}),
    "gurney_sarmousakis": (gurney_sarmousakis, {"constant": (3.81, KG**0.5 * M ** (-7 / 6)), "wall": (0.018, M),
                           "inner diameter": (0.119, M)}),
}  # fmt: skip


@pytest.mark.parametrize("law", LAWS)
def test_laws_do_not_depend_on_the_units(law):
    """The same piece in kilogram, metre, second and in gram, millimetre, microsecond."""
    formula, arguments = LAWS[law]
    si = formula(*(value for value, _ in arguments.values()))
    other = formula(*(value * unit for value, unit in arguments.values()))
    assert other == pytest.approx(KG * si, rel=1e-12)


@pytest.mark.parametrize(("law", "power"), [("mott", 7 / 3), ("mott_1947", 3.0), ("gurney_sarmousakis", 7 / 3)])
def test_similar_casings_at_one_speed(law, power):
    """All lengths times k, speed and steel the same: the mean mass grows as this power of k."""
    formula, arguments = LAWS[law]
    scale = {"radius": 2.0, "wall": 2.0, "inner diameter": 2.0, "rate": 0.5}
    small = formula(*(value for value, _ in arguments.values()))
    large = formula(*(value * scale.get(name, 1.0) for name, (value, _) in arguments.items()))
    assert large / small == pytest.approx(2.0**power, rel=1e-12)


def test_law_of_1947_by_hand():
    """Mott's example, 50 ton/in2, 480 lb/ft3, 2000 ft/s at 2 in: x0 = 1.47/sqrt(gamma) in (he prints 1.6)."""
    stress, density, rate = 50.0 * 2240.0 * 6894.757, 480.0 * 16.018463, 2000.0 * 0.3048 / (2.0 * 0.0254)
    wall, gamma = 0.005, 100.0
    mass = mott_1947(density, stress, gamma, wall, rate)
    breadth = math.sqrt(mass / (density * wall * ASPECT_RATIO))
    assert breadth == pytest.approx(1.5 * 1.470 / math.sqrt(gamma) * 0.0254, rel=1e-3)
    assert mott_1947(density, stress, gamma, wall, 0.0) == math.inf


def test_constants_of_the_explosives_are_those_in_ounces_and_inches():
    in_si = math.sqrt(28.349523125e-3) * 0.0254 ** (-7.0 / 6.0)
    for name, constant in (("TNT", 0.312), ("Composition B", 0.222)):
        assert explosive_constant(name, None) == pytest.approx(constant * in_si, rel=2e-3), name


def test_equivalent_cylinder_has_diameter_and_charge_ratio():
    wall, inner = equivalent_cylinder(0.155, 0.2, 7850.0, 1600.0)
    assert inner + 2.0 * wall == pytest.approx(0.155, rel=1e-12)
    ratio = 1600.0 * inner**2 / (7850.0 * (0.155**2 - inner**2))
    assert ratio == pytest.approx(0.2, rel=1e-12)


def charge_ratio(wall_ratio):
    """Mass of TNT over that of steel in a cylinder of this wall over its inner diameter."""
    return TNT[1] / (STEEL[0] * ((1.0 + 2.0 * wall_ratio) ** 2 - 1.0))


@pytest.mark.parametrize(
    ("casing", "low", "high"),
    [
        (lambda v: (v, 0.2, STEEL, TNT), 0.0635, 0.240),
        (lambda v: (0.155, charge_ratio(v), STEEL, TNT), 0.05, 0.45),
        (lambda v: (0.155, 0.2, (v, None), TNT), 7700.0, 8000.0),
        (lambda v: (0.155, 0.2, (7850.0, v), TNT), 400e6, 800e6),
    ],
)
def test_the_data_end_where_they_are_said_to_end(casing, low, high):
    for value, outside in ((low, -1), (high, 1)):
        assert not list(outside_data(*casing(value * (1.0 - 0.001 * outside))))
        assert len(list(outside_data(*casing(value * (1.0 + 0.001 * outside))))) == 1


@pytest.mark.parametrize(
    ("casing", "texts"),
    [
        ((0.155, 0.2, STEEL, TNT), []),
        ((0.155, 0.2, (7850.0, None), TNT), []),
        ((0.155, 0.2, STEEL, ("Composition B", 1710.0)), []),
        ((0.155, 0.2, STEEL, ("comp_b", 1710.0)), []),
        ((0.060, 0.2, STEEL, TNT), ["outer diameter 60 mm (data: 63.5 to 240 mm)"]),
        ((0.155, 0.2, (8960.0, 300e6), TNT), ["casing of 8960 kg/m3 (data: steel)"]),
        ((0.155, 0.2, (7800.0, 1600e6), TNT), ["yield strength 1600 MPa (data: steels of about 400 to 800 MPa)"]),
        ((0.155, 0.2, STEEL, ("ANFO", 900.0)), ["explosive 'ANFO' (data: TNT, Composition B, "]),
        ((0.3, 0.2, (2700.0, None), ("ANFO", 900.0)), ["outer diameter 300 mm", "casing of 2700", "explosive 'ANFO'"]),
    ],
)
def test_where_no_data_are_near_is_said(casing, texts):
    found = list(outside_data(*casing))
    assert len(found) == len(texts)
    assert all(one.startswith(text) for one, text in zip(found, texts, strict=True)), found


def test_summary_states_law_factor_and_what_is_outside(tmp_path):
    snapshot = Tube(radial_cells=1, around=8, axial=10, explosive="ANFO").read(tmp_path / "s.h5")
    reported = BreakUp(snapshot, BreakUpSettings()).realisation(1).summary["mean_mass"]
    assert (reported["law"], reported["factor"], reported["factor_source"]) == ("mott", FACTORS["mott"], FACTOR_SOURCE)
    assert [one["round"] for one in reported["outside_data"]] == ["round 0"]
    assert reported["outside_data"][0]["text"].startswith("explosive 'ANFO'")
    reported = (
        BreakUp(snapshot, BreakUpSettings(mean_mass=0.01, mean_mass_factor=1.1)).realisation(1).summary["mean_mass"]
    )
    assert reported == {"law": "given", "factor": 1.1, "factor_source": "input", "outside_data": []}


@pytest.mark.parametrize(
    ("values", "factor", "source"),
    [
        ({"mean_mass": "mott_1947"}, FACTORS["mott_1947"], FACTOR_SOURCE),
        ({"mean_mass": "gurney_sarmousakis", "prefactor": 2.0}, FACTORS["gurney_sarmousakis"], FACTOR_SOURCE),
        ({"prefactor": "paper"}, None, "not compared with published data at this prefactor"),
        ({"prefactor": 3.0, "critical_strain": 0.5}, None,
         "not compared with published data at this prefactor and critical_strain"),
        ({"prefactor": 3.0, "mean_mass_factor": 1.2}, 1.2, "input"),
        ({"mean_mass": 0.01}, None, "the mean mass is given"),
    ],
)  # fmt: skip
def test_factor_is_stated_only_for_inputs_that_were_compared(values, factor, source):
    assert BreakUpSettings(**values).factor == (factor, source)


def test_factor_changes_no_fragment(tmp_path):
    snapshot = Tube(radial_cells=1, around=8, axial=10).read(tmp_path / "s.h5")
    one, other = (BreakUp(snapshot, BreakUpSettings(mean_mass_factor=f)).fragments(3) for f in (1.0, 2.0))
    np.testing.assert_array_equal(one.mass, other.mass)
    np.testing.assert_array_equal(one.velocity, other.velocity)
