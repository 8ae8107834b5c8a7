"""How the studies make their runs, and what they vary."""

from __future__ import annotations

from pathlib import Path

import pytest

from fragfield.case import load_case
from fragfield.files.run_directory import RunDirectory
from validation.runs import ROOT, Runs, StudyError, changed_case

CASE = "cases/m107_pair.toml"


@pytest.fixture
def calls(monkeypatch):
    """Commands in place of runs, which leave a summary and end with the code next in line, 0 without one."""
    made, codes = [], []

    def call(command):
        made.append(command)
        out = Path(command[command.index("--out") + 1])
        out.mkdir(exist_ok=True)
        RunDirectory(out).write_summary({"burst": {"number": len(made)}})
        return codes.pop(0) if codes else 0

    monkeypatch.setattr(Runs, "_call", staticmethod(call))
    return made, codes


def test_runs_are_made_again_or_gone_on_with(tmp_path, calls):
    made, codes = calls
    runs = Runs(tmp_path)
    folder = runs.run("pair", CASE, "8 mm")
    assert folder == tmp_path / "pair_8_mm"
    assert made[-1][3:] == ["run", str(tmp_path / "pair_8_mm.toml"), "--set", "burst.cell_size=8 mm", "--out",
                            str(folder), "--overwrite"]  # fmt: skip
    assert load_case(tmp_path / "pair_8_mm.toml").burst.geometry == "3d"  # whatever the case leaves to choose
    assert runs.bursts == [("pair_8_mm", {"number": 1})]
    _, burst = runs.burst("single", "cases/m107_tnt.toml", "8 mm")
    assert burst == {"number": 2}
    assert load_case(tmp_path / "single_8_mm.toml").burst.geometry == "axisymmetric"
    resumed = Runs(tmp_path, resume=True, threads=2, ranks=2)
    resumed.run("other", CASE, "8 mm")
    assert (made[-1][:3], made[-1][-1]) == (["mpirun", "-n", "2"], "--overwrite")  # there is nothing to continue
    codes += [2, 0]  # of another case: made again
    resumed.run("other", CASE, "8 mm")
    assert [command[-1] for command in made[-2:]] == ["--resume", "--overwrite"]
    assert made[-1][-3:] == ["--threads", "2", "--overwrite"]
    codes += [3]
    with pytest.raises(StudyError, match="other at 8 mm ended with exit code 3") as caught:
        resumed.run("other", CASE, "8 mm")
    assert caught.value.code == 3
    assert made[-1][-1] == "--resume"  # a numerical stop is not tried again


def test_a_finished_run_of_the_same_case_is_kept_and_one_of_an_earlier_version_made_again(tmp_path, calls):
    made, _ = calls
    runs = Runs(tmp_path, resume=True)
    folder = runs.directory("pair", "8 mm")
    folder.mkdir()
    file = tmp_path / "stored.toml"
    file.write_text(changed_case(ROOT / CASE, {"burst.geometry": "3d"}), encoding="utf-8")
    RunDirectory(folder).write_case(load_case(file, {"burst.cell_size": "8 mm"}))
    RunDirectory(folder).write_summary({"burst": {}})
    (folder / "burst_snapshot.h5").touch()
    assert runs.run("pair", CASE, "8 mm", stage="burst") == folder
    assert not made
    runs.run("pair", CASE, "8 mm")  # the later stages are missing
    assert (made[-1][3], made[-1][-1]) == ("run", "--resume")
    runs.run("pair", CASE, "8 mm", {"burst.leakage.radius_ratio": 2.1}, stage="burst")  # of another case
    assert len(made) == 2
    (folder / "case.toml").write_text("key_of_an_earlier_version = 1\n", encoding="utf-8")
    runs.run("pair", CASE, "8 mm", stage="burst")
    assert len(made) == 3
