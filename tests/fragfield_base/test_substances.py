"""Files of explosives and casings: their form, their names, and what can be computed again from their values."""

from __future__ import annotations

import math
import tomllib

import numpy as np
import pytest

from fragfield_base.errors import InputError, plain_key
from fragfield_base.substances import (
    FOLDERS,
    GRADES,
    aliases,
    graded,
    read_substance,
    substance,
    substance_key,
    substance_names,
    substance_title,
    substances_with,
)

ALL = [(kind, name) for kind in FOLDERS for name in substance_names(kind)]
FILE = (FOLDERS["explosive"] / "comp_b.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize(("kind", "name"), ALL)
def test_every_file_is_of_the_form_and_says_what_its_substance_is(kind, name):
    one = substance(kind, name)
    assert plain_key(name) == name.replace("_", "")
    assert one.title
    assert one.composition
    assert {"charge"} <= set(one.groups) if kind == "explosive" else {"solid", "strength"} <= set(one.groups)
    for group in one.groups.values():
        assert group.values
        assert len(group.source) > 10
        assert group.grade in GRADES
    if one.groups.get("jwl") is None and kind == "explosive":
        assert "unreacted" not in one.groups  # refused by the burst as a whole


def test_every_name_is_of_one_substance_and_found_however_it_is_written():
    for kind in FOLDERS:
        assert len(aliases(kind)) >= len(substance_names(kind))  # raises where two share one
    for text in ("Comp B", "compb", "COMPOSITION-B", "composition_b", "RDX/TNT 60/40"):
        assert substance_key(text) == "comp_b", text
    for text, name in {
        "RDX/wax": "comp_a3", "C4": "comp_c4", "Octol 75/25": "octol", "Pentolite": "pentolite", "H6": "h_6",
        "LX14": "lx_14", "ammonium picrate": "explosive_d", "Hexogen": "rdx", "Minol II": "minol_2",
    }.items():  # fmt: skip
        assert substance_key(text) == name, text
    assert substance_key("AISI 1045", "casing") == substance_key("C45", "casing") == "steel_1045"
    assert substance_key("Tetrytol 70/30") == "tetrytol7030"
    assert (substance_title("h6"), substance_title("my mix")) == ("H-6", "my mix")


def test_a_name_of_two_substances_is_a_fault_of_the_files(monkeypatch):
    import fragfield_base.substances as module

    rdx = substance("explosive", "rdx")
    monkeypatch.setattr(module, "substance", lambda _kind, _name: rdx)
    with pytest.raises(ValueError, match="are both called 'RDX'"):
        module.aliases.__wrapped__("explosive")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[jwl]", "[jvl]", r"mine.toml: 'jvl' is unknown; did you mean 'jwl'\?"),
        ("omega = ", "omaga = ", r"mine.toml \[jwl\]: 'omaga' is unknown; did you mean 'omega'\?"),
        (
            'grade = "published"',
            'grade = "sure"',
            r"\[charge\]: grade: found 'sure' \(allowed: published, second hand,",
        ),
        ('grade = "published"', "", r"\[charge\]: grade: found ''"),
        ("R1 = 4.2", 'R1 = "4.2"', r"\[jwl\]: R1: found '4.2'; needed: a number in SI"),
        ("R1 = 4.2", "R1 = nan", r"\[jwl\]: R1: found nan"),
        ("gurney = [2680.0, 2770.0]", "gurney = 2700.0", "gurney: found 2700.0; needed: two numbers in SI"),
        ("gurney = [2680.0, 2770.0]", "gurney = [2770.0, 2680.0]", "two numbers above 0, the smaller first"),
        ("[charge]", "charge = 1\n[chargs]", r"\[charge\]: found 1; a table is needed"),
        ('aliases = ["Comp B"', 'aliases = [1, "Comp B"', r"aliases: found \[1, 'Comp B'"),
    ],
)
def test_a_file_at_fault_is_refused_with_file_and_key(old, new, message):
    assert old in FILE
    with pytest.raises(InputError, match=message):
        read_substance("explosive", tomllib.loads(FILE.replace(old, new, 1)), "mine.toml")


def test_a_group_without_a_source_is_refused():
    content = tomllib.loads(FILE)
    del content["jwl"]["source"]
    with pytest.raises(InputError, match=r"mine.toml \[jwl\]: source is missing"):
        read_substance("explosive", content, "mine.toml")


def test_grades_are_read_off_the_sources():
    one = substance("explosive", "comp_c4")
    text = one.sources("charge", "heat", "jwl", "unreacted")
    assert graded(text) == "Charge memory, Heat recalculated, JWL memory, Unreacted estimate"
    assert graded("a source of the user's own (estimate): x") == ""


def chapman_jouguet(density, constants):
    """Speed (m/s) and pressure (Pa) where the line from the initial state touches the Hugoniot of the products."""
    A, B, R1, R2, omega, E0 = (constants[key] for key in ("A", "B", "R1", "R2", "omega", "E0"))
    V = np.linspace(0.6, 0.9, 60001)
    cold = A * (1 - omega / (R1 * V)) * np.exp(-R1 * V) + B * (1 - omega / (R2 * V)) * np.exp(-R2 * V)
    pressure = (cold + omega * E0 / V) / (1 - omega * (1 - V) / (2 * V))  # with E = E0 + P (1 - V) / 2
    speed = np.sqrt(pressure / (density * (1 - V)))
    at = speed.argmin()
    return speed[at], pressure[at]


@pytest.mark.parametrize("name", substances_with("explosive", "jwl", "A"))
def test_chapman_jouguet_state_of_every_set_is_the_front_of_its_explosive(name):
    one = substance("explosive", name)
    charge = one.groups["charge"].values
    speed, pressure = chapman_jouguet(charge["density"], one.groups["jwl"].values)
    assert speed == pytest.approx(charge["detonation_velocity"], rel=0.01)
    assert pressure == pytest.approx(charge["cj_pressure"], rel=0.03)


def test_recalculated_heats_are_those_of_the_sets():
    for name in substances_with("explosive", "heat", "heat_of_detonation"):
        one = substance("explosive", name)
        if one.groups["heat"].grade == "recalculated":
            work = one.value("jwl", "E0") / one.value("charge", "density")
            assert one.value("heat", "heat_of_detonation") == pytest.approx(work, rel=1e-3), name


def flow_stress(solid, law, strain=0.3, rate=1e4, share=0.9, steps=3000):
    """Johnson and Cook's stress (Pa) at a strain, where a share of the work has heated the metal since 293 K."""
    heated, room = 0.0, 293.0
    for at in (np.arange(steps) + 0.5) * strain / steps:
        softer = 1.0 - (heated / (law["melting_temperature"] - room)) ** law["m"]
        stress = (law["A"] + law["B"] * at ** law["n"]) * (1.0 + law["C"] * math.log(rate)) * softer
        heated += share * stress * strain / steps / (solid["density"] * law["heat_capacity"])
    return stress


@pytest.mark.parametrize("name", [one for one in substances_with("casing", "johnson_cook", "A") if one != "copper"])
def test_shear_strengths_are_half_the_flow_stress_of_johnson_and_cook(name):
    groups = substance("casing", name).groups
    stress = flow_stress(groups["solid"].values, groups["johnson_cook"].values)
    assert groups["strength"].values["shear_strength"] == pytest.approx(0.5 * stress, rel=5e-3)
    assert groups["strength"].values["tensile_strength"] == pytest.approx(stress, rel=5e-3)
