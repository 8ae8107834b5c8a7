"""A new case file: sound as written, explained by the schema, and never in place of another."""

from __future__ import annotations

import json
import re
import tomllib

import pytest
from typer.testing import CliRunner

from burst_fenicsx.geometry.files import profile_names
from fragfield.case import load_case, plain
from fragfield.case.tables.burst import BurstTable
from fragfield.case.tables.flight import FlightTable
from fragfield.cli import app

STACKS = (None, "row", "triangle", "pallet")
_DEFAULT = re.compile(r"#([a-z_]+ = |\[)")


def _invoke(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def _new(tmp_path, *options):
    done = _invoke("new", tmp_path / "trial", *options)
    assert done.exit_code == 0, done.stderr
    assert done.stdout.strip() == str(tmp_path / "trial.toml")
    return tmp_path / "trial.toml"


@pytest.mark.parametrize("profile", profile_names())
def test_a_new_case_passes_the_check_as_written(profile, tmp_path):
    path = _new(tmp_path, "--round", profile)
    done = _invoke("check", path, "--json")
    assert done.exit_code == 0, done.stderr
    found = json.loads(done.stdout)
    assert len(found["rounds"]) == 1
    assert found["case"]["hazard"]["density"] == pytest.approx(1 / 55.7)


@pytest.mark.parametrize(("stack", "rounds"), [("row", 2), ("triangle", 3), ("pallet", 4)])
def test_a_new_stack_has_its_rounds(stack, rounds, tmp_path):
    path = _new(tmp_path, "--stack", stack, "--explosive", "comp_b")
    done = _invoke("check", path, "--cell-size", "12 mm", "--json")
    assert done.exit_code == 0, done.stderr
    found = json.loads(done.stdout)
    assert len(found["rounds"]) == rounds
    assert found["arrangement"]["min_clearance"]["clearance"] == pytest.approx(0.0217, abs=1e-6)
    assert {entry["explosive"]["name"] for entry in found["case"]["round"]} == {"comp_b"}


@pytest.mark.parametrize("stack", STACKS)
def test_a_lying_round_lies_on_the_ground(stack, tmp_path):
    """Its axis is horizontal, its lowest line touches z = 0, and copies lie side by side."""
    path = _new(tmp_path, "--lying", *(["--stack", stack] if stack else []))
    done = _invoke("check", path, "--cell-size", "12 mm", "--json")
    assert done.exit_code == 0, done.stderr
    found = json.loads(done.stdout)
    rounds = found["arrangement"]["rounds"]
    radius, length = (0.5 * found["rounds"][0]["outer_diameter"], found["rounds"][0]["length"])
    assert all(one["axis"] == [0.0, 1.0, 0.0] for one in rounds)
    assert min(one["position"][2] for one in rounds) == pytest.approx(radius, abs=1e-3)
    assert min(one["position"][2] for one in rounds) >= radius
    if stack is None:
        assert rounds[0]["position"][1] == pytest.approx(-0.5 * length)
    else:
        assert found["arrangement"]["min_clearance"]["clearance"] == pytest.approx(0.0217, abs=1e-6)


@pytest.mark.parametrize("stack", STACKS)
def test_every_default_that_is_shown_is_the_default(stack, tmp_path):
    """With every # before a default taken away the case is the same."""
    options = ["--all", *(["--stack", stack] if stack else [])]
    path = _new(tmp_path, *options)
    text = path.read_text()
    opened = path.with_name("opened.toml")
    opened.write_text("\n".join(_opened(text.splitlines())))
    bare, full = (_flat(plain(load_case(one))) for one in (path, opened))
    assert bare.keys() == full.keys()
    for key, value in bare.items():
        assert full[key] == (pytest.approx(value, rel=1e-9) if isinstance(value, float) else value), key
    assert len(_keys(tomllib.loads(opened.read_text()))) > len(_keys(tomllib.loads(text))) + 60


def _opened(lines):
    """Lines with defaults set; examples of what is left out by default stay behind their #."""
    words = ""
    for line in lines:
        yield line[1:] if _DEFAULT.match(line) and not words.endswith("for example:") else line
        words = words + line[1:] if line.startswith("# ") else ""


def _keys(value):
    return list(_flat(value))


def _flat(value, path=""):
    if isinstance(value, dict):
        return {key: entry for name, part in value.items() for key, entry in _flat(part, f"{path}.{name}").items()}
    if isinstance(value, list):
        return {key: entry for n, part in enumerate(value) for key, entry in _flat(part, f"{path}.{n}").items()}
    return {path: value}


def test_comments_are_those_of_the_schema(tmp_path):
    text = _new(tmp_path, "--all").read_text().replace("\n# ", " ")
    for table in (BurstTable, FlightTable):
        for name, field in table.model_fields.items():
            if field.description:
                assert " ".join(field.description.split()) in text, name
    assert 'One of "landau", "landau_cj", "jwl".' in text


def test_a_file_that_is_there_stays(tmp_path):
    path = _new(tmp_path)
    path.write_text("mine")
    done = _invoke("new", path)
    assert done.exit_code == 2
    assert f"{path}: is there already; nothing was written" in done.stderr
    assert path.read_text() == "mine"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--round", "m170"), '--round: found "m170" (did you mean "m107"?); allowed: copper_cylinder, generic_heavy'),
        (("--stack", "palet"), '--stack: found "palet" (did you mean "pallet"?); allowed: row, triangle, pallet'),
        (("--explosive", "comp_a"), '--explosive: found "comp_a" (did you mean "comp_a3"?); allowed: anfo, comp_a3,'),
        (("--explosive", "hmx"), '--explosive: found "hmx"; allowed: anfo, comp_a3,'),  # no data for the burst
        (("--casing", "brass"), '--casing: found "brass"; allowed: al_6061_t6, cast_iron_ductile,'),
    ],
)
def test_an_unknown_name_is_refused_and_nothing_is_written(options, message, tmp_path):
    done = _invoke("new", tmp_path / "trial", *options)
    assert done.exit_code == 2
    assert message in done.stderr
    assert not list(tmp_path.iterdir())


def test_the_casing_is_that_of_the_round(tmp_path):
    assert 'casing = "steel_m107"' in _new(tmp_path).read_text()
    (tmp_path / "trial.toml").unlink()
    assert 'casing = "copper"' in _new(tmp_path, "--round", "copper_cylinder").read_text()
