"""Progress and messages on stderr: on a terminal only, closed whatever happens."""

from __future__ import annotations

import logging
import sys
import time
import warnings
from types import SimpleNamespace

import pytest

from fragfield.terminal.logs import logged, to_stderr
from fragfield.terminal.progress import COMPILING, ProgressReporter

BURST = SimpleNamespace(
    time=30e-6, end_time=120e-6, step=250, steps_per_second=40.0, cell_steps_per_second=1.4e6, time_step=1e-7,
    seconds_left=200.0,
)  # fmt: skip


def _as_terminal(monkeypatch):
    """Make the stderr of this moment a terminal (a fixture would see another one)."""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "160")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)


@pytest.mark.parametrize(("terminal", "enabled"), [(False, True), (True, False)])
def test_no_terminal_other_ranks_and_quiet_runs_show_nothing(monkeypatch, capsys, terminal, enabled):
    if terminal:
        _as_terminal(monkeypatch)
    with ProgressReporter(enabled=enabled) as reporter:
        reporter.stage("burst")
        reporter.burst(BURST)
    assert capsys.readouterr() == ("", "")


def test_a_terminal_shows_stage_time_step_rate_and_time_left(monkeypatch, capsys):
    _as_terminal(monkeypatch)
    with ProgressReporter(enabled=True) as reporter:
        now = [0.0]
        reporter._bars.get_time = lambda: now[0]
        reporter.stage("burst")
        reporter.burst(SimpleNamespace(**{**vars(BURST), "time": 29.1e-6}))
        now[0] = 2.0
        reporter.burst(BURST)  # 0.9 us in 2 s, 90 us left
        assert reporter._shown.seconds_left == pytest.approx(200.0, abs=1.0)
        time.sleep(0.4)  # the line is drawn four times a second
        reporter.stage("fly")
        reporter.flight(SimpleNamespace(done=500, total=2000, wall_seconds=0.5, seconds_left=1.5))
        time.sleep(0.4)
        reporter.stage("report")
    shown = capsys.readouterr()
    assert shown.out == ""
    for part in ("30.00 of 120 us", "step 250", "1.40 M cell-steps/s", "3 min 20 s left", "500 of 2000 fragments"):
        assert part in shown.err
    assert "\x1b[?25h" in shown.err, "the cursor is shown again"


@pytest.mark.parametrize(
    ("expected", "share", "words"), [(150e-6, 0.2, "30.00 of about 150 us"), (None, 0.0, "30.00 us   step")]
)
def test_until_an_end_is_foreseen_the_burst_counts_to_the_expected_one(expected, share, words):
    found = []
    with ProgressReporter(enabled=False, follow=found.append) as reporter:
        reporter.expected_end = expected
        reporter.stage("burst")
        reporter.burst(SimpleNamespace(**{**vars(BURST), "end_time": None, "seconds_left": None}))
        assert (found[-1].share, words in found[-1].detail) == (pytest.approx(share), True)


def test_a_run_says_that_it_compiles(monkeypatch):
    """Numba's own events: a kernel that is compiled is announced once, whatever it calls, and the stage goes on."""
    import numba

    found = []
    with ProgressReporter(enabled=False, follow=found.append) as reporter:
        reporter.stage("burst")
        reporter.burst(BURST)
        inner = numba.njit(lambda x: x + 1.0)
        assert numba.njit(lambda x: 2.0 * inner(x))(1.0) == 4.0
        reporter.burst(BURST)
    details = [one.detail for one in found]
    assert details.count(COMPILING) == 1
    at = details.index(COMPILING)
    assert found[at].seconds_left is None
    assert found[at + 1] == found[at - 1], "what was said before stands again"
    numba.njit(lambda x: x - 1.0)(1.0)
    assert len(found) == len(details), "nothing is watched after the run"


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_it_is_closed_on_errors(error, monkeypatch, capsys):
    _as_terminal(monkeypatch)
    reporter = ProgressReporter(enabled=True)

    def fail():
        with reporter:
            reporter.stage("burst")
            raise error

    with pytest.raises(error):
        fail()
    assert "\x1b[?25h" in capsys.readouterr().err
    reporter.burst(BURST)  # late news after the end is of no harm


class OurWarning(UserWarning):
    """One of our own kinds."""


def test_the_log_keeps_messages_and_warnings_and_stderr_shows_what_concerns_the_user(tmp_path, capsys):
    path = tmp_path / "run.log"
    with to_stderr(quiet=False), logged(path, fresh=True), warnings.catch_warnings():
        warnings.simplefilter("always")
        logging.getLogger("flight.anything").info("a step")
        logging.getLogger("burst_fenicsx").warning("look here")
        warnings.warn("the table ends", OurWarning, stacklevel=1)
        warnings.warn("old spelling", DeprecationWarning, stacklevel=1)
    assert capsys.readouterr().err == "warning: look here\nwarning: the table ends\n"
    text = path.read_text()
    for part in ("INFO", "flight.anything: a step", "WARNING", "look here", "the table ends", "old spelling"):
        assert part in text
    logging.getLogger("flight").warning("after the run")
    with logged(path, fresh=False):
        logging.getLogger("flight").info("second")
    assert "after the run" not in path.read_text()
    assert "a step" in path.read_text()
    with logged(path, fresh=True):
        pass
    assert path.read_text() == ""


def test_a_library_that_captures_warnings_while_it_loads_takes_none_of_ours(tmp_path, capsys):
    """As ffcx does when the burst loads it: they would be no warnings of ours any more, neither shown nor recorded."""
    before, capture = warnings.showwarning, logging.captureWarnings
    first, second = to_stderr(quiet=False), logged(tmp_path / "run.log", fresh=True)
    first.__enter__()
    second.__enter__()
    logging.captureWarnings(capture=True)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.warn("cells too coarse", OurWarning, stacklevel=1)
        second.__exit__(None, None, None)
        warnings.warn("fragments too fast", OurWarning, stacklevel=1)
    first.__exit__(None, None, None)
    assert capsys.readouterr().err == "warning: cells too coarse\nwarning: fragments too fast\n"
    assert "cells too coarse" in (tmp_path / "run.log").read_text()
    assert "fragments too fast" not in (tmp_path / "run.log").read_text()
    assert (warnings.showwarning, logging.captureWarnings) == (before, capture)


def test_quiet_shows_errors_only(capsys):
    with to_stderr(quiet=True):
        logging.getLogger("fragfield").warning("doubtful")
        logging.getLogger("fragfield").error("wrong")
    assert capsys.readouterr().err == "error: wrong\n"
