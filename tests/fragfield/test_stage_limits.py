"""What a stage refuses is refused when the case is loaded, with its key: no limit waits for the end of the burst."""

from __future__ import annotations

import copy
import math
from dataclasses import fields

import pytest

from fragfield.case.keys import marks_of
from fragfield.case.load import case_from_document
from fragfield.errors import InputError
from fragfield_base import errors
from fragfield_base.inputs import Quantity
from tests.attack.cases import BASE
from tests.fragfield.short_run import ROOT, SHORT, invoke
from tests.fragfield.test_bounds import FIELDS

SAMPLES = sorted(
    {
        0.0,
        *(sign * 10.0**k for sign in (-1.0, 1.0) for k in range(-12, 13)),
        0.51,
        5.01,
        7.0,
        84_001.0,
        1.01,
        2.01,
        91.0,
    }
)


def _stages():
    """Key of a case, and what builds the stage's own object from a value of it (SI)."""
    from flight import Adaptive, ConstantAir, Contact, FixedStep, StandardAtmosphere
    from flight.hazard.criteria import Criteria
    from flight.shape import Lognormal
    from transition import BreakUpSettings

    for name in (one.name for one in fields(BreakUpSettings)):
        if f"break_up.{name}" in FIELDS and name != "segments":
            yield f"break_up.{name}", lambda value, name=name: BreakUpSettings(**{name: value}), {}
    for name in ("density", "restitution", "distance", "time_limit"):
        yield f"flight.collisions.{name}", lambda value, name=name: Contact(**{name: value}), {}
    yield "flight.collisions.friction_angle", lambda value: Contact(friction_angle_deg=math.degrees(value)), {}
    yield "flight.air.altitude", StandardAtmosphere, {}
    yield "flight.air.density", lambda value: ConstantAir(value, 340.0), {"model": "constant"}
    yield "flight.air.sound_speed", lambda value: ConstantAir(1.0, value), {"model": "constant", "density": "1 kg/m^3"}
    yield "flight.integrator.tolerance", Adaptive, {}
    yield "flight.integrator.step", FixedStep, {"method": "fixed"}
    yield "flight.shape.spread", lambda value: Lognormal(value, 2600.0), {"model": "lognormal"}
    for name in ("energy", "density", "person_area", "person_height"):
        yield f"hazard.{name}", lambda value, name=name: Criteria(**{name: value}), {}


STAGES = {key: (build, beside) for key, build, beside in _stages()}


def _document(key: str, value: object, beside: dict) -> dict:
    document = copy.deepcopy(BASE)
    *path, name = key.split(".")
    table = document
    for part in path:
        table = table.setdefault(part, {})
    table.update(beside)
    table[name] = value
    return document


def _refusal(document: dict) -> str:
    """Why a case is refused; empty where it is not."""
    try:
        case_from_document(document, source="case.toml", folder=ROOT)
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("key", STAGES)
def test_values_that_a_stage_refuses_are_refused_of_the_case(key):
    build, beside = STAGES[key]
    field = FIELDS[key]
    unit = next((mark.symbol for mark in marks_of(field) if isinstance(mark, Quantity)), None)
    numeric = "float" in str(field.annotation) or "int" in str(field.annotation)
    refused = 0
    for value in SAMPLES:
        try:
            build(value)
        except errors.InputError:
            pass
        else:
            continue
        refused += 1
        written = value if unit is None else f"{value!r} {unit}"
        message = _refusal(_document(key, written, beside))
        assert key in message, (value, message)
        assert message.startswith("case.toml: ")
    assert refused or not numeric, "no sample lies beyond the limits of the stage"


@pytest.mark.parametrize(
    ("break_up", "words"),
    [
        ({"mean_mass": "6 kg"}, "mean_mass: found 6 kg, above the mass of the heaviest segment of round[1], 5.479"),
        ({"mean_mass": "5 kg"}, ""),
        ({"mean_mass": "1 mg"}, "makes about 2.19e+07 fragments of the casings"),
        ({"mean_mass": "2 mg"}, ""),
        ({"mean_mass": "0.9 mg"}, "break_up.mean_mass: found 9e-07 kg; allowed: 1e-06 to 1000 kg"),
        ({"segments": ["100 mm", "300 mm"]}, "station 300 mm, beyond round[1]; allowed: below its length, 300 mm"),
        ({"segments": ["100 mm", "299 mm"]}, ""),
        ({"segments": ["0 mm", "100 mm"]}, "break_up.segments: found [0.0, 0.1]; every station lies above zero"),
        ({"mean_mass": "gurney_sarmousakis"}, ""),
        ({"mean_mass": "gurney_sarmousakis", "explosive_constant": 1e-4}, "makes about 1.83e+12 fragments"),
        ({"prefactor": 1e-3, "fracture_energy": "1 J/m^2"}, "makes about"),
        ({"sampler": "graded", "graded_m0": "6 kg"}, 'less than one fragment of the segment "front end" of round[1]'),
        ({"sampler": "graded"}, ""),
        ({"sampler": "graded", "mean_mass": "20 g", "graded_dm": "1e-7 kg"}, "break_up.graded_dm: the first grade"),
        ({"sampler": "graded", "mean_mass": "20 g", "graded_dm": "1e-4 kg"}, ""),
    ],
)  # fmt: skip
def test_what_only_rounds_and_settings_together_forbid(break_up, words):
    message = _refusal({**copy.deepcopy(BASE), "break_up": break_up})
    assert words in message
    assert bool(message) == bool(words)


def test_an_explosive_without_constant_is_refused_for_gurney_and_sarmousakis():
    document = copy.deepcopy(BASE)
    document["round"][0]["explosive"] = {
        "name": "mine", "density": "1.6 g/cm^3", "detonation_velocity": "7 km/s", "heat_of_detonation": "4.6 MJ/kg",
        "sound_speed": "2.5 km/s",
    }  # fmt: skip
    document["break_up"] = {"mean_mass": "gurney_sarmousakis"}
    assert "no constant is known for the explosive 'mine'" in _refusal(document)
    document["break_up"]["explosive_constant"] = 3.0
    assert _refusal(document) == ""


@pytest.mark.parametrize(
    ("hazard", "words"),
    [
        (
            {"stack_rule": {"side": 0, "top": 0}},
            "hazard.stack_rule: no round on the side and none on top; allowed: one",
        ),
        ({"stack_rule": {"side": 0, "top": 1}}, ""),
        ({"distance_cell": "1 cm", "sectors": 3600}, "make 7.2e+08 cells of density; allowed: at most 2e+07"),
        ({"distance_cell": "1 m", "sectors": 3600}, ""),
    ],
)
def test_what_the_hazard_distance_cannot_be_computed_with(hazard, words):
    message = _refusal({**copy.deepcopy(BASE), "hazard": hazard})
    assert words in message
    assert bool(message) == bool(words)


@pytest.mark.parametrize(
    ("size", "words"),
    [
        ("80 mm", "burst.cell_size: found 80 mm; at most the round's radius is allowed (tube: 77.5 mm)"),
        ("77 mm", ""),
        ("0.4 mm", "burst.cell_size: found 0.4 mm makes 8.84e+07 cells; at most 5e+07 are allowed"),
        ("0.5 mm", ""),
    ],
)
def test_cells_that_make_no_mesh(size, words):
    document = copy.deepcopy(BASE)
    document["burst"]["cell_size"] = size
    message = _refusal(document)
    assert words in message
    assert bool(message) == bool(words)


def test_check_warns_of_segments_lighter_than_a_given_mean_mass(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(SHORT.replace('profile = "tube"', 'profile = "m107"'))
    said = " ".join(invoke("check", path, "--set", 'break_up.mean_mass="3 kg"').stdout.split())
    assert "break_up.mean_mass = 3 kg is above the mass of" in said
    assert "of which each stays one piece" in said
    assert "stays one piece" not in invoke("check", path, "--set", 'break_up.mean_mass="10 g"').stdout


def test_a_witness_at_fault_is_named_by_its_key():
    document = copy.deepcopy(BASE)
    panel = {"name": "p", "kind": "panel", "centre": ["1 m", "0 m", "1 m"], "normal": [0, 0, 1], "width": "1 m"}
    document["witness"] = [{"name": "ring", "radius": "5 m"}, {**panel, "height": "1 m"}]
    assert _refusal(document).startswith('case.toml: witness[2]: "p": up [0.0, 0.0, 1.0] is along the normal')
