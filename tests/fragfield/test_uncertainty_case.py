"""The table [uncertainty]: its messages, the default set of every built-in round, and what it leaves alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from burst_fenicsx.geometry import load_profile, profile_names
from burst_fenicsx.materials.library import casing_names
from fragfield.case import differences, load_case, read_resolved, to_toml
from fragfield.case.load import case_from_document, read_document
from fragfield.errors import InputError
from fragfield.studies.uncertainty.inputs import inputs_of
from fragfield.studies.uncertainty.plan import plan_samples

ROOT = Path(__file__).parents[2]
TUBE, M107, PAIR = (ROOT / "cases" / f"{name}.toml" for name in ("tube", "m107_tnt", "m107_pair"))
RADIUS = {
    "name": "leakage radius", "keys": ["burst.leakage.radius_ratio"], "distribution": "uniform", "low": 1.59,
    "high": 2.1, "source": "published",
}  # fmt: skip


def _case(*inputs, file=TUBE, changes=None, **table):
    document = read_document(file)
    document |= changes or {}
    document["uncertainty"] = {**table, "input": [dict(one) for one in inputs]}
    return case_from_document(document, source="case.toml", folder=file.parent)


def test_a_resolved_case_keeps_the_table(tmp_path):
    case = _case(RADIUS, samples=64)
    path = tmp_path / "case.toml"
    path.write_text(to_toml(case))
    assert read_resolved(path).uncertainty == case.uncertainty
    assert case.uncertainty.input[0].high == 2.1


def test_no_run_depends_on_the_table():
    assert differences(load_case(TUBE), _case(RADIUS)) == []


# --- the default set ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("profile", "casing"),
    [*((one, "steel_paper") for one in profile_names()), *(("tube", one) for one in casing_names())],
)
def test_every_built_in_round_has_a_default_set_with_sources(profile, casing):
    entry = {"name": "it", "profile": profile, "explosive": "comp_b", "casing": casing}
    law = {"critical_strain": 0.5, "fracture_energy": "1e4 J/m^2", "mean_mass_factor": 1.6}  # some casings have none
    case = _case(changes={"round": [entry], "break_up": law})
    found = {one.name: one for one in inputs_of(case)}
    wanted = {"leakage radius", "heat of detonation", "yield strength", "ignition place", "mean fragment mass",
              "drag coefficient", "presented area"}  # fmt: skip
    assert wanted <= set(found)
    assert ("softening" in found) == (casing != "copper")  # which has none
    for one in found.values():
        assert len(one.source) > 40
        assert one.is_default
    assert found["leakage radius"].distribution.low == 1.59
    assert found["leakage radius"].distribution.high == 2.1
    assert not found["leakage radius"].judgement
    assert found["heat of detonation"].distribution.standard_deviation == 0.05
    assert found["heat of detonation"].judgement
    assert found["mean fragment mass"].distribution.factor == 1.6
    shape, moved = load_profile(profile), found["ignition place"].distribution
    assert moved.low == 0.0
    assert moved.high == pytest.approx(0.1 * (shape.charge_end - shape.charge_front), rel=1e-3)


def test_an_own_input_replaces_the_default_of_its_name_or_key():
    by_key = _case({**RADIUS, "name": "venting", "low": 1.7, "high": 1.8})
    names = [one.name for one in inputs_of(by_key)]
    assert names[0] == "venting"
    assert "leakage radius" not in names
    assert len(names) == 15
    by_name = _case({**RADIUS, "keys": ["burst.leakage.beta"], "low": 0.9, "high": 1.1})
    assert sum(one.name == "leakage radius" for one in inputs_of(by_name)) == 1
    assert [one.name for one in inputs_of(_case(RADIUS, defaults=False))] == ["leakage radius"]
    with pytest.raises(InputError, match="uncertainty: found no input"):
        inputs_of(_case(defaults=False))


@pytest.mark.parametrize(
    ("break_up", "key", "factor"),
    [
        ({}, "break_up.prefactor", 1.6),
        ({"mean_mass_factor": 2.0}, "break_up.prefactor", 2.0),
        ({"mean_mass": "mott_1947"}, "break_up.fracture_stress", 1.9),
        ({"mean_mass": "gurney_sarmousakis"}, "break_up.explosive_constant", 1.5**0.5),
        ({"mean_mass": "14.9 g"}, "break_up.mean_mass", 1.6),
    ],
)
def test_the_mean_mass_is_varied_by_what_its_law_is_linear_in(break_up, key, factor):
    (found,) = [one for one in inputs_of(_case(changes={"break_up": break_up})) if one.name == "mean fragment mass"]
    assert found.keys == (key,)
    assert found.distribution.factor == pytest.approx(factor)
    assert found.judgement == (break_up.get("mean_mass") == "14.9 g")


# --- samples --------------------------------------------------------------------------------------------------------


def test_a_sample_has_its_draws():
    study = plan_samples(load_case(M107), samples=20, seed=4)
    names = [one.name for one in study.inputs]
    for number in (0, 7, 19):
        draws = dict(zip(names, study.draws[number], strict=True))
        case = case_from_document(study.document(number), source="sample", folder=ROOT)
        assert case.burst.leakage.radius_ratio == draws["leakage radius"]
        assert case.round[0].explosive.heat_of_detonation == pytest.approx(4.52e6 * draws["heat of detonation"])
        assert case.round[0].casing.shear_softening_strain == draws["softening"]
        assert case.round[0].casing.tensile_softening_strain == draws["softening"]
        assert case.round[0].casing.shear_strength == pytest.approx(224e6 * draws["yield strength"])
        assert case.round[0].casing.tensile_strength == pytest.approx(448e6 * draws["yield strength"])
        assert case.round[0].ignition[0].station == pytest.approx(0.142518 + draws["ignition place"])
        assert case.break_up.prefactor == pytest.approx(4.0 * draws["mean fragment mass"])
        assert case.flight.drag_factor == draws["drag coefficient"]
        assert case.flight.shape_factor == pytest.approx(2600.0 * draws["presented area"])
        assert case.break_up.realisations == case.hazard.max_realisations == 12
        assert case.witness == []
        assert case.uncertainty is None
    assert study.burst is None
    assert study.document(0)["seed"] != study.document(1)["seed"]


def test_a_pair_shares_few_bursts():
    study = plan_samples(load_case(PAIR), samples=60)
    assert study.bursts == 12  # five inputs of the burst
    assert "three dimensions" in study.geometry
    for number in range(60):
        burst = study.draws[number][:5]
        assert burst == study.draws[int((study.burst == study.burst[number]).argmax())][:5]


@pytest.mark.parametrize(
    ("file", "table", "options", "message"),
    [
        (PAIR, {"bursts": 4}, {}, "uncertainty.bursts: found 4; allowed with 5 uncertain inputs of the burst: at least 7"),  # noqa: E501
        (PAIR, {}, {"samples": 20}, "uncertainty.samples: found 20 for 12 bursts; allowed: at least 24"),
    ],
)  # fmt: skip
def test_plans_that_cannot_be_made(file, table, options, message):
    with pytest.raises(InputError) as found:
        plan_samples(_case(file=file, **table), **options)
    assert message in str(found.value)


def test_an_input_whose_ends_make_no_case_is_refused_before_anything_runs():
    far = {"name": "place", "keys": ["round.0.ignition.0.station"], "distribution": "uniform", "low": "0 m",
           "high": "2 m", "source": "none"}  # fmt: skip
    for file in (TUBE, PAIR):
        with pytest.raises(InputError, match=r'uncertainty input "place" at [\d.]+: .*outside the charge'):
            plan_samples(_case(far, file=file))
    other = {**RADIUS, "keys": ["round.tub.explosive.density"], "low": "1600 kg/m^3", "high": "1650 kg/m^3"}
    with pytest.raises(InputError, match=r"there is no entry tub \(did you mean"):
        plan_samples(_case({**other, "name": "density"}))


def test_words_can_be_uncertain():
    table = {"name": "drag table", "keys": ["flight.drag"], "distribution": "discrete",
             "values": ["shell_fragment", "cube_face_on", 1.2], "source": "tables"}  # fmt: skip
    study = plan_samples(_case(table, defaults=False), samples=30)
    found = [case_from_document(study.document(i), source="s", folder=ROOT).flight.drag for i in range(30)]
    assert [found.count(value) for value in ("shell_fragment", "cube_face_on", 1.2)] == [10, 10, 10]
