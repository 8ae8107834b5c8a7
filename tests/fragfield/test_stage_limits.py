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
from tests.fragfield.short_run import ROOT
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
