"""When a run directory may be written, and what is removed from it."""

from __future__ import annotations

import json
import logging
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fragfield.case import load_case
from fragfield.case.write import plain
from fragfield.errors import InputError
from fragfield.files.run_directory import STAGES, RunDirectory
from fragfield.pipeline.job import Job, RunOptions
from fragfield.pipeline.parallel import Team
from fragfield.pipeline.stages import heard
from fragfield.results.burst import Burst
from fragfield.results.flight import Flight
from fragfield.results.summary import Summary, Warned
from fragfield.terminal.logs import logged
from fragfield.terminal.progress import ProgressReporter
from fragfield_base.writing import locked
from tests.fragfield.example_results import example

TUBE = Path(__file__).parents[2] / "cases" / "tube.toml"


@pytest.fixture(scope="module")
def case():
    return load_case(TUBE)


@pytest.fixture(scope="module")
def other():
    return load_case(TUBE, {"burst.cell_size": "9 mm"})


def _complete(run, *names):
    for name in names:
        for file in STAGES[name].files:
            run.file(file).write_text("old")
        run.write_summary({**run.summary(), **{part: {"from": name} for part in STAGES[name].parts}})


def test_a_summary_in_another_folder_has_the_parts_of_the_stages_before(case, tmp_path):
    source, target = RunDirectory(tmp_path / "source"), RunDirectory(tmp_path / "target")
    for one in (source, target):
        one.claim(case)
    burst = example(Burst, cells=3)
    source.write_results(Summary(burst=burst))
    job = Job(case, source, target, Team(), ProgressReporter(enabled=False), RunOptions(target.path))
    job.note(STAGES["fly"], Summary(flight=example(Flight, landed=7)), [example(Warned, code="certainty")])
    found = target.results()
    assert found.burst == burst
    assert found.flight.landed == 7
    assert [one.code for one in found.findings] == ["certainty"]


@pytest.mark.parametrize(
    ("before", "stage", "warned", "after"),
    [
        ([], "fly", False, []),
        (["burst", "fly"], "fly", False, ["burst"]),
        (["burst"], "fly", True, ["burst", "fly"]),
        (["report"], "report", False, []),
    ],
)
def test_warnings_of_a_stage_replace_its_earlier_ones(case, tmp_path, before, stage, warned, after):
    run = RunDirectory(tmp_path)
    run.claim(case)
    run.write_results(Summary(findings=tuple(example(Warned, stage=one) for one in before)))
    with heard(stage) as records:
        if warned:
            logging.getLogger("fragfield").warning("doubtful", extra={"code": "mine"})
    job = Job(case, run, run, Team(), ProgressReporter(enabled=False), RunOptions(run.path))
    job.note(STAGES[stage], Summary(), records.found)
    assert [one.stage for one in run.results().findings] == after
    assert [one.code for one in records.found] == (["mine"] if warned else [])


def test_a_report_without_warnings_leaves_the_summary_as_it_is(case, tmp_path):
    run = RunDirectory(tmp_path)
    run.claim(case)
    Job(case, run, run, Team(), ProgressReporter(enabled=False), RunOptions(run.path)).note(
        STAGES["report"], Summary(), []
    )
    assert not run.summary_file.exists()


def test_results_of_the_same_case_are_kept_unless_they_may_be_replaced(case, tmp_path):
    run = RunDirectory(tmp_path)
    run.claim(case)
    run.claim(case)  # nothing has been computed yet
    _complete(run, "burst", "break-up")
    with pytest.raises(InputError, match=r"holds checkpoint.h5 and 9 more results, .* --resume .* --overwrite"):
        run.claim(case)
    assert run.complete(STAGES["break-up"])
    run.claim(case, overwrite=True)
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
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case.toml", "notes.txt"]


def test_a_folder_with_other_things_is_refused(case, tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(InputError, match=r"holds thesis.tex, which is not a run of this program"):
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
    assert run.summary() == {"a": 1.5, "b": [0, 1, 2], "c": 2}
    stored = json.loads(run.summary_file.read_text())
    assert set(stored) == {"a", "b", "c", "checksum"}
    run.summary_file.write_text(json.dumps({**stored, "a": 1.6}))
    with pytest.raises(InputError, match=r"summary.json: damaged or edited \(its checksum does not fit\)"):
        run.summary()
    run.summary_file.write_text(json.dumps({"a": 1.5}))  # of an earlier version
    assert run.summary() == {"a": 1.5}
    run.summary_file.write_text('{"a": 1')
    with pytest.raises(InputError, match=r"summary.json: damaged"):
        run.summary()


@pytest.mark.parametrize("cut", [0.0, 0.3, 0.6, 0.8])
def test_a_case_that_is_empty_or_cut_is_refused(case, tmp_path, cut):
    run = RunDirectory(tmp_path)
    run.claim(case)
    whole = run.case_file.read_text()
    run.case_file.write_text(whole[: int(cut * len(whole))])
    with pytest.raises(InputError, match=r"case.toml: empty, cut off, or not written by this program"):
        run.stored_case()
    run.write_summary({"case": plain(case)})
    with pytest.raises(InputError, match=r"case.toml: "):
        run.stored_case()
    run.claim(case, overwrite=True)
    assert run.stored_case() == case


def test_an_edited_case_is_refused(case, tmp_path):
    run = RunDirectory(tmp_path)
    run.claim(case)
    text = run.case_file.read_text()
    run.case_file.write_text(text.replace('"0.006 m"', '"0.005 m"'))
    with pytest.raises(InputError, match=r"case.toml: was edited or damaged .* a case file of its own"):
        run.stored_case()
    unstamped = "".join(line for line in text.splitlines(keepends=True) if "checksum" not in line)
    run.case_file.write_text(unstamped)
    with pytest.raises(InputError, match=r"its last line, the checksum, is missing"):
        run.stored_case()


def test_results_without_their_case_are_not_deleted(case, tmp_path):
    (tmp_path / "landing.h5").write_text("weeks of work")
    with pytest.raises(InputError, match=r"holds landing.h5, which this would delete"):
        RunDirectory(tmp_path).claim(case)
    with pytest.raises(InputError, match=r"holds landing.h5, .* but no case.toml"):
        RunDirectory(tmp_path).enter(case, STAGES["fly"])
    assert (tmp_path / "landing.h5").read_text() == "weeks of work"


def test_links_under_names_of_ours_are_not_followed(case, tmp_path):
    (tmp_path / "precious").write_text("keep me")
    run = RunDirectory(tmp_path / "run")
    run.make()
    for name in ("case.toml.part", "run.log"):
        link = run.file(name)
        link.symlink_to(tmp_path / "precious")
        with pytest.raises(InputError, match=rf"{name}: is a symbolic link"):  # noqa: PT012
            run.claim(case)
            with logged(run.log_file, fresh=True):
                pass
        link.unlink()
    assert (tmp_path / "precious").read_text() == "keep me"


def test_a_second_writer_is_refused_until_the_first_one_is_gone_however_it_went(tmp_path):
    code = (
        "import sys, time; from pathlib import Path; from fragfield_base.writing import locked\n"
        "with locked(Path(sys.argv[1]), ValueError):\n    print('in', flush=True); time.sleep(60)\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(TUBE.parents[1])}
    holder = subprocess.Popen([sys.executable, "-c", code, str(tmp_path)], stdout=subprocess.PIPE, env=environment)
    assert holder.stdout.readline() == b"in\n"
    with pytest.raises(InputError, match=r"another command is writing into it; wait"), locked(tmp_path, InputError):
        pass
    holder.kill()
    holder.wait()
    with locked(tmp_path, InputError):
        pass
    assert list(tmp_path.iterdir()) == []
