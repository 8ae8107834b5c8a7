"""The run of the application: its commands one after the other, one run at a time, stopped with the application."""

from __future__ import annotations

import time

import pytest

from fragfield.app.document import Session
from fragfield.app.workspace import Workspace
from fragfield.errors import InputError

pytestmark = pytest.mark.cores


def ended(job, seconds=120.0):
    """The job once it has ended."""
    until = time.monotonic() + seconds
    while job.is_live:
        assert time.monotonic() < until, job.words()
        time.sleep(0.1)
    return job


def test_commands_run_one_after_the_other_up_to_the_first_that_fails(tmp_path):
    session = Session(Workspace(tmp_path))
    session.compute("a", "runs/a", [["--version"], ["--version"]])
    with pytest.raises(InputError, match=r"runs/a: is being computed; one run at a time"):
        session.compute("b", "runs/b", [["--version"]])
    first = ended(session.job)
    assert (first.state, first.code) == ("done", 0)
    assert first.words().count("fragfield 0") == 2
    session.compute("b", "runs/b", [["info", "nothing"], ["--version"]])
    second = ended(session.job)
    assert (second.state, second.code, second.run) == ("failed", 2, "runs/b")
    assert "nothing" in second.words()
    assert "fragfield 0" not in second.words()


def test_a_run_is_stopped_with_the_application(tmp_path):
    session = Session(Workspace(tmp_path))
    session.compute("a", "", [["warm-up"], ["--version"]])
    session.job.end()
    assert session.job.state == "stopped"
    assert "fragfield 0" not in session.job.words()
