"""What is said of a case that cannot be used: file, key, what was found, what is allowed."""

from __future__ import annotations

from pathlib import Path

import pytest

from fragfield.case import load_case
from fragfield.case.load import case_from_document
from fragfield.errors import InputError
from tests.fragfield.case_documents import CASE, a_round, changed, changed_burst


@pytest.mark.parametrize(
    ("document", "parts"),
    [
        (changed(brust={}), ['brust: unknown key (did you mean "burst"?)', "allowed here:"]),
        (changed_burst({"leakage": {"radius_ratoi": 2}}), ["burst.leakage.radius_ratoi", "radius_ratio"]),
        (changed_burst({"products": "jvl"}), ['found "jvl" (did you mean "jwl"?)', '"landau_cj"']),
        (changed_burst({"time_step": {"cfl": 1.5}}), ["burst.time_step.cfl: found 1.5", "above 0 and below 1"]),
        (changed_burst({"time_step": {"cfl": "0.8"}}), ['found "0.8"; allowed: a number without unit']),
        (
            changed(break_up={"dimension": 2**63}),
            ["break_up.dimension: found 9223372036854775808; allowed: a whole number of at most 19 digits"],
        ),
        (changed_burst({"leakage": 3}), ["burst.leakage: found 3; allowed: a table"]),
        (changed(burst={}), ["burst.cell_size: missing", "a length"]),
        ({"round": CASE["round"]}, ["burst: missing"]),
        ({"burst": CASE["burst"]}, ["round: missing"]),
        (changed_burst({"stop": "time"}), ["burst.end_time: missing", "120 us"]),
        (
            changed_burst({"stop": "acceleration", "end_time": "120 us"}),
            ["burst.end_time: found 0.00012 s", "contradict"],
        ),
        (changed_burst({"end_time": "2 ms"}), ["burst.end_time: found 0.002 s", "time_limit"]),
        (changed_burst({"acceleration_left": 1.5}), ["burst.acceleration_left"]),
        (changed(round=[a_round(), a_round()]), ['round[2].name: found "a", the name of round[1]']),
        (changed(round=[a_round(), a_round(name="b")]), ["round[2].position", "77.5 mm into round[1]"]),
        (
            changed(round=[a_round(), a_round(name="b", position=["150 mm", "0 mm", "0 mm"])]),
            ["5 mm into round[1]"],
        ),
        (changed(round=[a_round(position=["0 mm", "0 mm", "-2 mm"])]), ["2 mm below the ground"]),
        (changed(round=[a_round(mesh="x.msh")]), ["round[1].profile: found profile and mesh; allowed: one"]),
        (changed(round=[a_round(profile="tub")]), ["round[1].profile", "did you mean 'tube'"]),
        (changed(round=[a_round(profile=3)]), ["round[1].profile: found 3; allowed: a name, a file, or a table"]),
        (changed(round=[a_round(explosive="tmt")]), ["round[1].explosive", "did you mean 'tnt'"]),
        (changed(round=[a_round(explosive={"name": "x", "densty": "1 g/cm3"})]), ["explosive.densty", '"density"']),
        (changed(round=[a_round(casing="no.toml")]), ["round[1].casing", "no.toml"]),
        (changed(round=[a_round(axis=[0, 0, 0])]), ["round[1].axis: found [0, 0, 0]"]),
        (changed(round=[a_round(axis=["0 m", 0, 1])]), ["round[1].axis: component 1"]),
        (changed(round=[a_round(ignition=[{"offset": ["60 mm", "0 mm"]}])]), ["offset: found 60 mm", "55 mm"]),
        (changed(round=[a_round(ignition=[{"delay": "-1 us"}])]), ["round[1].ignition[1].delay", "at least 0 s"]),
        (changed(round=[a_round(ignition=[{"point": "nose"}])]), ["ignition[1].point: unknown key", "station"]),
        (changed(witness=[{"name": "r", "kind": "cilinder"}]), ['witness[1]: found kind = "cilinder"', '"cylinder"']),
        (changed(witness=[{"name": "r", "kind": "panel", "radius": "1 m"}]), ["[1].radius: unknown key", "width"]),
        (changed(witness=[{"name": "r", "radius": "1 m", "bottom": "2 m", "top": "1 m"}]), ["top: found 1 m"]),
        (changed(witness=[{"name": "r", "radius": "1 m"}] * 2), ["witness[2].name"]),
        (changed(flight={"air": {"model": "constant"}}), ["flight.air.density: missing"]),
        (changed(flight={"air": {"density": "1 kg/m3"}}), ["flight.air.density", 'only with model = "constant"']),
        (changed(flight={"wind": {"model": "profile", "heights": ["0 m"]}}), ["flight.wind.speeds: found 0 values"]),
        (changed(flight={"shape": {"model": "lognormal"}}), ["flight.shape.spread: missing", "spread = 0.2"]),
        (changed(flight={"shape": {"spread": 0.2}}), ["flight.shape.spread: found with", 'model = "lognormal"']),
        (changed(flight={"shape": {"model": "box", "ratios": [1, 0, 1]}}), ["flight.shape.ratios"]),
        (changed(flight={"collisions": {"restitution": 2}}), ["flight.collisions.restitution: found 2"]),
        (changed(flight={"collisions": {"distnace": "5 m"}}), ["collisions.distnace", '"distance"']),
        (changed(flight={"drag": "sphre"}), ["flight.drag", "sphere"]),
        (changed(flight={"drag": [1]}), ["flight.drag: found [1]; allowed: a name, a file, or a number"]),
        (changed(break_up={"segments": ["2 cm", "2 cm"]}), ["break_up.segments", "rise"]),
        (changed(break_up={"dimension": 4}), ["break_up.dimension: found 4", '2, 3 or "mixed"']),
        (changed(seed=-1), ["seed: found -1; allowed: 0 to 9.22337e+18"]),
        (changed(burst={"cell_size": "9 mm", "products": "jwl"},
                  round=[a_round(explosive={"name": "x", "density": "1 g/cm3", "detonation_velocity": "6 km/s",
                                           "heat_of_detonation": "4 MJ/kg", "sound_speed": "2 km/s"})]),
         ["round[1].explosive.jwl: missing"]),
    ],
)  # fmt: skip
def test_a_fault_names_file_and_key_what_was_found_and_what_is_allowed(document, parts):
    with pytest.raises(InputError) as caught:
        case_from_document(document, source="my.toml", folder=Path())
    message = str(caught.value)
    assert message.startswith("my.toml: ")
    for part in parts:
        assert part in message


def test_heat_of_detonation_is_of_no_concern_to_jwl():
    weak = {
        "name": "weak", "density": "1630 kg/m3", "detonation_velocity": "6940 m/s", "heat_of_detonation": "3 MJ/kg",
        "sound_speed": "2570 m/s",
        "jwl": {"A": "371.2 GPa", "B": "3.231 GPa", "R1": 4.15, "R2": 0.95, "omega": 0.3, "E0": "7 GPa"},
    }  # fmt: skip
    for products in ("landau", "landau_cj"):
        document = changed(burst={"cell_size": "9 mm", "products": products}, round=[a_round(explosive=weak)])
        with pytest.raises(InputError, match=r"more than D\^2/16 = 3.01 MJ/kg"):
            case_from_document(document, source="my.toml", folder=Path())
    document = changed(burst={"cell_size": "9 mm", "products": "jwl"}, round=[a_round(explosive=weak)])
    assert case_from_document(document, source="my.toml", folder=Path()).round[0].explosive.jwl.E0 == 7e9


def test_several_faults_are_reported_together():
    document = changed(seed="one", burst={"cell_size": 9}, flight={"gravity": "1 m"})
    with pytest.raises(InputError) as caught:
        case_from_document(document, source="my.toml", folder=Path())
    lines = str(caught.value).splitlines()
    assert lines[0] == "my.toml: 3 faults"
    assert [line.split(":")[0].strip() for line in lines[1:]] == ["seed", "burst.cell_size", "flight.gravity"]


def test_a_stack_end_to_end_may_touch_and_a_tilted_round_may_not_reach_in():
    on_top = [a_round(), a_round(name="b", position=["0 mm", "0 mm", "300 mm"])]
    assert len(case_from_document(changed(round=on_top), source="my.toml", folder=Path()).round) == 2
    tilted = [a_round(), a_round(name="b", position=["155 mm", "0 mm", "0 mm"], axis=[-0.1, 0, 1])]
    with pytest.raises(InputError, match=r"round\[2\].position"):
        case_from_document(changed(round=tilted), source="my.toml", folder=Path())


@pytest.mark.parametrize(
    ("content", "part"),
    [(b"[burst\n", "not valid TOML"), (b"\xff\xfe", "not text in UTF-8"), (None, "no such case file")],
)
def test_a_file_that_is_no_case_is_refused(content, part, tmp_path):
    path = tmp_path / "bad.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=part):
        load_case(path)


@pytest.mark.parametrize(
    ("document", "part"),
    [
        (changed(round=[a_round(explosive="TNX")]), "[1].explosive: explosive 'TNX' is unknown; did you mean 'tnt'"),
        (changed(round=[a_round(Explosive="tnt")]), 'Explosive: unknown key (did you mean "explosive"?)'),
        (changed(Burst={}), 'Burst: unknown key (did you mean "burst"?)'),
        (changed_burst({"products": "LANDAU_CJ"}), 'found "LANDAU_CJ" (did you mean "landau_cj"?)'),
        (changed(flight={"drag": "SPHERE"}), "unknown table 'SPHERE'; did you mean 'sphere'?"),
        (changed(obstacle=[{"name": "w", "kind": "WALL"}]), 'found kind = "WALL" (did you mean "wall"?)'),
    ],
)  # fmt: skip
def test_a_name_in_another_case_gets_the_right_one_suggested(document, part):
    with pytest.raises(InputError) as caught:
        case_from_document(document, source="my.toml", folder=Path())
    assert part in str(caught.value)
