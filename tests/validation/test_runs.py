"""How the studies make their runs, what they vary, and what they say of it."""

from __future__ import annotations

import tomllib

import pytest

from fragfield.case import load_case
from fragfield.files.run_directory import RunDirectory
from validation.__main__ import main
from validation.paper_3_2 import sensitivities
from validation.paper_3_2.check import REFERENCE
from validation.runs import ROOT, Runs, StudyError, changed_case

MIRRORED = ROOT / REFERENCE["mirrored"]


@pytest.mark.parametrize("name", ["single", "pair", "mirrored", "row", "pallet"])
def test_the_cases_of_the_study_exist(name):
    assert (ROOT / REFERENCE[name]).is_file()


@pytest.mark.parametrize("variation", sensitivities.VARIATIONS, ids=lambda variation: variation.name)
def test_a_variation_changes_what_it_names_and_nothing_else(variation):
    base = tomllib.loads(changed_case(MIRRORED, {}))
    changed = tomllib.loads(changed_case(MIRRORED, variation.changes))
    keys = set(_differing(base, changed))
    assert keys == set(_spelt_out(variation.changes))
    assert bool(keys) == (variation.name not in ("base", "cells_8", "cells_4"))


def _spelt_out(changes):
    return [key.replace(".*.", ".0.") for key in changes]


def _differing(one, other, path=""):
    if isinstance(one, dict) and isinstance(other, dict):
        for key in one.keys() | other.keys():
            yield from _differing(one.get(key), other.get(key), f"{path}.{key}" if path else key)
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for number, (first, second) in enumerate(zip(one, other, strict=True)):
            yield from _differing(first, second, f"{path}.{number}")
    elif one != other:
        yield path


@pytest.mark.parametrize(("name", "gap"), [("base", 0.0217), ("gap_half", 0.01085), ("gap_double", 0.0434)])
def test_the_gap_is_that_named(name, gap):
    variation = next(variation for variation in sensitivities.VARIATIONS if variation.name == name)
    place = tomllib.loads(changed_case(MIRRORED, variation.changes))["round"][0]["position"][0]
    assert 2.0 * float(place.split()[0]) - 0.155 == pytest.approx(gap, abs=1e-9)


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("burst.leakage.radius", r'burst.leakage.radius: unknown key \(did you mean "radius_ratio"\?\)'),
        ("round.3.name", "round.3.name: there is no entry 3"),
        ("seed.first", "seed.first: seed holds a value, it has no first"),
    ],
)
def test_a_key_that_no_case_has_is_refused(key, message):
    with pytest.raises(StudyError, match=message):
        changed_case(MIRRORED, {key: 1})


@pytest.fixture
def calls(monkeypatch):
    """Commands in place of runs; each ends with the code next in line, 0 without one."""
    made, codes = [], []

    def call(command):
        made.append(command)
        return codes.pop(0) if codes else 0

    monkeypatch.setattr(Runs, "_call", staticmethod(call))
    return made, codes


def test_runs_are_made_again_or_gone_on_with(tmp_path, calls):
    made, codes = calls
    folder = Runs(tmp_path).run("pair", REFERENCE["pair"], "8 mm")
    assert folder == tmp_path / "pair_8_mm"
    assert made[-1][3:] == ["run", str(tmp_path / "pair_8_mm.toml"), "--cell-size", "8 mm", "--out", str(folder),
                            "--overwrite"]  # fmt: skip
    assert load_case(tmp_path / "pair_8_mm.toml").burst.geometry == "3d"  # whatever the case leaves to choose
    Runs(tmp_path).run("single", REFERENCE["single"], "8 mm", stage="burst", geometry="axisymmetric")
    assert load_case(tmp_path / "single_8_mm.toml").burst.geometry == "axisymmetric"
    resumed = Runs(tmp_path, resume=True, threads=2, ranks=2)
    resumed.run("pair", REFERENCE["pair"], "8 mm")
    assert made[-1][:3] == ["mpirun", "-n", "2"]
    assert made[-1][-1] == "--overwrite"  # there is nothing to continue
    folder.mkdir()
    resumed.run("pair", REFERENCE["pair"], "8 mm")
    assert made[-1][-3:] == ["--threads", "2", "--resume"]
    codes += [2, 0]  # of another case: made again
    resumed.run("pair", REFERENCE["pair"], "8 mm")
    assert [command[-1] for command in made[-2:]] == ["--resume", "--overwrite"]
    codes += [3]
    with pytest.raises(StudyError, match="pair at 8 mm ended with exit code 3") as caught:
        resumed.run("pair", REFERENCE["pair"], "8 mm")
    assert caught.value.code == 3
    assert made[-1][-1] == "--resume"  # a numerical stop is not tried again


def test_a_finished_run_of_the_same_case_is_kept(tmp_path, calls):
    made, _ = calls
    runs = Runs(tmp_path, resume=True)
    folder = runs.directory("pair", "8 mm")
    folder.mkdir()
    file = tmp_path / "stored.toml"
    file.write_text(changed_case(ROOT / REFERENCE["pair"], {"burst.geometry": "3d"}), encoding="utf-8")
    RunDirectory(folder).write_case(load_case(file, cell_size="8 mm"))
    RunDirectory(folder).write_summary({"burst": {}})
    (folder / "burst_snapshot.h5").touch()
    assert runs.run("pair", REFERENCE["pair"], "8 mm", stage="burst") == folder
    assert not made
    runs.run("pair", REFERENCE["pair"], "8 mm")  # the later stages are missing
    assert (made[-1][3], made[-1][-1]) == ("run", "--resume")
    other = {"burst.leakage.radius_ratio": 2.1}
    runs.run("pair", REFERENCE["pair"], "8 mm", other, stage="burst")  # of another case
    assert len(made) == 2
    Runs(tmp_path).run("pair", REFERENCE["pair"], "8 mm", stage="burst")
    assert made[-1][-1] == "--overwrite"


def test_a_failed_run_ends_the_validation_with_its_code(tmp_path, calls, capsys, monkeypatch):
    calls[1].append(3)
    monkeypatch.setattr("validation.__main__.Runs", lambda *_, **__: Runs(tmp_path))
    assert main(["paper_3_2", "--quick"]) == 3
    assert "paper_3_2_single at 8 mm ended with exit code 3" in capsys.readouterr().err
