"""Rules beside ours, against the worked examples and printed values of their sources."""

from __future__ import annotations

import json
import math
from itertools import pairwise

import pytest

from fragfield.hazard.rules import (
    FOOT,
    POUND,
    Contents,
    contents_of,
    hazardous_fragment_distance,
    incident_pressure,
    pressure_distance,
    rules_for,
    tnt_equivalent,
)
from tests.fragfield.short_run import ROOT


def distance(contents: Contents, name: str) -> float | None:
    return next(rule.distance for rule in rules_for(contents) if rule.name.startswith(name))


def of(mass: float, all_up: float | None = None) -> Contents:
    whole = mass if all_up is None else all_up
    return Contents(mass, mass, whole, whole, 1)


@pytest.mark.parametrize(("mass", "kilopascals"), [(1000.0, 43.0), (10_000.0, 202.0), (100_000.0, 1150.0)])
def test_blast_agrees_with_the_worked_examples_of_iatg_01_80(mass, kilopascals):
    # IATG 01.80 (2021), Table 5: incident pressure at 50 m, printed to two or three digits
    assert incident_pressure(50.0 / mass ** (1.0 / 3.0)) == pytest.approx(1e3 * kilopascals, rel=0.012)


def test_blast_agrees_with_the_published_program():
    # kingery-bulmash (PyPI), README: 10,000 kg at 500 m
    assert incident_pressure(500.0 / 10_000.0 ** (1.0 / 3.0)) == pytest.approx(5.0549639655028455e3, rel=1e-9)


def test_pressure_falls_with_distance_and_inverts():
    scaled = [0.2 * 1.01**n for n in range(690)]
    pressures = [incident_pressure(z) for z in scaled]
    assert all(b < a * 1.003 for a, b in pairwise(pressures))  # joints of the ranges: 0.3 %
    assert pressure_distance(1000.0, 43e3) == pytest.approx(50.0, rel=0.01)
    assert pressure_distance(1.0, 1e9) is None
    assert math.isnan(incident_pressure(0.1))


def test_k40_is_the_pressure_its_source_gives():
    # Swisdak: 40 W^(1/3) corresponds to 1.18 psi
    reach = distance(of(100.0), "Inhabited building")
    assert reach == pytest.approx(40.0 * (100.0 / POUND) ** (1.0 / 3.0) * FOOT)
    assert incident_pressure(reach / 100.0 ** (1.0 / 3.0)) == pytest.approx(1.18 * 6894.76, rel=0.02)


def test_danger_areas_agree_with_the_calculator_of_un_saferguard():
    # printed for 1,200 kg and 20,000 t, rounded up by a metre: 2,068, 1,448 and 1,382 m; 10,446 and 7,316 m
    found = of(1200.0)
    assert distance(found, "Explosion danger area, public access possible") == pytest.approx(2068.0, abs=1.6)
    assert distance(found, "Explosion danger area, public access denied") == pytest.approx(1448.0, abs=1.6)
    assert distance(found, "Danger area of bare explosive") == pytest.approx(1382.0, abs=1.6)
    assert distance(of(2e7), "Explosion danger area, public access possible") == pytest.approx(10_446.0, abs=1.6)


@pytest.mark.parametrize(("pounds", "feet"), [(0.5, 236.0), (0.1, 236.0), (100.0, 657.5), (450.0, 1242.6)])
def test_fragment_distance_meets_the_printed_ends(pounds, feet):
    # 236 ft at 0.5 lb and below; both forms meet at 100 lb within 2 ft; 1250 ft from 450 lb on
    assert hazardous_fragment_distance(pounds * POUND) == pytest.approx(feet * FOOT, abs=0.15)


def test_fragment_distance_is_continuous_and_bounded():
    assert hazardous_fragment_distance(99.99 * POUND) == pytest.approx(
        hazardous_fragment_distance(100.0 * POUND), abs=0.6
    )
    assert hazardous_fragment_distance(451.0 * POUND) is None
    assert distance(of(300.0), "Hazardous fragment distance by net") is None


def test_waste_distances_are_those_of_40_cfr_265_382():
    name = "Open detonation"
    assert [distance(of(lb * POUND), name) for lb in (50, 100, 101, 5000, 30_000, 30_001)] == [
        204.0, 204.0, 380.0, 530.0, 690.0, None,
    ]  # fmt: skip


def test_contents_count_images_and_equivalents():
    from fragfield.case import load_case

    case = load_case(ROOT / "cases" / "m107_pair_mirrored.toml")
    single = load_case(ROOT / "cases" / "m107_tnt.toml")
    pair, one = contents_of(case, {}), contents_of(single, {})
    assert (pair.rounds, one.rounds) == (2, 1)
    assert pair.explosive == pytest.approx(2.0 * 7.2, rel=0.01)
    assert pair.tnt == pytest.approx(1.11 * pair.explosive)
    assert pair.all_up == pytest.approx(2.0 * pair.largest_round)
    assert one.tnt == pytest.approx(one.explosive)
    assert 40.0 < one.all_up < 45.0


@pytest.mark.parametrize("name", ["comp_b", "Composition B", "COMP-B", "Comp. B", "composition_b"])
def test_an_explosive_has_its_equivalent_however_its_name_is_written(name):
    assert tnt_equivalent(name)[0] == 1.11
    assert name in tnt_equivalent(name)[1]


def test_an_unknown_explosive_is_taken_as_the_strongest_known_with_a_word():
    factor, words = tnt_equivalent("Tetrytol 70/30")
    known = [tnt_equivalent(name)[0] for name in ("TNT", "tritonal", "Composition C-4", "H-6", "PETN", "RDX")]
    assert factor == 1.42
    assert factor > max(known)
    assert "Tetrytol 70/30, whose equivalent is not known" in words
    assert tnt_equivalent("tnt") == (1.0, "")


def test_every_built_in_explosive_has_an_equivalent():
    from burst_fenicsx.materials.library import explosive_names

    for name in explosive_names():
        assert "not known" not in tnt_equivalent(name)[1]


def test_blast_distances_do_not_depend_on_how_the_name_is_written(tmp_path):
    from fragfield.case import load_case

    text = (ROOT / "cases" / "m107_comp_b.toml").read_text(encoding="utf-8")
    (tmp_path / "built_in.toml").write_text(text, encoding="utf-8")
    library = (ROOT / "burst_fenicsx" / "data" / "explosives.toml").read_text(encoding="utf-8")
    (tmp_path / "own.toml").write_text(library.replace("[comp_b]", '["Composition B"]'), encoding="utf-8")
    own = text.replace('explosive = "comp_b"', 'explosive = "own.toml#Composition B"')
    assert own != text
    (tmp_path / "own_name.toml").write_text(own, encoding="utf-8")
    built_in, named = (contents_of(load_case(tmp_path / f"{name}.toml"), {}) for name in ("built_in", "own_name"))
    assert named.tnt == built_in.tnt == pytest.approx(1.11 * built_in.explosive)


def test_every_rule_names_source_formula_inputs_and_range():
    for rule in rules_for(of(7.2, 43.0)):
        assert all((rule.source, rule.formula, rule.inputs, rule.range)), rule
    assert json.loads(json.dumps([rule.distance for rule in rules_for(of(7.2, 43.0))]))
