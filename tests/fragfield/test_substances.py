"""Substances in a case: refused where a model lacks data, their grades in `check`, each casing run once."""

from __future__ import annotations

import json

import pytest

from burst_fenicsx.materials.library import burst_explosive_names, explosive_names
from fragfield.case import load_case, to_toml
from fragfield.case.load import case_from_document
from fragfield.errors import InputError
from fragfield_base.substances import FOLDERS, substance
from tests.fragfield.short_run import invoke

NEW = ("al_6061_t6", "cast_iron_ductile", "cast_iron_grey", "steel_1020", "steel_1045", "steel_4340")


def case_of(tmp_path, explosive="tnt", casing="steel_paper", **tables):
    entry = {"name": "a", "profile": "tube", "explosive": explosive, "casing": casing}
    document = {"burst": {"cell_size": "10 mm"}, "round": [entry], **tables}
    return case_from_document(document, source="my.toml", folder=tmp_path)


def test_any_name_of_a_substance_gives_its_built_in_name(tmp_path):
    case = case_of(tmp_path, "Composition A-3", "AISI 1045")
    assert (case.round[0].explosive.name, case.round[0].casing.name) == ("comp_a3", "steel_1045")


@pytest.mark.parametrize("name", sorted(set(explosive_names()) - set(burst_explosive_names())))
def test_an_explosive_without_data_for_the_burst_is_refused_with_what_is_missing(name, tmp_path):
    for products, key in (("jwl", "jwl"), ("landau_cj", "heat_of_detonation")):
        with pytest.raises(InputError) as caught:
            case_of(tmp_path, name, burst={"cell_size": "10 mm", "products": products})
        message = str(caught.value)
        assert f'round[1].explosive.{key}: missing for "{name}"; burst.products = "{products}" needs' in message
        assert f'round[1].explosive.sound_speed: missing for "{name}"' in message
        assert "only TNT equivalents and Gurney's speed" in message


def test_a_model_that_lacks_data_names_those_that_remain(tmp_path):
    text = (FOLDERS["explosive"] / "comp_b.toml").read_text(encoding="utf-8")
    heat = text[text.index("[heat]") : text.index("[jwl]")]
    (tmp_path / "mine.toml").write_text(text.replace(heat, ""), encoding="utf-8")
    with pytest.raises(InputError, match=r'heat_of_detonation: missing .*; allowed: burst.products = "jwl"'):
        case_of(tmp_path, "mine.toml")
    case = case_of(tmp_path, "mine.toml", burst={"cell_size": "10 mm", "products": "jwl"})
    assert case.round[0].explosive.heat_of_detonation is None
    (tmp_path / "case.toml").write_text(to_toml(case), encoding="utf-8")
    assert load_case(tmp_path / "case.toml") == case


@pytest.mark.parametrize(
    ("casing", "law", "message"),
    [
        (
            "al_6061_t6",
            "mott",
            '"mott" needs critical_strain and fracture_energy, of which the casing "al_6061_t6" has',
        ),
        ("cast_iron_grey", "mott_1947", "needs critical_strain and fracture_stress and fracture_gamma"),
        ("steel_1020", "mott_1947", 'fracture_gamma given or break_up.mean_mass = "mott", or the mean mass itself'),
    ],
)
def test_a_law_without_data_of_the_casing_is_refused(casing, law, message, tmp_path):
    with pytest.raises(InputError) as caught:
        case_of(tmp_path, casing=casing, break_up={"mean_mass": law})
    assert message in str(caught.value)
    given = {"critical_strain": 0.2, "fracture_energy": "1e4 J/m^2", "fracture_stress": "4e8 Pa", "fracture_gamma": 60}
    case_of(tmp_path, casing=casing, break_up={"mean_mass": law, **given})
    case_of(tmp_path, casing=casing, break_up={"mean_mass": "10 g"})


def test_casings_that_differ_need_one_value(tmp_path):
    text = (FOLDERS["casing"] / "steel_1045.toml").read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(text.replace("critical_strain = 0.75", "critical_strain = 0.5"))
    assert case_of(tmp_path, casing="mine.toml").break_up.critical_strain == 0.5
    one = {"name": "a", "profile": "tube", "explosive": "tnt", "casing": "steel_1045"}
    two = {**one, "name": "b", "casing": "mine.toml", "position": ["1 m", "0 m", "0 m"]}
    with pytest.raises(InputError, match=r"critical_strain: missing, and the casings differ in it: 0.75 of steel_1045"):
        case_of(tmp_path, round=[one, two])
    assert case_of(tmp_path, round=[one, two], break_up={"critical_strain": 0.6}).break_up.critical_strain == 0.6


def test_what_earlier_casings_break_up_by_has_not_moved(tmp_path):
    for name in ("steel_paper", "steel_m107", "copper"):
        for law in ("mott", "mott_1947"):
            table = case_of(tmp_path, casing=name, break_up={"mean_mass": law}).break_up
            found = table.critical_strain, table.fracture_energy, table.fracture_stress, table.fracture_gamma
            assert found == (0.75, 14.7e4, 804e6, 67.0)


def test_check_shows_the_grades_and_warns_of_estimates_that_matter(tmp_path):
    text = '[burst]\ncell_size = "12 mm"\n'
    entry = '[[round]]\nname = "{}"\nprofile = "tube"\nexplosive = "C-4"\ncasing = "C45"\n'
    entry += 'position = ["{} m", "0 m", "0 m"]\n'
    text += entry.format("a", 0) + entry.format("b", 0.4)
    (tmp_path / "two.toml").write_text(text + 'ignition = []\ninitiation = { pressure = "5 GPa" }\n')
    done = invoke("check", tmp_path / "two.toml")
    assert done.exit_code == 0, done.stderr
    words = " ".join(done.stdout.split())
    assert (
        "explosive comp_c4: Composition C-4 (Charge memory, Heat recalculated, JWL memory, Unreacted estimate)" in words
    )
    assert "casing steel_1045: Steel AISI 1045 (Solid memory, Strength recalculated)" in words
    assert 'explosive "comp_c4": sound_speed and hugoniot_slope are estimates' in words
    assert "yield strength" not in words  # published mean masses are of this steel


@pytest.mark.dolfinx
@pytest.mark.parametrize("casing", NEW)
def test_every_new_casing_bursts_and_breaks_up(casing, tmp_path):
    pytest.importorskip("burst_fenicsx.compat")
    text = (
        '[burst]\ncell_size = "11 mm"\nend_time = "80 us"\n[[round]]\nname = "a"\nprofile = "tube"\nexplosive = "tnt"\n'
    )
    text += f'casing = "{casing}"\n[break_up]\nrealisations = 1\n'
    if substance("casing", casing).groups.get("break_up") is None:
        text += 'mean_mass = "5 g"\n'
    (tmp_path / "case.toml").write_text(text)
    out = tmp_path / "run"
    for done in (invoke("burst", tmp_path / "case.toml", "--out", out, "--quiet"), invoke("break-up", out, "--quiet")):
        assert done.exit_code == 0, done.stderr
    summary = json.loads((out / "summary.json").read_text())
    burst, pieces = summary["burst"], summary["break_up"]
    assert burst["lost_cells"] == 0
    assert burst["energy_error"] < 0.03
    assert pieces["mass"] == pytest.approx(burst["casing_mass"], rel=1e-9)
    assert pieces["fragments"] > 100
