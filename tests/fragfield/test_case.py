"""The case file: schema, messages, round trip, and what reaches the stages."""

from __future__ import annotations

import dataclasses
import math
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from burst_fenicsx.geometry import load_profile
from burst_fenicsx.meshing import mesh_profile
from fragfield.case import Case, differences, load_case, read_resolved, to_toml
from fragfield.case.break_up_table import BreakUpTable
from fragfield.case.burst_table import (
    BurstTable,
    ContactTable,
    HourglassTable,
    LeakageTable,
    TimeStepTable,
    ViscosityTable,
)
from fragfield.case.convert import break_up_settings, burst_rounds, burst_settings, flight_arguments
from fragfield.case.load import case_from_document
from fragfield.case.round_table import CasingTable, ExplosiveTable, InitiationTable, JwlTable
from fragfield.errors import InputError

CASES = sorted((Path(__file__).parents[2] / "cases").glob("*.toml"))

FULL = """
title = 'All of it: "quotes", \\ and \u00b5'
seed = 7
[burst]
cell_size = "9 mm"
quadrature = "full"
products = "jwl"
burn = "time"
acceleration_window = "20 us"
time_step = { cfl = 0.7, fixed = "10 ns" }
leakage = { enabled = false }
viscosity = { linear = 0.1 }
hourglass = { casing_stiffness = 0.05 }
output = { interval = "5 us" }
[[round]]
name = "left"
profile = "tube"
explosive = "comp_b"
casing = "copper"
position = ["-100 mm", "0 mm", "0.5 m"]
ignition = [{ station = "middle", offset = ["5 mm", "0 mm"] }, { station = "base", delay = "3 us" }]
[[round]]
name = "right"
profile = "m107"
explosive = "tnt"
casing = "steel_m107"
position = ["100 mm", "0 mm", "0.5 m"]
axis = [0, 0.1, 1]
[break_up]
dimension = "mixed"
mixed_fraction = 0.3
mean_mass = "14.9 g"
prefactor = "paper"
sampler = "graded"
graded_m0 = "0.05 g"
segments = ["10 cm", "20 cm"]
[flight]
drag = 1.2
wind = { model = "profile", heights = ["0 m", "100 m"], speeds = ["1 m/s", "9 m/s"], directions = ["10 deg", "30 deg"] }
air = { model = "constant", density = "0.9 kg/m3" }
integrator = { method = "fixed", step = "0.1 ms" }
[[witness]]
name = "ring"
radius = "25 ft"
top = "3 m"
[[witness]]
name = "wall"
kind = "panel"
centre = ["10 m", "0 m", "1 m"]
normal = [-1, 0, 0]
width = "4 m"
height = "2 m"
[[witness]]
name = "roof"
kind = "polygon"
corners = [["8 m", "-1 m", "3 m"], ["10 m", "-1 m", "3 m"], ["9 m", "1 m", "3 m"]]
[hazard]
energy = "58 ft*lbf"
"""


def _write(folder, text):
    path = folder / "case.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_a_ready_case_written_resolved_and_read_back_is_the_same_case(path, tmp_path):
    case = load_case(path)
    stored = _write(tmp_path, to_toml(case))
    assert read_resolved(stored) == case
    assert load_case(stored) == case
    assert to_toml(load_case(stored)) == to_toml(case)


def test_a_case_that_uses_every_table_comes_back_the_same(tmp_path):
    case = load_case(_write(tmp_path, FULL))
    again = load_case(_write(tmp_path, to_toml(case)))
    assert again == case
    assert differences(case, again) == []


def test_a_resolved_case_spells_everything_out_and_needs_no_other_file(tmp_path):
    shutil.copy(Path(__file__).parents[2] / "burst_fenicsx/data/profiles/tube.toml", tmp_path / "mine.toml")
    (tmp_path / "fill.toml").write_text(
        "[mix]\ndensity = 1500\ndetonation_velocity = 6000\nheat_of_detonation = 4e6\nsound_speed = 2000\n"
    )
    text = '[burst]\ncell_size = "9 mm"\n[[round]]\nname = "a"\ncasing = "copper"\n'
    text += 'profile = "mine.toml"\nexplosive = "fill.toml"\n'
    case = load_case(_write(tmp_path, text))
    document = tomllib.loads(to_toml(case))
    assert document["burst"]["stop"] == "acceleration"
    assert document["burst"]["leakage"]["radius_ratio"] == 1.75
    assert document["round"][0]["profile"]["outer"]["points"] == [[0, 77.5], [300, 77.5]]
    assert document["round"][0]["explosive"]["density"] == "1500.0 kg/m^3"
    assert document["round"][0]["casing"]["shear_softening_strain"] == "none"
    assert document["round"][0]["ignition"] == [{"station": "0.0 m", "offset": ["0.0 m", "0.0 m"], "delay": "0.0 s"}]
    (tmp_path / "mine.toml").unlink()
    (tmp_path / "fill.toml").unlink()
    assert load_case(_write(tmp_path, to_toml(case))) == case


def test_the_case_reaches_every_setting_of_the_burst(tmp_path):
    case = load_case(_write(tmp_path, FULL))
    settings = burst_settings(case)
    assert (settings.cell_size, settings.quadrature, settings.products, settings.burn) == (0.009, "full", "jwl", "time")
    assert settings.end_time is None
    assert settings.acceleration_window == 20e-6
    assert (settings.time_step.cfl, settings.time_step.fixed) == (0.7, 10e-9)
    assert not settings.leakage.enabled
    assert settings.viscosity.linear == 0.1
    assert settings.hourglass.casing_stiffness == 0.05
    assert settings.output_interval == 5e-6
    left, right = burst_rounds(case)
    assert left.explosive.jwl is not None
    assert left.casing.shear_softening_strain is None
    assert [(point.station, point.offset, point.delay) for point in left.ignition] == [
        (pytest.approx(0.15), (0.005, 0.0), 0.0),
        (pytest.approx(0.3), (0.0, 0.0), 3e-6),
    ]
    assert [point.station for point in right.ignition] == [pytest.approx(0.142518)]
    assert right.axis == (0.0, 0.1, 1.0)


def test_the_case_reaches_break_up_and_flight(tmp_path):
    case = load_case(_write(tmp_path, FULL))
    settings = break_up_settings(case)
    assert (settings.dimension, settings.mixed_fraction, settings.mean_mass) == ("mixed", 0.3, 0.0149)
    assert (settings.prefactor, settings.sampler, settings.graded_m0) == ("paper", "graded", 5e-5)
    assert settings.segments == (0.1, 0.2)
    assert settings.shape_factor == 2600.0
    arguments = flight_arguments(case)
    assert float(arguments["air"].density(0.0)) == 0.9
    assert float(arguments["drag"].at(2.0)) == 1.2
    assert arguments["integrator"].step == 1e-4
    assert arguments["wind"].at(100.0) == pytest.approx([9 * 0.8660254037844387, 4.5])
    assert [surface.name for surface in arguments["witnesses"]] == ["ring", "wall", "roof"]
    assert arguments["witnesses"][0].radius == 7.62
    assert case.hazard.energy == pytest.approx(78.6374, rel=1e-5)


def test_the_schema_offers_every_field_of_the_stages_and_their_defaults():
    from burst_fenicsx import problem
    from transition import BreakUpSettings

    renamed = {"output_interval", "planes"}  # burst.output.interval, [[plane]]
    pairs = [
        (problem.BurstSettings, BurstTable, renamed),
        (problem.TimeStep, TimeStepTable, set()),
        (problem.Leakage, LeakageTable, set()),
        (problem.Viscosity, ViscosityTable, set()),
        (problem.Hourglass, HourglassTable, set()),
        (problem.Explosive, ExplosiveTable, set()),
        (problem.JonesWilkinsLee, JwlTable, set()),
        (problem.CasingMaterial, CasingTable, set()),
        (problem.Contact, ContactTable, set()),
        (problem.ShockInitiation, InitiationTable, set()),
        (BreakUpSettings, BreakUpTable, {"shape_factor"}),
    ]
    for data, table, elsewhere in pairs:
        for field in dataclasses.fields(data):
            if field.name in elsewhere:
                continue
            assert field.name in table.model_fields, f"{data.__name__}.{field.name} has no key"
            if field.default is not dataclasses.MISSING and not table.model_fields[field.name].is_required():
                default = table.model_fields[field.name].default
                if field.name.endswith("angle"):  # radians in the case, degrees in the stages
                    default = round(math.degrees(default), 10)
                assert default == field.default, f"{table.__name__}.{field.name}"


CASE = {
    "burst": {"cell_size": "9 mm"},
    "round": [{"name": "a", "profile": "tube", "explosive": "tnt", "casing": "copper"}],
}


def _changed(**changes):
    return {**CASE, **changes}


def _round(**changes):
    return {**CASE["round"][0], **changes}


def _burst(changes):
    return {**CASE, "burst": {**CASE["burst"], **changes}}


@pytest.mark.parametrize(
    ("document", "parts"),
    [
        (_changed(brust={}), ['brust: unknown key (did you mean "burst"?)', "allowed here:"]),
        (_burst({"leakage": {"radius_ratoi": 2}}), ["burst.leakage.radius_ratoi", "radius_ratio"]),
        (_burst({"products": "jvl"}), ['found "jvl" (did you mean "jwl"?)', '"landau_cj"']),
        (_burst({"time_step": {"cfl": 1.5}}), ["burst.time_step.cfl: found 1.5", "less than 1"]),
        (_burst({"time_step": {"cfl": "0.8"}}), ['found "0.8"; allowed: a number without unit']),
        (_burst({"leakage": 3}), ["burst.leakage: found 3; allowed: a table"]),
        (_changed(burst={}), ["burst.cell_size: missing", "a length"]),
        ({"round": CASE["round"]}, ["burst: missing"]),
        ({"burst": CASE["burst"]}, ["round: missing"]),
        (_burst({"stop": "time"}), ["burst.end_time: missing", "120 us"]),
        (
            _burst({"stop": "acceleration", "end_time": "120 us"}),
            ["burst.end_time: found 0.00012 s", "contradict"],
        ),
        (_burst({"end_time": "2 ms"}), ["burst.end_time: found 0.002 s", "time_limit"]),
        (_burst({"acceleration_window": "2 ms"}), ["burst.acceleration_window"]),
        (_changed(round=[_round(), _round()]), ['round[2].name: found "a", the name of round[1]']),
        (_changed(round=[_round(), _round(name="b")]), ["round[2].position", "155 mm into round[1]"]),
        (_changed(round=[_round(), _round(name="b", position=["150 mm", "0 mm", "0 mm"])]), ["5 mm into round[1]"]),
        (_changed(round=[_round(position=["0 mm", "0 mm", "-2 mm"])]), ["2 mm below the ground"]),
        (_changed(round=[_round(mesh="x.msh")]), ["round[1].profile: found both profile and mesh"]),
        (_changed(round=[_round(profile="tub")]), ["round[1].profile", "did you mean 'tube'"]),
        (_changed(round=[_round(profile=3)]), ["round[1].profile: found 3; allowed: a name, a file, or a table"]),
        (_changed(round=[_round(explosive="tmt")]), ["round[1].explosive", "did you mean 'tnt'"]),
        (_changed(round=[_round(explosive={"name": "x", "densty": "1 g/cm3"})]), ["explosive.densty", '"density"']),
        (_changed(round=[_round(casing="no.toml")]), ["round[1].casing", "no.toml"]),
        (_changed(round=[_round(axis=[0, 0, 0])]), ["round[1].axis: found [0, 0, 0]"]),
        (_changed(round=[_round(axis=["0 m", 0, 1])]), ["round[1].axis: component 1"]),
        (_changed(round=[_round(ignition=[{"offset": ["60 mm", "0 mm"]}])]), ["offset: found 60 mm", "55 mm"]),
        (_changed(round=[_round(ignition=[{"delay": "-1 us"}])]), ["round[1].ignition[1].delay", "at least 0 s"]),
        (_changed(round=[_round(ignition=[{"point": "nose"}])]), ["ignition[1].point: unknown key", "station"]),
        (_changed(witness=[{"name": "r", "kind": "cilinder"}]), ['witness[1]: found kind = "cilinder"', '"cylinder"']),
        (_changed(witness=[{"name": "r", "kind": "panel", "radius": "1 m"}]), ["[1].radius: unknown key", "width"]),
        (_changed(witness=[{"name": "r", "radius": "1 m", "bottom": "2 m", "top": "1 m"}]), ["top: found 1 m"]),
        (_changed(witness=[{"name": "r", "radius": "1 m"}] * 2), ["witness[2].name"]),
        (_changed(flight={"air": {"model": "constant"}}), ["flight.air.density: missing"]),
        (_changed(flight={"air": {"density": "1 kg/m3"}}), ["flight.air.density", 'only with model = "constant"']),
        (_changed(flight={"wind": {"model": "profile", "heights": ["0 m"]}}), ["flight.wind.speeds: found 0 values"]),
        (_changed(flight={"shape": {"model": "lognormal"}}), ["flight.shape.spread: missing", "spread = 0.2"]),
        (_changed(flight={"shape": {"spread": 0.2}}), ["flight.shape.spread: found with", 'model = "lognormal"']),
        (_changed(flight={"shape": {"model": "box", "ratios": [1, 0, 1]}}), ["flight.shape.ratios"]),
        (_changed(flight={"collisions": {"restitution": 2}}), ["flight.collisions.restitution: found 2"]),
        (_changed(flight={"collisions": {"distnace": "5 m"}}), ["collisions.distnace", '"distance"']),
        (_changed(flight={"drag": "sphre"}), ["flight.drag", "sphere"]),
        (_changed(flight={"drag": [1]}), ["flight.drag: found [1]; allowed: a name, a file, or a number"]),
        (_changed(break_up={"segments": ["2 cm", "1 cm"]}), ["break_up.segments", "rise"]),
        (_changed(break_up={"dimension": 4}), ["break_up.dimension: found 4", '2, 3 or "mixed"']),
        (_changed(seed=-1), ["seed: found -1; allowed: at least 0"]),
        (_changed(burst={"cell_size": "9 mm", "products": "jwl"},
                  round=[_round(explosive={"name": "x", "density": "1 g/cm3", "detonation_velocity": "6 km/s",
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


def test_shape_and_collisions_reach_the_flight(tmp_path):
    import flight

    given = {"shape": {"model": "box", "orientation": "fixed"}, "collisions": {"distance": "5 m"}}
    case = case_from_document(_changed(flight=given), source="my.toml", folder=tmp_path)
    arguments = flight_arguments(case)
    assert arguments["shape"] == flight.shape.Box((5.0, 2.0, 1.0), "fixed")
    assert arguments["contact"] == flight.Contact(distance=5.0)
    assert read_resolved(_write(tmp_path, to_toml(case))) == case
    drawn = _changed(flight={"shape_factor": "2370 kg/m3", "shape": {"model": "lognormal", "spread": 0.2}})
    arguments = flight_arguments(case_from_document(drawn, source="my.toml", folder=tmp_path))
    assert arguments["shape"] == flight.shape.Lognormal(0.2, 2370.0)
    arguments = flight_arguments(case_from_document(CASE, source="my.toml", folder=tmp_path))
    assert (arguments["shape"], arguments["contact"]) == (None, None)


def test_a_round_from_a_mesh_file_is_lit_within_its_charge(tmp_path):
    meshio = pytest.importorskip("meshio")
    mesh = mesh_profile(load_profile("tube"), 0.02)
    names = {"casing": np.array([1, 3]), "charge": np.array([2, 3])}
    tags = [mesh.part + 1]
    meshio.Mesh(
        mesh.nodes, [("hexahedron", mesh.cells)], field_data=names,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
    ).write(tmp_path / "tube.msh", file_format="gmsh22", binary=False)  # fmt: skip
    entry = {"name": "a", "mesh": "tube.msh", "explosive": "tnt", "casing": "copper"}
    case = case_from_document(_changed(round=[entry]), source="my.toml", folder=tmp_path)
    assert case.round[0].mesh == str(tmp_path / "tube.msh")
    assert [point.station for point in case.round[0].ignition] == [pytest.approx(0.0, abs=1e-9)]
    assert read_resolved(_write(tmp_path, to_toml(case))) == case
    at_base = {**entry, "ignition": [{"station": "base", "delay": "1 us"}]}
    case = case_from_document(_changed(round=[at_base]), source="my.toml", folder=tmp_path)
    assert burst_rounds(case)[0].ignition[0].station == pytest.approx(0.3)
    outside = {**entry, "ignition": [{"station": "301 mm"}]}
    with pytest.raises(InputError, match=r"ignition\[1\].station: found 301 mm, outside the charge"):
        case_from_document(_changed(round=[outside]), source="my.toml", folder=tmp_path)
    (tmp_path / "tube.msh").write_text("nonsense")
    with pytest.raises(InputError, match=r"my.toml: round\[1\].mesh: .*tube.msh"):
        case_from_document(_changed(round=[entry]), source="my.toml", folder=tmp_path)


def test_the_reference_can_be_generated_from_the_schema():
    schema = Case.model_json_schema()
    size = schema["$defs"]["BurstTable"]["properties"]["cell_size"]
    assert size["unit"] == "m"
    assert size["description"].startswith("Edge of a hexahedron")
    bare = [
        f"{name}.{key}"
        for name, table in schema["$defs"].items()
        for key, field in table.get("properties", {}).items()
        if "description" not in field and "$ref" not in field
    ]
    assert bare == [], "every key has its words"


def test_heat_of_detonation_is_of_no_concern_to_jwl():
    weak = {
        "name": "weak", "density": "1630 kg/m3", "detonation_velocity": "6940 m/s", "heat_of_detonation": "3 MJ/kg",
        "sound_speed": "2570 m/s",
        "jwl": {"A": "371.2 GPa", "B": "3.231 GPa", "R1": 4.15, "R2": 0.95, "omega": 0.3, "E0": "7 GPa"},
    }  # fmt: skip
    for products in ("landau", "landau_cj"):
        document = _changed(burst={"cell_size": "9 mm", "products": products}, round=[_round(explosive=weak)])
        with pytest.raises(InputError, match=r"more than D\^2/16 = 3.01 MJ/kg"):
            case_from_document(document, source="my.toml", folder=Path())
    document = _changed(burst={"cell_size": "9 mm", "products": "jwl"}, round=[_round(explosive=weak)])
    assert case_from_document(document, source="my.toml", folder=Path()).round[0].explosive.jwl.E0 == 7e9


def test_several_faults_are_told_together():
    document = _changed(seed="one", burst={"cell_size": 9}, flight={"gravity": "1 m"})
    with pytest.raises(InputError) as caught:
        case_from_document(document, source="my.toml", folder=Path())
    lines = str(caught.value).splitlines()
    assert lines[0] == "my.toml: 3 faults"
    assert [line.split(":")[0].strip() for line in lines[1:]] == ["seed", "burst.cell_size", "flight.gravity"]


def test_rounds_side_by_side_may_touch_where_they_do_not_push_each_other():
    both = [_round(), _round(name="b", position=["155 mm", "0 mm", "0 mm"])]
    apart = {**CASE["burst"], "contact": {"surfaces": False}}
    case = case_from_document(_changed(burst=apart, round=both), source="my.toml", folder=Path())
    assert len(case.round) == 2


def test_a_stack_end_to_end_may_touch_and_a_tilted_round_may_not_reach_in():
    on_top = [_round(), _round(name="b", position=["0 mm", "0 mm", "300 mm"])]
    assert len(case_from_document(_changed(round=on_top), source="my.toml", folder=Path()).round) == 2
    tilted = [_round(), _round(name="b", position=["155 mm", "0 mm", "0 mm"], axis=[-0.1, 0, 1])]
    with pytest.raises(InputError, match=r"round\[2\].position"):
        case_from_document(_changed(round=tilted), source="my.toml", folder=Path())


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


def test_differences_name_the_keys(tmp_path):
    path = _write(tmp_path, FULL)
    one, other = load_case(path), load_case(path, cell_size="8 mm")
    assert differences(one, other) == ['burst.cell_size: stored "0.009 m", now "0.008 m"']
    assert differences(one, other, within=["round", "burst.leakage"]) == []
    changed = load_case(
        _write(tmp_path, FULL.replace('radius = "25 ft"', 'radius = "24 ft"').replace("seed = 7", "seed = 8"))
    )
    assert [line.split(":")[0] for line in differences(one, changed)] == ["seed", "witness[1].radius"]
