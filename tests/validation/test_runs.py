"""How the studies make their runs, what they vary, and what they say of it."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest

from fragfield.case import load_case
from fragfield.files.run_directory import RunDirectory
from tests.validation.rings import ring
from validation.__main__ import main
from validation.paper_3_2 import scaling, sensitivities
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


class FakeRuns:
    """Runs that are remembered, not made; their names stand for their directories."""

    def __init__(self, folder):
        self.folder, self.made = folder, []

    def run(self, name, case, size, changes=None, *, stage="run", geometry="3d"):
        """Remember what is asked for."""
        self.made.append((name, case, size, dict(changes or {})))
        if name == "paper_3_2_mirrored_friction_40":
            raise StudyError("stopped", 3)
        return Path(name)


def burst(error=0.004):
    return {"burst": {"energy_error_at_outputs": error, "lost_cells": 0, "cell_size": 6e-3}}


def test_sensitivities_run_the_twin_only_where_the_round_changes(tmp_path, monkeypatch, capsys):
    def ensemble(folder, rounds, *, seed, realisations):
        single = "single" in folder.name
        assert rounds == (1 if single else 2)
        assert seed == (2 if single else 1)
        share = 2.5 if "leakage_1_6" in folder.name else 2.0
        fragments = 1000 if single else 2000
        return ring(seed, fragments, share=1.0 if single else share, realisations=20)

    fake = FakeRuns(tmp_path)
    monkeypatch.setattr(sensitivities, "ring_ensemble_of_run", ensemble)
    monkeypatch.setattr(
        sensitivities, "summary_of", lambda f: burst(0.02 if f.name.endswith("mirrored_friction_0") else 0.004)
    )
    monkeypatch.setattr("validation.__main__.Runs", lambda *_, **__: fake)
    code = main(["paper_3_2", "--sensitivities", "--realisations", "20", "--json"])
    rows = json.loads(capsys.readouterr().out)
    names = [name for name, *_ in fake.made]
    assert names.count("paper_3_2_single_base") == 1
    assert sum("_single_" in name for name in names) == 1 + 2 + 2 + 2 + 2  # base, leakage, charge, softening, cells
    assert sum("_mirrored_" in name for name in names) == len(sensitivities.VARIATIONS)
    sizes = {name.removeprefix("paper_3_2_"): size for name, _, size, _ in fake.made}
    assert (sizes["single_cells_4"], sizes["mirrored_cells_8"], sizes["mirrored_gap_half"]) == ("4 mm", "8 mm", "6 mm")
    changes = {name.removeprefix("paper_3_2_"): given for name, _, _, given in fake.made}
    assert changes["single_leakage_1_6"] == changes["mirrored_leakage_1_6"] == {"burst.leakage.radius_ratio": 1.6}
    found = {row["quantity"].split(" (")[0]: row for row in rows}
    leaking = found["leakage radius 1.6: number ratio within 10 deg"]
    assert leaking["ours"] == pytest.approx(5.0, rel=0.03)
    assert leaking["reference"] == pytest.approx(4.0, rel=0.03)
    assert code == 1  # one ledger is open: void, not compared
    assert [row["quantity"] for row in rows if row["passed"] is False] == [
        "friction of casings 0 degrees: energy error, or 0 lost cells",
        "friction of casings 40 degrees: bursts that stopped",
    ]
    table = (tmp_path / "paper_3_2_sensitivities.md").read_text(encoding="utf-8")
    assert table.startswith("| varied, at 6 mm where nothing else is said | number ratio within 10° |")
    assert "friction of casings 0 degrees (ledger open, void)" in table
    assert "| friction of casings 40 degrees (the burst stopped) | - | - | - | - |" in table
    assert len(table.splitlines()) == 2 + len(sensitivities.VARIATIONS)
    stored = json.loads((tmp_path / "paper_3_2_sensitivities.json").read_text(encoding="utf-8"))
    assert stored[1]["variation"] == "leakage_1_6"
    assert stored[1]["number_ratio_10_deg"] == pytest.approx(leaking["ours"])


def _stack(rounds, seconds, memory):
    return {
        "burst": {
            "rounds": [{}] * rounds, "threads": 2, "ranks": 1, "cells": 1000 * rounds, "steps": 500,
            "cell_steps": 500_000 * rounds, "wall_seconds": seconds, "peak_memory_bytes": memory,
        }
    }  # fmt: skip


def test_scaling_misses_what_grows_beyond_fifteen_per_cent():
    summaries = {
        "single": _stack(1, 10.0, 3.0e8),
        "pair": _stack(2, 22.0, 3.2e8),
        "row": _stack(4, 47.0, 3.6e8),
        "pallet": _stack(8, 80.0, 5.2e8),
    }
    rows = {row.quantity: row for row in scaling.rows(summaries)}
    row = rows["row of 4: wall time a round over the single round's"]
    assert row.ours == pytest.approx(1.175)
    assert row.passed is False
    assert rows["row of 4: core time a cell and step over the single round's"].ours == pytest.approx(1.175)
    assert rows["pair of 2: wall time a round over the single round's"].passed is True
    assert rows["pallet of 8: peak memory a round over the single round's"].ours == pytest.approx(5.2 / 8 / 3.0)
    further = "memory of a further round over that of the pair's second"
    assert rows[f"row: {further}"].ours == pytest.approx(1.0)
    assert rows[f"row: {further}"].passed is True
    assert rows[f"pallet: {further}"].ours == pytest.approx(2.0)
    assert rows[f"pallet: {further}"].passed is False
    line = "| pallet | 8 | 1000 | 500 | 10.0 s (1.00) | 40.00 us (1.00) | 65 MB (0.22) | 40.0 MB |"
    assert line in scaling.table(summaries)


def test_scaling_compiles_before_it_measures(tmp_path, monkeypatch, capsys):
    fake = FakeRuns(tmp_path)
    rounds = {"single": 1, "pair": 2, "row": 4, "pallet": 8}
    monkeypatch.setattr(
        scaling, "summary_of", lambda f: _stack(rounds[f.name.split("_")[-1]], 1.0 * rounds[f.name.split("_")[-1]], 3e8)
    )
    monkeypatch.setattr("validation.__main__.Runs", lambda *_, **__: fake)
    assert main(["paper_3_2", "--scaling", "--json"]) == 0
    names = [name.removeprefix("paper_3_2_scaling_") for name, *_ in fake.made]
    assert names == ["warm_up", "single", "pair", "row", "pallet"]
    assert {size for _, _, size, _ in fake.made[1:]} == {"8 mm"}
    assert len(json.loads(capsys.readouterr().out)) == 11
