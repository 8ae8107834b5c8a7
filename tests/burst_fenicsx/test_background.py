"""Files written on a thread of their own: one piece after the other, errors raised where the burst waits."""

from __future__ import annotations

import threading
import time

import pytest

from burst_fenicsx.files.output import Background


def test_one_piece_at_a_time_beside_the_caller():
    work, opened, done = Background(), threading.Event(), []

    def first():
        opened.wait(60.0)
        done.append(threading.current_thread())

    work.begin(first)  # does not wait: else the event is never set
    assert not done
    opened.set()
    work.begin(lambda: done.append(2))
    assert done[0] is not threading.main_thread()
    work.wait()
    assert done[1:] == [2]
    work.close()
    assert not any(thread.name.startswith("files") for thread in threading.enumerate())


@pytest.mark.parametrize("call", ["begin", "wait"])
def test_an_error_is_raised_once_where_the_next_waits(call):
    work, after = Background(), []

    def fails():
        raise OSError("disk full")

    work.begin(fails)
    with pytest.raises(OSError, match="disk full"):
        work.wait() if call == "wait" else work.begin(lambda: after.append(1))
    assert not after
    work.wait()
    work.begin(lambda: after.append(2))
    work.close()
    assert after == [2]


def test_closing_waits_and_raises_nothing():
    work = Background()

    def fails():
        raise OSError("disk full")

    work.begin(fails)
    work.close()
    assert not any(thread.name.startswith("files") for thread in threading.enumerate())


def test_a_checkpoint_comes_after_the_outputs_before_it(tmp_path, monkeypatch):
    """However slowly they are written: a burst that goes on from it drops none and writes none twice."""
    pytest.importorskip("burst_fenicsx.compat")
    from burst_fenicsx import simulation
    from burst_fenicsx.files.output import TimeSeries
    from burst_fenicsx.run_burst import simulate
    from tests.burst_fenicsx.tubes import SETTINGS, tube

    write, keep, seen = TimeSeries.write, simulation.write_checkpoint, []

    def slowly(series, *arguments, **named):
        time.sleep(0.5)
        write(series, *arguments, **named)
        seen.append(series.times[-1])

    def checkpoint(path, solver, *arguments, **named):
        seen.append(("checkpoint", 1e-5 * round(solver.time / 1e-5)))  # the first step from there on
        keep(path, solver, *arguments, **named)

    monkeypatch.setattr(TimeSeries, "write", slowly)
    monkeypatch.setattr(simulation, "write_checkpoint", checkpoint)
    monkeypatch.setattr(simulation, "_CHECKPOINT_SECONDS", 0.0)
    simulate([tube()], SETTINGS, tmp_path)
    kept = [pytest.approx(1e-5), ("checkpoint", 1e-5), pytest.approx(2e-5), ("checkpoint", 2e-5)]
    assert seen == [0.0, *kept]
