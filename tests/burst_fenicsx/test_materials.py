"""Numbers of the materials: the fuze's, every part's own, and how finely forces are rounded for them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.materials.products import make_products
from burst_fenicsx.mechanics.fields import make_fields
from burst_fenicsx.mechanics.material_tables import FUZE, density_of_fuze, largest_pressure, material_tables
from burst_fenicsx.meshing.distributed import distribute
from burst_fenicsx.problem import Hourglass, Part, Round, Viscosity
from tests.burst_fenicsx.boxes import BARE, COMP_B, STEEL, TNT, box, no_leakage, plain_inputs

pytestmark = pytest.mark.dolfinx

SOFT = replace(STEEL, elastic_modulus=1e9)


def test_what_stands_in_for_the_fuze_is_an_aluminium_alloy():
    """As 6061-T6 (E 68.9 GPa, nu 0.33, tensile strength 310 MPa), which shears at half its tension by Tresca's law.

    With steel parts it is somewhat denser than the alloy's 2700 kg/m3.
    """
    assert FUZE.elastic_modulus == pytest.approx(68.9e9, rel=0.05)
    assert FUZE.poisson_ratio == pytest.approx(0.33, abs=0.01)
    assert FUZE.tensile_strength == pytest.approx(310e6, rel=0.05)
    assert FUZE.shear_strength == pytest.approx(0.5 * FUZE.tensile_strength, rel=1e-12)
    assert 2700.0 < FUZE.density < 3200.0
    profile = SimpleNamespace(fuze_density=2500.0)
    assert density_of_fuze(SimpleNamespace(profile=profile)) == 2500.0
    profile.fuze_density = 0.0
    one = Round("one", TNT, STEEL)
    assert density_of_fuze(SimpleNamespace(profile=profile)) == density_of_fuze(one) == FUZE.density


def test_every_part_gets_the_numbers_of_its_material():
    soft = replace(STEEL, shear_softening_strain=0.4, tensile_softening_strain=None)
    rounds = [Round("one", TNT, STEEL), Round("two", COMP_B, soft)]
    hourglass = Hourglass(charge_viscous=0.2, casing_viscous=0.3, casing_stiffness=0.4)
    settings = replace(BARE, viscosity=Viscosity(0.1, 1.5), burn="time", hourglass=hourglass)
    products = [make_products(item.explosive, "jwl") for item in rounds]
    solid, charge, density = material_tables(rounds, settings, products, [3100.0, 3200.0])
    assert (Part.CASING, Part.CHARGE, Part.FUZE) == (0, 1, 2)
    assert density.tolist() == [7850.0, TNT.density, 3100.0, 7850.0, COMP_B.density, 3200.0]
    assert solid[3].tolist() == [210e9, 0.3, 7850.0, 0.1, 1.5, 0.3, 0.4, 0.0, 8e8, 8e8, 2.5, 0.0]
    fuze = [FUZE.elastic_modulus, FUZE.poisson_ratio, 3100.0, FUZE.shear_strength, FUZE.tensile_strength]
    assert solid[2, [0, 1, 2, 8, 9]].tolist() == fuze
    assert (solid[[1, 4]] == 0.0).all()
    assert (charge[[0, 2, 3, 5]] == 0.0).all()
    for row, explosive in ((1, TNT), (4, COMP_B)):
        assert charge[row, [0, 3, 7]].tolist() == [
            explosive.density, explosive.shear_strength, explosive.detonation_velocity
        ]  # fmt: skip
        assert charge[row, [4, 5, 6]].tolist() == [0.1, 1.5, 0.2]
        assert charge[row, 8] == 0.0  # nothing burns by compression
    by_compression = material_tables(rounds, BARE, products, [3000.0] * 2)[1][[1, 4], 8]
    # Burnt as a whole at the compression of Chapman and Jouguet, at which JWL's isentrope meets its Rayleigh line.
    assert by_compression == pytest.approx([1.0 / (1.0 - item.cj_volume) for item in products], rel=1e-12)


def test_the_largest_pressure_is_that_of_the_front_or_of_plates_that_meet():
    """4 p_CJ with gamma 3, whose density is 4/3 of the explosive's; rho c^2 / 4 of the casing's longitudinal wave."""
    stiff = replace(STEEL, elastic_modulus=600e9)
    bulk, shear = 600e9 / (3.0 * 0.4), 600e9 / (2.0 * 1.3)
    sound = np.sqrt((bulk + 4.0 / 3.0 * shear) / stiff.density)
    for explosive in (TNT, COMP_B):
        front = 4.0 * float(make_products(explosive, "landau_cj").pressure(0.75))
        assert largest_pressure(Round("one", explosive, SOFT)) == pytest.approx(front, rel=1e-12)
        plates = 0.25 * stiff.density * sound**2
        assert plates > front
        assert largest_pressure(Round("one", explosive, stiff)) == pytest.approx(plates, rel=1e-12)


def test_forces_are_rounded_for_the_strongest_of_all_rounds():
    """The order of the rounds and a weaker one beside the strongest change nothing."""
    mesh = box((1, 1, 2), (0.01, 0.01, 0.02), Part.CHARGE)
    mesh = replace(mesh, round=np.array([0, 1], dtype=np.int32), lengths=(0.02, 0.02))
    weak = replace(TNT, detonation_velocity=0.3 * TNT.detonation_velocity, heat_of_detonation=4.5e6)
    found = []
    for explosives in ((COMP_B, weak), (weak, COMP_B), (COMP_B, COMP_B), (weak, weak)):
        distributed = distribute(MPI.COMM_SELF, mesh)
        rounds = [Round(name, explosive, SOFT) for name, explosive in zip("ab", explosives, strict=True)]
        inputs = plain_inputs(distributed, mesh, no_leakage(BARE, MPI.COMM_SELF))
        fields = make_fields(distributed, rounds, BARE, **inputs)
        found.append((fields.nodes.rounding, fields.grid.rounding))
    assert found[0] == found[1] == found[2]
    assert (np.array(found[3]) < found[0]).all()
