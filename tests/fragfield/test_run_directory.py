"""When a run directory may be written, and what is removed from it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fragfield.case import load_case
from fragfield.errors import InputError
from fragfield.run_directory import STAGES, RunDirectory

TUBE = Path(__file__).parents[2] / "cases" / "tube.toml"


@pytest.fixture(scope="module")
def case():
    return load_case(TUBE)


@pytest.fixture(scope="module")
def other():
    return load_case(TUBE, cell_size="9 mm")


def _complete(run, *names):
    for name in names:
        for file in STAGES[name].files:
            run.file(file).write_text("old")
        run.write_summary({**run.summary(), **{part: {"from": name} for part in STAGES[name].parts}})


def test_a_new_directory_is_made_with_the_resolved_case(case, tmp_path):
    run = RunDirectory(tmp_path / "a" / "b")
    run.claim(case)
    assert run.stored_case() == case


def test_the_same_case_is_run_again_in_place(case, tmp_path):
    run = RunDirectory(tmp_path)
    run.claim(case)
    _complete(run, "burst", "break-up")
    run.claim(case)
    assert not run.complete(STAGES["burst"])
    assert run.summary() == {}
    assert [path.name for path in tmp_path.iterdir() if path.suffix == ".h5"] == []


def test_another_case_is_refused_with_the_keys_that_differ(case, other, tmp_path):
    run = RunDirectory(tmp_path)
    run.claim(case)
    _complete(run, "burst")
    for options in ({}, {"resume": True}, {"resume": True, "overwrite": True}):
        with pytest.raises(
            InputError, match=r"another case.*\n  burst.cell_size: stored \"0.006 m\", now \"0.009 m\"$"
        ):
            run.claim(other, **options)
    assert run.complete(STAGES["burst"]), "a refusal touches nothing"
    assert run.stored_case() == case


def test_overwrite_replaces_the_other_run_and_nothing_else(case, other, tmp_path):
    run = RunDirectory(tmp_path)
    run.claim(case)
    _complete(run, "burst", "fly")
    (tmp_path / "notes.txt").write_text("mine")
    run.claim(other, overwrite=True)
    assert run.stored_case() == other
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case.toml", "notes.txt", "summary.json"]


def test_resume_keeps_what_is_there(case, tmp_path):
    run = RunDirectory(tmp_path)
    run.claim(case)
    _complete(run, "burst", "break-up")
    run.claim(case, resume=True)
    assert [stage.name for stage in STAGES.values() if run.complete(stage)] == ["burst", "break-up"]


def test_a_folder_with_other_things_is_refused(case, tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(InputError, match=r"holds thesis.tex, which is no run"):
        RunDirectory(tmp_path).claim(case, overwrite=True)


def test_a_stage_refuses_a_case_whose_earlier_stages_differ(case, other, tmp_path):
    run = RunDirectory(tmp_path)
    run.claim(case)
    _complete(run, "burst", "break-up", "fly")
    with pytest.raises(InputError, match=r"burst_snapshot.h5 does not belong to this case"):
        run.enter(other, STAGES["break-up"])
    assert run.complete(STAGES["fly"])


def test_a_stage_done_again_removes_what_later_stages_made_of_it(case, tmp_path):
    run = RunDirectory(tmp_path)
    run.claim(case)
    _complete(run, "burst", "break-up", "fly", "report")
    changed = case.model_copy(update={"seed": 2})
    run.enter(changed, STAGES["break-up"])
    assert run.complete(STAGES["burst"])
    assert set(run.summary()) == {"burst"}
    assert not any(run.file(name).exists() for name in ("fragments.h5", "landing.h5", "report.html"))
    assert run.stored_case().seed == 2


def test_a_summary_is_plain_json(case, tmp_path):
    run = RunDirectory(tmp_path)
    run.claim(case)
    run.write_summary({"a": np.float64(1.5), "b": np.arange(3), "c": np.int32(2)})
    assert json.loads(run.summary_file.read_text()) == {"a": 1.5, "b": [0, 1, 2], "c": 2}
    run.summary_file.write_text('{"a": 1')
    with pytest.raises(InputError, match=r"summary.json: damaged"):
        run.summary()
