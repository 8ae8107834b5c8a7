"""The case file: schema, round trip, differences."""

from __future__ import annotations

import dataclasses
import shutil
import tomllib
from pathlib import Path

import pytest

from fragfield.case import CaseTable, differences, load_case, read_resolved, to_toml
from fragfield.case.keys import keys_of
from fragfield.case.load import case_from_document
from tests.fragfield.case_documents import CASE, FULL, a_round, changed, write_case

CASES = sorted((Path(__file__).parents[2] / "cases").glob("*.toml"))


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_a_ready_case_written_resolved_and_read_back_is_the_same_case(path, tmp_path):
    case = load_case(path)
    stored = write_case(tmp_path, to_toml(case))
    assert read_resolved(stored) == case
    assert load_case(stored) == case
    assert to_toml(load_case(stored)) == to_toml(case)


def test_a_case_that_uses_every_table_comes_back_the_same(tmp_path):
    case = load_case(write_case(tmp_path, FULL))
    again = load_case(write_case(tmp_path, to_toml(case)))
    assert again == case
    assert differences(case, again) == []


def test_a_resolved_case_spells_everything_out_and_needs_no_other_file(tmp_path):
    shutil.copy(Path(__file__).parents[2] / "burst_fenicsx/data/profiles/tube.toml", tmp_path / "mine.toml")
    (tmp_path / "fill.toml").write_text(
        "[mix]\ndensity = 1500\ndetonation_velocity = 6000\nheat_of_detonation = 4e6\nsound_speed = 2000\n"
    )
    text = '[burst]\ncell_size = "9 mm"\n[[round]]\nname = "a"\ncasing = "copper"\n'
    text += 'profile = "mine.toml"\nexplosive = "fill.toml"\n'
    case = load_case(write_case(tmp_path, text))
    document = tomllib.loads(to_toml(case))
    assert document["burst"]["stop"] == "acceleration"
    assert document["burst"]["leakage"]["radius_ratio"] == 1.75
    assert document["round"][0]["profile"]["outer"]["points"] == [[0, 77.5], [300, 77.5]]
    assert document["round"][0]["explosive"]["density"] == "1500.0 kg/m^3"
    assert document["round"][0]["casing"]["shear_softening_strain"] == "none"
    assert document["round"][0]["ignition"] == [{"station": "0.0 m", "offset": ["0.0 m", "0.0 m"], "delay": "0.0 s"}]
    (tmp_path / "mine.toml").unlink()
    (tmp_path / "fill.toml").unlink()
    assert load_case(write_case(tmp_path, to_toml(case))) == case


def _every_table(model=CaseTable):
    yield model
    for key in keys_of(model):
        for table in key.tables:
            yield from _every_table(table)


def test_a_table_left_empty_is_the_stage_with_its_own_defaults():
    """Words, angles in degrees, "none" and what is left out; of the others the case is shorter than the stage asks."""
    tables = [one for one in _every_table() if one.stage and not any(key.needed for key in keys_of(one))]
    whole = [one for one in tables if all(f.default is not f.default_factory for f in dataclasses.fields(one.stage))]
    assert len(whole) >= 9
    for table in whole:
        assert table().made() == table.stage()


def test_every_key_has_its_words():
    keys = [key for table in _every_table() for key in keys_of(table)]
    assert not [key.path for key in keys if not key.meaning and not key.tables]
    (size,) = (key for key in keys if key.name == "cell_size")
    assert (size.unit, size.example, size.meaning[:34]) == ("m", "6 mm", "Target edge length of the cells; t")
    for key in keys:  # an example is of the dimension of its limits
        if key.quantity is not None and key.quantity.example:
            assert isinstance(key.quantity.parse(key.quantity.example), float)


def test_differences_name_the_keys(tmp_path):
    path = write_case(tmp_path, FULL)
    one, other = load_case(path), load_case(path, {"burst.cell_size": "8 mm"})
    assert differences(one, other) == ['burst.cell_size: stored "0.009 m", now "0.008 m"']
    assert differences(one, other, within=["round", "burst.leakage"]) == []
    changed = load_case(
        write_case(tmp_path, FULL.replace('radius = "25 ft"', 'radius = "24 ft"').replace("seed = 7", "seed = 8"))
    )
    assert [line.split(":")[0] for line in differences(one, changed)] == ["seed", "witness[1].radius"]


# Units in which people write; a default is spelled in those of its dimension.


def test_writing_the_default_angles_down_is_no_other_case(tmp_path):
    """What `--resume` compares."""
    plane = {"name": "deck", "kind": "ground"}
    shorter = changed(plane=[plane], flight={"collisions": {}}, round=[a_round(position=["0 m", "0 m", "1 m"])])
    longer = {
        **shorter,
        "burst": {**CASE["burst"], "contact": {"friction_angle": "20 deg", "surface_friction_angle": "20 deg"}},
        "plane": [{**plane, "friction_angle": "20 deg"}],
        "flight": {"collisions": {"friction_angle": "20 deg"}},
    }
    one, other = (case_from_document(item, source="my.toml", folder=tmp_path) for item in (shorter, longer))
    assert differences(one, other) == []
    assert one == other
