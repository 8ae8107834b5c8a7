"""Jobs: one after the other, ended as their commands end, and recorded without a page that looks."""

from __future__ import annotations

import os
import signal
import time

import pytest

from fragfield.app.jobs import alive, cancel, jobs_of, read_job, start_job
from fragfield.app.workspace import Workspace

pytestmark = pytest.mark.cores


def ended(job, seconds=120.0):
    """The job once it has ended."""
    until = time.monotonic() + seconds
    while (now := read_job(job.file)) is None or now.is_live:
        assert time.monotonic() < until, now
        time.sleep(0.2)
    return now


def test_commands_run_one_job_after_the_other(tmp_path):
    space = Workspace(tmp_path)
    good = start_job(space, title="a", case="", run="", commands=[["--version"], ["--version"]])
    bad = start_job(space, title="b", case="", run="", commands=[["info", "nothing"], ["--version"]])
    first, second = ended(good), ended(bad)
    assert (first.state, first.code) == ("done", 0)
    assert first.words().count("fragfield 0") == 2
    assert (second.state, second.code) == ("failed", 2)
    assert "nothing" in second.words()
    assert "fragfield 0" not in second.words()
    assert second.ended >= first.ended
    assert [job.title for job in jobs_of(space)] == ["b", "a"]


def test_a_waiting_job_is_stopped_and_a_killed_one_is_known_to_have_failed(tmp_path):
    space = Workspace(tmp_path)
    first = start_job(space, title="a", case="", run="", commands=[["warm-up"]])
    second = start_job(space, title="b", case="", run="", commands=[["--version"]])
    until = time.monotonic() + 60.0
    while not (alive(now := read_job(second.file)) and read_job(first.file).state == "running"):
        assert time.monotonic() < until
        time.sleep(0.2)
    cancel(now)
    assert ended(second).state == "stopped"
    killed = read_job(first.file)
    os.killpg(killed.process, signal.SIGKILL)
    assert ended(first).state == "failed"


def test_what_is_no_job_is_no_job(tmp_path):
    space = Workspace(tmp_path)
    for number, text in enumerate(("", "[]", "{", '{"title": 1}')):
        space.state(f"jobs/{number}.json").write_text(text, encoding="utf-8")
    assert jobs_of(space) == []
