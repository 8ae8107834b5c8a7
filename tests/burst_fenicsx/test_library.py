"""Explosives and casings: the built-in data, a user's file, and the messages."""

from __future__ import annotations

import pytest

from burst_fenicsx.errors import InputError
from burst_fenicsx.materials.library import burst_explosive_names, casing_names, load_casing, load_explosive
from fragfield_base.substances import substance

CASING = """
[mine]
density = 7800
elastic_modulus = 2e11
poisson_ratio = 0.3
shear_strength = 3e8
tensile_strength = 6e8
"""


@pytest.mark.parametrize("name", burst_explosive_names())
def test_built_in_explosives_are_consistent(name):
    explosive = load_explosive(name)
    assert explosive.name == name
    assert explosive.source
    # Landau's isentrope closes only above D^2 / 16.
    assert explosive.heat_of_detonation > explosive.detonation_velocity**2 / 16
    # A Gurney energy is a part of the heat of detonation: well over half, well below all of it.
    assumed = 2 * [(1.4 * explosive.heat_of_detonation) ** 0.5]
    low, high = substance("explosive", name).value("gurney", "gurney") or assumed
    assert low**2 / 2 / explosive.heat_of_detonation > 0.55
    assert high**2 / 2 / explosive.heat_of_detonation < 0.85
    # JWL's E0 per volume lies above rho Q by less than a tenth.
    assert 0.9 < explosive.jwl.E0 / (explosive.density * explosive.heat_of_detonation) < 1.1


def test_tnt_is_the_one_of_the_paper():
    tnt = load_explosive("tnt")
    assert (tnt.density, tnt.detonation_velocity) == (1630.0, 6940.0)
    assert tnt.density * tnt.detonation_velocity**2 / 8 == pytest.approx(9.81e9, rel=1e-3)


@pytest.mark.parametrize("name", casing_names())
def test_built_in_casings_have_sources_and_sound_waves_of_metals(name):
    casing = load_casing(name)
    assert casing.source
    bar_speed = (casing.elastic_modulus / casing.density) ** 0.5
    assert 3500 < bar_speed < 5300


def test_paper_steel_and_copper():
    steel = load_casing("steel_paper")
    assert (steel.density, steel.shear_strength, steel.tensile_strength) == (7800.0, 800e6, 800e6)
    assert steel.shear_softening_strain == 0.5
    copper = load_casing("copper")
    assert copper.shear_softening_strain is None
    assert copper.tensile_softening_strain is None


def test_softening_has_a_length_unless_it_is_switched_off(tmp_path):
    assert load_casing("steel_m107").softening_length is None
    path = tmp_path / "mine.toml"
    for line, length in (("", None), ("softening_length = 0.004\n", 4e-3), ('softening_length = "none"\n', None)):
        path.write_text(CASING + line)
        assert load_casing(path).softening_length == length


def test_file_of_a_user(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(CASING)
    assert load_casing(path).shear_strength == 3e8
    path.write_text(CASING + CASING.replace("mine", "yours").replace("3e8", "4e8"))
    assert load_casing(f"{path}#yours").shear_strength == 4e8
    with pytest.raises(InputError, match=r"found 2 tables \(mine, yours\); name one as .*mine\.toml#name"):
        load_casing(path)
    with pytest.raises(InputError, match=r"no table \[your\]; did you mean 'yours'\?"):
        load_casing(f"{path}#your")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("density = 7800", "", r"\[mine\]: key 'density' is missing; a number above 0 \(kg/m3\) is expected"),
        ("density = 7800", "density = -1", r"density = -1; a number above 0 \(kg/m3\) is expected"),
        ("density = 7800", 'density = "7.8 g/cm^3"', r"density = '7.8 g/cm\^3'; a number above 0"),
        ("poisson_ratio = 0.3", "poisson_ratio = 0.5", r"poisson_ratio = 0.5; a number at least 0 and below 0.5"),
        ("shear_strength", "shear_stength", r"unknown key 'shear_stength'; did you mean 'shear_strength'\?"),
        ("density = 7800", "density = nan", r"density = nan; a number above 0"),
        ("7800", '7800\nshear_softening_strain = "no"', "= 'no'; a number above 0 or \"none\" is expected"),
    ],
)
def test_bad_casing_is_refused(tmp_path, old, new, message):
    path = tmp_path / "mine.toml"
    path.write_text(CASING.replace(old, new))
    with pytest.raises(InputError, match=message):
        load_casing(path)


def test_bad_explosives_are_refused(tmp_path):
    unknown = r"explosive 'compx' is unknown; did you mean 'comp_[abc]\w*'\? allowed: amatol, "
    with pytest.raises(InputError, match=unknown):
        load_explosive("compx")
    with pytest.raises(InputError, match=r"casing 'cooper' is unknown; did you mean 'copper'\?"):
        load_casing("cooper")
    path = tmp_path / "x.toml"
    text = "[x]\ndensity = 1.0\ndetonation_velocity = 1.0\nheat_of_detonation = 1.0\nsound_speed = 1.0\n"
    path.write_text(text + "jwl = { A = 1.0 }\n")
    with pytest.raises(InputError, match=r"\[x\] \[jwl\]: key 'B' is missing"):
        load_explosive(path)
    constants = "jwl = { A = 1e12, B = -1e9, R1 = 7.2, R2 = 1.9, omega = 0.3, E0 = 8e9 }\n"  # as published sets have
    path.write_text(text + constants)
    assert load_explosive(path).jwl.B == -1e9
    path.write_text(text + constants.replace("R2 = 1.9", "R2 = -1.9"))
    with pytest.raises(InputError, match=r"R2 = -1.9; a number above 0 is expected"):
        load_explosive(path)
    path.write_text(text + "gurney = [3.0, 2.0]\n")
    with pytest.raises(InputError, match=r"gurney = \[3.0, 2.0\]; two numbers above 0"):
        load_explosive(path)
